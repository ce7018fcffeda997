"""Clusters: connected pixels of one colour, as disjoint sets with their pixels in lists."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Labels
from imgquad_core.geometry.corner_rule import PAIR_AD, PAIR_BC, joined_pair
from imgquad_core.grouping import unite
from imgquad_core.jit import kernel


class Clusters(NamedTuple):
    """Disjoint sets of pixels; the root of each is its first pixel in reading order."""

    parent: Labels  #: towards the root
    pixels: Labels  #: how many, valid at roots
    follower: Labels  #: next pixel of the same cluster, -1 at its end
    last: Labels  #: last pixel of this list, valid at roots


def labelled_clusters(colors: Labels, rule: int) -> Clusters:
    """Label the clusters of a picture of colours, int32 (n_rows, n_cols); equal colours need not be one cluster.

    `rule` says what is connected over a corner, see `imgquad_core.geometry.corner_rule`.
    """
    root = roots_of(colors, rule)
    return Clusters(root, *_listed(root))


@kernel
def roots_of(colors: Labels, rule: int) -> Labels:
    """Return for each pixel, in reading order, the first pixel of its cluster."""
    rows, cols = colors.shape
    parent = np.arange(rows * cols, dtype=np.int32)
    for r in range(rows):
        for c in range(cols):
            p = r * cols + c
            beside, below = c > 0 and colors[r, c] == colors[r, c - 1], r > 0 and colors[r, c] == colors[r - 1, c]
            if beside:
                parent[p] = parent[p - 1]
            if below and not (beside and colors[r, c] == colors[r - 1, c - 1]):  # else they are united already
                unite(parent, p - cols, p)
            if r > 0 and c > 0 and not beside and not below:
                pair = joined_pair(colors, r, c, rule)
                if pair == PAIR_AD:
                    unite(parent, p - cols - 1, p)
                elif pair == PAIR_BC:
                    unite(parent, p - cols, p - 1)
    for p in range(len(parent)):
        parent[p] = parent[parent[p]]  # parents come before their pixels
    return parent


@kernel
def pixels_of(root: Labels) -> Labels:
    """Return the number of pixels of each cluster, at its root."""
    pixels = np.zeros(len(root), np.int32)
    for k in root:
        pixels[k] += 1
    return pixels


@kernel
def _listed(root: Labels) -> tuple[Labels, Labels, Labels]:
    """Return `pixels`, `follower` and `last` of `Clusters`."""
    n = len(root)
    pixels, follower, last = np.ones(n, np.int32), np.full(n, -1, np.int32), np.arange(n, dtype=np.int32)
    for p in range(n):
        k = root[p]
        if k != p:
            pixels[k] += 1
            follower[last[k]] = p
            last[k] = p
    return pixels, follower, last


@kernel
def join(clusters: Clusters, p: int, q: int) -> int:
    """Unite the clusters of two pixels; return the root that was given up, or -1 if they were one."""
    high = unite(clusters.parent, p, q)
    if high < 0:
        return -1
    low = clusters.parent[high]
    clusters.pixels[low] += clusters.pixels[high]
    clusters.follower[clusters.last[low]] = high
    clusters.last[low] = clusters.last[high]
    return high
