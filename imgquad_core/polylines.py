"""Nodes of the boundary that is meshed, and the two polylines through them: final edges, and coarse segments."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.clearance import CROSSING, find_conflicts, mark_sharp
from imgquad_core.curves import Curves, Ends, Flags, Floats, Ints
from imgquad_core.placement import Placement

_LEAST_SECTOR = np.radians(35.0)  # sharper sectors are blunted; tips of chains are rounded below 37 degrees


class Nodes(NamedTuple):
    """Nodes on the curves, with ids: ends of chains first, then the others chain by chain."""

    points: Floats  #: (n, 2)
    chain_points: Ints  #: ids of the nodes of every chain, in the order of `placed.at`
    placed: Placement


class Level(NamedTuple):
    """Polylines through all nodes (final edges), or through every second one (coarse)."""

    chain_points: Ints
    offsets: Ints
    segments: Ints  #: (m, 2)
    chain: Ints  #: (m,) chain of each segment
    at: Floats  #: places of the points on the curves


def number_nodes(curves: Curves, n_ends: int, xy: Floats, placed: Placement) -> Nodes:
    """Give ids to placed nodes at `xy`."""
    first, last = placed.offsets[:-1], placed.offsets[1:] - 1
    closed = curves.ends[:, 0] < 0
    is_inner = np.ones(len(xy), bool)
    is_inner[first[~closed]] = False
    is_inner[last] = False
    n_inner = int(np.count_nonzero(is_inner))
    ids = np.empty(len(xy), np.int64)
    ids[is_inner] = n_ends + np.arange(n_inner)
    ids[first[~closed]], ids[last[~closed]] = curves.ends[~closed].T
    ids[last[closed]] = ids[first[closed]]
    points = np.empty((n_ends + n_inner, 2))
    points[ids] = xy
    return Nodes(points, ids, placed)


def level_of(nodes: Nodes, step: int) -> Level:
    """Take every `step`-th node of each chain."""
    offsets = nodes.placed.offsets
    within = np.arange(offsets[-1]) - np.repeat(offsets[:-1], np.diff(offsets))
    taken = within % step == 0
    chain_points = nodes.chain_points[taken]
    counts = (np.diff(offsets) - 1) // step
    starts = np.concatenate([[0], np.cumsum(counts + 1)])
    pairs = np.stack([chain_points[:-1], chain_points[1:]], axis=1)
    inside = np.ones(len(pairs), bool)
    inside[starts[1:-1] - 1] = False
    chain = np.repeat(np.arange(len(counts)), counts)
    return Level(chain_points, starts, pairs[inside], chain, nodes.placed.at[taken])


def mark_conflicts(
    points: Floats, level: Level, ends: Ends, is_new: Flags, gently: bool, shape: tuple[int, int]
) -> NDArray[np.uint8]:
    """Mark the segments of a level that cross or touch; `gently` also those too close or at too sharp sectors.

    Only pairs with a segment on a chain of `is_new` are tested for the former.
    """
    marks = find_conflicts(points, level.segments, level.chain, is_new, shape)
    if gently:
        mark_sharp(points, level.chain_points, level.offsets, ends.offsets, ends.sockets, _LEAST_SECTOR, marks)
    else:
        marks[marks < CROSSING] = 0
    return marks


def any_of_chain(flags: Flags, offsets: Ints) -> Flags:
    """Tell for each chain whether any of its entries is flagged."""
    return np.logical_or.reduceat(flags, offsets[:-1])
