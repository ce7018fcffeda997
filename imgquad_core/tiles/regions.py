"""Regions of the whole picture, from what each tile sees of them: which stay whole, and whose they are.

A tile numbers the regions in its own pixels and one more row and column, which its neighbours number too. Where both
have the same pixel, both numbers are of one region::

        tile 0   | tile 1
      . . . . . .|x .            x: pixels of tile 1 and 2 that tile 0 numbers, too
      . . . . . .|x .
      -----------+----
      x x x x x x x              tile 2
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Flags, Ints, Labels
from imgquad_core.boundary import ExtractionOptions, label_regions
from imgquad_core.grouping import linked
from imgquad_core.model import VOID

from .grid import Box, Grid

STRIP = 256  #: rows that are looked at together
_FAR = np.iinfo(np.int64).max


class Table(NamedTuple):
    """The regions that a tile sees, without its plane."""

    above: Labels  #: ids in the first row
    beside: Labels  #: ids in the first column
    label: Labels  #: of each region
    pixels: Ints  #: of each region, those of the tile itself
    first: Ints  #: place of the first of them in the picture, counted row by row
    box: Ints  #: (n, 4) left, upper, right, lower bound of these
    below: Labels  #: ids in the row below the tile, one pixel more if there is a tile to the right
    right: Labels  #: ids in the column to the right


class TileRegions(NamedTuple):
    """The regions that a tile sees."""

    ids: Labels  #: (n_rows, n_cols) of the tile itself, -1 void
    table: Table


class Regions(NamedTuple):
    """All regions of the picture, in the order of their first pixels."""

    label: Labels
    pixels: Ints
    owner: Ints  #: tile of the first pixel
    is_cut: Flags  #: too large to stay whole: each tile has its own piece
    number: Ints  #: number of every tile's regions, tile by tile; -1 for those without own pixels
    offsets: Ints  #: (n_tiles + 1,) where a tile's begin
    reach: Ints  #: (n_tiles, 4) left, upper, right, lower bound of each tile's faces

    def box_of(self, t: int) -> Box:
        """Return the bounds of a tile and its faces."""
        left, upper, right, lower = self.reach[t].tolist()
        return left, upper, right, lower


def tile_regions(
    labels: Labels, window: Box, tile: Box, extended: Box, n_cols: int, options: ExtractionOptions
) -> TileRegions:
    """Number the regions of a tile.

    Parameters
    ----------
    labels : int32
        Labels of `window`.
    window, tile, extended : tuple of int
        Left, upper, right, lower bounds in the picture: `extended` is the tile with one more row and column where the
        picture goes on, the window has some more pixels around that, which say what is joined over corners.
    n_cols : int
        Of the picture.
    options : ExtractionOptions
        What is joined over corners.
    """
    left, upper = window[:2]
    inside = (extended[0] - left, extended[1] - upper, extended[2] - left, extended[3] - upper)
    ids = label_regions(labels, inside, options)
    height, width = tile[3] - tile[1], tile[2] - tile[0]
    own = np.ascontiguousarray(ids[:height, :width])
    seen = labels[inside[1] : inside[3], inside[0] : inside[2]]
    n = int(ids.max(initial=-1)) + 1
    label = np.full(n, VOID, np.int32)
    label[ids[ids >= 0]] = seen[ids >= 0]
    found = _Measured(np.zeros(n, np.int64), np.full(n, _FAR), np.tile([_FAR, _FAR, -1, -1], (n, 1)))
    for start in range(0, height, STRIP):
        _measure(own[start : start + STRIP], tile[0], tile[1] + start, n_cols, found)
    below = ids[height] if ids.shape[0] > height else np.empty(0, np.int32)
    right = ids[:height, width] if ids.shape[1] > width else np.empty(0, np.int32)
    return TileRegions(own, Table(own[0], own[:, 0], label, *found, below, right))


class _Measured(NamedTuple):
    pixels: Ints
    first: Ints
    box: Ints


def _measure(ids: Labels, left: int, upper: int, n_cols: int, found: _Measured) -> None:
    """Add what some rows have of each region, in place."""
    solid = np.flatnonzero(ids.ravel() >= 0)
    which, row, column = ids.ravel()[solid], solid // ids.shape[1] + upper, solid % ids.shape[1] + left
    found.pixels[:] += np.bincount(which, minlength=len(found.pixels))
    np.minimum.at(found.first, which, row * n_cols + column)
    for k, values in enumerate((column, row)):
        np.minimum.at(found.box[:, k], which, values)
        np.maximum.at(found.box[:, k + 2], which, values + 1)


def joined_regions(grid: Grid, tiles: list[Table]) -> Regions:
    """Put together what tiles see of the regions.

    Parameters
    ----------
    grid : Grid
        The tiles.
    tiles : list of Table
        In their order.
    """
    offsets = np.concatenate([[0], np.cumsum([len(tile.label) for tile in tiles])]).astype(np.int64)
    pairs = [_shared(grid, t, tiles, offsets) for t in range(grid.n_tiles)]
    a, b = np.concatenate(pairs, axis=1) if pairs else np.empty((2, 0), np.int64)
    of, n_sets = linked(a, b, int(offsets[-1]))

    def total(how: np.ufunc, name: str, start: int) -> NDArray[np.int64]:
        values = np.concatenate([getattr(tile, name) for tile in tiles])
        found = np.full((n_sets, *values.shape[1:]), start, np.int64)
        how.at(found, of, values)
        return found

    first, pixels = total(np.minimum, "first", _FAR), total(np.add, "pixels", 0)
    low, high = total(np.minimum, "box", _FAR)[:, :2], total(np.maximum, "box", -1)[:, 2:]
    label = np.full(n_sets, VOID, np.int32)
    label[of] = np.concatenate([tile.label for tile in tiles])
    order = np.argsort(first, kind="stable")[: np.count_nonzero(pixels)]  # those without pixels come last
    number = np.full(n_sets, -1, np.int64)
    number[order] = np.arange(len(order))
    low, high, first = low[order], high[order], first[order]
    is_large = (high - low > grid.keep).any(axis=1)
    in_tiles = (low // grid.tile != (high - 1) // grid.tile).any(axis=1)
    row, column = first // grid.shape[1] // grid.tile, first % grid.shape[1] // grid.tile
    own = np.concatenate([tile.pixels for tile in tiles]) > 0
    owner, is_cut = row * grid.across + column, is_large & in_tiles
    reach = np.array([grid.box(t, grid.reach) for t in range(grid.n_tiles)])
    np.minimum.at(reach[:, :2], owner[~is_cut], low[~is_cut])
    np.maximum.at(reach[:, 2:], owner[~is_cut], high[~is_cut])
    return Regions(label[order], pixels[order], owner, is_cut, np.where(own, number[of], -1), offsets, reach)


def _shared(grid: Grid, t: int, tiles: list[Table], offsets: Ints) -> NDArray[np.int64]:
    """Return pairs of numbers, in one row of all tiles' regions, that stand for the same pixel."""
    row, column = grid.place(t)
    found = [np.empty((2, 0), np.int64)]

    def add(mine: Labels, other: int, theirs: Labels) -> None:
        solid = mine >= 0
        pairs = np.stack([mine[solid] + offsets[t], theirs[solid] + offsets[other]])
        found.append(np.unique(pairs, axis=1))

    width = len(tiles[t].above)
    if row + 1 < grid.down:
        add(tiles[t].below[:width], t + grid.across, tiles[t + grid.across].above)
        if column + 1 < grid.across:
            add(tiles[t].below[width:], t + grid.across + 1, tiles[t + grid.across + 1].above[:1])
    if column + 1 < grid.across:
        add(tiles[t].right, t + 1, tiles[t + 1].beside)
    return np.concatenate(found, axis=1)


class Keys(NamedTuple):
    """The picture that faces are extracted from: each pixel has the key of its face."""

    pixels: Labels  #: (n_rows, n_cols) of a window, -1 void
    region: Ints  #: (n_keys,) number in `Regions`
    tile: Ints  #: (n_keys,) whose it is


class Part(NamedTuple):
    """What a window has of one tile, or which of that a route has given to another one."""

    tile: int
    place: tuple[slice, slice]  #: in the window
    ids: Labels  #: as the tile numbers its regions, -1 void
    owner: int  #: tile that pieces of cut regions are of
    where: Flags | None = None  #: the pixels that count, None for all


def keys_of(shape: tuple[int, int], parts: list[Part], grid: Grid, regions: Regions) -> Keys:
    """Return the keys of a window.

    Parameters
    ----------
    shape : tuple of int
        (n_rows, n_cols) of the window.
    parts : list of Part
        What it is made of: of several that have a pixel, the last one counts.
    grid, regions
        Of the picture.

    Notes
    -----
    Keys rise with the material, then with region and tile, in every window: so ambiguous corners are decided alike.
    """
    codes = [_codes(part, grid, regions) for part in parts]
    faces = np.unique(np.concatenate([np.empty(0, np.int64), *codes]))
    faces = faces[faces >= 0]
    region, tile = faces // grid.n_tiles, faces % grid.n_tiles
    order = np.lexsort((tile, region, regions.label[region]))
    key = np.empty(len(order) + 1, np.int32)
    key[order], key[-1] = np.arange(len(order)), VOID
    pixels = np.empty(shape, np.int32)
    for part, code in zip(parts, codes, strict=True):
        at = np.where(code >= 0, np.searchsorted(faces, code), len(faces))
        np.copyto(pixels[part.place], key[at][part.ids], where=True if part.where is None else part.where)
    return Keys(pixels, region[order], tile[order])


def _codes(part: Part, grid: Grid, regions: Regions) -> Ints:
    """Return for each number of a tile's regions, and at last for void, region and owner in one; -1 if not there."""
    number = regions.number[regions.offsets[part.tile] : regions.offsets[part.tile + 1]]
    ids = part.ids.ravel() if part.where is None else part.ids[part.where]
    there = np.bincount(ids + 1, minlength=len(number) + 1)[1:] > 0
    owner = np.where(regions.is_cut[number], part.owner, regions.owner[number])
    return np.append(np.where(there, number * grid.n_tiles + owner, -1), -1)
