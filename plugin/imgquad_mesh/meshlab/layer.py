"""A layer of a MeshSet as plain arrays, and the way it travels: exactly, with its polygons.

pymeshlab's constructor for polygons goes through float32 and its face attributes then crash some filters; its own PLY
has triangles only. A binary PLY in double precision written here loads without loss: coordinates, quads and their
order, colours, values.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Bytes, Floats, Ints, Labels
from imgquad_core.writers.ply import ply_bytes


@dataclass(frozen=True, eq=False)
class Layer:
    """One mesh of a MeshSet.

    Parameters
    ----------
    points : float64, shape (n_points, 3)
        Coordinates.
    face_offsets : int64, shape (n_faces + 1,)
        Face f has the corners ``face_points[face_offsets[f]:face_offsets[f + 1]]``.
    face_points : int64
        Ids of points.
    edges : int64, shape (n_edges, 2)
        Edges of a polyline; empty for a surface.
    face_color, point_color : uint8, shape (n, 4), optional
        RGBA.
    face_scalar, point_scalar : float64, shape (n,), optional
        MeshLab's "quality".
    material : int32, shape (n_faces,), optional
        Material of each face.
    label : str
        Name of the layer.
    """

    points: Floats
    face_offsets: Ints
    face_points: Ints
    edges: Ints
    face_color: Bytes | None = None
    point_color: Bytes | None = None
    face_scalar: Floats | None = None
    point_scalar: Floats | None = None
    material: Labels | None = None
    label: str = ""

    @property
    def n_faces(self) -> int:
        """Number of faces."""
        return len(self.face_offsets) - 1

    @property
    def face_sizes(self) -> Ints:
        """Number of corners of each face."""
        return np.diff(self.face_offsets)


def surface(points: Floats, faces: NDArray[Any], **arrays: Any) -> Layer:
    """Return a layer of faces with the same number of corners each; `points` of two or three columns."""
    deep = np.zeros((len(points), 3))
    deep[:, : points.shape[1]] = points
    offsets = np.arange(len(faces) + 1, dtype=np.int64) * faces.shape[1]
    return Layer(deep, offsets, faces.astype(np.int64).ravel(), np.empty((0, 2), np.int64), **arrays)


def polyline(points: Floats, edges: Ints, **arrays: Any) -> Layer:
    """Return a layer of edges; `points` of two or three columns."""
    deep = np.zeros((len(points), 3))
    deep[:, : points.shape[1]] = points
    return Layer(deep, np.zeros(1, np.int64), np.empty(0, np.int64), edges.astype(np.int64), **arrays)


def save_layer(layer: Layer, path: Path) -> None:
    """Write the arrays of a layer into an NPZ file."""
    arrays = {f.name: getattr(layer, f.name) for f in fields(layer)}
    with path.open("wb") as file:
        np.savez(file, **{name: value for name, value in arrays.items() if value is not None})


def load_layer(path: Path) -> Layer:
    """Read what `save_layer` wrote."""
    with np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    return Layer(**{**arrays, "label": str(arrays["label"])})


def write_ply(layer: Layer, path: Path) -> None:
    """Write a layer as binary PLY in double precision, polygons as they are.

    Parameters
    ----------
    layer : Layer
        What to write; `material` becomes an integer property of the faces that MeshLab ignores.
    path : Path
        The file; it is overwritten.
    """
    corners = (layer.face_offsets, layer.face_points)
    comment = " ".join(layer.label.split()) or "imgquad-mesh"
    path.write_bytes(ply_bytes(comment, _of_points(layer), corners, _of_faces(layer), layer.edges))


def _color_columns(color: Bytes | None) -> dict[str, NDArray[Any]]:
    return {} if color is None else dict(zip(("red", "green", "blue", "alpha"), color.T, strict=True))


def _of_points(layer: Layer) -> dict[str, NDArray[Any]]:
    columns: dict[str, NDArray[Any]] = dict(zip("xyz", layer.points.T, strict=True)) | _color_columns(layer.point_color)
    return columns if layer.point_scalar is None else columns | {"quality": layer.point_scalar}


def _of_faces(layer: Layer) -> dict[str, NDArray[Any]]:
    columns = _color_columns(layer.face_color)
    if layer.face_scalar is not None:
        columns["quality"] = layer.face_scalar
    if layer.material is not None:
        columns["material"] = layer.material.astype(np.int32)
    return columns


class Faces(NamedTuple):
    """The faces of a ``pymeshlab.Mesh``, and where they lie among its triangles.

    Parameters
    ----------
    offsets, corners : int64
        Face f has the corners ``corners[offsets[f]:offsets[f + 1]]``.
    triangles : int32, shape (n_triangles, 3)
        As MeshLab has them.
    first : int64, shape (n_faces,)
        One triangle of each face.
    """

    offsets: Ints
    corners: Ints
    triangles: Labels
    first: Ints


def layer_of(mesh: Any, faces: Faces | None = None) -> Layer:
    """Take the arrays out of a ``pymeshlab.Mesh``.

    Parameters
    ----------
    mesh : pymeshlab.Mesh
        Made compact if it is not.
    faces : Faces, optional
        Its faces where they are known, from `faces_of`.

    Returns
    -------
    Layer
        Coordinates with the layer's transformation applied; quads in order and with their first corner first.
    """
    faces = faces_of(mesh) if faces is None else faces
    some, first = len(faces.first) > 0, faces.first
    return Layer(
        points=np.array(mesh.transformed_vertex_matrix()),
        face_offsets=faces.offsets,
        face_points=faces.corners,
        edges=np.array(mesh.edge_matrix(), np.int64).reshape(-1, 2),
        face_color=_bytes(mesh.face_color_matrix()[first]) if mesh.has_face_color() and some else None,
        point_color=_bytes(mesh.vertex_color_matrix()) if mesh.has_vertex_color() else None,
        face_scalar=np.array(mesh.face_scalar_array())[first] if mesh.has_face_scalar() and some else None,
        point_scalar=np.array(mesh.vertex_scalar_array()) if mesh.has_vertex_scalar() else None,
        material=_material(mesh, first),
        label=str(mesh.label()),
    )


def faces_of(mesh: Any) -> Faces:
    """Take the faces out of a ``pymeshlab.Mesh``, which is made compact if it is not."""
    if not mesh.is_compact():
        mesh.compact()
    faces, triangles = mesh.polygonal_face_list(), _triangles(mesh)
    sizes = np.fromiter(map(len, faces), np.int64, len(faces))
    if sizes.sum() - 2 * len(faces) != len(triangles):  # a filter has left half a polygon behind
        sizes, corners = np.full(len(triangles), 3), triangles.astype(np.int64).ravel()
    else:
        corners = np.concatenate(faces).astype(np.int64) if faces else np.empty(0, np.int64)
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    last = offsets[1:][sizes == 4] - 1  # pymeshlab begins quads at their second corner
    corners[last[:, None] - [3, 2, 1, 0]] = corners[last[:, None] - [0, 3, 2, 1]]
    return Faces(offsets, corners, triangles, _triangle_of_face(offsets, corners, triangles))


def known_faces(mesh: Any, layer: Layer) -> Faces | None:
    """Return the faces of a mesh that was made of `layer`; None unless all are quads in order, two triangles each."""
    triangles = _triangles(mesh)
    if not _in_pairs(layer.face_offsets, layer.face_points, triangles):
        return None
    first = _triangle_of_face(layer.face_offsets, layer.face_points, triangles)
    return Faces(layer.face_offsets, layer.face_points, triangles, first)


def has_triangles(mesh: Any, faces: Faces) -> bool:
    """Whether the triangles of a mesh are still those of `faces`."""
    return bool(mesh.is_compact()) and np.array_equal(_triangles(mesh), faces.triangles)


def _triangles(mesh: Any) -> Labels:
    return np.array(mesh.face_matrix(), np.int32).reshape(-1, 3)


def _bytes(color: Floats) -> Bytes:
    return np.asarray(np.rint(color * 255), np.uint8)


def _material(mesh: Any, first: Ints) -> Labels | None:
    try:
        values = np.asarray(mesh.face_custom_scalar_attribute_array("material"))
    except Exception:  # pymeshlab cannot be asked whether there is such an attribute
        return None
    return np.asarray(np.rint(values[first]), np.int32)


def _triangle_of_face(offsets: Ints, corners: Ints, triangles: NDArray[Any]) -> Ints:
    """Return for each face the one of MeshLab's triangles that has the face's first directed edge."""
    if len(triangles) == 0:
        return np.empty(0, np.int64)
    start, end = corners[offsets[:-1]], corners[offsets[:-1] + 1]
    if _in_pairs(offsets, corners, triangles):
        return 2 * np.arange(len(start)) + ~_have_edge(triangles[::2], start, end)
    n = int(triangles.max()) + 1
    keys = _directed_keys(triangles, n)
    order = np.argsort(keys, kind="stable")
    wanted = start * n + end
    at = np.searchsorted(keys[order], wanted).clip(max=len(keys) - 1)
    return np.asarray(order[at] // 3)


def face_of_triangle(layer: Layer, triangles: NDArray[Any]) -> Ints:
    """Return the face of `layer` that each of MeshLab's triangles belongs to: one of its edges is one of the face's.

    ::

        3-------2      triangles (0, 1, 2) and (0, 2, 3) of the quad share the diagonal only;
        |     / |      each has two directed edges of the quad
        |   /   |
        | /     |
        0-------1
    """
    if len(triangles) == 0:
        return np.empty(0, np.int64)
    if _in_pairs(layer.face_offsets, layer.face_points, triangles):
        return np.arange(len(triangles)) // 2
    n = len(layer.points)
    after = np.arange(1, len(layer.face_points) + 1)
    after[layer.face_offsets[1:] - 1] = layer.face_offsets[:-1]
    keys = layer.face_points * n + layer.face_points[after]
    owner = np.repeat(np.arange(layer.n_faces), layer.face_sizes)
    order = np.argsort(keys, kind="stable")
    wanted = _directed_keys(triangles, n).reshape(-1, 3)
    at = np.searchsorted(keys[order], wanted).clip(max=len(keys) - 1)
    found = keys[order][at] == wanted
    return np.asarray(owner[order[at[np.arange(len(triangles)), np.argmax(found, axis=1)]]])


def _directed_keys(triangles: NDArray[Any], n_points: int) -> Ints:
    """Return a number for each directed edge, three a triangle in order."""
    wide = triangles.astype(np.int64)
    return (wide * n_points + np.roll(wide, -1, axis=1)).ravel()


def _have_edge(triangles: NDArray[Any], start: Ints, end: Ints) -> NDArray[np.bool_]:
    """Tell of each triangle whether it has the directed edge from `start` to `end`."""
    pairs = ((0, 1), (1, 2), (2, 0))
    found = [(triangles[:, a] == start) & (triangles[:, b] == end) for a, b in pairs]
    return np.asarray(np.logical_or.reduce(found))


def _in_pairs(offsets: Ints, corners: Ints, triangles: NDArray[Any]) -> bool:
    """Whether all faces are quads and triangles 2f and 2f + 1 each have two neighbouring edges of quad f."""
    n = len(offsets) - 1
    if len(corners) != 4 * n or len(triangles) != 2 * n or (np.diff(offsets) != 4).any():
        return False
    q = corners.reshape(-1, 4).T
    one, two = (
        [_have_edge(half, q[k], q[(k + 1) % 4]) for k in range(4)] for half in (triangles[::2], triangles[1::2])
    )
    ways = [one[k] & one[(k + 1) % 4] & two[(k + 2) % 4] & two[(k + 3) % 4] for k in range(4)]
    return bool(np.logical_or.reduce(ways).all())
