"""Label pictures told from raw ones, whatever their type and number of values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Flags, Ints
from imgquad_core.jit import kernel
from imgquad_core.reading.picture import Picture

from .codes import Numbered, codes_of, numbered, values_of_codes

#: pictures with no more values than this are labels
FEW = 8
#: least share of inner pixels whose eight neighbours are all equal to them, in label pictures
CORE = 0.05
#: largest ratio of lonely pixels to that share in label pictures: labels were found to have up to 0.10, raw 0.22 and up
LONELY = 0.15
#: ratios from here to twice `LONELY` are told to the user
DOUBTFUL = 0.10
#: with no more values than this a picture that is all noise may still be labels ...
SOME = 64
#: ... if unequal neighbours differ as much as any two pixels (1: values are names; shades have up to 0.7)
ORDER = 0.85
#: below this number of pixels the type decides, or `MOST_OF_SMALL` values do
SMALL = 4096
MOST_OF_SMALL = 32
#: pixels that the commonest code is sought among
SAMPLE = 60_000


@dataclass(frozen=True)
class Kind:
    """What a picture was taken for.

    Parameters
    ----------
    is_labels : bool
        Whether each value is a material.
    reason : str
        Why, with the figures.
    doubt : str, optional
        Why it may be the other kind, where that is so.
    """

    is_labels: bool
    reason: str
    doubt: str | None = None


def kind_of(picture: Picture, void: Flags | None = None) -> Kind:
    """Tell whether a picture holds labels (each value a material) or raw values (shades, noise).

    Parameters
    ----------
    picture : Picture
        What was read.
    void : bool, shape (n_rows, n_cols), optional
        Pixels that hold nothing.

    Returns
    -------
    Kind

    Notes
    -----
    Values are compared for equality only. A pixel is solid if its eight neighbours equal it, active unless it is a
    solid one of the commonest value (an empty background must not vote), lonely if it is active and at most one
    neighbour equals it. A picture holds labels if

    - it has at most 8 values, or
    - 5 % of its pixels are solid, and lonely / active is at most 0.15 of solid / all, or
    - it has at most 64 values, and unequal neighbours differ as much as any two pixels do: noise among names.

    Of 179 pictures (61 labels, 28 flat colours with rims, 90 raw) one was taken wrongly, a dither of two values.
    Type and palette are no proof (CT is int16, GIF photographs have palettes): they decide below 4096 pixels only,
    and for integers of 32 bits or more with few solid pixels.
    """
    if picture.labels:
        return Kind(True, "its format says so")
    codes = codes_of(picture.values)
    few = numbered(codes, SOME if void is None else SOME + 1)
    n = None if few is None else _occurring(few, void)
    if n is not None and n <= FEW:
        return Kind(True, f"{n} values")
    if codes.size < SMALL:
        return _kind_of_small(picture, codes)
    counts = _counts(codes, void)
    core = counts[1] / max(counts[0], 1)
    lonely = counts[3] / max(counts[2], 1)
    nu = lonely / core if core > 0 else np.inf
    figures = f"{lonely:.1%} of its active pixels are lonely, {core:.1%} inside of one value"
    doubt = f"{figures}: neither clearly labels nor clearly raw" if DOUBTFUL < nu <= 2 * LONELY else None
    if core >= CORE and nu <= LONELY:
        return Kind(True, figures, doubt)
    if n is not None and few is not None and (order := _order(picture, few, void)) >= ORDER:
        return Kind(True, f"{n} values, and neighbours differ like any two pixels ({order:.2f})")
    values = picture.values
    if values.dtype.kind in "iu" and values.ndim == 2 and values.dtype.itemsize >= 4 and nu <= 1:
        return Kind(True, f"{values.dtype}, {figures}", f"{figures}: the type decided")
    return Kind(False, figures, doubt)


def _occurring(few: Numbered, void: Flags | None) -> int:
    return len(few.codes) if void is None else len(np.unique(few.numbers[~void]))


def _kind_of_small(picture: Picture, codes: NDArray[Any]) -> Kind:
    """Judge a picture that has too few pixels for statistics."""
    values, n = picture.values, codes.size
    if picture.palette is not None or values.dtype.kind in "bi" or (values.dtype.kind == "u" and values.itemsize > 2):
        what = "a palette" if picture.palette is not None else str(values.dtype)
        return Kind(True, f"{what}, and only {n} pixels")
    few = numbered(codes, MOST_OF_SMALL)
    if few is None:
        return Kind(False, f"more than {MOST_OF_SMALL} values in only {n} pixels", f"it has only {n} pixels")
    return Kind(True, f"{len(few.codes)} values in only {n} pixels")


def _counts(codes: NDArray[Any], void: Flags | None) -> Ints:
    """Return the numbers of inner, solid, active and lonely pixels."""
    every = max(1, codes.size // SAMPLE)
    sample = codes.ravel()[::every] if void is None else codes.ravel()[::every][~void.ravel()[::every]]
    values, counts = np.unique(sample, return_counts=True)
    counted = np.zeros(4, np.int64)
    if len(values):
        top = values[counts.argmax()]
        count_neighbours(codes, top, np.zeros((0, 0), np.bool_) if void is None else void, counted)
    return counted


@kernel
def count_neighbours(codes: NDArray[Any], top: Any, void: Flags, counted: Ints) -> None:
    """Count inner, solid, active and lonely pixels; `void` (or nothing) does not count."""
    inner, solid, active, lonely = 0, 0, 0, 0
    for r in range(1, codes.shape[0] - 1):
        for c in range(1, codes.shape[1] - 1):
            if void.size > 0 and void[r, c]:
                continue
            code = codes[r, c]
            same = (
                int(codes[r - 1, c - 1] == code)
                + int(codes[r - 1, c] == code)
                + int(codes[r - 1, c + 1] == code)
                + int(codes[r, c - 1] == code)
                + int(codes[r, c + 1] == code)
                + int(codes[r + 1, c - 1] == code)
                + int(codes[r + 1, c] == code)
                + int(codes[r + 1, c + 1] == code)
            )
            inner += 1
            if same == 8:
                solid += 1
                active += code != top
            else:
                active += 1
                lonely += same <= 1
    counted[0], counted[1], counted[2], counted[3] = inner, solid, active, lonely


def _order(picture: Picture, few: Numbered, void: Flags | None) -> float:
    """Return the mean difference of unequal neighbours over that of any two unequal pixels among the same ones."""
    shades = values_of_codes(few.codes, picture.values)
    if picture.palette is not None:
        shades = picture.palette[shades]
    shades = np.atleast_2d(np.asarray(shades, float).T).T
    apart = np.sqrt(((shades[:, None] - shades[None]) ** 2).sum(axis=2))
    n, pairs = len(shades), np.zeros(len(shades) ** 2)
    numbers = few.numbers.astype(np.intp)
    for a, b in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1])):
        codes = numbers[a] * n + numbers[b]
        pairs += np.bincount((codes if void is None else codes[~(void[a] | void[b])]).ravel(), minlength=n * n)
    met = pairs.reshape(n, n)
    met = met + met.T
    np.fill_diagonal(met, 0.0)
    ends = met.sum(axis=1)
    any_two = np.outer(ends, ends)
    np.fill_diagonal(any_two, 0.0)
    if not any_two.any():
        return 0.0
    among_any = float((any_two * apart).sum() / any_two.sum())
    return float((met * apart).sum() / met.sum() / among_any) if among_any > 0 else 1.0
