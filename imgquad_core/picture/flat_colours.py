"""Label pictures with rims: which of their colours are blends, and whose they are."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Bytes, Flags, Floats, Ints, Labels
from imgquad_core.jit import kernel
from imgquad_core.reading.picture import Picture

from .blends import find_rims, relabel_rims
from .codes import Numbered
from .levels import levels_of

#: least contrast, in levels, of a rim between two flat colours
RIM = 4.0
#: what is so near to a colour with many times its solid pixels is the end of a ramp to it
NEAR, MANY_TIMES = 4.0, 10


def without_blends(picture: Picture, found: Numbered) -> Numbered:
    """Give pixels of blended colours to a flat colour beside them, where a picture has rims.

    Parameters
    ----------
    picture : Picture
        What was read: labels drawn in flat colours.
    found : Numbered
        Its distinct colours.

    Returns
    -------
    Numbered
        The flat colours. All colours where none is a blend.

    Notes
    -----
    Colours that are solid nowhere (no pixel with eight equal neighbours) are blends if they outnumber the others and
    if most of their pixels are lonely (at most one equal neighbour) or blends of two sides. A phase one pixel wide is
    solid nowhere, too, but does not outnumber the phases around it.
    """
    counts = np.zeros((len(found.codes), 3), np.int64)
    count_by_number(found.numbers, counts)
    nowhere = counts[:, 1] == 0
    if not np.count_nonzero(nowhere) > np.count_nonzero(~nowhere) > 0:
        return found
    levels = levels_of(picture, None)
    plane = np.clip(np.rint(levels.rows(0, levels.shape[0])), 0.0, 255.0).astype(np.uint8)
    rims = find_rims(plane, RIM)
    pixels, lonely = counts[nowhere, 0].sum(), counts[nowhere, 2].sum()
    at_rims = np.bincount(found.numbers[rims], minlength=len(nowhere))[nowhere].sum()
    if 2 * max(lonely, at_rims) <= pixels:
        return found
    colors = plane.reshape(-1, plane.shape[2])[np.unique(found.numbers, return_index=True)[1]].astype(float)
    flat = _flat(colors, counts[:, 1])
    number = np.where(flat, np.cumsum(flat) - 1, -1).astype(np.int32)
    labels = number[found.numbers]
    blended = np.flatnonzero(labels < 0)
    _grow(plane, labels, blended, colors[flat])
    relabel_rims(plane, rims & ~flat[found.numbers], labels, colors[flat])
    return Numbered(found.codes[flat], labels)


def _flat(colors: Floats, solid: Ints) -> Flags:
    """Tell the colours that are solid somewhere and no ends of ramps to another, from the most solid one on."""
    flat = solid > 0
    order = np.argsort(-solid, kind="stable")
    for k in order[: np.count_nonzero(flat)]:
        near = flat & (solid >= MANY_TIMES * solid[k]) & (np.abs(colors - colors[k]).max(axis=1) <= NEAR)
        flat[k] = not near.any()
    return flat


def _grow(plane: Bytes, labels: Labels, pixels: Ints, means: Floats) -> None:
    """Label `pixels`, which have -1, from their neighbours inwards, the one of the nearer colour first, in place."""
    while len(pixels):
        found = label_from_around(plane, labels, pixels, means)
        if (found < 0).all():
            return
        labels.ravel()[pixels] = found
        pixels = pixels[found < 0]


@kernel
def label_from_around(plane: Bytes, labels: Labels, pixels: Ints, means: Floats) -> Labels:
    """Return for each pixel the label among its eight neighbours whose colour is the nearest, -1 where none has one."""
    rows, cols = labels.shape
    found = np.full(len(pixels), -1, np.int32)
    for k in range(len(pixels)):
        r, c = pixels[k] // cols, pixels[k] % cols
        least = np.inf
        for i in range(max(r - 1, 0), min(r + 2, rows)):
            for j in range(max(c - 1, 0), min(c + 2, cols)):
                label = labels[i, j]
                if label < 0:
                    continue
                away = 0.0
                for m in range(plane.shape[2]):
                    away += (float(plane[r, c, m]) - means[label, m]) ** 2
                if away < least:
                    least, found[k] = away, label
    return found


@kernel
def count_by_number(numbers: Labels, counts: NDArray[Any]) -> None:
    """Count for each number its pixels, those with eight equal neighbours, and those with one at most."""
    rows, cols = numbers.shape
    for r in range(rows):
        for c in range(cols):
            number, same, around = numbers[r, c], -1, -1
            for i in range(max(r - 1, 0), min(r + 2, rows)):
                for j in range(max(c - 1, 0), min(c + 2, cols)):
                    same += numbers[i, j] == number
                    around += 1
            counts[number, 0] += 1
            counts[number, 1] += same == around
            counts[number, 2] += same <= 1
