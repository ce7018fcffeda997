"""Chains averaged along their length: outlines as a tolerance of several data points leaves them.

Each chain is averaged by a bell as wide, turned about its ends, and sampled anew at every three quarters
of it. Coordinates are then counted in widths: what smooths stairs of a pixel afterwards smooths these.

Chains keep their points where any of these, or the new chain beside it, would be farther off than a share of the
distance to foreign parts: so none jumps over an island. Those that cross others all the same keep theirs, too, and
those that would leave a node in another order, or turn a region inside out: thin parts stay as they are.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.geometry.conflicts import CROSSING, find_conflicts, snapped
from imgquad_core.jit import kernel, verb
from imgquad_core.model import PointKind

from .areas import enclosed_areas
from .curves import ELSEWHERE, PIXEL_CORNER, Curves, PixelChains, curves_of, numbered
from .feature_size import local_feature_size
from .joins import rings

_BELL = 1.05  # of the width, deviation of the bell
_REACH = 4.0  # widths, in which foreign parts are looked for
_SHORTEST_LOOP = 14  # closed chains of fewer points stay as they are
_ENDS = 3.0  # deviations to either side
_EVERY = 0.75  # of the width, from sample to sample along the stairs
_ROOM = 0.49  # of the distance to foreign parts: two points that both go that far do not meet
_ARC_RATIO = 2.0  # arc over distance of a foreign point


def averaged(chains: PixelChains, width: float, units: Floats | float) -> PixelChains:
    """Average chains over a width.

    Parameters
    ----------
    chains : PixelChains
        The pixel boundary.
    width : float
        More than 1.
    units : float or float64, shape (2,)
        Steps of the grid on which coordinates are exact, a unit of length, of x and y, before.

    Returns
    -------
    PixelChains
        The same chains, coordinates and picture divided by `width`.
    """
    curves, ends = curves_of(*chains)
    room = _ROOM * local_feature_size(curves.raw, curves, _REACH * width, _ARC_RATIO)
    stays = _strays(curves, room, *_sample(curves, room, np.zeros(len(curves.ends), bool), width))
    # as the points are rounded, so that what lies on the border lies on it exactly
    cols, rows = snapped(np.array(chains.graph.shape[::-1]) / width, units * width).tolist()
    shape: Any = (rows, cols)
    order, _ = rings(curves.raw, curves.offsets, ends.offsets, ends.sockets)
    while True:
        raw, offsets = _sample(curves, room, stays, width)
        ids = numbered(offsets, curves.ends, len(ends.place))
        points = np.empty((int(ids.max()) + 1, 2))
        points[ids] = snapped(raw / width, units * width)
        kind = np.full(len(points), PointKind.FREE, np.uint8)
        kind[ids[np.repeat(curves.is_frame, np.diff(offsets))]] = PointKind.FRAME
        kind[: len(ends.place)] = ends.kind
        graph = replace(
            chains.graph,
            points=points,
            point_kind=kind,
            chain_offsets=offsets,
            chain_points=ids,
            shape=shape,
        )
        chain = np.repeat(np.arange(len(stays)), np.diff(offsets) - 1)
        marks = find_conflicts(points, graph.segments, chain, ~stays, graph.shape, units * width)
        turned = np.append(enclosed_areas(graph) <= 0.0, False)[graph.chain_regions].any(axis=1)
        ring, _ = rings(points[ids], offsets, ends.offsets, ends.sockets)
        turned |= (ring != order).reshape(-1, 2).any(axis=1)
        bad = np.unique(np.concatenate([chain[marks >= CROSSING], np.flatnonzero(turned)]))
        if stays[bad].all():
            return PixelChains(graph, _sides(offsets, curves.ends[:, 0] >= 0))
        stays[bad] = True


def _sides(offsets: Ints, is_open: Flags) -> Ints:
    side = np.full(offsets[-1], ELSEWHERE)
    side[offsets[:-1][is_open]] = side[offsets[1:][is_open] - 1] = PIXEL_CORNER
    return side


@kernel
def _sample(curves: Curves, room: Floats, stays: Flags, width: float) -> tuple[Floats, Ints]:
    """Return the points of all chains, those of `stays` as they are."""
    offsets = np.zeros(len(stays) + 1, np.int64)
    for c in range(len(stays)):
        first, last = curves.offsets[c], curves.offsets[c + 1] - 1
        n = max(int(curves.arc[last] / (_EVERY * width) + 0.5), 2 if curves.ends[c, 0] >= 0 else 8)
        offsets[c + 1] = offsets[c] + (last - first if stays[c] else min(n, last - first)) + 1
    raw = np.empty((offsets[-1], 2))
    for c in range(len(stays)):
        first, begin, n = curves.offsets[c], offsets[c], offsets[c + 1] - offsets[c] - 1
        last = curves.offsets[c + 1] - 1
        is_open = curves.ends[c, 0] >= 0
        i = first
        for k in range(n + 1):
            if stays[c] or (is_open and (k == 0 or k == n)):
                i = first + k if stays[c] else (first if k == 0 else last)
                raw[begin + k, 0], raw[begin + k, 1] = curves.raw[i, 0], curves.raw[i, 1]
                continue
            if k == n:  # a closed chain ends where it began
                raw[begin + k, 0], raw[begin + k, 1] = raw[begin, 0], raw[begin, 1]
                continue
            s = curves.arc[last] * k / n
            while i < last - 1 and curves.arc[i + 1] < s:
                i += 1
            t = (s - curves.arc[i]) / max(curves.arc[i + 1] - curves.arc[i], 1e-12)
            x = curves.raw[i, 0] + t * (curves.raw[i + 1, 0] - curves.raw[i, 0])
            y = curves.raw[i, 1] + t * (curves.raw[i + 1, 1] - curves.raw[i, 1])
            if not curves.is_frame[c]:
                ax, ay = _mean_at(curves, first, last, i, s, is_open, _BELL * width)
                gone = np.hypot(ax - x, ay - y)
                share = min(1.0, min(room[i], room[i + 1]) / max(gone, 1e-12))
                x, y = x + share * (ax - x), y + share * (ay - y)
            raw[begin + k, 0], raw[begin + k, 1] = x, y
    return raw, offsets


@kernel
def _strays(curves: Curves, room: Floats, raw: Floats, offsets: Ints) -> Flags:
    """Tell which chains have a point farther from the new chain, at the same share of its length, than its room."""
    found = np.zeros(len(offsets) - 1, np.bool_)
    for c in range(len(found)):
        first, last = curves.offsets[c], curves.offsets[c + 1] - 1
        begin, n = offsets[c], offsets[c + 1] - offsets[c] - 1
        found[c] = curves.ends[c, 0] < 0 and last - first < _SHORTEST_LOOP
        for i in range(first, last + 1):
            t = n * curves.arc[i] / curves.arc[last]
            k = min(int(t), n - 1)
            x = raw[begin + k, 0] + (t - k) * (raw[begin + k + 1, 0] - raw[begin + k, 0])
            y = raw[begin + k, 1] + (t - k) * (raw[begin + k + 1, 1] - raw[begin + k, 1])
            found[c] |= np.hypot(x - curves.raw[i, 0], y - curves.raw[i, 1]) > room[i]
    return found


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
