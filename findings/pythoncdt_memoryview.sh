#!/usr/bin/env bash
# pythoncdt 2.0.2 takes a NumPy array of vertices, but not the buffer of the same array.
#
# Expected: its stub types the parameter as `Sequence[V2d] | Buffer`, and memoryview is a buffer (and what type checkers want
# with NumPy 1, whose arrays are no `Buffer` for them): `insert_vertices(array.data)` does what `insert_vertices(array)` does.
# Seen:
#     array: 4 vertices
#     array.data: NotImplementedError: multi-dimensional sub-views are not implemented
# The memoryview is taken for a sequence of points first, and reading its items fails. NotImplementedError is a RuntimeError, like
# the errors on crossing constraints: code that catches those takes this for bad input.
# We hand over arrays, typed as Any.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check pythoncdt==2.0.2 "numpy<3"
"$folder/bin/python" - <<'P'
import numpy as np
import pythoncdt as cdt

square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def told(vertices):
    mesh = cdt.Triangulation(cdt.VertexInsertionOrder.AUTO, cdt.IntersectingConstraintEdges.NOT_ALLOWED, 0.0)
    try:
        mesh.insert_vertices(vertices)
    except RuntimeError as error:
        return f"{type(error).__name__}: {error}"
    mesh.erase_super_triangle()
    return f"{mesh.vertices_count()} vertices"


array, buffer = told(square), told(square.data)
print("array:", array)
print("array.data:", buffer)
if array != "4 vertices" or not buffer.startswith("NotImplementedError"):
    raise SystemExit("changed: the buffer is taken")
print("still so: the buffer is refused")
P
