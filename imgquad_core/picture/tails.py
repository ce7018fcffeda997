"""Rare phases: what is far darker or far brighter than all classes of a histogram."""

from __future__ import annotations

import numpy as np
import scipy

from imgquad_core.arrays import Bytes, Flags, Floats

#: distance from a class, in its own standard deviations (by the median deviation) and in those of the noise
OWN, OF_NOISE = 6.0, 1.5
#: ... and as a part of the least distance of two classes
OF_GAP = 0.35
#: a peak of the histogram is a phase, too, if from so many of the class's deviations on there is a valley before it
#: that is so many times as low
FOOT, VALLEY = 3.0, 4.0
#: levels that the histogram is averaged over for this
AVERAGED = 5
#: smallest connected part, in pixels, and share of the picture of all of them
PIXELS, SHARE = 16, 0.001
#: distance from a part, pixels, at which its surroundings are looked at: past the rim
AROUND = 3


def tails_of(plane: Bytes, support: Flags, means: Floats, noise: float, constant: Flags | None = None) -> list[float]:
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
    constant : bool, shape (n_rows, n_cols), optional
        Pixels of constant values: what is beside them may be blurred towards them, and is no phase.
    """
    free = None if constant is None else ~scipy.ndimage.binary_dilation(constant, iterations=AROUND)
    weights = np.bincount(plane[support], minlength=256).astype(float)
    nearest = np.abs(np.arange(256.0)[:, None] - means[None]).argmin(axis=1)
    gap = OF_GAP * float(np.diff(means).min()) if len(means) > 1 else 0.0
    found = []
    for side, k in ((-1, 0), (1, len(means) - 1)):
        middle, deviation = _middle_and_deviation(np.where(nearest == k, weights, 0.0))
        upwards = (weights, middle) if side > 0 else (weights[::-1], 255.0 - middle)
        far = min(OWN * deviation, _valley(*upwards, deviation))
        least = max(far, OF_NOISE * noise, gap, 1.0)
        beyond = plane < middle - least if side < 0 else plane > middle + least
        level = _level_of(plane, beyond if free is None else beyond & free, support, middle)
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


def _valley(weights: Floats, middle: float, deviation: float) -> float:
    """Return how far above `middle` the valley before another peak of a histogram lies; inf where there is none."""
    first = int(np.ceil(middle + FOOT * deviation))
    beyond = scipy.ndimage.uniform_filter1d(weights, AVERAGED)[first:]
    if len(beyond) == 0:
        return np.inf
    peaks = np.flatnonzero(beyond > VALLEY * np.minimum.accumulate(beyond))
    if len(peaks) == 0:
        return np.inf
    peak = peaks[beyond[peaks].argmax()]
    return first + int(beyond[: peak + 1].argmin()) - middle


def _level_of(plane: Bytes, beyond: Flags, support: Flags, middle: float) -> float | None:
    """Return the mean level of pixels `beyond` in parts that are large enough, None where these are too few.

    A phase ends at an edge: what is around it lies nearer to the `middle` of its neighbour. A halo fades out.
    """
    if np.count_nonzero(beyond) < SHARE * plane.size:
        return None
    parts, n = scipy.ndimage.label(beyond)
    pixels = np.bincount(parts.ravel(), minlength=n + 1)
    firm = np.bincount(parts[support], minlength=n + 1)
    kept = (pixels >= PIXELS) & (firm > 0)
    kept[0] = False
    if pixels[kept].sum() < SHARE * plane.size:
        return None
    inside = kept[parts]
    level = float(plane[inside & support].mean())
    return level if _ends_at_edges(plane, inside, level, middle) else None


def _ends_at_edges(plane: Bytes, inside: Flags, level: float, middle: float) -> bool:
    """Whether most pixels that are `AROUND` away from a part lie less than half way from `middle` to its level."""
    near = scipy.ndimage.binary_dilation(inside, iterations=AROUND - 1)
    around = plane[scipy.ndimage.binary_dilation(near) & ~near]
    return len(around) == 0 or abs(level - middle) > 2.0 * float(np.median(around) - middle) * np.sign(level - middle)
