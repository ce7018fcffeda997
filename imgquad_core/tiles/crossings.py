r"""Places where boundaries cross seams: one node, not two with a short chain between them.

Where a boundary runs along the line of tiles from one side of it to the other, pixels make two nodes of that::

        |                         |                  |   seam, straight down
    ____a                         |                      boundary from left to right
        |          =>       ------m------            a, b: nodes that pixels give
        b____                     |                  m   halfway: the one that takes their place
        |                         |

The edges between a and b would be far below the size that is asked for, and stay when the seam is gone. What is joined
hangs on the pixels there alone, so all tiles that see the place join it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Floats, Ints
from imgquad_core.geometry.conflicts import snapped
from imgquad_core.model import VOID, BoundaryGraph, PointKind

STEP = 0.5  #: px between points on the way to a node, at most


class Crossed(NamedTuple):
    """A pixel boundary, and which chains of the one before are left."""

    graph: BoundaryGraph
    which: Ints  #: (n_chains,)


def join_crossings(raw: BoundaryGraph, regions: Ints, owners: Ints, longest: float) -> Crossed:
    """Join the two nodes at each end of short chains along a line of tiles.

    Parameters
    ----------
    raw : BoundaryGraph
        Pixel boundary.
    regions : int64, shape (n_chains, 2)
        Regions of the picture on both sides of each chain: the same one on both sides of a seam.
    owners : int64, shape (n_chains, 2)
        Tiles on both sides of each chain.
    longest : float
        Chains above this length stay, px.

    Returns
    -------
    Crossed
        Of two nodes the upper, or left, one keeps its id, at its new place.
    """
    chains = [raw.chain_points[a:b] for a, b in zip(raw.chain_offsets[:-1], raw.chain_offsets[1:], strict=True)]
    points, gone, into = raw.points.copy(), np.zeros(len(chains), bool), {}
    for c in _crossings(raw, regions, owners, longest).tolist():
        a, b = sorted((int(chains[c][0]), int(chains[c][-1])), key=lambda p: (-raw.points[p, 1], raw.points[p, 0]))
        points[[a, b]] = 0.5 * (raw.points[a] + raw.points[b])
        gone[c], into[a], into[b] = True, a, a
    which = np.flatnonzero(~gone)
    parts, ids, n = [points], [], len(points)
    for chain in (chains[c] for c in which.tolist()):
        ends = [into.get(int(p), int(p)) for p in chain[[0, -1]]]
        if into.keys() & {int(chain[0]), int(chain[-1])}:
            inner = _inner(raw.points[chain], points[ends])
            parts.append(inner)
            chain = np.concatenate([ends[:1], n + np.arange(len(inner)), ends[1:]]).astype(np.int64)
            n += len(inner)
        ids.append(chain)
    more = np.full(n - len(points), PointKind.FREE, np.uint8)
    joined = replace(
        raw,
        points=np.concatenate(parts),
        point_kind=np.concatenate([raw.point_kind, more]),
        chain_offsets=np.concatenate([[0], np.cumsum([len(chain) for chain in ids])]),
        chain_points=np.concatenate(ids),
        chain_regions=raw.chain_regions[which],
    )
    return Crossed(joined, which)


def _crossings(raw: BoundaryGraph, regions: Ints, owners: Ints, longest: float) -> Ints:
    """Find the short chains along a line of tiles, with one seam at each of their two ends."""
    first, last = raw.chain_points[raw.chain_offsets[:-1]], raw.chain_points[raw.chain_offsets[1:] - 1]
    n, is_seam = len(raw.points), (regions[:, 0] == regions[:, 1]) & (owners[:, 0] != owners[:, 1])
    of_seam = np.full(n, -1)
    of_seam[first[is_seam]] = of_seam[last[is_seam]] = regions[is_seam, 0]
    degree, seams = (np.bincount(np.append(first[of], last[of]), minlength=n) for of in (slice(None), is_seam))
    on_border = np.zeros(n, bool)
    outer = (raw.chain_regions == VOID).any(axis=1)
    on_border[first[outer]] = on_border[last[outer]] = True
    low, high = np.full(n, np.iinfo(np.int64).max), np.full(n, -1)
    for ends in (first, last):
        np.minimum.at(low, ends, owners.min(axis=1))
        np.maximum.at(high, ends, owners.max(axis=1))
    plain = (raw.point_kind == PointKind.JUNCTION) & (degree == 3) & (seams == 1) & ~on_border
    way = np.abs(raw.points[last] - raw.points[first])
    found = ~is_seam & (owners[:, 0] != owners[:, 1]) & plain[first] & plain[last] & (first != last)
    found &= (way.min(axis=1) == 0.0) & (way.max(axis=1) <= longest)
    found &= of_seam[first] != of_seam[last]  # else the boundary turns back from the line
    found &= (low[first] == low[last]) & (high[first] == high[last])
    of_chain = owners.min(axis=1), owners.max(axis=1)
    return np.flatnonzero(found & (low[first] == of_chain[0]) & (high[first] == of_chain[1]))


def _inner(xy: Floats, ends: Floats) -> Floats:
    """Return the points inside a chain, with a straight way to each end that was moved."""
    before = _way(xy[1], ends[0])[::-1] if (xy[0] != ends[0]).any() else xy[:0]
    after = _way(xy[-2], ends[1]) if (xy[-1] != ends[1]).any() else xy[:0]
    return np.concatenate([before, xy[1:-1], after])


def _way(start: Floats, stop: Floats) -> Floats:
    """Return the points between two."""
    n = max(int(np.ceil(np.hypot(*(stop - start)) / STEP)), 1)
    return snapped(start + np.arange(1, n)[:, None] / n * (stop - start))
