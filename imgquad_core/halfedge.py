"""Half-edges of polygon meshes: who lies across an edge, and which polygons meet at a point.

Half-edge ``k + n * f`` of a mesh of n-gons runs from corner k of face f to its next corner, counter-clockwise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .jit import kernel

Ids = NDArray[np.int64]


@kernel
def corners_at(faces: Ids, n_points: int) -> tuple[Ids, Ids]:
    """Return CSR (offsets, corners): the flat corner indices ``n * f + k`` that each point has, ascending."""
    flat = faces.ravel()
    offsets = np.zeros(n_points + 1, np.int64)
    for v in flat:
        offsets[v + 1] += 1
    for v in range(n_points):
        offsets[v + 1] += offsets[v]
    fill = offsets[:-1].copy()
    corners = np.empty(flat.size, np.int64)
    for i in range(flat.size):
        v = flat[i]
        corners[fill[v]] = i
        fill[v] += 1
    return offsets, corners


@kernel
def twins_of(faces: Ids, n_points: int) -> Ids:
    """Return the opposite half-edge of each half-edge, -1 on the rim; -2 where more than two faces share an edge.

    Both of two half-edges that run the same way between the same points (a folded mesh) get -2.
    """
    n = faces.shape[1]
    tail, head = faces.ravel(), np.empty(faces.size, np.int64)
    for f in range(len(faces)):
        for k in range(n):
            head[n * f + k] = faces[f, k + 1 if k + 1 < n else 0]
    offsets, corners = corners_at(faces, n_points)
    twins = np.full(tail.size, -1, np.int64)
    for h in range(tail.size):
        for i in range(offsets[head[h]], offsets[head[h] + 1]):
            c = corners[i]
            if head[c] == tail[h]:
                twins[h] = c if twins[h] == -1 else -2
        for i in range(offsets[tail[h]], offsets[tail[h] + 1]):
            c = corners[i]
            if c != h and head[c] == head[h]:
                twins[h] = -2
    return twins


@kernel
def components(twins: Ids, n: int) -> tuple[Ids, int]:
    """Return for each n-gon the number of its edge-connected component (in order of first face), and their count."""
    n_faces = twins.size // n
    part = np.full(n_faces, -1, np.int64)
    stack = np.empty(n_faces, np.int64)
    count = 0
    for seed in range(n_faces):
        if part[seed] >= 0:
            continue
        part[seed] = count
        stack[0] = seed
        top = 1
        while top > 0:
            top -= 1
            f = stack[top]
            for k in range(n):
                t = twins[n * f + k]
                if t >= 0 and part[t // n] < 0:
                    part[t // n] = count
                    stack[top] = t // n
                    top += 1
        count += 1
    return part, count
