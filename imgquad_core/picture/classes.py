"""How many classes the shades of a picture fall into, and which."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Floats, Labels

from .quantisation import Histogram, cielab, distances2, errors_of, kmeans_centres, otsu_centres

#: neighbouring classes lie at least so many pooled standard deviations apart. A Gaussian cut in two has 2.65, a
#: uniform distribution 3.46
APART = 4.0
#: least distance of two classes where no number of classes keeps `APART`; below it there is one
BARELY = 2.7
#: least share of a class
SHARE = 0.002
#: most classes of grey and of colour
MOST = {1: 10, 3: 32}
#: variance of a level, and of a CIELAB unit, that classes have at least: what rounding and the histogram's bins hide
FLOOR = {1: 0.5, 3: 0.25}


class Classes(NamedTuple):
    """What the shades of a picture fall into."""

    means: Floats  #: (n_classes, n_channels), levels
    nearest: Labels  #: the class of each bin of the histogram
    separation: float  #: least distance of two classes in pooled standard deviations; of one class: if it were two
    left_over: float  #: root of the mean squared distance of the pixels from their class: levels, or CIELAB units
    method: str


def classes_of(histogram: Histogram, number: int | None = None) -> Classes:
    """Divide a histogram in classes: the largest number of them that are far apart, or the number given.

    Parameters
    ----------
    histogram : Histogram
        Of pixels that are neither rims nor on slopes.
    number : int, optional
        How many; as many as are found by default.

    Notes
    -----
    Grey is split by multi-Otsu, colours by k-means in CIELAB. The distance of two classes is that of their means over
    the root of the mean of their variances (of colours: along the line between the means).
    """
    channels = histogram.levels.shape[1]
    points = histogram.levels if channels == 1 else cielab(histogram.levels)
    most = MOST[channels] if number is None else number
    grey = channels == 1
    found = otsu_centres(histogram.weights, most) if grey else kmeans_centres(points, histogram.weights, most)
    chosen = found[-1] if number is not None else _chosen(points, histogram.weights, found)
    nearest = distances2(points, chosen).argmin(axis=1).astype(np.int32)
    method = "multi-Otsu" if grey else "k-means in CIELAB"
    separation, _ = _separation(points, histogram.weights, found[1] if len(chosen) == 1 < len(found) else chosen)
    left_over = float(np.sqrt(errors_of(points, histogram.weights, [chosen])[0]))
    return Classes(_means(histogram, nearest, len(chosen)), nearest, separation, left_over, method)


def _chosen(points: Floats, weights: Floats, found: list[Floats]) -> Floats:
    """Return the largest set of centres that are far apart; two that barely are, else one."""
    for centres in reversed(found[1:]):
        separation, share = _separation(points, weights, centres)
        if separation >= APART and share >= SHARE:
            return centres
    if len(found) > 1 and _separation(points, weights, found[1])[0] >= BARELY:
        return found[1]
    return found[0]


def _separation(points: Floats, weights: Floats, centres: Floats) -> tuple[float, float]:
    """Return the least distance of two classes in pooled standard deviations, and the least share of a class."""
    n, dimension = centres.shape
    nearest = distances2(points, centres).argmin(axis=1)
    mass = np.bincount(nearest, weights, n)
    if n == 1 or (mass <= 0).any():
        return (np.inf, 1.0) if n == 1 else (0.0, 0.0)
    means = np.stack([np.bincount(nearest, weights * x, n) for x in points.T], axis=1) / mass[:, None]
    away = points - means[nearest]
    products = weights[:, None, None] * away[:, :, None] * away[:, None, :]
    covariance = np.zeros((n, dimension, dimension))
    np.add.at(covariance, nearest, products)
    covariance /= mass[:, None, None]
    a, b = (np.arange(n - 1), np.arange(1, n)) if dimension == 1 else np.triu_indices(n, 1)
    line = means[b] - means[a]
    length = np.linalg.norm(line, axis=1)
    unit = line / np.where(length > 0, length, 1.0)[:, None]
    variance = np.einsum("ki,kij,kj->k", unit, (covariance[a] + covariance[b]) / 2.0, unit)
    return float((length / np.sqrt(variance + FLOOR[dimension])).min()), float(mass.min() / mass.sum())


def _means(histogram: Histogram, nearest: Labels, n: int) -> Floats:
    """Return the mean levels of each class."""
    mass = np.bincount(nearest, histogram.weights, n)
    sums = [np.bincount(nearest, histogram.weights * channel, n) for channel in histogram.levels.T]
    return np.asarray(np.stack(sums, axis=1) / np.where(mass > 0, mass, 1.0)[:, None])
