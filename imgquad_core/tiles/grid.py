"""The grid of tiles."""

from __future__ import annotations

from typing import NamedTuple

from imgquad_core.errors import InputError

Box = tuple[int, int, int, int]
CONTEXT = 128  #: px around all that a tile meshes, beyond which nothing moves its boundaries by more than some .05 px
BAND = 22  #: quads on each side of a seam that are cleaned up after it is gone
CLEAR = 26  #: edges that the bands of seams stay away from the corners of tiles
CORNER = 33  #: edges around the corner of a tile within which its own band takes the rest of the seams
REACH = 16  #: edges that the route between two tiles may leave their line by


class Grid(NamedTuple):
    """Tiles from the upper left corner of a picture; the last ones are smaller. Tiles are numbered row by row."""

    shape: tuple[int, int]  #: (n_rows, n_cols) of the picture
    tile: int  #: px
    keep: int  #: px; regions in a box of that side stay whole
    reach: int = 0  #: px that routes between tiles may leave their lines by

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
        return self.clipped((left, upper, left + self.tile, upper + self.tile), around)

    def clipped(self, box: Box, around: int = 0) -> Box:
        """Return the part of a box, and of so many pixels around it, within the picture."""
        left, upper, right, lower = box
        found = common((left - around, upper - around, right + around, lower + around), (0, 0, *self.shape[::-1]))
        assert found is not None
        return found

    def window(self, faces: Box) -> Box:
        """Return what a tile must see to know all boundaries around faces within a box."""
        return self.clipped(faces, CONTEXT)

    def next_to(self, t: int, axis: int) -> int:
        """Return the tile below (axis 0) or to the right (1) of a tile; it must be there."""
        return t + (self.across, 1)[axis]

    def meets_others(self, t: int, axis: int) -> tuple[bool, bool]:
        """Tell whether there are tiles above and below (axis 0) or to the left and to the right (1) of a tile."""
        place, last = self.place(t)[axis], (self.down, self.across)[axis] - 1
        return place > 0, place < last

    def corridor(self, t: int, axis: int) -> Box | None:
        """Return where the route from a tile to the one `next_to` it runs; None if there is no such tile."""
        if not self.meets_others(t, axis)[1]:
            return None
        own, other = self.box(t), self.box(self.next_to(t, axis))
        back, ahead = (min(self.reach, (box[3 - axis] - box[1 - axis]) // 2) for box in (own, other))
        line = other[1 - axis]
        if axis == 0:
            return own[0], line - back, own[2], line + ahead
        return line - back, own[1], line + ahead, own[3]

    def seen_by(self, t: int) -> list[int]:
        """Return the tiles in whose pixels a tile may have faces, or see what bounds them."""
        return self.tiles_in(self.box(t, max(self.keep, self.reach) + CONTEXT + self.reach))

    def tiles_in(self, box: Box) -> list[int]:
        """Return the tiles that a box touches, in their order."""
        left, upper, right, lower = box
        rows = range(upper // self.tile, -(-lower // self.tile))
        return [r * self.across + c for r in rows for c in range(left // self.tile, -(-right // self.tile))]

    def around(self, t: int) -> list[int]:
        """Return the tiles that touch a tile, at a corner at least, and itself, in their order."""
        return self.tiles_in(self.box(t, 1))


def common(one: Box, other: Box | None) -> Box | None:
    """Return what two boxes have in common, None if that is nothing."""
    if other is None:
        return None
    left, upper, right, lower = *map(max, one[:2], other[:2]), *map(min, one[2:], other[2:])
    return (left, upper, right, lower) if left < right and upper < lower else None


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
    return Grid(shape, tile, keep, int(REACH * size))


def least_tile(keep: int, size: float) -> int:
    """Return the least side of tiles: bands of one round must not meet, nor faces of tiles that are not neighbours."""
    return max(int(2 * (BAND + CORNER) * size) + 1, 2 * keep + 1)
