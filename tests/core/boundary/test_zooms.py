"""Zooms that are no whole number: the boundary of the map itself comes back, whatever way pixels were rounded."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from imgquad_core.boundary.curves import pixel_chains
from imgquad_core.boundary.extraction import ExtractionOptions, extract_boundaries
from imgquad_core.boundary.options import SmoothingOptions
from imgquad_core.boundary.smoothing import smooth_boundaries
from imgquad_core.boundary.stairs import find_step, in_data_points
from imgquad_core.boundary.zooms import unrounded
from imgquad_core.model import BoundaryGraph
from support.labels import label_image, voronoi

Labels = NDArray[np.int32]
GRAINS = voronoi(80, 80, 20, 3)
WAYS: dict[str, Callable[[NDArray[np.int64], float], NDArray[np.float64]]] = {
    "middles of pixels": lambda pixel, times: np.floor((pixel + 0.5) / times),
    "left sides of pixels": lambda pixel, times: np.floor(pixel / times),
}


def zoomed(labels: Labels, times: float, way: str = "middles of pixels") -> Labels:
    """Nearest data point of each pixel."""
    at = [WAYS[way](np.arange(round(n * times)), times).astype(int) for n in labels.shape]
    return np.ascontiguousarray(labels[np.ix_(*at)])


def boundary(labels: Labels, times: float = 1.0) -> BoundaryGraph:
    return extract_boundaries(label_image(labels), ExtractionOptions(step=times))


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("times", [2.5, 2.7, 3.3, 4.7])
def test_the_chains_of_the_map_come_back(times: float, way: str) -> None:
    raw, chains = boundary(GRAINS), pixel_chains(boundary(zoomed(GRAINS, times, way), times))
    moved, step = unrounded(chains, find_step(chains.graph))
    made = in_data_points(moved, step)
    assert step == pytest.approx((times, times), rel=1e-12)
    assert np.abs(moved.graph.points - chains.graph.points).max() <= 1.0
    assert made.graph.shape == raw.shape
    assert np.array_equal(made.side, pixel_chains(raw).side)
    assert np.allclose(made.graph.points, raw.points, atol=1e-9)


@pytest.mark.parametrize("times", [2.5, 2.7, 3.3])
@pytest.mark.parametrize("seed", range(3))
def test_it_is_smoothed_and_cut_as_the_map_itself(times: float, seed: int) -> None:
    labels = voronoi(80, 80, 20, seed)
    one = smooth_boundaries(boundary(labels), SmoothingOptions(4.0))
    made = smooth_boundaries(boundary(zoomed(labels, times), times), SmoothingOptions(4.0 * times))
    assert made.n_chains == one.n_chains
    assert len(made.points) == pytest.approx(len(one.points), rel=0.03)  # some choices all but tie
    length = [np.hypot(*(g.points[g.segments[:, 1]] - g.points[g.segments[:, 0]]).T).sum() for g in (made, one)]
    assert length[0] / times == pytest.approx(length[1], rel=2e-4)
    assert np.allclose(made.region_pixels, one.region_pixels * times**2, atol=0.5)


def test_a_cropped_zoom_keeps_what_is_seen_of_its_outer_data_points() -> None:
    chains = pixel_chains(boundary(zoomed(GRAINS, 3.3)[4:, 2:], 3.3))
    moved, step = unrounded(chains, find_step(chains.graph))
    made = in_data_points(moved, step).graph
    assert step == pytest.approx((3.3, 3.3), rel=1e-3)
    assert made.shape[1] == pytest.approx(80 - 2 / 3.3, abs=0.1)
    x = made.points[(made.points[:, 0] > 0) & (made.points[:, 0] < made.shape[1]), 0]
    off = (2.0 * (x + 2 / 3.3) + 0.5) % 1.0 - 0.5  # from halves of data points
    assert np.mean(np.abs(off) < 0.2) > 0.95  # but for those on the border


@pytest.mark.parametrize("step", [(2.5, 2.5), (3.0, 3.0)])
def test_sides_that_are_none_of_data_points_stay(step: tuple[float, float]) -> None:
    chains = pixel_chains(boundary(GRAINS))
    moved, same = unrounded(chains, step)
    assert same == step
    assert np.array_equal(moved.graph.points, chains.graph.points)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("times", [1.5, 1.6, 1.7, 1.9])
def test_data_points_of_one_and_two_pixels_are_seen_by_the_sides_that_are_missing(times: float, way: str) -> None:
    assert find_step(boundary(zoomed(GRAINS, times, way))) == pytest.approx((times, times), rel=3e-3)


@pytest.mark.parametrize("seed", range(20))
def test_pixels_are_no_narrow_data_points(seed: int) -> None:
    assert find_step(boundary(voronoi(90, 90, 12 + 2 * seed, seed))) == (1.0, 1.0)
