"""The exact test that segments neither cross nor touch, and the tests that they keep room for good elements.

Coordinates are multiples of 2^-14 px, as int64: orientations of points up to 2^16 px are exact, no tolerance is
needed anywhere.
"""

from __future__ import annotations

import numpy as np

from imgquad_core.arrays import Bytes, Flags, Floats, Ints
from imgquad_core.grouping import add_up
from imgquad_core.jit import kernel, verb

UNITS = 16384.0  #: grid steps a pixel
FREE, SHARP, CLOSE, CROSSING = range(4)  #: what a segment is marked with
_ROOM = 0.25  # least distance of a node from a segment that is not its own, over the length of that segment


def snapped(points: Floats, units: Floats | float = UNITS) -> Floats:
    """Round coordinates to the grid on which the test is exact, of `units` steps each way."""
    return np.asarray(np.round(points * units) / units)


def find_conflicts(
    points: Floats,
    segments: Ints,
    chain: Ints,
    is_new: Flags,
    shape: tuple[float, float],
    units: Floats | float = UNITS,
) -> Bytes:
    """Find segments that cross, touch, coincide, have no length or come too close.

    Parameters
    ----------
    points : float64, shape (n, 2)
        Snapped points, inside the picture.
    segments : int64, shape (m, 2)
        Ids of the ends of each segment; segments that share an id may meet there.
    chain : int64, shape (m,)
        Chain of each segment.
    is_new : bool, shape (n_chains,)
        Only pairs of which one is on a new chain are looked at.
    shape : tuple of float
        (n_rows, n_cols) of the picture.
    units : float or float64, shape (2,)
        Grid steps a unit of length, of x and y.

    Returns
    -------
    uint8, shape (m,)
        FREE, CLOSE or CROSSING.
    """
    marks = np.zeros(len(segments), np.uint8)
    points = np.require(points, requirements="W")  # kernels are compiled once more for a read-only array
    if len(segments):
        cell = max(_mean_length(points, segments), float(np.sqrt(shape[0] * shape[1] / (4.0 * len(segments)))))
        n_across, n_up = int(shape[1] / cell) + 1, int(shape[0] / cell) + 1
        start, items = _bucket_segments(points, segments, chain, is_new, cell, n_across, n_up)
        grid = np.round(points * units).astype(np.int64)
        _compare_in_cells(grid, points, segments, chain, is_new, start, items, marks)
    return marks


@kernel
def _mean_length(points: Floats, segments: Ints) -> float:
    total = 0.0
    for k in range(len(segments)):
        dx = points[segments[k, 1], 0] - points[segments[k, 0], 0]
        dy = points[segments[k, 1], 1] - points[segments[k, 0], 1]
        total += np.sqrt(dx * dx + dy * dy)
    return float(total / len(segments))


@kernel
def _bucket_segments(
    points: Floats, segments: Ints, chain: Ints, is_new: Flags, cell: float, n_across: int, n_up: int
) -> tuple[Ints, Ints]:
    """Sort segments into the cells of boxes around pieces of them, at most a cell long, and the room they need.

    Short ones that are far from all new ones are left out.
    """
    start = np.zeros(n_across * n_up + 1, np.int64)
    is_near, inverse = np.full(n_across * n_up, is_new.all()), 1.0 / cell
    items = np.empty(0, np.int64)
    for step in range(1 if is_new.all() else 0, 3):  # cells at and beside new segments; counts; the segments
        for k in range(len(segments)):
            if step == 0 and not is_new[chain[k]]:
                continue
            ax, ay = points[segments[k, 0], 0], points[segments[k, 0], 1]
            dx, dy = points[segments[k, 1], 0] - ax, points[segments[k, 1], 1] - ay
            pieces = int(max(abs(dx), abs(dy)) * inverse) + 1
            if step > 0 and pieces == 1:  # all its cells are at or beside that of its middle
                row = min(max(int((ay + 0.5 * dy) * inverse), 0), n_up - 1)
                if not is_near[row * n_across + min(max(int((ax + 0.5 * dx) * inverse), 0), n_across - 1)]:
                    continue
            share, margin = 1.0 / pieces, _ROOM * np.sqrt(dx * dx + dy * dy)
            done_left = done_right = done_low = done_high = -1
            for p in range(pieces):
                x0, x1 = ax + share * p * dx, ax + share * (p + 1) * dx
                y0, y1 = ay + share * p * dy, ay + share * (p + 1) * dy
                left = max(int((min(x0, x1) - margin) * inverse) - (step == 0), 0)
                right = min(int((max(x0, x1) + margin) * inverse) + (step == 0), n_across - 1)
                low = max(int((min(y0, y1) - margin) * inverse) - (step == 0), 0)
                high = min(int((max(y0, y1) + margin) * inverse) + (step == 0), n_up - 1)
                for row in range(low, high + 1):
                    for column in range(left, right + 1):
                        if done_left <= column <= done_right and done_low <= row <= done_high:
                            continue
                        at = row * n_across + column
                        if step == 0:
                            is_near[at] = True
                        elif step == 1:
                            start[at] += 1
                        else:
                            start[at] -= 1
                            items[start[at]] = k
                done_left, done_right, done_low, done_high = left, right, low, high
        if step == 1:
            add_up(start)
            items = np.empty(start[-1], np.int64)
    return start, items


@kernel
def _compare_in_cells(
    grid: Ints,
    points: Floats,
    segments: Ints,
    chain: Ints,
    is_new: Flags,
    start: Ints,
    items: Ints,
    marks: Bytes,
) -> None:
    for k in range(len(segments)):
        if _is_point(points, segments[k, 0], segments[k, 1]):
            marks[k] = CROSSING
    for at in range(len(start) - 1):
        for i in range(start[at], start[at + 1]):
            k = items[i]
            for j in range(i + 1, start[at + 1]):
                other = items[j]
                if is_new[chain[k]] or is_new[chain[other]]:
                    mark = _compare(
                        grid, points, segments[k, 0], segments[k, 1], segments[other, 0], segments[other, 1]
                    )
                    _raise(marks, k, mark)
                    _raise(marks, other, mark)


@verb
def _raise(marks: Bytes, k: int, mark: int) -> None:
    if marks[k] < mark:
        marks[k] = mark


@verb
def _is_point(points: Floats, a: int, b: int) -> bool:
    return bool(points[a, 0] == points[b, 0] and points[a, 1] == points[b, 1])


@verb
def _compare(grid: Ints, points: Floats, a: int, b: int, c: int, d: int) -> int:
    """FREE, CLOSE or CROSSING for the segments a b and c d."""
    if a in (c, d) or b in (c, d):
        if (a == c and b == d) or (a == d and b == c):
            return CROSSING
        if a == d or b == d:
            c, d = d, c
        if b == c:
            a, b = b, a
        ahead = (grid[b, 0] - grid[a, 0]) * (grid[d, 0] - grid[a, 0]) + (grid[b, 1] - grid[a, 1]) * (
            grid[d, 1] - grid[a, 1]
        )
        return CROSSING if ahead > 0 and _orient(grid, a, b, d) == 0 else FREE
    if _boxes_meet(grid, a, b, c, d):
        o1, o2, o3, o4 = _orient(grid, a, b, c), _orient(grid, a, b, d), _orient(grid, c, d, a), _orient(grid, c, d, b)
        if o1 * o2 <= 0 and o3 * o4 <= 0:
            return CROSSING
    if _is_close(points, a, b, c, d) or _is_close(points, c, d, a, b):
        return CLOSE
    return FREE


@verb
def _orient(grid: Ints, a: int, b: int, c: int) -> int:
    """Sign of the turn a, b, c."""
    turn = (grid[b, 0] - grid[a, 0]) * (grid[c, 1] - grid[a, 1]) - (grid[b, 1] - grid[a, 1]) * (grid[c, 0] - grid[a, 0])
    return int(turn > 0) - int(turn < 0)


@verb
def _boxes_meet(grid: Ints, a: int, b: int, c: int, d: int) -> bool:
    for k in range(2):
        if max(grid[a, k], grid[b, k]) < min(grid[c, k], grid[d, k]) or max(grid[c, k], grid[d, k]) < min(
            grid[a, k], grid[b, k]
        ):
            return False
    return True


@verb
def _is_close(points: Floats, a: int, b: int, c: int, d: int) -> bool:
    """Tell whether c or d is nearer to the segment a b than a quarter of its length."""
    dx, dy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    length2 = dx * dx + dy * dy
    for k in range(2):
        p = d if k else c
        x, y = points[p, 0] - points[a, 0], points[p, 1] - points[a, 1]
        t = min(max((x * dx + y * dy) / (length2 + 1e-300), 0.0), 1.0)
        if (x - t * dx) ** 2 + (y - t * dy) ** 2 < _ROOM * _ROOM * length2:
            return True
    return False
