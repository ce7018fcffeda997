"""Edges of shared chains halved in a mesh that is there: what lies near them is filled anew, all else stays.

    |-- as it was --|-- 14 quads: cleaned up --| rim |-- filled anew --| chain with halved edges

The faces of a chain may be pieces of a matrix with a million quads; a poor quad beside one grain needs but its
surroundings. Nodes of boundaries stay to the bit, so neighbours that do the same still fit.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Bytes, Flags, Floats, Ints, Labels
from imgquad_core.chains import edges_of_chains, with_mid_points
from imgquad_core.cleanup.strips import nodes_around
from imgquad_core.errors import TopologyError
from imgquad_core.measures.quality import quad_areas, scaled_jacobian
from imgquad_core.mesher import MeshingOptions, fill_faces
from imgquad_core.mesher.strides import near_seams
from imgquad_core.model import BoundaryGraph, Materials, PointKind, QuadMesh
from imgquad_core.tracing import trace_mesh

from .bands import SEEDS, cleaned, rim_of
from .grid import BAND
from .meshes import Patch, TileMesh, bits_of, patched
from .outlines import EdgesOf, Outlines

RINGS = (12, 16, 24)  #: quads beside halved edges that are filled anew; more where a rim has an odd number of edges
MARGIN = 4.0  #: px that keep what is filled anew away from the border of its own small picture


class Edges(NamedTuple):
    """Edges of a boundary by the places of their ends, px."""

    tails: Floats  #: (n, 2)
    heads: Floats  #: (n, 2)


class _Cut(NamedTuple):
    """What is filled anew."""

    gone: Ints  #: places of its quads
    graph: BoundaryGraph  #: its boundary, edges halved, in a small picture of its own
    points: Floats  #: (n, 2) the boundary's, where they are in the picture
    corner: Floats  #: (2,) of the small picture
    region: Ints  #: of each of its faces


def wished_edges(mesh: TileMesh, outlines: Outlines, worst: float, reach: int) -> Ints:
    """Return the edges of shared chains that a tile would halve for poor quads: rows of a chain's key and an edge.

    Those are the four of each segment of stride 4 (else two) that such a quad touches, and `reach` segments before and
    after; seams count for nothing, as they will be gone.
    """
    poor = scaled_jacobian(mesh.points, mesh.quads) <= worst
    poor[poor] = ~near_seams(mesh.quads, mesh.seam)[poor]
    touched = np.unique(bits_of(mesh.points[mesh.quads[poor].ravel()]))
    found = [no_edges()]
    for c in np.flatnonzero(outlines.shared & ~outlines.seam) if len(touched) else ():
        points = outlines.points[outlines.ids[outlines.offsets[c] : outlines.offsets[c + 1]]]
        inner = points if outlines.closed[c] else points[1:-1]
        at = np.flatnonzero(np.isin(bits_of(inner), touched)) + (0 if outlines.closed[c] else 1)
        edges = _edges_beside(at, len(points) - 1, reach)
        found.append(np.column_stack([np.tile(outlines.key[c], (len(edges), 1)), edges]))
    return np.concatenate(found)


def no_edges() -> Ints:
    """Return no edge at all, as `wished_edges` does."""
    return np.empty((0, 5), np.int64)


def all_edges(outlines: Outlines) -> Ints:
    """Return all edges of shared chains, as `wished_edges` does: of a tile that cannot be meshed without."""
    counts = np.diff(outlines.offsets)[outlines.shared] - 1
    places = np.concatenate([np.empty(0, np.int64), *map(np.arange, counts)])
    return np.column_stack([np.repeat(outlines.key[outlines.shared], counts, axis=0), places])


def _edges_beside(at: Ints, n_edges: int, reach: int) -> Ints:
    """Return the edges of the segments around some places of a chain."""
    stride = 4 if n_edges % 4 == 0 else 2
    is_wished = np.zeros(n_edges // stride, bool)
    for place in at.tolist():
        first, last = (place - 1) // stride - reach, place // stride + reach  # between two segments: both
        is_wished[max(first, 0) : last + 1] = True
    return np.flatnonzero(np.repeat(is_wished, stride))


def edges_of(outlines: Outlines, which: EdgesOf) -> Edges:
    """Return some edges of shared chains, given by the chains' keys."""
    tails, heads = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for c in np.flatnonzero(outlines.shared):
        edges = sorted(which.get(tuple(outlines.key[c].tolist()), ()))
        ids = outlines.ids[outlines.offsets[c] : outlines.offsets[c + 1]]
        tails.append(ids[edges])
        heads.append(ids[1:][edges])
    return Edges(outlines.points[np.concatenate(tails)], outlines.points[np.concatenate(heads)])


def with_edges_halved(mesh: TileMesh, edges: Edges, outlines: Outlines, options: MeshingOptions) -> TileMesh | None:
    """Return the mesh with edges of its boundary halved.

    Parameters
    ----------
    mesh : TileMesh
        Of a tile.
    edges : Edges
        On its boundary.
    outlines : Outlines
        Of the tile: what its faces are made of.
    options : MeshingOptions
        How faces are filled.

    Returns
    -------
    TileMesh or None
        None where that does not do: the tile must be meshed as a whole.
    """
    if not len(edges.tails):
        return mesh
    ends, is_beside = _found(mesh, edges)
    for rings in RINGS:
        cut = _cut_out(mesh, ends, is_beside, rings, outlines)
        if (edges_of_chains(cut.graph) % 2 == 0).all():
            break
    else:
        return None
    try:
        made = fill_faces(cut.graph, options, widest=np.full(len(cut.region), 2)).mesh
    except TopologyError:
        return None
    points = made.points + cut.corner
    points[: len(cut.points)] = cut.points
    whole = patched(mesh, [Patch(cut.gone, points, made.quads, cut.region[made.quad_region])])
    whole = _cleaned_around(whole, np.arange(len(whole.quads) - made.n_quads, len(whole.quads)))
    seam = np.zeros(len(whole.points), bool)
    seam[_nodes_at(whole, mesh.points[mesh.seam])] = True
    return whole._replace(seam=seam)


def _found(mesh: TileMesh, edges: Edges) -> tuple[Ints, Flags]:
    """Return the ends of edges as nodes, shape (n, 2), and which quads are beside them."""
    ends = _nodes_at(mesh, np.concatenate([edges.tails, edges.heads])).reshape(2, -1).T
    is_end = np.zeros(len(mesh.points), bool)
    is_end[ends] = True
    near = np.flatnonzero(is_end[mesh.quads].sum(axis=1) >= 2)
    sides = np.stack([mesh.quads[near], np.roll(mesh.quads[near], -1, axis=1)], axis=-1).reshape(-1, 2)
    beside = np.zeros(len(mesh.quads), bool)
    beside[near] = np.isin(_names(sides, len(mesh.points)), _names(ends, len(mesh.points))).reshape(-1, 4).any(axis=1)
    return ends, beside


def _nodes_at(mesh: TileMesh, places: Floats) -> Ints:
    """Return the node at each place; there must be one."""
    nodes = np.flatnonzero(np.isin(mesh.points[:, 0], places[:, 0]))
    bits, first = np.unique(bits_of(mesh.points[nodes]), return_index=True)
    found: Ints = nodes[first[np.searchsorted(bits, bits_of(places))]]
    return found


def _names(edges: Ints, n: int) -> Ints:
    """Return one number for each edge of n nodes, whichever way it runs."""
    return np.asarray(edges.min(axis=1) * n + edges.max(axis=1))


def _cut_out(mesh: TileMesh, ends: Ints, is_beside: Flags, rings: int, outlines: Outlines) -> _Cut:
    """Return what is filled anew: quads around edges, in the faces beside these only."""
    gone = _around(mesh, is_beside, rings)
    used, corners = np.unique(mesh.quads[gone], return_inverse=True)
    regions, number = np.unique(mesh.region[gone], return_inverse=True)
    nobody = Materials(np.arange(len(regions)), tuple(map(str, regions)), np.zeros((len(regions), 3), np.uint8))
    traced = trace_mesh(mesh.points[used], corners.reshape(-1, 4), number, nobody)
    here = used[traced.chain_points]
    sides = np.stack([here, np.roll(here, -1)], axis=1)  # the last one of each chain is no edge, and not looked at
    split = np.isin(_names(sides, len(mesh.points)), _names(ends, len(mesh.points)))
    region = regions[traced.region_label]
    label = dict(zip(outlines.region.tolist(), outlines.label.tolist(), strict=True))
    finer = with_mid_points(_boundary_of(traced, np.array([label[r] for r in region.tolist()], np.int32)), split)
    corner = np.floor(finer.points.min(axis=0)) - MARGIN
    small = replace(
        finer, points=finer.points - corner, shape=_shape_of(finer.points - corner), point_kind=_held(finer, traced)
    )
    return _Cut(gone, small, finer.points, corner, region)


def _around(mesh: TileMesh, is_beside: Flags, rings: int) -> Ints:
    """Return the quads around some of them, none across a boundary."""
    faces = np.unique(mesh.region[is_beside])
    quads = np.flatnonzero(np.isin(mesh.region, faces))
    face = np.searchsorted(faces, mesh.region[quads])
    apart, corners = np.unique(mesh.quads[quads] * len(faces) + face[:, None], return_inverse=True)
    corners = corners.reshape(-1, 4)
    near = np.zeros(len(apart), bool)
    near[corners[is_beside[quads]]] = True
    taken: Ints = quads[nodes_around(corners, near, rings)[corners].all(axis=1)]
    return taken


def _boundary_of(traced: QuadMesh, label: Labels) -> BoundaryGraph:
    """Return the chains of a mesh, whose points may all be moved."""
    ids, chain_points = np.unique(traced.chain_points, return_inverse=True)
    areas = np.bincount(traced.quad_region, quad_areas(traced.points, traced.quads), len(label))
    pixels = np.maximum(areas, 1.0).astype(np.int64)
    points, kind = traced.points[ids], np.zeros(len(ids), np.uint8)
    return BoundaryGraph(
        points, kind, traced.chain_offsets, chain_points.ravel(), traced.chain_regions, label, pixels, _shape_of(points)
    )


def _shape_of(points: Floats) -> tuple[int, int]:
    """Return rows and columns of a picture with these points and a margin."""
    columns, rows = np.ceil(points.max(axis=0) + MARGIN).astype(int).tolist()
    return rows, columns


def _held(finer: BoundaryGraph, traced: QuadMesh) -> Bytes:
    """Return the kinds of points that all stay: those of a mesh's boundary, and mid-points after them."""
    old = traced.point_kind[np.unique(traced.chain_points)]
    kind = np.full(len(finer.points), PointKind.HELD, np.uint8)
    stays = np.flatnonzero(np.isin(old, (PointKind.JUNCTION, PointKind.CORNER)))
    kind[stays] = old[stays]
    return kind


def _cleaned_around(mesh: TileMesh, new: Ints) -> TileMesh:
    """Clean up across the rim of quads that were filled anew."""
    rim = rim_of(mesh, new)
    if not rim.any():
        return mesh
    faces = np.isin(mesh.region, np.unique(mesh.region[new]))
    quads = np.flatnonzero(faces & nodes_around(mesh.quads, rim, BAND - 1)[mesh.quads].any(axis=1))
    return patched(mesh, [Patch(quads, *cleaned(mesh, quads, nodes_around(mesh.quads, rim, SEEDS)))])
