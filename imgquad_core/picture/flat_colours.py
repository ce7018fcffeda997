"""Label pictures with rims: which of their colours are blends, and whose they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Bytes, Flags, Floats, Ints, Labels
from imgquad_core.jit import kernel, verb
from imgquad_core.reading.picture import Picture

from .blends import find_rims, relabel_rims
from .codes import Numbered, codes_of, values_of_codes
from .levels import Levels, levels_of

#: least contrast, in levels, of a rim between two flat colours
RIM = 4.0
#: connected parts of blended colours in letters have fewer pixels than this, on average
CRUMB = 4
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
    if most of their pixels are lonely (at most one equal neighbour) or blends of two sides. Of letters, whose strokes
    are too thin to have sides, those colours are blends whose connected parts have few pixels. A phase one pixel wide
    is solid nowhere, too, but does not outnumber the phases around it; many cracks, each a label, have longer parts.
    """
    counts = _counts(found)
    if not _may_be_blends(counts):
        return found
    drawn = _drawn(picture)
    flat = flat_among(_tally(found, counts, drawn), picture)
    if flat.all():
        return found
    labels = np.where(flat, np.cumsum(flat) - 1, -1).astype(np.int32)[found.numbers]
    _give_away(labels, drawn, _colors(found.codes[flat], picture))
    return Numbered(found.codes[flat], labels)


class Tally(NamedTuple):
    """How the pixels of each distinct colour lie; what is counted in several pictures adds up."""

    codes: NDArray[Any]  #: (n,) ascending
    counts: Ints  #: (n, 4) as `count_by_number` counts
    at_rims: Ints  #: (n,) pixels that are blends of their two sides


def tally_of(picture: Picture, found: Numbered) -> Tally:
    """Count how the pixels of each distinct colour of a picture lie."""
    return _tally(found, _counts(found), _drawn(picture))


def added_up(tallies: Sequence[Tally]) -> Tally:
    """Add up what was counted in pictures of one type."""
    codes, at = np.unique(np.concatenate([tally.codes for tally in tallies]), return_inverse=True)
    counts, at_rims = np.zeros((len(codes), 4), np.int64), np.zeros(len(codes), np.int64)
    np.add.at(counts, at, np.concatenate([tally.counts for tally in tallies]))
    np.add.at(at_rims, at, np.concatenate([tally.at_rims for tally in tallies]))
    return Tally(codes, counts, at_rims)


def flat_among(tally: Tally, like: Picture) -> Flags:
    """Tell which colours are flat, not blends; all where there are no blends. `like` says what the codes stand for."""
    everything = np.ones(len(tally.codes), bool)
    if not _may_be_blends(tally.counts):
        return everything
    pixels, solid, lonely, parts = tally.counts.T
    nowhere = solid == 0
    if 2 * max(lonely[nowhere].sum(), tally.at_rims[nowhere].sum()) <= pixels[nowhere].sum():
        crumbs = nowhere & (pixels < CRUMB * parts)
        if 2 * np.count_nonzero(crumbs) <= len(crumbs):
            return everything
        solid = np.where(nowhere & ~crumbs, 1, solid)
    return _flat(_colors(tally.codes, like), solid)


def in_flat_colours(picture: Picture, kept: NDArray[Any]) -> Labels:
    """Return the place of each pixel's code in `kept` (ascending); other codes go to a colour beside them."""
    codes = codes_of(picture.values)
    place = np.minimum(np.searchsorted(kept, codes), len(kept) - 1)
    labels = np.where(kept[place] == codes, place, -1).astype(np.int32)
    if (labels < 0).any():
        _give_away(labels, _drawn(picture), _colors(kept, picture))
    return labels


class _Drawn(NamedTuple):
    plane: Bytes
    rims: Flags


def _drawn(picture: Picture) -> _Drawn:
    levels = levels_of(picture, None)
    return _Drawn(plane := _plane(levels), find_rims(plane, RIM))


def _plane(levels: Levels) -> Bytes:
    return np.clip(np.rint(levels.rows(0, levels.shape[0])), 0.0, 255.0).astype(np.uint8)


def _colors(codes: NDArray[Any], picture: Picture) -> Floats:
    """Return the levels that codes have in a picture, shape (n, n_channels)."""
    levels = levels_of(picture, None)
    values = values_of_codes(codes, picture.values)
    values = values if picture.palette is None else picture.palette[values]
    if values.ndim == 2 and picture.palette is None and picture.values.dtype == np.uint16:
        values = values >> 8  # as `levels_of` takes deep colours
    channels = levels.values.shape[2]
    values = values.reshape(len(codes), 1, -1)[..., :channels]
    return _plane(replace(levels, values=values, void=None))[:, 0].astype(float)


def _give_away(labels: Labels, drawn: _Drawn, colors: Floats) -> None:
    """Give pixels of label -1 to one of the labels beside them, in place."""
    blended = labels < 0
    _grow(drawn.plane, labels, np.flatnonzero(blended), colors)
    relabel_rims(drawn.plane, drawn.rims & blended, labels, colors)


def _counts(found: Numbered) -> Ints:
    counts = np.zeros((len(found.codes), 4), np.int64)
    count_by_number(found.numbers, np.empty(found.numbers.shape[1], np.uint8), counts)
    return counts


def _tally(found: Numbered, counts: Ints, drawn: _Drawn) -> Tally:
    at_rims = np.bincount(found.numbers[drawn.rims], minlength=len(counts))
    return Tally(found.codes, counts, at_rims.astype(np.int64))


def _may_be_blends(counts: Ints) -> bool:
    nowhere = counts[:, 1] == 0
    return bool(np.count_nonzero(nowhere) > np.count_nonzero(~nowhere) > 0)


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
def count_by_number(numbers: Labels, same: Bytes, counts: NDArray[Any]) -> None:
    """Count for each number its pixels, those with eight equal neighbours, those with one at most, and its parts.

    Of parts, those pixels are counted that no equal neighbour comes before: one, or a few, in each. `same` has room for
    a row: how many equal neighbours come before each pixel, times 16, and after it.
    """
    rows, cols = numbers.shape
    for r in range(rows):
        inside = 0 < r < rows - 1 and cols > 2
        if inside:
            count_row(numbers, r, same)
        start, solid, lonely, parts = 0, 0, 0, 0
        for c in range(cols):
            if inside and 0 < c < cols - 1:
                before, after, around = same[c] >> 4, same[c] & 15, 8
            else:
                before, after, around = count_at_frame(numbers, r, c)
            solid += before + after == around
            lonely += before + after <= 1
            parts += before == 0
            if c + 1 == cols or numbers[r, c + 1] != numbers[r, c]:
                number = numbers[r, c]
                counts[number, 0] += c + 1 - start
                counts[number, 1] += solid
                counts[number, 2] += lonely
                counts[number, 3] += parts
                start, solid, lonely, parts = c + 1, 0, 0, 0


@verb
def count_row(numbers: Labels, r: int, same: Bytes) -> None:
    """Put the numbers of equal neighbours of the inner pixels of a row into `same`: compilers make 16 at a time."""
    for c in range(1, numbers.shape[1] - 1):
        own = numbers[r, c]
        before = (
            np.uint8(numbers[r - 1, c - 1] == own)
            + np.uint8(numbers[r - 1, c] == own)
            + np.uint8(numbers[r - 1, c + 1] == own)
            + np.uint8(numbers[r, c - 1] == own)
        )
        after = (
            np.uint8(numbers[r, c + 1] == own)
            + np.uint8(numbers[r + 1, c - 1] == own)
            + np.uint8(numbers[r + 1, c] == own)
            + np.uint8(numbers[r + 1, c + 1] == own)
        )
        same[c] = 16 * before + after


@verb
def count_at_frame(numbers: Labels, r: int, c: int) -> tuple[int, int, int]:
    """Return how many equal neighbours come before a pixel at the frame and after it, and how many it has."""
    before, after, around = 0, -1, -1
    for i in range(max(r - 1, 0), min(r + 2, numbers.shape[0])):
        for j in range(max(c - 1, 0), min(c + 2, numbers.shape[1])):
            equal = int(numbers[i, j] == numbers[r, c])
            if i < r or (i == r and j < c):
                before += equal
            else:
                after += equal
            around += 1
    return before, after, around
