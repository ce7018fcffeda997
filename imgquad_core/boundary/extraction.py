"""Step 2 of the paper: the boundaries between all colours, as chains of points from junction to junction.

Four pixels around a pixel corner, and the sides where their colours differ (paper, Fig. 2)::

      A | B          U
     ---+---       L + R        the outside of the picture is one more colour
      C | D          D

    two sides     the chain passes: straight on through the corner, or bent from mid-side to mid-side
    three sides   junction at the corner
    four sides    one diagonal of one colour: it is joined, two chains pass beside it
                  both diagonals: `ExtractionOptions.policy` says which is joined
                  none: junction of four colours       (all of it: `imgquad_core.geometry.corner_rule`)

Regions are labelled from the same table, so the faces between the chains are the regions by construction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Bytes, Floats, Ints, Labels
from imgquad_core.errors import InputError
from imgquad_core.geometry.corner_rule import PAIR_AD, PAIR_BC, corner_rule, joined_pair
from imgquad_core.grouping import root_of, unite
from imgquad_core.jit import kernel, verb
from imgquad_core.model import VOID, BoundaryGraph, LabelImage, PointKind

from .options import ExtractionOptions

Box = tuple[int, int, int, int]
OUTSIDE = -2  #: colour of what lies around the picture
# One byte for each pixel corner: bits 0-3 the sides with two colours, bits 4-5 what the chains do there,
# bits 6-7 whether the side to the right and the side below have been traced.
_UP, _RIGHT, _DOWN, _LEFT = 1, 2, 4, 8
_MEETS, _JOINS_AD, _JOINS_BC = 16, 32, 48
_WHAT = 48
_SEEN_RIGHT, _SEEN_DOWN = 64, 128


class _Chains(NamedTuple):
    """What `_trace_chains` gives: doubled picture coordinates (row, column) of all points, chain by chain."""

    places: Labels  # (n, 2)
    offsets: Ints
    ends: Ints  # corner number at either end of each chain, -1 where closed
    sides: Ints  # region left and right of each chain


def extract_boundaries(image: LabelImage, options: ExtractionOptions | None = None) -> BoundaryGraph:
    """Extract the pixel boundary between all regions of a label image.

    Parameters
    ----------
    image : LabelImage
        The picture. Pixels of label `VOID` belong to no region; boundaries between them and the outside are left out.
    options : ExtractionOptions, optional
        What to do with ambiguous places.

    Returns
    -------
    BoundaryGraph
        Chains through mid-sides and corners of pixels, 0.5 to 0.707 px apart. Chains end where three or more of
        them meet (kind JUNCTION) and at the four corners of the picture (CORNER); a closed chain has neither.
        Regions are numbered in the order of their first pixel, row by row from the top.

    Raises
    ------
    InputError
        If the picture has no pixel, or none with a material.
    """
    options = options or ExtractionOptions()
    labels = image.labels
    if labels.size == 0 or labels.max() < 0:
        raise InputError(f"picture of {labels.shape[0]} x {labels.shape[1]} pixels has none with a material to mesh")
    rule = corner_rule(options.policy, options.step)
    code = _classify_corners(np.pad(labels, 1, constant_values=OUTSIDE), rule)
    starts = np.flatnonzero(code[:-1, :-1] & _DOWN)
    rows = np.searchsorted(starts, np.arange(labels.shape[0] + 1) * labels.shape[1])
    run_region, first_run = _label_runs(code, labels, starts, rows)
    run_pixels = np.diff(starts, append=labels.size)
    inside = run_region >= 0
    return _graph(
        _trace_chains(code, starts, rows, run_region, _count_sides(code)),
        labels.ravel()[starts[first_run]],
        np.bincount(run_region[inside], run_pixels[inside], len(first_run)).astype(np.int64),
        image.shape,
    )


def label_regions(labels: Labels, box: Box, options: ExtractionOptions | None = None) -> Labels:
    """Number the regions within a part of a picture, as `extract_boundaries` would tell them.

    Parameters
    ----------
    labels : int32, shape (n_rows, n_cols)
        Labels of the part and of what lies around it: `REACH` data points at least, where the picture goes on.
    box : tuple of int
        Left, upper, right, lower bound of the part.
    options : ExtractionOptions, optional
        What to do with ambiguous places.

    Returns
    -------
    int32
        Number of each pixel's region by first pixels, -1 where it is `VOID`.
    """
    options = options or ExtractionOptions()
    left, upper, right, lower = box
    code = _classify_corners(np.pad(labels, 1, constant_values=OUTSIDE), corner_rule(options.policy, options.step))
    part, code = np.ascontiguousarray(labels[upper:lower, left:right]), code[upper : lower + 1, left : right + 1].copy()
    code[:, 0] |= np.uint8(_DOWN)  # a run begins at the left of the part
    starts = np.flatnonzero(code[:-1, :-1] & _DOWN)
    rows = np.searchsorted(starts, np.arange(part.shape[0] + 1) * part.shape[1])
    run_region, _ = _label_runs(code, part, starts, rows)
    return np.repeat(run_region, np.diff(starts, append=part.size)).astype(np.int32).reshape(part.shape)


def _count_sides(code: Bytes) -> int:
    return int(np.count_nonzero(code & _RIGHT) + np.count_nonzero(code & _DOWN))


def _graph(chains: _Chains, region_label: Labels, region_pixels: Ints, shape: tuple[int, int]) -> BoundaryGraph:
    """Put the points into a graph: chain ends first, in the order of their corners, then the others chain by chain."""
    places, offsets, ends, sides = chains
    closed = ends[:, 0] < 0
    nodes, at = np.unique(ends[~closed], return_inverse=True)
    is_end = np.zeros(len(places), bool)
    is_end[offsets[:-1]] = ~closed
    is_end[offsets[1:] - 1] = True
    ids = np.empty(len(places), np.int64)
    ids[~is_end] = len(nodes) + np.arange(np.count_nonzero(~is_end))
    ids[offsets[:-1][~closed]], ids[offsets[1:][~closed] - 1] = at.reshape(-1, 2).T
    ids[offsets[1:][closed] - 1] = ids[offsets[:-1][closed]]
    doubled = np.empty((int(ids.max()) + 1, 2), np.int64)
    doubled[ids] = places
    points = np.stack([doubled[:, 1] / 2, shape[0] - doubled[:, 0] / 2], axis=1)
    return BoundaryGraph(
        points, _kinds(points, len(nodes), shape), offsets, ids, sides, region_label, region_pixels, shape
    )


def _kinds(points: Floats, n_nodes: int, shape: tuple[int, int]) -> Bytes:
    on_side = (points[:, 0] == 0) | (points[:, 0] == shape[1])
    on_end = (points[:, 1] == 0) | (points[:, 1] == shape[0])
    kind = np.full(len(points), PointKind.FREE, np.uint8)
    kind[on_side | on_end] = PointKind.FRAME
    kind[:n_nodes] = PointKind.JUNCTION
    kind[on_side & on_end] = PointKind.CORNER
    return kind


@kernel
def _classify_corners(padded: Labels, rule: int) -> Bytes:
    n, m = padded.shape[0] - 1, padded.shape[1] - 1
    code = np.zeros((n, m), np.uint8)
    for i in range(n):
        for j in range(m):
            a, b, c, d = padded[i, j], padded[i, j + 1], padded[i + 1, j], padded[i + 1, j + 1]
            if a == b and c == d and a == c:
                continue
            up, right, down, left = a != b, b != d, c != d, a != c
            bits = up * _UP + right * _RIGHT + down * _DOWN + left * _LEFT
            n_sides = int(up) + int(right) + int(down) + int(left)
            if n_sides == 3 or (n_sides == 2 and (i == 0 or i == n - 1) and (j == 0 or j == m - 1)):
                bits += _MEETS
            elif n_sides == 4:
                pair = joined_pair(padded, i + 1, j + 1, rule)
                bits += _JOINS_AD if pair == PAIR_AD else (_JOINS_BC if pair == PAIR_BC else _MEETS)
            code[i, j] = bits
    return code


@kernel
def _label_runs(code: Bytes, labels: Labels, starts: Ints, rows: Ints) -> tuple[Ints, Ints]:
    """Region of each run of equal pixels in a row (-1 for void ones), and the first run of each region."""
    n_rows, n_cols = labels.shape
    parent = np.empty(len(starts), np.int64)
    for k in range(len(starts)):
        parent[k] = k
    for i in range(1, n_rows):
        above, here = rows[i - 1], rows[i]
        base_above, base = (i - 1) * n_cols, i * n_cols
        while above < rows[i] and here < rows[i + 1]:
            first = max(starts[above] - base_above, starts[here] - base)
            if code[i, first] & _RIGHT == 0:
                unite(parent, above, here)
            end_above = starts[above + 1] - base_above if above + 1 < rows[i] else n_cols
            end = starts[here + 1] - base if here + 1 < rows[i + 1] else n_cols
            if end_above == end and end < n_cols:
                what = code[i, end] & _WHAT
                if what == _JOINS_AD:
                    unite(parent, above, here + 1)
                elif what == _JOINS_BC:
                    unite(parent, above + 1, here)
            above += end_above <= end
            here += end <= end_above
    region = np.full(len(starts), -1, np.int64)
    first_run = np.empty(len(starts), np.int64)
    n_regions = 0
    for k in range(len(starts)):
        if labels[starts[k] // n_cols, starts[k] % n_cols] < 0:
            continue
        root = root_of(parent, k)
        if root == k:
            region[k] = n_regions
            first_run[n_regions] = k
            n_regions += 1
        else:
            region[k] = region[root]
    return region, first_run[:n_regions].copy()


@verb
def _region_at(starts: Ints, rows: Ints, region: Ints, n_cols: int, i: int, j: int) -> int:
    if i < 0 or i >= len(rows) - 1 or j < 0 or j >= n_cols:
        return VOID
    low, high = rows[i], rows[i + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if starts[middle] <= i * n_cols + j:
            low = middle
        else:
            high = middle
    return int(region[low])


@verb
def _leave(code: int, came_from: int) -> int:
    """Give the side (0 up, 1 right, 2 down, 3 left) by which a chain leaves a corner, from the one it came by."""
    what = code & _WHAT
    if what == _JOINS_AD:  # up with right, down with left
        return came_from ^ 1
    if what == _JOINS_BC:  # up with left, right with down
        return 3 - came_from
    rest = (code & 15) & ~(1 << came_from)
    return 0 if rest == 1 else 1 if rest == 2 else 2 if rest == 4 else 3


@verb
def _see(code: Bytes, i: int, j: int, side: int) -> bool:
    """Mark a side as traced, and tell whether it was before."""
    if side == 0:
        i -= 1
    elif side == 3:
        j -= 1
    bit = np.uint8(_SEEN_DOWN if side % 2 == 0 else _SEEN_RIGHT)
    seen = bool(code[i, j] & bit != 0)
    code[i, j] |= bit
    return seen


@verb
def _follow(code: Bytes, i: int, j: int, side: int, places: Labels, n: int) -> tuple[int, int]:
    """Append the points from corner (i, j) along `side` up to a junction; gives their number and its corner."""
    while True:
        di, dj = (side == 2) - (side == 0), (side == 1) - (side == 3)
        places[n, 0], places[n, 1] = 2 * i + di, 2 * j + dj
        n += 1
        if _see(code, i, j, side):
            return n, -1
        i, j = i + di, j + dj
        if code[i, j] & _WHAT == _MEETS:
            places[n, 0], places[n, 1] = 2 * i, 2 * j
            return n + 1, i * code.shape[1] + j
        onward = _leave(code[i, j], (side + 2) % 4)
        if onward == side:
            places[n, 0], places[n, 1] = 2 * i, 2 * j
            n += 1
        side = onward


@verb
def _is_seen(code: Bytes, i: int, j: int, side: int) -> bool:
    bit = _SEEN_DOWN if side % 2 == 0 else _SEEN_RIGHT
    return bool(code[i - (side == 0), j - (side == 3)] & bit != 0)


@kernel
def _trace_chains(
    code: Bytes,
    starts: Ints,
    rows: Ints,
    region: Ints,
    n_sides: int,
) -> _Chains:
    """Trace all chains: first those that start at junctions, then the closed ones."""
    n, m = code.shape
    places = np.empty((3 * n_sides + 3, 2), np.int32)
    offsets = np.zeros(n_sides + 1, np.int64)
    ends = np.empty((n_sides, 2), np.int64)
    sides = np.empty((n_sides, 2), np.int64)
    count = 0
    for closed in range(2):
        for i in range(n):
            for j in range(m):
                here = code[i, j]
                if here & 15 == 0 or (not closed and here & _WHAT != _MEETS):
                    continue
                for side in range(4):
                    if here & (1 << side) == 0 or _is_seen(code, i, j, side):
                        continue
                    k = offsets[count]
                    if not closed:
                        places[k, 0], places[k, 1] = 2 * i, 2 * j
                        k += 1
                    k, end = _follow(code, i, j, side, places, k)
                    outer = side == 0 or side == 3
                    left = _region_at(starts, rows, region, m - 1, i - (side < 2), j - outer)
                    right = _region_at(starts, rows, region, m - 1, i - outer, j - (side >= 2))
                    if left >= 0 or right >= 0:
                        offsets[count + 1] = k
                        ends[count, 0], ends[count, 1] = -1 if closed else i * m + j, end
                        sides[count, 0], sides[count, 1] = left, right
                        count += 1
    n_places = offsets[count]
    return _Chains(places[:n_places].copy(), offsets[: count + 1].copy(), ends[:count].copy(), sides[:count].copy())
