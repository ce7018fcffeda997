"""The outlines of the faces that are meshed together: every second, fourth or sixth point of the boundary chains.

A face is meshed coarser than its final edges. The Catmull-Clark split gives the points +, and where quads are split
once more at the end, in two or three each way, that gives the others:

    stride 6:  o--.--.--+--.--.--o
    stride 4:  o--.--+--.--o
    stride 2:  o--+--o
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.chains import chain_of_places, edges_of_chains, halved
from imgquad_core.geometry.conflicts import CROSSING, find_conflicts
from imgquad_core.model import VOID, BoundaryGraph, PointKind, QuadMesh

from .triangulation import Constraints, constraint_table

MOST_SHORT = 0.25  # share of the chains around a face that may be halved for the sake of stride 4
SHORTEST = 0.45  # edge that is halved for the sake of one face, over the mean edge around it


class Segments(NamedTuple):
    """Coarse segments of some chains, in ids of the boundary graph."""

    tail: Ints
    head: Ints
    middle: Ints  #: (m, 2), the point of the graph half-way between, or the two beside, from tail to head
    chain: Ints


class Outline(NamedTuple):
    """What is triangulated."""

    points: Floats  #: points used, in the order of their ids in the graph
    ids: Ints  #: their ids in the graph
    segments: Ints  #: (m, 2), places in `points`
    constraints: Constraints


def coarse_segments(graph: BoundaryGraph | QuadMesh, chains: Flags, stride: int) -> Segments:
    """Return the segments over `stride` edges each of the flagged chains, whose edges must be a multiple of it."""
    chosen = np.flatnonzero(chains)
    counts = (np.diff(graph.chain_offsets)[chosen] - 1) // stride
    chain = np.repeat(chosen, counts)
    nth = np.arange(len(chain)) - np.repeat(np.cumsum(counts) - counts, counts)
    place = graph.chain_offsets[chain] + stride * nth
    ids = graph.chain_points
    middle = np.stack([ids[place + stride // 2], ids[place + (stride + 1) // 2]], axis=1)
    return Segments(ids[place], ids[place + stride], middle, chain)


def chains_of(graph: BoundaryGraph, faces: Flags) -> Flags:
    """Return which chains bound a flagged face (region)."""
    padded = np.append(faces, False)  # VOID is the last entry
    return np.asarray(padded[graph.chain_regions].any(axis=1))


def outline(graph: BoundaryGraph, faces: Flags, stride: int) -> Outline:
    """Return the outline of the flagged faces."""
    segments = coarse_segments(graph, chains_of(graph, faces), stride)
    ids = np.unique(np.concatenate([segments.tail, segments.head]))
    tail, head = np.searchsorted(ids, segments.tail), np.searchsorted(ids, segments.head)
    regions = np.where(np.append(faces, False)[graph.chain_regions], graph.chain_regions, VOID)[segments.chain]
    table = constraint_table(len(ids), tail, head, regions[:, 0], regions[:, 1], segments.middle)
    return Outline(graph.points[ids], ids, np.stack([tail, head], axis=1), table)


def wide_faces(graph: BoundaryGraph, stride: int, least_width: float) -> Flags:
    """Return which faces can be meshed at a stride: edges divisible by it, no conflict of chords, wide enough.

    The width of a face is four times its area over its outline, in lengths of its segments.
    """
    fits = (edges_of_chains(graph) % stride == 0) & ~_cut_corners(graph, stride)
    segments = coarse_segments(graph, fits, stride)
    length = np.hypot(*(graph.points[segments.head] - graph.points[segments.tail]).T)
    wide = _width(graph, segments, length) >= least_width
    if not wide.any():
        return wide
    fits &= ~chains_in_conflict(graph, segments, np.ones(graph.n_chains, bool))
    for side in (0, 1):
        at = graph.chain_regions[:, side]
        wide[at[(at >= 0) & ~fits]] = False
    return wide & (_per_face(graph, edges_of_chains(graph) // stride) >= 4)


def _cut_corners(graph: BoundaryGraph, stride: int) -> Flags:
    """Return which chains have a corner between two points of their coarse segments."""
    chain = chain_of_places(graph)
    nth = np.arange(len(chain)) - graph.chain_offsets[chain]
    bad = np.zeros(graph.n_chains, bool)
    bad[chain[(nth % stride != 0) & (graph.point_kind[graph.chain_points] == PointKind.CORNER)]] = True
    return bad


def with_short_chains_halved(graph: BoundaryGraph, least_width: float) -> BoundaryGraph:
    """Return the graph with 4 edges on chains of 2, where nothing else keeps the faces beside them from stride 4.

    Where that is of use for the face on one side only, the edges must not be very short for it.
    """
    edges = edges_of_chains(graph)
    segments = coarse_segments(graph, edges % 4 == 0, 4)
    length = np.hypot(*(graph.points[segments.head] - graph.points[segments.tail]).T)
    hopeful = _width(graph, segments, length) >= least_width
    for side in (0, 1):
        at = graph.chain_regions[:, side]
        hopeful[at[(at >= 0) & (edges % 4 != 0) & (edges > 2)]] = False
    short = edges == 2
    share = _per_face(graph, short) / np.maximum(_per_face(graph, np.ones(graph.n_chains, bool)), 1)
    hopeful &= share <= MOST_SHORT
    usual = np.append(mean_edges(graph), 0.0)[graph.chain_regions].max(axis=1)
    for_both, for_one = np.append(hopeful, True)[graph.chain_regions].all(axis=1), chains_of(graph, hopeful)
    return halved(graph, short & (for_both | (for_one & (_lengths(graph) >= 2 * SHORTEST * usual))))


def _per_face(graph: BoundaryGraph, per_chain: NDArray[Any]) -> NDArray[Any]:
    """Sum a value of the chains around each face."""
    total = np.zeros(len(graph.region_label) + 1)
    for side in (0, 1):
        np.add.at(total, graph.chain_regions[:, side], per_chain)
    return total[:-1]


def chains_in_conflict(graph: BoundaryGraph, segments: Segments, new: Flags) -> Flags:
    """Return which chains have chords that cross, have no length, or join the same points as another chord.

    Crossings are looked for where at least one of both chords is on a new chain.
    """
    bad = np.zeros(graph.n_chains, bool)
    pairs = np.stack([segments.tail, segments.head], axis=1)
    marks = find_conflicts(graph.points, pairs, segments.chain, new, graph.shape)
    bad[segments.chain[marks == CROSSING]] = True
    pairs = np.sort(pairs, axis=1)
    _, first, count = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    bad[segments.chain[count[first.ravel()] > 1]] = True
    return bad


def mean_edges(graph: BoundaryGraph) -> Floats:
    """Return the mean length of the final edges around each face."""
    return np.asarray(_per_face(graph, _lengths(graph)) / np.maximum(_per_face(graph, edges_of_chains(graph)), 1))


def _lengths(graph: BoundaryGraph) -> Floats:
    """Return the length of each chain."""
    edges = coarse_segments(graph, np.ones(graph.n_chains, bool), 1)
    length = np.hypot(*(graph.points[edges.head] - graph.points[edges.tail]).T)
    return np.asarray(np.bincount(edges.chain, length, graph.n_chains), np.float64)


def _width(graph: BoundaryGraph, segments: Segments, length: Floats) -> Floats:
    """Return the width of each face in lengths of its segments."""
    around = _per_face(graph, np.bincount(segments.chain, length, graph.n_chains))
    count = _per_face(graph, np.bincount(segments.chain, minlength=graph.n_chains))
    edge = around / np.maximum(count, 1)
    return np.asarray(4.0 * graph.region_pixels / np.maximum(around * edge, 1e-9))
