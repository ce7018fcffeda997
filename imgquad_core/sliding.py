"""Let boundary nodes slide along their own chain, for the sake of the quads on both sides.

A node stays on the parabola through its own place and its two neighbours' places t = -1, 0, 1 on the chain, within
`REACH` of its own, so the boundary keeps its shape; junctions, corners and the ends of chains stay.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .jit import kernel
from .model import PointKind
from .relaxation import GUARD, HALVINGS, Rings, ring_energy, ring_quality

Ids = NDArray[np.int64]
Points = NDArray[np.float64]

REACH = 0.3  # of the way to a neighbour: two neighbours never come closer than 0.4 of their distance
GOOD_ENOUGH = 0.98  # worst scaled Jacobian of a ring that needs no slide
_FREE, _FRAME = int(PointKind.FREE), int(PointKind.FRAME)


@kernel
def slide(
    points: Points, rings: Rings, kind: NDArray[np.uint8], offsets: Ids, ids: Ids, chain: Points, at: Points
) -> None:
    """Move each boundary node once to where the energy of its ring is least, in place.

    `chain` holds the places of the nodes before any slide, `at` how far each has gone (t), which is kept up to date.
    """
    energy = np.empty(6)
    for c in range(offsets.size - 1):
        for i in range(offsets[c] + 1, offsets[c + 1] - 1):
            v = ids[i]
            if kind[v] == _FREE or kind[v] == _FRAME:
                _slide_node(points, rings, v, chain[ids[i - 1]], chain[v], chain[ids[i + 1]], at, energy)


@kernel
def _slide_node(
    points: Points, rings: Rings, v: int, before: Points, here: Points, behind: Points, at: Points, energy: Points
) -> None:
    """Move node v along the parabola through `before`, `here` and `behind` by one guarded Newton step."""
    quality = ring_quality(points, rings, v)
    if quality > GOOD_ENOUGH:
        return
    old, x, y = at[v], points[v, 0], points[v, 1]
    ax, ay = 0.5 * (behind[0] - before[0]), 0.5 * (behind[1] - before[1])
    bx, by = 0.5 * (behind[0] + before[0]) - here[0], 0.5 * (behind[1] + before[1]) - here[1]
    ring_energy(points, rings, v, energy)
    tx, ty, least = ax + 2.0 * old * bx, ay + 2.0 * old * by, energy[0]
    slope = energy[1] * tx + energy[2] * ty
    bend = energy[3] * tx * tx + 2.0 * energy[4] * tx * ty + energy[5] * ty * ty
    if not np.isfinite(least) or bend <= 0.0:
        return
    step = min(max(old - slope / bend, -REACH), REACH) - old
    for _ in range(HALVINGS):
        t = old + step
        points[v, 0] = here[0] + t * ax + t * t * bx
        points[v, 1] = here[1] + t * ay + t * t * by
        ring_energy(points, rings, v, energy)
        if energy[0] < least and ring_quality(points, rings, v) >= min(quality, GUARD):
            at[v] = t
            return
        step *= 0.5
    points[v, 0], points[v, 1] = x, y
