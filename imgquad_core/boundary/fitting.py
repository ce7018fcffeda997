"""Local quadratic least squares along the chains: the paper's smoothing, in a frame that works for any direction.

The paper fits ``f(x) = a + b x + c x^2`` to the samples, which fails where a boundary is vertical. Here x AND y are
quadratics of the length u along the pixel boundary, fitted around every point with a bell-shaped weight; the point
moves to the value at u = 0. The window is the widest one whose residual across the curve is still the noise of
pixel stairs, so straight and gently bent boundaries are averaged over long stretches and details stay.

Over a wide window a quadratic is off for two reasons: the length along pixels runs up to 8 % faster in some directions
than in others, and a bend is no parabola. So where windows are wide, quartics of the length along the quadratics'
curve take over, in a window half as wide again, which averages as much. A circle of radius 40 comes out with 0.06 px
(rms) of noise instead of 0.08, and that in longer waves: half the slope.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.jit import kernel, verb
from imgquad_core.threads import even_parts, in_threads

WINDOWS = (3.0, 4.5, 6.5, 9.5, 14.0, 20.0, 30.0, 45.0, 65.0)  #: half widths that are tried, px of arc
STAIR_NOISE = 0.33  #: px; steps of a digital straight line have a deviation of 1 / sqrt(12) = 0.289, some more
_EVERY = 4  # windows are chosen at every 4th point
_DARING = 20.0  # px; a window wider than this is tried only if not both of the last two narrower ones failed
_SLOPE = 0.5  # px that the half width of the window may grow a px of arc, so that neighbours average alike
_SINGULAR = 1e-9  # least determinant of moments over the product of their diagonal: two samples fix no quadratic
_WIDER = 1.5  # window of the quartic over that of the quadratic: the same noise
_DETAIL, _WIDE = 6.5, 14.0  # px; windows below the one keep quadratics, above the other they get quartics
_BELL = 0.47  # a sample at t half widths from the middle counts (1 - 0.47 t^2)^2: 0.28 at the end of a window
_LEAST_PIVOT = 1e-9  # over the sum of weights
_SHORTEST_LOOP = 14  # closed chains of fewer points stay as they are: regression would let them collapse


class Samples(NamedTuple):
    """What a curve is fitted to: points of the pixel boundary in their order along a chain."""

    x: Floats
    y: Floats
    arc: Floats  #: length along the chain up to each point
    weight: Floats  #: how well each point is known


class _Sums(NamedTuple):
    """Weighted sums over the samples around a point, with u, x and y relative to it."""

    bell: float  #: of the bell alone, over the samples that count
    u0: float
    u1: float
    u2: float
    u3: float
    u4: float
    x: float
    ux: float
    uux: float
    y: float
    uy: float
    uuy: float
    xx: float
    xy: float
    yy: float


@verb
def _sum_up(samples: Samples, i: int, w: float) -> _Sums:
    """Sum up within +-w of point i, with u = arc - arc[i]."""
    x, y, s, q = samples.x, samples.y, samples.arc, samples.weight
    count = u0 = u1 = u2 = u3 = u4 = 0.0
    sx = sux = suux = sy = suy = suuy = sxx = sxy = syy = 0.0
    for step in (-1, 1):
        j = i if step == 1 else i - 1
        while 0 <= j < len(s) and abs(s[j] - s[i]) <= w:
            if q[j] > 0.0:
                u, px, py = s[j] - s[i], x[j] - x[i], y[j] - y[i]
                t = u / w
                g = 1.0 - _BELL * t * t
                g *= g
                count += g
                g *= q[j]
                gu, guu = g * u, g * u * u
                u0, u1, u2, u3, u4 = u0 + g, u1 + gu, u2 + guu, u3 + guu * u, u4 + guu * u * u
                sx, sux, suux = sx + g * px, sux + gu * px, suux + guu * px
                sy, suy, suuy = sy + g * py, suy + gu * py, suuy + guu * py
                sxx, sxy, syy = sxx + g * px * px, sxy + g * px * py, syy + g * py * py
            j += step
    return _Sums(count, u0, u1, u2, u3, u4, sx, sux, suux, sy, suy, suuy, sxx, sxy, syy)


@verb
def _solve(m: _Sums, b0: float, b1: float, b2: float) -> tuple[float, float, float]:
    """Coefficients of the quadratic with the moments m and right-hand side b (Cramer); 0 if too few samples tell."""
    a00 = m.u2 * m.u4 - m.u3 * m.u3
    a01 = m.u2 * m.u3 - m.u1 * m.u4
    a02 = m.u1 * m.u3 - m.u2 * m.u2
    a11 = m.u0 * m.u4 - m.u2 * m.u2
    a12 = m.u1 * m.u2 - m.u0 * m.u3
    a22 = m.u0 * m.u2 - m.u1 * m.u1
    det = m.u0 * a00 + m.u1 * a01 + m.u2 * a02
    if not det > _SINGULAR * m.u0 * m.u2 * m.u4:
        return 0.0, 0.0, 0.0
    return (
        (a00 * b0 + a01 * b1 + a02 * b2) / det,
        (a01 * b0 + a11 * b1 + a12 * b2) / det,
        (a02 * b0 + a12 * b1 + a22 * b2) / det,
    )


@verb
def quadratic_at(samples: Samples, i: int, w: float) -> tuple[float, float, float]:
    """Fit around point i: its shift in x and in y, and the root mean square residual across the curve."""
    m = _sum_up(samples, i, w)
    x0, x1, x2 = _solve(m, m.x, m.ux, m.uux)
    y0, y1, y2 = _solve(m, m.y, m.uy, m.uuy)
    xx = m.xx - x0 * m.x - x1 * m.ux - x2 * m.uux
    xy = m.xy - x0 * m.y - x1 * m.uy - x2 * m.uuy
    yy = m.yy - y0 * m.y - y1 * m.uy - y2 * m.uuy
    across = (y1 * y1 * xx - 2 * x1 * y1 * xy + x1 * x1 * yy) / (x1 * x1 + y1 * y1 + 1e-300)
    return x0, y0, np.sqrt(max(across, 0.0) / m.bell)


@verb
def _quartic_at(samples: Samples, i: int, w: float, a: Floats) -> tuple[float, float]:
    """Fit a quartic around point i: its shift in x and in y.

    Row r of the normal equations `a` is that of (u / w)^(4 - r), the right-hand sides of x and y are its last columns:
    what is left of the last row when the others are eliminated is the value at u = 0.
    """
    x, y, s, q = samples.x, samples.y, samples.arc, samples.weight
    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = s8 = 0.0  # of powers
    x0 = x1 = x2 = x3 = x4 = y0 = y1 = y2 = y3 = y4 = 0.0
    for step in (-1, 1):
        j = i if step == 1 else i - 1
        while 0 <= j < len(s) and abs(s[j] - s[i]) <= w:
            if q[j] > 0.0:
                t, px, py = (s[j] - s[i]) / w, x[j] - x[i], y[j] - y[i]
                g = 1.0 - _BELL * t * t
                g *= g * q[j]
                s0, x0, y0, g1 = s0 + g, x0 + g * px, y0 + g * py, g * t
                s1, x1, y1, g2 = s1 + g1, x1 + g1 * px, y1 + g1 * py, g1 * t
                s2, x2, y2, g3 = s2 + g2, x2 + g2 * px, y2 + g2 * py, g2 * t
                s3, x3, y3, g4 = s3 + g3, x3 + g3 * px, y3 + g3 * py, g3 * t
                s4, x4, y4, g5 = s4 + g4, x4 + g4 * px, y4 + g4 * py, g4 * t
                s5, s6, s7, s8 = s5 + g5, s6 + g5 * t, s7 + g5 * t * t, s8 + g5 * t * t * t
            j += step
    a[0, 0], a[0, 1], a[0, 2], a[0, 3], a[0, 4], a[0, 5], a[0, 6] = s8, s7, s6, s5, s4, x4, y4
    a[1, 1], a[1, 2], a[1, 3], a[1, 4], a[1, 5], a[1, 6] = s6, s5, s4, s3, x3, y3
    a[2, 2], a[2, 3], a[2, 4], a[2, 5], a[2, 6] = s4, s3, s2, x2, y2
    a[3, 3], a[3, 4], a[3, 5], a[3, 6] = s2, s1, x1, y1
    a[4, 4], a[4, 5], a[4, 6] = s0, x0, y0
    least = _LEAST_PIVOT * a[4, 4]
    for k in range(4):
        pivot = max(a[k, k], least)  # a power that the samples do not determine gets no share
        for r in range(k + 1, 5):
            share = a[k, r] / pivot
            for c in range(r, 7):
                a[r, c] -= share * a[k, c]
    value = max(a[4, 4], least)
    return a[4, 5] / value, a[4, 6] / value


@verb
def _choose_windows(
    samples: Samples, first: int, scale: Floats, closed: bool, widest: float, windows: Floats, w: Floats
) -> None:
    """Half width of the window at the points of a piece, which begins at `first` and has these scales, into w."""
    s = samples.arc
    last = first + len(scale) - 1
    for k in range(first, last + _EVERY, _EVERY):
        i = min(k, last)
        unit = scale[i - first]
        w[i] = min(windows[0] * unit, widest)
        failures = 0
        for candidate in windows:
            if candidate * unit > widest or (candidate > _DARING and failures > 1):
                break
            _, _, rms = quadratic_at(samples, i, candidate * unit)
            if rms <= STAIR_NOISE * unit:
                w[i] = candidate * unit
                failures = 0
            else:
                failures += 1
    for k in range(first, last, _EVERY):
        end = min(k + _EVERY, last)
        for i in range(k + 1, end):
            w[i] = w[k] + (w[end] - w[k]) * (s[i] - s[k]) / (s[end] - s[k])
    for _ in range(2 if closed else 1):  # a loop twice: what is narrow at its end is so before its beginning
        for i in range(first + 1, last + 1):
            w[i] = min(w[i], w[i - 1] + _SLOPE * (s[i] - s[i - 1]))
        for i in range(last - 1, first - 1, -1):
            w[i] = min(w[i], w[i + 1] + _SLOPE * (s[i + 1] - s[i]))
        if closed:
            w[first] = w[last] = min(w[first], w[last])


@verb
def _put_quadratics(samples: Samples, at: int, width: Floats, closed: bool, piece: Floats) -> None:
    """Move the points of a piece, of which the first stands at `at`, to the values of their quadratics."""
    n = len(piece) - 1
    for j in range(0 if closed else 1, n):
        dx, dy, _ = quadratic_at(samples, at + j, width[j])
        piece[j, 0], piece[j, 1] = samples.x[at + j] + dx, samples.y[at + j] + dy
    if closed:
        piece[n, 0], piece[n, 1] = piece[0, 0], piece[0, 1]


@verb
def _put_quartics(
    samples: Samples, at: int, width: Floats, scale: Floats, closed: bool, piece: Floats, matrix: Floats
) -> None:
    """Move the points of a piece on to the values of quartics, where windows are wide."""
    n = len(piece) - 1
    for j in range(0 if closed else 1, n):
        share = min((width[j] / scale[j] - _DETAIL) / (_WIDE - _DETAIL), 1.0)
        if share > 0.0:
            dx, dy = _quartic_at(samples, at + j, _WIDER * width[j], matrix)
            piece[j, 0] += share * (samples.x[at + j] + dx - piece[j, 0])
            piece[j, 1] += share * (samples.y[at + j] + dy - piece[j, 1])
    if closed:
        piece[n, 0], piece[n, 1] = piece[0, 0], piece[0, 1]


@verb
def _extend(chain: Samples, first: int, last: int, closed: bool, reach: float, out: Samples) -> int:
    """Copy a piece of a chain into `out`, `reach` more at both ends; give the place of its first point.

    A closed chain goes on round, an open piece by its own image turned about its end: the curve keeps its ends.
    """
    x, y, arc = chain.x, chain.y, chain.arc
    n = last - first
    length = arc[last] - arc[first]
    before = 0
    while before < n and (arc[last] - arc[last - before] if closed else arc[first + before] - arc[first]) < reach:
        before += 1
    after = 0
    while after < n and (arc[first + after] - arc[first] if closed else arc[last] - arc[last - after]) < reach:
        after += 1
    for k in range(-before, n + after + 1):
        at = k + before
        if closed:
            i = first + k % n
            out.x[at], out.y[at], out.arc[at] = x[i], y[i], arc[i] + length * (k // n)
        elif k < 0 or k > n:
            pin = first if k < 0 else last
            i = first - k if k < 0 else last - (k - n)
            out.x[at], out.y[at], out.arc[at] = 2 * x[pin] - x[i], 2 * y[pin] - y[i], 2 * arc[pin] - arc[i]
        else:
            i = first + k
            out.x[at], out.y[at], out.arc[at] = x[i], y[i], arc[i]
        out.weight[at] = chain.weight[i]
    out.arc[before + n + after + 1] = np.inf
    return before


def fit_pieces(
    points: Floats,
    arc: Floats,
    weight: Floats,
    scale: Floats,
    pieces: Ints,
    closed: Flags,
    windows: Floats,
    *,
    threads: int = 1,
) -> Floats:
    """Smooth pieces of chains by local quadratics and, where windows are wide, quartics.

    Parameters
    ----------
    points : float64, shape (n, 2)
        Dense points; the ends of open pieces already where they stay.
    arc : float64, shape (n,)
        Length along the pixel boundary.
    weight : float64, shape (n,)
        How well each point is known.
    scale : float64, shape (n,)
        Width of stairs at each point: windows and noise are in these.
    pieces : int64, shape (k, 2)
        First and last point of each piece.
    closed : bool, shape (k,)
        The piece is a whole closed chain (its last point is its first).
    windows : float64
        Half widths to choose from, ascending.
    threads : int
        How many share the pieces.

    Returns
    -------
    float64, shape (n, 2)
        Fitted points; points on no piece as they were.
    """
    chains, fitted = Samples(points[:, 0].copy(), points[:, 1].copy(), arc, weight), points.copy()
    parts = even_parts(pieces[:, 1] - pieces[:, 0], threads)
    in_threads(parts, lambda part: _fit(chains, scale, pieces[part], closed[part], windows, fitted), threads)
    return fitted


@kernel
def _fit(chains: Samples, scale: Floats, pieces: Ints, closed: Flags, windows: Floats, fitted: Floats) -> None:
    """Fit pieces of chains; points inside them, and where closed ones begin, are all that changes."""
    x, y, arc, weight = chains.x, chains.y, chains.arc, chains.weight
    longest = 0
    for k in range(len(pieces)):
        longest = max(longest, pieces[k, 1] - pieces[k, 0])
    room = 3 * longest + 4
    samples = Samples(np.empty(room), np.empty(room), np.empty(room), np.empty(room))
    w = np.empty(room)
    width = np.empty(longest + 1)
    true_arc = np.empty(len(x))
    matrix = np.empty((5, 7))
    for k in range(len(pieces)):
        first, last = pieces[k, 0], pieces[k, 1]
        n = last - first
        length = arc[last] - arc[first]
        widest = min(length / 4 if closed[k] else length / 2, windows[-1])
        if (closed[k] and n < _SHORTEST_LOOP) or widest < 1.0:
            continue
        at = _extend(chains, first, last, closed[k], widest, samples)
        _choose_windows(samples, at, scale[first : last + 1], closed[k], widest, windows, w)
        widest_chosen = 0.0
        for j in range(n + 1):
            width[j] = w[at + j]
            widest_chosen = max(widest_chosen, width[j] / scale[first + j])
        piece = fitted[first : last + 1]
        _put_quadratics(samples, at, width, closed[k], piece)
        if widest_chosen > _DETAIL:
            true_arc[first] = 0.0
            for j in range(n):
                step = np.hypot(piece[j + 1, 0] - piece[j, 0], piece[j + 1, 1] - piece[j, 1])
                true_arc[first + j + 1] = true_arc[first + j] + step
            at = _extend(Samples(x, y, true_arc, weight), first, last, closed[k], _WIDER * widest, samples)
            _put_quartics(samples, at, width, scale[first : last + 1], closed[k], piece, matrix)
