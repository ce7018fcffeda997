"""The grid of tiles."""

from __future__ import annotations

from typing import NamedTuple

from imgquad_core.errors import InputError

Box = tuple[int, int, int, int]
CONTEXT = 128  #: px around all that a tile meshes, beyond which nothing moves its boundaries by more than some .05 px
BAND = 22  #: quads on each side of a seam that are cleaned up after it is gone
CLEAR = 26  #: edges that the bands of seams stay away from the corners of tiles
CORNER = 33  #: edges around the corner of a tile within which its own band takes the rest of the seams


class Grid(NamedTuple):
    """Tiles from the upper left corner of a picture; the last ones are smaller. Tiles are numbered row by row."""

    shape: tuple[int, int]  #: (n_rows, n_cols) of the picture
    tile: int  #: px
    keep: int  #: px; regions in a box of that side stay whole

    @property
    def across(self) -> int:
        """Number of tiles in a row."""
        return -(-self.shape[1] // self.tile)

    @property
    def down(self) -> int:
        """Number of tiles in a column."""
        return -(-self.shape[0] // self.tile)

    @property
    def n_tiles(self) -> int:
        """Number of tiles."""
        return self.across * self.down

    def place(self, t: int) -> tuple[int, int]:
        """Return row and column of a tile."""
        return t // self.across, t % self.across

    def box(self, t: int, around: int = 0) -> Box:
        """Return left, upper, right, lower bound of a tile and of so many pixels around it."""
        row, column = self.place(t)
        left, upper = column * self.tile, row * self.tile
        return self.clipped((left - around, upper - around, left + self.tile + around, upper + self.tile + around))

    def clipped(self, box: Box) -> Box:
        """Return the part of a box within the picture."""
        left, upper, right, lower = box
        return max(left, 0), max(upper, 0), min(right, self.shape[1]), min(lower, self.shape[0])

    def window(self, faces: Box) -> Box:
        """Return what a tile must see to know all boundaries around faces within a box."""
        left, upper, right, lower = faces
        return self.clipped((left - CONTEXT, upper - CONTEXT, right + CONTEXT, lower + CONTEXT))

    def tiles_in(self, box: Box) -> list[int]:
        """Return the tiles that a box touches, in their order."""
        left, upper, right, lower = box
        rows = range(upper // self.tile, -(-lower // self.tile))
        return [r * self.across + c for r in rows for c in range(left // self.tile, -(-right // self.tile))]

    def around(self, t: int) -> list[int]:
        """Return the tiles that touch a tile, at a corner at least, and itself, in their order."""
        return self.tiles_in(self.box(t, 1))


def grid_of(shape: tuple[int, int], tile: int, keep: int, size: float) -> Grid:
    """Return the grid of tiles, or raise where tiles are too small for their seams.

    Parameters
    ----------
    shape : tuple of int
        (n_rows, n_cols) of the picture.
    tile, keep : int
        Side of a tile, and of the box in which regions stay whole, px.
    size : float
        Largest edge length, px.
    """
    least = least_tile(keep, size)
    if tile < least:
        raise InputError(f"tile is {tile}: elements of {size:g} px and keep-whole = {keep} need {least} or more")
    if keep < 0:
        raise InputError(f"keep-whole is {keep}: give 0 or more pixels")
    return Grid(shape, tile, keep)


def least_tile(keep: int, size: float) -> int:
    """Return the least side of tiles: bands of one round must not meet, nor faces of tiles that are not neighbours."""
    return max(int(2 * (BAND + CORNER) * size) + 1, 2 * keep + 1)
