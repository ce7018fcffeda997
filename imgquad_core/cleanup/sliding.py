"""Let boundary nodes slide along their own chain, for the sake of the quads on both sides.

A node v moves parallel to the line through its neighbours p and n on the chain, so the areas on both sides stay what
they are, to the last digits; it goes at most `REACH` of the way. Junctions, corners and the ends of chains stay.

      <--v-->
    p/       \n
"""

from __future__ import annotations

import numpy as np

from imgquad_core.arrays import Bytes, Floats, Ints
from imgquad_core.jit import kernel, verb
from imgquad_core.model import PointKind

from .relaxation import HALVINGS, Rings, energy_of, guarded, is_ring_above, is_sound, ring_energy

REACH = 0.3  # of the way to a neighbour: two neighbours never come closer than 0.4 of their distance
GOOD_ENOUGH = 0.98  # worst scaled Jacobian of a ring that needs no slide
_FREE, _FRAME = int(PointKind.FREE), int(PointKind.FRAME)


@kernel
def slide(points: Floats, rings: Rings, kind: Bytes, offsets: Ints, ids: Ints, gone: Floats) -> None:
    """Move each boundary node once to where the energy of its ring is least, in place.

    `gone` holds how far each node has gone, in halves of the distance of its neighbours, and is kept up to date.
    """
    energy = np.empty(6)
    for c in range(offsets.size - 1):
        for i in range(offsets[c] + 1, offsets[c + 1] - 1):
            v = ids[i]
            if kind[v] == _FREE or kind[v] == _FRAME:
                _slide_node(points, rings, v, ids[i - 1], ids[i + 1], gone, energy)


@verb
def _slide_node(points: Floats, rings: Rings, v: int, p: int, n: int, gone: Floats, energy: Floats) -> None:
    """Move node v parallel to the line from p to n by one guarded Newton step."""
    if is_ring_above(points, rings, v, GOOD_ENOUGH):
        return
    need = guarded(points, rings, v)
    x, y = points[v, 0], points[v, 1]
    tx, ty = 0.5 * (points[n, 0] - points[p, 0]), 0.5 * (points[n, 1] - points[p, 1])
    ring_energy(points, rings, v, energy)
    least = energy[0]
    slope = energy[1] * tx + energy[2] * ty
    bend = energy[3] * tx * tx + 2.0 * energy[4] * tx * ty + energy[5] * ty * ty
    if not np.isfinite(least) or bend <= 0.0:
        return
    step = min(max(gone[v] - slope / bend, -REACH), REACH) - gone[v]
    for _ in range(HALVINGS):
        points[v, 0], points[v, 1] = x + step * tx, y + step * ty
        if energy_of(points, rings, v) < least and is_sound(points, rings, v, need):
            gone[v] += step
            return
        step *= 0.5
    points[v, 0], points[v, 1] = x, y
