"""A place in a mesh is filled anew, also with edges of the boundary halved; all else stays.

    |-- as it was --|-- 10 quads: cleaned up --| rim |-- 8: filled anew --| poor quads, or a boundary with halved edges

A face may be a matrix with a million quads; a poor quad beside one grain needs but its surroundings. Nodes of
boundaries stay to the bit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints, Labels
from imgquad_core.chains import with_mid_points
from imgquad_core.cleanup.areas import Area, cleaned, nameless, rim_of
from imgquad_core.cleanup.options import CleanUp
from imgquad_core.cleanup.strips import nodes_around
from imgquad_core.errors import TopologyError
from imgquad_core.measures.quality import quad_areas
from imgquad_core.model import BoundaryGraph, PointKind, QuadMesh
from imgquad_core.tracing import trace_mesh

RINGS = (8, 6, 11, 4)  #: quads around a place that are filled anew; other ones where that cannot be
SEEDS, BAND = 5, 10  #: quads on each side of the rim: irregular nodes that are looked at, and what may change
REACH = RINGS[0] + BAND  #: quads around a place beyond which all stays
PASSES = (CleanUp((40, 160), 1.0, 0.6, 160),)
MARGIN = 4.0  #: px between what is filled anew and the border of its own small picture, and between two faces there

#: fills a boundary, all points of which stay
Fill = Callable[[BoundaryGraph], QuadMesh]


class _Cut(NamedTuple):
    """The boundary of what is filled anew: each face by itself, in a place of its own of a small picture."""

    graph: BoundaryGraph
    ids: Ints  #: of its points in the area; those of mid-points follow the area's own
    part: Ints  #: of each face
    moved: Floats  #: (n_faces, 2) by which each face has been


def refilled(
    area: Area, begin: Flags, ends: Ints, labels: Labels, fill: Fill, threads: int, rings: int = RINGS[0]
) -> Area | None:
    """Fill anew what lies near some quads, with edges of the boundary halved.

    Parameters
    ----------
    area : Area
        Quads with all that lies within `REACH` of some, or all there is.
    begin : bool, shape (m,)
        Those; quads with one of the edges count as well.
    ends : int64, shape (k, 2)
        Points at the ends of each edge, an even number of them on each loop of the boundary of a part.
    labels : int32
        Material of each part.
    fill : callable
        Fills a boundary.
    threads : int
        The quads do not depend on it.
    rings : int
        Quads around these that are filled anew.

    Returns
    -------
    Area or None
        Its points begin with those of `area`, which stay, and the k mid-points in their order. None where the
        boundary cannot be filled.
    """
    gone = _around(area, begin | _beside(area, ends), rings)
    cut = _cut_out(area, gone, ends, labels)
    try:
        mesh = fill(cut.graph)
    except TopologyError:  # also where faces touch themselves, and one of several loops has an odd number of edges
        return None
    middle = 0.5 * (area.points[ends[:, 0]] + area.points[ends[:, 1]])
    n, rim = len(area.points) + len(middle), len(cut.ids)
    ids = np.append(cut.ids, n + np.arange(mesh.n_points - rim))
    face = np.zeros(mesh.n_points, np.int64)
    face[mesh.quads] = mesh.quad_region[:, None]
    points = np.vstack([area.points, middle, (mesh.points - cut.moved[face])[rim:]])
    new = Area(points, ids[mesh.quads], cut.part[mesh.quad_region])
    return _cleaned_around(*replaced(area, gone, new), threads)


def refilled_however(area: Area, begin: Flags, ends: Ints, labels: Labels, fill: Fill, threads: int) -> Area | None:
    """Do what `refilled` does, with more quads or fewer where the boundary of these cannot be filled."""
    made = (refilled(area, begin, ends, labels, fill, threads, rings) for rings in RINGS)
    return next((found for found in made if found is not None), None)


def replaced(area: Area, gone: Ints, new: Area) -> tuple[Area, Ints]:
    """Return an area with other quads in the place of some, whose points go on from its own, and where they are."""
    quads, part = np.delete(area.quads, gone, axis=0), np.delete(area.part, gone)
    at = len(quads) + np.arange(len(new.quads))
    return Area(new.points, np.concatenate([quads, new.quads]), np.concatenate([part, new.part])), at


def _cleaned_around(area: Area, new: Ints, threads: int) -> Area:
    """Clean up across the rim of quads that were filled anew."""
    rim = rim_of(area, new)
    if not rim.any():
        return area
    of_parts = np.isin(area.part, np.unique(area.part[new]))
    quads = np.flatnonzero(of_parts & nodes_around(area.quads, rim, BAND - 1)[area.quads].any(axis=1))
    return replaced(area, quads, cleaned(area, quads, nodes_around(area.quads, rim, SEEDS), PASSES, threads))[0]


def _beside(area: Area, ends: Ints) -> Flags:
    """Tell the quads that have one of some edges."""
    is_end = np.zeros(len(area.points), bool)
    is_end[ends] = True
    near = np.flatnonzero(is_end[area.quads].sum(axis=1) >= 2)
    sides = np.stack([area.quads[near], np.roll(area.quads[near], -1, axis=1)], axis=-1).reshape(-1, 2)
    beside = np.zeros(len(area.quads), bool)
    beside[near] = np.isin(_names(sides, area), _names(ends, area)).reshape(-1, 4).any(axis=1)
    return beside


def _names(edges: Ints, area: Area) -> Ints:
    """Return one number for each edge of an area, whichever way it runs."""
    return np.asarray(edges.min(axis=1) * len(area.points) + edges.max(axis=1))


def _around(area: Area, is_beside: Flags, rings: int) -> Ints:
    """Return the quads around some of them, none across a boundary."""
    parts = np.unique(area.part[is_beside])
    quads = np.flatnonzero(np.isin(area.part, parts))
    return quads[within(area.quads[quads], np.searchsorted(parts, area.part[quads]), is_beside[quads], rings)]


def within(quads: Ints, part: Ints, begin: Flags, rings: int) -> Flags:
    """Tell the quads at most so many quads away from some, in the same part."""
    corners = _apart(quads, part)[1]
    near = np.zeros(corners.max(initial=-1) + 1, bool)
    near[corners[begin]] = True
    return np.asarray(nodes_around(corners, near, rings)[corners].all(axis=1))


def _apart(quads: Ints, part: Ints) -> tuple[Ints, Ints]:
    """Give each part nodes of its own; return which they were, and the corners of the quads."""
    n = int(part.max(initial=0)) + 1
    names, corners = np.unique(quads * n + part[:, None], return_inverse=True)
    return names // n, corners.reshape(-1, 4)


def _cut_out(area: Area, gone: Ints, ends: Ints, labels: Labels) -> _Cut:
    """Return the boundary of some quads, with edges halved."""
    used, corners = _apart(area.quads[gone], area.part[gone])
    parts, number = np.unique(area.part[gone], return_inverse=True)
    traced = trace_mesh(area.points[used], corners, number.ravel(), nameless(len(parts)))
    traced = _with_sharp_turns_at_even_places(traced)
    part = parts[traced.region_label]
    names = _names(ends, area)
    order = np.argsort(names)
    here = used[traced.chain_points]
    name = _names(np.stack([here, np.roll(here, -1)], axis=1), area)
    split = np.isin(name, names)
    split[traced.chain_offsets[1:] - 1] = False  # there is no edge behind the last point of a chain
    middle = order[np.searchsorted(names[order], name[split])]
    graph, rim, moved = _side_by_side(traced, labels[part])
    finer = with_mid_points(graph, split)
    kind = np.full(len(finer.points), PointKind.HELD, np.uint8)  # corners, too: an edge between two may be halved
    ids = np.append(used[rim], len(area.points) + middle)
    return _Cut(replace(finer, point_kind=kind), ids, part, moved)


def _with_sharp_turns_at_even_places(mesh: QuadMesh) -> QuadMesh:
    """Return the mesh with closed chains begun at the next point where more turns are at even places by that.

    Quads are made of chords of two edges: one that cuts a corner makes poor ones.
    """
    chain_points = mesh.chain_points.copy()
    for begin, end in pairwise(mesh.chain_offsets.tolist()):
        loop = chain_points[begin : end - 1]
        if chain_points[begin] != chain_points[end - 1] or mesh.point_kind[loop[0]] == PointKind.JUNCTION:
            continue
        along = np.diff(mesh.points[np.append(loop, loop[:1])], axis=0)
        before = np.roll(along, 1, axis=0)
        turn = np.abs(np.arctan2(along[:, 1] * before[:, 0] - along[:, 0] * before[:, 1], (along * before).sum(axis=1)))
        if turn[1::2].sum() > turn[::2].sum():
            loop = np.roll(loop, -1)
            chain_points[begin:end] = np.append(loop, loop[:1])
    return replace(mesh, chain_points=chain_points)


def _side_by_side(traced: QuadMesh, label: Labels) -> tuple[BoundaryGraph, Ints, Floats]:
    """Return the chains of faces moved beside each other, the ids of their points, and by how much each face moved."""
    n = len(label)
    rim, chain_points = np.unique(traced.chain_points, return_inverse=True)
    face = np.zeros(traced.n_points, np.int64)
    face[traced.quads] = traced.quad_region[:, None]
    face = face[rim]
    low, high = np.full((n, 2), np.inf), np.full((n, 2), -np.inf)
    np.minimum.at(low, face, traced.points[rim])
    np.maximum.at(high, face, traced.points[rim])
    low, wide = np.floor(low), np.ceil(high) - np.floor(low) + MARGIN
    left = np.cumsum(wide[:, 0]) - wide[:, 0]
    moved = np.stack([MARGIN + left, np.full(n, MARGIN)], axis=1) - low
    shape = int(wide[:, 1].max() + 2 * MARGIN), int(wide[:, 0].sum() + 2 * MARGIN)
    areas = np.bincount(traced.quad_region, quad_areas(traced.points, traced.quads), n)
    graph = BoundaryGraph(
        traced.points[rim] + moved[face], np.zeros(len(rim), np.uint8), traced.chain_offsets, chain_points.ravel(),
        traced.chain_regions, label, np.maximum(areas, 1.0).astype(np.int64), shape,
    )  # fmt: skip
    return graph, rim, moved
