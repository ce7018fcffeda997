"""Pores: parts without a material that regions enclose. Their areas are kept like those of regions.

A pore is found by its border: chains are walked with void on the left until the walk closes. Where it turns
counter-clockwise, it encloses void (and whatever islands lie therein, whose areas are kept anyway).

      +-----------+          walk along the border of the pore:
      |  solid    |             at a node, the next chain clockwise
      |   +---+   |             from the one that was come by
      |   |   |   |
      |   +-<-+   |          the frame, and void that touches it, is walked
      +-----------+          clockwise: it takes whatever area is left
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Floats, Ints
from imgquad_core.grouping import linked, rows_of
from imgquad_core.model import VOID, BoundaryGraph

from .curves import curves_of, on_frame, rings


class Pores(NamedTuple):
    """Whose area each side of a chain is part of: a region, a pore, or nothing that is kept."""

    sides: Ints  #: (n_chains, 2) as `chain_regions`, pores numbered after the regions
    pixels: Floats  #: (n_pores,) area of each


def pores_of(graph: BoundaryGraph) -> Pores:
    """Find the pores of a pixel boundary.

    Parameters
    ----------
    graph : BoundaryGraph
        What `extract_boundaries` gave.

    Returns
    -------
    Pores
        Numbered by the first of their chains.
    """
    sides = np.array(graph.chain_regions)
    walks = np.flatnonzero(sides.ravel() == VOID)  # 2 * chain + 0 along it with void on its left, + 1 against it
    if on_frame(graph)[walks // 2].all():  # no pixel is void
        return Pores(sides, np.empty(0))
    n_loops, loop = _loops(graph, walks)
    area = np.bincount(loop, _swept(graph)[walks // 2] * np.where(walks % 2, -1.0, 1.0), n_loops)
    is_pore = area > 0.0
    number = np.where(is_pore, len(graph.region_label) + np.cumsum(is_pore) - 1, VOID)
    sides.ravel()[walks] = number[loop]
    return Pores(sides, np.asarray(area[is_pore], np.float64))


def _loops(graph: BoundaryGraph, walks: Ints) -> tuple[int, Ints]:
    """Return the number of closed walks along void, and the one that each walk of a chain is part of."""
    curves, ends = curves_of(graph)
    ring, _ = rings(curves.raw, curves.offsets, ends.offsets, ends.sockets)
    following = np.arange(len(ring))  # a walk ends at socket `walk ^ 1`, and begins at the one of its own number
    open_ = np.flatnonzero(ring >= 0)
    following[ring[open_] ^ 1] = open_
    place = np.empty(len(ring), np.int64)
    place[walks] = np.arange(len(walks))
    loop, n_loops = linked(np.arange(len(walks)), place[following[walks]], len(walks))
    return n_loops, loop


def _swept(graph: BoundaryGraph) -> Floats:
    """Area that each chain sweeps about the origin, along the sides of pixels.

    Chains go from the middle of a side to that of the next one, across the corner between them::

        +--p--c       p: x is a half      c = (x of q, y of p)
        |   \\ |       q: y is a half
        |    \\q
    """
    points = graph.points[graph.chain_points]
    p, q = points[:-1], points[1:]
    is_across = (p[:, 0] % 1.0 != 0.0)[:, None]
    corner = np.where(is_across, np.stack([q[:, 0], p[:, 1]], axis=1), np.stack([p[:, 0], q[:, 1]], axis=1))
    swept = 0.5 * (_cross(p, corner) + _cross(corner, q))
    chain = rows_of(graph.chain_offsets)[:-1]
    swept[graph.chain_offsets[1:-1] - 1] = 0.0  # from the end of a chain to the start of the next
    return np.asarray(np.bincount(chain, swept, graph.n_chains), np.float64)


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
