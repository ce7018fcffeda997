"""Rims: pixels whose colour is a blend of the two colours beside them (anti-aliasing, blur).

Quantised by their own colour they would become a thin third material between the two.
"""

from __future__ import annotations

import numpy as np

from imgquad_core.arrays import Bytes, Flags, Floats, Ints, Labels
from imgquad_core.jit import kernel, verb

#: how many pixels a rim may be followed to each side; wider ramps count as shades of their own
REACH = 4
#: colours on the line between two others may be off it by this part of their distance
BEND = 0.3
#: least change of colour from pixel to pixel along a ramp, as a part of that between the pixel's two neighbours
STEP = 0.1


def find_rims(levels: Bytes, contrast: float) -> Flags:
    """Mark the pixels that are blends of the two ends of a ramp of colours through them.

    Parameters
    ----------
    levels : uint8, shape (n_rows, n_cols, n_channels)
        Colours.
    contrast : float
        Smaller steps of colour (Euclidean, in levels) between the two neighbours of a pixel are no rim.

    Returns
    -------
    bool, shape (n_rows, n_cols)

    Notes
    -----
    The direction of a pixel is the one of horizontal, vertical and the two diagonals in which its neighbours differ
    most. From it the ramp is followed both ways while the colour goes on changing towards the neighbour's::

        colour   end . . . . . . . . . . . . . . . o---o
                                               o
                                       pixel o            nearer to the lower end
                                           o
                 o---o---o---o---o---o---o  . . . . . end

    The pixel is a rim if both ends are away from it and its colour is near the straight line between theirs. A thin
    line is darker, lighter or of another hue than both sides and so no blend of them: it is no rim. A line one pixel
    wide whose colour is a blend of its sides cannot be told from a rim.
    """
    marks = np.zeros(levels.shape[:2], np.bool_)
    mark_rims(levels, contrast**2, marks)
    return marks


def relabel_rims(levels: Bytes, marks: Flags, labels: Labels, means: Floats) -> None:
    """Give each rim to one of the two materials at its ends, the one whose mean colour is nearer, in place.

    Parameters
    ----------
    levels, marks
        What `find_rims` took and gave.
    labels : int32, shape (n_rows, n_cols)
        Material of each pixel by its own colour.
    means : float64, shape (n_materials, n_channels)
        Mean colour of each material: where two blend half and half, there is their boundary.
    """
    rims = np.flatnonzero(marks)
    for _ in range(2):  # the end of a ramp may be a rim in another direction
        labels.ravel()[rims] = labels_of_rims(levels, rims, labels, means)


@kernel
def mark_rims(levels: Bytes, contrast2: float, marks: Flags) -> None:
    """Set `marks` where `ends` are found."""
    for r in range(levels.shape[0]):
        for c in range(levels.shape[1]):
            dr, dc, most = direction(levels, r, c)
            if most > contrast2:
                marks[r, c] = ends(levels, r, c, dr, dc)[0] >= 0


@kernel
def labels_of_rims(levels: Bytes, rims: Ints, labels: Labels, means: Floats) -> Labels:
    """Return for the pixels `rims` the label of that end whose material is nearer in colour."""
    flat = labels.ravel()
    found = flat[rims]
    for k in range(len(rims)):
        r, c = rims[k] // levels.shape[1], rims[k] % levels.shape[1]
        dr, dc, _ = direction(levels, r, c)
        a, b = ends(levels, r, c, dr, dc)
        nearer_a = 0.0
        for i in range(levels.shape[2]):
            level = float(levels[r, c, i])
            nearer_a += (level - means[flat[b], i]) ** 2 - (level - means[flat[a], i]) ** 2
        found[k] = flat[a] if nearer_a >= 0.0 else flat[b]
    return found


@kernel
def direction(levels: Bytes, r: int, c: int) -> tuple[int, int, float]:
    """Return the direction (rows, columns) in which the two neighbours differ most, and how much (squared)."""
    rows, cols, _ = levels.shape
    dr, dc, most = 0, 1, 0.0
    for i, j in ((0, 1), (1, 0), (1, 1), (1, -1)):
        if r - i < 0 or r + i >= rows or c - abs(j) < 0 or c + abs(j) >= cols:
            continue
        difference = distance2(levels, r - i, c - j, r + i, c + j)
        if difference > most:
            dr, dc, most = i, j, difference
    return dr, dc, most


@verb
def distance2(levels: Bytes, r: int, c: int, i: int, j: int) -> float:
    """Return the squared distance of two pixels' colours."""
    total = 0
    for k in range(levels.shape[2]):
        d = int(levels[r, c, k]) - int(levels[i, j, k])
        total += d * d
    return float(total)


@kernel
def along(levels: Bytes, r: int, c: int, ar: int, ac: int, br: int, bc: int) -> float:
    """Return (pixel - a) . (b - a), the colour's way from that of `a` towards that of `b` times |b - a|."""
    total = 0
    for k in range(levels.shape[2]):
        a = int(levels[ar, ac, k])
        total += (int(levels[r, c, k]) - a) * (int(levels[br, bc, k]) - a)
    return float(total)


@verb
def ramp_length(levels: Bytes, r: int, c: int, dr: int, dc: int) -> int:
    """Return how many pixels the colour goes on changing in the direction (dr, dc), as it does around (r, c)."""
    rows, cols, _ = levels.shape
    br, bc, fr, fc = r - dr, c - dc, r + dr, c + dc
    least = STEP * distance2(levels, br, bc, fr, fc)
    here = along(levels, r, c, br, bc, fr, fc)
    n = 0
    while n < REACH:
        i, j = r + (n + 1) * dr, c + (n + 1) * dc
        if i < 0 or i >= rows or j < 0 or j >= cols:
            break
        there = along(levels, i, j, br, bc, fr, fc)
        if there < here + least:
            break
        here = there
        n += 1
    return n


@kernel
def ends(levels: Bytes, r: int, c: int, dr: int, dc: int) -> tuple[int, int]:
    """Return the pixels at the ends of the ramp through (r, c), the nearer in colour first; -1, -1 if no blend."""
    cols = levels.shape[1]
    back = ramp_length(levels, r, c, -dr, -dc)
    forth = ramp_length(levels, r, c, dr, dc)
    if back == 0 or forth == 0:
        return -1, -1
    ar, ac, br, bc = r - back * dr, c - back * dc, r + forth * dr, c + forth * dc
    whole2 = distance2(levels, ar, ac, br, bc)
    part = along(levels, r, c, ar, ac, br, bc)
    off2 = distance2(levels, r, c, ar, ac) - part * part / whole2
    if off2 > BEND * BEND * whole2:
        return -1, -1
    a, b = ar * cols + ac, br * cols + bc
    return (a, b) if 2 * part < whole2 else (b, a)
