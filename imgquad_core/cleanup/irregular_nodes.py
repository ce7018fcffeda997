"""Fewer irregular nodes by cavity remeshing: the paper's topology optimisation.

Around every irregular node a cavity of quads grows row by row. As soon as a pattern with fewer irregular nodes fits
its outline, the cavity is filled anew, smoothed on trial, and kept if the quads are good enough:

    sum over new quads of (1 - SJ)  <=  the same over the old ones + `tolerance` * (irregularity saved)

Rim nodes (on constraints) never move and never vanish; `wanted` tells how many quads each node should have.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Flags, Ints
from imgquad_core.geometry.quad_shape import quad_area, quad_quality
from imgquad_core.jit import kernel, verb

from .cavity import (
    CORNERS,
    COST,
    MEMBERS,
    OUTLINE,
    STAMP,
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
VAIN, FOUND, CHANGED = range(3)  # what comes of a search
BY_ITSELF = 1 << 40  # quads, more than any cavity: the search ended before it met its limit
RETRY = 1.3  # a cavity this much larger than the last failed one is tried again at the same gain


class Memory(NamedTuple):
    """What vain searches have found out: none is repeated where nothing has changed. Time counts successes."""

    changed: Ints  # when each node was last changed
    face_changed: Ints  # ... or any node of a face
    tried: Ints  # when there was a vain search around each node
    reach: Ints  # up to which number of quads, or `BY_ITSELF`
    gain: Ints  # of the last pattern that was tried then
    size: Ints  # quads of its cavity
    cost: Ints  # irregularity of each face
    least: Ints  # what it cannot fall below
    now: Ints  # (1,)


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
    memory = memory_of(net, len(mesh.points))
    begins = padded(np.ones(len(mesh.points), bool) if seeds is None else seeds, len(net.valence), True)
    for size in how.sizes:
        _clean_pass(net, cavity, canvas, begins, memory, size, how.tolerance, how.worst, size > how.thorough)
    return compact(net, mesh)


def memory_of(net: Net, n: int) -> Memory:
    """Return the memory of a mesh of n nodes before any search.

    The sum of wanted less present quads over the nodes of a face is the same for all meshes of it (Euler), and no node
    has less irregularity than it lacks quads or has too many: the sum is what irregularity cannot fall below.
    """
    n_faces = int(net.face.max()) + 1
    used = np.flatnonzero(net.valence[:n])
    face = net.face[net.ring[used, 0]]
    more = (net.valence - net.wanted)[used]
    cost = np.where(net.rim[used], np.maximum(-4 * more, 2 * more), np.maximum(2 * np.abs(more) - 1, 0))  # `penalty`
    changed, tried, reach, gain, size = (np.zeros(len(net.valence), np.int64) for _ in range(5))
    cost, least = (np.bincount(face, values, n_faces).astype(np.int64) for values in (cost, more))
    return Memory(
        changed, np.zeros(n_faces, np.int64), tried, reach, gain, size, cost, np.abs(least), np.zeros(1, np.int64)
    )


@verb
def _is_unchanged(net: Net, cavity: Cavity, changed: Ints, since: int) -> bool:
    """Whether nothing that growing the cavity has looked at was changed: its quads and those beside them."""
    for i in range(cavity.tally[MEMBERS]):
        for h in range(4 * cavity.members[i], 4 * cavity.members[i] + 4):
            if changed[net.quads[h >> 2, h & 3]] > since:
                return False
            t = net.twins[h] >> 2
            if t >= 0 and cavity.in_cavity[t] != cavity.tally[STAMP]:
                for k in range(4):
                    if changed[net.quads[t, k]] > since:
                        return False
    return True


@verb
def _remember_change(cavity: Cavity, memory: Memory, face: int, new_id: Ints, n_new: int) -> None:
    memory.now[0] += 1
    memory.face_changed[face] = memory.now[0]
    for i in range(cavity.tally[OUTLINE]):
        memory.changed[cavity.loop[i]] = memory.now[0]
    for i in range(n_new):
        memory.changed[new_id[i]] = memory.now[0]


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


@verb
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


@verb
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
    if whole or choose_cut(net.points, cavity.loop, cavity.corner, cavity.length, n, cut):
        return int(gain)
    return 0


@verb
def _draw_better(
    net: Net, cavity: Cavity, canvas: Canvas, cut: Ints, gain: int, tolerance: float, worst: float
) -> bool:
    """Draw a pattern and smooth it; return whether it may replace the cavity."""
    canvas.tally[POINTS], canvas.tally[QUADS] = 0, 0
    draw_cut(canvas, cavity.loop, cavity.corner, cavity.length, cavity.tally[CORNERS], cut)
    smooth_drawn(canvas, TRIAL_SWEEPS)
    return _is_better(net, cavity, canvas, gain, tolerance, worst)


@verb
def _search(
    net: Net,
    cavity: Cavity,
    canvas: Canvas,
    cut: Ints,
    memory: Memory,
    v: int,
    known: int,
    largest: int,
    tolerance: float,
    worst: float,
) -> int:
    """Grow a cavity around node v until a better pattern fits, which is drawn then.

    Cavities of up to `known` quads were tried in vain before: they are grown only. If anything has changed since then
    this is `CHANGED`, without a result.
    """
    begin(cavity)
    add_ring(net, cavity, v)
    last_gain, last_size, outcome = 0, 0, VAIN
    while settle(net, cavity, largest, FLAT):
        size = cavity.tally[MEMBERS]
        if 0 < known < size:
            if not _is_unchanged(net, cavity, memory.changed, memory.tried[v]):
                break
            known, last_gain, last_size = 0, memory.gain[v], memory.size[v]
        if known == 0:
            gain = _choose(net, cavity, cut, last_gain, last_size)
            if gain > 0:
                if _has_room(net, cavity, cut) and _draw_better(net, cavity, canvas, cut, gain, tolerance, worst):
                    outcome, memory.gain[v] = FOUND, gain
                    break
                last_gain, last_size = gain, size
        grown = push_all(net, cavity) if cavity.tally[CORNERS] < 2 else push_side(net, cavity)
        if not grown:
            break
    if known > 0 and not _is_unchanged(net, cavity, memory.changed, memory.tried[v]):
        outcome = CHANGED
    if outcome == VAIN:
        if known == 0:
            memory.gain[v], memory.size[v] = last_gain, last_size
        memory.tried[v] = memory.now[0]
        least = memory.reach[v] if known > 0 else 0
        memory.reach[v] = BY_ITSELF if cavity.tally[MEMBERS] <= largest else max(largest, least)
        if min(net.tops[QUADS], net.tops[POINTS]) < 2 * largest:
            memory.reach[v] = 0  # it may have failed for want of room
    return outcome


@kernel
def _clean_pass(
    net: Net,
    cavity: Cavity,
    canvas: Canvas,
    begins: Flags,
    memory: Memory,
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
        face, known, outcome = net.face[net.ring[v, 0]], memory.reach[v], CHANGED
        if memory.cost[face] <= memory.least[face]:
            continue
        if known == BY_ITSELF and memory.face_changed[face] <= memory.tried[v]:
            continue
        while outcome == CHANGED:
            outcome = _search(net, cavity, canvas, cut, memory, v, known, largest, tolerance, worst)
            known = 0
        if outcome == FOUND:
            memory.cost[face] -= memory.gain[v]
            remove(net, cavity)
            insert(net, canvas, new_id, face)
            _remember_change(cavity, memory, face, new_id, canvas.tally[POINTS])
            done += 1
    return done
