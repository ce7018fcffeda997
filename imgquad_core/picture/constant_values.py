"""Constant values: the outside of a cylinder, a banner; they are materials of their own and leave the histogram."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from imgquad_core.arrays import Flags

from .levels import Levels

#: least share of the picture that a constant fills, and least share of its pixels with eight equal neighbours
SHARE, SOLID = 0.05, 0.9
#: least step to the pixels around it: levels, and standard deviations of the noise
STEP, DEVIATIONS = 10.0, 4.0
#: pixels that candidates are sought among
SAMPLE = 60_000


class Constant(NamedTuple):
    """A value that fills a part of a picture."""

    pixels: Flags  #: (n_rows, n_cols)
    level: float


def constants_of(levels: Levels, noise: float) -> list[Constant]:
    """Return the constants of a grey picture, the darkest first.

    A value that fills 5 % of the picture, with 90 % of its pixels inside (clipped noise has fewer), and that differs
    from what is around it by 10 levels and four standard deviations of the noise. In the histogram it would outweigh
    the contrast of all the rest.
    """
    plane = levels.values[..., 0]
    sample = plane.ravel()[:: max(1, plane.size // SAMPLE)]
    values, counts = np.unique(sample, return_counts=True)
    candidates = values[counts >= 0.8 * SHARE * len(sample)]
    return [c for value in candidates if (c := _constant(levels, plane == value, noise))]


def _constant(levels: Levels, pixels: Flags, noise: float) -> Constant | None:
    if levels.void is not None:
        pixels = pixels & ~levels.void
    n = int(np.count_nonzero(pixels))
    if n < SHARE * pixels.size:
        return None
    square = np.ones((3, 3), bool)
    if np.count_nonzero(scipy.ndimage.binary_erosion(pixels, square, border_value=1)) < SOLID * n:
        return None
    ring = scipy.ndimage.binary_dilation(pixels, square) & ~pixels
    if not ring.any():
        return None
    r, c = np.nonzero(pixels)
    level = float(levels.rows(int(r[0]), int(r[0]) + 1)[0, c[0], 0])
    around = levels.rows(0, levels.shape[0])[..., 0][ring]
    if np.median(np.abs(around - level)) < max(STEP, DEVIATIONS * noise):
        return None
    return Constant(pixels, level)
