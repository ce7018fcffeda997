"""Chains averaged along their length: outlines as a tolerance of several data points leaves them.

Each chain is averaged by a bell as wide, turned about its ends, and sampled anew at every three quarters
of it. Coordinates are then counted in widths: what smooths stairs of a pixel afterwards smooths these.

A place where foreign parts are near gets a narrower bell and closer samples, down to the pixels themselves, and the
width grows away from it along the chain::

    width     ------.           .------      foreign: an island, the other side of a neck, another chain at a node
                     '.       .'
                       '.___.'
    samples   o     o    o o.....o o    o     o

A chain that bends to and fro within the bell is not foreign to itself there: such tips are what smoothing takes.
Points go at most half-way to foreign parts. Where the new chain is farther off than that all the same, where it
crosses others, leaves a node in another order or turns a region inside out, the width is halved, until it does not: so
thin parts stay as they are, and what is wide is smoothed beside them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.geometry.conflicts import CROSSING, find_conflicts, snapped
from imgquad_core.grouping import rows_of
from imgquad_core.jit import kernel, verb
from imgquad_core.model import BoundaryGraph, PointKind

from .areas import enclosed_areas
from .curves import ELSEWHERE, PIXEL_CORNER, Curves, Ends, PixelChains, curves_of, numbered, per_point, rings
from .edge_sizes import grade_along
from .feature_size import local_feature_size
from .nodes import divide

_BELL = 1.05  # of the width, deviation of the bell
_REACH = 4.0  # widths, in which foreign parts are looked for
_SHORTEST_LOOP = 14  # closed chains of fewer points stay as they are
_ENDS = 3.0  # deviations to either side
_EVERY = 0.75  # of the width, from sample to sample along the stairs
_NARROWEST = 1.0  # data points; places that need less keep their pixels
_OF_FREE = 0.75  # width over the distance to foreign parts, at most
_OF_REGION = 0.5  # and over the root of the area of regions beside it
_WIDENS = 0.5  # of the width, a unit of length along the chain
_ROOM = 0.49  # of the distance to foreign parts: two points that both go that far do not meet
_ARC_RATIO = 2.0  # arc over distance of a foreign point
_THIN = 3.0  # the same where a narrower bell is needed: chains that meet at more than 39 degrees are not thin
_WIGGLE = 4.0  # widths of a chain that the bell may take together: a tip or a bend to and fro is not a thin part
_ROUNDS = 12  # of halving widths; afterwards whole chains keep their pixels


def averaged(
    chains: PixelChains, width: float, units: Floats | float, as_pixels: Flags | None = None, *, threads: int = 1
) -> PixelChains:
    """Average chains over a width.

    Parameters
    ----------
    chains : PixelChains
        The pixel boundary.
    width : float
        More than 1.
    units : float or float64, shape (2,)
        Steps of the grid on which coordinates are exact, a unit of length, of x and y, before.
    as_pixels : bool, shape (n_chains,), optional
        Chains that keep their pixels.
    threads : int
        How many share the points.

    Returns
    -------
    PixelChains
        The same chains, coordinates and picture divided by `width`.
    """
    curves, ends = curves_of(*chains)
    reach, wiggle = _REACH * width, _WIGGLE * width
    room = _ROOM * local_feature_size(curves.raw, curves, reach, _ARC_RATIO, wiggle=wiggle, threads=threads)
    thin = local_feature_size(curves.raw, curves, reach, _THIN, wiggle=wiggle, threads=threads)
    widest = np.minimum(_widest(chains.graph, curves, width), _OF_FREE * thin)
    if as_pixels is not None:
        widest[per_point(curves, as_pixels)] = 0.0
    scale = _graded(curves, widest)
    new = np.ones(len(curves.ends), bool)
    for attempt in range(_ROUNDS + 2):
        at, offsets = _places(curves, scale)
        graph = _graph(chains.graph, curves, ends, _points(curves, room, scale, at), offsets, width, units)
        bad = _astray(curves, room, at, graph, width) | _in_conflict(curves, ends, at, graph, new, units * width)
        bad &= scale > 0.0
        if attempt >= _ROUNDS:
            bad = per_point(curves, np.logical_or.reduceat(bad, curves.offsets[:-1])) | (attempt > _ROUNDS)
        if not bad.any():
            break
        narrower = _graded(curves, np.where(bad, 0.0 if attempt >= _ROUNDS else 0.5, 1.0) * scale)
        new, scale = np.logical_or.reduceat(narrower < scale, curves.offsets[:-1]), narrower
    return PixelChains(graph, *_details(chains.side, curves, scale, at, offsets, width))


def _widest(graph: BoundaryGraph, curves: Curves, width: float) -> Floats:
    """Width at each point as the regions on both sides allow: tiny ones would collapse."""
    across = np.append(np.sqrt(np.maximum(enclosed_areas(graph), 0.0)), np.inf)  # VOID is the last entry
    widest = np.minimum(width, _OF_REGION * across[graph.chain_regions].min(axis=1))
    widest[(curves.ends[:, 0] < 0) & (np.diff(curves.offsets) <= _SHORTEST_LOOP)] = 0.0
    return per_point(curves, widest)


def _graded(curves: Curves, scale: Floats) -> Floats:
    """Let widths grow along chains as they may, from 0 where there are pixels."""
    from_pixels = np.where(scale < _NARROWEST, 0.0, scale)
    return grade_along(from_pixels, curves.arc, curves.offsets, curves.ends, _WIDENS)


def _graph(
    graph: BoundaryGraph, curves: Curves, ends: Ends, raw: Floats, offsets: Ints, width: float, units: Floats | float
) -> BoundaryGraph:
    """Put samples into a graph, in widths."""
    # rounded as the points are, so that what lies on the border lies on it exactly
    cols, rows = snapped(np.array(graph.shape[::-1]) / width, units * width).tolist()
    shape: Any = (rows, cols)
    ids = numbered(offsets, curves.ends, len(ends.place))
    points = np.empty((int(ids.max()) + 1, 2))
    points[ids] = snapped(raw / width, units * width)
    kind = np.full(len(points), PointKind.FREE, np.uint8)
    kind[ids[np.repeat(curves.is_frame, np.diff(offsets))]] = PointKind.FRAME
    kind[: len(ends.place)] = ends.kind
    return replace(graph, points=points, point_kind=kind, chain_offsets=offsets, chain_points=ids, shape=shape)


def _details(side: Ints, curves: Curves, scale: Floats, at: Floats, offsets: Ints, width: float) -> tuple[Ints, Floats]:
    """Tell what the samples are, and how wide what smoothing takes for stairs is there, in widths."""
    place = at.astype(np.int64)
    is_pixel = scale[place] < _NARROWEST
    made = np.where(is_pixel, side[place], ELSEWHERE)
    is_open = curves.ends[:, 0] >= 0
    made[offsets[:-1][is_open]] = made[offsets[1:][is_open] - 1] = PIXEL_CORNER
    return made, np.maximum(np.interp(at, np.arange(len(scale)), scale), _NARROWEST) / width


def _astray(curves: Curves, room: Floats, at: Floats, graph: BoundaryGraph, width: float) -> Flags:
    """Tell which dense points are farther from where the samples beside them put them than their room."""
    place = width * graph.points[graph.chain_points]
    dense = np.arange(len(room))
    k = np.minimum(np.searchsorted(at, dense, side="right") - 1, per_point(curves, graph.chain_offsets[1:] - 2))
    arc = np.interp(at, dense, curves.arc)
    t = (curves.arc - arc[k]) / (arc[k + 1] - arc[k])
    gone = place[k] + t[:, None] * (place[k + 1] - place[k]) - curves.raw
    return np.asarray(np.hypot(*gone.T) > room)


def _in_conflict(
    curves: Curves, ends: Ends, at: Floats, graph: BoundaryGraph, new: Flags, units: Floats | float
) -> Flags:
    """Tell which dense points lie under samples that cross others, change the order at a node or turn a region."""
    chain = rows_of(graph.chain_offsets, gaps=True)
    marks = find_conflicts(graph.points, graph.segments, chain, new, graph.shape, units)
    k = np.flatnonzero(marks >= CROSSING)
    low, high = at[k + chain[k]].astype(np.int64), np.ceil(at[k + chain[k] + 1]).astype(np.int64)
    begins = np.zeros(len(curves.raw) + 1, np.int64)
    np.add.at(begins, low, 1)
    np.add.at(begins, high + 1, -1)
    bad = np.cumsum(begins[:-1]) > 0
    ring, _ = rings(graph.points[graph.chain_points], graph.chain_offsets, ends.offsets, ends.sockets)
    order, _ = rings(curves.raw, curves.offsets, ends.offsets, ends.sockets)
    turned = np.append(enclosed_areas(graph) <= 0.0, False)[graph.chain_regions].any(axis=1)
    return np.asarray(bad | per_point(curves, turned | (ring != order).reshape(-1, 2).any(axis=1)))


@kernel
def _places(curves: Curves, scale: Floats) -> tuple[Floats, Ints]:
    """Return places of samples on the dense points, as fractional indices, and the first one of each chain."""
    cost = np.zeros(len(scale))
    n_most = 0
    for c in range(len(curves.ends)):
        for i in range(curves.offsets[c] + 1, curves.offsets[c + 1]):
            wide = _EVERY * max(0.5 * (scale[i] + scale[i - 1]), _NARROWEST)
            cost[i] = cost[i - 1] + (curves.arc[i] - curves.arc[i - 1]) / wide
        n_most += 2 * (curves.offsets[c + 1] - curves.offsets[c]) + 8
    at, offsets = np.empty(n_most), np.zeros(len(curves.ends) + 1, np.int64)
    for c in range(len(curves.ends)):
        first, last = curves.offsets[c], curves.offsets[c + 1] - 1
        n, begin = offsets[c], first
        at[n] = first
        for i in range(first + 1, last + 1):
            if i < last and min(scale[i - 1], scale[i], scale[i + 1]) >= _NARROWEST:
                continue
            least = 1
            if begin == first and i == last:  # a chain without pixels
                least = 2 if curves.ends[c, 0] >= 0 else 8
            number = min(max(int(cost[i] - cost[begin] + 0.5), least), i - begin)
            divide(cost, begin, i, number, at, n)
            n += number
            begin = i
        offsets[c + 1] = n + 1
    return at[: offsets[-1]].copy(), offsets


@kernel
def _points(curves: Curves, room: Floats, scale: Floats, at: Floats) -> Floats:
    """Return the samples at `at`, averaged where the scale is not that of pixels."""
    raw = np.empty((len(at), 2))
    k = 0
    for c in range(len(curves.ends)):
        first, last = curves.offsets[c], curves.offsets[c + 1] - 1
        is_open, begin = curves.ends[c, 0] >= 0, k
        while True:
            i = min(int(at[k]), last - 1)
            t = at[k] - i
            x = curves.raw[i, 0] + t * (curves.raw[i + 1, 0] - curves.raw[i, 0])
            y = curves.raw[i, 1] + t * (curves.raw[i + 1, 1] - curves.raw[i, 1])
            wide = scale[i] + t * (scale[i + 1] - scale[i])
            is_end = is_open and (k == begin or at[k] == last)
            if not (curves.is_frame[c] or is_end or wide < _NARROWEST):
                s = curves.arc[i] + t * (curves.arc[i + 1] - curves.arc[i])
                ax, ay = _mean_at(curves, first, last, i, s, is_open, _BELL * wide)
                gone = np.hypot(ax - x, ay - y)
                share = min(1.0, min(room[i], room[i + 1]) / max(gone, 1e-12))
                x, y = x + share * (ax - x), y + share * (ay - y)
            raw[k, 0], raw[k, 1] = x, y
            k += 1
            if at[k - 1] == last:
                break
        if not is_open:  # it ends where it began
            raw[k - 1, 0], raw[k - 1, 1] = raw[begin, 0], raw[begin, 1]
    return raw


@verb
def _mean_at(
    curves: Curves, first: int, last: int, i: int, s: float, is_open: bool, deviation: float
) -> tuple[float, float]:
    """Mean of a chain in a bell around the arc s, which lies behind point i."""
    n, length = last - first, curves.arc[last]
    x = y = total = 0.0
    for step in range(2):
        k = i - first + step
        while True:
            turns = k // n
            j = first + k % n
            if is_open and k < 0:
                j, arc = first - k, -curves.arc[min(first - k, last)]
            elif is_open and k > n:
                j = last - (k - n)
                arc = 2.0 * length - curves.arc[max(j, first)]
            elif is_open:
                j, arc = first + k, curves.arc[first + k]
            else:
                arc = curves.arc[j] + length * turns
            if abs(arc - s) > _ENDS * deviation or j < first or j > last:
                break
            weight = np.exp(-0.5 * ((arc - s) / deviation) ** 2) * _spacing(curves, first, last, j, is_open)
            px, py = curves.raw[j, 0], curves.raw[j, 1]
            if is_open and k < 0:
                px, py = 2.0 * curves.raw[first, 0] - px, 2.0 * curves.raw[first, 1] - py
            elif is_open and k > n:
                px, py = 2.0 * curves.raw[last, 0] - px, 2.0 * curves.raw[last, 1] - py
            x, y, total = x + weight * px, y + weight * py, total + weight
            k += 1 if step else -1
    return (x / total, y / total) if total > 0.0 else (curves.raw[i, 0], curves.raw[i, 1])


@verb
def _spacing(curves: Curves, first: int, last: int, j: int, is_open: bool) -> float:
    """Length of a chain that a dense point stands for."""
    if first < j < last:
        return float(0.5 * (curves.arc[j + 1] - curves.arc[j - 1]))
    beside = curves.arc[first + 1] + curves.arc[last] - curves.arc[last - 1]
    return float(0.5 * beside)
