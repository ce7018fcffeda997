"""Parts of a picture that are thinner than a tolerance go to their neighbours, so that boundaries stay shared.

With r half the tolerance, a disc of radius r fits around every pixel of a CORE, inside its own region and the picture.
What is within 2 r of a core stays: corners of more than 60 degrees do. The rest is thin, and flooded from all sides::

      ############                ############      # one region: its arm and the bay are thin
      ############                ############
      ##########.............     ############      the arm goes to the dots, and the bay to the region,
      ####   ####                 ############      whatever else it holds
      ####   ####                 ############

Where much was changed outlines are rounded. A picture of specks all over has no cores to flood from: there materials
are given places by their local density first, each with a weight that leaves it its area.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from imgquad_core.arrays import Flags, Floats, Labels
from imgquad_core.geometry.corner_rule import corner_rule
from imgquad_core.jit import kernel
from imgquad_core.model import VOID, LabelImage
from imgquad_core.orientation import turn_of_image

from .clusters import pixels_of, roots_of
from .cores import PX, distances, flood, near_core
from .options import AbsorbOptions
from .rounding import BELL_ENDS, rounded

FINEST = 6.0  #: px; with a smaller tolerance the picture is enlarged first: discs of 1 or 2 px eat the stairs
MOST_TIMES = 3  #: as wide
ROUNDS = 6
SPREAD, RIM = 2.0, 4.0  # radii around what is thin: room for further rounds, and around that, which they look at
CORNER = 2.0  # radii from a core that stay
BLUNT = 0.5  # width of the bell over the radius, where outlines are rounded
SPECKS, FAR = 0.02, 0.75  # share of the picture that is farther than that many tolerances from what stays: it is noisy
BALANCES, POWER, CALMER = 12, 0.7, 0.85  # rounds in which weights are set, how far at once, and how far in the next
MOST_BYTES = 2_000_000_000  # of densities; a picture with more is flooded


@dataclass(frozen=True)
class Absorption:
    """What one material lost and gained.

    Parameters
    ----------
    material, regions, absorbed : int
        Number of the material, of its regions, and of those that are gone.
    pixels, lost, gained : int
        Its pixels, those that went to others, and those of others that came to it.
    """

    material: int
    regions: int
    absorbed: int
    pixels: int
    lost: int
    gained: int


class Absorbed(NamedTuple):
    """A picture without thin parts."""

    image: LabelImage  #: of the size it had
    enlarged: LabelImage  #: what is meshed: enlarged `times`
    times: int
    materials: tuple[Absorption, ...]  #: none where nothing was asked for
    is_noisy: bool = False  #: materials were given places by their density: regions are the rest of nothing
    too_wide: bool = False  #: no part is as wide as the tolerance: all is as without one


def absorb_thin(image: LabelImage, options: AbsorbOptions) -> Absorbed:
    """Give what is thinner than a tolerance to its neighbours.

    Parameters
    ----------
    image : LabelImage
        The picture; void pixels stay void.
    options : AbsorbOptions
        What is absorbed.

    Returns
    -------
    Absorbed
        The picture without thin parts.
    """
    times = int(np.clip(np.ceil(FINEST / max(options.tolerance, 1.0)), 1, MOST_TIMES))
    if not options.tolerance:
        return Absorbed(image, image, 1, ())
    turn = turn_of_image(image, options.policy)
    image = turn.image(image)
    before = enlarged_labels(image.labels, times)
    radius, rule = 0.5 * options.tolerance * times, corner_rule(options.policy, options.step * times)
    stays = np.isin(before, [VOID, *options.keep])
    after, is_noisy = _absorbed(before, stays, radius, rule)
    if after is before and not (_kept(before, stays, radius, rule) & (before != VOID)).any():
        image, accounts = turn.image_back(image), _accounts(before, after, times, options)
        return Absorbed(image, image, 1, accounts, too_wide=True)
    middle = after[times // 2 :: times, times // 2 :: times]
    enlarged = LabelImage(after, image.materials)
    small = enlarged if times == 1 else LabelImage(middle, image.materials)
    accounts = _accounts(before, after, times, options)
    return Absorbed(turn.image_back(small), turn.image_back(enlarged), times, accounts, is_noisy)


def widest_part(image: LabelImage) -> float:
    """Return the width of the widest part of a picture, in pixels: of a larger tolerance nothing is left to stay."""
    return 2.0 * float(np.where(image.labels == VOID, 0.0, distances(image.labels)).max(initial=0.0))


def enlarged_labels(labels: Labels, times: int) -> Labels:
    """Return a picture with each pixel `times` as wide and high."""
    return np.ascontiguousarray(np.repeat(np.repeat(labels, times, axis=0), times, axis=1))


def areas_of_origin(before: Labels, after: Labels, rule: int) -> Floats:
    """Return the area that each region of the new picture is to have: that of what it is the rest of.

    Parameters
    ----------
    before, after : int32, shape (n_rows, n_cols)
        Labels.
    rule : int
        Of the ambiguous corner, see `corner_rule`.

    Returns
    -------
    float64, shape (n_regions,)
        In pixels; regions are numbered in the order of their first pixels. Those of the old picture give their area
        to their rests, by overlap; where nothing is left of one, its pixels count for the regions that they are in.
    """
    return _areas_of_rests(before.ravel(), after.ravel(), roots_of(before, rule), roots_of(after, rule))


@kernel
def _areas_of_rests(before: Labels, after: Labels, old: Labels, new: Labels) -> Floats:
    n = len(after)
    total, rest, region = np.zeros(n, np.int32), np.zeros(n, np.int32), np.empty(n, np.int32)
    n_regions = 0
    for p in range(n):
        if after[p] != VOID:
            total[old[p]] += 1
            rest[old[p]] += before[p] == after[p]
            if new[p] == p:
                region[p] = n_regions
                n_regions += 1
    areas, pixels = np.zeros(n_regions), np.zeros(n_regions)
    for p in range(n):
        if after[p] != VOID:
            k = region[new[p]]
            pixels[k] += 1.0
            if before[p] == after[p]:
                areas[k] += total[old[p]] / rest[old[p]]
            elif rest[old[p]] == 0:
                areas[k] += 1.0
    return np.maximum(areas, 0.5 * pixels)


def _absorbed(labels: Labels, stays: Flags, radius: float, rule: int) -> tuple[Labels, bool]:
    """Absorb what is thin; also tell whether the picture is noisy.

    The first round works on the whole picture. What it leaves thin are a few spots: each goes on in its window.
    """
    new, stays, gone = _flooded(labels, stays, radius, rule)
    if not gone.any():
        return labels, False
    is_noisy = bool(np.mean(gone > FAR * 2.0 * radius * PX) > SPECKS)
    if is_noisy:
        labels = _balanced(labels, stays, radius)
        new, stays, _ = _flooded(labels, stays, radius, rule)
    labels = rounded(new, (new != labels) & ~stays, stays, radius, BLUNT * radius)
    rim = int(np.ceil(RIM * radius))
    for window in _windows(~_kept(labels, stays, radius, rule), rim + int(np.ceil(radius * max(SPREAD, radius)))):
        held = stays[window] | _rim(window, labels.shape, rim)
        labels[window] = _settled(labels[window].copy(), held, radius, rule)
    return labels, is_noisy


def _settled(labels: Labels, stays: Flags, radius: float, rule: int) -> Labels:
    """Absorb until nothing is thin, or for some rounds."""
    for _ in range(ROUNDS - 1):
        new, stays, gone = _flooded(labels, stays, radius, rule)
        if not gone.any():
            return labels
        labels = rounded(new, (new != labels) & ~stays, stays, radius, BLUNT * radius)
    # what the last rounding left thin may not be seen in the picture that is not enlarged
    return _flooded(labels, stays, radius, rule)[0]


def _flooded(labels: Labels, stays: Flags, radius: float, rule: int) -> tuple[Labels, Flags, Labels]:
    """Flood what is thin; also tell what stays from now on, and how far each pixel is from what is kept."""
    kept = _kept(labels, stays, radius, rule)
    if kept.all() or not (kept & (labels != VOID)).any():
        return labels, stays, np.zeros(labels.shape, np.int32)
    new, gone = flood(labels, kept)
    return new, stays | (~kept & (gone == 0)), gone  # between void pixels, with nothing in reach that is kept


def _windows(flags: Flags, margin: int) -> Iterator[tuple[slice, slice]]:
    """Yield windows with a margin around flagged pixels, one for those that are near each other."""
    side = 2 * margin
    cells = np.zeros([-(-n // side) for n in flags.shape], bool)
    cells[tuple(at // side for at in np.nonzero(flags))] = True
    for box in scipy.ndimage.find_objects(scipy.ndimage.label(cells, np.ones((3, 3)))[0]):
        wide = tuple(slice(side * along.start, side * along.stop) for along in box)
        rows, cols = (
            slice(max(along.start + at.min() - margin, 0), along.start + at.max() + 1 + margin)
            for along, at in zip(wide, np.nonzero(flags[wide]), strict=True)
        )
        yield rows, cols


def _rim(window: tuple[slice, slice], shape: tuple[int, ...], width: int) -> Flags:
    """Flag the rim of a window, but where the picture ends: what is near is not known there."""
    inside = tuple(
        slice(width if along.start else 0, -width if along.stop < n else None)
        for along, n in zip(window, shape, strict=True)
    )
    flags = np.ones([min(along.stop, n) - along.start for along, n in zip(window, shape, strict=True)], bool)
    flags[inside] = False
    return flags


def _kept(labels: Labels, stays: Flags, radius: float, rule: int) -> Flags:
    """Tell which pixels stay: near a core of a region that is large enough."""
    large = _are_large(roots_of(labels, rule), 4.0 * radius * radius).reshape(labels.shape)
    return np.asarray((near_core(labels, distances(labels), radius, CORNER * radius) & large) | stays)


def _are_large(root: Labels, least: float) -> Flags:
    """Tell which pixels are in a region of at least so many pixels."""
    return np.asarray((pixels_of(root) >= least)[root])


def _balanced(labels: Labels, stays: Flags, width: float) -> Labels:
    """Give each pixel to the material that is densest around it, with weights that leave each its area.

    Where densities are flat a little more weight takes all of them: the weights whose areas are nearest count.
    """
    materials, number = np.unique(labels[labels != VOID], return_counts=True)
    if 4 * len(materials) * labels.size > MOST_BYTES or len(materials) < 2:
        return labels
    density = np.stack(
        [scipy.ndimage.gaussian_filter((labels == m).astype(np.float32), width, truncate=BELL_ENDS) for m in materials]
    )
    free = ~stays
    held = np.array([np.count_nonzero(stays & (labels == m)) for m in materials])
    weight, best, least = np.ones(len(materials), np.float32), np.zeros(labels.shape, np.int64), np.inf
    for power in POWER * CALMER ** np.arange(BALANCES):
        winner = (density * weight[:, None, None]).argmax(axis=0)
        present = np.bincount(winner[free], minlength=len(materials)) + held
        if (off := np.abs(present - number).sum()) < least:
            best, least = winner, off
        weight *= ((number / np.maximum(present, 1)) ** power).astype(np.float32)
        weight /= weight.max()
    return np.where(free, materials[best], labels).astype(np.int32)


def _accounts(before: Labels, after: Labels, times: int, options: AbsorbOptions) -> tuple[Absorption, ...]:
    """Tell for each material what it lost and gained."""
    root = roots_of(before, corner_rule(options.policy, options.step * times))
    old, new, gone = before.ravel(), after.ravel(), np.flatnonzero(before != after)
    first = np.flatnonzero((root == np.arange(root.size)) & (old != VOID))
    materials, region = np.unique(old[first], return_inverse=True)
    stays = pixels_of(root)[first]
    whole, n = stays.copy(), len(materials)
    np.subtract.at(stays, np.searchsorted(first, root[gone]), 1)
    counts = (
        np.bincount(region, minlength=n),
        np.bincount(region[stays == 0], minlength=n),
        np.bincount(region, whole, n) // times**2,
        *(np.bincount(np.searchsorted(materials, labels[gone]), minlength=n) // times**2 for labels in (old, new)),
    )
    return tuple(Absorption(*map(int, row)) for row in zip(materials, *counts, strict=True))
