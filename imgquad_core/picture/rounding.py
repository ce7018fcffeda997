"""Outlines are rounded: pixels go to the label that is densest around them."""

from __future__ import annotations

import numpy as np

from imgquad_core.arrays import Flags, Floats, Labels
from imgquad_core.jit import kernel, verb
from imgquad_core.model import VOID

TILE = 64  # px, of the picture at once
BELL_ENDS = 3.0  # widths


@kernel
def rounded(labels: Labels, changed: Flags, stays: Flags, reach: float, width: float) -> Labels:
    """Give pixels within reach of changed ones to the label that is densest there, in a bell of a width."""
    rows, cols = labels.shape
    out = labels.copy()
    margin = int(np.ceil(BELL_ENDS * width))
    bell = np.empty(margin + 1)
    for k in range(margin + 1):
        bell[k] = np.exp(-0.5 * (k / width) ** 2)
    near = _widened(changed, int(np.ceil(reach)))
    side = TILE + 2 * margin
    rowwise, dense, best = np.empty((side, TILE)), np.empty((TILE, TILE)), np.empty((TILE, TILE))
    present = np.empty(side * side, np.int32)
    for top in range(0, rows, TILE):
        for left in range(0, cols, TILE):
            low, high = min(top + TILE, rows), min(left + TILE, cols)
            if not _any_in(near, top, low, left, high):
                continue
            n = _labels_in(
                labels,
                max(top - margin, 0),
                min(low + margin, rows),
                max(left - margin, 0),
                min(high + margin, cols),
                present,
            )
            if n < 2:
                continue
            for a in range(low - top):
                for b in range(high - left):
                    best[a, b] = -1.0
            for k in range(n):
                _density(labels, present[k], top, low, left, high, margin, bell, rowwise, dense)
                for a in range(low - top):
                    for b in range(high - left):
                        i, j = top + a, left + b
                        value = dense[a, b] * (1.0 + 1e-9 * (present[k] == labels[i, j]))
                        if near[i, j] and not stays[i, j] and value > best[a, b]:
                            best[a, b] = value
                            out[i, j] = present[k]
    return out


@verb
def _widened(flags: Flags, reach: int) -> Flags:
    """Flag the squares around flagged pixels."""
    rows, cols = flags.shape
    flat, along, wide = flags.ravel(), np.zeros(rows * cols, np.bool_), np.zeros(rows * cols, np.bool_)
    for i in range(rows):
        _widen_line(flat, i * cols, 1, cols, reach, along)
    for j in range(cols):
        _widen_line(along, j, cols, rows, reach, wide)
    return wide.reshape(rows, cols)


@verb
def _widen_line(flags: Flags, first: int, step: int, n: int, reach: int, out: Flags) -> None:
    """Flag what is within `reach` of a flagged one, among the n pixels from `first` on, `step` apart."""
    last = -(reach + 1)
    for k in range(n):
        if flags[first + k * step]:
            last = k
        out[first + k * step] = k - last <= reach
    last = n + reach + 1
    for k in range(n - 1, -1, -1):
        if flags[first + k * step]:
            last = k
        out[first + k * step] |= last - k <= reach


@verb
def _any_in(flags: Flags, top: int, low: int, left: int, high: int) -> bool:
    for i in range(top, low):
        for j in range(left, high):
            if flags[i, j]:
                return True
    return False


@verb
def _labels_in(labels: Labels, top: int, low: int, left: int, high: int, present: Labels) -> int:
    """List the labels of a part of the picture but `VOID`, ascending."""
    n, last = 0, VOID
    for i in range(top, low):
        for j in range(left, high):
            value = labels[i, j]
            if value == last or value == VOID:
                continue
            last = value
            at = 0
            while at < n and present[at] < value:
                at += 1
            if at == n or present[at] != value:
                for k in range(n, at, -1):
                    present[k] = present[k - 1]
                present[at] = value
                n += 1
    return n


@verb
def _density(
    labels: Labels,
    label: int,
    top: int,
    low: int,
    left: int,
    high: int,
    margin: int,
    bell: Floats,
    rowwise: Floats,
    dense: Floats,
) -> None:
    """Weigh the pixels of a label around each pixel of a tile; the picture goes on beyond its border as a mirror."""
    rows, cols = labels.shape
    for i in range(top - margin, low + margin):
        r = -1 - i if i < 0 else (2 * rows - 1 - i if i >= rows else i)
        r = min(max(r, 0), rows - 1)
        for j in range(left, high):
            total = 0.0
            for k in range(-margin, margin + 1):
                c = j + k
                c = -1 - c if c < 0 else (2 * cols - 1 - c if c >= cols else c)
                c = min(max(c, 0), cols - 1)
                if labels[r, c] == label:
                    total += bell[abs(k)]
            rowwise[i - top + margin, j - left] = total
    for i in range(low - top):
        for j in range(high - left):
            total = 0.0
            for k in range(-margin, margin + 1):
                total += bell[abs(k)] * rowwise[i + margin + k, j]
            dense[i, j] = total
