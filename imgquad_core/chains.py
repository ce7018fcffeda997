"""Edits of a boundary graph that give another one, and the places of its chains."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .arrays import Flags, Floats, Ints
from .grouping import rows_of
from .model import VOID, BoundaryGraph, PointKind


class Places(NamedTuple):
    """Places of chains where a segment begins: all but the last one of each chain."""

    chain: Ints  #: (m,)
    at: Ints  #: (m,) index among all places
    here: Ints  #: (m,) id of the point there
    before: Ints  #: (m,) id of the one before; at the first place that before the last, which is right if it is closed
    after: Ints  #: (m,) id of the next one


def places_of(chain_points: Ints, offsets: Ints) -> Places:
    """Return the places of chains that have the points ``chain_points[offsets[c]:offsets[c + 1]]``."""
    at = np.delete(np.arange(len(chain_points)), offsets[1:] - 1)
    before = at - 1
    before[offsets[:-1] - np.arange(len(offsets) - 1)] = offsets[1:] - 2
    chain = rows_of(offsets, gaps=True)
    return Places(chain, at, chain_points[at], chain_points[before], chain_points[at + 1])


def edges_of_chains(graph: BoundaryGraph) -> Ints:
    """Return the number of edges of each chain."""
    return np.diff(graph.chain_offsets) - 1


def any_of_chain(flags: Flags, offsets: Ints) -> Flags:
    """Tell for each chain whether any of its entries is flagged."""
    return np.logical_or.reduceat(flags, offsets[:-1])


def halved(graph: BoundaryGraph, chains: Flags) -> BoundaryGraph:
    """Return the graph with a mid-point on every edge of the flagged chains, but for held ones."""
    return with_mid_points(graph, chains[chain_of_places(graph)])


def refined(graph: BoundaryGraph, points: Ints, reach: int) -> BoundaryGraph:
    """Return the graph with mid-points on the edges of the segments that these points are part of."""
    return with_mid_points(graph, near_segments(graph, points, reach))


def near_segments(graph: BoundaryGraph, points: Ints, reach: int) -> Flags:
    """Tell the entries of `chain_points` behind which is an edge of a segment that these points are part of.

    The `reach` segments before and after count, too. Chains keep their multiples of four if these edges are halved:
    they are the four edges of each stride-4 segment.
    """
    hit = np.zeros(len(graph.points), bool)
    hit[points] = True
    at = np.flatnonzero(hit[graph.chain_points])
    chain = chain_of_places(graph)[at]
    stride = np.where(edges_of_chains(graph)[chain] % 4 == 0, 4, 2)
    begin, end = graph.chain_offsets[chain], graph.chain_offsets[chain + 1] - 1
    into = (at - begin) % stride
    first = at - into - stride * (reach + (into == 0))  # between two segments: both
    split = np.zeros(len(graph.chain_points) + 1, np.int64)
    np.add.at(split, np.maximum(first, begin), 1)
    np.add.at(split, np.minimum(at - into + stride * (reach + 1), end), -1)
    return np.asarray(np.cumsum(split)[:-1] > 0)


def with_mid_points(graph: BoundaryGraph, split: Flags) -> BoundaryGraph:
    """Return the graph with a mid-point on the edges behind flagged entries of `chain_points`, but for held ones."""
    offsets, ids = graph.chain_offsets, graph.chain_points
    n, chain = len(graph.points), chain_of_places(graph)
    split = split.copy()
    split[offsets[1:] - 1] = False  # no edge behind the last point of a chain
    is_held = graph.point_kind[ids] >= PointKind.HELD
    split &= ~is_held & ~np.roll(is_held, -1)
    at = np.flatnonzero(split)
    new = n + np.arange(len(at))
    points = np.vstack([graph.points, 0.5 * (graph.points[ids[at]] + graph.points[ids[at + 1]])])
    straight = np.isin(graph.chain_regions, VOID).any(axis=1)[chain[at]]
    kind = np.where(straight & _on_frame(points[n:], graph.shape), 2, 0)
    counts = np.diff(offsets) + np.bincount(chain[at], minlength=graph.n_chains)
    return BoundaryGraph(
        points,
        np.concatenate([graph.point_kind, kind]),
        np.concatenate([[0], np.cumsum(counts)]),
        np.insert(ids, at + 1, new),
        graph.chain_regions,
        graph.region_label,
        graph.region_pixels,
        graph.shape,
    )


def with_chains_of(graph: BoundaryGraph, finer: BoundaryGraph, chains: Flags) -> BoundaryGraph:
    """Return `finer` with the chains of `graph` but for the flagged ones; points of the others stay, unused."""
    start = np.where(chains, len(graph.chain_points) + finer.chain_offsets[:-1], graph.chain_offsets[:-1])
    counts = np.where(chains, np.diff(finer.chain_offsets), np.diff(graph.chain_offsets))
    offsets = np.concatenate([[0], np.cumsum(counts)])
    place = np.repeat(start - offsets[:-1], counts) + np.arange(offsets[-1])
    points = np.concatenate([graph.chain_points, finer.chain_points])[place]
    return replace(finer, chain_offsets=offsets, chain_points=points)


def without_unused_points(graph: BoundaryGraph) -> tuple[BoundaryGraph, Ints]:
    """Return the graph without points that no chain has, and the new id of each point."""
    used = np.zeros(len(graph.points), bool)
    used[graph.chain_points] = True
    place = np.cumsum(used) - 1
    points, kind = graph.points[used], graph.point_kind[used]
    return replace(graph, points=points, point_kind=kind, chain_points=place[graph.chain_points]), place


def chain_of_places(graph: BoundaryGraph) -> Ints:
    """Return the chain of each entry of `chain_points`."""
    return rows_of(graph.chain_offsets)


def _on_frame(points: Floats, shape: tuple[int, int]) -> Flags:
    rows, cols = shape
    x, y = points.T
    return np.asarray((x == 0) | (x == cols) | (y == 0) | (y == rows))
