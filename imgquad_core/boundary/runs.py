"""Straight runs of pixel chains: from an end or a bend to the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Floats, Ints
from imgquad_core.jit import kernel

from .curves import ACROSS, PIXEL_CORNER, PixelChains


class Runs(NamedTuple):
    """Straight runs of sides, chain by chain."""

    chain: Ints
    begin: Floats  # (n, 2) corner where it begins
    end: Floats  # (n, 2)
    axis: Ints  # 0 horizontal, 1 vertical
    length: Floats  # px


def runs_of(chains: PixelChains) -> Runs:
    """Find the straight runs of all chains: from an end or a bend to the next."""
    graph = chains.graph
    return Runs(*_trace(graph.points[graph.chain_points], chains.side, np.array(graph.chain_offsets)))


@kernel
def _trace(points: Floats, side: Ints, offsets: Ints) -> tuple[Ints, Floats, Floats, Ints, Floats]:
    chain, axis = np.empty(len(side), np.int64), np.empty(len(side), np.int64)
    begin, end, length = np.empty((len(side), 2)), np.empty((len(side), 2)), np.empty(len(side))
    n = 0
    for c in range(len(offsets) - 1):
        first, last = offsets[c], offsets[c + 1] - 1
        is_open = side[first] == PIXEL_CORNER
        x, y = points[first, 0], points[first, 1]
        if not is_open:  # it begins beside a bend
            x, y = _bend(points, side, last - 1, first)
        for i in range(first + is_open, last):
            is_last = i == last - 1
            if side[i] == PIXEL_CORNER or (side[i + 1] == side[i] and not (is_last and not is_open)):
                continue
            if not is_last and side[i + 1] == PIXEL_CORNER:
                continue
            if is_last and is_open:
                px, py = points[last, 0], points[last, 1]
            else:
                px, py = _bend(points, side, i, i + 1)
            chain[n], axis[n], length[n] = c, side[i], abs(px - x) + abs(py - y)
            begin[n, 0], begin[n, 1], end[n, 0], end[n, 1] = x, y, px, py
            x, y = px, py
            n += 1
    return chain[:n].copy(), begin[:n].copy(), end[:n].copy(), axis[:n].copy(), length[:n].copy()


@kernel
def _bend(points: Floats, side: Ints, i: int, j: int) -> tuple[float, float]:
    """Corner between two mid-sides, of which one lies across."""
    if side[i] == ACROSS:
        return points[j, 0], points[i, 1]
    return points[i, 0], points[j, 1]
