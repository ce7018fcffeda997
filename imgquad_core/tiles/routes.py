r"""Where two tiles part large regions: along boundaries that are there anyway, else far from what lies close.

A route runs along sides of pixels, in a corridor around the line of tiles. Each row of pixels has one place of it, and
it starts from the corner of tiles within 45 degrees of the line, so routes never cross::

    -----+-----       corner of tiles
        /|\
       / | \          the corridor
      |  |  |

A step on a boundary costs little, as does one in a region that stays whole; others cost more, the nearer a boundary is.
Pixels on one side of a route are of one tile, those on the other side of the other one. Of what it cuts off, small
pieces go to the other side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.grouping import linked
from imgquad_core.jit import kernel

CHEAP = 0.1  #: cost of a side of a pixel on a boundary; inside a region it is 1 or more
CLOSE, DECAY = 12.0, 2.0  #: what the place right beside a boundary costs more, and edges over which that falls to 1/e
SLANT = 0.5**0.5  #: cost of a step to the next row and column, over that of both sides of pixels
SMALL = 36.0  #: quads; smaller pieces go to the other side


class Ends(NamedTuple):
    """Whether a route begins, and ends, at a corner of tiles: else on the picture's border."""

    first: bool
    last: bool


def side_of_route(region: Ints, is_cut: Flags, line: int, ends: Ends, size: float) -> Flags:
    """Tell the pixels beyond a route from the first row to the last.

    Parameters
    ----------
    region : int64, shape (n_rows, n_cols)
        Number of the region of each pixel in the corridor, -1 for void.
    is_cut : bool, shape (n_regions,)
        Regions that are cut where the route crosses them.
    line : int
        Column of the line of tiles.
    ends : Ends
        Where it leads.
    size : float
        Edge length, px.

    Returns
    -------
    bool, shape (n_rows, n_cols)
        Pixels of the tile with the higher columns.
    """
    down, across = _costs(region, is_cut, DECAY * size)
    low, high = _bounds(region.shape, line, ends)
    beyond = np.arange(region.shape[1]) >= _cheapest(down, across, low, high)[:, None]
    return beyond ^ _small_pieces(region, beyond, line, ends, SMALL * size**2)


def _costs(region: Ints, is_cut: Flags, decay: float) -> tuple[Floats, Floats]:
    """Return what sides of pixels cost, down and across: (n_rows, n_cols + 1) and (n_rows + 1, n_cols)."""
    beside = np.zeros(region.shape, bool)
    apart = [np.diff(region, axis=axis) != 0 for axis in (0, 1)]
    for parts, axis in zip(apart, (0, 1), strict=True):
        first, second = (beside[:-1], beside[1:]) if axis == 0 else (beside[:, :-1], beside[:, 1:])
        first |= parts
        second |= parts
    far = scipy.ndimage.distance_transform_edt(~beside) if beside.any() else np.full(region.shape, np.inf)
    inside = np.where(np.append(is_cut, False)[region], 1.0 + CLOSE * np.exp(-far / decay), CHEAP)
    across, down = (
        np.full((region.shape[0] + 1, region.shape[1]), np.inf),
        np.full((len(region), region.shape[1] + 1), np.inf),
    )
    across[1:-1] = np.where(apart[0], CHEAP, np.maximum(inside[:-1], inside[1:]))
    down[:, 1:-1] = np.where(apart[1], CHEAP, np.maximum(inside[:, :-1], inside[:, 1:]))
    return down, across


def _bounds(shape: tuple[int, ...], line: int, ends: Ends) -> tuple[Ints, Ints]:
    """Return the first and the last column that a route may have above each row, and below the last one."""
    n_rows, n_cols = shape
    place, reach = np.arange(n_rows + 1), np.full(n_rows + 1, n_cols)
    if ends.first:
        reach = np.minimum(reach, place)
    if ends.last:
        reach = np.minimum(reach, n_rows - place)
    return np.maximum(line - reach, 1), np.minimum(line + reach, n_cols - 1)


@kernel
def _cheapest(down: Floats, across: Floats, low: Ints, high: Ints) -> Ints:
    """Return the column of the cheapest route in each row."""
    n = len(down)
    before, best = np.zeros(down.shape[1]), np.zeros(down.shape[1])
    came = np.zeros((n + 1, down.shape[1]), np.int32)  # from which column in the row above
    for j in range(1, n + 1):
        best[:] = np.inf
        for x in range(low[j], high[j] + 1):
            for start in (x, x - 1, x + 1):
                if low[j - 1] <= start <= high[j - 1]:
                    cost = down[j - 1, start]
                    if start != x:
                        cost = SLANT * (cost + across[j, min(x, start)])
                    if before[start] + cost < best[x]:
                        best[x], came[j, x] = before[start] + cost, start
        for x in range(low[j] + 1, high[j] + 1):
            if best[x - 1] + across[j, x - 1] < best[x]:
                best[x], came[j, x] = best[x - 1] + across[j, x - 1], came[j, x - 1]
        for x in range(high[j] - 1, low[j] - 1, -1):
            if best[x + 1] + across[j, x] < best[x]:
                best[x], came[j, x] = best[x + 1] + across[j, x], came[j, x + 1]
        before[:] = best
    x = low[n]
    for other in range(low[n], high[n] + 1):
        if before[other] < before[x]:
            x = other
    at = np.empty(n, np.int64)
    for j in range(n, 0, -1):
        x = came[j, x]
        at[j - 1] = x
    return at


def _small_pieces(region: Ints, beyond: Flags, line: int, ends: Ends, least: float) -> Flags:
    """Tell the pixels of pieces of less than so many, cut off by the route, that lie in the corridor as a whole."""
    code, ids = 2 * region + beyond, np.arange(region.size).reshape(region.shape)
    a, b = (np.concatenate(ends) for ends in zip(_pairs(ids, code), _pairs(ids.T, code.T), strict=True))
    same = code.ravel()[a] == code.ravel()[b]
    piece, n = linked(a[same], b[same], code.size)
    stays = np.bincount(piece, minlength=n) >= least
    apart = np.ones(n, bool)  # from the rest of its region beyond the route
    cut = (region.ravel()[a] == region.ravel()[b]) & ~same
    apart[piece[a[cut]]] = apart[piece[b[cut]]] = False
    piece = piece.reshape(code.shape)
    low, high = _bounds(code.shape, line, ends)
    column = np.arange(code.shape[1])
    outside = (column < np.maximum(low[:-1], low[1:])[:, None]) | (column >= np.minimum(high[:-1], high[1:])[:, None])
    stays[piece[outside]] = True
    return np.asarray(~(stays | apart)[piece])


def _pairs(ids: Ints, code: Ints) -> tuple[Ints, Ints]:
    """Return pixels and those below them, of one region."""
    same = code[1:] >> 1 == code[:-1] >> 1
    return ids[:-1][same], ids[1:][same]
