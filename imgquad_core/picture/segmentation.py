"""Any picture becomes labels: exact colours where they are few, else quantised ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Bytes, Flags, Floats, Ints, Labels
from imgquad_core.errors import InputError
from imgquad_core.jit import kernel, verb
from imgquad_core.model import VOID, LabelImage, Materials

from .blends import find_rims, relabel_rims
from .exact_colours import dark_to_light, exact_labels
from .options import SegmentationOptions
from .picture import Picture, picture_of
from .quantisation import (
    MOST_CLASSES,
    Histogram,
    best_count,
    distances2,
    errors_of,
    histogram_of,
    kmeans_centres,
    otsu_centres,
)

#: `auto` takes a picture with no more colours than this at its word
MOST_EXACT = 32
#: no limit
ANY_NUMBER = 1 << 40
#: noise (standard deviation, in levels of 256) from which a picture is median filtered
NOISY = 0.5
Levels = Bytes


@dataclass(frozen=True, eq=False)
class Segmentation:
    """Labels, and how they were found.

    Parameters
    ----------
    image : LabelImage
        The labels.
    quantised : bool
        Whether colours were quantised; the default of noise removal hangs on it.
    method : str
        In words: "exact", "multi-Otsu", "k-means in CIELAB" or "nearest of the palette".
    noise : float
        Standard deviation of the noise that was found, in levels of 256 (0 where exact).
    smoothed : bool
        Whether the picture was median filtered for it.
    rims : int
        Blended pixels that were kept out of a third material's hands.
    """

    image: LabelImage
    quantised: bool
    method: str = "exact"
    noise: float = 0.0
    smoothed: bool = False
    rims: int = 0

    @property
    def note(self) -> str:
        """What was chosen, in one line."""
        n = len(self.image.materials.labels)
        if not self.quantised:
            return f"{n} materials, exact"
        filtered = f", noise {self.noise:.1f} of 255 median filtered" if self.smoothed else ""
        return f"{n} materials by {self.method}{filtered}, {self.rims} blended pixels"


def segment(picture: Picture | NDArray[Any] | LabelImage, options: SegmentationOptions | None = None) -> LabelImage:
    """Give each pixel of a picture a material.

    Parameters
    ----------
    picture : Picture, array_like or LabelImage
        What `read_picture` gave, or an array as for `picture_of`. A `LabelImage` is returned as it is.
    options : SegmentationOptions, optional
        How many colours, and what becomes of transparent pixels.

    Returns
    -------
    LabelImage
        Labels, int32, shape (n_rows, n_cols), and the names and colours of the materials.

    Raises
    ------
    InputError
        For labels that cannot be material numbers (below -1 or above 2**31 - 1; -1 is `VOID`), `exact` on greys that
        are not whole numbers, a number of colours for labels, a picture that is wholly transparent.

    Notes
    -----
    Numbers: palette indices, labels and few grey values are kept (named "material 3"). Colours, exact or quantised,
    are numbered 0, 1, 2, ... from dark to light (299 R + 587 G + 114 B, then R, G, B) and named "rgb_ff8000", or by
    their grey "grey_87". Colours of a given palette keep their place in it.

    Quantising: a noisy picture (standard deviation of 0.5 levels or more, found from its second differences) is median
    filtered, 3 x 3 twice, which keeps edges and lines of two pixels, but not thinner ones. Rims of anti-aliasing and
    blur, up to 4 pixels to each side, are not counted in the histogram and never become a third material: each goes to
    one of the two materials beside it (see `.blends`). Grey is split by multi-Otsu, colours by k-means in
    CIELAB; `auto` chooses 2 to 12 classes by the largest jump of the inverse error (`quantisation.best_count`).
    Labels of a noisy picture become the commonest of their 3 x 3 pixels. Nothing is random: the same picture gives the
    same labels.
    """
    return segment_picture(picture, options).image


def segment_picture(
    picture: Picture | NDArray[Any] | LabelImage, options: SegmentationOptions | None = None
) -> Segmentation:
    """Do what `segment` does, and tell what was chosen."""
    options = options or SegmentationOptions()
    if isinstance(picture, LabelImage):
        return Segmentation(picture, quantised=False)
    picture = picture if isinstance(picture, Picture) else picture_of(picture)
    void = None
    if options.drop_transparent and picture.opaque is not None:
        void = ~picture.opaque
        if void.all():
            raise InputError(f"{picture.name} is wholly transparent: keep transparent pixels (drop_transparent=False)")
    if picture.labels and options.colors not in ("auto", "exact"):
        raise InputError(f"colors is {options.colors}, but {picture.name} holds labels: give auto or exact")
    most = _most_exact(picture, options)
    exact = exact_labels(picture, most, must=options.colors == "exact", void=void) if most else None
    return Segmentation(exact, quantised=False) if exact else _quantised(picture, options, void)


def _most_exact(picture: Picture, options: SegmentationOptions) -> int:
    """Return up to how many distinct values the picture is taken as it is."""
    if isinstance(options.colors, str):
        return MOST_EXACT if options.colors == "auto" and not picture.labels else ANY_NUMBER
    return int(options.colors) if isinstance(options.colors, (int, np.integer)) else 0


def _quantised(picture: Picture, options: SegmentationOptions, void: Flags | None) -> Segmentation:
    levels, low, step = _levels(picture, in_color=not isinstance(options.colors, (str, int, np.integer)))
    noise = _noise(levels)
    if noise >= NOISY:
        levels = _median_filtered(levels)
    rims = find_rims(levels, contrast=16.0 + 2.0 * noise)
    counted = ~rims if void is None else ~(rims | void)
    if not counted.any():
        counted = ~counted if void is None else ~void
    histogram = histogram_of(levels, counted)
    classes = _classes(histogram, options)
    labels = histogram.spread(classes.of_bins)
    relabel_rims(levels, rims, labels, classes.means)
    if noise >= NOISY:
        labels = commonest_around(labels)
    if void is not None:
        labels[void] = VOID
    image = LabelImage(labels, _materials(classes.means, low, step))
    return Segmentation(image, True, classes.method, noise, noise >= NOISY, int(np.count_nonzero(rims)))


def _levels(picture: Picture, in_color: bool) -> tuple[Levels, float, float]:
    """Return levels 0 to 255 (rows, columns, 1 or 3), and for grey the value of level 0 and the step to the next."""
    values = picture.values if picture.palette is None else picture.palette[picture.values]
    if values.ndim == 3:
        rgb = values if values.dtype == np.uint8 else (values >> 8).astype(np.uint8)
        if in_color or (rgb[..., 0] != rgb[..., 1]).any() or (rgb[..., 0] != rgb[..., 2]).any():
            return np.ascontiguousarray(rgb), 0.0, 1.0
        values = rgb[..., 0]
    grey, low, step = values, 0.0, 1.0
    if values.dtype != np.uint8:
        # a few outliers must not take the range
        low, high = np.quantile(values, (0.0001, 0.9999)).tolist()
        step = (high - low) / 255.0 or 1.0
        grey = np.rint(np.clip((values - low) / step, 0.0, 255.0)).astype(np.uint8)
    return np.repeat(grey[..., None], 3 if in_color else 1, axis=2), low, step


def _noise(levels: Levels) -> float:
    """Return the standard deviation of white noise, from the median of second differences both ways.

    A difference as [[1, -2, 1], [-2, 4, -2], [1, -2, 1]] is blind to even slopes and to straight edges along rows and
    columns (Immerkaer 1996, doi:10.1006/cviu.1996.0060). At most about 10**6 pixels are looked at.
    """
    if min(levels.shape[:2]) < 3:
        return 0.0
    every = max(1, levels[..., 0].size // 1_000_000)
    above, here, below = (levels[k : levels.shape[0] - 2 + k : every].astype(np.int16) for k in range(3))
    down = above - 2 * here + below
    both = down[:, :-2] - 2 * down[:, 1:-1] + down[:, 2:]
    return float(np.median(np.abs(both), axis=(0, 1)).max() / 6.0 / 0.6745)


def _median_filtered(levels: Levels) -> Levels:
    from scipy.ndimage import median_filter

    # 3 x 3 twice spares lines of two pixels, which 5 x 5 loses, and takes out as much noise
    filtered = levels
    for _ in range(2):
        filtered = np.stack([median_filter(filtered[..., k], 3) for k in range(levels.shape[2])], axis=2)
    return filtered


class Classes(NamedTuple):
    """A histogram divided in materials."""

    of_bins: Labels  #: the material of each bin
    means: Floats  #: (n_materials, n_channels), levels
    method: str


def _classes(histogram: Histogram, options: SegmentationOptions) -> Classes:
    """Divide a histogram by the method that suits it."""
    is_grey = histogram.levels.shape[1] == 1
    points = histogram.levels if is_grey else _cielab(histogram.levels)
    if not isinstance(options.colors, (str, int, np.integer)):
        palette = np.rint(np.array(options.colors, float))
        nearest = distances2(points, _cielab(palette)).argmin(axis=1)
        return Classes(nearest.astype(np.int32), palette, "nearest of the palette")
    most = MOST_CLASSES if options.colors == "auto" else int(options.colors)
    found = otsu_centres(histogram.weights, most) if is_grey else kmeans_centres(points, histogram.weights, most)
    if options.colors == "auto":
        found = found[: best_count(errors_of(points, histogram.weights, found), points.shape[1])]
    nearest = distances2(points, found[-1]).argmin(axis=1)
    means = _means(histogram, nearest, len(found[-1]))
    order = dark_to_light(np.rint(means if means.shape[1] == 3 else np.repeat(means, 3, axis=1)))
    place = np.empty(len(order), np.int32)
    place[order] = np.arange(len(order))
    return Classes(place[nearest], means[order], "multi-Otsu" if is_grey else "k-means in CIELAB")


def _means(histogram: Histogram, nearest: Ints, n: int) -> Floats:
    """Return the mean levels of each class."""
    mass = np.bincount(nearest, histogram.weights, n)
    sums = [np.bincount(nearest, histogram.weights * channel, n) for channel in histogram.levels.T]
    return np.asarray(np.stack(sums, axis=1) / np.where(mass > 0, mass, 1.0)[:, None])


def _cielab(levels: Floats) -> Floats:
    from skimage.color import rgb2lab

    return np.asarray(rgb2lab(levels / 255.0), float)


@kernel
def commonest_around(labels: Labels) -> Labels:
    """Return the commonest label of the 3 x 3 pixels around each, its own among equals, else the first in order."""
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
    return found


@verb
def count_in(labels: Labels, top: int, left: int, bottom: int, right: int, label: int) -> int:
    """Return how often `label` occurs in a window."""
    n = 0
    for i in range(top, bottom):
        for j in range(left, right):
            n += labels[i, j] == label
    return n


def _materials(means: Floats, low: float, step: float) -> Materials:
    """Name materials 0, 1, ... by their colour; a name that has been given gets the number behind it."""
    colors = np.rint(means if means.shape[1] == 3 else np.repeat(means, 3, axis=1)).astype(np.uint8)
    if means.shape[1] == 3:
        names = ["rgb_" + "".join(f"{level:02x}" for level in color) for color in colors]
    else:
        digits = ".0f" if step >= 1.0 else ".6g"
        names = [f"grey_{low + step * level:{digits}}" for level in means[:, 0]]
    unique = tuple(name if name not in names[:k] else f"{name}_{k}" for k, name in enumerate(names))
    return Materials(np.arange(len(names)), unique, colors)
