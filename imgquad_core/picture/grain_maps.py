"""Grain maps: each region of one colour is a material, however many (orientation colours of EBSD)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy
import skimage

from imgquad_core.arrays import Bytes, Floats, Ints, Labels
from imgquad_core.errors import InputError
from imgquad_core.jit import kernel
from imgquad_core.model import LabelImage, Materials

from .levels import Levels, noise_of
from .raw import smoothed

#: a core's pixels differ by at most so many levels in 3 x 3, or a standard deviation of the noise
EVEN = 6.0
#: least pixels of a core
PIXELS = 25
#: in a grain map so much of the cores has a range of at most so many times that of 3 x 3
SHARE, RANGE = 0.9, 3.0
#: classes of a grain map leave at least this root of the mean squared distance, in CIELAB units
LEFT_OVER = 5.0


class Cores(NamedTuple):
    """Connected parts of even colour."""

    labels: Labels  #: (n_rows, n_cols), from 1; 0: none
    edges: Bytes  #: (n_rows, n_cols), largest difference in 3 x 3 of any channel
    means: Floats  #: (n_cores, n_channels)
    even: float  #: share of the cores' pixels in cores of one colour


def cores_of(plane: Bytes, noise: float, void: object = None) -> Cores:
    """Find the cores of grains in a picture without noise.

    Parameters
    ----------
    plane : uint8, shape (n_rows, n_cols, n_channels)
        Levels.
    noise : float
        Standard deviation of the noise that was in it.
    void : bool, shape (n_rows, n_cols), optional
        Pixels that belong to no grain.
    """
    channels = range(plane.shape[2])
    spans = [
        scipy.ndimage.maximum_filter(plane[..., k], 3) - scipy.ndimage.minimum_filter(plane[..., k], 3)
        for k in channels
    ]
    edges = np.maximum.reduce(spans)
    bound = max(EVEN, noise)
    flat = edges <= bound if void is None else (edges <= bound) & ~np.asarray(void)
    labels, n = scipy.ndimage.label(flat)
    pixels = np.bincount(labels.ravel(), minlength=n + 1)
    kept = pixels >= PIXELS
    kept[0] = False
    place = np.where(kept, np.cumsum(kept), 0).astype(np.int32)
    labels, pixels = place[labels], pixels[kept]
    sums = np.zeros((len(pixels), plane.shape[2]), np.int64)
    ranges = np.stack([np.full(sums.shape, 255), np.zeros(sums.shape)]).astype(np.uint8)
    measure_cores(plane, labels, sums, ranges[0], ranges[1])
    within = (ranges[1].astype(int) - ranges[0]).max(axis=1, initial=0) <= RANGE * bound
    share = float(pixels[within].sum() / max(pixels.sum(), 1))
    return Cores(labels, edges, sums / pixels[:, None], share)


@kernel
def measure_cores(plane: Bytes, labels: Labels, sums: Ints, low: Bytes, high: Bytes) -> None:
    """Add up the levels of each core, and find the lowest and highest."""
    for r in range(labels.shape[0]):
        for c in range(labels.shape[1]):
            k = labels[r, c] - 1
            if k < 0:
                continue
            for m in range(plane.shape[2]):
                level = plane[r, c, m]
                sums[k, m] += level
                low[k, m] = min(low[k, m], level)
                high[k, m] = max(high[k, m], level)


def regions_of(levels: Levels) -> LabelImage:
    """Make each region of one colour a material, numbered in reading order of the picture as it is given.

    Cores of even colour grow over the rest (watershed of the largest difference in 3 x 3 pixels).

    Raises
    ------
    InputError
        For a picture without a region of 25 pixels of one colour.
    """
    noise = noise_of(levels)
    plane = smoothed(levels, noise, None).plane
    cores = cores_of(plane, noise, levels.void)
    if len(cores.means) == 0:
        raise InputError(f"no region of {PIXELS} pixels has one colour: give another choice of colors than regions")
    inside = None if levels.void is None else ~levels.void
    labels = skimage.segmentation.watershed(cores.edges, cores.labels, mask=inside) - 1  # type: ignore[no-untyped-call]
    colors = np.rint(cores.means if levels.values.shape[2] == 3 else np.repeat(cores.means, 3, axis=1))
    names = tuple(f"region {k}" for k in range(len(colors)))
    return LabelImage(labels, Materials(np.arange(len(colors)), names, colors.astype(np.uint8)))
