r"""The star that takes the place of a short chain: where its centre may lie, and how far its spokes reach.

Asked are the sectors between the chains that pass by, seen from the centre at some distance, then those between the
spokes, and that nothing else is within twice their reach::

      \      /             \    /
       a----b       =>       q        a place q along the chain, spokes to the last points within reach
      /      \             /    \
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints, Labels
from imgquad_core.jit import verb

ALONG = np.array([0.5, 0.35, 0.65, 0.2, 0.8, 0.0, 1.0])  # of the chain: places of the new node that are looked at
_SEEN_AT, _SEEN_LEAST = 1.25, 5.0  # of the shortest length, and px: distance at which sectors are looked at
_LEAST_SEEN, _LEAST_SECTOR = np.radians(40.0), np.radians(38.0)  # sectors there, and of the spokes
REACHES = np.array([1.0, 1.4, 2.0, 2.8])  # lengths of spokes over that of the shortest that covers the old nodes
_BEYOND = 0.75  # px that a spoke reaches beyond the old nodes at least
MOST = 24  # chains at a node


class Net(NamedTuple):
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


class Grid(NamedTuple):
    """Dense points in square cells."""

    start: Labels
    items: Labels
    n_across: int
    n_up: int
    cell: float


@verb
def star_of(net: Net, c: int, star: Ints) -> int:
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
def best_place(
    net: Net, c: int, star: Ints, n: int, shortest: float, farthest: float, along: Floats
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
def _place_at(net: Net, c: int, t: float) -> tuple[float, float]:
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
def _gone_from(net: Net, v: int, x: float, y: float) -> float:
    """Largest distance of (x, y) from the old places of all that became node v."""
    w, farthest = v, 0.0
    while True:
        farthest = max(farthest, np.hypot(net.old[w, 0] - x, net.old[w, 1] - y))
        w = net.other[w]
        if w == v:
            return float(farthest)


@verb
def _seen_sector(net: Net, star: Ints, n: int, x: float, y: float, distance: float, shortest: float) -> float:
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
def _bearing(net: Net, s: int, x: float, y: float, distance: float) -> float:
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
def best_reach(
    net: Net,
    grid: Grid,
    chain: Ints,
    c: int,
    star: Ints,
    n: int,
    x: float,
    y: float,
    shortest: float,
    aside: float,
    reaches: Floats,
    cut: Ints,
    best_cut: Ints,
) -> float:
    """Choose the length of spokes with the widest least sector, and where they end; 0 if none is free and wide."""
    best, best_reach = _LEAST_SECTOR, 0.0
    covers = max(_gone_from(net, net.node[c, 0], x, y), _gone_from(net, net.node[c, 1], x, y)) + _BEYOND
    for factor in reaches:
        reach = factor * covers
        if not _cut_spokes(net, star, n, x, y, reach, aside, cut) or not _is_free(
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
def _cut_spokes(net: Net, star: Ints, n: int, x: float, y: float, reach: float, aside: float, cut: Ints) -> bool:
    """Find the last point of each chain within reach, before it leaves twice the reach."""
    for k in range(n):
        c, side = star[k] // 2, star[k] % 2
        step = 1 - 2 * side
        i, end = net.kept[c, side], net.kept[c, 1 - side]
        cut[k] = i
        # a spoke that is there already may be longer, within the disc that is free
        found = (end - i) * step >= 0 and np.hypot(net.raw[i, 0] - x, net.raw[i, 1] - y) <= 2.0 * reach
        stays = True
        while stays and (end - i) * step >= 0:
            d2 = (net.raw[i, 0] - x) ** 2 + (net.raw[i, 1] - y) ** 2
            stays = d2 <= 4.0 * reach * reach
            if d2 <= reach * reach:
                cut[k] = i
                found = True
            i += step
        far = net.node[c, 1 - side]
        # one that leaves and comes back goes around something, which would be lost
        if stays and np.hypot(net.place[far, 0] - x, net.place[far, 1] - y) <= max(reach, 1e-6):
            cut[k] = end + step  # straight to its other end
            found = True
        if not found or _goes_around(net, star[k], cut[k], x, y, aside):
            return False
    return True


@verb
def _goes_around(net: Net, s: int, cut: int, x: float, y: float, aside: float) -> bool:
    """Whether the points that a spoke from (x, y) leaves out are farther from it than `aside`.

    Then they go around a cave or a cape, which would be lost::

             .--.
            |    |
        q---.    .---
    """
    c, side = s // 2, s % 2
    step = 1 - 2 * side
    i, far = net.kept[c, side], net.node[c, 1 - side]
    to_end = (net.kept[c, 1 - side] - cut) * step < 0
    px = (net.place[far, 0] if to_end else net.raw[cut, 0]) - x
    py = (net.place[far, 1] if to_end else net.raw[cut, 1]) - y
    square = max(px * px + py * py, 1e-12)
    while (cut - i) * step > 0:
        dx, dy = net.raw[i, 0] - x, net.raw[i, 1] - y
        share = min(max((dx * px + dy * py) / square, 0.0), 1.0)
        if np.hypot(dx - share * px, dy - share * py) > aside:
            return True
        i += step
    return False


@verb
def _is_free(
    net: Net, grid: Grid, chain: Ints, c: int, star: Ints, n: int, x: float, y: float, reach: float, shortest: float
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
def _is_beside(net: Net, star: Ints, n: int, d: int, x: float, y: float, shortest: float) -> bool:
    """Whether chain d ends at a node nearer than `shortest` that a chain of the star leads to."""
    for k in range(n):
        far = net.node[star[k] // 2, 1 - star[k] % 2]
        if (net.node[d, 0] == far or net.node[d, 1] == far) and np.hypot(
            net.place[far, 0] - x, net.place[far, 1] - y
        ) < shortest:
            return True
    return False


@verb
def _is_near_end(net: Net, star: Ints, n: int, d: int, i: int, x: float, y: float, radius: float) -> bool:
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
def _spoke_sector(net: Net, star: Ints, n: int, x: float, y: float, cut: Ints) -> float:
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
