r"""The Catmull-Clark split, which makes all cells quads, and the split of every quad into four or nine.

         c                c--n--b           mid-points on edges, one point in the middle of each cell:
        / \               |  |  |           a triangle gives three quads, a quad gives four
       n   m              w--o--m
      /  o  \             |  |  |
     a---m---b            d--s--a

Reference: E. Catmull, J. Clark, CAD 10 (1978), https://doi.org/10.1016/0010-4485(78)90110-0
"""

from __future__ import annotations

import numpy as np

from imgquad_core.arrays import Floats, Ints
from imgquad_core.cleanup.faces import INNER_VALENCE, FaceQuads, wanted_quads
from imgquad_core.jit import kernel

from .cutting import CutMesh
from .triangulation import Constraints, find_edges


def split_composed(mesh: CutMesh, mate: Ints, inner_origin_from: int) -> FaceQuads:
    """Split pairs into four quads and single triangles into three.

    Parameters
    ----------
    mesh : CutMesh
        Triangles.
    mate : int64, shape (n_triangles,)
        From `compose`.
    inner_origin_from : int
        Points of the mesh with this origin or a higher one are not of the boundary graph.
    """
    points, quads, owner, origin, _ = _split_composed(mesh.points, mesh.triangles, mesh.twins, mate, mesh.middle)
    n = len(mesh.points)
    origin[:n] = np.where(mesh.on_rim & (mesh.origin < inner_origin_from), mesh.origin, -1)
    wanted = np.full(len(points), INNER_VALENCE, np.int64)
    wanted[:n][mesh.on_rim] = wanted_quads(mesh.angle[mesh.on_rim])
    wanted[n:][origin[n:] >= 0] = 2
    return FaceQuads(points, quads, mesh.face[owner], origin, wanted)


@kernel
def _split_composed(
    points: Floats, triangles: Ints, twins: Ints, mate: Ints, middle: Ints
) -> tuple[Floats, Ints, Ints, Ints, Ints]:
    """Return points, quads, triangle of each quad, origin of each point, and the mid-point of each half-edge."""
    n, n_triangles = len(points), len(triangles)
    capacity = n + 3 * n_triangles + n_triangles + 1
    new_points = np.empty((capacity, 2))
    origin = np.full(capacity, -1, np.int64)
    for v in range(n):
        new_points[v, 0], new_points[v, 1] = points[v, 0], points[v, 1]
    mid = np.full(3 * n_triangles, -1, np.int64)
    flat = triangles.ravel()
    count = n
    for h in range(3 * n_triangles):
        if mid[h] >= 0 or mate[h // 3] == h:
            continue
        a, b = flat[h], flat[h - h % 3 + (h % 3 + 1) % 3]
        new_points[count, 0] = 0.5 * (points[a, 0] + points[b, 0])
        new_points[count, 1] = 0.5 * (points[a, 1] + points[b, 1])
        origin[count] = middle[h]
        mid[h] = count
        if twins[h] >= 0:
            mid[twins[h]] = count
        count += 1
    quads = np.empty((3 * n_triangles, 4), np.int64)
    owner = np.empty(3 * n_triangles, np.int64)
    n_quads = 0
    edges = np.empty(4, np.int64)  # half-edges around the cell
    for t in range(n_triangles):
        h = mate[t]
        if h >= 0 and twins[h] < h:
            continue
        if h < 0:
            sides = 3
            edges[0], edges[1], edges[2] = 3 * t, 3 * t + 1, 3 * t + 2
        else:
            g, sides = twins[h], 4
            edges[0], edges[1] = h - h % 3 + (h % 3 + 1) % 3, h - h % 3 + (h % 3 + 2) % 3
            edges[2], edges[3] = g - g % 3 + (g % 3 + 1) % 3, g - g % 3 + (g % 3 + 2) % 3
        x, y = 0.0, 0.0
        for i in range(sides):
            x += points[flat[edges[i]], 0] / sides
            y += points[flat[edges[i]], 1] / sides
        new_points[count, 0], new_points[count, 1] = x, y
        for i in range(sides):
            quads[n_quads, 0] = flat[edges[i]]
            quads[n_quads, 1] = mid[edges[i]]
            quads[n_quads, 2] = count
            quads[n_quads, 3] = mid[edges[(i + sides - 1) % sides]]
            owner[n_quads] = t
            n_quads += 1
        count += 1
    return new_points[:count].copy(), quads[:n_quads].copy(), owner[:n_quads].copy(), origin[:count].copy(), mid


def refine_quads(mesh: FaceQuads, twins: Ints, between: Ints) -> FaceQuads:
    """Split every quad into n x n.

    Parameters
    ----------
    mesh : FaceQuads
        Quads.
    twins : int64, shape (4 n_quads,)
        Opposite half-edges, -1 on the rim.
    between : int64, shape (4 n_quads, n - 1)
        Ids in the boundary graph of the points that lie on the way along each rim half-edge.
    """
    points, quads, origin = _refine_quads(mesh.points, mesh.quads, twins, between)
    n = len(mesh.points)
    origin[:n] = mesh.origin
    wanted = np.full(len(points), INNER_VALENCE, np.int64)
    wanted[:n] = mesh.wanted
    wanted[n:][origin[n:] >= 0] = 2
    return FaceQuads(points, quads, np.repeat(mesh.face, (between.shape[1] + 1) ** 2), origin, wanted)


@kernel
def _refine_quads(points: Floats, quads: Ints, twins: Ints, between: Ints) -> tuple[Floats, Ints, Ints]:
    """Return points, quads (n x n for each one, row by row) and origin of the new points.

    d--.--.--c
    |  |  |  |
    .--.--.--.       the lattice of a quad: row 0 from a to b, row n from d to c
    |  |  |  |
    a--.--.--b
    """
    n = between.shape[1] + 1
    n_old, capacity = len(points), len(points) + len(quads) * (n - 1) * (n + 3)
    new_points, origin = np.empty((capacity, 2)), np.full(capacity, -1, np.int64)
    for v in range(n_old):
        new_points[v, 0], new_points[v, 1] = points[v, 0], points[v, 1]
    first = np.full(4 * len(quads), -1, np.int64)  # new point next to the tail of each half-edge
    step = np.ones(4 * len(quads), np.int64)  # from it to the next one
    new_quads = np.empty((n * n * len(quads), 4), np.int64)
    lattice = np.empty((n + 1, n + 1), np.int64)
    count = n_old
    for q in range(len(quads)):
        for k in range(4):
            h = 4 * q + k
            if first[h] >= 0:
                continue
            u, w = quads[q, k], quads[q, (k + 1) & 3]
            first[h] = count
            if twins[h] >= 0:
                first[twins[h]], step[twins[h]] = count + n - 2, -1
            for i in range(1, n):
                s = i / n
                new_points[count, 0] = (1.0 - s) * points[u, 0] + s * points[w, 0]
                new_points[count, 1] = (1.0 - s) * points[u, 1] + s * points[w, 1]
                if twins[h] < 0:
                    origin[count] = between[h, i - 1]
                count += 1
        a, b, c, d = quads[q, 0], quads[q, 1], quads[q, 2], quads[q, 3]
        lattice[0, 0], lattice[0, n], lattice[n, n], lattice[n, 0] = a, b, c, d
        for i in range(1, n):
            lattice[0, i] = first[4 * q] + step[4 * q] * (i - 1)
            lattice[i, n] = first[4 * q + 1] + step[4 * q + 1] * (i - 1)
            lattice[n, n - i] = first[4 * q + 2] + step[4 * q + 2] * (i - 1)
            lattice[n - i, 0] = first[4 * q + 3] + step[4 * q + 3] * (i - 1)
        for j in range(1, n):
            for i in range(1, n):
                s, t = i / n, j / n
                for axis in range(2):
                    low = (1.0 - s) * points[a, axis] + s * points[b, axis]
                    high = (1.0 - s) * points[d, axis] + s * points[c, axis]
                    new_points[count, axis] = (1.0 - t) * low + t * high
                lattice[j, i] = count
                count += 1
        for j in range(n):
            for i in range(n):
                new = (q * n + j) * n + i
                new_quads[new, 0], new_quads[new, 1] = lattice[j, i], lattice[j, i + 1]
                new_quads[new, 2], new_quads[new, 3] = lattice[j + 1, i + 1], lattice[j + 1, i]
    return new_points[:count].copy(), new_quads, origin[:count].copy()


def points_between(quads: Ints, twins: Ints, origin: Ints, table: Constraints, n: int) -> Ints:
    """Look up the n - 1 boundary points on the way along each rim half-edge, for n of 2 or 3; -1 inside."""
    between = np.full((twins.size, n - 1), -1, np.int64)
    rim = np.flatnonzero(twins < 0)
    tail, head = origin[quads[rim >> 2, rim & 3]], origin[quads[rim >> 2, (rim + 1) & 3]]
    for at, (u, w) in enumerate(((tail, head), (head, tail))[: n - 1]):
        place = find_edges(table, u, w)
        between[rim[place >= 0], at] = table.middle[place[place >= 0]]
    return between
