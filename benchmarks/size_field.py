"""How many quads do the boundaries of a mesh ask for? What the growth of its inner edges is measured by.

The length of edges grows away from each edge of a boundary by ``growth - 1`` a unit of length, up to the size asked
for. The integral of 1 / length^2 over the area is the number of squares that would do.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from imgquad_core.arrays import Floats, Ints

_CLASS = 1.1  # edges are looked up in classes whose lengths differ by no more


def field_integral(points: Floats, quads: Ints, rim: Ints, size: float, growth: float = 1.3) -> float:
    """Integrate over the quarters of each quad: places as near to the boundaries as its own edges are.

    `rim` has the two points of each edge of a boundary, in rows.
    """
    corners = points[quads]
    middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
    centre = corners.mean(axis=1, keepdims=True)
    places = 0.25 * (corners + middles + np.roll(middles, 1, axis=1) + centre)
    quarters = np.stack([corners, middles, np.broadcast_to(centre, corners.shape), np.roll(middles, 1, axis=1)], axis=2)
    diagonal = quarters[:, :, 2:] - quarters[:, :, :2]
    area = 0.5 * np.abs(diagonal[..., 0, 0] * diagonal[..., 1, 1] - diagonal[..., 0, 1] * diagonal[..., 1, 0])
    length = np.full(area.size, size)
    ends = points[rim]
    edge = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    number = np.floor(np.log(edge) / np.log(_CLASS)).astype(np.int64)
    for one in np.unique(number):
        chosen = number == one
        reach = (size - edge[chosen].min()) / (growth - 1.0)
        if reach <= 0.0:
            continue
        tree = cKDTree(ends[chosen].mean(axis=1))
        distance, nearest = tree.query(places.reshape(-1, 2), distance_upper_bound=reach)
        found = np.isfinite(distance)
        grown = edge[chosen][nearest[found]] + (growth - 1.0) * distance[found]
        length[found] = np.minimum(length[found], grown)
    return float((area.ravel() / length**2).sum())
