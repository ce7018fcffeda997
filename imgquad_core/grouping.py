"""Group anything by anything: rows of a table whose lengths differ (CSR), running sums."""

from __future__ import annotations

import numpy as np

from .arrays import Ints
from .jit import kernel, verb


@verb
def add_up(counts: Ints) -> None:
    """Replace counts by their running sum."""
    for k in range(1, len(counts)):
        counts[k] += counts[k - 1]


@kernel
def grouped(faces: Ints, n_points: int) -> tuple[Ints, Ints]:
    """Return CSR (offsets, corners): the flat corner indices ``n * f + k`` that each point has, ascending."""
    flat = faces.ravel()
    offsets = np.zeros(n_points + 1, np.int64)
    for v in flat:
        offsets[v + 1] += 1
    for v in range(n_points):
        offsets[v + 1] += offsets[v]
    fill = offsets[:-1].copy()
    corners = np.empty(flat.size, np.int64)
    for i in range(flat.size):
        v = flat[i]
        corners[fill[v]] = i
        fill[v] += 1
    return offsets, corners
