"""Clusters beside SciPy's labels and the rule of the corner told pixel by pixel."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from scipy.ndimage import label as connected

from imgquad_core.geometry.corner_rule import DIAGONAL, JUNCTION, POLICIES
from imgquad_core.grouping import root_of
from imgquad_core.picture.clusters import Clusters, join, labelled_clusters
from support.labels import Labels, any_labels


def roots(clusters: Clusters) -> Labels:
    return np.array([root_of(clusters.parent, p) for p in range(len(clusters.parent))], np.int32)


def members(clusters: Clusters, root: int) -> list[int]:
    """Follow the list of a cluster's pixels."""
    found = [root]
    while clusters.follower[found[-1]] >= 0:
        found.append(int(clusters.follower[found[-1]]))
    return found


@pytest.mark.parametrize("seed", range(12))
def test_clusters_without_corners_are_those_of_scipy(seed: int) -> None:
    labels = any_labels(seed)
    found = roots(labelled_clusters(labels, JUNCTION)).reshape(labels.shape)
    for color in np.unique(labels):
        number, n = connected(labels == color)
        assert n == len(np.unique(found[labels == color]))
        for k in range(1, n + 1):
            assert np.ptp(found[number == k]) == 0


@pytest.mark.parametrize("policy", range(len(POLICIES)))
@pytest.mark.parametrize("seed", range(6))
def test_lists_and_counts_hold_all_pixels_of_a_cluster_and_its_root_is_the_first(seed: int, policy: int) -> None:
    labels = any_labels(seed)
    clusters = labelled_clusters(labels, policy)
    of = roots(clusters)
    counts = Counter(of.tolist())
    assert sum(counts.values()) == labels.size
    for root, n in counts.items():
        inside = members(clusters, root)
        assert sorted(inside) == np.flatnonzero(of == root).tolist()
        assert clusters.pixels[root] == n
        assert clusters.last[root] == inside[-1]
        assert root == min(inside)
        assert len(set(labels.ravel()[inside].tolist())) == 1


def test_the_diagonal_joins_over_corners_that_no_side_joins() -> None:
    labels = np.array([[1, 0, 2], [0, 1, 2], [3, 3, 1]], np.int32)
    of = roots(labelled_clusters(labels, DIAGONAL)).reshape(3, 3)
    assert of[0, 0] == of[1, 1] == of[2, 2]
    assert of[0, 1] != of[1, 0]
    apart = roots(labelled_clusters(labels, JUNCTION)).reshape(3, 3)
    assert len({apart[0, 0], apart[1, 1], apart[2, 2]}) == 3


def test_joining_gives_the_root_that_was_given_up() -> None:
    clusters = labelled_clusters(np.arange(5, dtype=np.int32)[None], JUNCTION)
    assert join(clusters, 3, 1) == 3
    assert join(clusters, 4, 3) == 4
    assert join(clusters, 1, 4) == -1
    assert members(clusters, 1) == [1, 3, 4]
    assert clusters.pixels[1] == 3
