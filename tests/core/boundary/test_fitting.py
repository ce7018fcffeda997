"""Local fits beside NumPy's least squares; lines stay, circles come out round."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.arrays import Floats
from imgquad_core.boundary.curves import curves_of
from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.boundary.fitting import WINDOWS, fit_pieces
from support.labels import disc, label_image


def arc_of(points: Floats) -> Floats:
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])


def fitted(points: Floats, weight: Floats, windows: tuple[float, ...] = WINDOWS, closed: bool = False) -> Floats:
    piece = np.array([[0, len(points) - 1]])
    return fit_pieces(
        points, arc_of(points), weight, np.ones(len(points)), piece, np.array([closed]), np.array(windows)
    )


def quadratic_value(points: Floats, weight: Floats, i: int, w: float) -> Floats:
    """Value at point i of the weighted quadratics of the arc, by `np.polyfit`."""
    u = arc_of(points) - arc_of(points)[i]
    near = np.abs(u) <= w
    bell = (1 - 0.47 * (u[near] / w) ** 2) ** 2 * weight[near]
    return np.array([np.polyfit(u[near], points[near, k], 2, w=np.sqrt(bell))[2] for k in (0, 1)])


@pytest.mark.parametrize("window", [3.0, 6.5])
@pytest.mark.parametrize("seed", range(3))
def test_inside_a_piece_points_go_to_the_values_of_weighted_quadratics(seed: int, window: float) -> None:
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 2, 61)
    points = np.stack([15 * np.cos(t), 12 * np.sin(t)], axis=1) + rng.normal(0, 0.1, (61, 2))
    weight = rng.uniform(0.5, 9.0, 61)
    found = fitted(points, weight, (window,))
    arc = arc_of(points)
    inside = np.flatnonzero((arc > window) & (arc < arc[-1] - window))
    assert len(inside) > 15
    for i in inside:
        assert found[i] == pytest.approx(quadratic_value(points, weight, i, window), abs=1e-9)
    assert np.array_equal(found[[0, -1]], points[[0, -1]])


@pytest.mark.parametrize("degrees", [0.0, 33.0, 90.0, 151.0])
def test_points_on_a_line_stay_whatever_its_direction(degrees: float) -> None:
    s = np.sort(np.random.default_rng(1).random(200)) * 150
    points = 9.0 + s[:, None] * [np.cos(np.radians(degrees)), np.sin(np.radians(degrees))]
    assert fitted(points, np.ones(200)) == pytest.approx(points, abs=1e-9)


def test_a_window_is_no_wider_than_its_residual_allows() -> None:
    # a wave of 16 px that 14 px windows would flatten
    x = np.arange(0.0, 120.0, 0.5)
    points = np.stack([x, 1.5 * np.sin(2 * np.pi * x / 16)], axis=1)
    kept, flat = fitted(points, np.ones(len(x))), fitted(points, np.ones(len(x)), (20.0,))
    middle = (x > 30) & (x < 90)
    assert np.abs(kept - points)[middle].max() < 0.5
    assert np.abs(flat - points)[middle].max() > 1.0


def test_a_circle_of_pixels_comes_out_round() -> None:
    centre = np.array([60.3, 59.8])
    curves, _ = curves_of(extract_boundaries(label_image(disc(40.0, (60.3, 59.8), 120))))
    c = int(np.flatnonzero(curves.ends[:, 0] < 0)[0])
    mine = slice(curves.offsets[c], curves.offsets[c + 1])
    found = fitted(curves.raw[mine], curves.weight[mine], closed=True)
    before, after = (np.hypot(*(p - centre).T) - 40.0 for p in (curves.raw[mine], found))
    assert np.sqrt((after**2).mean()) < 0.08 < 0.25 * np.sqrt((before**2).mean()) + 0.08
    assert np.abs(after).max() < 0.25
    assert np.array_equal(found[0], found[-1])


def test_a_loop_comes_out_alike_wherever_it_begins() -> None:
    rng, every, n_loops = np.random.default_rng(0), 4, 0  # windows are chosen at every fourth point
    for _ in range(40):
        centre, radius = tuple(50 + rng.random(2)), rng.uniform(8, 42)
        found, _ = curves_of(extract_boundaries(label_image(disc(radius, centre, 101))))
        c = int(np.flatnonzero(found.ends[:, 0] < 0)[0])
        loop = found.raw[found.offsets[c] : found.offsets[c + 1]]
        if (len(loop) - 1) % every:
            continue
        n_loops += 1
        one = fitted(loop, np.ones(len(loop)), closed=True)
        for by in range(every, len(loop) - 1, 13 * every):
            other = fitted(np.vstack([loop[by:-1], loop[: by + 1]]), np.ones(len(loop)), closed=True)
            assert other == pytest.approx(np.vstack([one[by:-1], one[: by + 1]]), abs=1e-6)  # 0.08 where seams tell
    assert n_loops > 20


def test_a_loop_of_a_few_points_and_points_on_no_piece_stay() -> None:
    t = np.linspace(0, 2 * np.pi, 10)
    loop = np.stack([np.cos(t), np.sin(t)], axis=1)
    loop[-1] = loop[0]
    assert np.array_equal(fitted(loop, np.ones(10), closed=True), loop)
    points = np.random.default_rng(0).random((40, 2)) * 30
    none = fit_pieces(
        points,
        arc_of(points),
        np.ones(40),
        np.ones(40),
        np.empty((0, 2), np.int64),
        np.empty(0, bool),
        np.array(WINDOWS),
    )
    assert np.array_equal(none, points)
