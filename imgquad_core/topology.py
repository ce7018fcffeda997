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
    """Scratch of one cavity, whose outline is kept up to date quad by quad."""

    members: Ids  # quads
    in_cavity: Ids  # stamp of each quad
    seen: Ids  # stamp of each node of the cavity
    inside: Ids  # cavity quads at each node of the cavity
    leaving: Ids  # half-edges of the outline that leave each node of the cavity: 1, or 2 at a pinch
    leave: Ids  # the last one of them
    doubtful: Ids  # stack of nodes whose need may have changed
    loop: Ids  # outline, counter-clockwise
    edge: Ids  # half-edge of the outline that leaves each of its nodes
    corner: Ids  # places of the corners in the outline
    length: Ids  # edges between corners
    count: Ids  # see below


# what _Cavity.count holds
_MEMBERS, _OUTLINE, _CORNERS, _STAMP, _RIM_EDGES, _COST, _DOUBTFUL = range(7)


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
    n, m, few = len(net.valence), len(net.quads), _scratch_points(largest)
    lists = [np.empty(few, np.int64) for _ in range(8)]
    cavity = _Cavity(
        lists[0],
        np.zeros(m, np.int64),
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.empty(16 * few, np.int64),
        *lists[1:5],
        np.zeros(7, np.int64),
    )
    canvas = Canvas(
        net.points,
        n,
        np.empty((few, 4), np.int64),
        np.zeros(2, np.int64),
        *lists[5:8],
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
    """Put quad q into the cavity and bring the outline up to date."""
    count = cavity.count
    stamp = count[_STAMP]
    if cavity.in_cavity[q] == stamp or count[_MEMBERS] == cavity.members.size:
        return
    cavity.in_cavity[q] = stamp
    cavity.members[count[_MEMBERS]] = q
    count[_MEMBERS] += 1
    for k in range(4):
        v = net.quads[q, k]
        if cavity.seen[v] != stamp:
            cavity.seen[v], cavity.inside[v], cavity.leaving[v] = stamp, 0, 0
            count[_COST] += _penalty(net.valence[v], net.wanted[v], net.rim[v])
        cavity.inside[v] += 1
        cavity.doubtful[count[_DOUBTFUL]] = v
        count[_DOUBTFUL] += 1
    for h in range(4 * q, 4 * q + 4):  # the neighbours' edges vanish from the outline ...
        t = net.twins[h]
        if t >= 0 and cavity.in_cavity[t >> 2] == stamp:
            cavity.leaving[net.quads[t >> 2, t & 3]] -= 1
            count[_RIM_EDGES] -= 1
    for h in range(4 * q, 4 * q + 4):  # ... and the others of the quad become part of it
        t = net.twins[h]
        if t < 0 or cavity.in_cavity[t >> 2] != stamp:
            v = net.quads[q, h & 3]
            cavity.leaving[v] += 1
            cavity.leave[v] = h
            count[_RIM_EDGES] += 1


@kernel
def _add_ring(net: _Net, cavity: _Cavity, v: int) -> bool:
    """Put all quads at node v into the cavity; return whether that was any."""
    before = cavity.count[_MEMBERS]
    for i in range(net.valence[v]):
        _add_quad(net, cavity, net.ring[v, i])
    return cavity.count[_MEMBERS] > before


@kernel
def _settle(net: _Net, cavity: _Cavity, largest: int) -> bool:
    """Add quads until no node of the outline is concave or a pinch; return whether that was possible."""
    count = cavity.count
    while count[_DOUBTFUL] > 0:
        if count[_MEMBERS] > largest:
            return False
        count[_DOUBTFUL] -= 1
        v = cavity.doubtful[count[_DOUBTFUL]]
        if cavity.leaving[v] == 0:
            continue
        need = net.wanted[v] - (net.valence[v] - cavity.inside[v])
        if (cavity.leaving[v] > 1 or need >= 3) and not _add_ring(net, cavity, v):
            return False
    return count[_MEMBERS] <= largest and _trace_outline(net, cavity)


@kernel
def _leaving_edge(net: _Net, cavity: _Cavity, v: int) -> int:
    """Return the half-edge of the outline that leaves node v."""
    h = cavity.leave[v]
    t = net.twins[h]
    if t < 0 or cavity.in_cavity[t >> 2] != cavity.count[_STAMP]:
        return h
    for i in range(net.valence[v]):  # it has become inner: v was a pinch for a while
        q = net.ring[v, i]
        if cavity.in_cavity[q] == cavity.count[_STAMP]:
            for h in range(4 * q, 4 * q + 4):
                t = net.twins[h]
                if net.quads[q, h & 3] == v and (t < 0 or cavity.in_cavity[t >> 2] != cavity.count[_STAMP]):
                    return h
    return -1


@kernel
def _trace_outline(net: _Net, cavity: _Cavity) -> bool:
    """Trace the outline and find its corners; return whether it is one loop."""
    count = cavity.count
    total = count[_RIM_EDGES]
    start = np.int64(-1)
    for i in range(count[_MEMBERS] - 1, -1, -1):
        for k in range(4):
            if start < 0 and cavity.leaving[net.quads[cavity.members[i], k]] > 0:
                start = net.quads[cavity.members[i], k]
        if start >= 0:
            break
    if start < 0 or total > cavity.loop.size:
        return False
    n, c, v = 0, 0, start
    while True:
        h = _leaving_edge(net, cavity, v)
        if h < 0 or n == total:
            return False
        cavity.loop[n], cavity.edge[n] = v, h
        if net.wanted[v] - (net.valence[v] - cavity.inside[v]) <= 1:
            cavity.corner[c] = n
            if c > 0:
                cavity.length[c - 1] = n - cavity.corner[c - 1]
            c += 1
        n += 1
        v = net.quads[h >> 2, (h + 1) & 3]
        if v == start:
            break
    if c > 0:
        cavity.length[c - 1] = n - cavity.corner[c - 1] + cavity.corner[0]
    count[_OUTLINE], count[_CORNERS] = n, c
    return n == total


@kernel
def _push_side(net: _Net, cavity: _Cavity) -> bool:
    """Grow the cavity by the row behind one side: the one with most irregular nodes, then the longest."""
    n, n_loop, stamp = cavity.count[_CORNERS], cavity.count[_OUTLINE], cavity.count[_STAMP]
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
    before, n_loop = cavity.count[_MEMBERS], cavity.count[_OUTLINE]
    for i in range(n_loop):
        t = net.twins[cavity.edge[i]]
        if t >= 0:
            _add_quad(net, cavity, t >> 2)
    return cavity.count[_MEMBERS] > before


@kernel
def _cost_then(net: _Net, cavity: _Cavity, inner: int) -> int:
    """Irregularity with a pattern that has `inner` irregular nodes, one quad at each corner and two beside sides."""
    cost, c = inner, 0
    for i in range(cavity.count[_OUTLINE]):
        v = cavity.loop[i]
        quads = 2
        if c < cavity.count[_CORNERS] and cavity.corner[c] == i:
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
    total, n = 0.0, cavity.count[_OUTLINE]
    for i in range(n):
        u, w = cavity.loop[i], cavity.loop[(i + 1) % n]
        total += np.hypot(points[u, 0] - points[w, 0], points[u, 1] - points[w, 1])
    return total / n


@kernel
def _draw(net: _Net, cavity: _Cavity, canvas: Canvas, kind: int, cut: Ids) -> None:
    """Draw the chosen pattern into the cavity and smooth it."""
    canvas.count[:] = 0
    n_loop = cavity.count[_OUTLINE]
    if kind == CUT:
        draw_cut(canvas, cavity.loop, cavity.corner, cavity.length, cavity.count[_CORNERS], cut)
    else:
        for i in range(n_loop):
            canvas.poly[i] = cavity.loop[(cavity.corner[0] + i) % n_loop]
        draw_piece(canvas, cavity.length, cavity.count[_CORNERS])
    smooth_drawn(canvas, TRIAL_SWEEPS)


@kernel
def _is_better(net: _Net, cavity: _Cavity, canvas: Canvas, gain: int, tolerance: float, worst: float) -> bool:
    """Whether the drawn pattern may replace the cavity."""
    old_sum, old_worst, area = 0.0, 1.0, 0.0
    for i in range(cavity.count[_MEMBERS]):
        quality = quad_quality(net.points, net.quads, cavity.members[i])
        old_sum += 1.0 - quality
        old_worst = min(old_worst, quality)
        area += _area(net.points, net.quads, cavity.members[i])
    need, mean = min(worst, old_worst), area / cavity.count[_MEMBERS]
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
    n = cavity.count[_CORNERS]
    quads = cut_quads(cavity.length, n, cut) if kind == CUT else piece_quads(cavity.length, n)
    if not FEWEST * cavity.count[_MEMBERS] <= quads <= MOST * cavity.count[_MEMBERS]:
        return False
    if quads > net.tops[0] or quads > net.tops[1]:
        return False
    for i in range(cavity.count[_OUTLINE]):
        v = cavity.loop[i]
        if net.valence[v] - cavity.inside[v] + 2 > net.ring.shape[1]:
            return False
    return True


@kernel
def _remove(net: _Net, cavity: _Cavity) -> None:
    """Take the cavity's quads out of the mesh."""
    stamp = cavity.count[_STAMP]
    for i in range(cavity.count[_OUTLINE]):
        v, n = cavity.loop[i], 0
        for j in range(net.valence[v]):
            if cavity.in_cavity[net.ring[v, j]] != stamp:
                net.ring[v, n] = net.ring[v, j]
                n += 1
        net.valence[v] = n
    for i in range(cavity.count[_MEMBERS]):
        q = cavity.members[i]
        for k in range(4):
            v = net.quads[q, k]
            if cavity.leaving[v] == 0 and net.valence[v] > 0:
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
    n = cavity.count[_CORNERS]
    if n < 2 or n > MAX_CORNERS:
        return NONE, 0
    whole = piece_fits(cavity.length, n)
    if not whole and n != 2 and n != 4 and n != 6:
        return NONE, 0
    inner = (0 if n == 4 else 1) if whole else 2
    gain = cavity.count[_COST] - _cost_then(net, cavity, inner)
    if gain <= 0 or (gain <= last_gain and cavity.count[_MEMBERS] < RETRY * last_size):
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
    cavity.count[_STAMP] += 1
    for i in (_MEMBERS, _OUTLINE, _CORNERS, _RIM_EDGES, _COST, _DOUBTFUL):
        cavity.count[i] = 0
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
            last_gain, last_size = gain, cavity.count[_MEMBERS]
        if cavity.count[_CORNERS] < 2:
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
