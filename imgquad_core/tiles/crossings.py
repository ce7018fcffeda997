r"""Places where boundaries cross seams: one node, not two with a short chain between them.

Where the way along which tiles part crosses a boundary, it follows that for some pixels, which make two nodes::

        |                         |                  |   seam, straight down
    ____a                         |                      boundary from left to right
        |          =>       ------m------            a, b: nodes that pixels give
        b____                     |                  m   halfway: the one that takes their place
        |                         |

The edges between a and b would be far below the size that is asked for, and stay when the seam is gone. What is joined
hangs on the pixels there alone, so all tiles that see the place join it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.geometry.conflicts import snapped
from imgquad_core.model import VOID, BoundaryGraph, PointKind

GAP = 0.25  #: px between a seam and the pixel boundary that it follows to the crossing


class Crossed(NamedTuple):
    """A pixel boundary, and which chains of the one before are left."""

    graph: BoundaryGraph
    which: Ints  #: (n_chains,)


def join_crossings(raw: BoundaryGraph, regions: Ints, owners: Ints, longest: float) -> Crossed:
    """Join the two nodes at each end of short chains along which tiles part.

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
    is_seam = (regions[:, 0] == regions[:, 1]) & (owners[:, 0] != owners[:, 1])
    points, gone, into, tail = raw.points.copy(), np.zeros(len(chains), bool), {}, {}
    for c, left_first in _crossings(raw, regions, owners, is_seam, longest):
        way, half = raw.points[chains[c]], len(chains[c]) // 2
        first, last = int(chains[c][0]), int(chains[c][-1])
        a = min(first, last, key=lambda p: (-raw.points[p, 1], raw.points[p, 0]))
        points[[first, last]] = way[half]
        gone[c], into[first], into[last] = True, a, a
        tail[first, False], tail[last, False] = way[:half], way[:half:-1]
        tail[first, True] = _beside(way, left_first)[: max(half - 1, 0)]
        tail[last, True] = _beside(way, not left_first)[: half - 1 : -1]
    which = np.flatnonzero(~gone)
    parts, ids, n = [points], [], len(points)
    for c in which.tolist():
        chain, seam = chains[c], bool(is_seam[c])
        first, last = int(chain[0]), int(chain[-1])
        if into.keys() & {first, last}:
            none = points[:0]
            inner = [tail.get((first, seam), none)[::-1], raw.points[chain[1:-1]], tail.get((last, seam), none)]
            parts += inner
            new = n + np.arange(sum(map(len, inner)))
            chain = np.array([into.get(first, first), *new, into.get(last, last)])
            n += len(new)
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


def _crossings(
    raw: BoundaryGraph, regions: Ints, owners: Ints, is_seam: Flags, longest: float
) -> Iterator[tuple[int, bool]]:
    """Give short chains between two tiles with a seam at each end; tell whether the first one is on the left."""
    first, last = raw.chain_points[raw.chain_offsets[:-1]], raw.chain_points[raw.chain_offsets[1:] - 1]
    n = len(raw.points)
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
    length = np.add.reduceat(np.append(_steps(raw), 0.0), raw.chain_offsets[:-1])
    found = ~is_seam & (owners[:, 0] != owners[:, 1]) & plain[first] & plain[last] & (first != last)
    found &= length <= longest
    found &= of_seam[first] != of_seam[last]  # else the boundary turns back from where tiles part
    found &= (low[first] == low[last]) & (high[first] == high[last])
    of_chain = owners.min(axis=1), owners.max(axis=1)
    for c in np.flatnonzero(found & (low[first] == of_chain[0]) & (high[first] == of_chain[1])).tolist():
        yield c, bool(regions[c, 0] == of_seam[first[c]])


def _beside(way: Floats, left: bool) -> Floats:
    """Return the points inside a polyline, moved a little to its left or right: seams touch no boundary."""
    steps = np.diff(way, axis=0)
    normal = np.stack([-steps[:, 1], steps[:, 0]], axis=1) / np.hypot(*steps.T)[:, None]
    return snapped(way[1:-1] + (GAP if left else -GAP) * 0.5 * (normal[:-1] + normal[1:]))


def _steps(raw: BoundaryGraph) -> Floats:
    """Return how far it is from each place of the chains to the next one: 0 at their ends."""
    steps = np.hypot(*np.diff(raw.points[raw.chain_points], axis=0).T)
    steps[raw.chain_offsets[1:-1] - 1] = 0.0
    return np.asarray(steps)
