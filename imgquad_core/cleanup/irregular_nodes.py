"""Fewer irregular nodes by cavity remeshing: the paper's topology optimisation.

Around every irregular node a cavity of quads grows row by row. As soon as a pattern with fewer irregular nodes fits
its outline, the cavity is filled anew, smoothed on trial, and kept if the quads are good enough:

    sum over new quads of (1 - SJ)  <=  the same over the old ones + `tolerance` * (irregularity saved)

Rim nodes (on constraints) never move and never vanish; `wanted` tells how many quads each node should have.
"""

from __future__ import annotations

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.geometry.quad_shape import quad_area, quad_quality
from imgquad_core.jit import inlined, kernel, verb

from .cavity import (
    CORNERS,
    COST,
    MEMBERS,
    OUTLINE,
    Cavity,
    Net,
    add_ring,
    begin,
    compact,
    insert,
    net_of,
    padded,
    penalty,
    push_all,
    push_side,
    remove,
    scratch,
    settle,
)
from .faces import FaceQuads
from .options import CleanUp
from .patterns import MAX_CORNERS, POINTS, QUADS, Canvas, choose_cut, cut_quads, draw_cut, piece_fits, smooth_drawn

TRIAL_SWEEPS = 5  # of smoothing a new pattern before it is judged; the whole mesh is smoothed later
SMALLEST_SHARE, LARGEST_SHARE = 0.15, 4.0  # of a new quad's area in the mean of the cavity
FEWEST, MOST = 0.7, 1.4  # new quads per old quad
FLAT = 2  # quads beside a side of a pattern
RETRY = 1.3  # a cavity this much larger than the last failed one is tried again at the same gain


def clean_up(mesh: FaceQuads, how: CleanUp, seeds: Flags | None = None) -> FaceQuads:
    """Remesh cavities around irregular nodes.

    Parameters
    ----------
    mesh : FaceQuads
        A valid mesh: counter-clockwise, convex.
    how : CleanUp
        Sizes of cavities and acceptance.
    seeds : bool, shape (n_points,), optional
        Nodes around which to look, of those that are there now. By default all.

    Returns
    -------
    FaceQuads
        The new mesh. Old nodes that live come first, in their order; rim nodes all do.
    """
    if len(mesh.quads) == 0:
        return mesh
    largest = max(how.sizes)
    net = net_of(mesh, largest)
    cavity, canvas = scratch(net, largest)
    begins = padded(np.ones(len(mesh.points), bool) if seeds is None else seeds, len(net.valence), True)
    for size in how.sizes:
        _clean_pass(net, cavity, canvas, begins, size, how.tolerance, how.worst, size > how.thorough)
    return compact(net, mesh)


@verb
def _cost_then(net: Net, cavity: Cavity, inner: int) -> int:
    """Irregularity with a pattern that has `inner` irregular nodes, one quad at each corner and two beside sides."""
    cost, c = inner, 0
    for i in range(cavity.tally[OUTLINE]):
        v = cavity.loop[i]
        quads = 2
        if c < cavity.tally[CORNERS] and cavity.corner[c] == i:
            quads, c = 1, c + 1
        cost += penalty(net.valence[v] - cavity.inside[v] + quads, net.wanted[v], net.rim[v])
    return cost


@verb
def _mean_edge(points: Floats, cavity: Cavity) -> float:
    total, n = 0.0, cavity.tally[OUTLINE]
    for i in range(n):
        u, w = cavity.loop[i], cavity.loop[(i + 1) % n]
        total += np.hypot(points[u, 0] - points[w, 0], points[u, 1] - points[w, 1])
    return float(total / n)


@kernel
def _is_better(net: Net, cavity: Cavity, canvas: Canvas, gain: int, tolerance: float, worst: float) -> bool:
    """Whether the drawn pattern may replace the cavity."""
    old_sum, old_worst, area = 0.0, 1.0, 0.0
    for i in range(cavity.tally[MEMBERS]):
        quality = quad_quality(net.points, net.quads, cavity.members[i])
        old_sum += 1.0 - quality
        old_worst = min(old_worst, quality)
        area += quad_area(net.points, net.quads, cavity.members[i])
    need, mean = min(worst, old_worst), area / cavity.tally[MEMBERS]
    new_sum = 0.0
    for q in range(canvas.tally[QUADS]):
        quality = quad_quality(net.points, canvas.quads, q)
        if quality < need or quality <= 0.0:
            return False
        share = quad_area(net.points, canvas.quads, q) / mean
        if share < SMALLEST_SHARE or share > LARGEST_SHARE:
            return False
        new_sum += 1.0 - quality
    return new_sum <= old_sum + tolerance * gain


@inlined
def _has_room(net: Net, cavity: Cavity, cut: Ints) -> bool:
    """Whether the pattern has about as many quads as the cavity, and mesh and rings can hold it."""
    quads = cut_quads(cavity.length, cavity.tally[CORNERS], cut)
    if not FEWEST * cavity.tally[MEMBERS] <= quads <= MOST * cavity.tally[MEMBERS]:
        return False
    if quads > net.tops[QUADS] or quads > net.tops[POINTS]:
        return False
    for i in range(cavity.tally[OUTLINE]):
        v = cavity.loop[i]
        if net.valence[v] - cavity.inside[v] + 2 > net.ring.shape[1]:
            return False
    return True


@inlined
def _choose(net: Net, cavity: Cavity, cut: Ints, last_gain: int, last_size: int) -> int:
    """Return the gain of the best pattern for the cavity's outline, 0 where none helps; `cut` tells how it is cut."""
    n = cavity.tally[CORNERS]
    cut[4] = 0
    if n < 2 or n > MAX_CORNERS:
        return 0
    whole = piece_fits(cavity.length, n)
    if not whole and n != 2 and n != 4 and n != 6:
        return 0
    inner = (0 if n == 4 else 1) if whole else 2
    gain = cavity.tally[COST] - _cost_then(net, cavity, inner)
    if gain <= 0 or (gain <= last_gain and cavity.tally[MEMBERS] < RETRY * last_size):
        return 0
    edge = _mean_edge(net.points, cavity)
    if whole or choose_cut(net.points, cavity.loop, cavity.corner, cavity.length, n, edge, cut):
        return int(gain)
    return 0


@kernel
def _clean_pass(
    net: Net,
    cavity: Cavity,
    canvas: Canvas,
    begins: Flags,
    largest: int,
    tolerance: float,
    worst: float,
    crowded_only: bool,
) -> int:
    """Try a cavity of up to `largest` quads around each irregular node that `begins` one; return how many succeed."""
    cut = np.zeros(5, np.int64)
    new_id = np.empty(canvas.quads.shape[0], np.int64)
    done = 0
    for v in range(len(net.valence)):
        if not begins[v] or net.valence[v] == 0 or net.valence[v] == net.wanted[v]:
            continue
        if crowded_only and net.valence[v] < net.wanted[v]:
            continue
        begin(cavity)
        add_ring(net, cavity, v)
        last_gain, last_size = 0, 0
        while settle(net, cavity, largest, FLAT):
            gain = _choose(net, cavity, cut, last_gain, last_size)
            if gain > 0:
                if _has_room(net, cavity, cut):
                    canvas.tally[POINTS], canvas.tally[QUADS] = 0, 0
                    draw_cut(canvas, cavity.loop, cavity.corner, cavity.length, cavity.tally[CORNERS], cut)
                    smooth_drawn(canvas, TRIAL_SWEEPS)
                    if _is_better(net, cavity, canvas, gain, tolerance, worst):
                        face = net.face[cavity.members[0]]
                        remove(net, cavity)
                        insert(net, canvas, new_id, face)
                        done += 1
                        break
                last_gain, last_size = gain, cavity.tally[MEMBERS]
            grown = push_all(net, cavity) if cavity.tally[CORNERS] < 2 else push_side(net, cavity)
            if not grown:
                break
    return done
