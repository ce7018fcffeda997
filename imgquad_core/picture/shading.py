"""Shading: uneven light as a smooth surface, fitted where the picture is flat."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from imgquad_core.arrays import Bytes, Flags, Floats, Ints

from .levels import Levels, cubic, to_unit

#: the picture is smoothed by this Gauss before its gradient is taken, pixels
GAUSS = 2.0
#: flat pixels have this least distance from those that are not
MARGIN = 3
#: points of the fit at most, and how often they are weighted anew
POINTS, ROUNDS = 20_000, 8


class Shade(NamedTuple):
    """Uneven light."""

    coefficients: Floats  #: (10,) for `levels.cubic`, the mean of the surface being 0
    is_gain: bool  #: whether it is the logarithm of a factor, or an amount in levels
    span: float  #: largest by least difference of light over the picture, in levels of a bright pixel


#: level that the span of a gain is told at
BRIGHT = 255.0


def shade_of(levels: Levels, plane: Bytes, noise: float, without: Flags | None = None) -> Shade | None:
    """Fit a cubic surface whose gradient is that of the flat pixels.

    Parameters
    ----------
    levels : Levels
        Of a grey picture, unfiltered: the filter flattens slopes.
    plane : uint8, shape (n_rows, n_cols)
        Filtered levels, which tell where the picture is flat.
    noise : float
        Standard deviation of the noise in levels.
    without : bool, shape (n_rows, n_cols), optional
        Pixels that do not count.

    Returns
    -------
    Shade or None
        Light that adds or that multiplies, whichever fits better; None where too few pixels are flat.

    Notes
    -----
    Least absolute differences, by least squares that are weighted anew 8 times: steps between materials that the
    flatness test has missed are outliers. Light that multiplies by exp(b) changes a level v by v grad b.
    """
    places = _flat_places(plane, noise, without)
    if len(places[0]) < 100:
        return None
    smooth, by_x, by_y = _gradients(levels, places)
    x, y = (v.astype(float) for v in to_unit(levels.shape, *places))
    none, half = np.zeros_like(x), max(levels.shape) / 2.0
    # derivatives of x, y, xx, xy, yy, xxx, xxy, xyy, yyy
    left = np.stack([none + 1, none, 2 * x, y, none, 3 * x * x, 2 * x * y, y * y, none], axis=1)
    down = np.stack([none, none + 1, none, x, 2 * y, none, x * x, 2 * x * y, 3 * y * y], axis=1)
    matrix, wanted = np.concatenate([left, down]), half * np.concatenate([by_x, by_y])
    bright = np.tile(smooth - levels.dark, 2)[:, None]
    (added, off), (gain, off_gain) = (_least_absolute(m, wanted, 0.01 * half) for m in (matrix, matrix * bright))
    is_gain = off_gain < off
    found = _with_mean_0(gain if is_gain else added)
    return Shade(found, is_gain, _span(levels, found) * (BRIGHT - levels.dark if is_gain else 1.0))


def _span(levels: Levels, coefficients: Floats) -> float:
    """Return the range of a surface over the picture."""
    rows, cols = levels.shape
    return float(np.ptp(cubic((rows, cols), np.arange(0, rows, 4)[:, None], np.arange(0, cols, 4)[None], coefficients)))


def _flat_places(plane: Bytes, noise: float, without: Flags | None) -> tuple[Ints, ...]:
    """Return rows and columns of flat pixels, evenly thinned."""
    flat = scipy.ndimage.maximum_filter(plane, 3) - scipy.ndimage.minimum_filter(plane, 3) <= max(2.0, noise)
    if without is not None:
        flat &= ~without
    flat = scipy.ndimage.binary_erosion(flat, np.ones((3, 3), bool), iterations=MARGIN)
    found = np.flatnonzero(flat)
    found = found[:: max(1, -(-len(found) // POINTS))]
    return found // plane.shape[1], found % plane.shape[1]


def _gradients(levels: Levels, places: tuple[Ints, ...]) -> tuple[Floats, Floats, Floats]:
    """Return the smoothed picture, and its derivatives along columns and rows."""
    r, c = places
    smooth = scipy.ndimage.gaussian_filter(levels.rows(0, levels.shape[0])[..., 0], GAUSS)
    by_x = (smooth[r, c + 1].astype(float) - smooth[r, c - 1]) / 2.0
    by_y = (smooth[r + 1, c].astype(float) - smooth[r - 1, c]) / 2.0
    return smooth[r, c].astype(float), by_x, by_y


def _least_absolute(matrix: Floats, wanted: Floats, smallest: float) -> tuple[Floats, float]:
    """Return the coefficients that make the sum of absolute differences least, nearly, and this sum."""
    weights = np.ones(len(wanted))
    for _ in range(ROUNDS):
        weighted = matrix * weights[:, None]
        # a small ridge keeps pictures of one row or of few flat places determined
        normal = np.einsum("ij,ik->jk", weighted, matrix) + 1e-9 * weights.sum() * np.eye(matrix.shape[1])
        found = np.linalg.solve(normal, np.einsum("ij,i->j", weighted, wanted))
        off = np.abs(np.einsum("ij,j->i", matrix, found) - wanted)
        weights = 1.0 / np.maximum(off, smallest)
    return np.asarray(found), float(off.sum())


def _with_mean_0(coefficients: Floats) -> Floats:
    """Put a constant in front; xx and yy have the mean 1/3 on a square, odd powers 0."""
    return np.concatenate([[-(coefficients[2] + coefficients[4]) / 3.0], coefficients])
