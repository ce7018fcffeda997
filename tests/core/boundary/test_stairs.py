"""Data points wider than a pixel: seen where there are stairs of them only, and smoothed as pixels are."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from imgquad_core.boundary.curves import pixel_chains
from imgquad_core.boundary.extraction import ExtractionOptions, extract_boundaries
from imgquad_core.boundary.options import SmoothingOptions
from imgquad_core.boundary.smoothing import smooth_boundaries
from imgquad_core.boundary.stairs import as_step, find_step, in_data_points
from support.labels import disc, label_image, voronoi

Labels = NDArray[np.int32]


def enlarged(labels: Labels, width: int, height: int) -> Labels:
    return np.repeat(np.repeat(labels, height, axis=0), width, axis=1)


def zoomed(labels: Labels, times: float) -> Labels:
    """Nearest data point of each pixel."""
    at = [np.floor((np.arange(int(n * times)) + 0.5) / times).astype(int) for n in labels.shape]
    return labels[np.ix_(*at)]


def hexagons(width: int, n: int = 60) -> Labels:
    """Grains on data points in rows that are half a data point apart."""
    seeds = np.random.default_rng(0).uniform(0, n, (25, 2))
    row, column = np.mgrid[-1 : n + 2, -1 : n + 2]
    centres = np.stack([column + 0.5 * (row % 2) + 0.5, row + 0.5], axis=-1).reshape(-1, 2)
    grain = np.hypot(centres[:, None, 0] - seeds[:, 0], centres[:, None, 1] - seeds[:, 1]).argmin(axis=1)
    y, x = np.mgrid[: int(n * width * 0.866), : n * width] + 0.5
    points = np.stack([x.ravel() / width, y.ravel() / width / 0.866], axis=1)
    place = centres * [1, 0.866]
    return grain[cKDTree(place).query(points * [1, 0.866])[1]].reshape(x.shape).astype(np.int32)


def seen(labels: Labels) -> tuple[float, float]:
    return find_step(extract_boundaries(label_image(labels)))


GRAINS = voronoi(60, 60, 20, 3)


@pytest.mark.parametrize(("width", "height"), [(2, 2), (3, 3), (6, 6), (3, 2)])
@pytest.mark.parametrize("cropped", [0, 1])
def test_enlarged_pictures_are_seen(width: int, height: int, cropped: int) -> None:
    assert seen(enlarged(GRAINS, width, height)[cropped:, cropped:]) == (width, height)


@pytest.mark.parametrize("times", [2.5, 3.3])
def test_a_zoom_that_is_no_whole_number_is_seen(times: float) -> None:
    assert seen(zoomed(voronoi(100, 100, 30, 3), times)) == pytest.approx((times, times), rel=3e-3)


@pytest.mark.parametrize("width", [4, 6, 8])
def test_hexagons_are_seen(width: int) -> None:
    assert seen(hexagons(width)) == pytest.approx((width, width), rel=5e-3)


def layout() -> Labels:
    """Rectangles on a raster of five pixels: no stairs."""
    rng = np.random.default_rng(0)
    labels = np.zeros((200, 200), np.int32)
    for k in range(60):
        (i, j), (height, width) = rng.integers(0, 36, 2) * 5, rng.integers(1, 6, 2) * 5
        labels[i : i + height, j : j + width] = k % 4
    return labels


ROW, COLUMN = np.mgrid[:80, :80]


@pytest.mark.parametrize(
    "labels",
    [
        GRAINS,
        disc(30.0, (40, 40), 80),
        (ROW // 4 + COLUMN // 4) % 2,
        (COLUMN + ROW // 5 % 2 * 5) // 10 + ROW // 5 * 3,
        layout(),
        np.random.default_rng(1).integers(0, 3, (60, 60)),
        np.zeros((5, 5), int),
    ],
    ids=["grains", "disc", "chessboard", "bricks", "rectangles", "noise", "one colour"],
)
def test_no_false_alarm(labels: Labels) -> None:
    assert seen(labels) == (1.0, 1.0)


@pytest.mark.parametrize("times", [2, 3, 6])
def test_an_enlarged_picture_comes_back_in_data_points(times: int) -> None:
    raw = extract_boundaries(label_image(GRAINS))
    large = extract_boundaries(label_image(enlarged(GRAINS, times, times)), ExtractionOptions(step=times))
    made = in_data_points(pixel_chains(large), (float(times), float(times)))
    assert np.array_equal(made.side, pixel_chains(raw).side)
    assert np.array_equal(made.graph.chain_points, raw.chain_points)
    assert np.allclose(made.graph.points, raw.points, atol=1e-12)
    assert made.graph.shape == raw.shape


@pytest.mark.parametrize("times", [2, 3])
def test_it_is_smoothed_as_the_picture_itself(times: int) -> None:
    one = smooth_boundaries(extract_boundaries(label_image(GRAINS)), SmoothingOptions(4.0))
    large = extract_boundaries(label_image(enlarged(GRAINS, times, times)), ExtractionOptions(step=times))
    made = smooth_boundaries(large, SmoothingOptions(4.0 * times))
    assert made.shape == (60 * times, 60 * times)
    assert np.array_equal(made.chain_points, one.chain_points)
    assert np.allclose(made.points / times, one.points, atol=1e-3)
    kept = smooth_boundaries(large, SmoothingOptions(4.0 * times, step=1.0))
    assert len(kept.points) > 1.3 * len(made.points)


def test_a_disc_of_wide_data_points_is_round() -> None:
    labels = enlarged(disc(21.0, (30.3, 29.8), 60), 4, 4)
    made = smooth_boundaries(extract_boundaries(label_image(labels)), SmoothingOptions(12.0))
    chain = np.repeat(np.arange(made.n_chains), np.diff(made.chain_offsets) - 1)
    ends = made.points[made.segments[(made.chain_regions[chain] >= 0).all(axis=1)]]
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T).sum()
    assert length == pytest.approx(2 * np.pi * 21.0 * 4, rel=0.01)
    off = np.hypot(*(ends.mean(axis=1) / 4 - [30.3, 29.8]).T) - 21.0
    assert np.sqrt((off**2).mean()) < 0.12


@pytest.mark.parametrize("turns", range(4))
def test_no_bend_is_cut_beyond_what_lies_behind_it(turns: int) -> None:
    labels = np.zeros((50, 50), np.int32)
    labels[10:40, 10:40] = 1
    labels[11, 11] = 2  # behind one corner; a closed chain begins at one of the four
    chains = pixel_chains(extract_boundaries(label_image(np.rot90(labels, turns).copy())))
    drawn = in_data_points(chains, (10.0, 10.0)).graph
    block = np.flatnonzero(
        (np.sort(chains.graph.region_label[chains.graph.chain_regions], axis=1) == (0, 1)).all(axis=1)
    )
    number = np.diff(drawn.chain_offsets)[block], np.diff(chains.graph.chain_offsets)[block]
    assert len(block) == 1
    assert np.array_equal(*number)  # it keeps its pixels


def test_one_number_is_both_sides() -> None:
    assert as_step(3) == (3.0, 3.0)
    assert as_step((3, 2.5)) == (3.0, 2.5)


def test_a_few_rectangles_are_no_hexagons() -> None:
    labels = np.zeros((24, 30), np.int32)
    labels[6:18, 8:20] = 3
    labels[1:5, 1:6] = 5
    assert find_step(extract_boundaries(label_image(labels))) == (1.0, 1.0)
