"""Slow and plain twins of fast functions."""

from __future__ import annotations

from collections import defaultdict
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
