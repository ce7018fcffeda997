"""Which part of a picture is meshed: materials by name or number, a crop, materials left out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from imgquad_core.errors import InputError
from imgquad_core.model import VOID, LabelImage, Materials

Box = tuple[int, int, int, int]


def material_number(materials: Materials, material: str | int) -> int:
    """Return the number of a material given by its name or its number.

    Raises
    ------
    InputError
        There is no such material, or two of this name.
    """
    found = [int(n) for n, name in zip(materials.labels, materials.names, strict=True) if name == str(material)]
    if not found and str(material).lstrip("-").isdigit():
        found = [int(n) for n in materials.labels if n == int(material)]
    if len(found) != 1:
        known = ", ".join(f"{n} ({name})" for n, name in zip(materials.labels, materials.names, strict=True))
        problem = f"{len(found)} materials have this name, give the number" if found else "there is no such material"
        raise InputError(f"material '{material}': {problem}; there are {known}")
    return found[0]


def sizes_by_number(materials: Materials, sizes: Mapping[Any, float]) -> dict[int, float]:
    """Return sizes of materials, given by name or number, by number."""
    return {material_number(materials, name): size for name, size in sizes.items()}


def sizes_by_numbers(materials: Materials, sizes: Mapping[Any, float]) -> dict[tuple[int, int], float]:
    """Return sizes between two materials, given by names or numbers, by numbers."""
    return {
        (material_number(materials, one), material_number(materials, other)): size
        for (one, other), size in sizes.items()
    }


def crop_image(image: LabelImage, box: Box) -> LabelImage:
    """Return the part of a picture within a box.

    Parameters
    ----------
    image : LabelImage
        The picture.
    box : tuple of int
        Left, upper, right and lower bound in pixels from the picture's upper left corner, as image viewers count; the
        columns ``left`` to ``right - 1`` and the rows ``upper`` to ``lower - 1`` stay.
    """
    assert_box(box, image.shape)
    left, upper, right, lower = box
    return LabelImage(image.labels[upper:lower, left:right], image.materials)


def assert_box(box: Box, shape: tuple[int, int]) -> None:
    """Raise `InputError` where a box is no part of a picture of `shape` (n_rows, n_cols)."""
    left, upper, right, lower = box
    rows, cols = shape
    if not (0 <= left < right <= cols and 0 <= upper < lower <= rows):
        raise InputError(
            f"crop {left},{upper},{right},{lower} is not a box in a picture of {cols} x {rows} pixels: "
            f"give 0 <= X0 < X1 <= {cols} and 0 <= Y0 < Y1 <= {rows}, Y from the top"
        )


def drop_materials(image: LabelImage, dropped: Iterable[str | int]) -> LabelImage:
    """Return a picture that is void where it has one of the `dropped` materials (names or numbers)."""
    numbers = [material_number(image.materials, material) for material in dropped]
    if not numbers:
        return image
    return LabelImage(np.where(np.isin(image.labels, numbers), VOID, image.labels), image.materials)


def assert_solid(image: LabelImage) -> None:
    """Raise `InputError` where no pixel is left to mesh."""
    if not (image.labels != VOID).any():
        raise InputError("no pixel is left to mesh: all are transparent, dropped, or there are none; drop less")
