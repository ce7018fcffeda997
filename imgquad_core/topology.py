"""Fewer irregular nodes by cavity remeshing: the paper's topology optimisation.

Around every irregular node a cavity of quads grows row by row. As soon as a pattern with fewer irregular nodes fits
its outline, the cavity is filled anew, smoothed on trial, and kept if the quads are good enough:

    sum over new quads of (1 - SJ)  <=  the same over the old ones + `tolerance` * (irregularity saved)

Rim nodes (on constraints) never move and never vanish; `wanted` tells how many quads each node should have.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .halfedge import corners_at, twins_of
from .jit import kernel
from .patterns import (
    CUT,
    MAX_CORNERS,
    NONE,
    WHOLE,
    Canvas,
    choose_cut,
    cut_quads,
    draw_cut,
    draw_piece,
    piece_fits,
    piece_quads,
    smooth_drawn,
)
from .relaxation import quad_quality
from .splitting import INNER_VALENCE, FaceQuads

Ids = NDArray[np.int64]
Points = NDArray[np.float64]

TRIAL_SWEEPS = 5
SMALLEST_SHARE, LARGEST_SHARE = 0.15, 4.0  # of a new quad's area in the mean of the cavity
FEWEST, MOST = 0.7, 1.4  # new quads per old quad
RETRY = 1.3  # a cavity this much larger than the last failed one is tried again at the same gain
MAX_GROWTH_STEPS = 200


class CleanUp(NamedTuple):
    """How far the clean-up goes."""

    sizes: tuple[int, ...]  #: largest cavity (quads) of each pass
    tolerance: float  #: quality that may be paid for one irregular node
    worst: float  #: scaled Jacobian that every new quad must have, unless the old ones were worse


class _Net(NamedTuple):
    """A quad mesh that changes. Dead quads have quads[q, 0] == -1, dead nodes valence 0."""

    points: Points  # (capacity + scratch, 2)
    quads: Ids  # (capacity, 4)
    twins: Ids  # (4 capacity,)
    ring: Ids  # (node capacity, width): quads at each node
    valence: Ids
    wanted: Ids
    rim: NDArray[np.bool_]
    free_quads: Ids  # stack of unused quad ids
    free_nodes: Ids
    tops: Ids  # [free quads, free nodes] on the stacks
    touched: Ids  # (node capacity,): clock of the last change at each node
    face: Ids  # (capacity,): face of each quad


class _Cavity(NamedTuple):
    """Scratch of one cavity."""

    members: Ids  # quads
    in_cavity: Ids  # stamp of each quad
    seen: Ids  # stamp of each node of the cavity
    inside: Ids  # cavity quads at each node of the cavity
    on_loop: Ids  # stamp of each node of the outline
    loop: Ids  # outline, counter-clockwise
    edge: Ids  # half-edge of the cavity that leaves each outline node
    corner: Ids  # places of the corners in the outline
    length: Ids  # edges between corners
    count: Ids  # [members, outline, corners, stamp]


def clean_up(mesh: FaceQuads, how: CleanUp) -> FaceQuads:
    """Remesh cavities around irregular nodes.

    Parameters
    ----------
    mesh : FaceQuads
        A valid mesh: counter-clockwise, convex.
    how : CleanUp
        Sizes of cavities and acceptance.

    Returns
    -------
    FaceQuads
        The new mesh. Old nodes that live come first, in their order; rim nodes all do.
    """
    if len(mesh.quads) == 0:
        return mesh
    largest = max(how.sizes)
    net = _net_of(mesh, largest)
    cavity, canvas = _scratch(net, largest)
    for size in how.sizes:
        _clean_pass(net, cavity, canvas, size, how.tolerance, how.worst)
    return _compact(net, mesh)


def _net_of(mesh: FaceQuads, largest: int) -> _Net:
    n, m = len(mesh.points), len(mesh.quads)
    # cavities may gain quads: room for one that grows by MOST, and a share of the mesh
    node_room, quad_room = n + n // 4 + 2 * largest, m + m // 4 + 2 * largest
    offsets, corners = corners_at(mesh.quads, n)
    valence = _padded(np.diff(offsets), node_room, 0)
    ring = np.full((node_room, max(16, int(valence.max()) + 2)), -1, np.int64)
    _fill_rings(ring, offsets, corners)
    return _Net(
        _padded(mesh.points, node_room + _scratch_points(largest), 0),
        _padded(mesh.quads, quad_room, -1),
        _padded(twins_of(mesh.quads, n), 4 * quad_room, -1),
        ring,
        valence,
        _padded(mesh.wanted, node_room, INNER_VALENCE),
        _padded(mesh.origin >= 0, node_room, False),
        _free_ids(m, quad_room),
        _free_ids(n, node_room),
        np.array([quad_room - m, node_room - n]),
        np.zeros(node_room, np.int64),
        _padded(mesh.face, quad_room, -1),
    )


def _padded(values: NDArray[Any], room: int, filler: Any) -> NDArray[Any]:
    out = np.full((room, *values.shape[1:]), filler, values.dtype)
    out[: len(values)] = values
    return out


def _free_ids(used: int, room: int) -> Ids:
    """Return a stack for `room` ids on which those from `used` on lie, the lowest on top."""
    stack = np.zeros(room, np.int64)
    stack[: room - used] = np.arange(room - 1, used - 1, -1)
    return stack


def _scratch_points(largest: int) -> int:
    return 4 * largest + 64


def _scratch(net: _Net, largest: int) -> tuple[_Cavity, Canvas]:
    n, m, few = len(net.valence), len(net.quads), 4 * largest + 64
    cavity = _Cavity(
        np.empty(few, np.int64),
        np.zeros(m, np.int64),
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.empty(few, np.int64),
        np.empty(few, np.int64),
        np.empty(few, np.int64),
        np.empty(few, np.int64),
        np.zeros(4, np.int64),
    )
    canvas = Canvas(
        net.points,
        n,
        np.empty((few, 4), np.int64),
        np.zeros(2, np.int64),
        np.empty(few, np.int64),
        np.empty(few, np.int64),
        np.empty(few, np.int64),
        np.empty(few, np.int64),
        np.empty((few, 3)),
    )
    return cavity, canvas


@kernel
def _fill_rings(ring: Ids, offsets: Ids, corners: Ids) -> None:
    for v in range(offsets.size - 1):
        for i in range(offsets[v], offsets[v + 1]):
            ring[v, i - offsets[v]] = corners[i] >> 2


@kernel
def _penalty(valence: int, wanted: int, rim: bool) -> int:
    """Irregularity of a node: 1, 3, 5, ... inside; on the rim a missing quad (a wide corner) is worst."""
    d = valence - wanted
    if d == 0:
        return 0
    if rim:
        return -4 * d if d < 0 else 2 * d
    return 2 * abs(d) - 1


@kernel
def _add_quad(net: _Net, cavity: _Cavity, q: int) -> None:
    """Put quad q into the cavity."""
    stamp = cavity.count[3]
    if cavity.in_cavity[q] == stamp:
        return
    cavity.in_cavity[q] = stamp
    if cavity.count[0] < cavity.members.size:
        cavity.members[cavity.count[0]] = q
    cavity.count[0] += 1
    for k in range(4):
        v = net.quads[q, k]
        if cavity.seen[v] != stamp:
            cavity.seen[v] = stamp
            cavity.inside[v] = 0
        cavity.inside[v] += 1


@kernel
def _add_ring(net: _Net, cavity: _Cavity, v: int) -> bool:
    """Put all quads at node v into the cavity; return whether that was any."""
    before = cavity.count[0]
    for i in range(net.valence[v]):
        _add_quad(net, cavity, net.ring[v, i])
    return cavity.count[0] > before


@kernel
def _is_outline(net: _Net, cavity: _Cavity, h: int) -> bool:
    t = net.twins[h]
    return t < 0 or cavity.in_cavity[t >> 2] != cavity.count[3]


@kernel
def _trace_outline(net: _Net, cavity: _Cavity) -> int:
    """Trace the cavity's outline; return its length, 0 if quads were added at a pinch, -1 if it is not one loop."""
    stamp = cavity.count[3]
    total, start = 0, np.int64(-1)
    for i in range(cavity.count[0]):
        for h in range(4 * cavity.members[i], 4 * cavity.members[i] + 4):
            if _is_outline(net, cavity, h):
                total += 1
                if start < 0:
                    start = h
    if start < 0 or total > cavity.loop.size:
        return -1
    n, h = 0, start
    while True:
        v = net.quads[h >> 2, h & 3]
        if cavity.on_loop[v] == -stamp:  # a pinch: the outline passes the node twice
            return 0 if _add_ring(net, cavity, v) else -1
        cavity.on_loop[v] = -stamp
        cavity.loop[n], cavity.edge[n] = v, h
        n += 1
        h = (h & ~3) + ((h + 1) & 3)
        while not _is_outline(net, cavity, h):
            t = net.twins[h]
            h = (t & ~3) + ((t + 1) & 3)
        if h == start:
            break
    return n if n == total else -1


@kernel
def _find_corners(net: _Net, cavity: _Cavity) -> bool:
    """Find the corners of the outline; return False if a concave node made the cavity grow (or it has to stop)."""
    n = 0
    for i in range(cavity.count[1]):
        v = cavity.loop[i]
        need = net.wanted[v] - (net.valence[v] - cavity.inside[v])
        if need >= 3:
            if not _add_ring(net, cavity, v):
                cavity.count[1] = -1
            return False
        if need <= 1:
            if n > 0:
                cavity.length[n - 1] = i - cavity.corner[n - 1]
            cavity.corner[n] = i
            n += 1
    if n > 0:
        cavity.length[n - 1] = cavity.count[1] - cavity.corner[n - 1] + cavity.corner[0]
    cavity.count[2] = n
    return True


@kernel
def _settle(net: _Net, cavity: _Cavity, largest: int) -> bool:
    """Grow the cavity until its outline is one loop without concave nodes; return whether it got there."""
    for _ in range(MAX_GROWTH_STEPS):
        if cavity.count[0] > largest:
            return False
        stamp = cavity.count[3]
        n = _trace_outline(net, cavity)
        for i in range(min(cavity.count[0], cavity.members.size)):  # take the marks of the loop back
            for k in range(4):
                cavity.on_loop[net.quads[cavity.members[i], k]] = 0
        if n < 0:
            return False
        cavity.count[1] = n
        if n > 0 and _find_corners(net, cavity):
            for i in range(n):
                cavity.on_loop[cavity.loop[i]] = stamp
            return True
        if cavity.count[1] < 0:
            return False
    return False


@kernel
def _push_side(net: _Net, cavity: _Cavity) -> bool:
    """Grow the cavity by the row behind one side: the one with most irregular nodes, then the longest."""
    n, n_loop, stamp = cavity.count[2], cavity.count[1], cavity.count[3]
    best, best_score = -1, -1
    for s in range(n):
        score, blocked = 0, False
        for i in range(cavity.length[s]):
            t = net.twins[cavity.edge[(cavity.corner[s] + i) % n_loop]]
            if t < 0:
                blocked = True
                break
            for k in range(4):
                v = net.quads[t >> 2, k]
                if cavity.seen[v] != stamp and net.valence[v] != net.wanted[v]:
                    score += 1000
        score += cavity.length[s]
        if not blocked and score > best_score:
            best, best_score = s, score
    if best < 0:
        return False
    for i in range(cavity.length[best]):
        _add_quad(net, cavity, net.twins[cavity.edge[(cavity.corner[best] + i) % n_loop]] >> 2)
    return True


@kernel
def _push_all(net: _Net, cavity: _Cavity) -> bool:
    """Grow the cavity on all sides."""
    before, n_loop = cavity.count[0], cavity.count[1]
    for i in range(n_loop):
        t = net.twins[cavity.edge[i]]
        if t >= 0:
            _add_quad(net, cavity, t >> 2)
    return cavity.count[0] > before


@kernel
def _cost_now(net: _Net, cavity: _Cavity) -> int:
    """Irregularity of all nodes of the cavity."""
    stamp, cost = cavity.count[3], 0
    for i in range(cavity.count[0]):
        for k in range(4):
            v = net.quads[cavity.members[i], k]
            if cavity.seen[v] == stamp:
                cost += _penalty(net.valence[v], net.wanted[v], net.rim[v])
                cavity.seen[v] = -stamp
    for i in range(cavity.count[0]):
        for k in range(4):
            cavity.seen[net.quads[cavity.members[i], k]] = stamp
    return cost


@kernel
def _cost_then(net: _Net, cavity: _Cavity, inner: int) -> int:
    """Irregularity with a pattern that has `inner` irregular nodes, one quad at each corner and two beside sides."""
    cost, c = inner, 0
    for i in range(cavity.count[1]):
        v = cavity.loop[i]
        quads = 2
        if c < cavity.count[2] and cavity.corner[c] == i:
            quads, c = 1, c + 1
        cost += _penalty(net.valence[v] - cavity.inside[v] + quads, net.wanted[v], net.rim[v])
    return cost


@kernel
def _area(points: Points, quads: Ids, q: int) -> float:
    a, b, c, d = quads[q, 0], quads[q, 1], quads[q, 2], quads[q, 3]
    return 0.5 * (
        (points[c, 0] - points[a, 0]) * (points[d, 1] - points[b, 1])
        - (points[d, 0] - points[b, 0]) * (points[c, 1] - points[a, 1])
    )


@kernel
def _mean_edge(points: Points, cavity: _Cavity) -> float:
    total, n = 0.0, cavity.count[1]
    for i in range(n):
        u, w = cavity.loop[i], cavity.loop[(i + 1) % n]
        total += np.hypot(points[u, 0] - points[w, 0], points[u, 1] - points[w, 1])
    return total / n


@kernel
def _draw(net: _Net, cavity: _Cavity, canvas: Canvas, kind: int, cut: Ids) -> None:
    """Draw the chosen pattern into the cavity and smooth it."""
    canvas.count[:] = 0
    n_loop = cavity.count[1]
    if kind == CUT:
        draw_cut(canvas, cavity.loop, cavity.corner, cavity.length, cavity.count[2], cut)
    else:
        for i in range(n_loop):
            canvas.poly[i] = cavity.loop[(cavity.corner[0] + i) % n_loop]
        draw_piece(canvas, cavity.length, cavity.count[2])
    smooth_drawn(canvas, TRIAL_SWEEPS)


@kernel
def _is_better(net: _Net, cavity: _Cavity, canvas: Canvas, gain: int, tolerance: float, worst: float) -> bool:
    """Whether the drawn pattern may replace the cavity."""
    old_sum, old_worst, area = 0.0, 1.0, 0.0
    for i in range(cavity.count[0]):
        quality = quad_quality(net.points, net.quads, cavity.members[i])
        old_sum += 1.0 - quality
        old_worst = min(old_worst, quality)
        area += _area(net.points, net.quads, cavity.members[i])
    need, mean = min(worst, old_worst), area / cavity.count[0]
    new_sum = 0.0
    for q in range(canvas.count[1]):
        quality = quad_quality(net.points, canvas.quads, q)
        if quality < need or quality <= 0.0:
            return False
        share = _area(net.points, canvas.quads, q) / mean
        if share < SMALLEST_SHARE or share > LARGEST_SHARE:
            return False
        new_sum += 1.0 - quality
    return new_sum <= old_sum + tolerance * gain


@kernel
def _has_room(net: _Net, cavity: _Cavity, kind: int, cut: Ids) -> bool:
    """Whether the pattern has about as many quads as the cavity, and mesh and rings can hold it."""
    n = cavity.count[2]
    quads = cut_quads(cavity.length, n, cut) if kind == CUT else piece_quads(cavity.length, n)
    if not FEWEST * cavity.count[0] <= quads <= MOST * cavity.count[0]:
        return False
    if quads > net.tops[0] or quads > net.tops[1]:
        return False
    for i in range(cavity.count[1]):
        v = cavity.loop[i]
        if net.valence[v] - cavity.inside[v] + 2 > net.ring.shape[1]:
            return False
    return True


@kernel
def _remove(net: _Net, cavity: _Cavity) -> None:
    """Take the cavity's quads out of the mesh."""
    stamp = cavity.count[3]
    for i in range(cavity.count[1]):
        v, n = cavity.loop[i], 0
        for j in range(net.valence[v]):
            if cavity.in_cavity[net.ring[v, j]] != stamp:
                net.ring[v, n] = net.ring[v, j]
                n += 1
        net.valence[v] = n
    for i in range(cavity.count[0]):
        q = cavity.members[i]
        for k in range(4):
            v = net.quads[q, k]
            if cavity.on_loop[v] != stamp and net.valence[v] > 0:
                net.valence[v] = 0
                net.free_nodes[net.tops[1]] = v
                net.tops[1] += 1
        net.quads[q, 0] = -1
        net.free_quads[net.tops[0]] = q
        net.tops[0] += 1


@kernel
def _insert(net: _Net, canvas: Canvas, new_id: Ids, clock: int, face: int) -> None:
    """Put the drawn quads into the mesh."""
    for p in range(canvas.count[0]):
        net.tops[1] -= 1
        v = net.free_nodes[net.tops[1]]
        new_id[p] = v
        net.points[v] = canvas.points[canvas.first + p]
        net.wanted[v], net.rim[v], net.valence[v] = INNER_VALENCE, False, 0
    for i in range(canvas.count[1]):
        net.tops[0] -= 1
        q = net.free_quads[net.tops[0]]
        net.face[q] = face
        for k in range(4):
            v = canvas.quads[i, k]
            if v >= canvas.first:
                v = new_id[v - canvas.first]
            net.quads[q, k] = v
            net.ring[v, net.valence[v]] = q
            net.valence[v] += 1
            net.touched[v] = clock
        canvas.quads[i, 0] = q  # from here on: the ids of the new quads
    for i in range(canvas.count[1]):
        _join(net, canvas.quads[i, 0])


@kernel
def _join(net: _Net, q: int) -> None:
    """Set the twins of the four half-edges of quad q."""
    for k in range(4):
        u, w = net.quads[q, k], net.quads[q, (k + 1) & 3]
        net.twins[4 * q + k] = -1
        for i in range(net.valence[w]):
            g = net.ring[w, i]
            for j in range(4):
                if net.quads[g, j] == w and net.quads[g, (j + 1) & 3] == u:
                    net.twins[4 * q + k] = 4 * g + j
                    net.twins[4 * g + j] = 4 * q + k


@kernel
def _choose(net: _Net, cavity: _Cavity, cut: Ids, last_gain: int, last_size: int) -> tuple[int, int]:
    """Return (kind of pattern, gain) for the cavity's outline; kind NONE where none helps."""
    n = cavity.count[2]
    if n < 2 or n > MAX_CORNERS:
        return NONE, 0
    whole = piece_fits(cavity.length, n)
    if not whole and n != 2 and n != 4 and n != 6:
        return NONE, 0
    inner = (0 if n == 4 else 1) if whole else 2
    gain = _cost_now(net, cavity) - _cost_then(net, cavity, inner)
    if gain <= 0 or (gain <= last_gain and cavity.count[0] < RETRY * last_size):
        return NONE, 0
    if whole:
        return WHOLE, gain
    if choose_cut(
        net.points, cavity.loop, cavity.corner, cavity.length, n, _mean_edge(net.points, cavity), cut
    ):
        return CUT, gain
    return NONE, 0


@kernel
def _remesh_around(
    net: _Net, cavity: _Cavity, canvas: Canvas, seed: int, largest: int, tolerance: float, worst: float,
    cut: Ids, new_id: Ids, clock: int,
) -> bool:
    """Grow a cavity around node `seed` and remesh it; return whether that was done."""
    cavity.count[3] += 1
    cavity.count[0] = 0
    _add_ring(net, cavity, seed)
    last_gain, last_size = 0, 0
    while _settle(net, cavity, largest):
        kind, gain = _choose(net, cavity, cut, last_gain, last_size)
        if kind != NONE:
            if _has_room(net, cavity, kind, cut):
                _draw(net, cavity, canvas, kind, cut)
                if _is_better(net, cavity, canvas, gain, tolerance, worst):
                    face = net.face[cavity.members[0]]
                    _remove(net, cavity)
                    _insert(net, canvas, new_id, clock, face)
                    return True
            last_gain, last_size = gain, cavity.count[0]
        if cavity.count[2] < 2:
            if not _push_all(net, cavity):
                return False
        elif not _push_side(net, cavity):
            return False
    return False


@kernel
def _clean_pass(net: _Net, cavity: _Cavity, canvas: Canvas, largest: int, tolerance: float, worst: float) -> int:
    """Try a cavity of up to `largest` quads around each irregular node; return how many were remeshed."""
    cut = np.empty(5, np.int64)
    new_id = np.empty(canvas.quads.shape[0], np.int64)
    done = 0
    for v in range(len(net.valence)):
        if net.valence[v] == 0 or net.valence[v] == net.wanted[v]:
            continue
        if _remesh_around(net, cavity, canvas, v, largest, tolerance, worst, cut, new_id, done + 1):
            done += 1
    return done


def _compact(net: _Net, mesh: FaceQuads) -> FaceQuads:
    """Drop dead quads and nodes: old nodes keep their order, new ones follow."""
    alive = net.valence > 0
    new = np.cumsum(alive) - 1
    used = net.quads[:, 0] >= 0
    origin = _padded(mesh.origin, len(alive), -1)
    origin[~net.rim] = -1
    return FaceQuads(net.points[: len(alive)][alive], new[net.quads[used]], net.face[used], origin[alive], net.wanted[alive])
