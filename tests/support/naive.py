"""Slow and plain twins of fast functions."""

from __future__ import annotations

from collections import defaultdict
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Ids = NDArray[np.int64]
Points = NDArray[np.float64]


def twins(faces: Ids) -> Ids:
    """Opposite half-edge of each half-edge: -1 for none, -2 where an edge has more than two faces or a fold."""
    n = faces.shape[1]
    runs: dict[tuple[int, int], list[int]] = defaultdict(list)
    for h in range(faces.size):
        runs[int(faces.flat[h]), int(faces[h // n, (h + 1) % n])].append(h)
    out = np.full(faces.size, -1)
    for (a, b), along in runs.items():
        against = runs.get((b, a), [])
        for h in along:
            if len(along) > 1 or len(against) > 1:
                out[h] = -2
            elif against:
                out[h] = against[0]
    return out


def areas(points: Points, polygons: Ids) -> Points:
    """Signed area of each polygon, by the shoelace formula."""
    p, q = points[polygons], points[np.roll(polygons, -1, axis=1)]
    total: Points = 0.5 * (p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]).sum(axis=1)
    return total


def lengths(points: Points, pairs: Ids) -> Points:
    """Length of each edge, given by the ids of its ends, shape (..., 2)."""
    return np.asarray(np.hypot(*np.moveaxis(points[pairs[..., 1]] - points[pairs[..., 0]], -1, 0)))


def corner_sines(points: Points, quads: Ids) -> Points:
    """Sine of each corner angle of each quad, shape (n, 4)."""
    p = points[quads]
    a, b = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
    sines: Points = (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]) / np.sqrt((a**2).sum(-1) * (b**2).sum(-1) + 1e-300)
    return sines


def worst_quality(points: Points, quads: Ids) -> float:
    """Least scaled Jacobian of all quads."""
    return float(corner_sines(points, quads).min())


def best_quads(points: Points) -> float:
    """Worst scaled Jacobian of the best way to cut a polygon (points, counter-clockwise) into quads of its corners.

    All ways are tried: the quad on the last edge takes any two other corners, what remains are up to three polygons.
    """

    @cache
    def best(i: int, j: int) -> float:
        if j == i + 1:
            return 1.0
        ways: list[Any] = []
        for a in range(i + 1, j, 2):
            for b in range(a + 1, j, 2):
                quad = corner_sines(points, np.array([[i, a, b, j]])).min()
                ways.append(min(quad, best(i, a), best(a, b), best(b, j)))
        return float(max(ways))

    return best(0, len(points) - 1)


def best_star(points: Points, steps: int = 40) -> float:
    """Worst scaled Jacobian of the best way to join every second node of a polygon to one in it, tried on a grid."""
    n, low, high = len(points), points.min(axis=0), points.max(axis=0)
    worst = -1.0
    for x in np.linspace(low[0], high[0], steps):
        for y in np.linspace(low[1], high[1], steps):
            with_centre = np.vstack([points, [[x, y]]])
            for first in (0, 1):
                i = np.arange(first, n, 2)
                quads = np.stack([i, (i + 1) % n, (i + 2) % n, np.full(len(i), n)], axis=1)
                worst = max(worst, worst_quality(with_centre, quads))
    return worst


def shape_energy(points: Points, quads: Ids, power: int = 4) -> float:
    """Sum over all corners of the inverse mean ratio to a power, infinite if a corner is folded."""
    p = points[quads]
    a, b = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
    det = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    if (det <= 0).any():
        return float("inf")
    return float(((((a**2).sum(-1) + (b**2).sum(-1)) / (2 * det)) ** power).sum())


def segments_meet(p: Any, q: Any, r: Any, s: Any) -> bool:
    """Whether the segments p q and r s (of whole numbers, none without length) have a point in common: fractions."""
    (ux, uy), (vx, vy), (wx, wy) = (
        [int(b) - int(a) for a, b in zip(*pair, strict=True)] for pair in ((p, q), (r, s), (p, r))
    )
    det = ux * vy - uy * vx
    if det == 0:
        return any(is_on(x, r, s) for x in (p, q)) or any(is_on(x, p, q) for x in (r, s))
    t, k = Fraction(wx * vy - wy * vx, det), Fraction(wx * uy - wy * ux, det)
    return 0 <= t <= 1 and 0 <= k <= 1


def is_on(x: Any, p: Any, q: Any) -> bool:
    """Whether a point of whole numbers lies on the segment p q."""
    (ux, uy), (wx, wy) = ([int(b) - int(a) for a, b in zip(p, end, strict=True)] for end in (q, x))
    return ux * wy == uy * wx and 0 <= ux * wx + uy * wy <= ux * ux + uy * uy


def distance(x: Points, p: Points, q: Points) -> float:
    """Distance of a point from the segment p q."""
    t = np.clip((x - p) @ (q - p) / ((q - p) @ (q - p)), 0.0, 1.0)
    return float(np.linalg.norm(x - p - t * (q - p)))


def arc_between(curves: Any, i: int, j: int) -> float:
    """Shortest way along the curves from dense point i to j: along one chain, or round one node that two share."""
    c, d = (int(np.searchsorted(curves.offsets, k, side="right")) - 1 for k in (i, j))

    def to_ends(chain: int, k: int) -> dict[int, list[float]]:
        ways: dict[int, list[float]] = defaultdict(list)
        for node, way in zip(
            curves.ends[chain], (curves.arc[k], curves.arc[curves.offsets[chain + 1] - 1] - curves.arc[k]), strict=True
        ):
            ways[int(node)].append(way)
        return ways

    ways = [abs(curves.arc[i] - curves.arc[j])] if c == d else []
    if curves.ends[c, 0] < 0 or curves.ends[d, 0] < 0:
        if c == d:
            ways.append(curves.arc[curves.offsets[c + 1] - 1] - ways[0])
    else:
        there, here = to_ends(c, i), to_ends(d, j)
        ways += [a + b for node in there.keys() & here.keys() for a in there[node] for b in here[node]]
    return min(ways, default=np.inf)
