"""A picture as it came: numbers or colours, before anything is decided about materials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from imgquad_core.arrays import Bytes, Flags
from imgquad_core.errors import InputError

from .calibration import Box, Calibration


class Crystal(NamedTuple):
    """What a grain is made of and how its crystal lies."""

    phase: str
    euler: tuple[float, float, float]  #: Bunge's phi1, Phi, phi2, degrees


@dataclass(frozen=True, eq=False)
class Picture:
    """Values of the pixels and what the file said about them.

    Parameters
    ----------
    values : ndarray, shape (n_rows, n_cols) or (n_rows, n_cols, 3)
        Grey values, labels or palette indices (any integer or float type), or RGB (uint8 or uint16); row 0 on top.
    palette : uint8, shape (n, 3), optional
        RGB of the palette that `values` are indices of.
    opaque : bool, shape (n_rows, n_cols), optional
        False where the pixel is transparent (less than half of full alpha). None: all are opaque.
    labels : bool
        Whether the format says that `values` are material numbers; else the pixels are judged.
    void : bool, shape (n_rows, n_cols), optional
        Pixels that hold nothing: NaN, infinity, masked, nodata. None: all hold something.
    names : mapping of int to str, optional
        Names of material numbers, such as phases; others are named by their number.
    name : str
        What to call the picture in messages.
    calibration : Calibration
        Pixel size and place, as far as the file knows them.
    notes : tuple of str
        What the reader chose or found, in words.
    window : tuple of int, optional
        Left, upper, right, lower bound of the part of the file's picture that this is. None: the whole.
    crystals : mapping of int to Crystal, optional
        Phase and orientation of material numbers that are grains.
    bar_rows : int
        Rows at the bottom that the file says are no part of the picture (text below an electron micrograph).
    """

    values: NDArray[Any]
    palette: Bytes | None = None
    opaque: Flags | None = None
    labels: bool = False
    name: str = "the array"
    void: Flags | None = None
    names: Mapping[int, str] | None = None
    calibration: Calibration = field(default_factory=Calibration)
    notes: tuple[str, ...] = ()
    window: Box | None = None
    crystals: Mapping[int, Crystal] | None = None
    bar_rows: int = 0

    @property
    def shape(self) -> tuple[int, int]:
        """(n_rows, n_cols)."""
        return self.values.shape[0], self.values.shape[1]

    @property
    def is_grey(self) -> bool:
        """Whether pixels hold one number that is no palette index."""
        return self.values.ndim == 2 and self.palette is None


def part_of(picture: Picture, box: Box) -> Picture:
    """Return the part of a picture within a box: left, upper, right, lower bound."""
    left, upper, right, lower = box

    def cut(array: NDArray[Any] | None) -> Any:
        return None if array is None else np.ascontiguousarray(array[upper:lower, left:right])

    return replace(
        picture, values=cut(picture.values), opaque=cut(picture.opaque), void=cut(picture.void),
        calibration=picture.calibration.cropped(box, picture.shape[0]),
    )  # fmt: skip


def picture_of(array: ArrayLike, name: str = "the array") -> Picture:
    """Take an array as a picture.

    Parameters
    ----------
    array : array_like, shape (n_rows, n_cols) or (n_rows, n_cols, 1 to 4)
        One channel: material numbers or grey values of any type; `segment` tells them apart. Two: grey and alpha.
        Three or four: RGB and perhaps alpha; integers from 0 to 255 or 65535, floats from 0 to 1 or to 255. Pixels
        that a masked array hides, NaN and infinity are void.
    name : str
        What to call it in messages.

    Returns
    -------
    Picture
        Pixels with less than half of full alpha are marked as not opaque.

    Raises
    ------
    InputError
        For a stack, no pixels, no finite number, numbers that are no colours, and types that are no numbers.
    """
    values = array.data if isinstance(array, np.ma.MaskedArray) else np.asarray(array)
    if values.dtype.kind not in "biuf":
        raise InputError(f"{name} holds values of type {values.dtype}: give integers, floats or bool")
    if values.ndim not in (2, 3) or (values.ndim == 3 and not 1 <= values.shape[2] <= 4):
        raise InputError(
            f"{name} has the shape {values.shape}: give one plane, (rows, columns) or (rows, columns, 1 to 4 channels);"
            " of a 3D stack take one slice, such as stack[10]"
        )
    if values.size == 0:
        raise InputError(f"{name} has the shape {values.shape}, no pixels: give at least one")
    values = values.astype(values.dtype.newbyteorder("="), copy=False)
    void = _void_of(array.mask if isinstance(array, np.ma.MaskedArray) else None, values, name)
    if void is not None:
        values = values.copy()
        values[void] = values[~void][0]
    channels = values.shape[2] if values.ndim == 3 else 1
    opaque = _opaque(values[..., -1]) if channels in (2, 4) else None
    if channels >= 3:
        return Picture(_as_rgb(values[..., :3], name), None, opaque, name=name, void=void)
    grey = values if values.ndim == 2 else values[..., 0]
    return Picture(grey.astype(np.uint8) if grey.dtype.kind == "b" else grey, None, opaque, name=name, void=void)


def _void_of(mask: Any, values: NDArray[Any], name: str) -> Flags | None:
    """Return the pixels with a value that is masked or not finite, None where there are none."""
    void = np.broadcast_to(np.asarray(False if mask is None else mask), values.shape)
    if values.dtype.kind == "f":
        void = void | ~np.isfinite(values)
    void = void if void.ndim == 2 else void.any(axis=2)
    if void.all():
        raise InputError(f"{name} holds no finite number that is not masked: give at least one")
    return void if void.any() else None


def _opaque(alpha: NDArray[Any]) -> Flags | None:
    """Return where alpha is at least half: the middle of a soft edge, as anti-aliasing draws it."""
    if alpha.dtype.kind == "f":
        full = 1.0 if alpha.max() <= 1 else 255.0
    elif alpha.dtype.kind == "b" or alpha.max() <= 1:
        full = 1.0
    else:
        full = 65535.0 if alpha.dtype == np.uint16 or alpha.max() > 255 else 255.0
    opaque = alpha >= full / 2
    return None if opaque.all() else opaque


def _as_rgb(values: NDArray[Any], name: str) -> NDArray[Any]:
    if values.dtype in (np.uint8, np.uint16):
        return values
    if values.dtype.kind == "b":
        return values.astype(np.uint8) * np.uint8(255)
    low, high = values.min(), values.max()
    if low < 0 or high > (65535 if values.dtype.kind in "iu" else 255):
        raise InputError(
            f"colours of {name} go from {low} to {high}: give 0 to 255 (8 bit), 65535 (16 bit) or 1 (float)"
        )
    if values.dtype.kind == "f":
        return np.asarray(np.rint(values * (255 if high <= 1 else 1)), np.uint8)
    return np.asarray(values, np.uint8 if high <= 255 else np.uint16)


def either(first: Flags | None, second: Flags | None) -> Flags | None:
    """Return where one of two masks is set; None is a mask that is set nowhere."""
    if first is None or second is None:
        return second if first is None else first
    return first | second


def where_equal(values: NDArray[Any], value: float) -> Flags | None:
    """Return where pixels hold a number, in the precision of their type; None where none does."""
    if values.dtype.kind in "iub":
        same = values == int(value) if value.is_integer() else np.zeros(values.shape, bool)
    else:
        with np.errstate(over="ignore"):
            same = np.isnan(values) if np.isnan(value) else values == values.dtype.type(value)
    found = same if same.ndim == 2 else same.all(axis=2)
    return found if found.any() else None
