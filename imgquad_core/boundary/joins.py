r"""Joins of junctions that a short chain lies between: one node takes the place of both.

Three grains meet in a point; four do by chance only, and a pixel boundary makes two triple points of that, a pixel
or less apart. Such a chain forces edges far below the size that is asked for. It goes, and the chains around it end in
one node q. Near q each of them runs straight::

      \      /             \    /          spokes: from q to the LAST point of each chain within `reach`;
       a----b       =>       q             the sectors between them must be wide, or the join is refused
      /      \             /    \

Shortest chains first. The cyclic order of chains around q is that around a, then around b, and no other chain is
near: the faces stay what they were. The dense segments are tested exactly at the end all the same.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Bytes, Flags, Floats, Ints
from imgquad_core.geometry.conflicts import CROSSING, UNITS, find_conflicts, snapped
from imgquad_core.grouping import rows_of
from imgquad_core.jit import kernel, verb
from imgquad_core.model import VOID, PointKind

from .curves import ELSEWHERE, PIXEL_CORNER, PixelChains, curves_of, ends_of, numbered, rings
from .feature_size import in_cells
from .stars import ALONG, MOST, REACHES, Grid, Net, best_place, best_reach, star_of

_CHORD = 6  # dense points from chord to chord of a chain's length: arcs of stairs are up to 41 % too long
_STEP = 0.6  # px between dense points on a spoke, at most
_PASSES = 10  # over all short chains: a join may make room for another
_ATTEMPTS = 12  # with joins forbidden whose chains cross others


class Joined(NamedTuple):
    """What was joined."""

    chains: PixelChains
    which: Ints  #: (n_chains,) old number of each
    n_joins: int


def join_short_chains(
    chains: PixelChains,
    shortest: float,
    farthest: float,
    units: Floats | float = UNITS,
    barred: Flags | None = None,
) -> Joined:
    """Join the ends of chains below a length.

    Parameters
    ----------
    chains : PixelChains
        The pixel boundary.
    shortest : float
        Chains below this length go, where the sectors around the new node allow.
    farthest : float
        How far a node may go from its old place.
    units : float or float64, shape (2,)
        Steps of the grid on which coordinates are exact, a unit of length, of x and y.
    barred : bool, shape (n_chains,), optional
        Chains that stay, however short.

    Returns
    -------
    Joined
        The chains that are left, in their order, their old numbers, and the number of joins.
    """
    curves, ends = curves_of(*chains)
    nothing = Joined(chains, np.arange(len(curves.ends)), 0)
    candidates = _short(curves.raw, curves.offsets, curves.ends, shortest)
    if shortest <= 0.0 or not len(candidates):
        return nothing
    forbidden = np.zeros(len(curves.ends), bool) if barred is None else barred.copy()
    ring, first = rings(curves.raw, curves.offsets, ends.offsets, ends.sockets)
    rank = _ranks(ends.place, ends.kind, chains.graph.shape)
    is_outer = (chains.graph.chain_regions == VOID).any(axis=1)
    on_outer = np.zeros(len(rank), bool)
    on_outer[rows_of(ends.offsets)[is_outer[ends.sockets // 2]]] = True
    grid = _grid_of(curves.raw, chains.graph.shape, max(shortest, 2.0))
    chain = rows_of(curves.offsets)
    for attempt in range(_ATTEMPTS):
        net = Net(
            curves.raw,
            curves.offsets,
            curves.is_frame,
            is_outer,
            curves.ends.copy(),
            np.stack([curves.offsets[:-1] + 1, curves.offsets[1:] - 2], axis=1),
            np.zeros(len(curves.ends), bool),
            ring.copy(),
            first,
            rank.copy(),
            on_outer.copy(),
            ends.place.copy(),
            ends.place,
            np.arange(len(ends.place)),
            np.zeros(len(ends.place)),
        )
        into = _join_all(net, grid, chain, candidates, forbidden, shortest, farthest, ALONG, REACHES)
        if not net.gone.any():
            return nothing
        joined, which = _drawn(chains, net, units)
        bad = _nodes_in_conflict(joined, net, which, units)
        if not bad.any():
            return Joined(joined, which, int(net.gone.sum()))
        forbidden |= net.gone & (bad[into] | (attempt >= _ATTEMPTS - 2))
    raise AssertionError("no join, no conflict")


def _short(raw: Floats, offsets: Ints, ends: Ints, shortest: float) -> Ints:
    """Return the open chains that are shorter, or may become so as their ends move."""
    first, last = raw[offsets[:-1]], raw[offsets[1:] - 1]
    near = np.hypot(*(last - first).T) < 2.0 * shortest
    points = np.diff(offsets)
    return np.flatnonzero(near & (ends[:, 0] >= 0) & (ends[:, 0] != ends[:, 1]) & (points <= 8.0 * shortest + 8.0))


def _ranks(place: Floats, kind: Bytes, shape: tuple[float, float]) -> Ints:
    on_border = (place == 0).any(axis=1) | (place == shape[::-1]).any(axis=1)
    return np.where(kind == PointKind.CORNER, 2, on_border.astype(np.int64))


def _grid_of(points: Floats, shape: tuple[float, float], cell: float) -> Grid:
    n_across, n_up = int(shape[1] / cell) + 1, int(shape[0] / cell) + 1
    return Grid(*in_cells(points, np.arange(len(points)), cell, n_across, n_up), n_across, n_up, cell)


@kernel
def _join_all(
    net: Net,
    grid: Grid,
    chain: Ints,
    candidates: Ints,
    forbidden: Flags,
    shortest: float,
    farthest: float,
    along: Floats,
    reaches: Floats,
) -> Ints:
    """Join in place, shortest chains first; return the node that each chain that is gone became part of."""
    into = np.full(len(net.gone), -1, np.int64)
    star, cut, best_cut = np.empty(MOST, np.int64), np.empty(MOST, np.int64), np.empty(MOST, np.int64)
    length = np.empty(len(candidates))
    for _ in range(_PASSES):
        for k in range(len(candidates)):
            length[k] = _length(net, candidates[k])
        n_joins = 0
        for k in np.argsort(length, kind="mergesort"):
            c = candidates[k]
            if net.gone[c] or forbidden[c] or _length(net, c) >= shortest:
                continue
            n = star_of(net, c, star)
            if n == 0:
                continue
            x, y = best_place(net, c, star, n, shortest, farthest, along)
            if np.isnan(x):
                continue
            reach = best_reach(net, grid, chain, c, star, n, x, y, shortest, 2.0 * farthest, reaches, cut, best_cut)
            if reach > 0.0:
                _join(net, c, star, n, x, y, reach, best_cut)
                into[c] = net.node[c, 0]
                n_joins += 1
        if n_joins == 0:
            break
    for c in range(len(into)):
        if into[c] >= 0:
            into[c] = _least(net, into[c])
    return into


@verb
def _least(net: Net, v: int) -> int:
    """Return the least of the nodes that became node v."""
    least, w = v, net.other[v]
    while w != v:
        least = min(least, w)
        w = net.other[w]
    return int(least)


@verb
def _length(net: Net, c: int) -> float:
    """Length of a chain as it is now, over chords."""
    x, y = net.place[net.node[c, 0], 0], net.place[net.node[c, 0], 1]
    total = 0.0
    for i in range(net.kept[c, 0] + _CHORD - 1, net.kept[c, 1] + 1, _CHORD):
        total += np.hypot(net.raw[i, 0] - x, net.raw[i, 1] - y)
        x, y = net.raw[i, 0], net.raw[i, 1]
    return float(total + np.hypot(net.place[net.node[c, 1], 0] - x, net.place[net.node[c, 1], 1] - y))


@verb
def _join(net: Net, c: int, star: Ints, n: int, x: float, y: float, reach: float, cut: Ints) -> None:
    """Make one node of both ends of chain c."""
    a, b = net.node[c, 0], net.node[c, 1]
    net.gone[c] = True
    net.place[a, 0], net.place[a, 1], net.reach[a] = x, y, reach
    net.place[b, 0], net.place[b, 1], net.reach[b] = x, y, reach
    net.rank[a] = max(net.rank[a], net.rank[b])
    net.on_outer[a] = net.on_outer[a] or net.on_outer[b]
    net.other[a], net.other[b] = net.other[b], net.other[a]  # two rings become one
    for k in range(n):
        net.next[star[k]] = star[(k + 1) % n]
        net.node[star[k] // 2, star[k] % 2] = a
        net.kept[star[k] // 2, star[k] % 2] = cut[k]


def _drawn(chains: PixelChains, net: Net, units: Floats | float) -> tuple[PixelChains, Ints]:
    """Draw what is left as dense points, with spokes; also return the old number of each chain."""
    which = np.flatnonzero(~net.gone)
    has_spoke = _have_spokes(net, which)
    drawn = [_drawn_chain(chains, net, c, units) for c in which[has_spoke].tolist()]
    counts = np.diff(net.offsets)[which]
    counts[has_spoke] = [len(side) for _, side in drawn]
    offsets = np.concatenate([[0], np.cumsum(counts)])
    source = np.arange(offsets[-1]) + np.repeat(net.offsets[which] - offsets[:-1], counts)
    source[np.repeat(has_spoke, counts)] = 0
    raw, side = net.raw[source], chains.side[source]
    for k, new in zip(np.flatnonzero(has_spoke).tolist(), drawn, strict=True):
        raw[offsets[k] : offsets[k + 1]], side[offsets[k] : offsets[k + 1]] = new
    used, node = np.unique(net.node[which], return_inverse=True)
    used, node = used[used >= 0], node.reshape(-1, 2) - np.count_nonzero(used < 0)
    ids = numbered(offsets, node, len(used))
    points = np.empty((int(ids.max()) + 1, 2))
    points[ids] = raw
    kind = np.full(len(points), PointKind.FREE, np.uint8)
    kind[ids[np.repeat(net.is_frame[which], np.diff(offsets))]] = PointKind.FRAME
    kind[: len(used)] = np.where(net.rank[used] == 2, PointKind.CORNER, PointKind.JUNCTION)
    graph = replace(
        chains.graph,
        points=points,
        point_kind=kind,
        chain_offsets=offsets,
        chain_points=ids,
        chain_regions=chains.graph.chain_regions[which],
    )
    return PixelChains(graph, side), which


def _have_spokes(net: Net, which: Ints) -> Flags:
    """Tell which chains have a spoke at one of their ends."""
    return np.asarray(((net.node[which] >= 0) & (net.reach[net.node[which]] > 0.0)).any(axis=1))


def _drawn_chain(chains: PixelChains, net: Net, c: int, units: Floats | float) -> tuple[Floats, Ints]:
    """Return the dense points of a chain with spokes, and what they are; the new ones are on the grid."""
    places = net.place[net.node[c]]
    start, stop = places
    begin, end = net.kept[c, 0], net.kept[c, 1] + 1
    inner, side = net.raw[begin:end], chains.side[begin:end]
    before = snapped(_spoke(start, inner[0] if len(inner) else stop), units)
    after = snapped(_spoke(inner[-1], stop), units) if len(inner) else inner
    start, stop = np.where((net.reach[net.node[c]] > 0.0)[:, None], snapped(places, units), places)
    raw = np.concatenate([start[None], before, inner, after, stop[None]])
    return raw, np.concatenate(
        [[PIXEL_CORNER], 0 * before[:, 0] + ELSEWHERE, side, 0 * after[:, 0] + ELSEWHERE, [PIXEL_CORNER]]
    ).astype(np.int64)


def _spoke(start: Floats, stop: Floats) -> Floats:
    """Return points between two, at most `_STEP` apart."""
    n = int(np.ceil(np.hypot(*(stop - start)) / _STEP))
    return np.asarray(start + np.arange(1, n)[:, None] / max(n, 1) * (stop - start))


def _nodes_in_conflict(chains: PixelChains, net: Net, which: Ints, units: Floats | float) -> Flags:
    """Tell which nodes have a spoke, or a chain with one, that crosses another chain or changed places with it.

    Where chains of one piece cross nowhere, and leave every node in the order they did, all faces are what they were;
    other pieces are far from the spokes.
    """
    graph = chains.graph
    ends = net.node[which]
    has_spoke = (ends >= 0) & (net.reach[ends] > 0.0)
    chain = rows_of(graph.chain_offsets, gaps=True)
    marks = find_conflicts(graph.points, graph.segments, chain, _have_spokes(net, which), graph.shape, units)
    is_hit = np.zeros(len(which), bool)
    is_hit[chain[marks >= CROSSING]] = True
    is_hit |= _changed_order(chains, net, which)
    bad = np.zeros(len(net.place), bool)
    bad[ends[is_hit][has_spoke[is_hit]]] = True
    for v in np.flatnonzero(bad).tolist():  # the least of the nodes that became one stands for all
        group, w = [v], net.other[v]
        while w != v:
            group.append(int(w))
            w = net.other[w]
        bad[min(group)] = True
    return bad


def _changed_order(chains: PixelChains, net: Net, which: Ints) -> Flags:
    """Tell which chains leave a node in another order than they did."""
    graph, (_, ends) = chains.graph, ends_of(chains.graph)
    ring, _ = rings(graph.points[graph.chain_points], graph.chain_offsets, ends.offsets, ends.sockets)
    new = np.full(len(net.gone), -1, np.int64)
    new[which] = np.arange(len(which))
    old = (2 * which[:, None] + [0, 1]).ravel()
    wanted = net.next[old]
    wanted = np.where(wanted >= 0, 2 * new[wanted // 2] + wanted % 2, -1)
    return np.asarray((ring != wanted).reshape(-1, 2).any(axis=1))
