"""Cores of regions, what is near to them, and the flood that takes the rest: distances in pictures of labels."""

from __future__ import annotations

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints, Labels, Singles
from imgquad_core.jit import kernel, verb
from imgquad_core.model import VOID

PX, DIAGONAL = 10_000, 14_142  #: lengths of steps: whole numbers, so that ways of one length are equal
_NOT_YET = 2**31 - 1


@kernel
def distances(labels: Labels) -> Singles:
    """Distance of each pixel to the nearest one of another label, or outside the picture.

    Exact: in each row, within a run of one label, the squared distance is the lower envelope of parabolas, whose
    heights are distances within columns; beyond its ends there is another label at height 0.
    """
    rows, cols = labels.shape
    up = np.empty((rows, cols), np.float32)  # half the memory: whole numbers, and roots of some
    for i in range(rows):
        for j in range(cols):
            up[i, j] = 1.0 if i == 0 or labels[i, j] != labels[i - 1, j] else up[i - 1, j] + 1.0
    for i in range(rows - 1, -1, -1):
        for j in range(cols):
            down = 1.0 if i == rows - 1 or labels[i, j] != labels[i + 1, j] else up[i + 1, j] + 1.0
            up[i, j] = min(up[i, j], np.float32(down))
    height, found = np.empty(cols + 2), np.empty(cols + 2)
    top, ends = np.empty(cols + 2, np.int64), np.empty(cols + 3)
    for i in range(rows):
        begin = 0
        while begin < cols:
            end = begin + 1
            while end < cols and labels[i, end] == labels[i, begin]:
                end += 1
            n = end - begin + 2
            height[0] = height[n - 1] = 0.0
            for k in range(1, n - 1):
                height[k] = float(up[i, begin + k - 1]) ** 2
            _lower_envelope(height, n, top, ends, found)
            for k in range(1, n - 1):
                up[i, begin + k - 1] = np.sqrt(found[k])
            begin = end
    return up


@verb
def _lower_envelope(height: Floats, n: int, top: Ints, ends: Floats, found: Floats) -> None:
    """Least of height[k] + (x - k)^2 over k, at x = 0 .. n - 1 (Felzenszwalb & Huttenlocher 2012)."""
    count = 0
    top[0], ends[0], ends[1] = 0, -np.inf, np.inf
    for q in range(1, n):
        while True:
            p = top[count]
            s = (height[q] + q * q - height[p] - p * p) / (2.0 * (q - p))
            if s > ends[count]:
                break
            count -= 1
        count += 1
        top[count], ends[count], ends[count + 1] = q, s, np.inf
    count = 0
    for x in range(n):
        while ends[count + 1] < x:
            count += 1
        found[x] = height[top[count]] + (x - top[count]) ** 2


@kernel
def near_core(labels: Labels, distance: Singles, radius: float, reach: float) -> Flags:
    """Tell which pixels are within reach of one farther than `radius` from other labels, on a way in their region."""
    rows, cols = labels.shape
    gone = np.empty((rows, cols), np.int32)
    queue = np.empty(rows * cols, np.int32)
    waits = np.zeros((rows, cols), np.bool_)
    count = 0
    for i in range(rows):
        for j in range(cols):
            gone[i, j] = 0 if distance[i, j] > radius else _NOT_YET
            if distance[i, j] > radius and distance[i, j] <= radius + 2.0:
                queue[count] = i * cols + j
                waits[i, j] = True
                count += 1
    _spread(labels, gone, queue, waits, count, int(reach * PX), True, labels)
    for i in range(rows):
        for j in range(cols):
            waits[i, j] = gone[i, j] != _NOT_YET
    return waits


@verb
def _spread(
    labels: Labels, gone: Labels, queue: Labels, waits: Flags, count: int, reach: int, inside: bool, out: Labels
) -> None:
    """Carry lengths of ways on from the pixels in the queue, first come first served, until none gets shorter.

    `inside`: ways stay in their region. Else the label of a way's begin goes into `out`.
    """
    rows, cols = labels.shape
    head, size = 0, len(queue)
    while count > 0:
        p = queue[head]
        head = (head + 1) % size
        count -= 1
        i, j = p // cols, p % cols
        waits[i, j] = False
        for di in range(-1, 2):
            for dj in range(-1, 2):
                a, b = i + di, j + dj
                if (di == 0 and dj == 0) or a < 0 or b < 0 or a >= rows or b >= cols:
                    continue
                way = gone[i, j] + (DIAGONAL if di != 0 and dj != 0 else PX)
                if way >= gone[a, b] or way > reach or (inside and labels[a, b] != labels[i, j]):
                    continue
                gone[a, b] = way
                if not inside:
                    out[a, b] = out[i, j]
                if not waits[a, b]:
                    waits[a, b] = True
                    queue[(head + count) % size] = a * cols + b
                    count += 1


@kernel
def flood(labels: Labels, kept: Flags) -> tuple[Labels, Labels]:
    """Give pixels that are not kept to the nearest that are, over those that are not; also tell how far, in 1 / PX."""
    rows, cols = labels.shape
    out = labels.copy()
    gone = np.empty((rows, cols), np.int32)
    queue = np.empty(rows * cols, np.int32)
    waits = np.zeros((rows, cols), np.bool_)
    count = 0
    for i in range(rows):
        for j in range(cols):
            gone[i, j] = 0 if kept[i, j] else _NOT_YET
            if kept[i, j] and labels[i, j] != VOID and _is_beside(kept, i, j):
                queue[count] = i * cols + j
                waits[i, j] = True
                count += 1
    _spread(labels, gone, queue, waits, count, _NOT_YET, False, out)
    for i in range(rows):
        for j in range(cols):
            if gone[i, j] == _NOT_YET:
                gone[i, j] = 0  # out of reach: between void pixels
    return out, gone


@verb
def _is_beside(kept: Flags, i: int, j: int) -> bool:
    """Whether one of the eight pixels around is not kept."""
    for a in range(max(i - 1, 0), min(i + 2, kept.shape[0])):
        for b in range(max(j - 1, 0), min(j + 2, kept.shape[1])):
            if not kept[a, b]:
                return True
    return False
