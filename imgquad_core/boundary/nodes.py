"""Where the nodes lie on the curves, and how many there are.

The paper moves each sample to the point of the curve that is equally far from both neighbours, and repeats this
until the edges' lengths agree. The same is had at once by nodes at equal steps of the integral of ds / size between
two corners: neighbours differ by what the size differs. What is left (a chord is shorter than its arc) is evened out
by the paper's move, `even_out`, on the curve itself and in whatever direction it runs.

    o = coarse node (even place), . = node halfway between them (odd place), x = corner or end of the chain

    x--.--o--.--o--.--o--.--x     4 coarse segments, 8 final edges
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Bytes, Flags, Floats, Ints
from imgquad_core.geometry.conflicts import CROSSING, SHARP, find_conflicts
from imgquad_core.jit import kernel, verb

from .curves import Curves, Ends, numbered

_LONG = 2.3  # coarse segments from which a piece gets an even number of them, for meshing on the next stride
_SHORT = 0.7  # the same beside a corner: a short piece there would keep both faces of a long chain from that
_COARSE = 0.3  # mean size over asked size from which that is of use
_VERY_LONG = 30.0  # coarse segments from which their number may be made a multiple of six
_SWEEPS = 3  # over the nodes of a chain that even out its edges: each goes halfway, so an eighth of the way is left
_LEAST_SECTOR = np.radians(35.0)  # sharper sectors are blunted; tips of chains are rounded below 37 degrees


def mark_sharp(
    points: Floats,
    chain_points: Ints,
    offsets: Ints,
    node_offsets: Ints,
    sockets: Ints,
    least: float,
    marks: Bytes,
) -> None:
    """Mark the segments on both sides of sectors of less than `least` radians (below a right angle), in place."""
    _mark_sectors(points, chain_points, offsets, node_offsets, sockets, float(np.tan(least)), marks)


@kernel
def _mark_sectors(
    points: Floats,
    chain_points: Ints,
    offsets: Ints,
    node_offsets: Ints,
    sockets: Ints,
    tangent: float,
    marks: Bytes,
) -> None:
    for c in range(len(offsets) - 1):
        first, last = offsets[c], offsets[c + 1] - 1
        is_open = chain_points[first] != chain_points[last]
        for i in range(first + is_open, last):
            before = i - 1 if i > first else last - 1
            if _is_sharp(points, chain_points[i], chain_points[before], chain_points[i + 1], tangent):
                _mark_sharp(marks, i - c)
                _mark_sharp(marks, before - c)
    for v in range(len(node_offsets) - 1):
        for k in range(node_offsets[v], node_offsets[v + 1]):
            mine, p = _segment_at(chain_points, offsets, sockets[k])
            for j in range(k + 1, node_offsets[v + 1]):
                other, q = _segment_at(chain_points, offsets, sockets[j])
                if _is_sharp(points, v, p, q, tangent):
                    _mark_sharp(marks, mine)
                    _mark_sharp(marks, other)


@verb
def _segment_at(chain_points: Ints, offsets: Ints, socket: int) -> tuple[int, int]:
    """Return the segment at an end of a chain, and the point that it leads to."""
    c, is_end = socket // 2, socket % 2
    at = offsets[c + 1] - 2 if is_end else offsets[c]
    return at - c, chain_points[at + 1 - is_end]


@verb
def _mark_sharp(marks: Bytes, segment: int) -> None:
    marks[segment] = max(marks[segment], SHARP)


@verb
def _is_sharp(points: Floats, v: int, p: int, q: int, tangent: float) -> bool:
    """Tell whether the angle between the segments from v to p and to q is below that of a tangent."""
    ux, uy = points[p, 0] - points[v, 0], points[p, 1] - points[v, 1]
    wx, wy = points[q, 0] - points[v, 0], points[q, 1] - points[v, 1]
    return bool(abs(ux * wy - uy * wx) < tangent * (ux * wx + uy * wy))


class Placement(NamedTuple):
    """Nodes on the curves: chain c has ``at[offsets[c]:offsets[c + 1]]``, both ends among them."""

    offsets: Ints
    at: Floats  #: place as a fractional index of dense points
    is_corner: Flags


def joined(parts: Sequence[Placement]) -> Placement:
    """Join the placements of some chains and those that follow them."""
    begins = np.cumsum([0, *(part.offsets[-1] for part in parts)]).tolist()
    offsets = [part.offsets[:-1] + begin for part, begin in zip(parts, begins[:-1], strict=True)]
    at, is_corner = (np.concatenate(arrays) for arrays in list(zip(*parts, strict=True))[1:])
    return Placement(np.append(np.concatenate(offsets), begins[-1]), at, is_corner)


@kernel
def place_nodes(
    curves: Curves,
    size: Floats,
    limit: Floats,
    is_corner: Flags,
    at_least: Ints,
    exact: Flags,
    edge_multiple: int,
) -> Placement:
    """Place the final nodes on every chain; `curves` may have the offsets of some chains only.

    Parameters
    ----------
    curves : Curves
        The chains; `arc` is that along the smoothed ones.
    size, limit : float64, shape (n,)
        Wanted length of final edges at each dense point, and the asked one.
    is_corner : bool, shape (n,)
        Dense points that become nodes.
    at_least : int64, shape (n_chains,)
        Least number of coarse segments of each chain.
    exact : bool, shape (n_chains,)
        Chains that get a coarse node at every dense point.
    edge_multiple : int
        Very long pieces get a multiple of this many final edges; even.

    Returns
    -------
    Placement
        An even number of final edges for every piece between corners.
    """
    cost = np.empty(len(size))
    n_nodes = 0
    for c in range(len(exact)):
        cost[curves.offsets[c]] = 0.0
        for i in range(curves.offsets[c] + 1, curves.offsets[c + 1]):
            step = max(curves.arc[i] - curves.arc[i - 1], 1e-9)
            cost[i] = cost[i - 1] + 2 * step / (size[i] + size[i - 1])
            n_nodes += 2 + 16 * is_corner[i]
        n_nodes += 24 + int(cost[curves.offsets[c + 1] - 1]) * 2
    offsets = np.zeros(len(exact) + 1, np.int64)
    at = np.empty(n_nodes)
    corner = np.zeros(len(at), np.bool_)
    for c in range(len(exact)):
        first, last = curves.offsets[c], curves.offsets[c + 1] - 1
        n = offsets[c]
        at[n] = first
        corner[n] = is_corner[first]
        begin = first
        pieces = 1
        for i in range(first + 1, last):
            pieces += is_corner[i]
        for i in range(first + 1, last + 1):
            if i < last and not is_corner[i] and not exact[c]:
                continue
            least = -(-at_least[c] // pieces)
            number = 1 if exact[c] else _count(curves, cost, limit, is_corner, begin, i, least, edge_multiple)
            divide(cost, begin, i, 2 * number, at, n)
            n += 2 * number
            corner[n] = is_corner[i]
            begin = i
        offsets[c + 1] = n + 1
    return Placement(offsets, at[: offsets[-1]], corner[: offsets[-1]])


@verb
def _count(
    curves: Curves, cost: Floats, limit: Floats, is_corner: Flags, begin: int, end: int, least: int, edge_multiple: int
) -> int:
    """Choose the number of coarse segments of a piece."""
    total = 0.5 * (cost[end] - cost[begin])
    length = curves.arc[end] - curves.arc[begin]
    enough = _SHORT if is_corner[begin] or is_corner[end] else _LONG
    if total > enough and length > 2 * _COARSE * total * limit[begin]:
        step = edge_multiple // 2 if total > _VERY_LONG else 2
        return step * max(int(total / step + 0.5), max((least + step - 1) // step, 1))
    return max(int(np.ceil(total - 0.3)), least)


@verb
def divide(cost: Floats, begin: int, end: int, number: int, at: Floats, n: int) -> None:
    """Put `number` equal steps of cost between two dense points behind node n."""
    j = begin
    for k in range(1, number):
        target = cost[begin] + (cost[end] - cost[begin]) * k / number
        while j < end - 1 and cost[j + 1] < target:
            j += 1
        at[n + k] = j + (target - cost[j]) / (cost[j + 1] - cost[j])
    at[n + number] = end


@verb
def _point(points: Floats, at: float) -> tuple[float, float]:
    i = min(int(at), len(points) - 2)
    t = at - i
    return (
        points[i, 0] + t * (points[i + 1, 0] - points[i, 0]),
        points[i, 1] + t * (points[i + 1, 1] - points[i, 1]),
    )


@kernel
def points_at(points: Floats, at: Floats) -> Floats:
    """Points of the curves at fractional indices."""
    found = np.empty((len(at), 2))
    for k in range(len(at)):
        found[k, 0], found[k, 1] = _point(points, at[k])
    return found


@kernel
def even_out(points: Floats, placed: Placement, exact: Flags, edge_ratio: float) -> None:
    """Move nodes towards the bisector of their neighbours, along the curve, until edges keep within `edge_ratio`.

    A node goes halfway to the point of the curve where the edges to both neighbours are equal, which is where the
    curve crosses the perpendicular bisector (paper, eq. 1). Corners and chains of `exact` stay as they are.
    """
    at = placed.at
    for c in range(len(exact)):
        first, last = placed.offsets[c], placed.offsets[c + 1] - 1
        for _ in range(0 if exact[c] else _SWEEPS):
            ax, ay = _point(points, at[first])
            x, y = _point(points, at[first + 1])
            for k in range(first + 1, last):
                bx, by = _point(points, at[k + 1])
                before, after = np.hypot(x - ax, y - ay), np.hypot(bx - x, by - y)
                if not placed.is_corner[k] and max(before, after) > edge_ratio * min(before, after):
                    at[k] = 0.5 * (at[k] + _bisector_crossing(points, at[k - 1], at[k + 1], ax, ay, bx, by))
                    x, y = _point(points, at[k])
                ax, ay, x, y = x, y, bx, by


@verb
def _bisector_crossing(points: Floats, low: float, high: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Where the curve from node a to node b crosses the perpendicular bisector of their chord."""
    nx, ny = bx - ax, by - ay
    offset = 0.5 * (nx * (ax + bx) + ny * (ay + by))
    for _ in range(12):
        middle = 0.5 * (low + high)
        x, y = _point(points, middle)
        if nx * x + ny * y < offset:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


class Nodes(NamedTuple):
    """Nodes on the curves, with ids: ends of chains first, then the others chain by chain."""

    points: Floats  #: (n, 2)
    chain_points: Ints  #: ids of the nodes of every chain, in the order of `placed.at`
    placed: Placement


class Strided(NamedTuple):
    """Polylines through all nodes (final edges), or through every second one (coarse)."""

    chain_points: Ints
    offsets: Ints
    segments: Ints  #: (m, 2)
    chain: Ints  #: (m,) chain of each segment
    at: Floats  #: places of the points on the curves


def number_nodes(curves: Curves, n_ends: int, xy: Floats, placed: Placement) -> Nodes:
    """Give ids to placed nodes at `xy`."""
    ids = numbered(placed.offsets, curves.ends, n_ends)
    points = np.empty((int(ids.max()) + 1, 2))
    points[ids] = xy
    return Nodes(points, ids, placed)


def on_stride(nodes: Nodes, step: int) -> Strided:
    """Take every `step`-th node of each chain."""
    return Strided(*_on_stride(nodes.chain_points, nodes.placed.offsets, nodes.placed.at, step))


@kernel
def _on_stride(chain_points: Ints, offsets: Ints, at: Floats, step: int) -> tuple[Ints, Ints, Ints, Ints, Floats]:
    n = 0
    starts = np.zeros(len(offsets), np.int64)
    for c in range(len(offsets) - 1):
        starts[c + 1] = starts[c] + (offsets[c + 1] - offsets[c] - 1) // step + 1
    taken, place = np.empty(starts[-1], np.int64), np.empty(starts[-1])
    segments = np.empty((starts[-1] - len(offsets) + 1, 2), np.int64)
    chain = np.empty(len(segments), np.int64)
    for c in range(len(offsets) - 1):
        for k in range(starts[c], starts[c + 1]):
            i = offsets[c] + step * (k - starts[c])
            taken[k], place[k] = chain_points[i], at[i]
            if k > starts[c]:
                segments[n, 0], segments[n, 1], chain[n] = taken[k - 1], taken[k], c
                n += 1
    return taken, starts, segments, chain, place


def mark_conflicts(
    points: Floats, strided: Strided, ends: Ends, is_new: Flags, gently: bool, shape: tuple[float, float], units: float
) -> Bytes:
    """Mark the segments that cross, touch or leave the picture; `gently` also those too close or at too sharp sectors.

    Only pairs with a segment on a chain of `is_new` are tested for the former.
    """
    marks = find_conflicts(points, strided.segments, strided.chain, is_new, shape, units)
    _mark_beyond(points, strided.segments, float(shape[1]), float(shape[0]), 4.0 / units, marks)
    if gently:
        mark_sectors(points, strided, ends, marks)
    else:
        marks[marks < CROSSING] = 0
    return marks


@kernel
def _mark_beyond(points: Floats, segments: Ints, width: float, height: float, off: float, marks: Bytes) -> None:
    """Mark segments that leave the picture, but for rounding: past void nothing else is crossed."""
    for k in range(len(segments)):
        for end in range(2):
            x, y = points[segments[k, end], 0], points[segments[k, end], 1]
            if abs(2.0 * x - width) > width + off or abs(2.0 * y - height) > height + off:
                marks[k] = CROSSING


def mark_sectors(points: Floats, strided: Strided, ends: Ends, marks: Bytes) -> None:
    """Mark the segments on both sides of sectors that are too sharp, in place."""
    mark_sharp(points, strided.chain_points, strided.offsets, ends.offsets, ends.sockets, _LEAST_SECTOR, marks)
