"""Exact labels: one material per value or colour."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Bytes, Flags, Ints, Labels
from imgquad_core.errors import InputError
from imgquad_core.model import VOID, LabelImage, Materials
from imgquad_core.reading.picture import Picture, either

from .codes import codes_of, numbered, put_in_place, values_of_codes
from .flat_colours import without_blends

#: no limit
ANY_NUMBER = 1 << 40
#: grey labels whose levels are nearer than this are shown in colours instead
VISIBLE = 8


class Exact(NamedTuple):
    """Materials that are values, and how many colours were blends of them."""

    image: LabelImage
    blends: int  #: distinct colours that were given to one of their sides


def exact_labels(picture: Picture, most: int, void: Flags | None, with_blends: bool = True) -> Exact | None:
    """Return one material per value or colour, or None where there are more than `most` of them.

    Parameters
    ----------
    picture : Picture
        What was read.
    most : int
        Limit of the number of materials.
    void : bool, shape (n_rows, n_cols), optional
        Pixels that become `VOID`, as do those of -1 in signed integers.
    with_blends : bool
        Whether colours that occur at rims only are materials; else they go to one of their sides.

    Raises
    ------
    InputError
        For whole numbers that cannot be material numbers.
    """
    codes, void = codes_of(picture.values), with_minus_one(picture.values, void)
    if void is not None:
        if void.all():
            raise InputError(f"{picture.name} holds no pixel with a material: all are void")
        codes = np.where(void, codes.ravel()[void.argmin()], codes)
    found = numbered(codes, most)
    del codes
    if found is None:
        return None
    flat = found if with_blends else without_blends(picture, found)
    labels, materials = materials_of_codes(picture, flat.codes)
    n_blends, image = len(found.codes) - len(flat.codes), flat.numbers
    put_in_place(image, labels)
    if void is not None:
        image[void] = VOID
    return Exact(LabelImage(image, materials), n_blends)


def with_minus_one(values: NDArray[Any], void: Flags | None) -> Flags | None:
    """Return void pixels with those of -1, which stands for no material in signed numbers."""
    if values.ndim == 3 or values.dtype.kind not in "if":
        return void
    held = values if void is None else values[~void]
    if held.size == 0 or held.min() != VOID or not _whole(held):
        return void
    return either(void, np.asarray(values == VOID))


def _whole(values: NDArray[Any]) -> bool:
    return values.dtype.kind in "biu" or bool((values == np.rint(values)).all())


def materials_of_codes(picture: Picture, codes: NDArray[Any]) -> tuple[Labels, Materials]:
    """Return the label of each distinct code (ascending), and the materials."""
    values = values_of_codes(codes, picture.values)
    if values.ndim == 2:
        return _materials_of_colors(values, 8 * picture.values.dtype.itemsize)
    if not _whole(values):
        return _materials_of_reals(values)
    low, high = int(values.min()), int(values.max())
    if low < 0 or high > np.iinfo(np.int32).max:
        raise InputError(
            f"{picture.name} holds labels from {low:.10g} to {high:.10g}: give numbers from 0 to 2147483647 (-1 is"
            f" void), or, if it stands for no data, no_data = {low if low < 0 else high:.10g}"
        )
    labels = values.astype(np.int32)
    order = np.argsort(labels, kind="stable")  # bits of floats are in the order of the numbers, but wide integers wrap
    names = tuple((picture.names or {}).get(label, f"material {label}") for label in labels[order].tolist())
    return labels, Materials(labels[order], names, _colors_of_values(picture, labels[order].astype(np.int64)))


def _materials_of_colors(channels: NDArray[Any], bits: int) -> tuple[Labels, Materials]:
    order = dark_to_light(channels)
    labels = np.empty(len(channels), np.int32)
    labels[order] = np.arange(len(channels))
    names = ["rgb_" + "".join(f"{level:0{bits // 4}x}" for level in channels[k]) for k in order]
    colors = channels[order] >> (bits - 8)
    return labels, Materials(np.arange(len(channels)), tuple(names), colors.astype(np.uint8))


def _materials_of_reals(values: NDArray[Any]) -> tuple[Labels, Materials]:
    """Number values that are not whole from the smallest, and name them by the value."""
    order = np.argsort(values, kind="stable")
    labels = np.empty(len(values), np.int32)
    labels[order] = np.arange(len(values))
    names = tuple(f"value {value}" for value in values[order].tolist())
    return labels, Materials(np.arange(len(values)), names, _hues(np.arange(len(values))))


def dark_to_light(colors: NDArray[Any]) -> Ints:
    """Return the order of colours, shape (n, 3), from dark to light; equally light ones by R, G, B."""
    red, green, blue = colors.T
    order: Ints = np.lexsort((blue, green, red, 299 * red + 587 * green + 114 * blue))
    return order


def _colors_of_values(picture: Picture, values: Ints) -> Bytes:
    """Return the palette's colours, greys that can be told apart, or else a colour that hangs on the number only."""
    if picture.palette is not None:
        return np.asarray(picture.palette[values], np.uint8)
    if not picture.labels and picture.values.dtype.kind == "u":
        grey = values >> (8 * picture.values.dtype.itemsize - 8)
        if len(grey) == 1 or np.diff(grey).min() >= VISIBLE:
            return np.repeat(grey[:, None], 3, axis=1).astype(np.uint8)
    return _hues(values)


def _hues(values: Ints) -> Bytes:
    """Return colours that hang on the numbers only."""
    # hues by the golden section are far apart for neighbouring numbers; brightness alternates too
    hue = (0.07 + values * 0.6180339887498949) % 1.0
    wheel = np.abs((hue[:, None] * 6.0 + np.array([0.0, 4.0, 2.0])) % 6.0 - 3.0) - 1.0
    value = np.where(values // 5 % 2 == 0, 0.9, 0.6)
    return np.asarray(np.rint(255.0 * value[:, None] * (0.35 + 0.65 * np.clip(wheel, 0.0, 1.0))), np.uint8)
