"""Clusters: connected pixels of one colour, as disjoint sets with their pixels in lists."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Labels
from imgquad_core.jit import kernel, verb

#: the window of the local minority is 2 * REACH pixels wide, as in the boundary stage
REACH = 3


class Clusters(NamedTuple):
    """Disjoint sets of pixels; the root of each is its first pixel in reading order."""

    parent: Labels  #: towards the root
    pixels: Labels  #: how many, valid at roots
    follower: Labels  #: next pixel of the same cluster, -1 at its end
    last: Labels  #: last pixel of this list, valid at roots


def labelled_clusters(colors: Labels) -> Clusters:
    """Label the clusters of a picture of colours, int32 (n_rows, n_cols); equal colours need not be one cluster."""
    n = colors.size
    pixels = np.arange(n, dtype=np.int32)
    clusters = Clusters(pixels, np.ones(n, np.int32), np.full(n, -1, np.int32), pixels.copy())
    label_clusters(colors, clusters)
    return clusters


@kernel
def find(parent: Labels, p: int) -> int:
    """Return the root of pixel `p`, halving the path to it."""
    while parent[p] != p:
        parent[p] = parent[parent[p]]
        p = parent[p]
    return p


@kernel
def join(clusters: Clusters, p: int, q: int) -> int:
    """Unite the clusters of two pixels; return the root that was given up, or -1 if they were one."""
    low, high = find(clusters.parent, p), find(clusters.parent, q)
    if low == high:
        return -1
    if low > high:
        low, high = high, low
    clusters.parent[high] = low
    clusters.pixels[low] += clusters.pixels[high]
    clusters.follower[clusters.last[low]] = high
    clusters.last[low] = clusters.last[high]
    return high


@verb
def joined_diagonal(colors: Labels, r: int, c: int) -> int:
    """Return which pixels are connected over the corner of four pixels that no side connects.

    ::

        A B      (r - 1, c - 1)  (r - 1, c)
        C D      (r,     c - 1)  (r,     c)         1: A and D,  2: B and C,  0: none
    """
    a, b, x, d = colors[r - 1, c - 1], colors[r - 1, c], colors[r, c - 1], colors[r, c]
    if a in (b, x) or d in (b, x):
        return 0
    if a == d and b == x:
        return 1 if is_minority(colors, r, c, a, b) else 2
    return 1 if a == d else (2 if b == x else 0)


@verb
def is_minority(colors: Labels, r: int, c: int, a: int, b: int) -> bool:
    """Return whether `a` is rarer than `b` around the corner (r, c), or as rare and the lower number."""
    more = 0
    for i in range(max(r - REACH, 0), min(r + REACH, colors.shape[0])):
        for j in range(max(c - REACH, 0), min(c + REACH, colors.shape[1])):
            if colors[i, j] == a:
                more += 1
            elif colors[i, j] == b:
                more -= 1
    return more < 0 or (more == 0 and a < b)


@kernel
def label_clusters(colors: Labels, clusters: Clusters) -> None:
    """Unite the pixels of each cluster."""
    rows, cols = colors.shape
    for r in range(rows):
        for c in range(cols):
            p = r * cols + c
            if c > 0 and colors[r, c] == colors[r, c - 1]:
                join(clusters, p - 1, p)
            if r > 0 and colors[r, c] == colors[r - 1, c]:
                join(clusters, p - cols, p)
            if r > 0 and c > 0:
                diagonal = joined_diagonal(colors, r, c)
                if diagonal == 1:
                    join(clusters, p - cols - 1, p)
                elif diagonal == 2:
                    join(clusters, p - cols, p - 1)
