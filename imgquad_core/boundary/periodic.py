"""Periodic cells: opposite sides of the picture's border get nodes at the same places.

::

     left        stations        right     A boundary that meets both sides at nearly the same height meets them at the
    --j---          j           ---j--     mean height; where it meets one side only, the other gets a node there.
      |             |              |       Between stations both sides are cut alike, as finely as the finer of them.
      o             o              o
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Floats, Ints
from imgquad_core.errors import InputError
from imgquad_core.geometry.conflicts import CROSSING, find_conflicts, snapped
from imgquad_core.model import VOID, BoundaryGraph, PointKind, QuadMesh

from .areas import polygon_areas, restore_areas

DIRECTIONS = ("x", "y", "xy")
REACH = 3.0  #: px, a boundary that meets opposite sides within this distance is one boundary of the periodic picture
TOUCHING = 1.0  #: px, ends of different boundaries this near take one place, too
AREA_ROOM = 0.5  #: px, by which boundaries may move to keep areas
RATIO, GROWTH = 1.6, 0.3  #: edges beside the border may be this much longer than its own, and grow so along the arc
STEP = 2.5  #: ratio of neighbouring edges there; halving alone makes steps of two
SLOPE = 0.25  #: by how much edges may grow per length of the side
SAMPLE = 0.25  #: px, between places where the length of edges is looked at
LEAST_GAP = 0.1  #: px, between neighbouring stations of one side that were moved


class _Side(NamedTuple):
    """One side of the border: its chains and where they begin and end."""

    across: int  # 0: the side stands at x = level
    level: float
    chains: Ints
    ends: Ints  # ids, ascending along the side, each once


def match_opposite_sides(graph: BoundaryGraph, directions: str) -> BoundaryGraph:
    """Return the boundary with nodes at the same places on opposite sides of the picture.

    Parameters
    ----------
    graph : BoundaryGraph
        From `smooth_boundaries`.
    directions : str
        ``x`` (left and right match), ``y`` (bottom and top) or ``xy``.

    Returns
    -------
    BoundaryGraph
        The same chains and regions. Ends of boundaries on the border have moved along it by at most 1.5 px, to where
        the boundary of the picture repeated side by side crosses the seam; nodes between them are new.

    Raises
    ------
    InputError
        Unknown directions.
    """
    if directions not in DIRECTIONS:
        raise InputError(f"periodic = '{directions}': choose one of x, y, xy")
    areas = _areas(graph)
    for direction in directions:
        across = "xy".index(direction)
        lengths = [_edge_lengths(graph, side) for side in _sides(graph, across)]
        graph = _bare(graph, _sides(graph, across))
        low, high = _sides(graph, across)
        if not len(low.ends) + len(high.ends):
            continue  # all materials on both sides were dropped
        graph = _joined(graph, low, high)
        stations = np.unique(graph.points[np.concatenate([low.ends, high.ends]), 1 - across])
        graph = _recut(graph, (low, high), _cuts(lengths, stations))
    return _graded(_with_areas(graph, areas))


def rematch(graph: BoundaryGraph, mesh: QuadMesh, directions: str) -> BoundaryGraph | None:
    """Return the boundary that `mesh` has, matched anew where the mesher has cut edges of one side only.

    Parameters
    ----------
    graph : BoundaryGraph
        What was meshed.
    mesh : QuadMesh
        What came out.
    directions : str
        As for `match_opposite_sides`.

    Returns
    -------
    BoundaryGraph or None
        None where opposite sides match.
    """
    found = replace(
        graph,
        points=mesh.points,
        point_kind=mesh.point_kind,
        chain_offsets=mesh.chain_offsets,
        chain_points=mesh.chain_points,
        chain_regions=mesh.chain_regions,
    )
    matches = True
    for direction in directions:
        across = "xy".index(direction)
        stations, sides = _heights(graph, _sides(graph, across)), _sides(found, across)
        shared = _heights(found, sides)
        if any(_lacks(found, side, shared) for side in sides):
            matches = False
            counts = np.max([_edges_between(found, side, stations) for side in sides], axis=0)
            bare = _bare(found, sides)
            found = _recut(bare, _sides(bare, across), _even_cuts(stations, counts))
    return None if matches else found


def _heights(graph: BoundaryGraph, sides: tuple[_Side, _Side]) -> Floats:
    """Return the places of the nodes of two sides, ascending, each once."""
    ids = [graph.chain(c) for side in sides for c in side.chains.tolist()]
    return np.unique(graph.points[np.concatenate(ids), 1 - sides[0].across]) if ids else np.empty(0)


def _lacks(graph: BoundaryGraph, side: _Side, heights: Floats) -> bool:
    """Whether a chain of the side passes one of `heights` without a node there."""
    for c in side.chains.tolist():
        own = graph.points[graph.chain(c), 1 - side.across]
        if ((heights >= own.min()) & (heights <= own.max())).sum() > len(own):
            return True
    return False


def _edges_between(graph: BoundaryGraph, side: _Side, stations: Floats) -> Ints:
    """Return how many edges the side has between each two of `stations` that follow each other."""
    ends = np.concatenate(_edge_lengths(graph, side)).reshape(2, -1)
    return np.bincount(np.searchsorted(stations, ends.mean(axis=0)) - 1, minlength=len(stations) - 1)


def _even_cuts(stations: Floats, counts: Ints) -> list[Floats]:
    """Return the places of the nodes from each station to the next, both included.

    Not where the mesher has left them: they slide, on each side as its own quads want it.
    """
    pairs = zip(stations[:-1].tolist(), stations[1:].tolist(), np.maximum(counts, 1).tolist(), strict=True)
    return [_between(a, b, count) for a, b, count in pairs]


def _between(a: float, b: float, count: int) -> Floats:
    places = snapped(np.linspace(a, b, count + 1))
    places[[0, -1]] = a, b
    return places


def _areas(graph: BoundaryGraph) -> Floats:
    return polygon_areas(graph.points, graph.chains, len(graph.region_label))


def _with_areas(graph: BoundaryGraph, areas: Floats) -> BoundaryGraph:
    """Give the regions back what moving the ends of boundaries took; less where chains would cross or leave."""
    is_free = graph.point_kind[graph.chain_points] == PointKind.FREE
    extent = np.array(graph.shape[::-1], float)
    farthest = np.maximum(extent, snapped(extent))
    for share in (1.0, 0.5, 0.25):
        bound = np.where(is_free, share * AREA_ROOM, 0.0)
        points, _ = restore_areas(graph.points, graph.chains, areas, bound, np.zeros(graph.n_chains))
        moved = replace(graph, points=snapped(points))
        is_within = (moved.points >= 0.0).all() and (moved.points <= farthest).all()  # beyond is void: nothing to cross
        if is_within and not _crossing(moved, 1) and not _crossing(moved, 2):
            return moved
    return graph


def _sides(graph: BoundaryGraph, across: int) -> tuple[_Side, _Side]:
    levels = (0.0, float(graph.shape[1 - across]))
    low, high = (_side(graph, across, level) for level in levels)
    return low, high


def _side(graph: BoundaryGraph, across: int, level: float) -> _Side:
    on_side = graph.points[graph.chain_points, across] == level
    outer = (graph.chain_regions == VOID).any(axis=1)
    all_on = np.logical_and.reduceat(on_side, graph.chain_offsets[:-1])
    chains = np.flatnonzero(all_on & outer)
    ends = np.concatenate([graph.chain(c)[[0, -1]] for c in chains]) if len(chains) else np.empty(0, np.int64)
    ends = np.unique(ends)
    return _Side(across, level, chains, ends[np.argsort(graph.points[ends, 1 - across])])


def _edge_lengths(graph: BoundaryGraph, side: _Side) -> tuple[Floats, Floats]:
    """Lower and upper ends of all edges of a side, ascending."""
    along = 1 - side.across
    pairs = [np.stack([graph.chain(c)[:-1], graph.chain(c)[1:]], axis=1) for c in side.chains.tolist()]
    ends = graph.points[np.concatenate(pairs), along] if pairs else np.empty((0, 2))
    ends = np.sort(ends, axis=1)
    ends = ends[np.argsort(ends[:, 0])]
    return ends[:, 0], ends[:, 1]


def _bare(graph: BoundaryGraph, sides: tuple[_Side, _Side]) -> BoundaryGraph:
    """Leave only their ends to the chains of both sides."""
    chains = [graph.chain(c) for c in range(graph.n_chains)]
    for c in np.concatenate([side.chains for side in sides]).tolist():
        chains[c] = chains[c][[0, -1]]
    return _with_chains(graph, chains)


def _with_chains(graph: BoundaryGraph, chains: list[Ints]) -> BoundaryGraph:
    """Give the graph other chains and leave out the points that none of them has."""
    used, numbered = np.unique(np.concatenate(chains), return_inverse=True)
    return replace(
        graph,
        points=graph.points[used],
        point_kind=graph.point_kind[used],
        chain_offsets=np.cumsum([0] + [len(chain) for chain in chains]),
        chain_points=numbered.ravel(),
    )


def _joined(graph: BoundaryGraph, low: _Side, high: _Side) -> BoundaryGraph:
    """Move both ends of each boundary across the seam to one height; leave those alone where chains would cross."""
    refused: set[tuple[int, int]] = set()
    along = 1 - low.across
    while True:
        pairs = [pair for pair in _pairs(graph, low, high) if pair not in refused]
        points = graph.points.copy()
        for a, b in pairs:
            points[[a, b], along] = points[[a, b], along].mean()
        moved = replace(graph, points=snapped(points))
        bad = _squeezed(moved, low) | _squeezed(moved, high) | _crossing(moved, 1) | _crossing(moved, 2)
        wrong = {(a, b) for a, b in pairs if a in bad or b in bad}
        if not wrong:
            return moved
        refused |= wrong


def _crossing(graph: BoundaryGraph, step: int) -> set[int]:
    """Return the ends of segments that cross or touch others, on the polylines through every `step`-th point."""
    chains = [graph.chain(c) for c in range(graph.n_chains)]
    chains = [chain[::step] if len(chain) > 2 else chain for chain in chains]
    segments = np.concatenate([np.stack([chain[:-1], chain[1:]], axis=1) for chain in chains])
    chain_of = np.repeat(np.arange(graph.n_chains), [len(chain) - 1 for chain in chains])
    marks = find_conflicts(graph.points, segments, chain_of, np.ones(graph.n_chains, bool), graph.shape)
    return set(np.unique(segments[marks == CROSSING]).tolist())


def _pairs(graph: BoundaryGraph, low: _Side, high: _Side) -> list[tuple[int, int]]:
    """Pair the ends on both sides that belong together, the nearest first, in the same order on both sides."""
    along = 1 - low.across
    a, b = (_movable(graph, side) for side in (low, high))
    apart = np.abs(graph.points[a, along][:, None] - graph.points[b, along][None, :])
    same = np.array([[_beside(graph, low, i) == _beside(graph, high, j) for j in b.tolist()] for i in a.tolist()])
    near = apart <= np.where(same.reshape(apart.shape), REACH, TOUCHING)
    rows, columns = np.nonzero(near)
    chosen: list[tuple[int, int]] = []
    for k in np.lexsort((columns, rows, apart[rows, columns])).tolist():
        i, j = int(rows[k]), int(columns[k])
        if all((i - p) * (j - q) > 0 for p, q in chosen):
            chosen.append((i, j))
    return [(int(a[i]), int(b[j])) for i, j in sorted(chosen)]


def _movable(graph: BoundaryGraph, side: _Side) -> Ints:
    movable: Ints = side.ends[graph.point_kind[side.ends] != PointKind.CORNER]
    return movable


def _beside(graph: BoundaryGraph, side: _Side, end: int) -> tuple[int, int]:
    """Materials below and above an end on its side; VOID where nothing is meshed."""
    along = 1 - side.across
    found = [VOID, VOID]
    for c in side.chains.tolist():
        chain = graph.chain(c)
        if end in (chain[0], chain[-1]):
            other = chain[-1] if end == chain[0] else chain[0]
            region = int(graph.chain_regions[c].max())
            found[int(graph.points[other, along] > graph.points[end, along])] = int(graph.region_label[region])
    return found[0], found[1]


def _squeezed(graph: BoundaryGraph, side: _Side) -> set[int]:
    """Return the ends that came too near their neighbours on the side, or past them."""
    at = graph.points[side.ends, 1 - side.across]
    tight = np.flatnonzero(np.diff(at) < LEAST_GAP)
    return set(side.ends[np.concatenate([tight, tight + 1])].tolist())


def _cuts(lengths: list[tuple[Floats, Floats]], stations: Floats) -> list[Floats]:
    """Places of the nodes from each station to the next, both included: an even number of edges each."""
    at, wanted = _wanted_lengths(lengths, stations)
    # edges from the lower end of the side to each place
    edges = np.concatenate([[0.0], np.cumsum(np.diff(at) / ((wanted[:-1] + wanted[1:]) / 2))])
    cuts = []
    for begin, end in zip(stations[:-1].tolist(), stations[1:].tolist(), strict=True):
        first, last = np.interp([begin, end], at, edges)
        count = 2 * max(1, int(np.ceil((last - first) / 2 - 0.15)))
        if count > 6 and count % 4:
            count += 2
        places = snapped(np.interp(np.linspace(first, last, count + 1), edges, at))
        places[[0, -1]] = begin, end
        cuts.append(places)
    return cuts


def _wanted_lengths(lengths: list[tuple[Floats, Floats]], stations: Floats) -> tuple[Floats, Floats]:
    """Places all along the side, and the length of edges there.

    As on the finer side, at most half of what lies between two stations, growing slowly away from fine places.
    """
    places = np.arange(stations[0], stations[-1], SAMPLE)
    at = np.unique(np.concatenate([places, stations]))
    between = np.maximum(np.searchsorted(stations, at, side="right") - 1, 0).clip(max=len(stations) - 2)
    length = np.diff(stations)[between] / 2
    for ends in lengths:
        length = np.minimum(length, _length_at(ends, at))
    for _ in range(2):  # up the side, then down
        length = np.minimum.accumulate(length - SLOPE * at) + SLOPE * at
        length, at = length[::-1], -at[::-1]
    return at, length


def _length_at(ends: tuple[Floats, Floats], at: Floats) -> Floats:
    """Length of the edge at each height, infinite where the side is not meshed."""
    lower, upper = ends
    if not len(lower):
        return np.full(len(at), np.inf)
    edge = np.maximum(np.searchsorted(lower, at) - 1, 0)
    inside = (lower[edge] <= at) & (at <= upper[edge])
    return np.where(inside, upper[edge] - lower[edge], np.inf)


def _recut(graph: BoundaryGraph, sides: tuple[_Side, _Side], cuts: list[Floats]) -> BoundaryGraph:
    """Give the chains of both sides the nodes at `cuts`."""
    points, n = [graph.points], len(graph.points)
    chains = [graph.chain(c) for c in range(graph.n_chains)]
    for side in sides:
        along = 1 - side.across
        for c in side.chains.tolist():
            first, last = chains[c]
            low, high = np.sort(graph.points[[first, last], along])
            heights = np.unique(np.concatenate([cut for cut in cuts if cut[0] >= low and cut[-1] <= high]))[1:-1]
            new = np.full((len(heights), 2), side.level)
            new[:, along] = heights if graph.points[first, along] == low else heights[::-1]
            points.append(new)
            chains[c] = np.concatenate([[first], n + np.arange(len(new)), [last]])
            n += len(new)
    # of the kind that stays: nodes of kind FRAME slide along the border when the mesh is relaxed
    kinds = np.concatenate([graph.point_kind, np.full(n - len(graph.points), PointKind.CORNER, np.uint8)])
    return _with_chains(replace(graph, points=np.concatenate(points), point_kind=kinds), chains)


def _graded(graph: BoundaryGraph) -> BoundaryGraph:
    """Halve the edges of boundaries near the border, again and again, where they are long beside those of the border.

    Both edges between even places are cut alike, so even places stay even.
    """
    outer = (graph.chain_regions == VOID).any(axis=1)
    finest = np.full(len(graph.points), np.inf)
    for c in np.flatnonzero(outer).tolist():
        chain = graph.chain(c)
        length = np.linalg.norm(np.diff(graph.points[chain], axis=0), axis=1)
        np.minimum.at(finest, chain[[0, -1]], length[[0, -1]])
    points, n = [graph.points], len(graph.points)
    chains = []
    for c in range(graph.n_chains):
        chain = graph.chain(c)
        if not outer[c] and np.isfinite(finest[chain[[0, -1]]]).any():
            chain, new = _halved_near_ends(graph.points, chain, finest[chain[[0, -1]]], n)
            points.append(new)
            n += len(new)
        chains.append(chain)
    kinds = np.concatenate([graph.point_kind, np.full(n - len(graph.points), PointKind.FREE, np.uint8)])
    return _with_chains(replace(graph, points=np.concatenate(points), point_kind=kinds), chains)


def _halved_near_ends(points: Floats, chain: Ints, finest: Floats, first_id: int) -> tuple[Ints, Floats]:
    """Return the chain with new points from id `first_id` on, and these points."""
    p = points[chain]
    length = np.linalg.norm(np.diff(p, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(length)])
    longest = length.reshape(-1, 2).max(axis=1)
    begin, end = arc[:-1:2], arc[2::2]
    wanted = np.minimum(finest[0] + GROWTH * begin, finest[1] + GROWTH * (arc[-1] - end))
    times = np.ceil(np.log2(np.maximum(longest / (RATIO * wanted), 1.0))).astype(np.int64)
    for k in [*range(1, len(times)), *range(len(times) - 1, 0, -1)]:  # no edge far longer than its neighbours
        for here, beside in ((k, k - 1), (k - 1, k)):
            while longest[here] / 2 ** times[here] > STEP * longest[beside] / 2 ** times[beside]:
                times[here] += 1
    parts = np.repeat(2**times, 2)
    edge = np.repeat(np.arange(len(length)), parts)
    share = (np.arange(len(edge)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[edge]
    is_new = share > 0
    ids = chain[edge]
    ids[is_new] = first_id + np.arange(np.count_nonzero(is_new))
    between = p[edge] + share[:, None] * (p[edge + 1] - p[edge])
    return np.append(ids, chain[-1]), snapped(between[is_new])
