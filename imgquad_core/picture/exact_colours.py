"""Exact labels: one material per value or colour."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Bytes, Flags, Ints, Labels
from imgquad_core.errors import InputError
from imgquad_core.jit import kernel
from imgquad_core.model import VOID, LabelImage, Materials

from .picture import Picture

#: up to this many values are numbered without sorting all pixels
FEW = 256
#: grey labels whose levels are nearer than this are shown in colours instead
VISIBLE = 8


def exact_labels(picture: Picture, most: int, must: bool, void: Flags | None) -> LabelImage | None:
    """Return one material per value or colour, or None where there are more than `most` of them.

    Parameters
    ----------
    picture : Picture
        What was read.
    most : int
        Limit of the number of materials.
    must : bool
        Whether values that cannot be material numbers are an error (else None is returned).
    void : bool, shape (n_rows, n_cols), optional
        Pixels that become `VOID`.
    """
    codes = codes_of(picture, must)
    if codes is None:
        return None
    if void is not None:
        codes[void] = VOID
    distinct = _distinct(codes, most)
    if distinct is None:
        return None
    values, numbers = distinct
    is_void = values == VOID
    labels, materials = _materials(picture, values[~is_void])
    table = np.full(len(values), VOID, np.int32)
    table[~is_void] = labels
    return LabelImage(table[numbers], materials)


def codes_of(picture: Picture, must: bool) -> Ints | None:
    """Return one integer for each pixel, the same for the same colour; None for greys that are not whole numbers."""
    values = picture.values
    if values.ndim == 3:
        bits = 8 * values.dtype.itemsize
        red, green, blue = (values[..., k].astype(np.int64) for k in range(3))
        return (red << 2 * bits) | (green << bits) | blue
    low, high = values.min(), values.max()
    whole = values.dtype.kind in "iu" or bool((values == np.rint(values)).all())
    if whole and low >= VOID and high <= np.iinfo(np.int32).max:
        return values.astype(np.int64)
    if picture.labels or (must and whole):
        raise InputError(
            f"{picture.name} holds labels from {low} to {high}: give numbers from 0 to 2147483647 (-1 is void)"
        )
    if must:
        raise InputError(f"{picture.name} holds greys that are not whole numbers: give a number of colours, or auto")
    return None


def _distinct(codes: Ints, most: int) -> tuple[Ints, Labels] | None:
    """Return the distinct codes, ascending, and the place of each pixel's; None where `most` and void are fewer."""
    found = np.empty(min(most + 1, FEW), np.int64)
    numbers = np.empty(codes.shape, np.int32)
    n = number_codes(codes, found, numbers)
    if n <= len(found):
        order = np.argsort(found[:n])
        place = np.empty(n, np.int32)
        place[order] = np.arange(n)
        values, numbers = found[order], place[numbers]
    elif most < FEW:
        return None
    else:
        values, places = np.unique(codes, return_inverse=True)
        numbers = places.reshape(codes.shape).astype(np.int32)
    return (values, numbers) if np.count_nonzero(values != VOID) <= most else None


@kernel
def number_codes(codes: Ints, found: Ints, numbers: Labels) -> int:
    """Give codes numbers in the order they come; return how many there are, at most one more than `found` holds."""
    n, last = 0, 0
    for r in range(codes.shape[0]):
        for c in range(codes.shape[1]):
            code = codes[r, c]
            if n == 0 or found[last] != code:
                last = 0
                while last < n and found[last] != code:
                    last += 1
                if last == len(found):
                    return n + 1
                if last == n:
                    found[n] = code
                    n += 1
            numbers[r, c] = last
    return n


def _materials(picture: Picture, values: Ints) -> tuple[Labels, Materials]:
    """Return the label of each distinct code (ascending), and the materials."""
    if picture.values.ndim == 2:
        labels = values.astype(np.int32)
        names = [f"material {value}" for value in values]
        return labels, Materials(labels, tuple(names), _colors_of_values(picture, values))
    bits = 8 * picture.values.dtype.itemsize
    channels = np.stack([values >> 2 * bits, values >> bits, values], axis=1) & ((1 << bits) - 1)
    order = dark_to_light(channels)
    labels = np.empty(len(values), np.int32)
    labels[order] = np.arange(len(values))
    names = ["rgb_" + "".join(f"{level:0{bits // 4}x}" for level in channels[k]) for k in order]
    colors = channels[order] >> (bits - 8)
    return labels, Materials(np.arange(len(values)), tuple(names), colors.astype(np.uint8))


def dark_to_light(colors: NDArray[Any]) -> Ints:
    """Return the order of colours, shape (n, 3), from dark to light; equally light ones by R, G, B."""
    red, green, blue = colors.T
    order: Ints = np.lexsort((blue, green, red, 299 * red + 587 * green + 114 * blue))
    return order


def _colors_of_values(picture: Picture, values: Ints) -> Bytes:
    """Return the palette's colours, greys that can be told apart, or else a colour that hangs on the number only."""
    if picture.palette is not None:
        return np.asarray(picture.palette[values], np.uint8)
    if not picture.labels and picture.values.dtype.kind == "u":
        grey = values >> (8 * picture.values.dtype.itemsize - 8)
        if len(grey) == 1 or np.diff(grey).min() >= VISIBLE:
            return np.repeat(grey[:, None], 3, axis=1).astype(np.uint8)
    # hues by the golden section are far apart for neighbouring numbers; brightness alternates too
    hue = (0.07 + values * 0.6180339887498949) % 1.0
    wheel = np.abs((hue[:, None] * 6.0 + np.array([0.0, 4.0, 2.0])) % 6.0 - 3.0) - 1.0
    value = np.where(values // 5 % 2 == 0, 0.9, 0.6)
    return np.asarray(np.rint(255.0 * value[:, None] * (0.35 + 0.65 * np.clip(wheel, 0.0, 1.0))), np.uint8)
