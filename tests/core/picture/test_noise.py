"""Noise removal: what goes, what stays, who gets it, and that it ends."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.ndimage import label as connected

from imgquad_core.declared import POLICIES
from imgquad_core.errors import InputError
from imgquad_core.geometry.corner_rule import corner_rule
from imgquad_core.model import VOID
from imgquad_core.picture.clusters import labelled_clusters
from imgquad_core.picture.noise import DenoiseOptions, automatic_limits, list_removed, remove_noise
from support.labels import Labels, label_image


def cleaned(labels: Labels, min_pixels: int, min_length: float) -> Labels:
    return remove_noise(label_image(np.asarray(labels)), DenoiseOptions(min_pixels, min_length)).labels


def drawing(text: str) -> Labels:
    return np.array([[int(c) for c in line] for line in text.split()], np.int32)


def slow_clusters(labels: Labels) -> list[set[tuple[int, int]]]:
    """Flood fill over sides and joined corners, by the words of the documentation."""
    rows, cols = labels.shape

    def joined(r: int, c: int, i: int, j: int) -> bool:
        if not (0 <= i < rows and 0 <= j < cols) or labels[i, j] != labels[r, c]:
            return False
        if r == i or c == j:
            return True
        a, b, mine = labels[r, j], labels[i, c], labels[r, c]
        if mine in (a, b):
            return False  # connected over sides anyway
        if a != b:
            return True
        top, left = max(r, i), max(c, j)
        window = labels[max(top - 3, 0) : top + 3, max(left - 3, 0) : left + 3]
        n_mine, n_other = np.count_nonzero(window == mine), np.count_nonzero(window == a)
        return bool((n_mine, mine) < (n_other, a))

    seen: set[tuple[int, int]] = set()
    clusters = []
    for start in np.ndindex(rows, cols):
        if start in seen:
            continue
        cluster, front = {start}, deque([start])
        while front:
            r, c = front.popleft()
            for i in (r - 1, r, r + 1):
                for j in (c - 1, c, c + 1):
                    if (i, j) not in cluster and joined(r, c, i, j):
                        cluster.add((i, j))
                        front.append((i, j))
        seen |= cluster
        clusters.append(cluster)
    return clusters


def slow_length(cluster: set[tuple[int, int]]) -> int:
    """Pixels on the longest of all shortest paths, from every pixel."""
    longest = 0
    for start in cluster:
        steps, front = {start: 1}, deque([start])
        while front:
            r, c = front.popleft()
            for q in ((r + i, c + j) for i in (-1, 0, 1) for j in (-1, 0, 1)):
                if q in cluster and q not in steps:
                    steps[q] = steps[r, c] + 1
                    front.append(q)
        longest = max(longest, *steps.values())
    return longest


@pytest.mark.parametrize("turn", range(4))
def test_a_one_pixel_vein_stays_while_a_blob_of_as_many_pixels_goes(turn: int) -> None:
    labels = np.zeros((80, 80), np.int32)
    labels[3, 10:70] = 1
    labels[40:50, 30:36] = 1
    labels[np.arange(60) + 12, np.arange(60) + 15] = 2  # a diagonal vein is one cluster too
    labels[70:76, 5:15] = 2
    labels = np.rot90(labels, turn)
    after = np.rot90(cleaned(labels, 61, 20), -turn)
    assert (after == 1).sum() == 60
    assert (after[3, 10:70] == 1).all()
    assert (after == 2).sum() == 60
    assert (np.diagonal(after, 3)[12:72] == 2).all()


def test_a_bent_vein_is_as_long_as_its_way() -> None:
    zigzag = np.zeros((12, 12), np.int32)
    zigzag[1:11:2, 1:11] = 1
    zigzag[2:10:4, 10] = zigzag[4:10:4, 1] = 1
    n = int(zigzag.sum())
    assert (cleaned(zigzag, n + 1, n - 8) == zigzag).all()  # the way cuts two corners at each bend
    assert (cleaned(zigzag, n + 1, n - 7) == 0).all()


def test_both_limits_must_be_missed() -> None:
    labels = np.zeros((20, 20), np.int32)
    labels[5:9, 5:9] = 1
    assert (cleaned(labels, 16, 100) == labels).all()
    assert (cleaned(labels, 100, 4) == labels).all()
    assert (cleaned(labels, 17, 4.5) == 0).all()


def test_noise_goes_to_the_longest_border_then_to_the_larger_neighbour_then_to_the_lower_number() -> None:
    assert (cleaned(drawing("1122 1132 1122"), 2, 2) == drawing("1122 1122 1122")).all()
    assert (cleaned(drawing("113222"), 2, 2) == drawing("112222")).all()
    assert (cleaned(drawing("22311"), 2, 2) == drawing("22111")).all()


def test_a_border_counts_for_all_neighbours_of_one_material_together() -> None:
    assert (cleaned(drawing("1555 1315 2212 2222"), 2, 2) == drawing("1555 1115 2212 2222")).all()


def test_the_smallest_goes_first() -> None:
    # first the 2 goes to the 1 around it, which then is large enough to stay
    labels = drawing("00000 01110 01210 01110 00000")
    assert (cleaned(labels, 9, 9) == drawing("00000 01110 01110 01110 00000")).all()
    assert (cleaned(labels, 10, 9) == 0).all()


def test_off_by_default_and_for_exact_labels() -> None:
    noise = drawing("010 101 010")
    image = label_image(noise)
    assert remove_noise(image) is image
    assert remove_noise(image, automatic_limits(quantised=False, shape=(3, 3))) is image
    assert automatic_limits(quantised=True, shape=(5000, 5000)) == DenoiseOptions(256, 16.0)
    assert automatic_limits(quantised=True, shape=(200, 200)) == DenoiseOptions(16, 4.0)


def test_void_is_neither_noise_nor_a_neighbour() -> None:
    labels = np.full((7, 7), VOID, np.int32)
    labels[3, 3] = 4
    assert (cleaned(labels, 50, 50) == labels).all()
    labels = np.zeros((7, 7), np.int32)
    labels[2, 2:4] = VOID
    labels[3, 3] = 4
    after = cleaned(labels, 50, 50)
    assert (after == np.where(labels == VOID, VOID, 0)).all()


def test_a_picture_of_one_colour_and_of_one_pixel_stay() -> None:
    assert (cleaned(np.full((3, 4), 7, np.int32), 100, 100) == 7).all()
    assert (cleaned(np.full((1, 1), 7, np.int32), 100, 100) == 7).all()


def test_the_ledger_lists_clusters_and_pixels_by_material() -> None:
    labels = np.zeros((10, 20), np.int32)
    labels[2, 2] = labels[5:7, 5] = 5
    labels[8, 8:12] = 1_000_000_007
    labels[3:7, 12:16] = 9
    before = label_image(labels)
    after = remove_noise(before, DenoiseOptions(10, 10))
    found = {(r.name, r.material, r.clusters, r.pixels) for r in list_removed(before, after)}
    assert all(type(number) is int for _, *numbers in found for number in numbers)  # so that JSON takes them
    assert found == {("m5", 5, 2, 3), ("m1000000007", 1_000_000_007, 1, 4)}
    assert (after.labels[3:7, 12:16] == 9).all()


@settings(max_examples=60, deadline=None)
@given(
    arrays(np.int32, st.tuples(st.integers(1, 14), st.integers(1, 14)), elements=st.integers(-1, 3)),
    st.integers(2, 12),
    st.integers(2, 8),
)
def test_no_noise_is_left_and_nothing_is_touched_twice(labels: Labels, min_pixels: int, min_length: int) -> None:
    before = labels.copy()
    after = cleaned(labels, min_pixels, min_length)
    assert (labels == before).all()
    assert ((after == VOID) == (labels == VOID)).all()
    assert set(np.unique(after)) <= set(np.unique(labels))
    assert (cleaned(after, min_pixels, min_length) == after).all()
    for cluster in slow_clusters(after):
        r, c = next(iter(cluster))
        beside = {(i + x, j + y) for i, j in cluster for x, y in ((0, 1), (1, 0), (0, -1), (-1, 0))} - cluster
        lonely = all(
            not (0 <= i < labels.shape[0] and 0 <= j < labels.shape[1]) or after[i, j] == VOID for i, j in beside
        )
        # two sweeps find the diameter of what has no holes or nearly: 3/4 holds for these small shapes
        assert after[r, c] == VOID or lonely or len(cluster) >= min_pixels or slow_length(cluster) >= 0.75 * min_length


@settings(max_examples=30, deadline=None)
@given(arrays(np.int32, st.tuples(st.integers(1, 12), st.integers(1, 12)), elements=st.integers(0, 2)))
def test_the_ledger_counts_the_clusters_that_a_flood_fill_finds(labels: Labels) -> None:
    before = label_image(labels)
    after = remove_noise(before, DenoiseOptions(6, 6))
    changed = before.labels != after.labels
    clusters = [c for c in slow_clusters(labels) if any(changed[p] for p in c)]
    assert sum(r.clusters for r in list_removed(before, after)) == len(clusters)
    assert sum(r.pixels for r in list_removed(before, after)) == changed.sum()
    for value in range(3):  # pixels that share sides stay together; only at corners may a cluster be parted before
        part, n = connected(labels == value)
        assert all(np.unique(changed[part == k]).size == 1 for k in range(1, n + 1))


def test_the_ledger_counts_clusters_that_were_parted_at_a_corner_and_kept_in_part() -> None:
    rows = ("000111", "110110", "101001", "101111", "110111")
    before = label_image(np.array([list(row) for row in rows], np.int32))
    after = remove_noise(before, DenoiseOptions(6, 6))
    assert after.labels[0, 0] == 0
    assert [(r.material, r.clusters, r.pixels) for r in list_removed(before, after)] == [(0, 1, 3), (1, 1, 5)]


def test_limits_that_make_no_sense_are_refused() -> None:
    for bad in ({"min_pixels": -1}, {"min_length": -0.5}, {"min_length": float("nan")}, {"min_pixels": 2.5}):
        with pytest.raises(InputError, match=next(iter(bad))):
            DenoiseOptions(**bad)  # type: ignore[arg-type]


def test_a_large_noisy_picture_is_cleaned_to_its_grains() -> None:
    rows, cols = np.mgrid[0:300, 0:400]
    clean = ((rows // 50 + cols // 40) % 5).astype(np.int32)
    random = np.random.default_rng(4)
    noisy = np.where(random.random(clean.shape) < 0.05, random.integers(0, 5, clean.shape), clean)
    assert (cleaned(noisy, 16, 8) != clean).mean() < 0.003 < (noisy != clean).mean()


@pytest.mark.parametrize("policy", POLICIES)
def test_clusters_with_removed_pixels_are_counted_once_each(policy: str) -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        labels = rng.integers(0, 3, rng.integers(1, 30, 2)).astype(np.int32)
        changed = rng.random(labels.shape) < rng.choice([0.02, 0.3])
        before, after = label_image(labels), label_image(np.where(changed, (labels + 1) % 3, labels))
        root = labelled_clusters(labels, corner_rule(policy)).parent
        while (root != root[root]).any():
            root = root[root]
        touched = labels.ravel()[np.unique(root[changed.ravel()])]
        found = {removal.material: removal.clusters for removal in list_removed(before, after, policy)}
        assert found == {m: int((touched == m).sum()) for m in np.unique(labels[changed]).tolist()}
