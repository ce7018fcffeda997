"""Singles of a picture as levels 0 to 255, their noise, and the filter that takes it away."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from imgquad_core.arrays import Flags, Floats, Singles
from imgquad_core.jit import kernel
from imgquad_core.reading.picture import Picture

from .total_variation import total_variation

#: part of the pixels at each end that may leave the range of levels
OUTLIERS = 0.0001
#: share of the pixels with which a number far from all others is told, and is no outlier of these
FAR_SHARE = 0.001
#: levels within which those of its pixels stay that the filter draws towards their surroundings
END = 20.0
#: pixels that are looked at for the range and for noise
ENOUGH = 1_000_000
#: times the noise between neighbours that it is between every second pixel: from which it is correlated, at most
CORRELATED, MOST_FARTHER = 1.3, 2.5
#: pixels that are filtered at once, and rows of overlap
STRIP, OVERLAP = 1 << 22, 64
#: noise (standard deviation, in levels) from which a picture is filtered
NOISY = 0.5
#: weight of the total variation filter, in standard deviations of the noise: the usual one, and a light one, which
#: leaves more noise and more of the contrast of what is one or two pixels thin
WEIGHT, LIGHT = 2.0, 1.0


@dataclass(frozen=True, eq=False)
class Levels:
    """How the values of a picture become levels.

    Parameters
    ----------
    values : ndarray, shape (n_rows, n_cols, 1 or 3)
        As stored.
    low, step : float
        Value of level 0, and difference of a level to the next.
    void : bool, shape (n_rows, n_cols), optional
        Pixels that hold nothing; their values are those of the nearest pixel that holds one.
    shade : float64, shape (10,), optional
        Coefficients of a cubic surface that is taken out (see `cubic`): taken off, in levels, or the logarithm of what
        the values are divided by.
    is_gain : bool
        Whether the surface divides the values (light, the coil of a scanner) or is taken off (a background).
    shift, shrink : float
        What is taken off then, and what the rest is divided by, to lie in 0 to 255.
    ends : tuple of (float or None)
        Numbers of many pixels far below and far above all others, which are levels 0 and 255; None: there is none.
    """

    values: NDArray[Any]
    low: float = 0.0
    step: float = 1.0
    void: Flags | None = None
    shade: Floats | None = None
    is_gain: bool = False
    shift: float = 0.0
    shrink: float = 1.0
    ends: tuple[float | None, float | None] = (None, None)

    @property
    def shape(self) -> tuple[int, int]:
        """(n_rows, n_cols)."""
        return self.values.shape[0], self.values.shape[1]

    @property
    def is_grey(self) -> bool:
        """Whether there is one channel only."""
        return self.values.shape[2] == 1

    def rows(self, first: int, last: int, step: int = 1) -> Singles:
        """Return the levels of some rows, float32 (rows, n_cols, n_channels)."""
        part = np.asarray(self.values[first:last:step], np.float32)
        if (self.low, self.step) != (0.0, 1.0):
            part = np.clip((part - np.float32(self.low)) / np.float32(self.step), 0.0, 255.0)
        if self.shade is not None:
            rows = np.arange(first, last, step)
            surface = cubic(self.shape, rows[:, None], np.arange(self.shape[1])[None], self.shade)[..., None]
            dark = np.float32(self.dark)
            part = (part - dark) * np.exp(-surface) + dark if self.is_gain else part - surface
            part = (part - np.float32(self.shift)) / np.float32(self.shrink)
        return part

    @property
    def dark(self) -> float:
        """Level of the value 0, which no gain changes; 0 where there are negative values, which no light makes."""
        return -self.low / self.step if self.low > 0.0 else 0.0

    def without_shade(self, shade: Floats, is_gain: bool) -> Levels:
        """Return levels with a surface taken out, shifted (and, where need be, shrunk) to lie in 0 to 255."""
        flat = replace(self, shade=shade, is_gain=is_gain)
        every = max(1, self.values.size // ENOUGH)
        low, high = np.quantile(flat.rows(0, self.shape[0], every), (OUTLIERS, 1.0 - OUTLIERS)).tolist()
        shift = low if low < 0.0 else max(high - 255.0, 0.0) if high - low < 255.0 else low
        return replace(flat, shift=shift, shrink=max((high - shift) / 255.0, 1.0))

    def value_of(self, level: float) -> float:
        """Return the value, as stored, of a level."""
        for end, reached in zip(self.ends, (level < END, level > 255.0 - END), strict=True):
            if end is not None and reached:
                return end
        return self.low + self.step * (level * self.shrink + self.shift)


def cubic(shape: tuple[int, int], r: NDArray[Any], c: NDArray[Any], coefficients: Floats) -> Singles:
    """Return a cubic surface at rows `r` and columns `c`: 1, x, y, xx, xy, yy, xxx, xxy, xyy, yyy, from -1 to 1."""
    x, y = to_unit(shape, r, c)
    k = coefficients
    by_x = k[1] + x * (k[3] + x * k[6]) + y * (k[4] + x * k[7] + y * k[8])
    return np.asarray(k[0] + x * by_x + y * (k[2] + y * (k[5] + y * k[9])), np.float32)


def to_unit(shape: tuple[int, int], r: NDArray[Any], c: NDArray[Any]) -> tuple[Singles, Singles]:
    """Return places as x, y of a picture whose longer side goes from -1 to 1."""
    half = max(shape) / 2.0
    return (
        np.asarray((c + 0.5 - shape[1] / 2.0) / half, np.float32),
        np.asarray((r + 0.5 - shape[0] / 2.0) / half, np.float32),
    )


def levels_of(picture: Picture, void: Flags | None) -> Levels:
    """Return a picture's levels: bytes as they are, all else stretched from its range; grey stored as RGB is grey."""
    values = picture.values if picture.palette is None else picture.palette[picture.values]
    if values.ndim == 3:
        rgb = values if values.dtype == np.uint8 else (values >> 8).astype(np.uint8)
        if (rgb[..., 0] != rgb[..., 1]).any() or (rgb[..., 0] != rgb[..., 2]).any():
            return Levels(filled(np.ascontiguousarray(rgb), void), void=void)
        values = rgb[..., 0]
    values = filled(values[..., None], void)
    if values.dtype == np.uint8:
        return Levels(values, void=void)
    low, step, ends = _range(values[..., 0])
    return Levels(values, low, step, void, ends=ends)


def filled(values: NDArray[Any], void: Flags | None) -> NDArray[Any]:
    """Return values with those of void pixels replaced by the nearest that is not void."""
    if void is None or not void.any() or void.all():
        return values
    r, c = scipy.ndimage.distance_transform_edt(void, return_distances=False, return_indices=True)
    return np.asarray(values[r, c])


def _range(values: NDArray[Any]) -> tuple[float, float, tuple[float | None, float | None]]:
    """Return the value of level 0, the step, and the numbers far from all others.

    Neither outliers nor single hot pixels nor far numbers take the range.
    """
    every = max(1, values.size // ENOUGH)
    part = values[::every].astype(np.float64)
    ends = _far_below(part), _far_below(-part)
    ends = ends[0], None if ends[1] is None else -ends[1]
    for end in ends:
        if end is not None:
            part = np.where(part == end, np.median(part[part != end]), part)
    low, high = np.quantile(part, (OUTLIERS, 1.0 - OUTLIERS))
    if min(part.shape) >= 3:
        # what medians of three along rows and columns leave is no single pixel
        inner_low, inner_high = np.quantile(_middle(_middle(part).T), (OUTLIERS, 1.0 - OUTLIERS))
        span = inner_high - inner_low
        # noise ends within one span of them, hot pixels do not
        low = low if low >= inner_low - span else inner_low - span / 4.0
        high = high if high <= inner_high + span else inner_high + span / 4.0
    margin = (high - low) / 4.0  # between the level of far numbers and all others
    low, high = low - margin * (ends[0] is not None), high + margin * (ends[1] is not None)
    return float(low), float(high - low) / 255.0 or 1.0, ends


def _far_below(part: Floats) -> float | None:
    """Return the least number if many pixels hold it, and it is farther from all others than these are from another."""
    least = float(part.min())
    others = part[part != least]
    if part.size - others.size < FAR_SHARE * part.size or others.size == 0:
        return None
    low, high = float(others.min()), float(np.quantile(others, 1.0 - FAR_SHARE))
    return least if low - least > high - low > 0.0 else None


def _middle(values: NDArray[Any]) -> NDArray[Any]:
    """Return the middle one of each three in a column."""
    a, b, c = values[:-2], values[1:-1], values[2:]
    return np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c))


def noise_of(levels: Levels, without: Flags | None = None) -> float:
    """Return the standard deviation of the noise in levels; the largest of the channels.

    Parameters
    ----------
    levels : Levels
        Of the picture.
    without : bool, shape (n_rows, n_cols), optional
        Pixels that do not count.

    Notes
    -----
    From the median of second differences both ways, [[1, -2, 1], [-2, 4, -2], [1, -2, 1]], which is blind to even
    slopes and straight edges along rows and columns (Immerkaer 1996, doi:10.1006/cviu.1996.0060). Noise that is
    correlated from pixel to pixel (resampled pictures) is seen between every second pixel only: the value there counts,
    up to `MOST_FARTHER` times the first, where it is larger than edges alone make it in white noise (1.0 to 1.2 times;
    by a blur of half a pixel it is 1.5 times, of .6 pixels 2.2 times).
    """
    if levels.void is not None:
        without = levels.void if without is None else without | levels.void
    near, far = (_second_differences(levels, stride, without) for stride in (1, 2))
    return near if far < CORRELATED * near else min(far, MOST_FARTHER * near)


def _second_differences(levels: Levels, stride: int, without: Flags | None) -> float:
    rows, cols = levels.shape
    if min(rows, cols) < 2 * stride + 1:
        return 0.0
    every = max(1, rows * cols // ENOUGH)
    above, here, below = (levels.rows(k * stride, rows - (2 - k) * stride, every) for k in range(3))
    down = above - 2.0 * here + below
    both = np.abs(down[:, : -2 * stride] - 2.0 * down[:, stride:-stride] + down[:, 2 * stride :])
    if without is not None:
        counted = ~without[stride : rows - stride : every, stride:-stride]
        both = both[counted][:, None] if counted.any() else both
    return float(np.median(both, axis=(0, 1)).max() / 6.0 / 0.6745)


class Strip(NamedTuple):
    """Some rows of a picture, and rows around them."""

    shades: Singles  #: (n_rows_of_strip, n_cols, n_channels)
    own: slice  #: its own rows in `shades`
    place: slice  #: its own rows in the picture


def filtered_strips(levels: Levels, noise: float, weight: float = WEIGHT) -> Iterator[Strip]:
    """Give strips of a picture with its noise taken away.

    Total variation with a weight in standard deviations, the channels each by itself. Pictures above `STRIP` pixels
    are filtered in strips that overlap.
    """
    rows, cols = levels.shape
    height = rows if rows * cols <= STRIP else max(STRIP // cols, OVERLAP)
    for first in range(0, rows, height):
        last = min(first + height, rows)
        start, end = max(first - OVERLAP, 0), min(last + OVERLAP, rows)
        strip = without_noise(levels.rows(start, end), noise, weight)
        yield Strip(strip, slice(first - start, last - start), slice(first, last))


def without_noise(shades: Singles, noise: float, weight: float = WEIGHT) -> Singles:
    """Return levels after total variation filtering; as they are below `NOISY`."""
    if noise < NOISY:
        return shades
    planes = (np.ascontiguousarray(shades[..., k]) for k in range(shades.shape[2]))
    return np.stack([total_variation(plane, weight * noise) for plane in planes], axis=2)


def squared_gradient(shades: Singles) -> Singles:
    """Return the squared length of the gradient (central differences), all channels together."""
    found = np.empty(shades.shape[:2], np.float32)
    put_gradient(shades, found)
    return found


@kernel
def put_gradient(shades: Singles, squares: Singles) -> None:
    """Put the squared length of the gradient of each pixel into `squares`."""
    rows, cols, channels = shades.shape
    for r in range(rows):
        above, below = max(r - 1, 0), min(r + 1, rows - 1)
        for c in range(cols):
            left, right = max(c - 1, 0), min(c + 1, cols - 1)
            total = 0.0
            for k in range(channels):
                down = (shades[below, c, k] - shades[above, c, k]) / max(below - above, 1)
                along = (shades[r, right, k] - shades[r, left, k]) / max(right - left, 1)
                total += down * down + along * along
            squares[r, c] = total
