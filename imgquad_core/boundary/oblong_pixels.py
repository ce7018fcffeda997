"""Boundaries of pictures whose pixels, or data points, are not square.

A pixel boundary is off by a share of a pixel each way: it is smoothed in pixels. Lengths of edges mean something in
true shape only: it is stretched before it is cut into edges.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Floats

from .curves import Curves, Ends, arc_lengths


class TrueShape(NamedTuple):
    """A picture in squares of the shorter side of its pixels."""

    shape: tuple[int, int]  #: height and width, in squares
    square: tuple[float, float]  #: width and height of a square, in the unit of the pixels' sides


def true_shape(shape: tuple[int, int], sides: tuple[float, float] = (1.0, 1.0)) -> TrueShape:
    """Return a picture's height and width in squares of the shorter side of its pixels.

    Both are whole numbers, so that squares are square to within half a side over the whole picture.

    Parameters
    ----------
    shape : tuple of int
        (n_rows, n_cols) in pixels.
    sides : tuple of float
        Width and height of a pixel, in any unit.
    """
    rows, cols = shape
    width, height = sides
    shorter = min(sides)
    new_cols, new_rows = max(round(cols * width / shorter), 1), max(round(rows * height / shorter), 1)
    if (new_rows, new_cols) == (rows, cols):
        return TrueShape(shape, sides)
    return TrueShape((new_rows, new_cols), (width * (cols / new_cols), height * (rows / new_rows)))


def stretch(
    curves: Curves,
    ends: Ends,
    node: Floats,
    smooth: Floats,
    old_shape: tuple[float, float],
    new_shape: tuple[float, float],
) -> tuple[Curves, Ends, Floats, Floats]:
    """Stretch a picture to another (height, width): its curves, ends, moved ends, smooth curves."""
    new, old = np.array(new_shape[::-1]), np.array(old_shape[::-1])

    def place(points: Floats) -> Floats:
        # first times, then by: what lies on the border lies on it exactly
        stretched: Floats = points * new / old
        return stretched

    raw = place(curves.raw)
    return (
        curves._replace(raw=raw, arc=arc_lengths(raw, curves.offsets)),
        ends._replace(place=place(ends.place)),
        place(node),
        place(smooth),
    )
