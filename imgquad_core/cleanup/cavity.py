"""Cavities in a quad mesh: grow one quad by quad, know its outline, and put other quads in its place."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.geometry.halfedge import twins_of
from imgquad_core.grouping import grouped
from imgquad_core.jit import kernel, verb

from .faces import INNER_VALENCE, FaceQuads
from .patterns import POINTS, QUADS, Canvas


class Net(NamedTuple):
    """A quad mesh that changes. Dead quads have quads[q, 0] == -1, dead nodes valence 0."""

    points: Floats  # (capacity + scratch, 2)
    quads: Ints  # (capacity, 4)
    twins: Ints  # (4 capacity,)
    ring: Ints  # (node capacity, width): quads at each node
    valence: Ints
    wanted: Ints
    rim: Flags
    free_quads: Ints  # stack of unused quad ids
    free_nodes: Ints
    tops: Ints  # how many are on the stacks, at the places `QUADS` and `POINTS`
    face: Ints  # (capacity,): face of each quad


class Cavity(NamedTuple):
    """Scratch of one cavity, whose outline is kept up to date quad by quad."""

    members: Ints  # quads
    in_cavity: Ints  # stamp of each quad
    seen: Ints  # stamp of each node of the cavity
    inside: Ints  # cavity quads at each node of the cavity
    leaving: Ints  # half-edges of the outline that leave each node of the cavity: 1, or 2 at a pinch
    leave: Ints  # the last one of them
    doubtful: Ints  # stack of nodes whose need may have changed
    loop: Ints  # outline, counter-clockwise
    edge: Ints  # half-edge of the outline that leaves each of its nodes
    corner: Ints  # places of the corners in the outline
    length: Ints  # edges between corners
    tally: Ints  # numbers, at the places that follow


# what Cavity.tally holds
MEMBERS, OUTLINE, CORNERS, STAMP, RIM_EDGES, COST, DOUBTFUL = range(7)


def net_of(mesh: FaceQuads, largest: int) -> Net:
    """Return the mesh in arrays with room to change, for cavities of up to `largest` quads."""
    n, m = len(mesh.points), len(mesh.quads)
    # cavities may gain quads: room for one that grows by MOST, and a share of the mesh
    node_room, quad_room = n + n // 4 + 2 * largest, m + m // 4 + 2 * largest
    offsets, corners = grouped(mesh.quads, n)
    valence = padded(np.diff(offsets), node_room, 0)
    ring = np.full((node_room, max(16, int(valence.max()) + 2)), -1, np.int64)
    _fill_rings(ring, offsets, corners)
    return Net(
        padded(mesh.points, node_room + _scratch_points(largest), 0),
        padded(mesh.quads, quad_room, -1),
        padded(twins_of(mesh.quads, n), 4 * quad_room, -1),
        ring,
        valence,
        padded(mesh.wanted, node_room, INNER_VALENCE),
        padded(mesh.origin >= 0, node_room, False),
        _free_ids(m, quad_room),
        _free_ids(n, node_room),
        np.array([node_room - n, quad_room - m]),
        padded(mesh.face, quad_room, -1),
    )


def padded(values: NDArray[Any], room: int, filler: Any) -> NDArray[Any]:
    """Return `values` with `filler` behind them, `room` rows in all."""
    out = np.full((room, *values.shape[1:]), filler, values.dtype)
    out[: len(values)] = values
    return out


def _free_ids(used: int, room: int) -> Ints:
    """Return a stack for `room` ids on which those from `used` on lie, the lowest on top."""
    stack = np.zeros(room, np.int64)
    stack[: room - used] = np.arange(room - 1, used - 1, -1)
    return stack


def _scratch_points(largest: int) -> int:
    return 4 * largest + 64


def scratch(net: Net, largest: int) -> tuple[Cavity, Canvas]:
    """Return empty work arrays for cavities of up to `largest` quads."""
    n, m, few = len(net.valence), len(net.quads), _scratch_points(largest)
    cavity = Cavity(
        np.empty(few, np.int64),
        np.zeros(m, np.int64),
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.empty(16 * few, np.int64),
        np.empty(few, np.int64),
        np.empty(few, np.int64),
        np.empty(few, np.int64),
        np.empty(few, np.int64),
        np.zeros(7, np.int64),
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
def _fill_rings(ring: Ints, offsets: Ints, corners: Ints) -> None:
    for v in range(offsets.size - 1):
        for i in range(offsets[v], offsets[v + 1]):
            ring[v, i - offsets[v]] = corners[i] >> 2


@verb
def penalty(valence: int, wanted: int, rim: bool) -> int:
    """Irregularity of a node: 1, 3, 5, ... inside; on the rim a missing quad (a wide corner) is worst."""
    d = valence - wanted
    if d == 0:
        return 0
    if rim:
        return -4 * d if d < 0 else 2 * d
    return 2 * abs(d) - 1


@kernel
def begin(cavity: Cavity) -> None:
    """Empty the cavity."""
    cavity.tally[STAMP] += 1
    for i in (MEMBERS, OUTLINE, CORNERS, RIM_EDGES, COST, DOUBTFUL):
        cavity.tally[i] = 0


@verb
def add_quad(net: Net, cavity: Cavity, q: int) -> None:
    """Put quad q into the cavity and bring the outline up to date."""
    tally = cavity.tally
    stamp = tally[STAMP]
    if cavity.in_cavity[q] == stamp or tally[MEMBERS] == cavity.members.size:
        return
    cavity.in_cavity[q] = stamp
    cavity.members[tally[MEMBERS]] = q
    tally[MEMBERS] += 1
    for k in range(4):
        v = net.quads[q, k]
        if cavity.seen[v] != stamp:
            cavity.seen[v], cavity.inside[v], cavity.leaving[v] = stamp, 0, 0
            tally[COST] += penalty(net.valence[v], net.wanted[v], net.rim[v])
        cavity.inside[v] += 1
        cavity.doubtful[tally[DOUBTFUL]] = v
        tally[DOUBTFUL] += 1
    for h in range(4 * q, 4 * q + 4):  # the neighbours' edges vanish from the outline ...
        t = net.twins[h]
        if t >= 0 and cavity.in_cavity[t >> 2] == stamp:
            cavity.leaving[net.quads[t >> 2, t & 3]] -= 1
            tally[RIM_EDGES] -= 1
    for h in range(4 * q, 4 * q + 4):  # ... and the others of the quad become part of it
        t = net.twins[h]
        if t < 0 or cavity.in_cavity[t >> 2] != stamp:
            v = net.quads[q, h & 3]
            cavity.leaving[v] += 1
            cavity.leave[v] = h
            tally[RIM_EDGES] += 1


@verb
def add_ring(net: Net, cavity: Cavity, v: int) -> bool:
    """Put all quads at node v into the cavity; return whether that was any."""
    before = cavity.tally[MEMBERS]
    for i in range(net.valence[v]):
        add_quad(net, cavity, net.ring[v, i])
    return bool(cavity.tally[MEMBERS] > before)


@verb
def settle(net: Net, cavity: Cavity, largest: int, most_needed: int) -> bool:
    """Add quads until no node of the outline is a pinch or needs more than `most_needed` of them (is concave).

    Returns whether that was possible with at most `largest` quads, and the outline is one loop.
    """
    tally = cavity.tally
    while tally[DOUBTFUL] > 0:
        if tally[MEMBERS] > largest:
            return False
        tally[DOUBTFUL] -= 1
        v = cavity.doubtful[tally[DOUBTFUL]]
        if cavity.leaving[v] == 0:
            continue
        need = net.wanted[v] - (net.valence[v] - cavity.inside[v])
        if (cavity.leaving[v] > 1 or need > most_needed) and not add_ring(net, cavity, v):
            return False
    return tally[MEMBERS] <= largest and _trace_outline(net, cavity)


@verb
def _leaving_edge(net: Net, cavity: Cavity, v: int) -> int:
    """Return the half-edge of the outline that leaves node v."""
    h = cavity.leave[v]
    t = net.twins[h]
    if t < 0 or cavity.in_cavity[t >> 2] != cavity.tally[STAMP]:
        return int(h)
    for i in range(net.valence[v]):  # it has become inner: v was a pinch for a while
        q = net.ring[v, i]
        if cavity.in_cavity[q] == cavity.tally[STAMP]:
            for h in range(4 * q, 4 * q + 4):
                t = net.twins[h]
                if net.quads[q, h & 3] == v and (t < 0 or cavity.in_cavity[t >> 2] != cavity.tally[STAMP]):
                    return int(h)
    return -1


@verb
def _trace_outline(net: Net, cavity: Cavity) -> bool:
    """Trace the outline and find its corners; return whether it is one loop."""
    tally = cavity.tally
    total = tally[RIM_EDGES]
    start: Any = np.int64(-1)
    for i in range(tally[MEMBERS] - 1, -1, -1):
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
    tally[OUTLINE], tally[CORNERS] = n, c
    return bool(n == total)


@verb
def push_side(net: Net, cavity: Cavity) -> bool:
    """Grow the cavity by the row behind one side: the one with most irregular nodes, then the longest."""
    n, n_loop, stamp = cavity.tally[CORNERS], cavity.tally[OUTLINE], cavity.tally[STAMP]
    best, best_score = -1, -1
    for s in range(n):
        score, blocked, place = 0, False, cavity.corner[s]
        for _ in range(cavity.length[s]):
            t = net.twins[cavity.edge[place]]
            if t < 0:
                blocked = True
                break
            place = place + 1 if place + 1 < n_loop else 0  # a remainder takes as long as all of the rest
            for k in range(2, 4):  # the nodes across: those of the edge are in the cavity
                v = net.quads[t >> 2, (t + k) & 3]
                if cavity.seen[v] != stamp and net.valence[v] != net.wanted[v]:
                    score += 1000
        score += cavity.length[s]
        if not blocked and score > best_score:
            best, best_score = s, score
    if best < 0:
        return False
    for i in range(cavity.length[best]):
        add_quad(net, cavity, net.twins[cavity.edge[(cavity.corner[best] + i) % n_loop]] >> 2)
    return True


@verb
def push_all(net: Net, cavity: Cavity) -> bool:
    """Grow the cavity on all sides."""
    before, n_loop = cavity.tally[MEMBERS], cavity.tally[OUTLINE]
    for i in range(n_loop):
        t = net.twins[cavity.edge[i]]
        if t >= 0:
            add_quad(net, cavity, t >> 2)
    return bool(cavity.tally[MEMBERS] > before)


@verb
def remove(net: Net, cavity: Cavity) -> None:
    """Take the cavity's quads out of the mesh."""
    stamp = cavity.tally[STAMP]
    for i in range(cavity.tally[OUTLINE]):
        v, n = cavity.loop[i], 0
        for j in range(net.valence[v]):
            if cavity.in_cavity[net.ring[v, j]] != stamp:
                net.ring[v, n] = net.ring[v, j]
                n += 1
        net.valence[v] = n
    for i in range(cavity.tally[MEMBERS]):
        q = cavity.members[i]
        for k in range(4):
            v = net.quads[q, k]
            if cavity.leaving[v] == 0 and net.valence[v] > 0:
                net.valence[v] = 0
                net.free_nodes[net.tops[POINTS]] = v
                net.tops[POINTS] += 1
        net.quads[q, 0] = -1
        net.free_quads[net.tops[QUADS]] = q
        net.tops[QUADS] += 1


@kernel
def insert(net: Net, canvas: Canvas, new_id: Ints, face: int) -> None:
    """Put the drawn quads into the mesh."""
    for p in range(canvas.tally[POINTS]):
        net.tops[POINTS] -= 1
        v = net.free_nodes[net.tops[POINTS]]
        new_id[p] = v
        for i in range(2):
            net.points[v, i] = canvas.points[canvas.first + p, i]
        net.wanted[v], net.rim[v], net.valence[v] = INNER_VALENCE, False, 0
    for i in range(canvas.tally[QUADS]):
        net.tops[QUADS] -= 1
        q = net.free_quads[net.tops[QUADS]]
        net.face[q] = face
        for k in range(4):
            v = canvas.quads[i, k]
            if v >= canvas.first:
                v = new_id[v - canvas.first]
            net.quads[q, k] = v
            net.ring[v, net.valence[v]] = q
            net.valence[v] += 1
        canvas.quads[i, 0] = q  # from here on: the ids of the new quads
    for i in range(canvas.tally[QUADS]):
        _join(net, canvas.quads[i, 0])


@verb
def _join(net: Net, q: int) -> None:
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


def compact(net: Net, mesh: FaceQuads) -> FaceQuads:
    """Drop dead quads and nodes: old nodes keep their order, new ones follow."""
    alive = net.valence > 0
    new = np.cumsum(alive) - 1
    used = net.quads[:, 0] >= 0
    origin = padded(mesh.origin, len(alive), -1)
    origin[~net.rim] = -1
    return FaceQuads(
        net.points[: len(alive)][alive], new[net.quads[used]], net.face[used], origin[alive], net.wanted[alive]
    )
