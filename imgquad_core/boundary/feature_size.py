"""Local feature size: how far each point of the curves is from the nearest FOREIGN part of the boundary.

Foreign is a point that is much farther along the curves than through the plane: on another chain, or on the same
one, or round a shared junction, with an arc of more than `bend` times the distance. So neighbours along a smooth
curve do not count, the other side of a thin vein does, and so do two chains that leave a junction at less than
2 asin(1 / bend) (60 degrees for 2, 29 degrees for 4). No medial axis is needed.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Floats, Ints, Labels
from imgquad_core.grouping import add_up, rows_of
from imgquad_core.jit import kernel, verb
from imgquad_core.threads import even_parts, in_threads

from .curves import Curves

# px searched among all points; each level has every 4th point of the one before, and searches four times as far
_REACH = 4.0


class Buckets(NamedTuple):
    """Points in square cells, row by row: cell k has ``items[start[k]:start[k + 1]]``."""

    start: Labels
    items: Labels  #: ids of points
    n_across: int  #: cells in a row
    cell: float  #: side of a cell, px


def local_feature_size(
    points: Floats,
    curves: Curves,
    reach: float,
    bend: float,
    corner: Ints | None = None,
    *,
    wiggle: float = 0.0,
    threads: int = 1,
) -> Floats:
    """Distance to the nearest foreign point of the boundary.

    Parameters
    ----------
    points : float64, shape (n, 2)
        Dense points, as `curves.raw`, where they are now.
    curves : Curves
        Their chains.
    reach : float
        Largest distance of interest, in pixels.
    bend : float
        Arc over distance from which a point is foreign.
    corner : int64, shape (n,), optional
        Corner that each point is beside, -1 for none: both sides of one corner are not foreign to each other.
    wiggle : float
        Arc along one chain below which its points are not foreign to each other, however near they are.
    threads : int
        How many share the points.

    Returns
    -------
    float64, shape (n,)
        Distance in pixels, infinity where nothing foreign was found within about `reach`.
    """
    chain = rows_of(curves.offsets)
    corner = np.full(len(points), -1) if corner is None else corner
    lfs = np.full(len(points), np.inf)
    stride, level = 1, min(_REACH, reach)
    while True:
        ids = np.arange(len(points)) if stride == 1 else _every(curves.offsets, stride)
        buckets = bucket(points, ids, max(level / 2, 1.0))
        for_part = partial(_nearest_foreign, points, curves, chain, corner, buckets, level, bend, wiggle, lfs)
        in_threads([ids[part] for part in even_parts(np.ones(len(ids), np.int64), threads)], for_part, threads)
        if stride > 1:
            _spread(ids, stride, chain, lfs)
        if level >= reach:
            return lfs
        stride, level = 4 * stride, min(4 * level, reach)


def _every(offsets: Ints, stride: int) -> Ints:
    """Every `stride`-th point of each chain, and its last."""
    is_taken = (np.arange(offsets[-1]) - np.repeat(offsets[:-1], np.diff(offsets))) % stride == 0
    is_taken[offsets[1:] - 1] = True
    return np.flatnonzero(is_taken)


def bucket(points: Floats, ids: Ints, cell: float) -> Buckets:
    """Sort the points `ids` into square cells."""
    n_across, n_up = int(points[:, 0].max() / cell) + 1, int(points[:, 1].max() / cell) + 1
    return Buckets(*in_cells(points, ids, cell, n_across, n_up), n_across, cell)


@kernel
def in_cells(points: Floats, ids: Ints, cell: float, n_across: int, n_up: int) -> tuple[Labels, Labels]:
    """Return CSR (start, items) of the points `ids` in each of these cells, row by row; the last ones have no end."""
    start, items = np.zeros(n_across * n_up + 1, np.int32), np.empty(len(ids), np.int32)
    for i in ids:
        start[_cell_of(points, i, cell, n_across, n_up)] += 1
    add_up(start)
    for k in range(len(ids) - 1, -1, -1):
        at = _cell_of(points, ids[k], cell, n_across, n_up)
        start[at] -= 1
        items[start[at]] = ids[k]
    return start, items


@verb
def _cell_of(points: Floats, i: int, cell: float, n_across: int, n_up: int) -> int:
    return min(int(points[i, 1] / cell), n_up - 1) * n_across + min(int(points[i, 0] / cell), n_across - 1)


@verb
def _arc_between(curves: Curves, c: int, i: int, d: int, j: int) -> float:
    """Length along the curves from point i of chain c to point j of chain d, over at most one node."""
    shortest = np.inf
    if c == d:
        shortest = abs(curves.arc[i] - curves.arc[j])
        if curves.ends[c, 0] < 0:
            return float(min(shortest, curves.arc[curves.offsets[c + 1] - 1] - shortest))
        if curves.ends[c, 0] != curves.ends[c, 1]:
            return float(shortest)
    elif curves.ends[c, 0] < 0 or curves.ends[d, 0] < 0:
        return shortest
    to_end_i = curves.arc[curves.offsets[c + 1] - 1] - curves.arc[i]
    to_end_j = curves.arc[curves.offsets[d + 1] - 1] - curves.arc[j]
    for side in range(2):
        from_i = to_end_i if side else curves.arc[i]
        for other in range(2):
            if curves.ends[c, side] == curves.ends[d, other]:
                shortest = min(shortest, from_i + (to_end_j if other else curves.arc[j]))
    return shortest


@kernel
def _nearest_foreign(
    points: Floats,
    curves: Curves,
    chain: Ints,
    corner: Ints,
    buckets: Buckets,
    reach: float,
    bend: float,
    wiggle: float,
    lfs: Floats,
    ids: Ints,
) -> None:
    start, n_across, cell = buckets.start, buckets.n_across, buckets.cell
    n_up = (len(start) - 1) // n_across
    rings = int(np.ceil(reach / cell))
    for i in ids:
        if lfs[i] < np.inf:
            continue
        x, y = points[i, 0], points[i, 1]
        column, row = int(x / cell), int(y / cell)
        best = reach * reach
        found = False
        for ring in range(rings + 1):
            if found and (ring - 1) * cell > 0 and ((ring - 1) * cell) ** 2 > best:
                break
            for r in range(max(row - ring, 0), min(row + ring + 1, n_up)):
                step = 1 if abs(r - row) == ring else 2 * ring
                for k in range(column - ring, column + ring + 1, max(step, 1)):
                    if k < 0 or k >= n_across:
                        continue
                    for at in range(start[r * n_across + k], start[r * n_across + k + 1]):
                        j = buckets.items[at]
                        d2 = (points[j, 0] - x) ** 2 + (points[j, 1] - y) ** 2
                        if d2 >= best or (corner[i] >= 0 and corner[i] == corner[j]):
                            continue
                        arc = _arc_between(curves, chain[i], i, chain[j], j)
                        if arc > bend * np.sqrt(d2) and (chain[i] != chain[j] or arc > wiggle):
                            best = d2
                            found = True
        if found:
            lfs[i] = np.sqrt(best)


@kernel
def _spread(ids: Ints, stride: int, chain: Ints, lfs: Floats) -> None:
    """Give what was found at every `stride`-th point to the points around it."""
    for i in ids:
        if lfs[i] == np.inf:
            continue
        for j in range(max(i - stride // 2, 0), min(i + stride // 2 + 1, len(lfs))):
            if chain[j] == chain[i] and lfs[j] == np.inf:
                lfs[j] = lfs[i]
