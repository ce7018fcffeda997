"""Zooms that are no whole number: where the sides of data points were before they were rounded to whole pixels.

Nearest neighbours, zoomed 2.5 times, make data points of 2 and 3 px. Their sides are the whole numbers next to
2.5 i + c, off by up to half a pixel. The number i of a side is known, so that is undone, and what is smoothed are the
stairs of the data points themselves::

      pixels              |0 0 0|1 1|2 2 2|3 3|      sides at  0   3    5   8    10
      data points again   | 0  | 1  | 2  | 3  |                0   2.5  5   7.5  10
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple, TypeAlias

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints

from .curves import PixelChains, on_frame
from .runs import Runs, runs_of

_OFF, _SURELY_OFF = 0.65, 0.58  # px that a side is off at most: half, and what the fit is off; that tells of a zoom
_LEAST = 1.4  # px, of data points: of narrower ones every pixel side is near one of theirs
_SHARE = 0.95  # of the sides, by length, that are at sides of data points
_FITS = 4

#: width and height of data points, in pixels
Step: TypeAlias = "tuple[float, float]"


class _Lattice(NamedTuple):
    """The sides of data points along one axis: number i is at ``step * i + first``, in pixels."""

    step: float
    first: float

    def number(self, places: Floats) -> Floats:
        """Return the number of the side that is nearest to each place."""
        return np.asarray(np.rint((places - self.first) / self.step))

    def off(self, places: Floats) -> Floats:
        """Return how far each place is from the nearest side."""
        return np.asarray(np.abs(places - self.first - self.step * self.number(places)))


class _Sides(NamedTuple):
    """Where the pixel sides along one axis belong."""

    step: float
    pixels: Floats  # ascending places, both borders of the picture among them
    places: Floats  # where these belong


def fine_step(chains: PixelChains, step: Step) -> Step:
    """Return width and height of data points near `step` as the places of pixel sides tell them.

    Parameters
    ----------
    chains : PixelChains
        The pixel boundary.
    step : tuple of float
        Width and height, about. What is a whole number stays.
    """
    if _is_whole(step):
        return step
    runs = runs_of(chains)
    width, height = (sides.step if sides else k for k, sides in zip(step, _sides(chains, runs, step), strict=True))
    return width, height


def is_zoom(places: Floats, weight: Floats, step: float) -> bool:
    """Tell whether all places of pixel sides, of that length, can be sides of data points about `step` wide."""
    found = _lattice(places, weight, step)
    if found is None:
        return False
    fits = found.off(places) <= _SURELY_OFF
    sides, numbers = np.unique(places[fits]), np.unique(found.number(places[fits]))  # each side is at one place
    return bool(weight[fits].sum() >= _SHARE * weight.sum() and _SHARE * len(sides) <= len(numbers))


def unrounded(chains: PixelChains, step: Step) -> tuple[PixelChains, Step]:
    """Put the sides of data points where they were before they were rounded to whole pixels.

    Parameters
    ----------
    chains : PixelChains
        The pixel boundary.
    step : tuple of float
        Width and height of data points, in pixels. Where it is a whole number, and where the sides are not those of
        data points, nothing moves.

    Returns
    -------
    PixelChains
        With points up to a pixel from where they were.
    tuple of float
        Width and height of its data points.
    """
    if _is_whole(step):
        return chains, step
    points, found = np.array(chains.graph.points), list(step)
    for axis, sides in enumerate(_sides(chains, runs_of(chains), step)):
        if sides:
            points[:, axis] = np.interp(points[:, axis], sides.pixels, sides.places)
            found[axis] = sides.step
    return chains._replace(graph=replace(chains.graph, points=points)), (found[0], found[1])


def larger(before: PixelChains, after: PixelChains, sides: Ints, n: int) -> Floats:
    """Return how many times as large each region, or pore, is after its sides were moved.

    Parameters
    ----------
    before, after : PixelChains
        The same chains.
    sides : int64, shape (n_chains, 2)
        Regions or pores on both sides of each chain, -1 for none.
    n : int
        Their number.
    """
    old, new = (_areas(runs_of(chains), sides, n) for chains in (before, after))
    return np.asarray(np.where(old > 0.0, new / np.where(old > 0.0, old, 1.0), 1.0))


def _is_whole(step: Step) -> bool:
    return all(k.is_integer() for k in step)


def _areas(runs: Runs, sides: Ints, n: int) -> Floats:
    swept = 0.5 * (runs.begin[:, 0] * runs.end[:, 1] - runs.begin[:, 1] * runs.end[:, 0])
    left, right = np.where(sides < 0, n, sides)[runs.chain].T
    return np.asarray((np.bincount(left, swept, n + 1) - np.bincount(right, swept, n + 1))[:n])


def _sides(chains: PixelChains, runs: Runs, step: Step) -> list[_Sides | None]:
    """Return where the pixel sides along both axes belong; None for an axis on which they stay."""
    is_inner = ~on_frame(chains.graph)[runs.chain]
    found: list[_Sides | None] = []
    for axis, size in enumerate(chains.graph.shape[::-1]):
        across = is_inner & (runs.axis != axis)
        places = runs.end[across, axis]
        lattice = _lattice(places, runs.length[across], step[axis])
        found.append(_placed(lattice, np.unique(np.append(places, [0.0, size]))) if lattice else None)
    return found


def _lattice(places: Floats, weight: Floats, step: float) -> _Lattice | None:
    """Find the sides of data points near a step; None where too few pixel sides are theirs."""
    if step.is_integer() or step < _LEAST or len(places) == 0:
        return None
    turns = np.angle((weight * np.exp(2j * np.pi / step * places)).sum()) / (2.0 * np.pi)
    found = _Lattice(step, float(step * turns))
    for _ in range(_FITS):
        found = _fitted(places, weight / weight.sum(), found)
    return found if weight[found.off(places) <= _OFF].sum() >= _SHARE * weight.sum() else None


def _fitted(places: Floats, share: Floats, found: _Lattice) -> _Lattice:
    """Return the line of least squares of places over their numbers."""
    number = found.number(places)
    n, place = (share * number).sum(), (share * places).sum()
    spread = (share * (number - n) ** 2).sum()
    step = float((share * (number - n) * (places - place)).sum() / spread) if spread > 0.0 else found.step
    return _Lattice(step, float(place - step * n))


def _placed(lattice: _Lattice, pixels: Floats) -> _Sides:
    """Put ascending places where they belong; the borders are sides of data points, too, if they are near enough."""
    number, is_side = lattice.number(pixels), _are_sides(lattice, pixels)
    size, starts, ends = float(pixels[-1]), is_side[0], is_side[-1] and number[-1] > number[0]
    step = size / float(number[-1] - number[0]) if starts and ends else lattice.step
    first = -step * number[0] if starts else size - step * number[-1] if ends else lattice.first
    places = step * np.where(is_side, number, (pixels - lattice.first) / lattice.step) + first
    places[0], places[-1] = 0.0, size
    return _Sides(step, pixels, places)


def _are_sides(lattice: _Lattice, pixels: Floats) -> Flags:
    """Tell which places are sides of data points: the nearest to each, if it is near enough."""
    number, off = lattice.number(pixels), lattice.off(pixels)
    order = np.lexsort((off, number))
    is_nearest = np.zeros(len(off), bool)
    is_nearest[order[np.diff(number[order], prepend=-np.inf) != 0.0]] = True
    return is_nearest & (off <= _OFF)
