"""Move nodes for better shape; connectivity stays. No move ever inverts a quad.

Three ways, each for what it does best: Laplace on an active set (cheap, most of the way), Newton's method on the
inverse mean ratio where a ring is not good yet (tails), a pattern search on the worst scaled Jacobian where a ring is
bad (also turns inverted quads back).

Reference: P. M. Knupp, Algebraic mesh quality metrics, SISC 23 (2001), https://doi.org/10.1137/S1064827500371499
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.geometry.quad_shape import is_quad_above, nodes_of_poor, quad_quality
from imgquad_core.grouping import grouped
from imgquad_core.jit import kernel, verb

GUARD = 0.6  # a move may lower a ring's worst scaled Jacobian down to this, not further
TOLERANCE = 0.015  # of the edge length: smaller moves stop the activity of a node
GOOD = 0.9  # Newton works on rings with a quad below this
BAD = 0.35  # the pattern search works on rings below this
SLIVER = 0.02  # of the longest edge at a node: a shorter one makes a triangle of its quads, which no angle tells
LEAST = 0.5  # scaled Jacobian down to which angles may pay for that
SHORT = 0.25  # of the longest edge at a node: the pattern search makes no edge there shorter, for angles alone
POWER = 4  # of the inverse mean ratio in Newton's energy
HALVINGS = 6  # of a Newton step that makes things worse, until the node stays: 1/64 of the step is not worth it
TINY = 1e-300  # added where lengths divide, so that a side of no length gives 0 and no NaN
WAYS = np.array([[np.cos(d * np.pi / 4), np.sin(d * np.pi / 4)] for d in range(8)])  # of the pattern search


class Rings(NamedTuple):
    """Quads and, for each node, the corners ``4 q + k`` that it has."""

    quads: Ints
    offsets: Ints
    corners: Ints


def rings_of(quads: Ints, n_points: int) -> Rings:
    """Return the rings of the nodes of `quads`."""
    quads = np.require(quads, requirements="W")  # kernels are compiled once more for a read-only array
    offsets, corners = grouped(quads, n_points)
    return Rings(quads, offsets, corners)


@kernel
def ring_quality(points: Floats, rings: Rings, v: int) -> float:
    """Worst scaled Jacobian of the quads around node v."""
    worst = 1.0
    for i in range(rings.offsets[v], rings.offsets[v + 1]):
        worst = min(worst, quad_quality(points, rings.quads, rings.corners[i] >> 2))
    return worst


@verb
def is_ring_above(points: Floats, rings: Rings, v: int, floor: float) -> bool:
    """Whether the quads around node v have a scaled Jacobian of `floor` or more; fast where `floor` is positive."""
    for i in range(rings.offsets[v], rings.offsets[v + 1]):
        if not is_quad_above(points, rings.quads, rings.corners[i] >> 2, floor):
            return False
    return True


@verb
def _turns(points: Floats, quads: Ints, corner: int) -> tuple[float, float, float, float, float, float, float]:
    """Cross products of the edges at three corners of a quad, then the squares of its edges.

    p---d
    |   |      the corner is at v; the one at d does not feel where v is
    v---n
    """
    q, k = corner >> 2, corner & 3
    v, n, d, p = quads[q, k], quads[q, (k + 1) & 3], quads[q, (k + 2) & 3], quads[q, (k + 3) & 3]
    vn_x, vn_y = points[n, 0] - points[v, 0], points[n, 1] - points[v, 1]
    nd_x, nd_y = points[d, 0] - points[n, 0], points[d, 1] - points[n, 1]
    dp_x, dp_y = points[p, 0] - points[d, 0], points[p, 1] - points[d, 1]
    pv_x, pv_y = points[v, 0] - points[p, 0], points[v, 1] - points[p, 1]
    return (
        pv_x * vn_y - pv_y * vn_x,
        vn_x * nd_y - vn_y * nd_x,
        dp_x * pv_y - dp_y * pv_x,
        vn_x * vn_x + vn_y * vn_y,
        nd_x * nd_x + nd_y * nd_y,
        dp_x * dp_x + dp_y * dp_y,
        pv_x * pv_x + pv_y * pv_y,
    )


@verb
def is_sound(points: Floats, rings: Rings, v: int, floor: float) -> bool:
    """Whether a move of node v, before which its ring was above `floor`, has left it so."""
    if floor <= 0.0:
        return ring_quality(points, rings, v) >= floor
    square = floor * floor
    for i in range(rings.offsets[v], rings.offsets[v + 1]):
        at_v, at_n, at_p, vn, nd, dp, pv = _turns(points, rings.quads, rings.corners[i])
        if at_v <= 0.0 or at_n <= 0.0 or at_p <= 0.0:
            return False
        if at_v**2 < square * pv * vn or at_n**2 < square * vn * nd or at_p**2 < square * dp * pv:
            return False
    return True


@verb
def _felt_quality(points: Floats, rings: Rings, v: int, floor: float) -> float:
    """Least sine of the corners around node v that feel where it is, or one that is not above `floor`.

    The corners opposite to it do not.
    """
    worst = 1.0
    for i in range(rings.offsets[v], rings.offsets[v + 1]):
        at_v, at_n, at_p, vn, nd, dp, pv = _turns(points, rings.quads, rings.corners[i])
        sine = min(at_v / np.sqrt(pv * vn + TINY), at_n / np.sqrt(vn * nd + TINY))
        worst = min(worst, min(sine, at_p / np.sqrt(dp * pv + TINY)))
        if worst <= floor:
            break
    return worst


@verb
def guarded(points: Floats, rings: Rings, v: int) -> float:
    """Return the scaled Jacobian that a move of node v must leave in its ring."""
    return GUARD if is_ring_above(points, rings, v, GUARD) else ring_quality(points, rings, v)


@verb
def _activate_ring(active: Flags, rings: Rings, v: int) -> None:
    for i in range(rings.offsets[v], rings.offsets[v + 1]):
        for k in range(4):
            active[rings.quads[rings.corners[i] >> 2, k]] = True


@verb
def _is_fair(points: Floats, rings: Rings, v: int, fair: Flags) -> bool:
    """Whether the quads around node v are above the guard; those found so are marked."""
    for i in range(rings.offsets[v], rings.offsets[v + 1]):
        q = rings.corners[i] >> 2
        if not fair[q]:
            if not is_quad_above(points, rings.quads, q, GUARD):
                return False
            fair[q] = True
    return True


@kernel
def laplace(points: Floats, rings: Rings, free: Flags, sweeps: int) -> None:
    """Move free nodes to the mean of their edge neighbours, in place, while anything moves (at most `sweeps` times)."""
    active = free.copy()
    fair = np.zeros(len(rings.quads), np.bool_)  # quads known to be above the guard
    for _ in range(sweeps):
        moved = False
        for v in range(len(points)):
            n = rings.offsets[v + 1] - rings.offsets[v]
            if not (active[v] and free[v]) or n == 0:
                continue
            active[v] = False
            x, y, reach = 0.0, 0.0, 0.0
            old_x, old_y = points[v, 0], points[v, 1]
            for i in range(rings.offsets[v], rings.offsets[v + 1]):
                c = rings.corners[i]
                w = rings.quads[c >> 2, (c + 1) & 3]
                x += points[w, 0]
                y += points[w, 1]
                reach += abs(points[w, 0] - old_x) + abs(points[w, 1] - old_y)
            x, y = x / n, y / n
            if abs(x - old_x) + abs(y - old_y) < TOLERANCE * reach / n:
                continue
            need = GUARD if _is_fair(points, rings, v, fair) else ring_quality(points, rings, v)
            points[v, 0], points[v, 1] = x, y
            if not is_sound(points, rings, v, need):
                points[v, 0], points[v, 1] = old_x, old_y
                continue
            if need < GUARD:
                for i in range(rings.offsets[v], rings.offsets[v + 1]):
                    fair[rings.corners[i] >> 2] = False
            _activate_ring(active, rings, v)
            moved = True
        if not moved:
            break


@kernel
def _corner_energy(
    px: float, py: float, nx: float, ny: float, bx: float, by: float, which: int
) -> tuple[float, float, float, float, float, float]:
    """Energy f^POWER of one corner, f = (|a|^2 + |b|^2) / 2 det, with its derivatives by one of its three points.

    The corner is at p, a runs to n(ext), b to (previous) b; `which` is 0 for p, 1 for n, 2 for b.
    Returns (energy, gx, gy, hxx, hxy, hyy); energy is inf where the corner is folded.
    """
    ax, ay, cx, cy = nx - px, ny - py, bx - px, by - py
    det = ax * cy - ay * cx
    if det <= 0.0:
        return np.inf, 0.0, 0.0, 0.0, 0.0, 0.0
    f = (ax * ax + ay * ay + cx * cx + cy * cy) / (2.0 * det)
    if which == 0:
        sx, sy, dx, dy, h = -(ax + cx), -(ay + cy), ay - cy, cx - ax, 2.0
    elif which == 1:
        sx, sy, dx, dy, h = ax, ay, cy, -cx, 1.0
    else:
        sx, sy, dx, dy, h = cx, cy, -ay, ax, 1.0
    fx, fy = (sx - f * dx) / det, (sy - f * dy) / det
    fxx = (h - 2.0 * fx * dx) / det
    fyy = (h - 2.0 * fy * dy) / det
    fxy = -(fx * dy + fy * dx) / det
    f2 = f * f  # POWER == 4
    first, second = 4.0 * f2 * f, 12.0 * f2
    return (
        f2 * f2,
        first * fx,
        first * fy,
        second * fx * fx + first * fxx,
        second * fx * fy + first * fxy,
        second * fy * fy + first * fyy,
    )


@verb
def ring_energy(points: Floats, rings: Rings, v: int, out: Floats) -> None:
    """Sum energy and derivatives of the three corners of each ring quad that node v is part of, into `out` (6,)."""
    for i in range(6):
        out[i] = 0.0
    for i in range(rings.offsets[v], rings.offsets[v + 1]):
        c = rings.corners[i]
        q, k = c >> 2, c & 3
        for which in range(3):
            # v is the corner itself, or what the corner before it runs to, or what the corner after it comes from
            at = (k + (0, 3, 1)[which]) & 3
            p, n, b = rings.quads[q, at], rings.quads[q, (at + 1) & 3], rings.quads[q, (at + 3) & 3]
            e, gx, gy, hxx, hxy, hyy = _corner_energy(
                points[p, 0], points[p, 1], points[n, 0], points[n, 1], points[b, 0], points[b, 1], which
            )
            out[0] += e
            out[1] += gx
            out[2] += gy
            out[3] += hxx
            out[4] += hxy
            out[5] += hyy


@verb
def energy_of(points: Floats, rings: Rings, v: int) -> float:
    """Sum the energy alone of the same corners; inf where one is folded."""
    total = 0.0
    for i in range(rings.offsets[v], rings.offsets[v + 1]):
        at_v, at_n, at_p, vn, nd, dp, pv = _turns(points, rings.quads, rings.corners[i])
        if at_v <= 0.0 or at_n <= 0.0 or at_p <= 0.0:
            return np.inf
        total += (((pv + vn) / at_v) ** 4 + ((vn + nd) / at_n) ** 4 + ((dp + pv) / at_p) ** 4) / 16.0
    return total


@verb
def _newton_step(out: Floats) -> tuple[float, float]:
    """Descent step from energy derivatives: Newton's, with the Hessian shifted to be positive definite."""
    gx, gy, hxx, hxy, hyy = out[1], out[2], out[3], out[4], out[5]
    mean, spread = 0.5 * (hxx + hyy), np.sqrt(0.25 * (hxx - hyy) ** 2 + hxy * hxy)
    shift = max(0.0, 1e-3 * (abs(mean) + spread) - (mean - spread))
    hxx, hyy = hxx + shift, hyy + shift
    det = hxx * hyy - hxy * hxy
    return -(hyy * gx - hxy * gy) / det, -(hxx * gy - hxy * gx) / det


@kernel
def newton(points: Floats, rings: Rings, free: Flags, sweeps: int, good: float) -> None:
    """Lower the energy of rings that hold a quad worse than `good`, node by node, in place."""
    active = nodes_of_poor(points, rings.quads, good)
    now = np.empty(6)
    for _ in range(sweeps):
        moved = False
        for v in range(len(points)):
            if not (active[v] and free[v]):
                continue
            active[v] = False
            if is_ring_above(points, rings, v, good):
                continue
            need = guarded(points, rings, v)
            ring_energy(points, rings, v, now)
            if not np.isfinite(now[0]) or now[0] == 0.0:
                continue
            dx, dy = _newton_step(now)
            x, y = points[v, 0], points[v, 1]
            c = rings.corners[rings.offsets[v]]
            w = rings.quads[c >> 2, (c + 1) & 3]
            reach = abs(points[w, 0] - x) + abs(points[w, 1] - y)
            for _ in range(HALVINGS):
                points[v, 0], points[v, 1] = x + dx, y + dy
                if energy_of(points, rings, v) < now[0] and is_sound(points, rings, v, need):
                    break  # the energy alone would pay for length with angles
                points[v, 0], points[v, 1] = x, y
                dx, dy = 0.5 * dx, 0.5 * dy
            if abs(points[v, 0] - x) + abs(points[v, 1] - y) > TOLERANCE * reach:
                _activate_ring(active, rings, v)
                moved = True
        if not moved:
            break


@verb
def _reach_of(points: Floats, rings: Rings, v: int) -> tuple[float, float]:
    """Lengths of the shortest and the longest edge at node v."""
    shortest, longest = np.inf, 0.0
    for i in range(rings.offsets[v], rings.offsets[v + 1]):
        c = rings.corners[i]
        w = rings.quads[c >> 2, (c + 1) & 3]
        length = np.hypot(points[w, 0] - points[v, 0], points[w, 1] - points[v, 1])
        shortest, longest = min(shortest, length), max(longest, length)
    return shortest, longest


@kernel
def untangle(points: Floats, rings: Rings, free: Flags, rounds: int, bad: float) -> int:
    """Raise the worst corners that feel a node, where below `bad`, by a pattern search.

    Corners opposite to the node do not count: where they are the worst, what it can do for the others would be missed.
    Returns how many nodes are left with a quad below.
    """
    todo, seen = nodes_of_poor(points, rings.quads, bad), np.zeros(len(points), np.bool_)
    for _ in range(rounds):
        moved = False
        for v in range(len(points)):
            if not (todo[v] and free[v]) or rings.offsets[v] == rings.offsets[v + 1]:
                continue
            todo[v], seen[v] = False, True
            before = _felt_quality(points, rings, v, -1.0)
            if before >= bad:
                continue
            best = before
            shortest, longest = _reach_of(points, rings, v)
            room, step = min(shortest, SHORT * longest), 0.3 * longest
            for _ in range(8):
                x, y = points[v, 0], points[v, 1]
                best_x, best_y = x, y
                for d in range(8):
                    points[v, 0], points[v, 1] = x + step * WAYS[d, 0], y + step * WAYS[d, 1]
                    quality = _felt_quality(points, rings, v, best)
                    if quality > best + 1e-9 and (best <= 0.0 or _reach_of(points, rings, v)[0] >= room):
                        best, best_x, best_y = quality, points[v, 0], points[v, 1]
                points[v, 0], points[v, 1] = best_x, best_y
                if best_x == x and best_y == y:
                    step *= 0.5
            if best > before:
                _activate_ring(todo, rings, v)
                moved = True
        if not moved:
            break
    left = 0
    for v in range(len(points)):
        left += seen[v] and not is_ring_above(points, rings, v, bad)
    return left


@verb
def _move_towards(points: Floats, rings: Rings, targets: Floats, v: int) -> bool:
    """Move node v to its target, or half-way, where its ring stays valid; return whether it is there."""
    x, y = points[v, 0], points[v, 1]
    if x == targets[v, 0] and y == targets[v, 1]:
        return True
    floor = min(0.5 * ring_quality(points, rings, v), 0.3)
    for share in (1.0, 0.5, 0.25):
        points[v, 0] = targets[v, 0] if share == 1.0 else x + share * (targets[v, 0] - x)
        points[v, 1] = targets[v, 1] if share == 1.0 else y + share * (targets[v, 1] - y)
        if ring_quality(points, rings, v) > floor:
            return share == 1.0
    points[v, 0], points[v, 1] = x, y
    return False


def fit_rim(points: Floats, rings: Rings, on_rim: Flags, targets: Floats, rounds: int) -> Flags:
    """Move rim nodes to their targets, in place, making room inside; return which of them did not get there."""
    late = on_rim.copy()
    for _ in range(rounds):
        make_room = _approach(points, rings, late, targets)
        if not late.any():
            break
        make_room &= ~on_rim
        laplace(points, rings, make_room, 2)
        untangle(points, rings, make_room, 1, BAD)
    return late


@kernel
def _approach(points: Floats, rings: Rings, late: Flags, targets: Floats) -> Flags:
    """Move late nodes to their targets as far as may be; return the nodes around those that are late still."""
    around = np.zeros(len(points), np.bool_)
    for v in range(len(points)):
        if late[v]:
            late[v] = not _move_towards(points, rings, targets, v)
            if late[v]:
                _activate_ring(around, rings, v)
    return around


@kernel
def part(points: Floats, rings: Rings, free: Flags, share: float, floor: float, mended: Flags) -> None:
    """Move free nodes away from a neighbour that is nearer than `share` of their longest edge, in place.

    Angles do not see how short a side is. No quad gets a scaled Jacobian below `floor` by it. Where that leaves a
    sliver it may come down to `LEAST`, until it is none; such nodes are flagged in `mended`.
    """
    for v in range(len(points)):
        if not free[v] or rings.offsets[v] == rings.offsets[v + 1]:
            continue
        shortest, longest = _reach_of(points, rings, v)
        if shortest < share * longest:
            shortest, longest = _part(points, rings, v, share, floor)
            if shortest < SLIVER * longest:
                _part(points, rings, v, SLIVER, LEAST)
                mended[v] = True


@verb
def _part(points: Floats, rings: Rings, v: int, share: float, floor: float) -> tuple[float, float]:
    """Move node v until its shortest edge is `share` of its longest one, as far as may be; return their lengths."""
    shortest, longest = _reach_of(points, rings, v)
    step, x, y = SHORT * longest, points[v, 0], points[v, 1]
    while shortest < share * longest and step > TOLERANCE * longest:
        need, best_x, best_y = min(guarded(points, rings, v), floor), x, y
        for d in range(len(WAYS)):
            points[v, 0], points[v, 1] = x + step * WAYS[d, 0], y + step * WAYS[d, 1]
            reach, _ = _reach_of(points, rings, v)
            if reach > shortest and is_sound(points, rings, v, need):
                shortest, best_x, best_y = reach, points[v, 0], points[v, 1]
        points[v, 0], points[v, 1] = best_x, best_y
        if best_x == x and best_y == y:
            step *= 0.5
        x, y = best_x, best_y
    return shortest, longest
