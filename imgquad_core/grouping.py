"""Group anything by anything: rows of a table whose lengths differ (CSR), running sums, disjoint sets."""

from __future__ import annotations

import numpy as np

from .arrays import Ints, Labels
from .jit import kernel, verb


def rows_of(offsets: Ints, gaps: bool = False) -> Ints:
    """Return the row of each item of a table whose rows begin at `offsets`, or of each gap between two of its items."""
    return np.repeat(np.arange(len(offsets) - 1), np.diff(offsets) - gaps)


@verb
def add_up(counts: Ints | Labels) -> None:
    """Replace counts by their running sum."""
    for k in range(1, len(counts)):
        counts[k] += counts[k - 1]


@kernel
def grouped(faces: Ints, n_points: int) -> tuple[Ints, Ints]:
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
def root_of(parent: Ints | Labels, k: int) -> int:
    """Return the root of the disjoint set that `k` is in, its lowest number, halving the path to it."""
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@verb
def unite(parent: Ints | Labels, a: int, b: int) -> int:
    """Unite the sets of `a` and `b` under the lower root; return the root that was given up, or -1 if they were one."""
    low, high = root_of(parent, a), root_of(parent, b)
    if low == high:
        return -1
    if low > high:
        low, high = high, low
    parent[high] = low
    return high


def linked(a: Ints, b: Ints, n: int) -> tuple[Ints, int]:
    """Return the group of each of `n` things, numbered by their first ones, and how many; links join a[i] and b[i]."""
    return _linked(np.ascontiguousarray(a, np.int64), np.ascontiguousarray(b, np.int64), n)


@kernel
def _linked(a: Ints, b: Ints, n: int) -> tuple[Ints, int]:
    parent = np.arange(n)
    for i in range(len(a)):
        unite(parent, a[i], b[i])
    group, count = np.empty(n, np.int64), 0
    for k in range(n):
        root = root_of(parent, k)
        if root == k:
            group[k] = count
            count += 1
        else:
            group[k] = group[root]
    return group, count
