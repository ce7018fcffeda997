"""Step 3 of the paper: smooth boundaries, cut into edges of the wanted length.

In this order: junctions and border ends move (`junctions`), local quadratics smooth the chains (`fitting`), every
point within a bound that keeps foreign boundaries apart; then edge lengths are wanted everywhere (`spacing`), nodes
placed (`placement`) and tested exactly (`clearance`). Where the test finds fault, nodes are placed closer together
and the smoothing is withdrawn by thirds, down to the pixel boundary itself, which never crosses.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.areas import polygon_areas, restore_areas
from imgquad_core.clearance import CROSSING, SHARP, find_conflicts, mark_sharp, snapped
from imgquad_core.corners import find_corners, place_corners
from imgquad_core.curves import Curves, Flags, Floats, Ints, curves_of, per_point, pin_ends
from imgquad_core.errors import InputError, TopologyError
from imgquad_core.features import local_feature_size
from imgquad_core.fitting import WINDOWS, fit_pieces
from imgquad_core.jit import kernel
from imgquad_core.junctions import place_junctions
from imgquad_core.model import VOID, BoundaryGraph, PointKind
from imgquad_core.placement import Placement, even_out, place_nodes, points_at
from imgquad_core.spacing import edge_sizes

_ROOM = 0.35  # of the local feature size of the pixel boundary: two foreign points that both move it cannot meet
_SHARE = 0.75  # of the largest shift that smoothing may use; the rest is for areas
_NARROW = 2.0  # px; reach of the local feature size that bounds shifts
_ARC_RATIO = 2.0  # arc over distance of a foreign point of the pixel boundary
_LEAST_SECTOR = np.radians(30.0)
_CLOSEST = 0.25  # px between nodes, to which they are drawn together where they conflict
_AREA_ROOM = 0.7  # of the bound of smoothing, for the shift that restores areas
_AREA_ROUNDS = 10
_GENTLE_ROUNDS, _ROUNDS = 8, 14  # rounds that mind sectors and room; rounds until faulty chains get their pixels back


@dataclass(frozen=True)
class SmoothingOptions:
    """How boundaries are smoothed and cut into edges.

    Parameters
    ----------
    size : float
        Length of final edges, in pixels.
    boundary_size : float, optional
        The same on boundaries, `size` where not given.
    growth : float
        Largest ratio of the sizes of neighbouring elements.
    edge_ratio : float
        Largest ratio of the lengths of neighbouring edges of a chain.
    max_shift : float
        How far a point of the boundary moves at most, in pixels.
    material_sizes : mapping of int to float
        Length of final edges per material label; a boundary takes the least of its two sides'.
    """

    size: float = 4.0
    boundary_size: float | None = None
    growth: float = 1.3
    edge_ratio: float = 1.2
    max_shift: float = 1.0
    material_sizes: Mapping[int, float] | None = field(default=None)

    def __post_init__(self) -> None:
        sizes = {"size": self.size, "boundary_size": self.boundary_size or self.size}
        sizes |= {f"size of material {label}": value for label, value in (self.material_sizes or {}).items()}
        for name, value in sizes.items():
            if not 0.05 <= value < float("inf"):
                raise InputError(f"{name} is {value}; give a length of at least 0.05 px")
        for name, ratio in (("growth", self.growth), ("edge_ratio", self.edge_ratio)):
            if not 1.01 <= ratio <= 10.0:
                raise InputError(f"{name} is {ratio}; give a ratio from 1.01 to 10")
        if not 0.0 <= self.max_shift <= 10.0:
            raise InputError(f"max_shift is {self.max_shift}; give a length from 0 to 10 px")


class _Level(NamedTuple):
    """The polylines through all nodes (final edges), or through every second one (coarse)."""

    chain_points: Ints
    offsets: Ints
    segments: Ints
    chain: Ints  # of each segment


class _Nodes(NamedTuple):
    """Nodes of the boundary that is meshed."""

    points: Floats
    chain_points: Ints
    placed: Placement


def smooth_boundaries(graph: BoundaryGraph, options: SmoothingOptions | None = None) -> BoundaryGraph:
    """Smooth a pixel boundary and cut it into edges of the wanted length.

    Parameters
    ----------
    graph : BoundaryGraph
        What `extract_boundaries` gave.
    options : SmoothingOptions, optional
        Sizes and limits.

    Returns
    -------
    BoundaryGraph
        The boundary that is meshed, with chains and regions numbered as in `graph`: an even number of edges for
        every piece between corners, on every chain; all points, and the points at even places alone, form polylines
        that neither cross nor touch. Coordinates are multiples of 2^-14 px.
    """
    options = options or SmoothingOptions()
    curves, is_corner = find_corners(curves_of(graph))
    limit = per_point(curves, _asked_sizes(graph, options))
    room = _room(curves, is_corner, options.max_shift)
    node = place_junctions(curves, room, graph.shape)
    smooth = _smooth(curves, node, is_corner, room)
    size = edge_sizes(smooth, curves, limit, is_corner, options.growth, options.edge_ratio, graph.shape)
    nodes, gently = _place_freely(curves, smooth, node, size, limit, is_corner, options, graph.shape)
    nodes = _restore(graph, curves, nodes, room, options.max_shift, gently)
    return _graph(graph, curves, nodes)


def region_areas(graph: BoundaryGraph) -> Floats:
    """Area of each region within its chains, in square pixels, shape (n_regions,).

    Compare with `graph.region_pixels` for the error of smoothing.
    """
    return polygon_areas(
        np.array(graph.points),
        np.array(graph.chain_points),
        np.array(graph.chain_offsets),
        graph.chain_regions,
        len(graph.region_label),
    )


def _asked_sizes(graph: BoundaryGraph, options: SmoothingOptions) -> Floats:
    """Asked length of final edges, for each chain."""
    of_region = np.full(len(graph.region_label) + 1, float(options.boundary_size or options.size))
    of_region[VOID] = np.inf
    for label, size in (options.material_sizes or {}).items():
        of_region[:-1][graph.region_label == label] = size
    return of_region[graph.chain_regions].min(axis=1)


def _room(curves: Curves, is_corner: Flags, max_shift: float) -> Floats:
    """How far smoothing may move each dense point."""
    free = _ROOM * local_feature_size(curves.raw, curves, _NARROW, _ARC_RATIO)
    return np.minimum(free, np.where(is_corner, 1.0, _SHARE) * max_shift)


def _smooth(curves: Curves, node: Floats, is_corner: Flags, room: Floats) -> Floats:
    """Smooth all chains between their moved ends and corners, within `room` of the pixel boundary."""
    pinned = curves.raw.copy()
    place_corners(curves, is_corner, room, pinned)
    pin_ends(pinned, curves, node)
    pieces, closed = _pieces(curves, is_corner)
    smooth = fit_pieces(pinned, curves.arc, curves.weight, pieces, closed, np.array(WINDOWS))
    shift = smooth - curves.raw
    length = np.hypot(shift[:, 0], shift[:, 1])
    smooth = curves.raw + shift * np.minimum(1.0, room / np.maximum(length, 1e-300))[:, None]
    pin_ends(smooth, curves, node)
    return smooth


def _pieces(curves: Curves, is_corner: Flags) -> tuple[Ints, Flags]:
    """First and last dense point of each piece between corners, off the border; is it a whole closed chain?"""
    is_cut = is_corner.copy()
    is_cut[curves.offsets[:-1]] = is_cut[curves.offsets[1:] - 1] = True
    cuts = np.flatnonzero(is_cut)
    chain = np.searchsorted(curves.offsets, cuts, side="right") - 1
    inner = (chain[1:] == chain[:-1]) & ~curves.is_frame[chain[:-1]]
    pieces = np.stack([cuts[:-1], cuts[1:]], axis=1)[inner]
    return pieces, ((curves.ends[:, 0] < 0)[chain[:-1]] & ~is_corner[cuts[:-1]])[inner]


def _place_freely(
    curves: Curves,
    smooth: Floats,
    node: Floats,
    size: Floats,
    limit: Floats,
    is_corner: Flags,
    options: SmoothingOptions,
    shape: tuple[int, int],
) -> tuple[_Nodes, bool]:
    """Place nodes; closer and nearer to the pixel boundary where they conflict, until they don't.

    Also tells whether they keep room and open sectors too.
    """
    size = size.copy()
    withdrawn = np.zeros(len(smooth))
    exact = np.zeros(len(curves.ends), bool)
    is_new = np.ones(len(curves.ends), bool)
    at_least = _least_segments(curves)
    for attempt in range(_ROUNDS + len(exact) + 2):
        nodes = _place(curves, smooth, node, size, limit, is_corner, at_least, exact, withdrawn, options.edge_ratio)
        factor = np.ones(len(smooth))
        pull = np.zeros(len(smooth))
        worst = 0
        for step in (2, 1):
            level = _level(nodes, step)
            marks = _conflicts(nodes.points, level, curves, is_new, attempt < _GENTLE_ROUNDS, shape)
            worst = max(worst, int(marks.max(initial=0)))
            _mark_dense(marks, level.chain, nodes.placed.at[_places(nodes.placed.offsets, step)], curves.offsets,
                        level.offsets, attempt >= 2, factor, pull)
        if worst == 0:
            return nodes, attempt < _GENTLE_ROUNDS
        is_new = _touched(curves, factor)
        size = np.maximum(size * factor, np.minimum(_CLOSEST, limit))
        withdrawn = np.minimum(withdrawn + pull, 1.0)
        if attempt >= _ROUNDS:
            exact |= np.logical_or.reduceat(factor < 1, curves.offsets[:-1]) | (attempt > _ROUNDS + 6)
            withdrawn[per_point(curves, exact)] = 1.0
            is_new = np.ones(len(exact), bool)
    raise TopologyError("the pixel boundary itself has conflicts")


def _least_segments(curves: Curves) -> Ints:
    """Least number of coarse segments of each chain, so that every face has at least three."""
    ends = np.sort(curves.ends, axis=1)
    _, pair, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    least = np.where(count[pair.ravel()] > 1, 2, 1)
    least[ends[:, 0] == ends[:, 1]] = 3
    least[ends[:, 0] < 0] = 4
    return least.astype(np.int64)


def _place(
    curves: Curves,
    smooth: Floats,
    node: Floats,
    size: Floats,
    limit: Floats,
    is_corner: Flags,
    at_least: Ints,
    exact: Flags,
    withdrawn: Floats,
    edge_ratio: float,
) -> _Nodes:
    points = smooth + withdrawn[:, None] * (curves.raw - smooth)
    pin_ends(points, curves, _withdraw_nodes(curves, node, withdrawn))
    placed = place_nodes(curves, size, limit, is_corner, at_least, exact)
    even_out(points, placed, exact, edge_ratio)
    return _number(curves, snapped(points_at(points, placed.at)), placed)


def _withdraw_nodes(curves: Curves, node: Floats, withdrawn: Floats) -> Floats:
    of_node = np.zeros(len(node))
    for side, place in ((0, curves.offsets[:-1]), (1, curves.offsets[1:] - 1)):
        open_ = curves.ends[:, side] >= 0
        np.maximum.at(of_node, curves.ends[open_, side], withdrawn[place[open_]])
    return node + of_node[:, None] * (curves.node - node)


def _number(curves: Curves, xy: Floats, placed: Placement) -> _Nodes:
    """Give ids: chain ends first, then the others chain by chain."""
    first, last = placed.offsets[:-1], placed.offsets[1:] - 1
    closed = curves.ends[:, 0] < 0
    is_inner = np.ones(len(xy), bool)
    is_inner[first[~closed]] = False
    is_inner[last] = False
    ids = np.empty(len(xy), np.int64)
    ids[is_inner] = len(curves.node) + np.arange(np.count_nonzero(is_inner))
    ids[first[~closed]], ids[last[~closed]] = curves.ends[~closed].T
    ids[last[closed]] = ids[first[closed]]
    points = np.empty((len(curves.node) + np.count_nonzero(is_inner), 2))
    points[ids] = xy
    return _Nodes(points, ids, placed)


def _places(offsets: Ints, step: int) -> Ints:
    """Places of every `step`-th node of all chains."""
    if step == 1:
        return np.arange(offsets[-1])
    within = np.arange(offsets[-1]) - np.repeat(offsets[:-1], np.diff(offsets))
    return np.flatnonzero(within % step == 0)


def _level(nodes: _Nodes, step: int) -> _Level:
    chain_points = nodes.chain_points[_places(nodes.placed.offsets, step)]
    counts = (np.diff(nodes.placed.offsets) - 1) // step
    offsets = np.concatenate([[0], np.cumsum(counts + 1)])
    pairs = np.stack([chain_points[:-1], chain_points[1:]], axis=1)
    inside = np.ones(len(pairs), bool)
    inside[offsets[1:-1] - 1] = False
    return _Level(chain_points, offsets, pairs[inside], np.repeat(np.arange(len(counts)), counts))


def _conflicts(
    points: Floats, level: _Level, curves: Curves, is_new: Flags, gently: bool, shape: tuple[int, int]
) -> NDArray[np.uint8]:
    marks = find_conflicts(points, level.segments, level.chain, is_new, shape)
    if not gently:
        marks[marks < CROSSING] = 0
        return marks
    mark_sharp(points, level.chain_points, level.offsets, curves.node_offsets, curves.sockets, _LEAST_SECTOR, marks)
    return marks


@kernel
def _mark_dense(
    marks: NDArray[np.uint8],
    chain: Ints,
    at: Floats,
    dense_offsets: Ints,
    offsets: Ints,
    withdraw: bool,
    factor: Floats,
    pull: Floats,
) -> None:
    """For the dense points under marked segments: how much closer nodes go, and how much nearer to the pixels."""
    for k in range(len(marks)):
        if marks[k] == 0:
            continue
        c = chain[k]
        low = max(int(at[k + c]) - 1, dense_offsets[c])
        high = min(int(at[k + c + 1]) + 2, dense_offsets[c + 1] - 1)
        for i in range(low, high + 1):
            factor[i] = min(factor[i], 0.8 if marks[k] == SHARP else 0.6)
            if withdraw or marks[k] == SHARP:
                pull[i] = 1.0 / 3.0


def _touched(curves: Curves, factor: Floats) -> Flags:
    """Chains whose nodes move next time: the marked ones and those at their ends."""
    marked = np.logical_or.reduceat(factor < 1, curves.offsets[:-1])
    node = np.zeros(len(curves.node) + 1, bool)
    node[curves.ends[marked].ravel()] = True
    node[-1] = False
    return marked | node[curves.ends].any(axis=1)


def _restore(
    graph: BoundaryGraph, curves: Curves, nodes: _Nodes, room: Floats, max_shift: float, gently: bool
) -> _Nodes:
    """Give regions their areas; less where that makes conflicts."""
    placed = nodes.placed
    bound = _area_bounds(curves, nodes, room, max_shift)
    shift = np.zeros(graph.n_chains)
    tested = nodes.points
    for attempt in range(_AREA_ROUNDS):
        points, shift = restore_areas(
            nodes.points, nodes.chain_points, placed.offsets, graph.chain_regions, graph.region_pixels, bound, shift
        )
        points = snapped(points)
        has_moved = (points != tested).any(axis=1)[nodes.chain_points]
        moved = np.logical_or.reduceat(has_moved, placed.offsets[:-1])
        tested = points
        is_bad = np.zeros(len(points), bool)
        for step in (2, 1):
            level = _level(nodes, step)
            is_bad[level.segments[_conflicts(points, level, curves, moved, gently, graph.shape) > 0]] = True
        if not is_bad.any():
            return nodes._replace(points=points)
        bad = is_bad[nodes.chain_points]
        bad[1:] |= bad[:-1].copy()
        bad[:-1] |= bad[1:].copy()
        bound[bad] *= 0.5 if attempt < 1 else 0.0
    return nodes


def _area_bounds(curves: Curves, nodes: _Nodes, room: Floats, max_shift: float) -> Floats:
    """How far each node may be shifted for areas."""
    at = nodes.placed.at
    home = points_at(curves.raw, at)
    xy = nodes.points[nodes.chain_points]
    bound = np.minimum(max_shift - np.hypot(*(xy - home).T), _AREA_ROOM * room[at.astype(np.int64)])
    chain = np.repeat(np.arange(len(curves.ends)), np.diff(nodes.placed.offsets))
    bound[curves.is_frame[chain] | nodes.placed.is_corner] = 0.0
    open_ = curves.ends[:, 0] >= 0
    bound[nodes.placed.offsets[:-1][open_]] = bound[nodes.placed.offsets[1:][open_] - 1] = 0.0
    return np.maximum(bound, 0.0)


def _graph(graph: BoundaryGraph, curves: Curves, nodes: _Nodes) -> BoundaryGraph:
    kind = np.full(len(nodes.points), PointKind.FREE, np.uint8)
    chain = np.repeat(np.arange(graph.n_chains), np.diff(nodes.placed.offsets))
    kind[nodes.chain_points[curves.is_frame[chain]]] = PointKind.FRAME
    kind[nodes.chain_points[nodes.placed.is_corner]] = PointKind.CORNER
    kind[: len(curves.node)] = curves.node_kind
    return BoundaryGraph(
        nodes.points, kind, nodes.placed.offsets, nodes.chain_points, graph.chain_regions, graph.region_label,
        graph.region_pixels, graph.shape,
    )
