"""The final edge length wanted at every dense point of the curves.

It is the least of the asked size, a share of the local feature size, and what the bend of the curve allows; it then
grows away from fine places no faster than `growth` from one element to the next, through the plane (a raster of the
picture) and along the chain (where neighbouring edges keep within `edge_ratio`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.jit import kernel, verb
from imgquad_core.threads import even_parts, in_threads

from .curves import Curves
from .feature_size import local_feature_size

_FINEST = 0.5  # px, smallest edge length asked for in thin places; pixels leave none under 0.7 px
_FINEST_BEND = 1.0  # px, smallest length asked for because of a bend alone: a pixel's side, bends below are stairs
_ACROSS = 1.0  # edge length over local feature size: coarse segments are at most twice as long as the place is wide
_BEND = 4.0  # arc over distance of a foreign point; chains that meet at more than 29 degrees do not count as thin
_TURN = 0.55  # radians that the curve may turn from one edge to the next, 32 degrees: 11 edges on a circle
_PAST_ENDS = 2  # junctions past which a fine place still makes edges shorter, on the chains that go on there
_OVER = 2.0  # px of arc to each side over which the bend is measured


def edge_sizes(
    points: Floats,
    curves: Curves,
    limit: Floats,
    is_corner: Flags,
    growth: float,
    edge_ratio: float,
    shape: tuple[float, float],
    *,
    threads: int = 1,
) -> Floats:
    """Wanted length of final edges at each dense point.

    Parameters
    ----------
    points : float64, shape (n, 2)
        Smoothed dense points.
    curves : Curves
        Their chains.
    limit : float64, shape (n,)
        Largest length asked for at each point.
    is_corner : bool, shape (n,)
        Points where the curve may turn at once.
    growth, edge_ratio : float
        Largest ratio of neighbouring elements, and of neighbouring edges of a chain.
    shape : tuple of float
        (n_rows, n_cols) of the picture.
    threads : int
        How many share the points.

    Returns
    -------
    float64, shape (n,)
        Length in pixels.
    """
    reach = min(float(limit.max()) / _ACROSS, float(np.hypot(*shape)))
    lfs = local_feature_size(points, curves, reach, _BEND, threads=threads)
    size = np.minimum(limit, _ACROSS * lfs)
    corners: Ints = np.cumsum(is_corner)
    parts = even_parts(np.diff(curves.offsets), threads)
    of_parts = [curves._replace(offsets=curves.offsets[part.start : part.stop + 1]) for part in parts]
    in_threads(of_parts, lambda some: _limit_turn(points, some, corners, size), threads)
    size = np.minimum(np.maximum(size, _FINEST * curves.scale), limit)
    return grade(size, points, curves, growth, edge_ratio, shape)


def grade(
    size: Floats, points: Floats, curves: Curves, growth: float, edge_ratio: float, shape: tuple[float, float]
) -> Floats:
    """Limit how fast `size` grows away from fine places."""
    slope = 2.0 * (growth - 1.0) / (growth + 1.0)
    if size.min() < size.max():
        raster = np.full((int(np.ceil(shape[0])), int(np.ceil(shape[1]))), np.inf, np.float32)
        size = _grade_plane(size, points, slope, raster)
    return grade_chains(size, curves, int(curves.ends.max(initial=-1)) + 1, edge_ratio)


def grade_chains(
    size: Floats, curves: Curves, n_nodes: int, edge_ratio: float, is_graded: Flags | None = None
) -> Floats:
    """Limit how fast `size` grows along the chains, and past their ends; some may be as this left them."""
    is_graded = np.zeros(len(curves.ends), bool) if is_graded is None else is_graded
    return _grade_chains(size, curves, np.empty(n_nodes), float(np.log(edge_ratio)), is_graded)


@kernel
def _grade_chains(size: Floats, curves: Curves, least: Floats, slope: float, is_graded: Flags) -> Floats:
    """Do so; `least` is room for the least size at each node."""
    offsets, ends = curves.offsets, curves.ends
    size, is_graded = size.copy(), is_graded.copy()
    for k in range(_PAST_ENDS + 1):
        for v in range(len(least)):
            least[v] = np.inf
        for c in range(len(ends)):
            if not is_graded[c]:
                _grade_chain(size, curves.arc, offsets[c], offsets[c + 1] - 1, ends[c, 0] < 0, slope)
            is_graded[c] = True
            if ends[c, 0] >= 0:
                least[ends[c, 0]] = min(least[ends[c, 0]], size[offsets[c]])
                least[ends[c, 1]] = min(least[ends[c, 1]], size[offsets[c + 1] - 1])
        for c in range(len(ends) if k < _PAST_ENDS else 0):
            if ends[c, 0] >= 0:
                first, last = offsets[c], offsets[c + 1] - 1
                is_graded[c] = size[first] == least[ends[c, 0]] and size[last] == least[ends[c, 1]]
                size[first], size[last] = least[ends[c, 0]], least[ends[c, 1]]
    return size


@kernel
def _limit_turn(points: Floats, curves: Curves, corners: Ints, size: Floats) -> None:
    """`corners` counts the corners up to each point."""
    offsets, arc, scale = curves.offsets, curves.arc, curves.scale
    for c in range(len(offsets) - 1):
        first, last = offsets[c], offsets[c + 1] - 1
        back = ahead = first
        for i in range(first + 1, last):
            while arc[i] - arc[back] > _OVER * scale[i]:
                back += 1
            while ahead < last and arc[ahead] - arc[i] < _OVER * scale[i]:
                ahead += 1
            if corners[ahead] > corners[max(back - 1, 0)]:
                continue
            ux, uy = points[i, 0] - points[back, 0], points[i, 1] - points[back, 1]
            vx, vy = points[ahead, 0] - points[i, 0], points[ahead, 1] - points[i, 1]
            turn = abs(np.arctan2(ux * vy - uy * vx, ux * vx + uy * vy))
            apart = 0.5 * (np.hypot(ux, uy) + np.hypot(vx, vy))
            if turn * size[i] > _TURN * apart:
                size[i] = max(_TURN * apart / turn, min(size[i], _FINEST_BEND * scale[i]))


def _grade_plane(size: Floats, points: Floats, slope: float, raster: NDArray[np.float32]) -> Floats:
    """Two chamfer passes over the pixels, then back to the points."""
    _lower(raster, points, size.astype(np.float32))
    for forward in (True, False):
        _chamfer(raster, np.float32(slope), np.float32(slope * np.sqrt(2.0)), forward)
    return _lowered(size, points, raster)


@kernel
def _lower(raster: NDArray[np.float32], points: Floats, size: NDArray[np.float32]) -> None:
    """Lower pixels to the least size of the points in them."""
    for i in range(len(points)):
        r, c = min(int(points[i, 1]), raster.shape[0] - 1), min(int(points[i, 0]), raster.shape[1] - 1)
        raster[r, c] = min(raster[r, c], size[i])


@kernel
def _lowered(size: Floats, points: Floats, raster: NDArray[np.float32]) -> Floats:
    """Return the sizes of points, lowered to those of their pixels."""
    lowered = np.empty(len(size))
    for i in range(len(points)):
        r, c = min(int(points[i, 1]), raster.shape[0] - 1), min(int(points[i, 0]), raster.shape[1] - 1)
        lowered[i] = min(size[i], float(raster[r, c]))
    return lowered


@kernel
def _chamfer(raster: NDArray[np.float32], straight: np.float32, slanting: np.float32, forward: bool) -> None:
    """Carry sizes to the pixels below and to the right, or above and to the left."""
    n_rows, n_cols = raster.shape
    step = 1 if forward else -1
    for i in range(n_rows):
        r = i if forward else n_rows - 1 - i
        if i > 0:
            _carry_over(raster, r - step, r, straight, slanting)
        best = np.float32(np.inf)
        for j in range(n_cols):
            c = j if forward else n_cols - 1 - j
            best = min(raster[r, c], best + straight)
            raster[r, c] = best


@verb
def _carry_over(raster: NDArray[np.float32], since: int, to: int, straight: np.float32, slanting: np.float32) -> None:
    """Carry sizes from one row to the next: no pixel waits for another, so that many are done at once."""
    last = raster.shape[1] - 1
    for c in range(last + 1):
        raster[to, c] = min(raster[to, c], raster[since, c] + straight)
    for c in range(last):
        raster[to, c] = min(raster[to, c], raster[since, c + 1] + slanting)
    for c in range(last):
        raster[to, c + 1] = min(raster[to, c + 1], raster[since, c] + slanting)


@kernel
def grade_along(values: Floats, arc: Floats, offsets: Ints, ends: Ints, slope: float) -> Floats:
    """Limit values so that they grow by no more than `slope` times the arc along each chain."""
    values = values.copy()
    for c in range(len(offsets) - 1):
        _grade_chain(values, arc, offsets[c], offsets[c + 1] - 1, ends[c, 0] < 0, slope)
    return values


@verb
def _grade_chain(values: Floats, arc: Floats, first: int, last: int, is_closed: bool, slope: float) -> None:
    for _ in range(2 if is_closed else 1):  # a closed chain needs the second round
        if is_closed:
            values[first] = min(values[first], values[last])
            values[last] = values[first]
        for i in range(first + 1, last + 1):
            values[i] = min(values[i], values[i - 1] + slope * (arc[i] - arc[i - 1]))
        for i in range(last - 1, first - 1, -1):
            values[i] = min(values[i], values[i + 1] + slope * (arc[i + 1] - arc[i]))
