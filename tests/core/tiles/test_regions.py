"""Regions of the whole picture, found tile by tile."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.arrays import Labels
from imgquad_core.boundary import ExtractionOptions, extract_boundaries
from imgquad_core.errors import InputError
from imgquad_core.model import VOID
from imgquad_core.tiles import Grid, grid_of
from imgquad_core.tiles.regions import Keys, Part, Regions, TileRegions, joined_regions, keys_of, tile_regions
from support.labels import label_image

OPTIONS = ExtractionOptions()


def regions_by_tiles(labels: Labels, grid: Grid) -> tuple[Regions, list[TileRegions]]:
    tiles = []
    for t in range(grid.n_tiles):
        box = grid.box(t)
        extended = grid.clipped((box[0], box[1], box[2] + 1, box[3] + 1))
        window = grid.clipped((extended[0] - 4, extended[1] - 4, extended[2] + 4, extended[3] + 4))
        part = labels[window[1] : window[3], window[0] : window[2]]
        tiles.append(tile_regions(part, window, box, extended, labels.shape[1], OPTIONS))
    return joined_regions(grid, [tile.table for tile in tiles]), tiles


def keys_in(box: tuple[int, int, int, int], grid: Grid, found: Regions, tiles: list[TileRegions]) -> Keys:
    parts = []
    for t in grid.tiles_in(box):
        left, upper, right, lower = grid.box(t)
        first, top, last, end = max(left, box[0]), max(upper, box[1]), min(right, box[2]), min(lower, box[3])
        place = np.s_[top - box[1] : end - box[1], first - box[0] : last - box[0]]
        parts.append(Part(t, place, tiles[t].ids[top - upper : end - upper, first - left : last - left], t))
    return keys_of((box[3] - box[1], box[2] - box[0]), parts, grid, found)


def whole_ids(grid: Grid, found: Regions, tiles: list[TileRegions]) -> np.ndarray:
    ids = np.full(grid.shape, -1, np.int64)
    for t, tile in enumerate(tiles):
        left, upper, right, lower = grid.box(t)
        number = np.append(found.number[found.offsets[t] : found.offsets[t + 1]], -1)
        ids[upper:lower, left:right] = number[tile.ids]
    return ids


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("shape", [(37, 53), (16, 33), (17, 16)])
def test_they_are_those_of_the_picture_as_a_whole(seed: int, shape: tuple[int, int]) -> None:
    """In number, order, material and pixels, corners that are joined included; the last tiles are one pixel wide."""
    rng = np.random.default_rng(seed)
    labels = rng.integers(-1, 3, shape).astype(np.int32)
    grid = Grid(shape, 16, 6)
    found, tiles = regions_by_tiles(labels, grid)
    whole = extract_boundaries(label_image(labels), OPTIONS)
    assert np.array_equal(found.label, whole.region_label)
    assert np.array_equal(found.pixels, whole.region_pixels)
    ids = whole_ids(grid, found, tiles)
    assert np.array_equal(ids < 0, labels == VOID)
    for region in range(len(found.label)):
        rows, columns = np.nonzero(ids == region)
        first = rows[0] // 16 * grid.across + columns[0] // 16
        assert found.owner[region] == first
        large = np.ptp(rows) >= 6 or np.ptp(columns) >= 6
        one_tile = len(np.unique(rows // 16 * 100 + columns // 16)) == 1
        assert found.is_cut[region] == (large and not one_tile)


def test_keys_are_alike_in_all_windows() -> None:
    rng = np.random.default_rng(5)
    labels = np.kron(rng.integers(0, 3, (10, 12)), np.ones((5, 5))).astype(np.int32)
    grid = Grid(labels.shape, 16, 6)
    found, tiles = regions_by_tiles(labels, grid)
    whole = keys_in((0, 0, 60, 50), grid, found, tiles)
    faces = list(zip(found.label[whole.region], whole.region, whole.tile, strict=True))
    assert faces == sorted(faces)  # they rise with the material
    assert np.array_equal(whole.region[whole.pixels], whole_ids(grid, found, tiles))
    row, column = np.indices(labels.shape) // 16
    cut = found.is_cut[whole.region[whole.pixels]]
    assert np.array_equal(whole.tile[whole.pixels][cut], (row * grid.across + column)[cut])
    part = np.s_[3:40, 9:50]
    window = keys_in((9, 3, 50, 40), grid, found, tiles)
    assert np.array_equal(window.region[window.pixels], whole.region[whole.pixels[part]])
    assert np.array_equal(window.tile[window.pixels], whole.tile[whole.pixels[part]])
    order = (np.argsort(keys.ravel(), kind="stable") for keys in (window.pixels, whole.pixels[part]))
    assert np.array_equal(*order)


def test_tiles_too_small_for_their_seams_are_refused() -> None:
    with pytest.raises(InputError, match=r"tile is 440: elements of 4 px and keep-whole = 100 need 441 or more"):
        grid_of((2000, 2000), 440, 100, 4.0)
    with pytest.raises(InputError, match="need 1001 or more"):
        grid_of((2000, 2000), 700, 500, 4.0)
