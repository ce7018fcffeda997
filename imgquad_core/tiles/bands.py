"""Bands across former seams: the clean-up of irregular nodes and quality that the seam has kept apart.

    |-- held --|-- 14 quads --|-- 8: seeds --| seam |-- 8: seeds --|-- 14 quads --|-- held --|

The quads of one region on both sides are put together, the seam's nodes are free like others, and cavities around
irregular nodes near it are filled anew. Real boundaries and the rims of the band stay to the bit. Three rounds, so that
no quad is in two bands at once: seams from top to bottom, seams from left to right, corners of tiles.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.cleanup.areas import Area, cleaned
from imgquad_core.cleanup.options import CleanUp
from imgquad_core.cleanup.strips import nodes_around

from .grid import BAND, CLEAR, CORNER, Grid
from .meshes import Patch, TileMesh, joined_meshes, part_of

SEEDS = 8  #: quads from the seam within which irregular nodes are looked at
PASSES = (CleanUp((40, 160, 600), 1.0, 0.6, 600), CleanUp((40, 160, 600, 1200), 1.0, 0.6, 600))
ROUNDS = ("down", "across", "corner")


def groups_of(grid: Grid, kind: str) -> list[tuple[int, ...]]:
    """Return the tiles that each band of a round lies in, in their order: two, or four around a corner."""
    found: list[tuple[int, ...]] = []
    for t in range(grid.n_tiles):
        row, column = grid.place(t)
        to_right, below = column + 1 < grid.across, row + 1 < grid.down
        if kind == "down" and to_right:
            found.append((t, t + 1))
        if kind == "across" and below:
            found.append((t, t + grid.across))
        if kind == "corner" and to_right and below:
            found.append((t, t + 1, t + grid.across, t + grid.across + 1))
    return found


def seam_places(grid: Grid, kind: str, group: tuple[int, ...], size: float) -> Callable[[Floats], Flags]:
    """Return what tells the places whose seams a band takes: away from corners of tiles, or near one."""
    row, column = grid.place(group[-1])
    line, level = column * grid.tile, grid.shape[0] - row * grid.tile  # x and y of the lines that meet
    near, far = CORNER * size, CLEAR * size
    n_rows, n_cols = grid.shape

    def along(values: Floats, last: int, flip: bool) -> Flags:
        """Tell what is away from the lines across a seam; the picture's own borders are no such lines."""
        v = n_rows - values if flip else values
        nearest = np.rint(v / grid.tile) * grid.tile
        return np.asarray((np.abs(v - nearest) >= far) | (nearest <= 0) | (nearest >= last))

    def tell(points: Floats) -> Flags:
        x, y = points.T
        if kind == "corner":
            return np.asarray((np.abs(x - line) <= near) & (np.abs(y - level) <= near))
        if kind == "down":
            return np.asarray((np.abs(x - line) <= near) & along(y, n_rows, True))
        return np.asarray((np.abs(y - level) <= near) & along(x, n_cols, False))

    return tell


def cleaned_band(
    grid: Grid, group: tuple[int, ...], meshes: list[TileMesh], is_place: Callable[[Floats], Flags]
) -> list[Patch]:
    """Clean up across the seams of some tiles; return what is new in each.

    Parameters
    ----------
    grid : Grid
        The tiles.
    group : tuple of int
        Their numbers.
    meshes : list of TileMesh
        As they are now.
    is_place : callable
        Tells the places whose seams count.
    """
    near = [nodes_around(mesh.quads, mesh.seam & is_place(mesh.points), BAND + 1) for mesh in meshes]
    beside_seams = [flags[mesh.quads].any(axis=1) for flags, mesh in zip(near, meshes, strict=True)]
    whole, tile = joined_meshes([part_of(mesh, which) for mesh, which in zip(meshes, beside_seams, strict=True)])
    place = np.concatenate([np.flatnonzero(which) for which in beside_seams])
    shared = _in_several(whole.quads, np.repeat(tile[:, None], 4, axis=1), len(whole.points))
    seam = whole.seam & shared & is_place(whole.points)
    if not seam.any():
        return [_nothing()] * len(group)
    _, region = np.unique(whole.region, return_inverse=True)
    beside = _in_several(region.ravel(), tile, int(region.max()) + 1)[region.ravel()]
    quads = np.flatnonzero(beside & nodes_around(whole.quads, seam, BAND - 1)[whole.quads].any(axis=1))
    area = Area(whole.points, whole.quads, whole.region)
    points, corners, region = cleaned(area, quads, nodes_around(whole.quads, seam, SEEDS), PASSES)
    centre = points[corners].mean(axis=1)
    column, row = centre[:, 0] // grid.tile, (grid.shape[0] - centre[:, 1]) // grid.tile
    owner = (row * grid.across + column).astype(np.int64)
    owner = np.where(np.isin(owner, group), owner, group[0])
    patches = []
    for k, t in enumerate(group):
        used, at = np.unique(corners[owner == t], return_inverse=True)
        gone = place[quads[tile[quads] == k]]
        patches.append(Patch(gone, points[used], at.reshape(-1, 4).astype(np.int64), region[owner == t]))
    return patches


def _nothing() -> Patch:
    none = np.empty(0, np.int64)
    return Patch(none, np.empty((0, 2)), none.reshape(0, 4), none)


def _in_several(what: Ints, tile: Ints, n: int) -> Flags:
    """Tell which of n things occur in several tiles."""
    n_tiles = int(tile.max(initial=0)) + 1
    return np.bincount(np.unique(what * n_tiles + tile) // n_tiles, minlength=n) > 1
