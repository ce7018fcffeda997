r"""Replace the worst quads: best quads for a small outline, whatever the valences.

Around a poor quad a few small cavities are tried. Their outlines (an even number of nodes) are filled either without
any new node, by the quads whose worst scaled Jacobian is largest (dynamic programming over the outline), or by a
star; or the poor quad is collapsed:

    b----c         b----c
    |    |        / \    \        the quad i a b j splits an outline into three shorter ones;
    a    d   or  a   o----d       a star joins every second node to a new one, o;
    | /  |        \ /    /        collapsed, two opposite corners of a quad become one node
    i----j         i----j
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.geometry.quad_shape import quad_quality
from imgquad_core.jit import kernel, verb

from .cavity import (
    MEMBERS,
    OUTLINE,
    Cavity,
    Net,
    add_quad,
    add_ring,
    begin,
    compact,
    insert,
    net_of,
    remove,
    scratch,
    settle,
)
from .faces import FaceQuads
from .patterns import POINTS, QUADS, Canvas

LARGEST = 24  # quads of a cavity
LONGEST = 16  # nodes of an outline
LEAST_GAIN = 0.02  # of the worst scaled Jacobian
ANY = 99  # quads that a node of the outline may need: valences do not count here
ROUNDS = 3  # over the poor quads, at most: a replaced one may make room for the next
COLLAPSE = 6  # the first of the two cavities in which the quad is collapsed
CAVITIES = COLLAPSE + 2  # that are tried around a quad, see `_grow`
FILLINGS = 3  # of an outline: without a new node, or a star on its even or on its odd nodes
CENTRE_STEPS = 8  # of the pattern search for the best place of a new node; it narrows to 0.6 where none is better
ROUNDING = 1e-12  # of a sine


class Tables(NamedTuple):
    """Dynamic programming over an outline: for the nodes i to j of it, the best filling and how it begins."""

    quality: Floats  #: (n, n) worst scaled Jacobian
    first: Ints  #: (n, n) the node a of the quad i a b j
    second: Ints  #: (n, n) the node b


class Choice(NamedTuple):
    """Which cavity is filled in which way; -1 for none."""

    cavity: int
    filling: int


def repair(mesh: FaceQuads, below: float) -> tuple[FaceQuads, Flags]:
    """Replace quads whose scaled Jacobian is less than `below` where that makes the worst one better.

    Returns the mesh and its nodes at replaced quads or beside them.
    """
    if len(mesh.quads) == 0:
        return mesh, np.zeros(0, np.bool_)
    net = net_of(mesh, LARGEST)
    cavity, canvas = scratch(net, LARGEST)
    hopeless, fresh = np.zeros((2, len(net.quads)), np.bool_)
    for _ in range(ROUNDS):
        if _repair_pass(net, cavity, canvas, below, hopeless, fresh) == 0:
            break
    if not fresh.any():
        return mesh, np.zeros(len(mesh.points), np.bool_)
    beside = np.zeros(len(net.valence), np.bool_)
    beside[net.quads[fresh & (net.quads[:, 0] >= 0)]] = True
    return compact(net, mesh), beside[net.valence > 0]


@verb
def _best_fill(points: Floats, loop: Ints, n: int, floor: float, tables: Tables) -> float:
    """Fill the tables of the best quads for each run of an outline; return the worst quality of the best filling.

    Only fillings better than `floor` count; -2 where there is none.
    """
    best, first, second = tables.quality, tables.first, tables.second
    corners = np.empty((1, 4), np.int64)
    for i in range(n - 1):
        best[i, i + 1] = 1.0
    for run in range(3, n, 2):
        for i in range(n - run):
            j = i + run
            best[i, j] = floor
            for a in range(i + 1, j, 2):
                for b in range(a + 1, j, 2):
                    rest = min(best[i, a], min(best[a, b], best[b, j]))
                    if rest <= best[i, j]:
                        continue
                    corners[0, 0], corners[0, 1], corners[0, 2], corners[0, 3] = loop[i], loop[a], loop[b], loop[j]
                    worst = min(rest, quad_quality(points, corners, 0))
                    if worst > best[i, j]:
                        best[i, j], first[i, j], second[i, j] = worst, a, b
    return float(best[0, n - 1]) if best[0, n - 1] > floor else -2.0


@verb
def _draw_fill(canvas: Canvas, loop: Ints, n: int, tables: Tables) -> None:
    """Draw the quads that the tables tell."""
    runs = np.empty((2 * n, 2), np.int64)
    runs[0, 0], runs[0, 1] = 0, n - 1
    top = 1
    canvas.tally[POINTS], canvas.tally[QUADS] = 0, 0
    while top > 0:
        top -= 1
        i, j = runs[top, 0], runs[top, 1]
        if j - i < 3:
            continue
        a, b, q = tables.first[i, j], tables.second[i, j], canvas.tally[QUADS]
        canvas.quads[q, 0], canvas.quads[q, 1] = loop[i], loop[a]
        canvas.quads[q, 2], canvas.quads[q, 3] = loop[b], loop[j]
        canvas.tally[QUADS] += 1
        runs[top, 0], runs[top, 1] = i, a
        runs[top + 1, 0], runs[top + 1, 1] = a, b
        runs[top + 2, 0], runs[top + 2, 1] = b, j
        top += 3


@verb
def _worst_drawn(canvas: Canvas, floor: float) -> float:
    """Return the worst quality of the drawn quads, or one that is not above `floor`."""
    worst = 1.0
    for q in range(canvas.tally[QUADS]):
        worst = min(worst, quad_quality(canvas.points, canvas.quads, q))
        if worst <= floor:
            break
    return worst


@verb
def _draw_star(canvas: Canvas, loop: Ints, n: int, turn: int, floor: float) -> float:
    """Draw a star whose centre is joined to the nodes turn, turn + 2, ...; return its worst quality."""
    canvas.tally[POINTS], canvas.tally[QUADS] = 1, n // 2
    o = canvas.first
    canvas.points[o, 0], canvas.points[o, 1], reach = 0.0, 0.0, 0.0
    for i in range(n):
        canvas.points[o, 0] += canvas.points[loop[i], 0] / n
        canvas.points[o, 1] += canvas.points[loop[i], 1] / n
    for i in range(0, n, 2):
        q = i // 2
        canvas.quads[q, 0], canvas.quads[q, 3] = loop[(turn + i) % n], o
        canvas.quads[q, 1], canvas.quads[q, 2] = loop[(turn + i + 1) % n], loop[(turn + i + 2) % n]
        v = loop[i]
        reach = max(
            reach, np.hypot(canvas.points[v, 0] - canvas.points[o, 0], canvas.points[v, 1] - canvas.points[o, 1])
        )
    return _centred(canvas, reach, floor)


@verb
def _corner_sine(canvas: Canvas, q: int, k: int) -> float:
    p, n, b = canvas.quads[q, k], canvas.quads[q, (k + 1) & 3], canvas.quads[q, (k + 3) & 3]
    ax, ay = canvas.points[n, 0] - canvas.points[p, 0], canvas.points[n, 1] - canvas.points[p, 1]
    bx, by = canvas.points[b, 0] - canvas.points[p, 0], canvas.points[b, 1] - canvas.points[p, 1]
    return float((ax * by - ay * bx) / (np.sqrt((ax * ax + ay * ay) * (bx * bx + by * by)) + 1e-300))


@verb
def _fixed_quality(canvas: Canvas) -> float:
    """Return the least sine of the corners that do not hang on the drawn point: no place of it makes the worst better.

    A quad has three corners that do, or none.
    """
    o, worst = canvas.first, 1.0
    for q in range(canvas.tally[QUADS]):
        away = True
        for k in range(4):
            away &= canvas.quads[q, k] != o
        for k in range(4):
            if away or canvas.quads[q, (k + 2) & 3] == o:
                worst = min(worst, _corner_sine(canvas, q, k))
    return worst


@verb
def _centred(canvas: Canvas, reach: float, floor: float) -> float:
    """Move the drawn point to where the worst quality is best; return that, or one that is not above `floor`."""
    o = canvas.first
    if _fixed_quality(canvas) < floor - ROUNDING:
        return -1.0
    best, step = _worst_drawn(canvas, -1.0), 0.3 * reach
    for _ in range(CENTRE_STEPS):
        x, y = canvas.points[o, 0], canvas.points[o, 1]
        best_x, best_y = x, y
        for d in range(8):
            angle = d * np.pi / 4
            canvas.points[o, 0], canvas.points[o, 1] = x + step * np.cos(angle), y + step * np.sin(angle)
            worst = _worst_drawn(canvas, best)
            if worst > best + 1e-9:
                best, best_x, best_y = worst, canvas.points[o, 0], canvas.points[o, 1]
        canvas.points[o, 0], canvas.points[o, 1] = best_x, best_y
        if best_x == x and best_y == y:
            step *= 0.6
    return best


@verb
def _grow(net: Net, cavity: Cavity, q: int, trial: int) -> bool:
    """Make one of the cavities at quad q; return whether its outline can be filled.

    0 to 3: the ring of a corner; 4: the quads beside it; 5: all rings; 6 and 7: the rings of two opposite corners.
    """
    begin(cavity)
    if trial < 4:
        add_ring(net, cavity, net.quads[q, trial])
    elif trial >= COLLAPSE:
        add_ring(net, cavity, net.quads[q, trial - COLLAPSE])
        add_ring(net, cavity, net.quads[q, trial - COLLAPSE + 2])
    else:
        add_quad(net, cavity, q)
        for k in range(4):
            if trial == 5:
                add_ring(net, cavity, net.quads[q, k])
            elif net.twins[4 * q + k] >= 0:
                add_quad(net, cavity, net.twins[4 * q + k] >> 2)
    return settle(net, cavity, LARGEST, ANY) and cavity.tally[OUTLINE] <= LONGEST


@verb
def _worst_member(net: Net, cavity: Cavity) -> float:
    worst = 1.0
    for i in range(cavity.tally[MEMBERS]):
        worst = min(worst, quad_quality(net.points, net.quads, cavity.members[i]))
    return worst


@verb
def _draw_collapsed(net: Net, cavity: Cavity, canvas: Canvas, q: int, k: int, floor: float) -> float:
    """Draw the cavity with corners k and k + 2 of quad q made one node; return its worst quality."""
    a, c = net.quads[q, k], net.quads[q, k + 2]
    if net.rim[a] and net.rim[c]:
        return -1.0
    o = canvas.first
    for i in range(2):
        canvas.points[o, i] = 0.5 * (net.points[a, i] + net.points[c, i])
    merged = a if net.rim[a] else (c if net.rim[c] else o)
    canvas.tally[POINTS], canvas.tally[QUADS] = merged == o, 0
    for i in range(cavity.tally[MEMBERS]):
        if cavity.members[i] == q:
            continue
        for j in range(4):
            v = net.quads[cavity.members[i], j]
            if v == a or v == c:
                v = merged
            elif cavity.leaving[v] == 0:
                return -1.0  # another inner node would be left with two quads
            canvas.quads[canvas.tally[QUADS], j] = v
        canvas.tally[QUADS] += 1
    reach = np.hypot(net.points[a, 0] - net.points[c, 0], net.points[a, 1] - net.points[c, 1])
    return _centred(canvas, reach, floor) if merged == o else _worst_drawn(canvas, -1.0)


@verb
def _draw(net: Net, cavity: Cavity, canvas: Canvas, tables: Tables, q: int, choice: Choice, floor: float) -> float:
    """Draw a filling of the cavity's outline; return its worst quality.

    A filling no better than `floor` is of no use.
    """
    n = cavity.tally[OUTLINE]
    if choice.cavity >= COLLAPSE:
        return _draw_collapsed(net, cavity, canvas, q, choice.cavity - COLLAPSE, floor) if choice.filling == 0 else -1.0
    if choice.filling > 0:
        return _draw_star(canvas, cavity.loop, n, choice.filling - 1, floor)
    worst = _best_fill(net.points, cavity.loop, n, floor, tables)
    if worst > floor:
        _draw_fill(canvas, cavity.loop, n, tables)
    return worst


@verb
def _rings_have_room(net: Net, cavity: Cavity, canvas: Canvas) -> bool:
    """Whether nodes of the outline can take all drawn quads."""
    for i in range(cavity.tally[OUTLINE]):
        if net.valence[cavity.loop[i]] + canvas.tally[QUADS] > net.ring.shape[1]:
            return False
    return bool(canvas.tally[QUADS] <= net.tops[QUADS] and canvas.tally[POINTS] <= net.tops[POINTS])


@verb
def _find(net: Net, cavity: Cavity, canvas: Canvas, tables: Tables, q: int, below: float) -> Choice:
    """Choose what makes the surroundings of quad q best; the first that leaves nothing below `below` is enough."""
    gain, best = LEAST_GAIN, Choice(-1, -1)
    for trial in range(CAVITIES):
        if not _grow(net, cavity, q, trial):
            continue
        worst = _worst_member(net, cavity)
        for filling in range(FILLINGS):
            choice = Choice(trial, filling)
            quality = _draw(net, cavity, canvas, tables, q, choice, worst + gain)
            if min(quality, below) - worst > gain:
                gain, best = min(quality, below) - worst, choice
                if quality >= below:
                    return best
    return best


@verb
def _redraw(net: Net, cavity: Cavity, canvas: Canvas, tables: Tables, q: int, choice: Choice) -> bool:
    """Draw the choice once more; return whether the nodes of the outline can take it."""
    _grow(net, cavity, q, choice.cavity)
    _draw(net, cavity, canvas, tables, q, choice, _worst_member(net, cavity) + LEAST_GAIN)
    return _rings_have_room(net, cavity, canvas)


@verb
def _fill(net: Net, cavity: Cavity, canvas: Canvas, new_id: Ints, hopeless: Flags, fresh: Flags) -> None:
    """Put what is drawn in the place of the cavity; what lies beside it is worth a try again."""
    face = net.face[cavity.members[0]]
    remove(net, cavity)
    insert(net, canvas, new_id, face)
    for i in range(cavity.tally[OUTLINE]):
        v = cavity.loop[i]
        for j in range(net.valence[v]):
            hopeless[net.ring[v, j]], fresh[net.ring[v, j]] = False, True


@kernel
def _repair_pass(net: Net, cavity: Cavity, canvas: Canvas, below: float, hopeless: Flags, fresh: Flags) -> int:
    """Try to replace each quad worse than `below`; return how many cavities were filled anew.

    Quads are hopeless from a vain try on, until something changes beside them.
    """
    tables = Tables(
        np.empty((LONGEST, LONGEST)),
        np.empty((LONGEST, LONGEST), np.int64),
        np.empty((LONGEST, LONGEST), np.int64),
    )
    new_id = np.empty(canvas.quads.shape[0], np.int64)
    done = 0
    for q in range(len(net.quads)):
        if net.quads[q, 0] < 0 or hopeless[q] or quad_quality(net.points, net.quads, q) >= below:
            continue
        hopeless[q] = True
        choice = _find(net, cavity, canvas, tables, q, below)
        if choice.cavity >= 0 and _redraw(net, cavity, canvas, tables, q, choice):
            _fill(net, cavity, canvas, new_id, hopeless, fresh)
            done += 1
    return done
