"""Codes: one integer for each pixel, equal where the values are equal, whatever their type."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Labels
from imgquad_core.jit import kernel

#: slots of the smallest table of codes; it grows fourfold while more than half of it is taken
SLOTS = 1 << 10


class Numbered(NamedTuple):
    """Pixels numbered by their value."""

    codes: NDArray[Any]  #: (n,) the distinct codes, ascending
    numbers: Labels  #: (n_rows, n_cols) place of each pixel's code


def codes_of(values: NDArray[Any]) -> NDArray[Any]:
    """Return a code for each pixel: compare for equality only, unless `values` are integers.

    Parameters
    ----------
    values : ndarray, shape (n_rows, n_cols) or (n_rows, n_cols, 3)
        Integers, bool, floats or RGB (uint8, uint16).

    Returns
    -------
    int32 or int64, shape (n_rows, n_cols)
        Integers as they are, RGB packed (R highest), bits of floats.
    """
    if values.ndim == 3:
        bits = 8 * values.dtype.itemsize
        wide: Any = np.int32 if bits == 8 else np.int64
        red, green, blue = (np.asarray(values[..., k], wide) for k in range(3))
        return np.asarray((red << 2 * bits) | (green << bits) | blue)
    if values.dtype.kind == "f":
        if values.dtype.itemsize > 4:
            return np.add(values, 0.0, dtype=np.float64).view(np.int64)  # no minus zero
        return np.add(values, 0.0, dtype=np.float32).view(np.int32)
    is_wide = values.dtype.itemsize > 4 or values.dtype == np.uint32
    return np.ascontiguousarray(values, np.int64 if is_wide else np.int32)


def values_of_codes(codes: NDArray[Any], like: NDArray[Any]) -> NDArray[Any]:
    """Return the values, shape (n,) or (n, 3), that `codes_of` gave the codes, for a picture of the type of `like`."""
    if like.ndim == 3:
        bits = 8 * like.dtype.itemsize
        return np.asarray(np.stack([codes >> 2 * bits, codes >> bits, codes], axis=1) & ((1 << bits) - 1))
    if like.dtype.kind == "f":
        return codes.view(np.float64 if codes.dtype == np.int64 else np.float32)
    return codes.view(np.uint64) if like.dtype == np.uint64 else codes


def numbered(codes: NDArray[Any], most: int) -> Numbered | None:
    """Number the distinct codes from 0, ascending; None where there are more than `most`."""
    numbers = np.empty(codes.shape, np.int32)
    slots = SLOTS
    while True:
        table, places = np.empty(slots, codes.dtype), np.full(slots, -1, np.int32)
        n = number_codes(codes, table, places, numbers, min(most, slots // 2))
        if n > most:
            return None
        if n <= slots // 2:
            break
        slots *= 4
    found = np.empty(n, codes.dtype)
    found[places[places >= 0]] = table[places >= 0]
    order = np.argsort(found, kind="stable")
    place = np.empty(n, np.int32)
    place[order] = np.arange(n)
    put_in_place(numbers, place)
    return Numbered(found[order], numbers)


@kernel
def put_in_place(numbers: Labels, of_numbers: Labels) -> None:
    """Replace each number by what `of_numbers` gives for it, in place: large pictures have room for few copies."""
    for r in range(numbers.shape[0]):
        for c in range(numbers.shape[1]):
            numbers[r, c] = of_numbers[numbers[r, c]]


@kernel
def number_codes(codes: NDArray[Any], table: NDArray[Any], places: Labels, numbers: Labels, most: int) -> int:
    """Give codes numbers in the order they come; return how many there are, `most` + 1 as soon as there are more.

    `table` is a hash table of codes with linear probing, `places` the number of the code in each slot (-1: free). Its
    length is a power of two.
    """
    mask = len(table) - 1
    n, slot = 0, 0
    for r in range(codes.shape[0]):
        for c in range(codes.shape[1]):
            code = codes[r, c]
            if n == 0 or table[slot] != code:
                # the golden ratio of 2**32 spreads neighbouring codes (Knuth, Art of Computer Programming 3, 6.4)
                slot = ((int(code) ^ (int(code) >> 32)) * 2654435769 >> 12) & mask
                while places[slot] >= 0 and table[slot] != code:
                    slot = (slot + 1) & mask
                if places[slot] < 0:
                    if n == most:
                        return n + 1
                    table[slot] = code
                    places[slot] = n
                    n += 1
            numbers[r, c] = places[slot]
    return n
