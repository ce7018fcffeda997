"""The dense curves that smoothing works on: every chain with its own copy of its points, and the ends they share."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Bytes, Flags, Floats, Ints
from imgquad_core.grouping import rows_of
from imgquad_core.jit import kernel, verb
from imgquad_core.model import VOID, BoundaryGraph, PointKind

_LONGEST_RUN = 16  # sides from step to step that count
#: what a dense point is: corner of a pixel, middle of a horizontal or vertical side, or none of these
PIXEL_CORNER, ACROSS, UP, ELSEWHERE = -1, 0, 1, 2


class PixelChains(NamedTuple):
    """The boundary that is smoothed, and what its dense points are."""

    graph: BoundaryGraph
    side: Ints  #: (n,) one of the above for each place of `graph.chain_points`
    scale: Floats | None = None  #: (n,) width of what smoothing takes for stairs there, a unit of length; 1 for None


def pixel_chains(graph: BoundaryGraph) -> PixelChains:
    """Tell what the points of a pixel boundary are: the middle of a horizontal side lies on half columns."""
    return PixelChains(graph, sides_of(graph.points[graph.chain_points]))


def sides_of(points: Floats) -> Ints:
    """Tell what points of a pixel boundary are."""
    is_half = points != np.floor(points)
    return np.where(is_half[:, 0], ACROSS, np.where(is_half[:, 1], UP, PIXEL_CORNER))


class Curves(NamedTuple):
    """The pixel boundary, chain by chain.

    Chain c has the dense points ``offsets[c]:offsets[c + 1]``; a closed one repeats its first point.
    """

    raw: Floats  #: (n, 2) points of the pixel boundary
    arc: Floats  #: (n,) length along the chain up to each point
    weight: Floats  #: (n,) how well each point is known, see `sample_weights`
    offsets: Ints  #: (n_chains + 1,)
    ends: Ints  #: (n_chains, 2) node at either end; -1 closed
    is_frame: Flags  #: (n_chains,) lies on the picture's border
    scale: Floats  #: (n,) width of what smoothing takes for stairs, a unit of length


class Ends(NamedTuple):
    """The points that chains end at."""

    place: Floats  #: (n_nodes, 2)
    kind: Bytes  #: (n_nodes,) JUNCTION or CORNER
    offsets: Ints  #: (n_nodes + 1,) CSR of `sockets`
    sockets: Ints  #: 2 * chain + 0 for its start or 1 for its end


def curves_of(graph: BoundaryGraph, side: Ints | None = None, scale: Floats | None = None) -> tuple[Curves, Ends]:
    """Unpack a pixel boundary; `side` tells what its points are where coordinates do not, see `PixelChains`."""
    side = pixel_chains(graph).side if side is None else side
    raw, offsets = graph.points[graph.chain_points], np.array(graph.chain_offsets)
    first, last = graph.chain_points[offsets[:-1]], graph.chain_points[offsets[1:] - 1]
    second = graph.chain_points[offsets[:-1] + 1]
    nodes, ends = ends_of(graph)
    curves = Curves(
        raw,
        arc_lengths(raw, offsets),
        sample_weights(side, offsets),
        offsets,
        nodes,
        (graph.point_kind[second] == PointKind.FRAME) | _along_border(graph, first, second, last),
        np.ones(len(raw)) if scale is None else scale,
    )
    return curves, ends


def ends_of(graph: BoundaryGraph) -> tuple[Ints, Ends]:
    """Return the nodes at both ends of each chain, -1 closed, and all of them."""
    first, last = graph.chain_points[graph.chain_offsets[:-1]], graph.chain_points[graph.chain_offsets[1:] - 1]
    is_node = (graph.point_kind == PointKind.JUNCTION) | (graph.point_kind == PointKind.CORNER)
    open_ = is_node[first]
    nodes = np.unique(np.concatenate([first[open_], last[open_]]))
    ends = np.full((graph.n_chains, 2), -1, np.int64)
    ends[open_, 0], ends[open_, 1] = np.searchsorted(nodes, first[open_]), np.searchsorted(nodes, last[open_])
    sockets = np.flatnonzero(ends.ravel() >= 0)
    at = ends.ravel()[sockets]
    offsets = np.concatenate([[0], np.cumsum(np.bincount(at, minlength=len(nodes)))]).astype(np.int64)
    order = np.argsort(at, kind="stable")
    return ends, Ends(graph.points[nodes], graph.point_kind[nodes], offsets, sockets[order])


def _along_border(graph: BoundaryGraph, first: Ints, second: Ints, last: Ints) -> Flags:
    """Tell which chains are one straight side of the picture's border, without a point between their ends."""
    p, q = graph.points[first], graph.points[last]
    is_along = ((p == q) & ((p == 0.0) | (p == np.array(graph.shape[::-1])))).any(axis=1)
    return np.asarray(is_along & (second == last) & (graph.chain_regions == VOID).any(axis=1))


def on_frame(graph: BoundaryGraph) -> Flags:
    """Tell which chains of a pixel boundary lie on the picture's border."""
    return np.asarray(graph.point_kind[graph.chain_points[graph.chain_offsets[:-1] + 1]] == PointKind.FRAME)


@kernel
def numbered(offsets: Ints, node: Ints, n_nodes: int) -> Ints:
    """Give ids to the points of chains between nodes, shape (n_chains, 2), -1 closed: nodes first, others in order."""
    ids, new = np.empty(offsets[-1], np.int64), n_nodes
    for c in range(len(node)):
        first, last = offsets[c], offsets[c + 1] - 1
        is_open = node[c, 0] >= 0
        for i in range(first + is_open, last):
            ids[i] = new
            new += 1
        if is_open:
            ids[first] = node[c, 0]
        ids[last] = node[c, 1] if is_open else ids[first]
    return ids


@kernel
def arc_lengths(points: Floats, offsets: Ints) -> Floats:
    """Length along each chain up to each of its points."""
    arc = np.zeros(len(points))
    for c in range(len(offsets) - 1):
        for i in range(offsets[c] + 1, offsets[c + 1]):
            arc[i] = arc[i - 1] + np.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
    return arc


@kernel
def sample_weights(side: Ints, offsets: Ints) -> Floats:
    """Weight of each point as an observation of the true boundary.

    A mid-side is off by up to half a pixel ACROSS its side only. Of a nearly straight boundary with runs of r sides
    from step to step, the sides along the runs are off by that much, the side at a step by 1 / r of it::

        ___a___b___c___                      a, b, c, d, e, f: weight 1
                       |                     s: weight r^2, the lesser of both runs, here 9
                       s___d___e___f___

    Corners of pixels between two sides of a run lie halfway between their samples and say nothing: weight 0.
    """
    weight = np.zeros(len(side))
    run = np.zeros(len(side), np.int64)
    for c in range(len(offsets) - 1):
        first, last = offsets[c], offsets[c + 1] - 1
        weight[first] = weight[last] = 1.0
        begin, kind, length = first, -1, 0
        for i in range(first, last + 2):
            this = 3 if i > last else side[i]
            if this < 0:
                continue
            if this != kind:
                for k in range(begin, i):
                    run[k] = length if kind < ELSEWHERE else 1
                begin, kind, length = i, this, 0
            length += 1
        for i in range(first, last + 1):
            if side[i] >= 0:
                weight[i] = 1.0
                if run[i] == 1 and first < i < last and side[i] < ELSEWHERE:
                    weight[i] = min(min(run[i - 1], run[i + 1]), _LONGEST_RUN) ** 2
    return weight


@kernel
def pin_ends(points: Floats, curves: Curves, node: Floats) -> None:
    """Put chain ends on their nodes, in place; chains on the border become straight between theirs."""
    for c in range(len(curves.ends)):
        pin(curves, node, c, points)


@verb
def pin(curves: Curves, node: Floats, c: int, points: Floats) -> None:
    """Do this for one chain."""
    first, last = curves.offsets[c], curves.offsets[c + 1] - 1
    start, end = curves.ends[c, 0], curves.ends[c, 1]
    for k in range(2):
        if start < 0:
            points[last, k] = points[first, k]
            continue
        if curves.is_frame[c]:
            for i in range(first, last):
                share = curves.arc[i] / curves.arc[last]
                points[i, k] = node[start, k] + share * (node[end, k] - node[start, k])
        points[first, k], points[last, k] = node[start, k], node[end, k]


def per_point(curves: Curves, values: NDArray[Any]) -> NDArray[Any]:
    """Repeat one value a chain for each of its dense points."""
    return np.repeat(values, np.diff(curves.offsets))


@verb
def line_beside(
    curves: Curves, c: int, i: int, step: int, near: float, far: float
) -> tuple[int, float, float, float, float, float]:
    """Total least squares line through the points of chain c from arc `near` to `far` on one side of its point i.

    Gives the number of points a point on the line relative to point i, its
    direction (away from point i) and the residual:
    root of the weighted sum of squares over the number of points.
    """
    first, last = curves.offsets[c], curves.offsets[c + 1] - 1
    n, k, gone = 0, i, 0.0
    g = x = y = xx = xy = yy = 0.0
    while gone <= far:
        if gone >= near:
            dx, dy = curves.raw[k, 0] - curves.raw[i, 0], curves.raw[k, 1] - curves.raw[i, 1]
            q = curves.weight[k]
            n, g, x, y = n + 1, g + q, x + q * dx, y + q * dy
            xx, xy, yy = xx + q * dx * dx, xy + q * dx * dy, yy + q * dy * dy
        if k == (last if step > 0 else first):
            if curves.ends[c, 0] >= 0:
                break
            k = first if step > 0 else last
        k += step
        gone += abs(curves.arc[k] - curves.arc[k - step])
    if n < 2 or g == 0.0:
        return 0, 0.0, 0.0, 1.0, 0.0, 0.0
    x, y = x / g, y / g
    xx, xy, yy = xx / g - x * x, xy / g - x * y, yy / g - y * y
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    spread = 0.5 * (xx + yy) - np.hypot(0.5 * (xx - yy), xy)
    tx, ty = np.cos(angle), np.sin(angle)
    if tx * x + ty * y < 0:
        tx, ty = -tx, -ty
    return n, x, y, tx, ty, np.sqrt(max(spread, 0.0) * g / n)


def started_at(curves: Curves, flags: Flags) -> tuple[Curves, Flags]:
    """Turn closed chains round so that they start at their first flagged point, and the flags with them."""
    size = np.diff(curves.offsets)
    first = curves.offsets[:-1]
    closed = curves.ends[:, 0] < 0
    flagged = np.where(flags, np.arange(len(flags)), len(flags))
    by = np.minimum.reduceat(flagged, first) - first
    by[~closed | (by >= size)] = 0
    period = per_point(curves, np.where(closed, size - 1, size))
    within = np.arange(len(flags)) - per_point(curves, first)
    order = per_point(curves, first) + (within + per_point(curves, by)) % period
    raw = curves.raw[order]
    turned = curves._replace(raw=raw, arc=arc_lengths(raw, curves.offsets), weight=curves.weight[order])
    return turned._replace(scale=curves.scale[order]), flags[order]


def rings(raw: Floats, offsets: Ints, node_offsets: Ints, sockets: Ints) -> tuple[Ints, Ints]:
    """Return the next socket round its node for each socket, and one socket of each node."""
    chain, is_end = sockets // 2, sockets % 2 == 1
    at = np.where(is_end, offsets[chain + 1] - 1, offsets[chain])
    step = raw[np.where(is_end, at - 1, at + 1)] - raw[at]
    node = rows_of(node_offsets)
    turn = np.arctan2(step[:, 1], step[:, 0])
    order = sockets[np.lexsort((turn, node))]
    ring = np.full(2 * (len(offsets) - 1), -1, np.int64)
    following = np.roll(order, -1)
    following[node_offsets[1:] - 1] = order[node_offsets[:-1]]
    ring[order] = following
    return ring, order[node_offsets[:-1]]
