"""Half-edges of polygon meshes: who lies across an edge, and which polygons meet at a point.

Half-edge ``k + n * f`` of a mesh of n-gons runs from corner k of face f to its next corner, counter-clockwise.
"""

from __future__ import annotations

import numpy as np

from imgquad_core.arrays import Ints
from imgquad_core.grouping import grouped
from imgquad_core.jit import kernel


@kernel
def twins_of(faces: Ints, n_points: int) -> Ints:
    """Return the opposite half-edge of each half-edge, -1 on the rim; -2 where more than two faces share an edge.

    Both of two half-edges that run the same way between the same points (a folded mesh) get -2.
    """
    n = faces.shape[1]
    tail, head = faces.ravel(), np.empty(faces.size, np.int64)
    for f in range(len(faces)):
        for k in range(n):
            head[n * f + k] = faces[f, k + 1 if k + 1 < n else 0]
    offsets, corners = grouped(faces, n_points)
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
def components(twins: Ints, n: int) -> tuple[Ints, int]:
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
