"""Smoothed boundaries around the faces of a tile, with one writer for every point.

    owner of a chain      the lowest tile beside it
    owner of a junction   the lowest tile around it

Each tile computes all chains around its faces, in a window wide enough for that; of those it does not own it copies
the nodes. A chain is found in the owner's file by the pixel corner or side it starts from and the next one: they are
the same in every window. Junctions where faces of several tiles meet are never joined, so both tiles have all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Bytes, Flags, Floats, Ints, Labels
from imgquad_core.boundary import ExtractionOptions, SmoothingOptions, extract_boundaries, smooth_chains
from imgquad_core.model import VOID, BoundaryGraph, LabelImage, Materials, PointKind

from .crossings import join_crossings
from .grid import Box
from .regions import Keys, Regions

LONGEST = 16.0  #: px between two tiles that a boundary takes to cross their seam, at one node
NOBODY = np.iinfo(np.int64).max  #: owner of what is not meshed

#: for keys of shared chains, some of their edges
EdgesOf = Mapping[tuple[int, ...], Collection[int]]


class Outlines(NamedTuple):
    """All chains around the faces of one tile. Coordinates are those of the picture, y up from its lower edge."""

    points: Floats
    kind: Bytes
    offsets: Ints
    ids: Ints
    sides: Ints  #: (n_chains, 2) face on the left and right, -1 for one of another tile or none
    owner: Ints  #: (n_chains,)
    shared: Flags  #: (n_chains,) between faces of two tiles
    closed: Flags  #: (n_chains,) without a junction
    seam: Flags  #: (n_chains,) between two pieces of one region
    key: Ints  #: (n_chains, 4) where it starts and goes on: doubled row and column in the picture
    node: Ints  #: (m, 4) end of chains where several tiles meet: id, owner, doubled row and column
    region: Ints  #: (n_faces,)
    label: Labels  #: (n_faces,)
    pixels: Ints  #: (n_faces,)
    window: Ints  #: (4,) left, upper, right, lower bound of what the tile sees


def outlines_of(
    t: int,
    keys: Keys,
    window: Box,
    n_rows: int,
    regions: Regions,
    extraction: ExtractionOptions,
    smoothing: SmoothingOptions,
) -> Outlines:
    """Return the chains around the faces of tile `t`.

    Parameters
    ----------
    t : int
        The tile.
    keys : Keys
        Of its window.
    window : tuple of int
        Left, upper, right, lower bound of the window in the picture.
    n_rows : int
        Of the picture.
    regions : Regions
        Of the picture.
    extraction, smoothing
        Options of these stages.
    """
    pixels, key_of = _extracted(keys, regions, extraction)
    owners = np.append(keys.tile[key_of], NOBODY)[pixels.chain_regions]
    beside = np.append(keys.region[key_of], -1)[pixels.chain_regions]
    is_seam = (beside[:, 0] == beside[:, 1]) & (owners[:, 0] != owners[:, 1])
    raw, left = join_crossings(pixels, beside, owners, LONGEST)
    owners, is_seam = owners[left], is_seam[left]
    ends = np.stack([raw.chain_points[raw.chain_offsets[:-1]], raw.chain_points[raw.chain_offsets[1:] - 1]], axis=1)
    low, high = _owners_at(raw, ends, owners)
    smooth, which = smooth_chains(raw, smoothing, barred=(low != high)[ends].any(axis=1), seams=is_seam)
    mine = (keys.tile[key_of] == t)[np.maximum(smooth.chain_regions, 0)] & (smooth.chain_regions >= 0)
    kept = np.flatnonzero(mine.any(axis=1))
    which, owners = which[kept], owners[which[kept]]
    faces = np.flatnonzero(keys.tile[key_of] == t)
    face = np.full(len(key_of) + 1, VOID, np.int64)
    face[faces] = np.arange(len(faces))
    shared = (owners[:, 0] != owners[:, 1]) & (owners != NOBODY).all(axis=1)
    offsets, ids, old = _compressed(smooth, kept)
    shift = np.array([window[0], n_rows - window[3]], float)
    start = pixels.chain_offsets[left[which]]
    key = np.hstack([_doubled(pixels, window, pixels.chain_points[start + k]) for k in (0, 1)])
    at_ends = np.stack([ids[offsets[:-1]], ids[offsets[1:] - 1]], axis=1)
    fixed = np.isin(raw.point_kind, (PointKind.JUNCTION, PointKind.CORNER))
    closed = ~fixed[ends[which, 0]]
    mixed = (low != high)[ends[which]] & ~closed[:, None]
    here, first = np.unique(at_ends[mixed], return_index=True)
    origin = ends[which][mixed][first]
    return Outlines(
        points=smooth.points[old] + shift,
        kind=smooth.point_kind[old],
        offsets=offsets,
        ids=ids,
        sides=face[smooth.chain_regions[kept]],
        owner=owners.min(axis=1),
        shared=shared,
        closed=closed,
        seam=is_seam[which],
        key=key,
        node=np.column_stack([here, low[origin], _doubled(pixels, window, origin)]),
        region=keys.region[key_of[faces]],
        label=np.asarray(raw.region_label[faces]),
        pixels=np.asarray(smooth.region_pixels[faces]),
        window=np.array(window),
    )


def _extracted(keys: Keys, regions: Regions, extraction: ExtractionOptions) -> tuple[BoundaryGraph, Ints]:
    """Return the pixel boundary of a window, with the materials of its regions, and the key of each region."""
    nobody = Materials(np.empty(0, np.int32), (), np.empty((0, 3), np.uint8))
    raw = extract_boundaries(LabelImage(keys.pixels, nobody), extraction)
    key_of = np.asarray(raw.region_label, np.int64)
    return replace(raw, region_label=regions.label[keys.region[key_of]]), key_of


def _doubled(raw: BoundaryGraph, window: Box, points: Ints) -> NDArray[np.int64]:
    """Return twice the row and column of points in the picture: whole numbers."""
    x, y = raw.points[points].T
    rows_columns = np.rint(2 * np.stack([raw.shape[0] - y, x], axis=1)).astype(np.int64)
    return np.asarray(rows_columns + np.array([2 * window[1], 2 * window[0]]))


def _owners_at(raw: BoundaryGraph, ends: Ints, owners: Ints) -> tuple[Ints, Ints]:
    """Return the lowest and the highest owner of the faces around each end of chains."""
    low, high = np.full(len(raw.points), NOBODY), np.full(len(raw.points), -1)
    for side in (0, 1):
        np.minimum.at(low, ends[:, side], owners.min(axis=1))
        known = np.where(owners == NOBODY, -1, owners).max(axis=1)
        np.maximum.at(high, ends[:, side], known)
    return low, high


def _compressed(graph: BoundaryGraph, kept: Ints) -> tuple[Ints, Ints, Ints]:
    """Return offsets and ids of some chains, and the old ids of their points."""
    counts = np.diff(graph.chain_offsets)[kept]
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    places = np.repeat(graph.chain_offsets[kept] - offsets[:-1], counts) + np.arange(offsets[-1])
    old, ids = np.unique(graph.chain_points[places], return_inverse=True)
    return offsets, ids.ravel().astype(np.int64), old


def settled(t: int, mine: Outlines, others: Callable[[int], Outlines], halved: Sequence[EdgesOf] = ()) -> Outlines:
    """Return a tile's outlines with the nodes that other tiles own copied from them, and shared ones held.

    Parameters
    ----------
    t : int
        The tile.
    mine : Outlines
        As it computed them.
    others : callable
        Returns the outlines of another tile.
    halved : sequence of mapping
        For keys of shared chains, which of their edges get a mid-point: on both sides alike, one after the other.

    Raises
    ------
    KeyError
        Another tile does not have a chain or junction that it owns.
    """
    if not len(mine.owner):
        return mine
    known = {int(o): _Index.of(others(int(o))) for o in np.unique(np.append(mine.owner, mine.node[:, 1])) if o != t}
    points = mine.points.copy()
    for at, owner, row, column in mine.node.tolist():
        if owner != t:
            points[at] = known[owner].nodes[(row, column)]
    kind = mine.kind
    new_points, new_kind, new_ids, counts = [points], [kind], [], []
    n = len(points)
    for c in range(len(mine.offsets) - 1):
        ids = mine.ids[mine.offsets[c] : mine.offsets[c + 1]]
        if mine.shared[c]:
            if mine.owner[c] == t:
                inner, inner_kind = points[ids], kind[ids]
            else:
                inner, inner_kind = known[int(mine.owner[c])].chains[tuple(mine.key[c].tolist())]
            for edges in halved:
                at = sorted(edges.get(tuple(mine.key[c].tolist()), ()))
                inner, inner_kind = _halved(inner, inner_kind, np.array(at, np.int64))
            loop = mine.closed[c]
            inner, inner_kind = (inner[:-1], inner_kind[:-1]) if loop else (inner[1:-1], inner_kind[1:-1])
            new = n + np.arange(len(inner))
            n += len(inner)
            new_points.append(inner)
            held = PointKind.SEAM if mine.seam[c] else PointKind.HELD
            new_kind.append(np.where(inner_kind == PointKind.CORNER, PointKind.CORNER, held).astype(np.uint8))
            ids = np.append(new, new[:1]) if loop else np.concatenate([ids[:1], new, ids[-1:]])
        new_ids.append(ids)
        counts.append(len(ids))
    return mine._replace(
        points=np.concatenate(new_points),
        kind=np.concatenate(new_kind),
        ids=np.concatenate(new_ids),
        offsets=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
    )


def _halved(points: Floats, kind: Bytes, edges: Ints) -> tuple[Floats, Bytes]:
    """Return a chain with a mid-point on some edges."""
    middle = 0.5 * (points[edges] + points[edges + 1])
    return np.insert(points, edges + 1, middle, axis=0), np.insert(kind, edges + 1, PointKind.HELD)


class _Index(NamedTuple):
    """Where to find what a tile owns."""

    nodes: Mapping[tuple[int, int], Floats]
    chains: Mapping[tuple[int, ...], tuple[Floats, Bytes]]

    @staticmethod
    def of(outlines: Outlines) -> _Index:
        nodes = {(row, column): outlines.points[at] for at, _, row, column in outlines.node.tolist()}
        chains = {}
        for c in np.flatnonzero(outlines.shared):
            ids = outlines.ids[outlines.offsets[c] : outlines.offsets[c + 1]]
            chains[tuple(outlines.key[c].tolist())] = (outlines.points[ids], outlines.kind[ids])
        return _Index(nodes, chains)


def corner_of(outlines: Outlines, n_rows: int) -> Floats:
    """Return x and y of the lower left corner of what a tile sees."""
    return np.array([outlines.window[0], n_rows - outlines.window[3]], float)


def graph_of(outlines: Outlines, n_rows: int) -> BoundaryGraph:
    """Return the boundary of a tile's faces, in the coordinates of its window."""
    left, upper, right, lower = outlines.window.tolist()
    return BoundaryGraph(
        outlines.points - corner_of(outlines, n_rows),
        outlines.kind,
        outlines.offsets,
        outlines.ids,
        outlines.sides,
        outlines.label,
        outlines.pixels,
        (lower - upper, right - left),
    )
