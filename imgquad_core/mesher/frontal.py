"""Place points layer by layer from the constraints, along the cross field (the paper's advancing front).

A rim point with a sector for n quads sends n - 1 spokes inwards; a placed point sends four, one along each arm of the
cross. A spoke becomes a point unless one of the same face is closer than `EXCLUSION` edge lengths. The queue is first
in, first out: the first layer along all constraints is complete before the second begins.

Fronts from different sides would meet out of phase. So the points are a position field, too: each stands for a lattice
along its cross, and the end of a spoke moves to the mean of the lattice points that those around it expect there.

References
----------
J.-F. Remacle et al., IJNME 94 (2013), https://doi.org/10.1002/nme.4458
W. Jakob et al., Instant field-aligned meshes, ACM TOG 34 (2015), https://doi.org/10.1145/2816795.2818078
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Floats, Ints
from imgquad_core.cleanup.faces import QUARTER, wanted_quads
from imgquad_core.jit import kernel, verb

from .crossfield import CrossField
from .cutting import CutMesh

EXCLUSION = 0.7  # of the local edge length; .6 gives 7.8 % irregular nodes, .65 6.3, .7 5.8, .75 6.0, .8 6.3
SIGHT = 1.6  # edge lengths: points this near tell where they expect a point
PULL = 0.5  # edge lengths: expectations farther from the end of a spoke do not count
CELL = 1.4  # edge lengths
ON_RIM = 1e-6  # of the length of an edge of the rim: a point within it is on the edge, which it would cut in two
MAX_WALK = 400  # triangles on the way to a spoke's end


class _Front(NamedTuple):
    """The points so far (rim points first) and a hash grid of them with one level for each power of two in size."""

    points: Floats
    triangle: Ints
    size: Floats
    arm: Floats  # direction of one arm of the cross at each point
    next: Ints  # next point in the same bucket
    heads: Ints  # first point of each bucket, -1 for none; the number of buckets is a power of two


def frontal_points(mesh: CutMesh, field: CrossField) -> Floats:
    """Return the new points inside the faces of `mesh`, float64, shape (n, 2), in the order of their layers."""
    spokes = spokes_of_rim(mesh)
    capacity = len(mesh.points) + int(1.7 * _expected_points(mesh.points, mesh.triangles, field.size)) + 64
    while True:
        front = _Front(
            np.empty((capacity, 2)),
            np.empty(capacity, np.int64),
            np.empty(capacity),
            np.empty(capacity),
            np.empty(capacity, np.int64),
            np.full(1 << int(np.ceil(np.log2(2 * capacity))), -1, np.int64),
        )
        count = _advance(mesh, field, spokes, front)
        if count >= 0:
            return front.points[len(mesh.points) : count].copy()
        capacity *= 2


class Spokes(NamedTuple):
    """How rim points begin: first direction, sector angle, number of quads wanted, a triangle of the sector."""

    start: Floats
    angle: Floats
    quads: Ints
    triangle: Ints


def spokes_of_rim(mesh: CutMesh) -> Spokes:
    """Return the spokes of each rim point (no quads wanted where a point is not on the rim)."""
    start, triangle = _first_rim_edges(mesh.points, mesh.triangles, mesh.twins)
    quads = np.where(mesh.on_rim, wanted_quads(mesh.angle), 0)
    return Spokes(start, mesh.angle, quads, triangle)


def _first_rim_edges(points: Floats, triangles: Ints, twins: Ints) -> tuple[Floats, Ints]:
    """Return direction and triangle of the rim half-edge that leaves each rim point."""
    start = np.zeros(len(points))
    triangle = np.full(len(points), -1, np.int64)
    rim = np.flatnonzero(twins < 0)
    tail, head = triangles.ravel()[rim], np.roll(triangles, -1, axis=1).ravel()[rim]
    x, y = (points[head] - points[tail]).T
    start[tail], triangle[tail] = np.arctan2(y, x), rim // 3
    return start, triangle


def _expected_points(points: Floats, triangles: Ints, size: Floats) -> float:
    """Area over the square of the local size."""
    a, b, c = (points[corner] for corner in triangles.T)
    (bx, by), (cx, cy) = (b - a).T, (c - a).T
    return float((0.5 * (bx * cy - by * cx) / size[triangles].mean(axis=1) ** 2).sum())


@kernel
def _walk(mesh_points: Floats, triangles: Ints, twins: Ints, t: int, x: float, y: float) -> int:
    """Return the triangle that holds (x, y), walking from triangle t without leaving its face; -1 if none does.

    What is on the rim is in none.
    """
    for _ in range(MAX_WALK):
        step = np.int64(-1)
        blocked = False
        for k in range(3):
            a, b = triangles[t, k], triangles[t, (k + 1) % 3]
            along, up = mesh_points[b, 0] - mesh_points[a, 0], mesh_points[b, 1] - mesh_points[a, 1]
            side = along * (y - mesh_points[a, 1]) - up * (x - mesh_points[a, 0])
            if twins[3 * t + k] < 0:
                blocked = blocked or side <= ON_RIM * (along * along + up * up)
            elif side < 0.0:
                step = twins[3 * t + k] // 3
                break
        if step < 0:
            return -1 if blocked else t
        t = int(step)
    return -1


@verb
def _sample(mesh: CutMesh, field: CrossField, t: int, x: float, y: float) -> tuple[float, float]:
    """Return (direction of one arm, size) at (x, y) in triangle t."""
    a, b, c = mesh.triangles[t, 0], mesh.triangles[t, 1], mesh.triangles[t, 2]
    ax, ay = mesh.points[a, 0], mesh.points[a, 1]
    bx, by = mesh.points[b, 0] - ax, mesh.points[b, 1] - ay
    cx, cy = mesh.points[c, 0] - ax, mesh.points[c, 1] - ay
    det = bx * cy - by * cx
    wb = ((x - ax) * cy - (y - ay) * cx) / det
    wc = (bx * (y - ay) - by * (x - ax)) / det
    wa = 1.0 - wb - wc
    ux = wa * field.cross[a, 0] + wb * field.cross[b, 0] + wc * field.cross[c, 0]
    uy = wa * field.cross[a, 1] + wb * field.cross[b, 1] + wc * field.cross[c, 1]
    return np.arctan2(uy, ux) / 4.0, wa * field.size[a] + wb * field.size[b] + wc * field.size[c]


@verb
def _level(size: float) -> int:
    """Level of the hash grid whose cells are at least `CELL` edge lengths wide."""
    return int(np.ceil(np.log2(CELL * size)))


@verb
def _bucket(level: int, i: int, j: int, mask: int) -> int:
    """Bucket of cell (i, j) of a level."""
    return ((i * 73856093) ^ (j * 19349663) ^ (level * 83492791)) & mask


@verb
def _insert(front: _Front, p: int) -> None:
    """Put point p into the hash grid."""
    level = _level(front.size[p])
    cell = 2.0**level
    i, j = int(np.floor(front.points[p, 0] / cell)), int(np.floor(front.points[p, 1] / cell))
    b = _bucket(level, i, j, front.heads.size - 1)
    front.next[p] = front.heads[b]
    front.heads[b] = p


@verb
def _crowded(front: _Front, face_of: Ints, face: int, x: float, y: float, size: float, radius: float) -> bool:
    """Whether a point of the same face is closer to (x, y) than `radius`, which is at most the exclusion radius."""
    middle = _level(size)
    for level in range(middle - 1, middle + 2):  # sizes vary slowly: no closer point can be of another level
        cell = 2.0**level
        for i in range(int(np.floor((x - radius) / cell)), int(np.floor((x + radius) / cell)) + 1):
            for j in range(int(np.floor((y - radius) / cell)), int(np.floor((y + radius) / cell)) + 1):
                p = front.heads[_bucket(level, i, j, front.heads.size - 1)]
                while p >= 0:
                    dx, dy = front.points[p, 0] - x, front.points[p, 1] - y
                    if dx * dx + dy * dy < radius * radius and face_of[front.triangle[p]] == face:
                        return True
                    p = front.next[p]
    return False


@verb
def _expected(
    front: _Front, p: int, x: float, y: float, size: float, arm: float, cos_arm: float, sin_arm: float
) -> tuple[float, float]:
    """Return the point next to (x, y) of the lattice of point p, along the mean of its cross and that at (x, y)."""
    step = 0.5 * (size + front.size[p])
    bend = front.arm[p] - arm
    bend = 0.5 * (bend - QUARTER * np.floor(bend / QUARTER + 0.5))
    square = bend * bend  # the series are good to 1e-5 up to 22.5 degrees, and much faster
    turn_x, turn_y = 1.0 - square * (0.5 - square / 24.0), bend * (1.0 - square / 6.0 * (1.0 - square / 20.0))
    cos, sin = cos_arm * turn_x - sin_arm * turn_y, sin_arm * turn_x + cos_arm * turn_y
    dx, dy = x - front.points[p, 0], y - front.points[p, 1]
    u = step * np.floor((dx * cos + dy * sin) / step + 0.5)
    v = step * np.floor((dy * cos - dx * sin) / step + 0.5)
    return front.points[p, 0] + u * cos - v * sin, front.points[p, 1] + u * sin + v * cos


@verb
def _expected_by_all(
    front: _Front, face_of: Ints, face: int, x: float, y: float, size: float, arm: float
) -> tuple[float, float]:
    """Return the mean of where the points around (x, y) expect a point next to it, the nearer ones counting more."""
    radius, pull = SIGHT * size, PULL * size
    middle = _level(size)
    cos_arm, sin_arm = np.cos(arm), np.sin(arm)
    sum_x, sum_y, total = 0.0, 0.0, 0.0
    for level in range(middle - 1, middle + 2):
        cell = 2.0**level
        for i in range(int(np.floor((x - radius) / cell)), int(np.floor((x + radius) / cell)) + 1):
            for j in range(int(np.floor((y - radius) / cell)), int(np.floor((y + radius) / cell)) + 1):
                p = front.heads[_bucket(level, i, j, front.heads.size - 1)]
                while p >= 0:
                    px, py = front.points[p, 0], front.points[p, 1]
                    square = (px - x) ** 2 + (py - y) ** 2
                    # a bucket may hold points of other cells, which would count twice
                    at_home = int(np.floor(px / cell)) == i and int(np.floor(py / cell)) == j
                    if at_home and square < radius * radius and face_of[front.triangle[p]] == face:
                        ex, ey = _expected(front, p, x, y, size, arm, cos_arm, sin_arm)
                        if (ex - x) ** 2 + (ey - y) ** 2 < pull * pull and (ex != px or ey != py):
                            sum_x += ex / square
                            sum_y += ey / square
                            total += 1.0 / square
                    p = front.next[p]
    return (sum_x / total, sum_y / total) if total > 0.0 else (x, y)


@verb
def _spoke_end(
    mesh: CutMesh, field: CrossField, t: int, x: float, y: float, size: float, turn: float
) -> tuple[int, float, float, float, float]:
    """Return (triangle or -1, x, y, size, arm) at the end of a spoke from (x, y), bent half-way along the field."""
    ex, ey = x + size * np.cos(turn), y + size * np.sin(turn)
    e = _walk(mesh.points, mesh.triangles, mesh.twins, t, ex, ey)
    if e < 0:
        return -1, ex, ey, size, turn
    arm, far_size = _sample(mesh, field, e, ex, ey)
    bend = arm - turn
    bend -= QUARTER * np.floor(bend / QUARTER + 0.5)  # the arm of the cross next to the spoke
    turn += 0.5 * bend
    size = 0.5 * (size + far_size)
    ex, ey = x + size * np.cos(turn), y + size * np.sin(turn)
    e = _walk(mesh.points, mesh.triangles, mesh.twins, e, ex, ey)
    if e >= 0:
        arm, far_size = _sample(mesh, field, e, ex, ey)
    return e, ex, ey, far_size, arm


@kernel
def _advance(mesh: CutMesh, field: CrossField, spokes: Spokes, front: _Front) -> int:
    """Fill `front`; return the number of points, or -1 if they do not fit."""
    n_rim = len(mesh.points)
    for v in range(n_rim):
        front.points[v, 0], front.points[v, 1] = mesh.points[v, 0], mesh.points[v, 1]
        front.triangle[v] = spokes.triangle[v]
        front.size[v] = field.size[v]
        front.arm[v] = np.arctan2(field.cross[v, 1], field.cross[v, 0]) / 4.0
        if spokes.triangle[v] >= 0:
            _insert(front, v)
    count, done = n_rim, 0
    while done < count:
        p = done
        done += 1
        t = front.triangle[p]
        if t < 0:
            continue
        x, y = front.points[p, 0], front.points[p, 1]
        if p < n_rim:
            first, step, n = spokes.start[p], spokes.angle[p] / spokes.quads[p], spokes.quads[p] - 1
            first += step
        else:
            first, step, n = front.arm[p], QUARTER, 4
        for k in range(n):
            size, turn = front.size[p], first + k * step
            ex, ey = x + size * np.cos(turn), y + size * np.sin(turn)
            # most spokes end where a point is already: told without a walk
            if _crowded(front, mesh.face, mesh.face[t], ex, ey, size, (EXCLUSION - PULL) * size):
                continue
            e, ex, ey, size, arm = _spoke_end(mesh, field, t, x, y, size, turn)
            if e < 0 or _crowded(front, mesh.face, mesh.face[e], ex, ey, size, (EXCLUSION - PULL) * size):
                continue
            sx, sy = _expected_by_all(front, mesh.face, mesh.face[e], ex, ey, size, arm)
            inside = _walk(mesh.points, mesh.triangles, mesh.twins, e, sx, sy)
            if inside >= 0:
                e, ex, ey = inside, sx, sy
            if _crowded(front, mesh.face, mesh.face[e], ex, ey, size, EXCLUSION * size):
                continue
            if count == front.size.size:
                return -1
            front.points[count, 0], front.points[count, 1] = ex, ey
            front.triangle[count], front.size[count], front.arm[count] = e, size, arm
            _insert(front, count)
            count += 1
    return count
