"""Few colours for many: multi-Otsu for grey, k-means in CIELAB for colours, on histograms, deterministic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
import skimage
from numpy.typing import NDArray

from imgquad_core.arrays import Bytes, Flags, Floats, Ints, Labels
from imgquad_core.jit import kernel

#: bits of each channel that the histogram of colours keeps
BITS = 6


@dataclass(frozen=True, eq=False)
class Histogram:
    """Colours that occur, and how often.

    Parameters
    ----------
    codes : integer, shape (n_rows, n_cols)
        Code of each pixel.
    number : int32, shape (n_codes,)
        Bin of each code (0 where it does not occur).
    levels : float64, shape (n_bins, n_channels)
        Mean levels of each bin, 0 to 255.
    weights : float64, shape (n_bins,)
        Pixels of each bin that count.
    """

    codes: NDArray[Any]
    number: Labels
    levels: Floats
    weights: Floats

    def spread(self, of_bins: Labels) -> Labels:
        """Return for each pixel what `of_bins` gives for its bin."""
        return np.asarray(of_bins[self.number][self.codes], np.int32)


def histogram_of(levels: Bytes, counted: Flags) -> Histogram:
    """Return the histogram of grey (one bin a level) or RGB (2**BITS steps a channel).

    Parameters
    ----------
    levels : uint8, shape (n_rows, n_cols, 1 or 3)
        Colours.
    counted : bool, shape (n_rows, n_cols)
        Pixels that the weights count.
    """
    if levels.shape[2] == 1:
        plane = levels[..., 0]
        weights = np.bincount(plane[counted], minlength=256).astype(float)
        return Histogram(plane, np.arange(256, dtype=np.int32), np.arange(256.0)[:, None], weights)
    size = 1 << 3 * BITS
    codes = np.empty(levels.shape[:2], np.int32)
    sums = np.zeros((size, 5), np.int64)
    fill_histogram(levels, counted, codes, sums)
    present = np.flatnonzero(sums[:, 3])
    number = np.zeros(size, np.int32)
    number[present] = np.arange(len(present))
    sums = sums[present]
    return Histogram(codes, number, sums[:, :3] / sums[:, 3:4], sums[:, 4].astype(float))


@kernel
def fill_histogram(levels: Bytes, counted: Flags, codes: Labels, sums: Ints) -> None:
    """Fill codes, and by code the sums of the channels, all pixels and pixels that count."""
    for r in range(levels.shape[0]):
        for c in range(levels.shape[1]):
            code = 0
            for k in range(3):
                code = (code << BITS) | (int(levels[r, c, k]) >> (8 - BITS))
            codes[r, c] = code
            for k in range(3):
                sums[code, k] += levels[r, c, k]
            sums[code, 3] += 1
            sums[code, 4] += counted[r, c]


def otsu_centres(weights: Floats, most: int) -> list[Floats]:
    """Return the class means, shape (n_classes, 1), of the best splits of a grey histogram in 1 to `most` classes.

    Exact: least sum of squares by dynamic programming, which is Otsu's criterion for several thresholds.

    References
    ----------
    Otsu (1979), doi:10.1109/TSMC.1979.4310076; Wang and Song (2011), doi:10.32614/RJ-2011-015.
    """
    levels = np.arange(len(weights) + 1)
    total, first, second = (
        np.concatenate([[0.0], np.cumsum(weights * np.arange(len(weights)) ** power)]) for power in (0, 1, 2)
    )
    mass, moment = total[None, :] - total[:, None], first[None, :] - first[:, None]
    cost = second[None, :] - second[:, None] - moment**2 / np.where(mass > 0, mass, 1.0)
    # classes [i, j) that hold pixels only
    cost = np.where((levels[:, None] < levels[None, :]) & (mass > 0), np.maximum(cost, 0.0), np.inf)
    best, starts, found = cost[0], [], [np.array([[first[-1] / total[-1]]])]
    for _ in range(1, min(most, int(np.count_nonzero(weights)))):
        through = best[:, None] + cost
        starts.append(through.argmin(axis=0))
        best = through.min(axis=0)
        ends = [len(weights)]
        for start in reversed(starts):
            ends.append(int(start[ends[-1]]))
        cuts = np.array([0, *ends[:0:-1], len(weights)])
        found.append((np.diff(first[cuts]) / np.diff(total[cuts]))[:, None])
    return found


def kmeans_centres(points: Floats, weights: Floats, most: int) -> list[Floats]:
    """Return k-means centres of weighted points for 1, 2, ... `most` classes.

    Each set starts from the one before, with the point added that lowers the sum of squares most (fast global
    k-means, Likas et al. 2003, doi:10.1016/S0031-3203(02)00060-2) or with the class of the largest sum of squares cut
    across its longest axis (Su and Dy 2007, doi:10.3233/IDA-2007-11402): whichever is better after Lloyd's steps. No
    random numbers.
    """
    points, weights = points[weights > 0], weights[weights > 0]
    centres = np.average(points, axis=0, weights=weights)[None, :]
    found = [centres]
    for _ in range(1, min(most, len(points))):
        starts = (_extended(points, weights, centres), _cut(points, weights, centres))
        both = [_settled(points, weights, start, 20) for start in starts]
        centres = both[int(errors_of(points, weights, both).argmin())]
        found.append(centres)
    found[-1] = _settled(points, weights, centres, 100)
    return found


def _extended(points: Floats, weights: Floats, centres: Floats) -> Floats:
    """Add the point that lowers the sum of squares most, of the 256 that add most to it."""
    nearest = distances2(points, centres).min(axis=1)
    candidates = np.argsort(-weights * nearest, kind="stable")[:256]
    lowered = np.maximum(nearest[:, None] - distances2(points, points[candidates]), 0.0)
    gains = (weights[:, None] * lowered).sum(axis=0)  # no BLAS, whose sums hang on its number of threads
    return np.vstack([centres, points[candidates[gains.argmax()]]])


def _cut(points: Floats, weights: Floats, centres: Floats) -> Floats:
    """Put two centres for that of the class with the largest sum of squares, on both sides along its longest axis."""
    distances = distances2(points, centres)
    nearest = distances.argmin(axis=1)
    worst = int(np.bincount(nearest, weights * distances.min(axis=1), len(centres)).argmax())
    mine = nearest == worst
    away = points[mine] - centres[worst]
    spread = (weights[mine, None, None] * away[:, :, None] * away[:, None, :]).sum(axis=0)
    values, axes = np.linalg.eigh(spread / weights[mine].sum())
    step = np.sqrt(max(values[-1], 0.0)) * axes[:, -1]
    return np.vstack([np.delete(centres, worst, axis=0), centres[worst] - step, centres[worst] + step])


def _settled(points: Floats, weights: Floats, centres: Floats, steps: int) -> Floats:
    """Move centres to the means of their points until they stay (Lloyd)."""
    for _ in range(steps):
        nearest = distances2(points, centres).argmin(axis=1)
        mass = np.bincount(nearest, weights, len(centres))
        sums = np.stack([np.bincount(nearest, weights * x, len(centres)) for x in points.T], axis=1)
        moved = np.where(mass[:, None] > 0, sums / np.where(mass > 0, mass, 1.0)[:, None], centres)
        if np.abs(moved - centres).max() < 1e-2:
            return moved
        centres = moved
    return centres


def distances2(points: Floats, centres: Floats) -> Floats:
    """Return squared distances, shape (n_points, n_centres)."""
    return np.asarray(scipy.spatial.distance.cdist(points, centres, "sqeuclidean"), float)


def errors_of(points: Floats, weights: Floats, found: list[Floats]) -> Floats:
    """Return the mean squared error of each set of centres."""
    return np.array([(distances2(points, c).min(axis=1) * weights).sum() / weights.sum() for c in found])


def cielab(levels: Floats) -> Floats:
    """Return RGB levels, shape (n, 3), 0 to 255, in CIELAB."""
    return np.asarray(skimage.color.rgb2lab(levels / 255.0), float)
