"""The mesh of a tile's faces, and what is done to it afterwards."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.errors import TopologyError
from imgquad_core.geometry.halfedge import twins_of
from imgquad_core.mesher import MeshingOptions, fill_faces
from imgquad_core.model import VOID

from .outlines import Outlines, corner_of, graph_of


class TileMesh(NamedTuple):
    """Quads of a tile, in coordinates of the picture (px, y up from its lower edge)."""

    points: Floats  #: (n, 2)
    quads: Ints  #: (m, 4) counter-clockwise
    region: Ints  #: (m,) number in the picture
    seam: Flags  #: (n,) nodes between two pieces of one region


class Patch(NamedTuple):
    """What takes the place of some quads of a tile."""

    gone: Ints  #: their places
    points: Floats
    quads: Ints
    region: Ints


class Made(NamedTuple):
    """A mesh, and on which stride each face was meshed."""

    mesh: TileMesh
    stride: Ints
    fell: Flags  #: those that were worse on a wider one


def mesh_outlines(outlines: Outlines, n_rows: int, options: MeshingOptions, widest: Ints, is_cut: Flags) -> Made | None:
    """Mesh the faces of a tile; None where they cannot be filled.

    Parameters
    ----------
    outlines : Outlines
        From `settled`.
    n_rows : int
        Of the picture.
    options : MeshingOptions
        How faces are filled.
    widest : int64, shape (n_faces,)
        Stride that each is meshed on at most.
    is_cut : bool, shape (n_faces,)
        Pieces of regions: one that is worse on a wide stride has decided for the region.
    """
    none = np.empty(0, np.int64)
    if len(outlines.region) == 0:
        return Made(TileMesh(np.empty((0, 2)), none.reshape(0, 4), none, np.empty(0, bool)), none, np.empty(0, bool))
    try:
        mesh, stride, fell = fill_faces(graph_of(outlines, n_rows), options, widest=widest, once=is_cut)
    except TopologyError:
        return None
    seam = np.zeros(mesh.n_points, bool)
    for c in np.flatnonzero(outlines.seam):
        seam[mesh.chain_points[mesh.chain_offsets[c] : mesh.chain_offsets[c + 1]]] = True
    made = TileMesh(mesh.points + corner_of(outlines, n_rows), mesh.quads, outlines.region[mesh.quad_region], seam)
    return Made(made, stride, fell)


def patched(mesh: TileMesh, patches: list[Patch]) -> TileMesh:
    """Return a mesh with some of its quads replaced; nodes at the same place are one."""
    if not patches:
        return mesh
    kept = np.ones(len(mesh.quads), bool)
    for patch in patches:
        kept[patch.gone] = False
    shift = np.cumsum([len(mesh.points), *(len(patch.points) for patch in patches)])
    quads = [mesh.quads[kept], *(patch.quads + s for patch, s in zip(patches, shift, strict=False))]
    points = np.concatenate([mesh.points, *(patch.points for patch in patches)])
    seam = np.append(mesh.seam, np.zeros(len(points) - len(mesh.points), bool))
    region = np.concatenate([mesh.region[kept], *(patch.region for patch in patches)])
    near = np.ones(len(points), bool)
    near[: len(mesh.points)] = _within(mesh.points, [patch.points for patch in patches if len(patch.points)])
    return welded(TileMesh(points, np.concatenate(quads), region, seam), near)


def _within(points: Floats, others: list[Floats]) -> Flags:
    """Tell the points within the bounds of one of several others."""
    found = np.zeros(len(points), bool)
    for other in others:
        found |= ((points >= other.min(axis=0)) & (points <= other.max(axis=0))).all(axis=1)
    return found


def welded(mesh: TileMesh, near: Flags | None = None) -> TileMesh:
    """Return a mesh with one node at each place that quads use, in the order that nodes come first.

    Places of several nodes are among those `near` only, by default anywhere.
    """
    used = np.zeros(len(mesh.points), bool)
    used[mesh.quads] = True
    ids = np.flatnonzero(used if near is None else used & near)
    first, node = same_places(mesh.points[ids])
    one, seam = np.arange(len(mesh.points)), mesh.seam.copy()
    one[ids] = ids[first][node]
    seam[one[ids[mesh.seam[ids]]]] = True
    kept = used & (one == np.arange(len(one)))
    new = np.cumsum(kept) - 1
    return TileMesh(mesh.points[kept], new[one[mesh.quads]], mesh.region, seam[kept])


def part_of(mesh: TileMesh, which: Flags) -> TileMesh:
    """Return some quads of a mesh and their nodes."""
    used = np.zeros(len(mesh.points), bool)
    used[mesh.quads[which]] = True
    new = np.cumsum(used) - 1
    return TileMesh(mesh.points[used], new[mesh.quads[which]], mesh.region[which], mesh.seam[used])


def same_places(points: Floats) -> tuple[Ints, Ints]:
    """Return the first of the points at each place, in their order, and the place of each point: equal to the bit."""
    _, first, node = np.unique(bits_of(points), return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return first[order], rank[node.ravel()]


def bits_of(points: Floats) -> NDArray[np.complex128]:
    """Return each point as one value: to sort, and to compare to the bit."""
    return np.ascontiguousarray(points, np.float64).view(np.complex128).ravel()


def joined_meshes(meshes: list[TileMesh]) -> tuple[TileMesh, Ints]:
    """Put tiles together; return also which one each quad is of."""
    shift = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    whole = TileMesh(
        np.concatenate([mesh.points for mesh in meshes]),
        np.concatenate([mesh.quads + s for mesh, s in zip(meshes, shift, strict=False)]),
        np.concatenate([mesh.region for mesh in meshes]),
        np.concatenate([mesh.seam for mesh in meshes]),
    )
    return welded(whole), np.repeat(np.arange(len(meshes)), [len(mesh.quads) for mesh in meshes])


def open_nodes(mesh: TileMesh) -> Ints:
    """Return the nodes on edges with a quad on one side only: those that other tiles may have, too."""
    if len(mesh.quads) == 0:
        return np.empty(0, np.int64)
    twins = twins_of(mesh.quads, len(mesh.points))
    h = np.flatnonzero(twins == VOID)
    corners = mesh.quads.ravel()
    return np.asarray(np.unique(np.concatenate([corners[h], np.roll(mesh.quads, -1, axis=1).ravel()[h]])))
