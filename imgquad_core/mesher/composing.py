r"""Compose triangles into quadrilaterals, best first (the paper's "triangular composing").

Two triangles beside an edge become one quad. Because the points stand in layers along the cross field, the best
pairs are those of the layers. Triangles that stay single are split into three quads later: no parity is asked for.

         c                       c
        / \                     / \
       a---b    edge h: a->b    a   b      corners of the pair, counter-clockwise: c a d b
        \ /                     \ /
         d                       d
"""

from __future__ import annotations

from typing import Any

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.jit import kernel, verb

from .cutting import CutMesh

WORST_PAIR = 0.25  # scaled Jacobian below which two triangles stay apart
WORST_AUGMENTED = 0.5  # the same for pairs made by augmentation, which would bring bad pairs back
WIDE_CORNER = -0.6  # cosine: no pair may have a corner wider than 127 degrees on a constraint
AUGMENTATIONS = 3  # passes over the triangles left over, at most; it ends with the first that pairs none


def compose(mesh: CutMesh) -> Ints:
    """Pair triangles to quads.

    Returns
    -------
    int64, shape (n_triangles,)
        The half-edge of each triangle that vanishes in its pair, -1 for a single triangle.
    """
    quality = _pair_quality(mesh.points, mesh.triangles, mesh.twins, mesh.on_rim)
    candidates = np.flatnonzero(quality > WORST_PAIR)
    best_first = candidates[np.argsort(-quality[candidates], kind="stable")]
    mate = _greedy(best_first, mesh.twins)
    for _ in range(AUGMENTATIONS):
        if _augment(mate, mesh.twins, quality) == 0:
            break
    return mate


@verb
def _corner(points: Floats, v: int, a: int, b: int) -> tuple[float, float]:
    """Return sine and cosine of the angle at v from edge v->a to edge v->b."""
    ax, ay = points[a, 0] - points[v, 0], points[a, 1] - points[v, 1]
    bx, by = points[b, 0] - points[v, 0], points[b, 1] - points[v, 1]
    norm = np.sqrt((ax * ax + ay * ay) * (bx * bx + by * by)) + 1e-300
    return (ax * by - ay * bx) / norm, (ax * bx + ay * by) / norm


@kernel
def _pair_quality(points: Floats, triangles: Ints, twins: Ints, on_rim: Flags) -> Floats:
    """Scaled Jacobian of the pair beside each half-edge; -1 on the rim, where barred, and for one of two twins."""
    quality = np.full(twins.size, -1.0)
    for h in range(twins.size):
        g = twins[h]
        if g <= h:
            continue
        t, k = h // 3, h % 3
        a, b, c = triangles[t, k], triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
        d = triangles[g // 3, (g % 3 + 2) % 3]
        sine_a, cosine_a = _corner(points, a, d, c)
        sine_b, cosine_b = _corner(points, b, c, d)
        if (on_rim[a] and cosine_a < WIDE_CORNER) or (on_rim[b] and cosine_b < WIDE_CORNER):
            continue
        quality[h] = min(min(sine_a, sine_b), min(_corner(points, c, a, b)[0], _corner(points, d, b, a)[0]))
    return quality


@kernel
def _greedy(best_first: Ints, twins: Ints) -> Ints:
    """Pair free triangles in the given order of edges."""
    mate = np.full(twins.size // 3, -1, np.int64)
    for h in best_first:
        t, u = h // 3, twins[h] // 3
        if mate[t] < 0 and mate[u] < 0:
            mate[t] = h
            mate[u] = twins[h]
    return mate


@kernel
def _augment(mate: Ints, twins: Ints, quality: Floats) -> int:
    """Turn single - pair - single into two pairs wherever both are good; return how often.

    t | a = b | u   becomes   t = a | b = u
    """
    count = 0
    for t in range(mate.size):
        if mate[t] >= 0:
            continue
        none: Any = np.int64(-1)
        best, best_ta, best_bu = WORST_AUGMENTED, none, none
        for ta in range(3 * t, 3 * t + 3):
            if twins[ta] < 0 or max(quality[ta], quality[twins[ta]]) < best:
                continue
            a = twins[ta] // 3
            if mate[a] < 0:
                continue
            b = twins[mate[a]] // 3
            for bu in range(3 * b, 3 * b + 3):
                u = twins[bu] // 3 if twins[bu] >= 0 else -1
                if u < 0 or u == t or u == a or mate[u] >= 0:
                    continue
                worst = min(max(quality[ta], quality[twins[ta]]), max(quality[bu], quality[twins[bu]]))
                if worst > best:
                    best, best_ta, best_bu = worst, ta, bu
        if best_ta >= 0:
            for h in (best_ta, best_bu):
                mate[h // 3] = h
                mate[twins[h] // 3] = twins[h]
            count += 1
    return count
