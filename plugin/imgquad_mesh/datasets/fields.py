"""What the materials are called, in the field arrays of a dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.model import Materials
from imgquad_core.reading import Calibration

from .field_texts import put_numbers, put_texts, texts_of

if TYPE_CHECKING:
    import pyvista as pv

NUMBERS, NAMES, COLORS = MATERIAL_FIELDS = ("material_numbers", "material_names", "material_colors")
#: of grains: phase and Bunge's Euler angles (degrees, NaN where unknown) of each
PHASES, ORIENTATIONS = ("material_phases", "material_orientations")


def put_materials(dataset: Any, materials: Materials) -> None:
    """Store what the materials are called in the field arrays of a dataset, in place."""
    put_numbers(dataset, NUMBERS, materials.labels)
    put_texts(dataset, NAMES, materials.names)
    put_numbers(dataset, COLORS, materials.colors)
    if materials.phases is not None:
        put_texts(dataset, PHASES, materials.phases)
    if materials.orientations is not None:
        put_numbers(dataset, ORIENTATIONS, materials.orientations)


def materials_of(dataset: pv.DataSet, present: NDArray[Any] | None = None) -> Materials:
    """Return what `put_materials` stored; grey ones without names for the numbers `present` where nothing is stored."""
    fields = dataset.field_data
    if present is None or (NUMBERS in fields and NAMES in fields):
        names = texts_of(fields[NAMES])
        colors = fields[COLORS] if COLORS in fields else _grey(len(names))
        return Materials(fields[NUMBERS], names, colors, *_crystals(fields))
    numbers = np.unique(present)
    return Materials(numbers, tuple(f"material {number}" for number in numbers), _grey(len(numbers)))


def _grey(n: int) -> NDArray[np.uint8]:
    return np.full((n, 3), 128, np.uint8)


def _crystals(fields: Any) -> tuple[tuple[str, ...] | None, NDArray[Any] | None]:
    phases = texts_of(fields[PHASES]) if PHASES in fields else None
    return phases, fields.get(ORIENTATIONS, None)


def put_calibration(
    dataset: Any,
    found: Calibration,
    placement: tuple[tuple[float, float], tuple[float, float]] | None = None,
) -> None:
    """Store pixel size and place in the field arrays of a dataset, in place; an image gets spacing and origin.

    Parameters
    ----------
    dataset : pyvista.DataSet or vtkUnstructuredGrid
        An image or a mesh.
    found : Calibration
        What the file says.
    placement : tuple, optional
        Pixel size and origin of a mesh, as it was made.
    """
    size = found.size
    if placement is not None:
        for name, values in zip(("pixel_size", "origin"), placement, strict=True):
            put_numbers(dataset, name, np.array(values, np.float64))
    elif size is not None and (not size.doubt or found.crs):
        dataset.spacing = (size.x, size.y, 1.0)
        dataset.origin = (*(found.origin or (0.0, 0.0)), 0.0)
    if size is not None:
        put_numbers(dataset, "file_pixel_size", np.array([size.x, size.y], np.float64))
        for name, text in (("unit", size.unit), ("source", size.source), ("doubt", size.doubt)):
            put_texts(dataset, f"file_pixel_size_{name}", [text])
    if found.crs:
        put_texts(dataset, "crs", [found.crs])
