"""Raw pictures: from shades and noise to classes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Bytes, Flags, Floats, Ints, Labels
from imgquad_core.jit import kernel, verb

from .blends import find_rims, relabel_rims
from .classes import Classes, classes_of
from .constant_values import Constant, constants_of
from .exact_colours import dark_to_light
from .levels import LIGHT, NOISY, WEIGHT, Levels, filtered_strips, noise_of, squared_gradient
from .quantisation import cielab, distances2, histogram_of
from .shading import shade_of
from .tails import tails_of

#: least contrast of a rim: levels, and at most so many more for noise
RIM, RIM_OF_NOISE = 16.0, 16.0
#: pixels of larger gradient (levels, or standard deviations of the noise) are on a slope; three channels add up
SLOPE, OF_COLOUR = 2.0, 1.7
#: ... of greys without noise: the feet of blurred edges are no class beside the grey that they rise to
FOOT = 1.0
#: shading is taken out if it ranges over more standard deviations of the noise, and separates as many classes so much
#: better, or more classes than before, or one class less, which was no phase but the uneven light of another
SHADED, BETTER, BETTER_AND_MORE, BETTER_AND_FEWER = 2.0, 1.25, 1.1, 3.0
#: the light filter counts if it separates as many classes so much better
CLEARER = 1.15
#: constants count if at least so much of the picture is flat beside them
LEFT = 0.05
#: levels by which a constant may differ from picture to picture
SAME = 1.0
#: a pixel so far from another class towards its own keeps it, whatever is around it
CLEAR = 0.7


class Smooth(NamedTuple):
    """A picture without noise."""

    plane: Bytes  #: (n_rows, n_cols, n_channels)
    rims: Flags  #: blends of two sides
    support: Flags  #: neither rims nor on slopes: what classes are judged by
    weight: float = WEIGHT  #: of the filter, in standard deviations of the noise


@dataclass(frozen=True, eq=False)
class Found:
    """Classes of a raw picture, and how they were found.

    Parameters
    ----------
    labels : int32, shape (n_rows, n_cols)
        Number of each pixel's class.
    means : float64, shape (n_classes, 1 or 3)
        Mean levels of the classes; grey ones and colours from dark to light.
    levels : Levels
        What level means which value.
    method : str
        In words.
    noise : float
        Standard deviation of the noise, in levels.
    rims : int
        Blended pixels that were given to one of their sides.
    separation : float
        Least distance of two classes in pooled standard deviations; inf if that was not looked at.
    left_over : float
        Root of the mean squared distance of the pixels' colours from their classes: levels, CIELAB units of colours.
    smooth : Smooth
        The picture without noise.
    constant : bool, shape (n_classes,)
        Which classes are constant values.
    tails : int
        How many classes are rare phases outside all others.
    """

    labels: Labels
    means: Floats
    levels: Levels
    method: str
    noise: float
    rims: int
    smooth: Smooth
    constant: Flags
    separation: float = np.inf
    left_over: float = 0.0
    tails: int = 0

    @property
    def constants(self) -> int:
        """How many classes are constant values."""
        return int(np.count_nonzero(self.constant))

    @property
    def shaded(self) -> bool:
        """Whether shading was taken out."""
        return self.levels.shade is not None


class Choice(NamedTuple):
    """Classes of the pixels that are no constants."""

    levels: Levels
    smooth: Smooth
    classes: Classes


def find_classes(levels: Levels, number: int | None = None, flatten: bool = True) -> Found:
    """Find the classes of a raw picture: as many as are far apart, or the number given.

    Parameters
    ----------
    levels : Levels
        Of the picture.
    number : int, optional
        How many.
    flatten : bool
        Whether shading may be taken out of grey pictures.

    Notes
    -----
    See `imgquad_core.picture.segmentation.segment` for the steps.
    """
    constants, noise, smooth = _without_constants(levels, number)
    fixed = np.logical_or.reduce([constant.pixels for constant in constants]) if constants else None
    wanted = None if number is None else number - len(constants)
    choice = _chosen(levels, smooth, wanted)
    if flatten and levels.is_grey and not constants:
        choice = _flattened(choice, noise, wanted)
    choice = _clearer(choice, noise, wanted, fixed)
    means = choice.classes.means
    tails: list[float] = []
    if number is None and levels.is_grey:
        tails = tails_of(choice.smooth.plane[..., 0], choice.smooth.support, np.sort(means[:, 0]), noise, fixed)
    means = np.concatenate([means, np.reshape(tails, (-1, 1))]) if tails else means
    means = means[_by_light(means)]
    return _labelled(choice, means, constants, noise, len(tails))


def _without_constants(levels: Levels, number: int | None) -> tuple[list[Constant], float, Smooth]:
    """Return the constants, the noise of all else, and the picture without noise; constants are no support."""
    noise = noise_of(levels)
    constants = constants_of(levels, noise) if levels.is_grey else []
    constants = constants if number is None else constants[: number - 1]
    if constants:
        fixed = np.logical_or.reduce([constant.pixels for constant in constants])
        noise_inside = noise_of(levels, fixed)
        if noise_inside >= NOISY:  # else a drawing in flat greys: they are its classes
            smooth = smoothed(levels, noise_inside, fixed)
            if np.count_nonzero(smooth.support) >= LEFT * fixed.size:
                return constants, noise_inside, smooth
    return [], noise, smoothed(levels, noise, None)


def find_nearest(levels: Levels, palette: Floats) -> Found:
    """Give each pixel the nearest of given colours, shape (n, 3), in CIELAB."""
    noise = noise_of(levels)
    smooth = smoothed(levels, noise, None)
    if levels.is_grey:  # only now: three equal channels would make steps and rims of its noise 1.7 times as high
        smooth = smooth._replace(plane=np.repeat(smooth.plane, 3, axis=2))
    classes = Classes(palette, np.zeros(0, np.int32), np.inf, 0.0, "nearest of the palette")
    return _labelled(Choice(levels, smooth, classes), palette, [], noise, 0)


class Known(NamedTuple):
    """Classes that were found in other pictures of the same thing."""

    means: Floats  #: (n_classes, 1 or 3), from dark to light
    constant: Flags  #: (n_classes,) which of them are constant values
    noise: float
    weight: float  #: of the filter


def known_classes(found: Found) -> Known:
    """Return the classes of a picture, for others of the same thing."""
    return Known(found.means, found.constant, found.noise, found.smooth.weight)


def find_known(levels: Levels, known: Known) -> Labels:
    """Give each pixel its class of those that are known.

    Raises
    ------
    ValueError
        The picture has colours, the classes are grey.
    """
    smooth = smoothed(levels, known.noise, None, known.weight)
    in_color = known.means.shape[1] == 3
    if levels.is_grey and in_color:
        smooth = smooth._replace(plane=np.repeat(smooth.plane, 3, axis=2))
    elif in_color != (not levels.is_grey):
        raise ValueError("colours among greys")
    shades, levels_of_constants = np.flatnonzero(~known.constant), np.flatnonzero(known.constant)
    constants, order = [], list(shades)
    for constant in constants_of(levels, known.noise) if len(levels_of_constants) else []:
        nearest = levels_of_constants[np.abs(known.means[levels_of_constants, 0] - constant.level).argmin()]
        if abs(known.means[nearest, 0] - constant.level) <= SAME and nearest not in order:
            constants.append(constant)
            order.append(nearest)
    classes = Classes(known.means[shades], np.zeros(0, np.int32), np.inf, 0.0, "")
    labels = _numbered(Choice(levels, smooth, classes), known.means[shades], constants, known.noise)
    return np.asarray(np.array(order, np.int32)[labels], np.int32)


def smoothed(levels: Levels, noise: float, without: Flags | None, weight: float = WEIGHT) -> Smooth:
    """Take noise away and tell rims and slopes from what is flat; pixels `without` and void are no support."""
    plane = np.empty((*levels.shape, levels.values.shape[2]), np.uint8)
    gentle = np.empty(levels.shape, np.bool_)
    drawn = levels.is_grey and noise < NOISY
    bound = FOOT if drawn else max(SLOPE, noise) * (1.0 if levels.is_grey else OF_COLOUR)
    for strip in filtered_strips(levels, noise, weight):
        plane[strip.place] = np.rint(np.clip(strip.shades[strip.own], 0.0, 255.0))
        gentle[strip.place] = squared_gradient(strip.shades)[strip.own] <= bound**2
    rims = find_rims(plane, RIM + min(noise, RIM_OF_NOISE))
    support = gentle & ~rims
    for pixels in (levels.void, without):
        if pixels is not None:
            support &= ~pixels
    return Smooth(plane, rims, support, weight)


def _chosen(levels: Levels, smooth: Smooth, number: int | None) -> Choice:
    """Find the classes of the support, of all pixels where there are noise or slopes all over."""
    support = smooth.support
    if not support.any():
        support = np.ones(levels.shape, np.bool_) if levels.void is None else ~levels.void
    return Choice(levels, smooth, classes_of(histogram_of(smooth.plane, support), number))


def _flattened(choice: Choice, noise: float, number: int | None) -> Choice:
    """Return the choice without shading, where that separates the classes clearly better."""
    shade = shade_of(choice.levels, choice.smooth.plane[..., 0], noise, choice.levels.void)
    if shade is None or shade.span <= SHADED * noise:
        return choice
    flat = choice.levels.without_shade(shade.coefficients, shade.is_gain)
    other = _chosen(flat, smoothed(flat, noise, None), number)
    n, n_before = len(other.classes.means), len(choice.classes.means)
    if n < n_before:
        is_better = n == n_before - 1 and other.classes.separation > BETTER_AND_FEWER * choice.classes.separation
    else:
        factor = BETTER if n == n_before else BETTER_AND_MORE
        is_better = other.classes.separation > factor * _apart(choice, n)
    return other if is_better else choice


def _clearer(choice: Choice, noise: float, number: int | None, without: Flags | None) -> Choice:
    """Return the choice by the light filter, where that separates as many classes clearly better.

    The filter takes twice its weight over their width from the contrast of thin phases: then its classes are nearer
    to each other than what is left of the noise makes them.
    """
    if noise < NOISY:
        return choice
    other = _chosen(choice.levels, smoothed(choice.levels, noise, without, LIGHT), number)
    is_same = len(other.classes.means) == len(choice.classes.means)
    return other if is_same and other.classes.separation > CLEARER * choice.classes.separation else choice


def _apart(choice: Choice, n: int) -> float:
    """Return how far apart `n` classes of a choice are."""
    return (choice if n == len(choice.classes.means) else _chosen(choice.levels, choice.smooth, n)).classes.separation


def _by_light(means: Floats) -> Ints:
    """Return the order of classes from dark to light."""
    return dark_to_light(np.rint(means if means.shape[1] == 3 else np.repeat(means, 3, axis=1)))


def _labelled(choice: Choice, means: Floats, constants: list[Constant], noise: float, tails: int) -> Found:
    """Give each pixel its class, and the classes their order."""
    labels = _numbered(choice, means, constants, noise)
    means = np.concatenate([means, *([[c.level]] for c in constants)])
    is_constant = np.arange(len(means)) >= len(means) - len(constants)
    if constants:
        order = _by_light(means)
        place = np.empty(len(order), np.int32)
        place[order] = np.arange(len(order))
        labels, means, is_constant = place[labels], means[order], is_constant[order]
    return Found(
        labels=labels,
        means=means,
        levels=choice.levels,
        method=choice.classes.method,
        noise=noise,
        rims=int(np.count_nonzero(choice.smooth.rims)),
        smooth=choice.smooth,
        constant=is_constant,
        separation=choice.classes.separation,
        left_over=choice.classes.left_over,
        tails=tails,
    )


def _numbered(choice: Choice, means: Floats, constants: list[Constant], noise: float) -> Labels:
    """Give each pixel its nearest class, rims one of their sides, noise what is around it; constants come last."""
    smooth = choice.smooth
    histogram = histogram_of(smooth.plane, smooth.support)
    in_color = means.shape[1] == 3
    points, centres = (cielab(histogram.levels), cielab(means)) if in_color else (histogram.levels, means)
    labels = histogram.spread(distances2(points, centres).argmin(axis=1).astype(np.int32))
    means = np.concatenate([means, *([[c.level]] for c in constants)])
    for k, constant in enumerate(constants):
        labels[constant.pixels] = len(means) - len(constants) + k
    if len(means) > 2:
        relabel_rims(smooth.plane, smooth.rims, labels, means)
        for k, constant in enumerate(constants):
            labels[constant.pixels] = len(means) - len(constants) + k
    return commonest_around(labels, smooth.plane, means) if noise >= NOISY else labels


@kernel
def commonest_around(labels: Labels, plane: Bytes, means: Floats) -> Labels:
    """Return the commonest label of the 3 x 3 pixels around each, its own among equals, else the first in order.

    A pixel that is clearly of its own class stays: it may be of a line one pixel wide.
    """
    rows, cols = labels.shape
    found = labels.copy()
    for r in range(rows):
        for c in range(cols):
            top, left, bottom, right = max(r - 1, 0), max(c - 1, 0), min(r + 2, rows), min(c + 2, cols)
            most = count_in(labels, top, left, bottom, right, labels[r, c])
            if 2 * most > (bottom - top) * (right - left):
                continue
            for i in range(top, bottom):
                for j in range(left, right):
                    n = count_in(labels, top, left, bottom, right, labels[i, j])
                    if n > most:
                        found[r, c], most = labels[i, j], n
            if found[r, c] != labels[r, c] and is_clear(plane, means, r, c, labels[r, c], found[r, c]):
                found[r, c] = labels[r, c]
    return found


@verb
def is_clear(plane: Bytes, means: Floats, r: int, c: int, own: int, other: int) -> bool:
    """Tell whether a pixel lies at least `CLEAR` of the way from the class `other` to its own."""
    along, whole = 0.0, 0.0
    for k in range(plane.shape[2]):
        step = means[own, k] - means[other, k]
        along += (float(plane[r, c, k]) - means[other, k]) * step
        whole += step * step
    return along >= CLEAR * whole


@verb
def count_in(labels: Labels, top: int, left: int, bottom: int, right: int, label: int) -> int:
    """Return how often `label` occurs in a window."""
    n = 0
    for i in range(top, bottom):
        for j in range(left, right):
            n += labels[i, j] == label
    return n
