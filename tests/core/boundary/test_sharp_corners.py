"""Sharp corners of chains: found where two straight sides meet, placed there, nowhere on a circle."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.boundary.curves import Curves, curves_of
from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.boundary.sharp_corners import beside_corners, find_corners, place_corners
from support.labels import Labels, disc, label_image, square


def curves(labels: Labels) -> Curves:
    return curves_of(extract_boundaries(label_image(labels)))[0]


@pytest.mark.parametrize("degrees", [0.0, 17.0, 40.0])
def test_a_square_has_four_corners_that_go_to_their_places(degrees: float) -> None:
    labels, true = square(34.0, degrees, (32.3, 31.8), 64)
    found, is_corner = find_corners(curves(labels))
    c = int(np.flatnonzero(found.ends[:, 0] < 0)[0])
    first, last = found.offsets[c], found.offsets[c + 1] - 1
    assert is_corner[first]
    assert is_corner[last]
    at = np.flatnonzero(is_corner)
    assert ((at >= first) & (at <= last)).all()
    assert len(at) == 5  # the chain starts at one, and ends there
    points = found.raw.copy()
    place_corners(found, is_corner, np.full(len(points), 2.0), points)
    off = np.hypot(*(points[at[:4]][:, None] - true).transpose(2, 0, 1))
    before = np.hypot(*(found.raw[at[:4]][:, None] - true).transpose(2, 0, 1)).min(axis=0)
    assert sorted(off.argmin(axis=1).tolist()) == [0, 1, 2, 3]
    assert off.min(axis=0).max() < 0.75
    assert off.min(axis=0).mean() < before.mean()
    assert np.array_equal(points[~is_corner], found.raw[~is_corner])


@pytest.mark.parametrize("room", [0.0, 0.1])
def test_a_corner_goes_no_farther_than_its_room(room: float) -> None:
    found, is_corner = find_corners(curves(square(34.0, 17.0, (32.3, 31.8), 64)[0]))
    points = found.raw.copy()
    place_corners(found, is_corner, np.full(len(points), room), points)
    gone = np.hypot(*(points - found.raw)[is_corner].T)
    assert gone.max() == pytest.approx(room, abs=1e-12)


@pytest.mark.parametrize("radius", [9.0, 15.0, 25.0])
def test_a_circle_has_no_corner(radius: float) -> None:
    before = curves(disc(radius, (30.2, 29.6), 60))
    found, is_corner = find_corners(before)
    assert not is_corner.any()
    assert np.array_equal(found.raw, before.raw)


@pytest.mark.parametrize("radius", np.arange(5.0, 12.5, 0.5))
def test_no_disc_has_a_corner_wherever_it_lies(radius: float) -> None:
    centres = np.random.default_rng(0).random((60, 2)) + 20.0
    found = [find_corners(curves(disc(radius, (x, y), 42)))[1].sum() for x, y in centres]
    assert not any(found)


@pytest.mark.parametrize("side", [9.0, 12.0, 17.0, 25.0])
def test_squares_keep_their_corners_wherever_they_lie(side: float) -> None:
    rng = np.random.default_rng(1)
    found = [
        find_corners(curves(square(side, rng.uniform(0, 90), tuple(rng.random(2) + 25), 50)[0]))[1].sum()
        for _ in range(25)
    ]
    assert np.mean(np.array(found) == 5) >= 0.9  # four, and the first again at the end of the chain


def test_the_rounded_tip_of_a_line_is_no_corner() -> None:
    labels = np.zeros((30, 60), np.int32)
    labels[14:16, 10:50] = 1
    assert not find_corners(curves(labels))[1].any()


def test_points_within_a_sides_length_of_a_corner_know_it() -> None:
    found, is_corner = find_corners(curves(square(34.0, 17.0, (32.3, 31.8), 64)[0]))
    corner = beside_corners(found, is_corner)
    c = int(np.flatnonzero(found.ends[:, 0] < 0)[0])
    first, last = found.offsets[c], found.offsets[c + 1] - 1
    length = found.arc[last]
    for i in range(first, last):
        way = np.abs(found.arc[is_corner] - found.arc[i])
        way = np.minimum(way, length - way)
        nearest = np.flatnonzero(is_corner)[way.argmin()]
        if way.min() < 5.0:
            assert found.raw[corner[i]].tolist() == found.raw[nearest].tolist()
        elif way.min() > 7.0:
            assert corner[i] == -1
