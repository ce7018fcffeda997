"""Cross field and size field on a background triangulation: where quads should point, and how long they should be.

The cross of a rim point follows its constraints; inside, the representation vector (cos 4t, sin 4t) is harmonic.
The size is that of the rim's edges and grows inwards with a given slope up to the size asked for.

References
----------
J.-F. Remacle et al., A frontal Delaunay quad mesh generator using the L-infinity norm, IJNME 94 (2013),
https://doi.org/10.1002/nme.4458
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .cutting import CutMesh
from .jit import kernel

Ids = NDArray[np.int64]
Points = NDArray[np.float64]

SWEEPS = 12  # the field has converged after 5 to 10 (study: 5, 30 and 100 sweeps give the same mesh)
OVER_RELAXATION = 1.5
MAX_SIZE_SWEEPS = 50


class CrossField(NamedTuple):
    """Values at the points of a `CutMesh`."""

    cross: Points  #: (n, 2), unit vectors (cos 4t, sin 4t) of the direction t of one arm
    size: Points  #: (n,), edge length


def cross_field(mesh: CutMesh, max_size: Points, growth: float) -> CrossField:
    """Compute cross and size at each point of `mesh`.

    Parameters
    ----------
    mesh : CutMesh
        Background mesh.
    max_size : float64, shape (n_points,)
        Edge length asked for far from the constraints.
    growth : float
        Slope of the size: it grows at most by `growth` per unit of length.
    """
    offsets, neighbors = _neighbors(mesh.triangles, mesh.twins, len(mesh.points))
    cross, size = _rim_values(mesh.points, mesh.triangles, mesh.twins, max_size)
    _relax_cross(cross, mesh.on_rim, offsets, neighbors)
    _limit_growth(size, mesh.points, offsets, neighbors, growth)
    return CrossField(cross, size)


@kernel
def _neighbors(triangles: Ids, twins: Ids, n_points: int) -> tuple[Ids, Ids]:
    """Return CSR (offsets, neighbors) of the points that share an edge."""
    flat = triangles.ravel()
    offsets = np.zeros(n_points + 1, np.int64)
    for h in range(twins.size):
        if twins[h] < h:
            offsets[flat[h] + 1] += 1
            offsets[flat[h - h % 3 + (h % 3 + 1) % 3] + 1] += 1
    for v in range(n_points):
        offsets[v + 1] += offsets[v]
    fill = offsets[:-1].copy()
    neighbors = np.empty(offsets[n_points], np.int64)
    for h in range(twins.size):
        if twins[h] < h:
            a, b = flat[h], flat[h - h % 3 + (h % 3 + 1) % 3]
            neighbors[fill[a]] = b
            neighbors[fill[b]] = a
            fill[a] += 1
            fill[b] += 1
    return offsets, neighbors


@kernel
def _rim_values(points: Points, triangles: Ids, twins: Ids, max_size: Points) -> tuple[Points, Points]:
    """Return cross (0 inside) and size (`max_size` inside) as the rim's edges tell them."""
    cross = np.zeros((len(points), 2))
    total = np.zeros(len(points))
    count = np.zeros(len(points))
    flat = triangles.ravel()
    for h in range(twins.size):
        if twins[h] < 0:
            a, b = flat[h], flat[h - h % 3 + (h % 3 + 1) % 3]
            dx, dy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
            turn, length = 4.0 * np.arctan2(dy, dx), np.hypot(dx, dy)
            for v in (a, b):
                cross[v, 0] += np.cos(turn)
                cross[v, 1] += np.sin(turn)
                total[v] += length
                count[v] += 1.0
    size = max_size.copy()
    for v in range(len(points)):
        if count[v] > 0:
            size[v] = total[v] / count[v]
            norm = np.hypot(cross[v, 0], cross[v, 1])
            if norm > 1e-9:
                cross[v, 0] /= norm
                cross[v, 1] /= norm
    return cross, size


@kernel
def _relax_cross(cross: Points, fixed: NDArray[np.bool_], offsets: Ids, neighbors: Ids) -> None:
    """Make the representation vectors harmonic inside (successive over-relaxation), then of unit length."""
    for _ in range(SWEEPS):
        for v in range(len(cross)):
            n = offsets[v + 1] - offsets[v]
            if fixed[v] or n == 0:
                continue
            sx, sy = 0.0, 0.0
            for i in range(offsets[v], offsets[v + 1]):
                sx += cross[neighbors[i], 0]
                sy += cross[neighbors[i], 1]
            cross[v, 0] += OVER_RELAXATION * (sx / n - cross[v, 0])
            cross[v, 1] += OVER_RELAXATION * (sy / n - cross[v, 1])
    for v in range(len(cross)):
        norm = np.hypot(cross[v, 0], cross[v, 1])
        if norm > 1e-12:
            cross[v, 0] /= norm
            cross[v, 1] /= norm
        else:
            cross[v, 0], cross[v, 1] = 1.0, 0.0


@kernel
def _limit_growth(size: Points, points: Points, offsets: Ids, neighbors: Ids, growth: float) -> None:
    """Lower sizes until no two neighbours differ by more than `growth` times their distance."""
    n = len(size)
    for sweep in range(MAX_SIZE_SWEEPS):
        changed = False
        for i in range(n):
            v = i if sweep % 2 == 0 else n - 1 - i
            for j in range(offsets[v], offsets[v + 1]):
                w = neighbors[j]
                limit = size[w] + growth * np.hypot(points[v, 0] - points[w, 0], points[v, 1] - points[w, 1])
                if limit < size[v] * (1.0 - 1e-9):
                    size[v] = limit
                    changed = True
        if not changed:
            break
