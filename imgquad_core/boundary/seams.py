"""Chains that are cut through a region for a time, so that its parts can be meshed apart: others know nothing of them.

A seam follows its pixels smoothly, but goes round what lies close beside it. Boundaries keep the nodes that they would
have without it, but for one where it ends: no edge gets shorter because a seam is near, no sector is too sharp for it.
"""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy

from imgquad_core.arrays import Flags, Floats, Ints

from .curves import Curves, Ends, per_point

ROUNDS = 12  # of moving seams off boundaries


class Real(NamedTuple):
    """What is left without seams."""

    curves: Curves
    kept: Ints | slice  #: dense points that are left
    ends: Ends  #: all of them, with the sockets that are left


def without_seams(curves: Curves, ends: Ends, is_seam: Flags) -> Real:
    """Return curves and ends without seams."""
    if not is_seam.any():
        return Real(curves, slice(None), ends)
    kept = np.flatnonzero(~per_point(curves, is_seam))
    left = Curves(
        curves.raw[kept], curves.arc[kept], curves.weight[kept], _offsets_of(np.diff(curves.offsets)[~is_seam]),
        curves.ends[~is_seam], curves.is_frame[~is_seam], curves.scale[kept],
    )  # fmt: skip
    node, there = np.repeat(np.arange(len(ends.place)), np.diff(ends.offsets)), ~is_seam[ends.sockets // 2]
    offsets = _offsets_of(np.bincount(node[there], minlength=len(ends.place)))
    return Real(left, kept, ends._replace(offsets=offsets, sockets=ends.sockets[there]))


def _offsets_of(counts: Ints) -> Ints:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def lay_seams(points: Floats, curves: Curves, is_seam: Flags, room: float) -> None:
    """Put the points of seams between their ends, in place: smoothly, but `room` away from boundaries."""
    if is_seam.any():
        _smoothen(points, curves, is_seam, int(4 * room))
        _bend(points, curves, is_seam, room)


def _smoothen(points: Floats, curves: Curves, is_seam: Flags, reach: int) -> None:
    """Average the pixel boundary of seams over so many points on each side, fewer near their ends: twice."""
    for c in np.flatnonzero(is_seam):
        part = slice(curves.offsets[c], curves.offsets[c + 1])
        xy = np.concatenate([points[part][:1], curves.raw[part][1:-1], points[part][-1:]])
        for _ in range(2):
            xy = _averaged(xy, reach)
        points[part] = xy


def _averaged(xy: Floats, reach: int) -> Floats:
    k, n = np.arange(len(xy)), len(xy)
    half = np.minimum(np.minimum(k, n - 1 - k), reach)
    sums = np.concatenate([np.zeros((1, 2)), np.cumsum(xy, axis=0)])
    return np.asarray((sums[k + half + 1] - sums[k - half]) / (2 * half + 1)[:, None])


def _bend(points: Floats, curves: Curves, is_seam: Flags, room: float) -> None:
    """Move seams off boundaries, but near their ends, where they belong to one."""
    at_seam = per_point(curves, is_seam)
    at, boundary = np.flatnonzero(at_seam), points[~at_seam]
    tree = scipy.spatial.cKDTree(boundary)
    to_end = np.minimum(curves.arc, per_point(curves, curves.arc[curves.offsets[1:] - 1]) - curves.arc)[at] / room
    offsets = _offsets_of(np.diff(curves.offsets)[is_seam])
    for _ in range(ROUNDS):
        gap, nearest = tree.query(points[at], distance_upper_bound=room)
        lack = np.where(np.isfinite(gap), room - gap, 0.0) * np.clip(to_end - 1.0, 0.0, 1.0)
        if not lack.any():
            return
        off = points[at] - boundary[np.minimum(nearest, len(boundary) - 1)]
        push = off * (lack / np.maximum(gap, 1e-9))[:, None]
        points[at] += 0.5 * np.minimum(to_end, 1.0)[:, None] * _spread(push, offsets, int(room))


def _spread(push: Floats, offsets: Ints, reach: int) -> Floats:
    """Average over so many points on each side along each seam."""
    parts = (push[a:b] for a, b in pairwise(offsets))
    average = partial(scipy.ndimage.uniform_filter1d, axis=0, mode="constant")
    return np.concatenate([average(part, min(2 * reach + 1, len(part))) for part in parts])


def moved_areas(points: Floats, curves: Curves, is_seam: Flags, sides: Ints, n: int) -> Floats:
    """Return by how much faces are larger as seams lie elsewhere than on the pixel boundary."""
    found = np.zeros(n)
    for c in np.flatnonzero(is_seam):
        part = slice(curves.offsets[c], curves.offsets[c + 1])
        x, y = np.concatenate([points[part], curves.raw[part][::-1]]).T
        area = 0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
        found[sides[c, 0]] += area
        found[sides[c, 1]] -= area
    return found
