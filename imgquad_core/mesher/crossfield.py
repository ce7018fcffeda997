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

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.grouping import grouped
from imgquad_core.jit import kernel

from .cutting import CutMesh

SWEEPS = 12  # the field has converged after 5 to 10 (study: 5, 30 and 100 sweeps give the same mesh)
OVER_RELAXATION = 1.5  # of each sweep: 1 is Gauss-Seidel, from 2 on it diverges
MAX_SIZE_SWEEPS = 50  # to and fro over the points, each carries sizes on; it ends with the first that changes none


class CrossField(NamedTuple):
    """Values at the points of a `CutMesh`."""

    cross: Floats  #: (n, 2), unit vectors (cos 4t, sin 4t) of the direction t of one arm
    size: Floats  #: (n,), edge length


def cross_field(mesh: CutMesh, max_size: Floats, growth: float) -> CrossField:
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


def _neighbors(triangles: Ints, twins: Ints, n_points: int) -> tuple[Ints, Ints]:
    """Return CSR (offsets, neighbors) of the points that share an edge."""
    edges = np.stack([triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()], axis=1)
    edges = edges[twins < np.arange(twins.size)]
    offsets, places = grouped(edges, n_points)
    return offsets, edges.ravel()[places ^ 1]


def _rim_values(points: Floats, triangles: Ints, twins: Ints, max_size: Floats) -> tuple[Floats, Floats]:
    """Return cross (0 inside) and size (`max_size` inside) as the rim's edges tell them."""
    n, rim = len(points), np.flatnonzero(twins < 0)
    ends = np.stack([triangles.ravel()[rim], np.roll(triangles, -1, axis=1).ravel()[rim]], axis=1)
    step = points[ends[:, 1]] - points[ends[:, 0]]
    turn, length = 4.0 * np.arctan2(step[:, 1], step[:, 0]), np.hypot(step[:, 0], step[:, 1])
    cos, sin, total, count = (
        np.bincount(ends.ravel(), np.repeat(value, 2), n)
        for value in (np.cos(turn), np.sin(turn), length, np.ones(len(rim)))
    )
    norm = np.hypot(cos, sin)
    cross = np.stack([cos, sin], axis=1) / np.where(norm > 1e-9, norm, 1.0)[:, None]
    return cross, np.where(count > 0, total / np.maximum(count, 1.0), max_size)


@kernel
def _relax_cross(cross: Floats, fixed: Flags, offsets: Ints, neighbors: Ints) -> None:
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
def _limit_growth(size: Floats, points: Floats, offsets: Ints, neighbors: Ints, growth: float) -> None:
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
