"""Stairs of several pixels: pictures that were enlarged, maps whose data points are wider than a pixel.

A pixel boundary is smoothed as if every pixel were one observation. Where data points are k pixels wide its stairs are
k times as coarse, and nothing that is counted in pixels fits. So the width of data points is seen, and the chains are
drawn anew in data points: what comes after works in these, and its result is multiplied by k at the end::

          +-------            k = 4:  a run of 8 px becomes two sides,  o--|--o
          |                           one of 4 px one side,             o
      +---+                           a bend stays a bend

The width is seen twice: in the spectrum of the places of sides (periodic layouts have one, too) and in stairs: runs
between a left and a right bend, several in a row. Hexagons, drawn in pixels, have no stairs of their width: their rows
and columns are sqrt(3) to 1 apart.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.geometry.conflicts import CROSSING, UNITS, find_conflicts
from imgquad_core.grouping import rows_of
from imgquad_core.jit import kernel
from imgquad_core.model import BoundaryGraph, PointKind

from .curves import PIXEL_CORNER, PixelChains, numbered, on_frame, pixel_chains
from .runs import Runs, runs_of
from .zooms import Step, fine_step, is_zoom

_FEWEST_SIDES = 30  # across an axis, for a spectrum
_LONGEST = 24.0  # px, of the periods that are looked for; the shortest is 2: places are whole numbers
_FINENESS = 10  # frequencies a period of the whole span
_BESIDE = 8  # frequencies to each side that a peak is higher than
_PEAK, _OF_HIGHEST = 0.3, 0.8  # least height of a peak, alone and over the highest one
_FEWEST_STEPS, _IN_A_ROW = 8, 3  # steps of a picture that can tell their width; of one run that count as a stair
_ALIKE, _LEAST_MEAN = 0.6, 1.25  # share of the steps of the width, and its least mean, px
_LEAST_OF_PERIOD = 0.75  # the same, over the period: steps are the shorter ones of 1 and 2 px
_SHORT, _FEW_SHORT = 0.6, 0.02  # of the width; share of runs below it, at most
_CLEAR, _OFF = 0.6, 1.0  # least height of the peak, and its distance in px from the mean step
_HEX_LEAST, _HEX_OFF, _HEX_CLEAR = 2.0, 0.03, 0.2  # least distance of rows, px; off sqrt(3) at most; height there
_HEX_RUNS = 60  # across an axis: the few of some rectangles have periods by chance
_NARROWEST, _NARROW_PLACES = 1.4, 60  # px, of data points below 2 px; different places across an axis that tell of them
_TINY = 1e-9  # data points
_WHOLE = 0.004  # a period this near a whole number, relative, is that number


class _Spectrum(NamedTuple):
    height: Floats  # of frequencies 0, 1, 2, ... over `number`, from 0 to 1
    number: int
    runs: int = 0  # straight runs that it was made of


class _Peak(NamedTuple):
    period: float
    height: float


_NO_PEAK = _Peak(1.0, 0.0)


def as_step(step: float | Step) -> Step:
    """Return width and height of data points, of which one number tells both."""
    width, height = np.broadcast_to(np.asarray(step, np.float64), 2).tolist()
    return width, height


def find_step(graph: BoundaryGraph) -> Step:
    """See how many pixels wide and high the data points of a picture are.

    Parameters
    ----------
    graph : BoundaryGraph
        Its pixel boundary.

    Returns
    -------
    tuple of float
        Width and height in pixels, 1 where there is no sign of more.
    """
    chains = pixel_chains(graph)
    runs = runs_of(chains)
    is_inner = ~on_frame(graph)[runs.chain]
    spectra = [_spectrum(runs, axis, is_inner) for axis in (0, 1)]
    if hexagon := _hexagon(*spectra) or _hexagon(*spectra[::-1]):
        return hexagon, hexagon
    peaks = [_narrow_or(_peak(spectra[a], _PEAK), spectra[a], runs, a, is_inner) for a in (0, 1)]
    is_stair, is_step = _stairs(runs, is_inner)
    found = [_width(runs.length, is_stair & (runs.axis == a), is_step & (runs.axis == a), peaks[a]) for a in (0, 1)]
    width, height = (found[a] or found[1 - a] or 1.0 for a in (0, 1))
    return fine_step(chains, (width, height))


def in_data_points(chains: PixelChains, step: Step) -> PixelChains:
    """Draw pixel chains anew in data points.

    Parameters
    ----------
    chains : PixelChains
        The pixel boundary.
    step : tuple of float
        Width and height of data points, in pixels.

    Returns
    -------
    PixelChains
        The same chains, coordinates and picture divided by `step`: what enlarging each pixel of a picture gives comes
        back as that picture's own pixel boundary.
    """
    if step == (1.0, 1.0):
        return chains
    graph, size = chains.graph, np.array(step)
    runs = runs_of(chains)
    number = np.maximum(np.floor(runs.length / size[runs.axis] + 0.5).astype(np.int64), 1)
    is_closed = graph.chain_points[graph.chain_offsets[:-1]] == graph.chain_points[graph.chain_offsets[1:] - 1]
    is_closed &= chains.side[graph.chain_offsets[:-1]] != PIXEL_CORNER
    begin, end = _counted(runs.begin / size), _counted(runs.end / size)
    stays = _swallow(chains, runs, is_closed, runs.length / number)
    while True:  # chains with finer detail than a data point may cross where bends are cut: these keep their pixels
        sides = np.where(stays[runs.chain], np.rint(runs.length).astype(np.int64), number)
        raw, side, offsets = _draw(runs.chain, begin, end, runs.axis, sides, is_closed)
        made = _graph(graph, raw, offsets, is_closed, size)
        chain = rows_of(offsets, gaps=True)
        marks = find_conflicts(made.points, made.segments, chain, ~stays, made.shape, UNITS * size)
        bad = np.unique(chain[marks >= CROSSING])
        if stays[bad].all():
            return PixelChains(made, side)
        stays[bad] = True


def _counted(places: Floats) -> Floats:
    """Make whole numbers of what is one but for rounding: a length that is a multiple of the size has no edge more."""
    whole = np.rint(places)
    return np.where(np.abs(places - whole) < _TINY, whole, places)


def _swallow(chains: PixelChains, runs: Runs, is_closed: Flags, side: Floats) -> Flags:
    """Tell which chains would leave out points of others where their bends are cut, between the middles of sides."""
    found = np.zeros(chains.graph.n_chains, bool)
    before, after = _bends(runs.chain, is_closed)
    corner, legs = runs.end[before], 0.5 * np.stack([side[before], side[after]], axis=1)
    is_cut = legs.max(axis=1) > 0.5
    if not is_cut.any() or (runs.length >= _SHORT * side.max()).all():
        return found  # no detail is finer than a data point
    back, ahead = (_unit(runs, at) for at in (before, after))
    points = chains.graph.points
    tree = scipy.spatial.cKDTree(points)
    for k in np.flatnonzero(is_cut).tolist():
        near = points[tree.query_ball_point(corner[k], legs[k].max())] - corner[k]
        u, v = -(near * back[k]).sum(axis=1) / legs[k, 0], (near * ahead[k]).sum(axis=1) / legs[k, 1]
        found[runs.chain[before[k]]] |= bool(((u > 0) & (v > 0) & (u + v < 1)).any())
    return found


def _bends(chain: Ints, is_closed: Flags) -> tuple[Ints, Ints]:
    """Return the runs before and after each bend; a closed chain has one where it begins, too."""
    same = np.flatnonzero(chain[1:] == chain[:-1])
    first = np.flatnonzero(np.diff(chain, prepend=-1))
    last = np.append(first[1:], len(chain)) - 1
    round_ = is_closed[chain[first]] & (last > first)
    return np.concatenate([same, last[round_]]), np.concatenate([same + 1, first[round_]])


def _unit(runs: Runs, at: Ints) -> Floats:
    return np.asarray((runs.end[at] - runs.begin[at]) / runs.length[at, None])


def _graph(graph: BoundaryGraph, raw: Floats, offsets: Ints, is_closed: Flags, size: Floats) -> BoundaryGraph:
    """Put dense points into a graph: the ends of chains first, as they were, then the others chain by chain."""
    ends = np.stack([graph.chain_points[graph.chain_offsets[:-1]], graph.chain_points[graph.chain_offsets[1:] - 1]], 1)
    ends[is_closed] = -1
    used, node = np.unique(ends, return_inverse=True)
    used, node = used[used >= 0], node.reshape(-1, 2) - np.count_nonzero(used < 0)
    ids = numbered(offsets, node, len(used))
    points = np.empty((int(ids.max()) + 1, 2))
    points[ids] = raw
    kind = np.full(len(points), PointKind.FREE, np.uint8)
    kind[ids[np.repeat(on_frame(graph), np.diff(offsets))]] = PointKind.FRAME
    kind[: len(used)] = graph.point_kind[used]
    shape = tuple(_counted(np.array(graph.shape) / size[::-1]).tolist())
    return replace(graph, points=points, point_kind=kind, chain_offsets=offsets, chain_points=ids, shape=shape)


@kernel
def _draw(
    chain: Ints, begin: Floats, end: Floats, axis: Ints, number: Ints, is_closed: Flags
) -> tuple[Floats, Ints, Ints]:
    """Put `number` sides on each run: their middles, and the corners between them."""
    total = 2 * len(is_closed)
    for r in range(len(chain)):
        total += 2 * number[r]
    raw, side, offsets = np.empty((total, 2)), np.empty(total, np.int64), np.zeros(len(is_closed) + 1, np.int64)
    n = 0
    for r in range(len(chain)):
        c = chain[r]
        if (r == 0 or chain[r - 1] != c) and not is_closed[c]:
            raw[n, 0], raw[n, 1], side[n] = begin[r, 0], begin[r, 1], PIXEL_CORNER
            n += 1
        for k in range(1, 2 * number[r]):
            t = k / (2.0 * number[r])
            raw[n, 0] = begin[r, 0] + t * (end[r, 0] - begin[r, 0])
            raw[n, 1] = begin[r, 1] + t * (end[r, 1] - begin[r, 1])
            side[n] = axis[r] if k % 2 else PIXEL_CORNER
            n += 1
        if r == len(chain) - 1 or chain[r + 1] != c:
            if is_closed[c]:
                raw[n, 0], raw[n, 1], side[n] = raw[offsets[c], 0], raw[offsets[c], 1], side[offsets[c]]
            else:
                raw[n, 0], raw[n, 1], side[n] = end[r, 0], end[r, 1], PIXEL_CORNER
            n += 1
            offsets[c + 1] = n
    return raw[:n].copy(), side[:n].copy(), offsets


def _spectrum(runs: Runs, axis: int, is_inner: Flags) -> _Spectrum:
    """Return how periodic the places of the sides across an axis are."""
    across = is_inner & (runs.axis != axis)
    place, weight = runs.end[across, axis].astype(np.int64), runs.length[across]
    span = int(np.ptp(place)) if len(place) else 0
    if weight.sum() < _FEWEST_SIDES or span == 0:
        return _Spectrum(np.zeros(1), 1)
    number = _FINENESS * span
    height = np.abs(np.fft.rfft(np.bincount(place - place.min(), weight), number)) / weight.sum()
    return _Spectrum(height, number, len(place))


def _peak(spectrum: _Spectrum, least: float) -> _Peak:
    """Find the longest clear period, of at least that height."""
    height, number = spectrum.height, spectrum.number
    low, high = int(np.ceil(number / min(_LONGEST, number / _FINENESS / 4))), len(height) - 1
    if low >= high:
        return _NO_PEAK
    least = max(least, _OF_HIGHEST * float(height[low : high + 1].max()))
    is_peak = (height >= least) & (height == _highest_near(height))
    found = low + np.flatnonzero(is_peak[low : high + 1])
    return _Peak(number / found[0], float(height[found[0]])) if len(found) else _NO_PEAK


def _narrow_or(peak: _Peak, spectrum: _Spectrum, runs: Runs, axis: int, is_inner: Flags) -> _Peak:
    """Find data points of less than 2 px, by pixel sides that are missing; else return the peak.

    At whole numbers waves of k px look as those of k / (k - 1) px, which the spectrum has.
    """
    across = is_inner & (runs.axis != axis)
    places, weight, number = runs.end[across, axis], runs.length[across], spectrum.number
    if peak.height >= _CLEAR and (_whole(peak.period).is_integer() or is_zoom(places, weight, peak.period)):
        return peak
    low, high = int(np.ceil(number * (1.0 - 1.0 / _NARROWEST))), number // 2
    if low >= high or len(np.unique(places)) < _NARROW_PLACES:
        return peak
    period = number / (number - (low + int(np.argmax(spectrum.height[low:high]))))
    return _Peak(period, 1.0) if is_zoom(places, weight, period) else peak


def _highest_near(height: Floats) -> Floats:
    """Return the largest of each value and those up to `_BESIDE` places away."""
    padded = np.pad(height, _BESIDE, constant_values=-np.inf)
    return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, 2 * _BESIDE + 1).max(axis=1))


def _hexagon(along: _Spectrum, up: _Spectrum) -> float | None:
    """Return the width of hexagons whose rows lie one above the other; None if there are none.

    Their upright sides are half a width apart, sqrt(3) times as near as their rows.
    """
    if min(along.runs, up.runs) < _HEX_RUNS:
        return None
    row, column = _peak(up, _PEAK), _peak(along, _HEX_CLEAR)
    if row.height < _CLEAR or row.period <= _HEX_LEAST or abs(row.period / column.period - np.sqrt(3.0)) > _HEX_OFF:
        return None
    return _whole(2.0 * column.period)


def _stairs(runs: Runs, is_inner: Flags) -> tuple[Flags, Flags]:
    """Tell which runs stand in stairs, between a left and a right bend, and which of them are steps."""
    along = runs.end - runs.begin
    turn = np.zeros(len(along))  # at the end of each run; 0 at the end of its chain
    same = runs.chain[1:] == runs.chain[:-1]
    turn[:-1][same] = np.sign(along[:-1, 0] * along[1:, 1] - along[:-1, 1] * along[1:, 0])[same]
    bends = runs.end[turn != 0.0]
    _, which, times = np.unique(bends[:, 0] + 1j * bends[:, 1], return_inverse=True, return_counts=True)
    turn[np.flatnonzero(turn)[times[which] > 1]] = 0.0  # two chains bend there: pixels that touch at a corner
    between = np.zeros(len(along), bool)
    between[1:-1] = (turn[:-2] * turn[1:-1] < 0.0)[: max(len(along) - 2, 0)]
    between &= is_inner
    edges = np.flatnonzero(np.diff(np.concatenate([[False], between, [False]]).astype(np.int8)))
    number = np.diff(edges)[::2]
    is_stair = np.zeros(len(along), bool)
    is_stair[between] = np.repeat(number >= _IN_A_ROW, number)
    longest = np.minimum(np.roll(runs.length, 1), np.roll(runs.length, -1))
    return is_stair, is_stair & (runs.length <= longest)


def _width(length: Floats, is_stair: Flags, is_step: Flags, peak: _Peak) -> float | None:
    """Tell the width of steps that the peak of the spectrum confirms; 1 if it does not, None where steps are few."""
    steps = np.rint(length[is_step]).astype(np.int64)
    if len(steps) < _FEWEST_STEPS:
        return None
    count = np.bincount(steps, minlength=2)
    m = int(np.argmax(count[:-1] + count[1:]))
    alike = steps[(steps == m) | (steps == m + 1)]
    mean = float(alike.mean())
    short = float(np.mean(length[is_stair] < _SHORT * m))
    is_clear = peak.height >= _CLEAR and abs(peak.period - mean) <= _OFF
    if not (
        is_clear
        and len(alike) >= _ALIKE * len(steps)
        and mean >= min(_LEAST_MEAN, _LEAST_OF_PERIOD * peak.period)
        and short <= _FEW_SHORT
    ):
        return 1.0
    return _whole(peak.period)


def _whole(period: float) -> float:
    return float(round(period)) if abs(period - round(period)) <= _WHOLE * period else period
