"""What the materials are called, in the field arrays of a dataset."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from imgquad_core.model import Materials

NUMBERS, NAMES, COLORS = MATERIAL_FIELDS = ("material_numbers", "material_names", "material_colors")


def put_materials(dataset: pv.DataSet, materials: Materials) -> None:
    """Store what the materials are called in the field arrays of a dataset, in place."""
    dataset.field_data[NUMBERS] = materials.labels
    dataset.field_data[NAMES] = list(materials.names)
    dataset.field_data[COLORS] = materials.colors


def materials_of(dataset: pv.DataSet, present: NDArray[Any] | None = None) -> Materials:
    """Return what `put_materials` stored; grey ones without names for the numbers `present` where nothing is stored."""
    fields = dataset.field_data
    if present is None or (NUMBERS in fields and NAMES in fields):
        names = tuple(map(str, fields[NAMES]))
        return Materials(fields[NUMBERS], names, fields[COLORS] if COLORS in fields else _grey(len(names)))
    numbers = np.unique(present)
    return Materials(numbers, tuple(f"material {number}" for number in numbers), _grey(len(numbers)))


def _grey(n: int) -> NDArray[np.uint8]:
    return np.full((n, 3), 128, np.uint8)
