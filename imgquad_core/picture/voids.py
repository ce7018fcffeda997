"""Void: pixels that hold nothing (not indexed, NaN, nodata, masked), and how they are filled from around."""

from __future__ import annotations

import numpy as np
import scipy

from imgquad_core.arrays import Ints, Labels
from imgquad_core.model import VOID, LabelImage


def fill_void(image: LabelImage, pixels: int) -> LabelImage:
    """Give void clusters of at most `pixels` pixels to the material with the longest common border.

    Parameters
    ----------
    image : LabelImage
        Labels, `VOID` where there is no material.
    pixels : int
        Clusters (connected over sides) of more pixels stay void. 0: all stay.

    Returns
    -------
    LabelImage
        With the same materials. Of equally long borders that of the lower number counts.
    """
    clusters, sizes = void_clusters(image.labels)
    small = np.flatnonzero((sizes > 0) & (sizes <= pixels))
    if len(small) == 0:
        return image
    owner = np.full(len(sizes), VOID, np.int32)
    owner[1:] = _takers(image.labels, clusters, len(sizes))[1:]
    taken = np.full(len(sizes), VOID, np.int32)
    taken[small] = owner[small]
    labels = np.where(image.labels == VOID, taken[clusters], image.labels)
    return LabelImage(labels, image.materials)


def void_clusters(labels: Labels) -> tuple[Labels, Ints]:
    """Return the void cluster of each pixel, from 1 (0: none), and the pixels of each cluster (0 for number 0)."""
    clusters, n = scipy.ndimage.label(labels == VOID)
    sizes = np.bincount(clusters.ravel(), minlength=n + 1)
    sizes[0] = 0
    return np.asarray(clusters, np.int32), sizes


def _takers(labels: Labels, clusters: Labels, n: int) -> Labels:
    """Return for each cluster the material with the longest common border, `VOID` where there is none."""
    sides = []
    for a, b in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1])):
        for void, other in ((a, b), (b, a)):
            beside = (clusters[void] > 0) & (labels[other] != VOID)
            sides.append(np.stack([clusters[void][beside], labels[other][beside]], axis=1))
    pairs, lengths = np.unique(np.concatenate(sides), axis=0, return_counts=True)
    # by cluster, the longest border first, then the lower number
    order = np.lexsort((pairs[:, 1], -lengths, pairs[:, 0]))
    found, first = np.unique(pairs[order, 0], return_index=True)
    takers = np.full(n, VOID, np.int32)
    takers[found] = pairs[order, 1][first]
    return takers
