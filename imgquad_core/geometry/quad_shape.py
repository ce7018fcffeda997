"""The shape of one quad, in kernels: scaled Jacobian, area, corner angles."""

from __future__ import annotations

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.jit import kernel, verb


@kernel
def quad_quality(points: Floats, quads: Ints, q: int) -> float:
    """Scaled Jacobian of quad q: the least sine of its corners (negative where one is reflex)."""
    worst = 1.0
    p = quads[q, 3]
    ax, ay = points[quads[q, 0], 0] - points[p, 0], points[quads[q, 0], 1] - points[p, 1]
    for k in range(4):  # at corner p, edge a comes in and edge b goes out
        p, n = quads[q, k], quads[q, (k + 1) & 3]
        bx, by = points[n, 0] - points[p, 0], points[n, 1] - points[p, 1]
        sine = (ax * by - ay * bx) / (np.sqrt((ax * ax + ay * ay) * (bx * bx + by * by)) + 1e-300)
        worst = min(worst, sine)
        ax, ay = bx, by
    return float(worst)


@kernel
def quad_area(points: Floats, quads: Ints, q: int) -> float:
    """Signed area of a quad."""
    a, b, c, d = quads[q, 0], quads[q, 1], quads[q, 2], quads[q, 3]
    ac_x, ac_y = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    return float(0.5 * (ac_x * (points[d, 1] - points[b, 1]) - (points[d, 0] - points[b, 0]) * ac_y))


@verb
def is_quad_above(points: Floats, quads: Ints, q: int, floor: float) -> bool:
    """Whether quad q has a scaled Jacobian of `floor` or more; fast where `floor` is positive."""
    if floor <= 0.0:
        return quad_quality(points, quads, q) >= floor
    p = quads[q, 3]
    ax, ay = points[quads[q, 0], 0] - points[p, 0], points[quads[q, 0], 1] - points[p, 1]
    for k in range(4):  # squares instead of roots
        p, n = quads[q, k], quads[q, (k + 1) & 3]
        bx, by = points[n, 0] - points[p, 0], points[n, 1] - points[p, 1]
        turn = ax * by - ay * bx
        if turn <= 0.0 or turn * turn < floor * floor * (ax * ax + ay * ay) * (bx * bx + by * by):
            return False
        ax, ay = bx, by
    return True


@kernel
def nodes_of_poor(points: Floats, quads: Ints, below: float) -> Flags:
    """Return which nodes have a quad of a scaled Jacobian below `below`."""
    poor = np.zeros(len(points), np.bool_)
    for q in range(len(quads)):
        if not is_quad_above(points, quads, q, below):
            for k in range(4):
                poor[quads[q, k]] = True
    return poor


@kernel
def lower_to_worst(points: Floats, quads: Ints, face: Ints, worst: Floats) -> None:
    """Lower the value of each face to the worst scaled Jacobian of its quads, in place."""
    for q in range(len(quads)):
        worst[face[q]] = min(worst[face[q]], quad_quality(points, quads, q))


@kernel
def rim_angles(points: Floats, quads: Ints, rim: Flags) -> Floats:
    """Sum of the corner angles at each rim node: the angle of its sector; 0 for the others."""
    angle = np.zeros(len(points))
    for q in range(len(quads)):
        for k in range(4):
            if not rim[quads[q, k]]:
                continue
            v, a, b = quads[q, k], quads[q, (k + 1) & 3], quads[q, (k + 3) & 3]
            ax, ay = points[a, 0] - points[v, 0], points[a, 1] - points[v, 1]
            bx, by = points[b, 0] - points[v, 0], points[b, 1] - points[v, 1]
            angle[v] += np.arctan2(ax * by - ay * bx, ax * bx + ay * by)
    return angle
