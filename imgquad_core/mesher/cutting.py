"""Cut a triangulation apart at its constraints, so that every face (region) becomes a mesh of its own.

A point on a constraint gets one copy for each sector between constraints:

        |  b                 |   | b
     a  |                  a |
    ----v----     ->     ----v1  v2----     v1, v2, v3: copies, each with the angle of its sector
       c                     v3
                           ------
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.geometry.halfedge import components
from imgquad_core.jit import kernel, verb

from .triangulation import Constraints, Triangles


class CutMesh(NamedTuple):
    """Triangles of faces that share no point: every constraint is rim."""

    points: Floats  #: float64 (n, 2)
    triangles: Ints  #: int64 (n, 3)
    twins: Ints  #: int64 (3 n,), -1 on the rim
    face: Ints  #: int64 (n_triangles,), region of each triangle
    origin: Ints  #: int64 (n,), id of the point before the cut
    on_rim: Flags  #: (n,)
    angle: Floats  #: (n,), angle of the sector of a rim point, 2 pi inside
    middle: Ints  #: int64 (3 n,), of each rim half-edge the `Constraints.middle`, else -1


class FaceConflict(NamedTuple):
    """Regions whose outlines contradict each other, a face inside the wrong neighbour, or are not all there."""

    regions: Ints


def cut_at_constraints(mesh: Triangles, constraints: Constraints) -> CutMesh | FaceConflict:
    """Cut `mesh` at its constraints and keep the faces that have a region.

    Returns
    -------
    CutMesh or FaceConflict
        The conflict, where the rim of one face names two regions (an island on the wrong side of a chord), or where
        a constraint is no edge of `mesh`.
    """
    twins = mesh.twins.copy()
    left, middle, is_edge = _open_constraints(mesh.triangles, twins, constraints)
    if len(lost := constraints.region[~is_edge & (constraints.region >= 0)]):
        return FaceConflict(np.unique(lost))
    face, bad = _flood_regions(twins, left)
    if len(bad):
        return FaceConflict(np.unique(bad[bad >= 0]))
    keep = face >= 0
    triangles, twins, middle = _compress(mesh.triangles, twins, middle, keep)
    corner_copy, origin, on_rim, angle = _copies(mesh.points, triangles, twins)
    return CutMesh(mesh.points[origin], corner_copy, twins, face[keep], origin, on_rim, angle, middle)


@kernel
def _open_constraints(triangles: Ints, twins: Ints, constraints: Constraints) -> tuple[Ints, Ints, Flags]:
    """Set the twins of constraint edges to -1.

    Return for each half-edge the region on its left (-2: none told) and the middle, and which constraints are edges.
    """
    is_edge = np.zeros(constraints.head.size, np.bool_)
    left = np.full(twins.size, -2, np.int64)
    middle = np.full(twins.size, -1, np.int64)
    n_tails = constraints.offsets.size - 1
    for t in range(len(triangles)):
        for k in range(3):
            tail, head = triangles[t, k], triangles[t, (k + 1) % 3]
            if tail >= n_tails:
                continue
            for i in range(constraints.offsets[tail], constraints.offsets[tail + 1]):
                if constraints.head[i] == head:
                    left[3 * t + k] = constraints.region[i]
                    middle[3 * t + k] = constraints.middle[i]
                    twins[3 * t + k] = -1
                    is_edge[i] = True
    return left, middle, is_edge


def _flood_regions(twins: Ints, left: Ints) -> tuple[Ints, Ints]:
    """Return the region of each triangle, and the regions that meet inside one face (none if all is well)."""
    face, n_faces = components(twins, 3)
    told = np.flatnonzero(left != -2)
    at = face[told // 3]
    region = np.full(n_faces, -1, np.int64)
    region[at] = left[told]
    bad = region[at] != left[told]
    return region[face], np.concatenate([region[at[bad]], left[told[bad]]])


@kernel
def _compress(triangles: Ints, twins: Ints, middle: Ints, keep: Flags) -> tuple[Ints, Ints, Ints]:
    """Keep some triangles and renumber their twins."""
    new = np.full(len(triangles), -1, np.int64)
    n = 0
    for t in range(len(triangles)):
        if keep[t]:
            new[t] = n
            n += 1
    kept, kept_twins, kept_middle = np.empty((n, 3), np.int64), np.full(3 * n, -1, np.int64), np.empty(3 * n, np.int64)
    for t in range(len(triangles)):
        if keep[t]:
            for k in range(3):
                kept[new[t], k] = triangles[t, k]
                kept_middle[3 * new[t] + k] = middle[3 * t + k]
                h = twins[3 * t + k]
                if h >= 0 and keep[h // 3]:
                    kept_twins[3 * new[t] + k] = 3 * new[h // 3] + h % 3
    return kept, kept_twins, kept_middle


@verb
def _corner_angle(points: Floats, triangles: Ints, c: int) -> float:
    """Angle of corner c = 3 t + k."""
    t, k = c // 3, c % 3
    v, a, b = triangles[t, k], triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
    ax, ay = points[a, 0] - points[v, 0], points[a, 1] - points[v, 1]
    bx, by = points[b, 0] - points[v, 0], points[b, 1] - points[v, 1]
    return float(np.arctan2(ax * by - ay * bx, ax * bx + ay * by))


@kernel
def _copies(points: Floats, triangles: Ints, twins: Ints) -> tuple[Ints, Ints, Flags, Floats]:
    """Give each fan of triangles around a point its own copy of the point, in the order of first corners."""
    copy = np.full((len(triangles), 3), -1, np.int64)
    origin = np.empty(3 * len(triangles), np.int64)
    on_rim = np.zeros(3 * len(triangles), np.bool_)
    angle = np.empty(3 * len(triangles))
    n = 0
    for start in range(3 * len(triangles)):
        if copy[start // 3, start % 3] >= 0:
            continue
        c = start
        while True:  # clockwise to the first corner of the fan: across half-edge c, which leaves the point
            h = twins[c]
            if h < 0:
                on_rim[n] = True
                break
            c = h - h % 3 + (h % 3 + 1) % 3
            if c == start:
                break
        total, first = 0.0, c
        while True:  # counter-clockwise: across the half-edge that comes in
            copy[c // 3, c % 3] = n
            total += _corner_angle(points, triangles, c)
            h = twins[c - c % 3 + (c % 3 + 2) % 3]
            if h < 0 or h == first:
                break
            c = h
        origin[n] = triangles[start // 3, start % 3]
        angle[n] = total
        n += 1
    return copy, origin[:n].copy(), on_rim[:n].copy(), angle[:n].copy()
