"""Boundary extraction: chains, regions and their faces."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from imgquad_core.boundary.areas import enclosed_areas
from imgquad_core.boundary.extraction import ExtractionOptions, extract_boundaries
from imgquad_core.errors import InputError
from imgquad_core.geometry.corner_rule import POLICIES, corner_rule
from imgquad_core.model import BoundaryGraph, PointKind
from imgquad_core.picture.clusters import labelled_clusters
from support.labels import any_labels, label_image, spiral
from support.planar import check_planar

EIGHT = np.ones((3, 3))


def n_regions(labels: list[list[int]], policy: str = "minority") -> int:
    return len(extract_boundaries(label_image(labels), ExtractionOptions(policy)).region_label)


def signature(graph: BoundaryGraph, labels_to: dict[int, int]) -> list[tuple[int, int]]:
    return sorted(zip([labels_to[int(k)] for k in graph.region_label], graph.region_pixels.tolist(), strict=True))


def test_one_pixel_is_framed_by_four_chains_from_corner_to_corner() -> None:
    graph = extract_boundaries(label_image([[7]]))
    assert graph.n_chains == 4
    assert graph.region_label.tolist() == [7]
    assert (graph.point_kind == PointKind.CORNER).sum() == 4
    corners = {tuple(xy) for xy in graph.points[graph.point_kind == PointKind.CORNER]}
    assert corners == {(0, 0), (1, 0), (0, 1), (1, 1)}
    assert enclosed_areas(graph).tolist() == [1.0]


def test_a_junction_lies_where_three_colours_meet() -> None:
    graph = extract_boundaries(label_image([[0, 1], [2, 2]]))
    junctions = graph.points[graph.point_kind == PointKind.JUNCTION]
    assert sorted(map(tuple, junctions)) == [(0, 1), (1, 1), (1, 2), (2, 1)]


def test_a_bent_boundary_runs_from_mid_side_to_mid_side() -> None:
    graph = extract_boundaries(label_image(np.pad([[1]], 2)))
    inner = np.flatnonzero((graph.chain_regions >= 0).all(axis=1))
    assert len(inner) == 1
    ring = graph.points[graph.chain(inner[0])]
    assert {tuple(xy) for xy in ring} == {(2.5, 3), (3, 2.5), (2.5, 2), (2, 2.5)}
    assert tuple(ring[0]) == tuple(ring[-1])


def test_left_and_right_are_seen_along_the_chain() -> None:
    graph = extract_boundaries(label_image([[0, 1]]))
    chain = next(c for c in range(graph.n_chains) if (graph.chain_regions[c] >= 0).all())
    start, end = graph.points[graph.chain(chain)[[0, -1]]]
    left, right = graph.region_label[graph.chain_regions[chain]]
    assert (left, right) == ((1, 0) if end[1] < start[1] else (0, 1))


@pytest.mark.parametrize(
    ("policy", "expected"), [("minority", 3), ("majority", 4), ("lower", 4), ("diagonal", 3), ("junction", 5)]
)
def test_a_diagonal_line_stays_whole_or_falls_apart_by_policy(policy: str, expected: int) -> None:
    assert n_regions(np.eye(3, dtype=int).tolist(), policy) == expected


def test_minority_joins_lines_of_either_slope() -> None:
    line = np.eye(9, dtype=int)
    assert n_regions(line.tolist()) == 3
    assert n_regions(line[::-1].tolist()) == 3


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("seed", range(40))
def test_faces_are_regions(seed: int, policy: str) -> None:
    labels = any_labels(seed)
    graph = extract_boundaries(label_image(labels), ExtractionOptions(policy))
    check_planar(graph, 1)
    assert graph.region_pixels.sum() == (labels >= 0).sum()
    colours = np.unique(labels[labels >= 0])
    fewest = sum(ndimage.label(labels == k, EIGHT)[1] for k in colours)
    most = sum(ndimage.label(labels == k)[1] for k in colours)
    assert fewest <= len(graph.region_label) <= most
    assert len(graph.region_label) == most or policy != "junction"


@pytest.mark.parametrize("seed", range(20))
def test_turning_and_mirroring_keep_the_regions(seed: int) -> None:
    labels = any_labels(seed)
    same = {int(k): int(k) for k in np.unique(labels)}
    expected = signature(extract_boundaries(label_image(labels)), same)
    for other in (np.rot90(labels), np.fliplr(labels), labels.T):
        assert signature(extract_boundaries(label_image(other)), same) == expected


def test_void_pixels_are_outside() -> None:
    labels = np.zeros((6, 6), int)
    labels[2:4, 2:4] = -1
    labels[0, 0] = -1
    graph = extract_boundaries(label_image(labels))
    assert graph.region_label.tolist() == [0]
    assert enclosed_areas(graph)[0] == pytest.approx(36 - 5 + 0.5 + 0.125, abs=1e-12)
    assert (0.0, 6.0) not in {tuple(xy) for xy in graph.points}


def test_a_spiral_is_two_regions() -> None:
    assert n_regions(spiral(15).tolist()) == 2


def test_a_picture_with_nothing_to_mesh_is_refused() -> None:
    with pytest.raises(InputError, match="2 x 3 pixels"):
        extract_boundaries(label_image(np.full((2, 3), -1)))


def test_an_unknown_policy_is_refused() -> None:
    with pytest.raises(InputError, match="'sometimes'"):
        ExtractionOptions("sometimes")


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("seed", range(6))
def test_clusters_of_noise_removal_are_the_regions(policy: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    labels = rng.integers(0, 2 + seed % 3, rng.integers(1, 25, 2)).astype(np.int32)
    parent = labelled_clusters(labels, corner_rule(policy)).parent
    while (parent != parent[parent]).any():
        parent = parent[parent]
    pixels = np.unique(parent, return_counts=True)[1]  # roots are first pixels, so in the order of regions
    graph = extract_boundaries(label_image(labels), ExtractionOptions(policy))
    assert pixels.tolist() == graph.region_pixels.tolist()
