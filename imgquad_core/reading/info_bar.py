"""The bar with text that electron microscopes add below a picture, and the scale that is drawn into it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from imgquad_core.arrays import Flags

from .calibration import Box
from .picture import Picture, part_of

#: share of a row's pixels that have one value: in its first row (a line or plain ground), in all its rows
FIRST, EVERY = 0.99, 0.5
#: the same in the middle of all rows above: a micrograph has hardly two equal pixels in a row
NOISY = 0.3
#: least and largest share of the picture's rows
LEAST, MOST = 0.02, 0.25
#: rows of the picture that may show again below the bar: Zeiss leaves one
BELOW = 2
#: least width of a drawn scale, as a share of the picture's columns and as a multiple of its height; least share of its
#: box that it fills
WIDE, LONG, FULL = 0.04, 4.0, 0.97


def cut_info_bar(picture: Picture, what: str) -> Picture:
    """Cut an info bar off ("crop"), or tell that there seems to be one ("keep"); tell of a scale drawn elsewhere.

    Parameters
    ----------
    picture : Picture
        What was read.
    what : "keep" or "crop"
        What becomes of the bar.
    """
    rows = picture.shape[0]
    n_bar = picture.bar_rows or find_info_bar(picture)
    if not 0 < n_bar < rows:
        return _scale_told(picture)
    told = f"rows {rows - n_bar} to {rows - 1} hold an info bar"
    if what == "keep":
        return replace(picture, notes=(*picture.notes, f"{told}: info-bar crop leaves them out"))
    kept = part_of(picture, (0, 0, picture.shape[1], rows - n_bar))
    return _scale_told(replace(kept, bar_rows=0, notes=(*picture.notes, f"{told}: left out")))


def _scale_told(picture: Picture) -> Picture:
    """Add a note where a scale is drawn into a picture: no option knows what is under it."""
    box = find_scale(picture)
    if box is None:
        return picture
    left, upper, right, lower = box
    told = (
        f"rows {upper} to {lower - 1}, columns {left} to {right - 1} look like a drawn scale, which is meshed: crop it"
    )
    return replace(picture, notes=(*picture.notes, told))


def find_scale(picture: Picture) -> Box | None:
    """Return the box of a scale bar drawn into a micrograph: a long solid rectangle of the least or largest value.

    Left, upper, right and lower bound; None where there is none, and for pictures without noise.
    """
    values = picture.values if picture.values.ndim == 2 else picture.values.max(axis=2)
    shares = [_commonest_share(row) for row in values[:: max(1, len(values) // 64)]]
    if picture.labels or float(np.median(shares)) >= NOISY:
        return None
    return next((box for value in (values.max(), values.min()) if (box := _long_box(values == value))), None)


def _long_box(drawn: Flags) -> Box | None:

    parts, _ = scipy.ndimage.label(drawn)
    for k, (down, along) in enumerate(scipy.ndimage.find_objects(parts), start=1):
        height, width = down.stop - down.start, along.stop - along.start
        is_long = height > 1 and width >= WIDE * drawn.shape[1] and width >= LONG * height
        if is_long and np.count_nonzero(parts[down, along] == k) >= FULL * height * width:
            return along.start, down.start, along.stop, down.stop
    return None


def find_info_bar(picture: Picture) -> int:
    """Return how many rows at the bottom look like an info bar; 0 for none.

    It starts with a row of one value; in each of its rows (but perhaps the last two), most pixels have one value;
    above it is noise.
    """
    values = picture.values
    rows = first = len(values)
    while first > rows - BELOW and _commonest_share(values[first - 1]) < EVERY:
        first -= 1
    while first > rows * (1.0 - MOST) and _commonest_share(values[first - 1]) >= EVERY:
        first -= 1
    while first < rows and _commonest_share(values[first]) < FIRST:
        first += 1
    n_bar = rows - first
    if not LEAST * rows <= n_bar < MOST * rows - 1 or picture.labels:
        return 0
    sample = values[: first - 1 : max(1, first // 64)]
    shares = [_commonest_share(row) for row in sample]
    return n_bar if shares and float(np.median(shares)) < NOISY else 0


def _commonest_share(row: NDArray[Any]) -> float:
    flat = row if row.ndim == 1 else row.astype(np.int64) @ np.array([1, 1 << 16, 1 << 32])
    return float(np.unique(flat, return_counts=True)[1].max() / len(flat))
