"""Wanted edge lengths: graded along chains, round their ends and through the plane, and bent curves finer."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.arrays import Floats
from imgquad_core.boundary.curves import Curves, arc_lengths, curves_of
from imgquad_core.boundary.edge_sizes import _grade_plane, edge_sizes, grade_along, grade_chains
from imgquad_core.boundary.extraction import extract_boundaries
from support.labels import label_image, voronoi


def along(values: Floats, arc: Floats, closed: bool, slope: float) -> Floats:
    """Least over all points of the chain of their value plus `slope` times the way to them."""
    way = np.abs(arc[:, None] - arc)
    if closed:
        way = np.minimum(way, arc[-1] - way)
    return np.asarray((values + slope * way).min(axis=1))


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_grading_along_chains_is_the_least_over_all_points(seed: int, closed: bool) -> None:
    rng = np.random.default_rng(seed)
    offsets = np.array([0, 30, 37])
    arc = np.concatenate([np.cumsum(rng.random(n)) for n in (30, 7)])
    arc -= arc[np.repeat(offsets[:-1], [30, 7])]
    values = rng.random(37) * 8
    ends = np.full((2, 2), -1) if closed else np.array([[0, 1], [1, 2]])
    found = grade_along(values, arc, offsets, ends, 0.4)
    for first, last in ((0, 30), (30, 37)):
        assert np.allclose(found[first:last], along(values[first:last], arc[first:last], closed, 0.4), rtol=1e-12)


def test_a_fine_place_reaches_past_two_ends_of_chains() -> None:
    curves, ends = curves_of(extract_boundaries(label_image(voronoi(40, 50, 9, 4))))
    size = np.full(len(curves.raw), 5.0)
    c = int(np.flatnonzero((curves.ends[:, 0] >= 0) & ~curves.is_frame)[0])
    size[curves.offsets[c] + 1] = 0.5
    graded = grade_chains(size, curves, len(ends.place), 1.2)
    first, last = curves.offsets[:-1], curves.offsets[1:] - 1
    for node in curves.ends[c]:
        at_node = np.r_[graded[first[curves.ends[:, 0] == node]], graded[last[curves.ends[:, 1] == node]]]
        assert np.ptp(at_node) == 0
    near = np.r_[graded[first[curves.ends[:, 0] == curves.ends[c, 0]]]]
    assert near.max() < 1.0
    steps = np.log(1.2) * np.diff(curves.arc)
    inside = np.ones(len(steps), bool)
    inside[last[:-1]] = False
    assert (np.abs(np.diff(graded))[inside] <= steps[inside] + 1e-12).all()


@pytest.mark.parametrize("seed", range(3))
def test_grading_through_the_plane_is_the_least_over_all_pixels(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.random((25, 2)) * [17, 11]
    size, slope = rng.random(25) * 6, 0.3
    found = _grade_plane(size, points, slope, np.full((11, 17), np.inf, np.float32))
    cell = np.floor(points)
    apart = np.abs(cell[:, None] - cell)
    way = apart.max(axis=2) - apart.min(axis=2) + np.sqrt(2.0) * apart.min(axis=2)  # king's moves
    assert np.allclose(found, np.minimum(size, (size + slope * way).min(axis=1)), rtol=1e-5)


def circle(radius: float) -> Curves:
    t = np.linspace(0, 2 * np.pi, int(12 * radius) + 1)
    raw = np.stack([40 + radius * np.cos(t), 40 + radius * np.sin(t)], axis=1)
    raw[-1] = raw[0]
    offsets = np.array([0, len(raw)])
    return Curves(
        raw,
        arc_lengths(raw, offsets),
        np.ones(len(raw)),
        offsets,
        np.array([[-1, -1]]),
        np.zeros(1, bool),
        np.ones(len(raw)),
    )


@pytest.mark.parametrize("radius", [4.0, 7.0, 20.0])
def test_edges_of_a_circle_turn_by_at_most_as_much_as_asked(radius: float) -> None:
    c = circle(radius)
    nowhere = np.zeros(len(c.raw), bool)
    size = edge_sizes(c.raw, c, np.full(len(c.raw), 6.0), nowhere, 1.3, 1.2, (80, 80))
    assert size == pytest.approx(np.full(len(size), min(6.0, 0.55 * radius)), rel=0.05)


def test_a_corner_is_no_bend() -> None:
    side = np.arange(0.0, 20.0, 0.5)
    raw = np.r_[
        np.stack([10 + side, np.full(40, 10.0)], axis=1), np.stack([np.full(41, 30.0), 10 + np.r_[side, 20]], axis=1)
    ]
    offsets = np.array([0, len(raw)])
    c = Curves(
        raw,
        arc_lengths(raw, offsets),
        np.ones(len(raw)),
        offsets,
        np.array([[0, 1]]),
        np.zeros(1, bool),
        np.ones(len(raw)),
    )
    sizes = [
        edge_sizes(raw, c, np.full(len(raw), 4.0), np.arange(len(raw)) == corner, 1.3, 1.2, (50, 50))
        for corner in (40, -1)
    ]
    assert (sizes[0] == 4.0).all()
    assert sizes[1].min() == pytest.approx(1.0)
