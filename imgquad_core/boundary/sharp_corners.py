"""Sharp corners of chains: where two straight sides meet, and one quadratic cannot follow them.

A corner of a square inclusion is cut by the pixel boundary from mid-side to mid-side; its true place is where the
lines through both sides meet. Chains are split there, so that smoothing leaves the corner alone.

Short sides are straight on a small circle, too: 6 px of a disc of radius 6 are off by 0.2 px (rms), no more than pixel
stairs. So where the sides are no longer than that, a corner is what no circle fits. Measured: without this test half of
the discs of radius 5 to 8 have corners; there circles leave 0.20 to 0.28 px, 95 of 100 corners of squares 0.32 or more.
The others have a right angle between sides of 8.5 px, which are never straight on so small a circle.
"""

from __future__ import annotations

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.jit import kernel, verb
from imgquad_core.threads import even_parts, in_threads

from .curves import Curves, line_beside, started_at
from .fitting import Samples, quadratic_at

_SIDE = 6.0  # px of arc of each side
_SIDES = np.array([_SIDE, 26.0, 18.0, 12.0, 8.5, _SIDE])  # a first look; then the longest that are straight tell
_NEAR = 0.4  # px beside the corner that are left out
_STRAIGHT = 0.32  # px, largest residual (rms) of a side
_TURN, _TIP = 0.8, 2.5  # radians, least and largest turn between the sides; beyond it is the round tip of a line
_UNLIKE = 0.20  # px, least residual of one quadratic through both sides
_UNROUND = 0.289  # px, least residual (rms) of one circle through short sides: 1 / sqrt(12), what pixel stairs leave
_LONG = 12.0  # px; no circle is straight over two sides of this length and turns by `_TURN`
_FAIR, _OFF_RIGHT = 8.0, 0.11  # px, and radians from a right angle within which sides of this length will do
_FARTHEST = 2.0  # px from the pixel boundary
_APART = 4.2  # px of arc between corners
_WHOLE = 0.999  # least scale of a corner: where details are finer sides are too short to tell
_BESIDE = 12  # samples on each side of a point of a closed chain
_ROUND = 2 * _BESIDE + 2
_AHEAD = 0.6  # px that a corner may lie ahead of its point along a side: more would fold the curve


def find_corners(curves: Curves, *, threads: int = 1) -> tuple[Curves, Flags]:
    """Find sharp corners; closed chains that have some are turned round to start at one.

    Parameters
    ----------
    curves : Curves
        The pixel boundary.
    threads : int
        How many share the chains.

    Returns
    -------
    Curves
        The same chains.
    is_corner : bool, shape (n,)
        Dense points that are corners; where a closed chain starts at one, its last point too.
    """
    is_corner = np.zeros(len(curves.raw), bool)
    parts = even_parts(np.diff(curves.offsets), threads)
    in_threads(parts, lambda part: _find(curves, _SIDES, part.start, part.stop, is_corner), threads)
    return started_at(curves, is_corner & (curves.scale >= _WHOLE))


def place_corners(curves: Curves, is_corner: Flags, room: Floats, points: Floats) -> None:
    """Move corners to where the lines of their sides meet, in place, by no more than `room`."""
    _place(curves, is_corner, room, _SIDES, points)


@kernel
def _place(curves: Curves, is_corner: Flags, room: Floats, lengths: Floats, points: Floats) -> None:
    for c in range(len(curves.ends)):
        for i in range(curves.offsets[c], curves.offsets[c + 1]):
            if is_corner[i]:
                _, dx, dy, _, _ = _corner_at(curves, c, i, lengths)
                scale = min(1.0, room[i] / max(np.hypot(dx, dy), 1e-9))
                points[i, 0], points[i, 1] = curves.raw[i, 0] + scale * dx, curves.raw[i, 1] + scale * dy


@kernel
def beside_corners(curves: Curves, is_corner: Flags) -> Ints:
    """Return for each dense point the corner that it is within a side's length of; -1 for none."""
    corner = np.full(len(curves.raw), -1, np.int64)
    for c in range(len(curves.ends)):
        for i in range(curves.offsets[c], curves.offsets[c + 1]):
            if is_corner[i]:
                corner[i] = i
                for step in (-1, 1):
                    _mark_side(curves, c, i, step, is_corner, corner)
    return corner


@verb
def _mark_side(curves: Curves, c: int, i: int, step: int, is_corner: Flags, corner: Ints) -> None:
    """Mark the points on one side of corner i, up to the next corner or the end of the chain."""
    begin, end = curves.offsets[c], curves.offsets[c + 1] - 1
    if step < 0:
        begin, end = end, begin
    k, gone = i, 0.0
    while gone <= _SIDE:
        if k == end:
            if curves.ends[c, 0] >= 0:
                break
            k = begin  # the same place of a closed chain
            corner[k] = i
        k += step
        gone += abs(curves.arc[k] - curves.arc[k - step])
        if is_corner[k]:
            break
        corner[k] = i


@kernel
def _find(curves: Curves, lengths: Floats, begin: int, end: int, is_corner: Flags) -> None:
    """Flag the corners of the chains from `begin` to before `end`."""
    score = np.zeros(len(curves.raw))
    most = _ROUND  # samples on both sides of a point: all those of its chain if need be
    for c in range(begin, end):
        most = max(most, curves.offsets[c + 1] - curves.offsets[c] + 2)
    beside = Samples(np.empty(most), np.empty(most), np.empty(most), np.full(most, 1.0))
    for c in range(begin, end):
        if curves.is_frame[c]:
            continue
        first, last = curves.offsets[c], curves.offsets[c + 1] - 1
        for i in range(first + (curves.ends[c, 0] >= 0), last):
            straight, dx, dy, _, _ = _corner_at(curves, c, i, lengths)
            if straight <= 0.0:
                continue
            middle, _ = _gather(curves, c, i, beside)
            gain = quadratic_at(beside, middle, _SIDE)[2]
            if gain >= _UNLIKE:
                j = _nearest(curves, c, i, curves.raw[i, 0] + dx, curves.raw[i, 1] + dy)
                score[j] = max(score[j], gain + straight)
        for i in range(first, last):
            if score[i] > 0.0 and _is_best(curves, c, i, score):
                straight, _, _, side, turn = _corner_at(curves, c, i, lengths)
                _, n = _gather(curves, c, i, beside)
                is_told = side >= _LONG or (side >= _FAIR and abs(turn - 0.5 * np.pi) <= _OFF_RIGHT)
                is_corner[i] = straight > 0.0 and (is_told or _off_circle(beside, n) >= _UNROUND)


@verb
def _corner_at(curves: Curves, c: int, i: int, lengths: Floats) -> tuple[float, float, float, float, float]:
    """How straight the sides of point i are (0: no corner), the shift to where their lines meet, their length and turn.

    The longest sides that are straight tell: lines through 6 px of pixel stairs are off by up to 6 degrees.
    """
    for k in range(len(lengths)):
        n, ax, ay, ux, uy, rms_u = line_beside(curves, c, i, -1, _NEAR, lengths[k])
        m, bx, by, vx, vy, rms_v = line_beside(curves, c, i, 1, _NEAR, lengths[k])
        is_straight = max(rms_u, rms_v) <= _STRAIGHT
        if k == 0 and (n < 6 or m < 6 or not is_straight or _turn(ux, uy, vx, vy) < _TURN):
            return 0.0, 0.0, 0.0, 0.0, 0.0
        if k > 0 and is_straight:
            break
    turn = _turn(ux, uy, vx, vy)
    if not _TURN <= turn <= _TIP:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    t = ((bx - ax) * vy - (by - ay) * vx) / (ux * vy - uy * vx)
    x, y = ax + t * ux, ay + t * uy
    if not (x * x + y * y < _FARTHEST**2 and x * ux + y * uy < _AHEAD and x * vx + y * vy < _AHEAD):
        return 0.0, 0.0, 0.0, 0.0, 0.0
    return 1.0 - max(rms_u, rms_v), x, y, lengths[k], turn


@verb
def _turn(ux: float, uy: float, vx: float, vy: float) -> float:
    """Turn from one side to the other, of directions that both lead away from the corner."""
    return float(np.pi - abs(np.arctan2(ux * vy - uy * vx, ux * vx + uy * vy)))


@verb
def _gather(curves: Curves, c: int, i: int, out: Samples) -> tuple[int, int]:
    """Copy the points around i; gives the place of i among them, and their number."""
    first, last = curves.offsets[c], curves.offsets[c + 1] - 1
    low = high = i
    if curves.ends[c, 0] >= 0:
        while low > first and curves.arc[i] - curves.arc[low] < _SIDE:
            low -= 1
        while high < last and curves.arc[high] - curves.arc[i] < _SIDE:
            high += 1
    else:
        low, high = i - _BESIDE, i + _BESIDE
    n, length = last - first, curves.arc[last]
    for k in range(low, high + 1):
        j = first + (k - first) % n if curves.ends[c, 0] < 0 else k
        out.x[k - low], out.y[k - low] = curves.raw[j, 0], curves.raw[j, 1]
        out.arc[k - low] = curves.arc[j] + (length * ((k - first) // n) if curves.ends[c, 0] < 0 else 0.0)
    out.arc[high - low + 1] = np.inf
    return i - low, high - low + 1


@verb
def _off_circle(samples: Samples, n: int) -> float:
    """Root mean square distance of the first n samples from the circle of least squares (Kasa 1976).

    I. Kasa, "A circle fitting procedure and its error analysis", doi 10.1109/TIM.1976.6312298.
    """
    mx = my = 0.0
    for k in range(n):
        mx, my = mx + samples.x[k] / n, my + samples.y[k] / n
    xx = xy = yy = xz = yz = 0.0
    for k in range(n):
        x, y = samples.x[k] - mx, samples.y[k] - my
        z = x * x + y * y
        xx, xy, yy, xz, yz = xx + x * x, xy + x * y, yy + y * y, xz + x * z, yz + y * z
    det = 2.0 * (xx * yy - xy * xy)
    if det <= 1e-9 * (xx + yy) ** 2:
        return 0.0  # a line
    cx, cy = (xz * yy - yz * xy) / det, (yz * xx - xz * xy) / det
    radius, total = np.sqrt(cx * cx + cy * cy + (xx + yy) / n), 0.0
    for k in range(n):
        total += (np.hypot(samples.x[k] - mx - cx, samples.y[k] - my - cy) - radius) ** 2
    return float(np.sqrt(total / n))


@verb
def _nearest(curves: Curves, c: int, i: int, x: float, y: float) -> int:
    """Point of the chain nearest to (x, y), within 6 points of i."""
    first, last = curves.offsets[c], curves.offsets[c + 1] - 1
    best, nearest = i, np.inf
    for k in range(i - 6, i + 7):
        if curves.ends[c, 0] >= 0 and not first < k < last:
            continue
        j = first + (k - first) % (last - first) if curves.ends[c, 0] < 0 else k
        d2 = (curves.raw[j, 0] - x) ** 2 + (curves.raw[j, 1] - y) ** 2
        if d2 < nearest - 1e-9:
            best, nearest = j, d2
    return best


@verb
def _is_best(curves: Curves, c: int, i: int, score: Floats) -> bool:
    """Is there no better corner near point i? The first one wins a tie."""
    first, last = curves.offsets[c], curves.offsets[c + 1] - 1
    length = curves.arc[last]
    for k in range(i - 12, i + 13):
        if curves.ends[c, 0] >= 0 and not first < k < last:
            continue
        j = first + (k - first) % (last - first) if curves.ends[c, 0] < 0 else k
        apart = abs(curves.arc[j] - curves.arc[i])
        if curves.ends[c, 0] < 0:
            apart = min(apart, length - apart)
        if apart < _APART and (score[j] > score[i] or (score[j] == score[i] and j < i)):
            return False
    return True
