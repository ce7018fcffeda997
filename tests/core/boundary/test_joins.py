"""Joins of short chains: four grains that meet nearly in a point get one junction, and all faces stay."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from imgquad_core import MeshOptions, mesh_image
from imgquad_core.boundary.areas import enclosed_areas
from imgquad_core.boundary.curves import pixel_chains
from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.boundary.joins import join_short_chains
from imgquad_core.boundary.options import SmoothingOptions
from imgquad_core.boundary.smoothing import smooth_boundaries
from imgquad_core.model import VOID, BoundaryGraph, PointKind
from support.labels import any_labels, label_image, voronoi
from support.planar import check_meshable, check_planar


def cross(shift: int, n: int = 40) -> NDArray[np.int32]:
    """Four grains whose two triple points are `shift` px apart."""
    y, x = np.mgrid[:n, :n] + 0.5
    upper, lower = np.where(x > n / 2, 1, 2), np.where(x > n / 2 + shift, 3, 4)
    return np.where(y < n / 2, upper, lower).astype(np.int32)


def joined(labels: NDArray[np.int32], shortest: float) -> tuple[BoundaryGraph, BoundaryGraph]:
    raw = extract_boundaries(label_image(labels))
    return raw, join_short_chains(pixel_chains(raw), shortest, max(0.5 * shortest, 1.0)).chains.graph


@pytest.mark.parametrize("shift", [1, 2, 5])
def test_a_short_chain_goes_and_its_ends_become_one_halfway(shift: int) -> None:
    raw, made = joined(cross(shift), shift + 0.5)
    assert made.n_chains == raw.n_chains - 1
    check_planar(made, 1)
    valence = np.bincount(np.concatenate([made.chain(c)[[0, -1]] for c in range(made.n_chains)]))
    (four,) = np.flatnonzero(valence == 4)
    assert made.point_kind[four] == PointKind.JUNCTION
    assert made.points[four].tolist() == pytest.approx([20 + shift / 2, 20], abs=0.01)


def test_longer_chains_stay() -> None:
    raw, made = joined(cross(5), 4.0)
    assert np.array_equal(made.chain_points, raw.chain_points)
    assert np.array_equal(made.points, raw.points)


def test_a_lens_stays() -> None:
    labels = np.zeros((30, 30), np.int32)
    labels[:, 15:] = 1
    labels[14:16, 14:16] = 2  # between the ends of its two chains nothing may be joined
    raw, made = joined(labels, 3.0)
    assert made.n_chains == raw.n_chains


def test_a_corner_of_the_picture_stays_and_takes_what_is_near() -> None:
    labels = np.zeros((30, 30), np.int32)
    labels[np.add.outer(np.arange(30), 3 * np.arange(30)) < 40] = 1
    labels[0, :] = 1
    _, made = joined(labels, 3.0)
    corners = made.points[made.point_kind == PointKind.CORNER]
    assert sorted(map(tuple, corners.tolist())) == [(0, 0), (0, 30), (30, 0), (30, 30)]
    check_planar(made, 1)


@pytest.mark.parametrize("shortest", [2.0, 5.0, 9.0])
@pytest.mark.parametrize("seed", range(6))
def test_grains_keep_their_faces_and_no_node_goes_far(seed: int, shortest: float) -> None:
    labels = voronoi(60, 60, 40, seed)
    raw, made = joined(labels, shortest)
    check_planar(made, 1)
    assert made.n_chains < raw.n_chains
    nodes = raw.points[raw.point_kind == PointKind.JUNCTION]
    now = made.points[(made.point_kind == PointKind.JUNCTION) | (made.point_kind == PointKind.CORNER)]
    nearest = np.hypot(*(nodes[:, None] - now[None]).transpose(2, 0, 1)).min(axis=1)
    assert nearest.max() <= max(0.5 * shortest, 1.0) + 1e-3


@pytest.mark.parametrize("seed", range(40, 70))
def test_any_picture_stays_planar(seed: int) -> None:
    graph = extract_boundaries(label_image(any_labels(seed)))
    check_meshable(smooth_boundaries(graph, SmoothingOptions(2.5, join=6.0)))


def test_no_join_where_none_is_asked_for() -> None:
    graph = extract_boundaries(label_image(cross(1)))
    assert smooth_boundaries(graph, SmoothingOptions(4.0, join=0.0)).n_chains == graph.n_chains
    assert smooth_boundaries(graph, SmoothingOptions(4.0, max_shift=0.0)).n_chains == graph.n_chains
    assert smooth_boundaries(graph, SmoothingOptions(4.0)).n_chains == graph.n_chains - 1


def test_a_side_of_the_border_between_two_corners_stays_there() -> None:
    """The junction on the left is joined with the corner; what is left of the top side are its two ends."""
    mesh = mesh_image(np.array([[0], [2]], np.int32), MeshOptions(size=1.0, step=2.6, effort="fast"))
    assert mesh.points.min(axis=0).tolist() == [0.0, 0.0]
    assert mesh.points.max(axis=0).tolist() == [1.0, 2.0]


@pytest.mark.parametrize("depth", [1, 3, 5, 7, 12])
@pytest.mark.parametrize("width", [1, 3, 7])
@pytest.mark.parametrize("neck", [1, 3])
def test_a_cave_beside_a_join_is_not_walled_up(neck: int, width: int, depth: int) -> None:
    """A spoke to the last point within reach left the cave out, and the region got its area in silence."""
    labels = np.zeros((24, 24), np.int32)
    labels[11, 24 - neck :] = VOID
    labels[11 - width // 2 : 12 + width // 2, 24 - neck - depth : 24 - neck] = VOID
    labels[13:, 23] = VOID  # one pixel of the border lies between
    smooth = smooth_boundaries(extract_boundaries(label_image(labels)))
    assert np.abs(enclosed_areas(smooth) - smooth.region_pixels).max() < 1.5


def test_an_island_in_a_cave_stays_in_it() -> None:
    labels = np.zeros((16, 16), np.int32)
    labels[2:9, 3:10] = labels[5, 3:] = labels[7:, 15] = VOID
    labels[3, 4] = 0
    assert mesh_image(label_image(labels)).n_quads > 0  # the outline without the cave had the island inside


def test_a_border_of_void_stays_in_the_picture_where_the_border_beside_it_is_joined_away() -> None:
    options = MeshOptions(size=2.5, effort="fast", drop=(0,), pixel_size=(0.4, 3.0))
    mesh = mesh_image(label_image([[1], [0]]), options)  # its left side ends in the upper corner
    assert mesh.points.min() >= 0
    assert (mesh.points <= np.array([0.4, 6.0]) + 1e-9).all()
