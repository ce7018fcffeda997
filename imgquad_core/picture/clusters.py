"""Clusters: connected pixels of one colour, as disjoint sets with their pixels in lists."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Ints, Labels
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
    n = colors.size
    pixels = np.arange(n, dtype=np.int32)
    clusters = Clusters(pixels, np.ones(n, np.int32), np.full(n, -1, np.int32), pixels.copy())
    label_clusters(colors, clusters, rule)
    return clusters


@kernel
def roots_of(clusters: Clusters) -> Ints:
    """Return the root of each pixel, in reading order: parents come before their pixels."""
    root = np.empty(len(clusters.parent), np.int64)
    for p in range(len(root)):
        parent = clusters.parent[p]
        root[p] = p if parent == p else root[parent]
    return root


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


@kernel
def label_clusters(colors: Labels, clusters: Clusters, rule: int) -> None:
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
                pair = joined_pair(colors, r, c, rule)
                if pair == PAIR_AD:
                    join(clusters, p - cols - 1, p)
                elif pair == PAIR_BC:
                    join(clusters, p - cols, p - 1)
