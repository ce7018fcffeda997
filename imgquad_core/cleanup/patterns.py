r"""Regular patterns of quads for polygons: choose one by the numbers of edges on the sides, and fill it.

A polygon has corners (one quad each) and sides with a number of edges. Four corners with equal opposite sides take a
grid; three or five take one irregular node o joined to every side by a spoke; a mismatch is taken up by a cut into
two such pieces (one or two irregular nodes, a "dislocation"):

      2-----+-----1        +------u-----+
       \   s1   /          |  3   /      |      4 corners, unequal sides: 3 + 5
        +---o---+          |     /   5  |      6 corners: 5 + 5     2 corners: 3 + 3
         \  s0 /           +----w-------+
            0

With spokes s the sides of an n-gon with centre have L[i] = s[i - 1] + s[i + 1] edges.

References: K. Takayama, D. Panozzo, O. Sorkine-Hornung, Pattern-based quadrangulation for N-sided patches, CGF 33
(2014), https://doi.org/10.1111/cgf.12443; C. S. Verma, K. Suresh, CAD (2017), https://doi.org/10.1016/j.cad.2016.08.011
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Floats, Ints
from imgquad_core.jit import kernel, verb

MAX_CORNERS = 6  # of an outline that is filled: there are patterns for two to six


POINTS, QUADS = range(2)  #: places of what `Canvas.tally` counts


class Canvas(NamedTuple):
    """Where a pattern is drawn: scratch points behind those of the mesh, and quads.

    Drawn point i has the id ``first + i``.
    """

    points: Floats  #: points of the mesh with room for the drawn ones from ``first`` on
    first: int
    quads: Ints  #: (capacity, 4)
    tally: Ints  #: (2,), numbers of what is drawn, at the places `POINTS` and `QUADS`
    lattice: Ints  #: scratch of a grid's node ids
    poly: Ints  #: scratch of a piece's outline
    spokes: Ints  #: scratch of spokes' node ids
    line: Ints  #: node ids of the cut
    sums: Floats  #: (capacity, 3) scratch of the smoothing


@kernel
def spoke(length: Ints, n: int, i: int) -> int:
    """Edges on spoke i of an n-gon (n odd) with sides `length`; -1 where the sum is odd."""
    total = 0
    sign = 1
    for j in range(n):  # alternating sum over every second side, beginning behind spoke i
        total += sign * length[(i + 1 + 2 * j) % n]
        sign = -sign
    return total // 2 if total % 2 == 0 else -1


@kernel
def piece_fits(length: Ints, n: int) -> bool:
    """Whether one pattern without a cut fills a polygon with sides `length`."""
    if n == 4:
        return bool(length[0] == length[2] and length[1] == length[3])
    if n != 3 and n != 5:
        return False
    for i in range(n):
        if spoke(length, n, i) < 1:
            return False
    return True


@verb
def _cut_sides(length: Ints, n: int, i: int, j: int, a: int, b: int, l: int, one: Ints, two: Ints) -> None:
    """Sides of both pieces of a cut of l edges, from side i behind its first a edges to side j >= i behind its b."""
    one[0] = length[i] - a
    for k in range(i + 1, j):
        one[k - i] = length[k % n]
    one[j - i], one[j - i + 1] = b, l
    two[0] = length[j % n] - b
    for k in range(j + 1, i + n):
        two[k - j] = length[k % n]
    two[i + n - j], two[i + n - j + 1] = a, l


@verb
def _edges_of_cut(n: int, one: int, before: int, after: int, two: int) -> tuple[int, int]:
    """Fewest and most edges of a cut so that one pattern fills a piece: each spoke of an n-gon, n 3 or 5, has an edge.

    The sides of the piece are one, before, after, two and the cut; a triangle has but one and two beside it.
    """
    if n == 3:
        return abs(one - two) + 2, one + two - 2
    least = max(abs(one + before - after - two), before + after - one - two)
    return least + 2, before + after - abs(one - two) - 2


@verb
def _mean_edge(points: Floats, loop: Ints, n: int) -> float:
    total = 0.0
    for i in range(n):
        u, w = loop[i], loop[(i + 1) % n]
        total += np.hypot(points[u, 0] - points[w, 0], points[u, 1] - points[w, 1])
    return float(total / n)


@verb
def choose_cut(points: Floats, loop: Ints, corner: Ints, length: Ints, n: int, best: Ints) -> bool:
    """Find the cut whose number of edges suits its length best; `best` gets (i, j, a, b, l).

    `loop` holds the outline, `corner` the places of the corners in it. Numbers of edges tell most cuts apart: what is
    left is measured.
    """
    apart = 3 if n == 6 else 1  # sides between the cut's ends: 6 = 5 + 5, 4 = 3 + 5, 2 = 3 + 3
    score, edge, n_loop = np.inf, 0.0, 0
    for i in range(n):
        n_loop += length[i]
    if n_loop % 2 == 1:  # as no outline of quads is
        return False
    for i in range(n if n == 4 else n // 2):
        j = i + apart
        p, p_before, p_after = length[i], length[(i + 1) % n], length[(i + 2) % n]
        q, q_before, q_after = length[j % n], length[(j + 1) % n], length[(j + 2) % n]
        for a in range(1, p):
            for b in range(1, q):
                least, most = _edges_of_cut(apart + 2, p - a, p_before, p_after, b)
                low, high = _edges_of_cut(n - apart + 2, q - b, q_before, q_after, a)
                least, most = max(least, low), min(most, high)
                if least > most:
                    continue
                if edge == 0.0:
                    edge = _mean_edge(points, loop, n_loop)
                u, w = loop[(corner[i] + a) % n_loop], loop[(corner[j % n] + b) % n_loop]
                ideal = np.hypot(points[u, 0] - points[w, 0], points[u, 1] - points[w, 1]) / edge
                l = max(1, int(np.floor(ideal + 0.5)))
                if (l - least) % 2 == 1:  # the outline of each piece must be even, as it is with the fewest edges
                    l = l + 1 if l < ideal or l == 1 else l - 1
                if least <= l <= most and abs(l - ideal) < score:
                    score = abs(l - ideal)
                    best[0], best[1], best[2], best[3], best[4] = i, j, a, b, l
    return score < np.inf


@verb
def piece_quads(length: Ints, n: int) -> int:
    """Number of quads in the pattern of a piece."""
    if n == 4:
        return int(length[0] * length[1])
    total = 0
    for i in range(n):
        total += spoke(length, n, i) * spoke(length, n, (i + 1) % n)
    return total


@verb
def cut_quads(length: Ints, n: int, cut: Ints) -> int:
    """Number of quads in both pieces of a cut, or in the one pattern where the cut has no edge."""
    one, two = np.empty(MAX_CORNERS + 2, np.int64), np.empty(MAX_CORNERS + 2, np.int64)
    pieces, corners, total = 1, n, 0
    if cut[4] > 0:
        _cut_sides(length, n, cut[0], cut[1], cut[2], cut[3], cut[4], one, two)
        pieces, corners = 2, cut[1] - cut[0] + 2
    else:
        one = length
    for piece in range(pieces):  # one call for both: a kernel is compiled anew at every call of it
        total += piece_quads(one if piece == 0 else two, corners)
        corners = n + 4 - corners
    return total


@verb
def _draw_point(canvas: Canvas, x: float, y: float) -> int:
    p = canvas.first + canvas.tally[POINTS]
    canvas.points[p, 0], canvas.points[p, 1] = x, y
    canvas.tally[POINTS] += 1
    return int(p)


@kernel
def draw_line(canvas: Canvas, u: int, w: int, edges: int, out: Ints, at: int) -> None:
    """Draw a straight line of nodes from u to w; their ids go to ``out[at : at + edges + 1]``."""
    out[at], out[at + edges] = u, w
    for t in range(1, edges):
        s = t / edges
        out[at + t] = _draw_point(
            canvas,
            (1 - s) * canvas.points[u, 0] + s * canvas.points[w, 0],
            (1 - s) * canvas.points[u, 1] + s * canvas.points[w, 1],
        )


@verb
def _draw_grid(canvas: Canvas, n: int, m: int) -> None:
    """Fill the lattice of (n + 1) x (m + 1) nodes, whose rim is given, by transfinite interpolation; draw its quads."""
    grid, points, w = canvas.lattice, canvas.points, n + 1
    for j in range(1, m):
        t = j / m
        left, right = grid[j * w], grid[j * w + n]
        for i in range(1, n):
            s = i / n
            low, high = grid[i], grid[m * w + i]
            a, b, c, d = grid[0], grid[n], grid[m * w + n], grid[m * w]
            x = (1 - t) * points[low, 0] + t * points[high, 0] + (1 - s) * points[left, 0] + s * points[right, 0]
            y = (1 - t) * points[low, 1] + t * points[high, 1] + (1 - s) * points[left, 1] + s * points[right, 1]
            x -= (1 - t) * ((1 - s) * points[a, 0] + s * points[b, 0]) + t * ((1 - s) * points[d, 0] + s * points[c, 0])
            y -= (1 - t) * ((1 - s) * points[a, 1] + s * points[b, 1]) + t * ((1 - s) * points[d, 1] + s * points[c, 1])
            grid[j * w + i] = _draw_point(canvas, x, y)
    for j in range(m):
        for i in range(n):
            q = canvas.tally[QUADS]
            canvas.quads[q, 0], canvas.quads[q, 1] = grid[j * w + i], grid[j * w + i + 1]
            canvas.quads[q, 2], canvas.quads[q, 3] = grid[(j + 1) * w + i + 1], grid[(j + 1) * w + i]
            canvas.tally[QUADS] += 1


@verb
def draw_piece(canvas: Canvas, length: Ints, n: int) -> None:
    """Draw the pattern of a piece: ``canvas.poly`` holds its outline counter-clockwise from corner 0."""
    poly, grid = canvas.poly, canvas.lattice
    size = 0
    for i in range(n):
        size += length[i]
    if n == 4:
        a, b = length[0], length[1]
        for i in range(a + 1):
            grid[i] = poly[i]
            grid[b * (a + 1) + a - i] = poly[a + b + i]
        for j in range(b + 1):
            grid[j * (a + 1) + a] = poly[a + j]
            grid[(b - j) * (a + 1)] = poly[(2 * a + b + j) % size]
        _draw_grid(canvas, a, b)
        return
    start = np.empty(n, np.int64)  # place of each corner in the outline
    first = np.empty(n + 1, np.int64)  # where each spoke begins in canvas.spokes
    start[0], first[0] = 0, 0
    x, y = 0.0, 0.0
    for i in range(n):
        if i:
            start[i] = start[i - 1] + length[i - 1]
        first[i + 1] = first[i] + spoke(length, n, i) + 1
        v = poly[start[i] + spoke(length, n, (i + n - 1) % n)]
        x += canvas.points[v, 0] / n
        y += canvas.points[v, 1] / n
    centre = _draw_point(canvas, x, y)
    for i in range(n):
        before = spoke(length, n, (i + n - 1) % n)
        draw_line(canvas, poly[start[i] + before], centre, first[i + 1] - first[i] - 1, canvas.spokes, first[i])
    for i in range(n):
        k = (i + n - 1) % n
        a, b = first[k + 1] - first[k] - 1, first[i + 1] - first[i] - 1
        for t in range(a + 1):  # along side i, and along spoke k
            grid[t] = poly[start[i] + t]
            grid[b * (a + 1) + t] = canvas.spokes[first[k] + t]
        for t in range(b + 1):  # along spoke i, and back along side k
            grid[t * (a + 1) + a] = canvas.spokes[first[i] + t]
            grid[t * (a + 1)] = poly[(start[i] - t + size) % size]
        _draw_grid(canvas, a, b)


@verb
def draw_cut(canvas: Canvas, loop: Ints, corner: Ints, length: Ints, n: int, cut: Ints) -> None:
    """Draw both pieces of a cut (i, j, a, b, l), or the one pattern where the cut has no edge (l = 0)."""
    i, j, a, b, l = cut[0], cut[1], cut[2], cut[3], cut[4]
    one, two = np.empty(MAX_CORNERS + 2, np.int64), np.empty(MAX_CORNERS + 2, np.int64)
    n_loop = 0
    for k in range(n):
        n_loop += length[k]
    if l > 0:
        _cut_sides(length, n, i, j, a, b, l, one, two)
        pieces, corners = 2, j - i + 2
        u, w = (corner[i] + a) % n_loop, (corner[j % n] + b) % n_loop
        around = (w - u + n_loop) % n_loop
        draw_line(canvas, loop[u], loop[w], l, canvas.line, 0)
    else:
        one, pieces, corners, u, w, around = length, 1, n, corner[0], corner[0], n_loop - 1
    for piece in range(pieces):
        begin = u if piece == 0 else w
        for k in range(around + 1):
            canvas.poly[k] = loop[(begin + k) % n_loop]
        for k in range(1, l):
            canvas.poly[around + k] = canvas.line[l - k if piece == 0 else k]
        draw_piece(canvas, one if piece == 0 else two, corners)
        around, corners = n_loop - around, n + 4 - corners


@kernel
def smooth_drawn(canvas: Canvas, sweeps: int) -> None:
    """Move the drawn points to the mean of their neighbours, all at once, `sweeps` times."""
    n, sums = canvas.tally[POINTS], canvas.sums
    for _ in range(sweeps):
        for p in range(n):
            sums[p, 0], sums[p, 1], sums[p, 2] = 0.0, 0.0, 0.0
        for q in range(canvas.tally[QUADS]):
            for k in range(4):
                p = canvas.quads[q, k] - canvas.first
                if p >= 0:  # each neighbour of a drawn point follows it in exactly one quad
                    w = canvas.quads[q, (k + 1) & 3]
                    sums[p, 0] += canvas.points[w, 0]
                    sums[p, 1] += canvas.points[w, 1]
                    sums[p, 2] += 1.0
        for p in range(n):
            canvas.points[canvas.first + p, 0] = sums[p, 0] / sums[p, 2]
            canvas.points[canvas.first + p, 1] = sums[p, 1] / sums[p, 2]
