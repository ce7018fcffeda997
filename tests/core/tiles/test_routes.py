"""Routes along which tiles part regions."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.tiles.grid import Grid, grid_of
from imgquad_core.tiles.regions import Part, Regions, keys_of
from imgquad_core.tiles.routes import Ends, side_of_route

SHAPE, LINE, SIZE = (120, 64), 32, 4.0
OPEN, BETWEEN = Ends(first=False, last=False), Ends(first=True, last=True)


def route(region: np.ndarray, ends: Ends = OPEN) -> np.ndarray:
    """Return the column of the route in each row; each row has one."""
    beyond = side_of_route(region.astype(np.int64), np.ones(3, bool), LINE, ends, SIZE)
    at = SHAPE[1] - beyond.sum(axis=1)
    assert np.array_equal(beyond, np.arange(SHAPE[1]) >= at[:, None])
    return np.asarray(at)


def test_it_is_the_line_where_nothing_is_near() -> None:
    assert set(route(np.zeros(SHAPE), BETWEEN)) == {LINE}


def test_it_follows_a_boundary_from_corner_to_corner_within_45_degrees() -> None:
    x = np.indices(SHAPE)[1]
    at = route(x >= 40, BETWEEN)
    assert set(at[12:-12]) == {40}
    assert (np.abs(at - LINE) <= np.minimum(np.arange(120) + 1, np.arange(120, 0, -1))).all()


def test_it_goes_round_what_lies_in_its_way() -> None:
    y, x = np.indices(SHAPE) + 0.5
    disc = np.hypot(x - LINE - 2, y - 60) < 12
    at = route(disc, BETWEEN)
    assert not runs_through(disc, at)


def runs_through(what: np.ndarray, at: np.ndarray) -> bool:
    """Whether a route has a side of a pixel inside."""
    row, column = np.arange(SHAPE[0]), np.clip(at, 1, SHAPE[1] - 1)
    return bool((what[row, column] & what[row, column - 1]).any())


def test_it_crosses_a_slanting_layer_at_a_right_angle() -> None:
    y, x = np.indices(SHAPE) + 0.5
    layer = np.abs(x - LINE - (y - 60)) < 14
    at = route(layer.astype(int))
    rows = np.flatnonzero(layer[np.arange(120), np.clip(at, 0, 63)] & layer[np.arange(120), np.clip(at - 1, 0, 63)])
    assert np.ptp(at[rows]) > 8  # it leaves the line to do so


def test_small_pieces_go_to_the_other_side() -> None:
    """A bump of a boundary that it follows, which no route of one column a row can go round."""
    region = np.zeros(SHAPE, int)
    region[:, 40:] = 1
    region[50:53, 34:40], region[53:58, 34:37] = 1, 1  # a hook, open below
    beyond = side_of_route(region.astype(np.int64), np.ones(2, bool), LINE, BETWEEN, SIZE)
    assert beyond[12:-12][region[12:-12] == 1].all()


@pytest.mark.parametrize("shape", [(500, 910), (448, 900), (910, 500)])
def test_corridors_lie_in_the_picture_and_meet_no_other(shape: tuple[int, int]) -> None:
    grid = grid_of(shape, 448, 100, 4.0)
    for t in range(grid.n_tiles):
        for axis in (0, 1):
            box = grid.corridor(t, axis)
            assert (box is None) == (not grid.meets_others(t, axis)[1])
            if box is not None:
                assert grid.clipped(box) == box
                assert box[2 + (1 - axis)] - box[1 - axis] <= 2 * grid.reach


def test_pixels_beyond_a_route_are_of_the_other_tile() -> None:
    """But those of regions that stay whole."""
    grid = Grid((4, 8), 4, 1, 2)
    cut = np.array([True, False])
    none = np.empty(0, np.int64)
    number, offsets = np.array([0, 1, 0]), np.array([0, 2, 3])
    regions = Regions(np.array([5, 7], np.int32), none, np.array([0, 0]), cut, number, offsets, none)
    ids = np.zeros((4, 4), np.int32)
    ids[0] = 1
    given = np.zeros((4, 2), bool)
    given[:2] = True
    right = np.s_[0:4, 2:4]
    parts = [
        Part(0, np.s_[0:4, 0:4], ids, 0),
        Part(1, np.s_[0:4, 4:8], np.zeros((4, 4), np.int32), 1),
        Part(0, right, ids[:, 2:], 1, given),
    ]
    keys = keys_of((4, 8), parts, grid, regions)
    owner = keys.tile[keys.pixels]
    assert np.array_equal(owner[:, 4:], np.ones((4, 4)))
    assert np.array_equal(owner[:, :4], [[0, 0, 0, 0], [0, 0, 1, 1], [0, 0, 0, 0], [0, 0, 0, 0]])
