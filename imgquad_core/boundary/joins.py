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
from imgquad_core.jit import kernel, verb
from imgquad_core.model import VOID, PointKind

from .curves import ELSEWHERE, PIXEL_CORNER, PixelChains, curves_of, numbered

_CHORD = 6  # dense points from chord to chord of a chain's length: arcs of stairs are up to 41 % too long
_ALONG = np.array([0.5, 0.35, 0.65, 0.2, 0.8, 0.0, 1.0])  # of the chain: places of the new node that are looked at
_SEEN_AT, _SEEN_LEAST = 1.25, 5.0  # of the shortest length, and px: distance at which sectors are looked at
_LEAST_SEEN, _LEAST_SECTOR = np.radians(40.0), np.radians(38.0)  # sectors there, and of the spokes
_REACHES = np.array([1.0, 1.4, 2.0, 2.8])  # lengths of spokes over that of the shortest that covers the old nodes
_BEYOND = 0.75  # px that a spoke reaches beyond the old nodes at least
_STEP = 0.6  # px between dense points on a spoke, at most
_MOST = 24  # chains at a node
_PASSES = 10  # over all short chains: a join may make room for another
_ATTEMPTS = 12  # with joins forbidden whose chains cross others


class Joined(NamedTuple):
    """What was joined."""

    chains: PixelChains
    which: Ints  #: (n_chains,) old number of each
    n_joins: int


class _Net(NamedTuple):
    """Chains, of which some are gone and some begin with a spoke, as they are joined.

    Socket ``2 * chain + side`` is an end of a chain; the sockets of a node are a ring, counter-clockwise.
    """

    raw: Floats
    offsets: Ints
    is_frame: Flags
    is_outer: Flags  # (n_chains,) on the border of what is meshed: the picture's, or that of void pixels
    node: Ints  # (n_chains, 2) node at either end
    kept: Ints  # (n_chains, 2) first and last dense point that is kept, without the nodes
    gone: Flags  # (n_chains,)
    next: Ints  # (2 * n_chains,) next socket round the node
    socket: Ints  # (n_nodes,) one socket of each node
    rank: Ints  # (n_nodes,) 0 inside the picture, 1 on its border, 2 its corner
    on_outer: Flags  # (n_nodes,) at the end of such a chain
    place: Floats  # (n_nodes, 2)
    old: Floats  # (n_nodes, 2) where the node was before
    other: Ints  # (n_nodes,) next one of the nodes that became this one, a ring
    reach: Floats  # (n_nodes,) of the spokes, 0 for none


class _Grid(NamedTuple):
    """Dense points in square cells."""

    start: Ints
    items: Ints
    n_across: int
    n_up: int
    cell: float


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
    on_outer[np.repeat(np.arange(len(rank)), np.diff(ends.offsets))[is_outer[ends.sockets // 2]]] = True
    grid = _grid_of(curves.raw, chains.graph.shape, max(shortest, 2.0))
    chain = np.repeat(np.arange(len(curves.ends)), np.diff(curves.offsets))
    for attempt in range(_ATTEMPTS):
        net = _Net(
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
        into = _join_all(net, grid, chain, candidates, forbidden, shortest, farthest, _ALONG, _REACHES)
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


def rings(raw: Floats, offsets: Ints, node_offsets: Ints, sockets: Ints) -> tuple[Ints, Ints]:
    """Return the next socket round its node for each socket, and one socket of each node."""
    chain, is_end = sockets // 2, sockets % 2 == 1
    at = np.where(is_end, offsets[chain + 1] - 1, offsets[chain])
    step = raw[np.where(is_end, at - 1, at + 1)] - raw[at]
    node = np.repeat(np.arange(len(node_offsets) - 1), np.diff(node_offsets))
    turn = np.arctan2(step[:, 1], step[:, 0])
    order = sockets[np.lexsort((turn, node))]
    ring = np.full(2 * (len(offsets) - 1), -1, np.int64)
    following = np.roll(order, -1)
    following[node_offsets[1:] - 1] = order[node_offsets[:-1]]
    ring[order] = following
    return ring, order[node_offsets[:-1]]


def _ranks(place: Floats, kind: Bytes, shape: tuple[float, float]) -> Ints:
    on_border = (place == 0).any(axis=1) | (place == shape[::-1]).any(axis=1)
    return np.where(kind == PointKind.CORNER, 2, on_border.astype(np.int64))


def _grid_of(points: Floats, shape: tuple[float, float], cell: float) -> _Grid:
    n_across, n_up = int(shape[1] / cell) + 1, int(shape[0] / cell) + 1
    column, row = np.minimum((points / cell).astype(np.int64), [n_across - 1, n_up - 1]).T
    at = row * n_across + column
    start = np.concatenate([[0], np.cumsum(np.bincount(at, minlength=n_across * n_up))])
    return _Grid(start, np.argsort(at, kind="stable"), n_across, n_up, cell)


@kernel
def _join_all(
    net: _Net,
    grid: _Grid,
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
    star, cut, best_cut = np.empty(_MOST, np.int64), np.empty(_MOST, np.int64), np.empty(_MOST, np.int64)
    length = np.empty(len(candidates))
    for _ in range(_PASSES):
        for k in range(len(candidates)):
            length[k] = _length(net, candidates[k])
        n_joins = 0
        for k in np.argsort(length, kind="mergesort"):
            c = candidates[k]
            if net.gone[c] or forbidden[c] or _length(net, c) >= shortest:
                continue
            n = _star(net, c, star)
            if n == 0:
                continue
            x, y = _best_place(net, c, star, n, shortest, farthest, along)
            if np.isnan(x):
                continue
            reach = _best_reach(net, grid, chain, c, star, n, x, y, shortest, reaches, cut, best_cut)
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
def _least(net: _Net, v: int) -> int:
    """Return the least of the nodes that became node v."""
    least, w = v, net.other[v]
    while w != v:
        least = min(least, w)
        w = net.other[w]
    return int(least)


@verb
def _length(net: _Net, c: int) -> float:
    """Length of a chain as it is now, over chords."""
    x, y = net.place[net.node[c, 0], 0], net.place[net.node[c, 0], 1]
    total = 0.0
    for i in range(net.kept[c, 0] + _CHORD - 1, net.kept[c, 1] + 1, _CHORD):
        total += np.hypot(net.raw[i, 0] - x, net.raw[i, 1] - y)
        x, y = net.raw[i, 0], net.raw[i, 1]
    return float(total + np.hypot(net.place[net.node[c, 1], 0] - x, net.place[net.node[c, 1], 1] - y))


@verb
def _star(net: _Net, c: int, star: Ints) -> int:
    """List the sockets around both ends of chain c but its own, in their cyclic order; 0 where it must stay."""
    a, b = net.node[c, 0], net.node[c, 1]
    if (net.rank[a] == 2 and net.rank[b] == 2) or (net.rank[a] > 0 and net.rank[b] > 0 and not net.is_frame[c]):
        return 0
    if net.on_outer[a] and net.on_outer[b] and not net.is_outer[c]:
        return 0  # what is meshed would be cut in two there
    n = 0
    for side in range(2):
        s = net.next[2 * c + side]
        while s != 2 * c + side:
            far = net.node[s // 2, 1 - s % 2]
            if far == a or far == b or n == len(star):
                return 0  # a lens, or a loop
            star[n] = s
            n += 1
            s = net.next[s]
    return n


@verb
def _best_place(
    net: _Net, c: int, star: Ints, n: int, shortest: float, farthest: float, along: Floats
) -> tuple[float, float]:
    """Choose the place along chain c whose star has the widest least sector; nan where all are too sharp."""
    a, b = net.node[c, 0], net.node[c, 1]
    best, best_x, best_y = _LEAST_SEEN, np.nan, np.nan
    seen_at = max(_SEEN_AT * shortest, _SEEN_LEAST)
    for t in along:
        if (net.rank[a] > net.rank[b] and t != 0.0) or (net.rank[a] < net.rank[b] and t != 1.0):
            continue
        x, y = _place_at(net, c, t)
        if max(_gone_from(net, a, x, y), _gone_from(net, b, x, y)) > farthest:
            continue
        sector = min(
            _seen_sector(net, star, n, x, y, seen_at, shortest),
            _seen_sector(net, star, n, x, y, 2.0 * seen_at, shortest),
        )
        if sector > best + 1e-9:
            best, best_x, best_y = sector, x, y
    return best_x, best_y


@verb
def _place_at(net: _Net, c: int, t: float) -> tuple[float, float]:
    """Point at a share of the arc of chain c."""
    a, b = net.node[c, 0], net.node[c, 1]
    if t == 0.0:
        return net.place[a, 0], net.place[a, 1]
    if t == 1.0:
        return net.place[b, 0], net.place[b, 1]
    total = 0.0
    for goal in range(2):
        x, y, gone = net.place[a, 0], net.place[a, 1], 0.0
        for i in range(net.kept[c, 0], net.kept[c, 1] + 2):
            is_last = i > net.kept[c, 1]
            px = net.place[b, 0] if is_last else net.raw[i, 0]
            py = net.place[b, 1] if is_last else net.raw[i, 1]
            step = np.hypot(px - x, py - y)
            if goal and gone + step >= t * total and step > 0.0:
                share = (t * total - gone) / step
                return x + share * (px - x), y + share * (py - y)
            gone += step
            x, y = px, py
        total = gone
    return net.place[b, 0], net.place[b, 1]


@verb
def _gone_from(net: _Net, v: int, x: float, y: float) -> float:
    """Largest distance of (x, y) from the old places of all that became node v."""
    w, farthest = v, 0.0
    while True:
        farthest = max(farthest, np.hypot(net.old[w, 0] - x, net.old[w, 1] - y))
        w = net.other[w]
        if w == v:
            return float(farthest)


@verb
def _seen_sector(net: _Net, star: Ints, n: int, x: float, y: float, distance: float, shortest: float) -> float:
    """Least sector between the chains of a star as they pass a distance from (x, y); 0 where their order differs.

    Chains that are to go themselves do not count.
    """
    least, total = 2.0 * np.pi, 0.0
    first = last = 0.0
    count = 0
    for k in range(n):
        far = net.node[star[k] // 2, 1 - star[k] % 2]
        if np.hypot(net.place[far, 0] - x, net.place[far, 1] - y) < shortest:
            continue
        turn = _bearing(net, star[k], x, y, distance)
        if count == 0:
            first = turn
        else:
            sector = (turn - last) % (2.0 * np.pi)
            least, total = min(least, sector), total + sector
        last = turn
        count += 1
    if count > 1:
        sector = (first - last) % (2.0 * np.pi)
        least, total = min(least, sector), total + sector
    return least if total < 2.0 * np.pi + 1e-6 else 0.0


@verb
def _bearing(net: _Net, s: int, x: float, y: float, distance: float) -> float:
    """Direction from (x, y) to where the chain of a socket first is that far away, or to its other end."""
    c, side = s // 2, s % 2
    step = 1 - 2 * side
    i, end = net.kept[c, side], net.kept[c, 1 - side]
    while (end - i) * step >= 0:
        dx, dy = net.raw[i, 0] - x, net.raw[i, 1] - y
        if dx * dx + dy * dy >= distance * distance:
            return float(np.arctan2(dy, dx))
        i += step
    far = net.node[c, 1 - side]
    return float(np.arctan2(net.place[far, 1] - y, net.place[far, 0] - x))


@verb
def _best_reach(
    net: _Net,
    grid: _Grid,
    chain: Ints,
    c: int,
    star: Ints,
    n: int,
    x: float,
    y: float,
    shortest: float,
    reaches: Floats,
    cut: Ints,
    best_cut: Ints,
) -> float:
    """Choose the length of spokes with the widest least sector, and where they end; 0 if none is free and wide."""
    best, best_reach = _LEAST_SECTOR, 0.0
    covers = max(_gone_from(net, net.node[c, 0], x, y), _gone_from(net, net.node[c, 1], x, y)) + _BEYOND
    for factor in reaches:
        reach = factor * covers
        if not _cut_spokes(net, star, n, x, y, reach, cut) or not _is_free(
            net, grid, chain, c, star, n, x, y, reach, shortest
        ):
            continue
        sector = _spoke_sector(net, star, n, x, y, cut)
        if sector > best + 1e-9:
            best, best_reach = sector, reach
            for k in range(n):
                best_cut[k] = cut[k]
    return best_reach


@verb
def _cut_spokes(net: _Net, star: Ints, n: int, x: float, y: float, reach: float, cut: Ints) -> bool:
    """Find the last point of each chain within reach, before it leaves twice the reach."""
    for k in range(n):
        c, side = star[k] // 2, star[k] % 2
        step = 1 - 2 * side
        i, end = net.kept[c, side], net.kept[c, 1 - side]
        cut[k] = i
        # a spoke that is there already may be longer, within the disc that is free
        found = (end - i) * step >= 0 and np.hypot(net.raw[i, 0] - x, net.raw[i, 1] - y) <= 2.0 * reach
        while (end - i) * step >= 0:
            d2 = (net.raw[i, 0] - x) ** 2 + (net.raw[i, 1] - y) ** 2
            if d2 > 4.0 * reach * reach:
                break
            if d2 <= reach * reach:
                cut[k] = i
                found = True
            i += step
        far = net.node[c, 1 - side]
        if np.hypot(net.place[far, 0] - x, net.place[far, 1] - y) <= max(reach, 1e-6):
            cut[k] = end + step  # straight to its other end
            found = True
        if not found:
            return False
    return True


@verb
def _is_free(
    net: _Net, grid: _Grid, chain: Ints, c: int, star: Ints, n: int, x: float, y: float, reach: float, shortest: float
) -> bool:
    """Whether no chain but those of the star, up to where they leave, is within twice the reach of (x, y).

    Chains of a node that is to be joined as well may be there.
    """
    radius = 2.0 * reach
    for k in range(n):  # no other spokes near
        far = net.node[star[k] // 2, 1 - star[k] % 2]
        apart = np.hypot(net.place[far, 0] - x, net.place[far, 1] - y)
        if net.reach[far] > 0.0 and shortest <= apart < radius + net.reach[far]:
            return False
    low, high = max(int((y - radius) / grid.cell), 0), min(int((y + radius) / grid.cell), grid.n_up - 1)
    left, right = max(int((x - radius) / grid.cell), 0), min(int((x + radius) / grid.cell), grid.n_across - 1)
    for row in range(low, high + 1):
        for at in range(grid.start[row * grid.n_across + left], grid.start[row * grid.n_across + right + 1]):
            i = grid.items[at]
            d = chain[i]
            if d == c or net.gone[d] or (net.raw[i, 0] - x) ** 2 + (net.raw[i, 1] - y) ** 2 >= radius * radius:
                continue
            if not (net.kept[d, 0] <= i <= net.kept[d, 1] or net.node[d, 0] < 0):
                continue
            if not _is_near_end(net, star, n, d, i, x, y, radius) and not _is_beside(net, star, n, d, x, y, shortest):
                return False
    return True


@verb
def _is_beside(net: _Net, star: Ints, n: int, d: int, x: float, y: float, shortest: float) -> bool:
    """Whether chain d ends at a node nearer than `shortest` that a chain of the star leads to."""
    for k in range(n):
        far = net.node[star[k] // 2, 1 - star[k] % 2]
        if (net.node[d, 0] == far or net.node[d, 1] == far) and np.hypot(
            net.place[far, 0] - x, net.place[far, 1] - y
        ) < shortest:
            return True
    return False


@verb
def _is_near_end(net: _Net, star: Ints, n: int, d: int, i: int, x: float, y: float, radius: float) -> bool:
    """Whether point i is on a chain of the star, before it leaves the disc for the first time."""
    for k in range(n):
        if star[k] // 2 != d:
            continue
        step = 1 - 2 * (star[k] % 2)
        j = net.kept[d, star[k] % 2]
        while j != i:
            if (net.raw[j, 0] - x) ** 2 + (net.raw[j, 1] - y) ** 2 > radius * radius:
                return False
            j += step
        return True
    return False


@verb
def _spoke_sector(net: _Net, star: Ints, n: int, x: float, y: float, cut: Ints) -> float:
    """Least sector between spokes; 0 where their order differs from that of the chains."""
    least, total = 2.0 * np.pi, 0.0
    first = last = 0.0
    for k in range(n + 1):
        if k == n:
            turn = first
        else:
            c, side = star[k] // 2, star[k] % 2
            if (net.kept[c, 1 - side] - cut[k]) * (1 - 2 * side) < 0:
                far = net.node[c, 1 - side]
                turn = np.arctan2(net.place[far, 1] - y, net.place[far, 0] - x)
            else:
                turn = np.arctan2(net.raw[cut[k], 1] - y, net.raw[cut[k], 0] - x)
        if k == 0:
            first = turn
        elif n > 1:
            sector = (turn - last) % (2.0 * np.pi)
            least, total = min(least, sector), total + sector
        last = turn
    return least if total < 2.0 * np.pi + 1e-6 else 0.0


@verb
def _join(net: _Net, c: int, star: Ints, n: int, x: float, y: float, reach: float, cut: Ints) -> None:
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


def _drawn(chains: PixelChains, net: _Net, units: Floats | float) -> tuple[PixelChains, Ints]:
    """Draw what is left as dense points, with spokes; also return the old number of each chain."""
    which = np.flatnonzero(~net.gone)
    drawn = [_drawn_chain(chains, net, c) for c in which.tolist()]
    offsets = np.concatenate([[0], np.cumsum([len(side) for _, side in drawn])])
    raw, side = (np.concatenate(parts) for parts in zip(*drawn, strict=True))
    used, node = np.unique(net.node[which], return_inverse=True)
    used, node = used[used >= 0], node.reshape(-1, 2) - np.count_nonzero(used < 0)
    ids = numbered(offsets, node, len(used))
    points = np.empty((int(ids.max()) + 1, 2))
    points[ids] = snapped(raw, units)
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


def _drawn_chain(chains: PixelChains, net: _Net, c: int) -> tuple[Floats, Ints]:
    """Return the dense points of a chain, and what they are."""
    first, last = net.offsets[c], net.offsets[c + 1]
    if net.node[c, 0] < 0 or (net.reach[net.node[c]] == 0.0).all():
        return net.raw[first:last], chains.side[first:last]
    start, stop = net.place[net.node[c]]
    begin, end = net.kept[c, 0], net.kept[c, 1] + 1
    inner, side = net.raw[begin:end], chains.side[begin:end]
    before = _spoke(start, inner[0] if len(inner) else stop)
    after = _spoke(inner[-1], stop) if len(inner) else inner
    raw = np.concatenate([start[None], before, inner, after, stop[None]])
    return raw, np.concatenate(
        [[PIXEL_CORNER], 0 * before[:, 0] + ELSEWHERE, side, 0 * after[:, 0] + ELSEWHERE, [PIXEL_CORNER]]
    ).astype(np.int64)


def _spoke(start: Floats, stop: Floats) -> Floats:
    """Return points between two, at most `_STEP` apart."""
    n = int(np.ceil(np.hypot(*(stop - start)) / _STEP))
    return np.asarray(start + np.arange(1, n)[:, None] / max(n, 1) * (stop - start))


def _nodes_in_conflict(chains: PixelChains, net: _Net, which: Ints, units: Floats | float) -> Flags:
    """Tell which nodes have a spoke, or a chain with one, that crosses another chain or changed places with it.

    Where chains of one piece cross nowhere, and leave every node in the order they did, all faces are what they were;
    other pieces are far from the spokes.
    """
    graph = chains.graph
    ends = net.node[which]
    has_spoke = (ends >= 0) & (net.reach[ends] > 0.0)
    chain = np.repeat(np.arange(len(which)), np.diff(graph.chain_offsets) - 1)
    marks = find_conflicts(graph.points, graph.segments, chain, has_spoke.any(axis=1), graph.shape, units)
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


def _changed_order(chains: PixelChains, net: _Net, which: Ints) -> Flags:
    """Tell which chains leave a node in another order than they did."""
    curves, ends = curves_of(*chains)
    ring, _ = rings(curves.raw, curves.offsets, ends.offsets, ends.sockets)
    new = np.full(len(net.gone), -1, np.int64)
    new[which] = np.arange(len(which))
    old = (2 * which[:, None] + [0, 1]).ravel()
    wanted = net.next[old]
    wanted = np.where(wanted >= 0, 2 * new[wanted // 2] + wanted % 2, -1)
    return np.asarray((ring != wanted).reshape(-1, 2).any(axis=1))
