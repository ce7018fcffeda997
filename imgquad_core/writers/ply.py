"""The bytes of a Stanford file (``.ply``, binary little endian), of faces and edges of any kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Ints

Columns: TypeAlias = Mapping[str, NDArray[Any]]

_TYPES = {"<f8": "double", "|u1": "uchar", "<i4": "int"}  # NumPy's name of a type -> PLY's
_LIST = "property list uchar int vertex_indices"


def ply_bytes(
    comment: str, points: Columns, corners: tuple[Ints, Ints], of_faces: Columns, edges: Ints | None = None
) -> bytes:
    """Return the file of points, polygons and edges.

    Parameters
    ----------
    comment : str
        One line.
    points : mapping of str to array, shape (n_points,)
        Properties of the points, float64, uint8 or int32; x, y and z among them.
    corners : int64, shape (n_faces + 1,), and int64
        Face f has the corners ``corners[1][corners[0][f]:corners[0][f + 1]]``.
    of_faces : mapping of str to array, shape (n_faces,)
        Properties of the faces.
    edges : int64, shape (n_edges, 2), optional
        Pairs of points.
    """
    vertices, n_faces = _records(points), len(corners[0]) - 1
    header = ["ply", "format binary_little_endian 1.0", f"comment {comment}"]
    header += [f"element vertex {len(vertices)}", *_properties(vertices.dtype)]
    body = vertices.tobytes()
    if n_faces:
        extra = _records(of_faces, n_faces)
        header += [f"element face {n_faces}", _LIST, *_properties(extra.dtype)]
        body += _faces(*corners, extra)
    if edges is not None and len(edges):
        header += [f"element edge {len(edges)}", "property int vertex1", "property int vertex2"]
        body += edges.astype("<i4").tobytes()
    return "\n".join([*header, "end_header", ""]).encode("ascii", "replace") + body


def _properties(dtype: np.dtype[Any]) -> list[str]:
    return [f"property {_TYPES[dtype[name].str]} {name}" for name in dtype.names or ()]


def _records(columns: Columns, n: int | None = None) -> NDArray[Any]:
    count = n if n is not None else len(next(iter(columns.values())))
    records = np.empty(count, [(name, values.dtype.newbyteorder("<")) for name, values in columns.items()])
    for name, values in columns.items():
        records[name] = values
    return records


def _faces(offsets: Ints, points: Ints, extra: NDArray[Any]) -> bytes:
    """Return the records of faces: they differ in length, so all of one number of corners are put in their places."""
    sizes = np.diff(offsets)
    starts = np.concatenate([[0], np.cumsum(1 + 4 * sizes + extra.dtype.itemsize)])
    out = np.empty(int(starts[-1]), np.uint8)
    for size in np.unique(sizes):
        rows = np.flatnonzero(sizes == size)
        records = np.empty(len(rows), [("n", "u1"), ("corners", "<i4", (int(size),)), ("extra", extra.dtype)])
        records["n"] = size
        records["corners"] = points[offsets[rows, None] + np.arange(size)]
        records["extra"] = extra[rows]
        length = records.dtype.itemsize
        out[starts[rows, None] + np.arange(length)] = records.view(np.uint8).reshape(len(rows), length)
    return out.tobytes()
