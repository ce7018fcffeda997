"""Rare phases: what is far darker or far brighter than all classes of a histogram."""

from __future__ import annotations

import numpy as np

from imgquad_core.arrays import Bytes, Flags, Floats

#: distance from a class, in its own standard deviations (by the median deviation) and in those of the noise
OWN, OF_NOISE = 6.0, 1.5
#: ... and as a part of the least distance of two classes
OF_GAP = 0.35
#: smallest connected part, in pixels, and share of the picture of all of them
PIXELS, SHARE = 16, 0.001


def tails_of(plane: Bytes, support: Flags, means: Floats, noise: float) -> list[float]:
    """Return the mean levels of phases darker than the darkest class and brighter than the brightest.

    Parameters
    ----------
    plane : uint8, shape (n_rows, n_cols)
        Filtered levels.
    support : bool, shape (n_rows, n_cols)
        Pixels that are neither rims nor on slopes.
    means : float64, shape (n_classes,)
        Mean levels of the classes, ascending.
    noise : float
        Standard deviation of the noise in levels.
    """
    weights = np.bincount(plane[support], minlength=256).astype(float)
    nearest = np.abs(np.arange(256.0)[:, None] - means[None]).argmin(axis=1)
    gap = OF_GAP * float(np.diff(means).min()) if len(means) > 1 else 0.0
    found = []
    for side, k in ((-1, 0), (1, len(means) - 1)):
        middle, deviation = _middle_and_deviation(np.where(nearest == k, weights, 0.0))
        least = max(OWN * deviation, OF_NOISE * noise, gap, 1.0)
        beyond = plane < middle - least if side < 0 else plane > middle + least
        level = _level_of(plane, beyond, support)
        if level is not None:
            found.append(level)
    return found


def _middle_and_deviation(weights: Floats) -> tuple[float, float]:
    """Return the median of a histogram and its standard deviation by the median deviation (bins are even inside)."""
    edges = np.arange(len(weights) + 1) - 0.5
    sums = np.concatenate([[0.0], np.cumsum(weights)])
    if sums[-1] == 0:
        return 0.0, 0.0
    middle = float(np.interp(0.5 * sums[-1], sums, edges))
    away = np.linspace(0.0, float(len(weights)), 8 * len(weights) + 1)
    within = np.interp(middle + away, edges, sums) - np.interp(middle - away, edges, sums)
    return middle, 1.4826 * float(np.interp(0.5 * sums[-1], within, away))


def _level_of(plane: Bytes, beyond: Flags, support: Flags) -> float | None:
    """Return the mean level of pixels `beyond` in parts that are large enough, None where these are too few."""
    from scipy.ndimage import label

    if np.count_nonzero(beyond) < SHARE * plane.size:
        return None
    parts, n = label(beyond)
    pixels = np.bincount(parts.ravel(), minlength=n + 1)
    firm = np.bincount(parts[support], minlength=n + 1)
    kept = (pixels >= PIXELS) & (firm > 0)
    kept[0] = False
    if pixels[kept].sum() < SHARE * plane.size:
        return None
    inside = kept[parts] & support
    return float(plane[inside].mean())
