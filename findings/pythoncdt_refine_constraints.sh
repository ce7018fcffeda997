#!/usr/bin/env bash
# pythoncdt 2.0.2: `refine_triangles` splits constraint edges, and nothing keeps them while the inside is refined.
#
# Expected, as of Triangle with `-YY`: a way to refine a face by area whose rim stays as it is, because the face beyond is meshed
# alone. The parameter `min_edge_length` looks like one.
# Seen, in a square of side 4 with 4 constraints, refined to an area of 0.1:
#     min_edge_length 0: 142 vertices, 34 constraint edges
#     min_edge_length inf: 4 vertices, 4 constraint edges
# Without a limit the rim is split into 34 edges; with one, no triangle that has a shorter edge is refined at all.
# We place points inside ourselves, at centroids (`mesher/triangulation.py`).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check pythoncdt==2.0.2 "numpy<3"
"$folder/bin/python" - <<'P'
import math

import numpy as np
import pythoncdt as cdt

square = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])
around = np.array([[0, 1], [1, 2], [2, 3], [3, 0]], np.uintc)


def refined(shortest):
    mesh = cdt.Triangulation(cdt.VertexInsertionOrder.AUTO, cdt.IntersectingConstraintEdges.NOT_ALLOWED, 0.0)
    mesh.insert_vertices(square)
    mesh.insert_edges(around)
    outside = mesh.collect_outer_triangles()
    mesh.refine_triangles(1000, cdt.RefinementCriterion.LARGEST_AREA, 0.1, outside, shortest)
    mesh.finalize_triangulation(outside)
    print(f"min_edge_length {shortest:g}: {mesh.vertices_count()} vertices, {mesh.fixed_edges_count()} constraint edges")
    return mesh.vertices_count(), mesh.fixed_edges_count()


free, limited = refined(0.0), refined(math.inf)
if not (free[1] > 4 and limited == (4, 4)):
    raise SystemExit("changed: look again whether faces can be refined with their rim kept")
print("still so: the rim is split, or nothing is refined")
P
