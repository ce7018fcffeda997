"""Pictures in files that VTK reads: image data (.vti) and MetaImage (.mha, .mhd)."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

from imgquad_core.errors import InputError
from imgquad_core.reading.calibration import Calibration, size_of
from imgquad_core.reading.decoding import Stack, assert_pixels
from imgquad_core.reading.options import ReadOptions
from imgquad_core.reading.picture import Picture, picture_of

from .fields import materials_of
from .images import MATERIAL, pixel_counts
from .metaimage import assert_whole


@contextmanager
def silent_vtk() -> Iterator[None]:
    """Keep VTK and PyVista from printing what the errors raised here say in one line."""
    logging.disable(logging.CRITICAL)
    try:
        with pv.vtk_verbosity("off"):
            yield
    finally:
        logging.disable(logging.NOTSET)


class _Array(NamedTuple):
    """An array of an image that may be the picture."""

    name: str
    association: str  #: "point" or "cell"
    values: NDArray[Any]


def read_vtk(path: Path, options: ReadOptions) -> Picture:
    """Read a slice of VTK's image data or of a MetaImage.

    Notes
    -----
    Rows of .vti run upwards, as in VTK; the first stored row of a MetaImage is on top, as ITK's programs show it.
    Which array: the one that `scalars` names, else the only one, the only one of integers, the active one.
    """
    if not path.is_file():
        raise InputError(f"cannot open the picture {path}: there is no such file")
    image = _image(path, options)
    array, told = _chosen(path, image, options)
    counts = pixel_counts(image, array.association)
    planes = array.values.reshape(*counts[::-1], *array.values.shape[1:])
    k, (u, v, w) = _slice_of(path, counts, options)
    values = np.moveaxis(planes, 2 - w, 0)[k]
    values = np.ascontiguousarray(values[::-1] if path.suffix.lower() == ".vti" else values)
    found = picture_of(values, str(path))
    notes = (told, f"slice {k} of {counts[w]}" if counts[w] > 1 else "")
    calibration = _calibration(path, image, array.association, (u, v))
    found = replace(found, calibration=calibration, notes=tuple(filter(None, notes)))
    return _with_names(found, image, array.name)


def _image(path: Path, options: ReadOptions) -> pv.ImageData:
    """Read a file whose header promises no more than is allowed."""
    is_vti = path.suffix.lower() == ".vti"
    if not is_vti:
        assert_whole(path, options)
    try:
        with silent_vtk():
            reader = pv.XMLImageDataReader(str(path)) if is_vti else pv.get_reader(str(path))  # type: ignore[no-untyped-call]
            reader.reader.UpdateInformation()
            extent = reader.reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.WHOLE_EXTENT())
            sides = [high - low + 1 for low, high in zip(extent[::2], extent[1::2], strict=True)]
            n_values = int(np.prod(sides, dtype=object))
            _assert_bytes(path, sides, n_values, is_vti)
            _, rows, columns = sorted(sides)
            assert_pixels(path, columns, rows, options)
            image = reader.read()
    except InputError:
        raise
    except Exception as error:  # VTK's own texts are many lines long
        raise InputError(f"{path} cannot be read as VTK image data: save it anew") from error
    if image.n_points == 0 or not image.array_names:
        raise InputError(f"{path} has no pixels, or is damaged: save it with an array of labels, greys or colours")
    return image


def _assert_bytes(path: Path, sides: list[int], n_values: int, is_vti: bool) -> None:
    """Raise where a small file promises more values than it could hold, even packed."""
    if min(sides) < 1 or (n_values > 8000 * max(path.stat().st_size, 1) and is_vti):
        raise InputError(f"{path} promises {' x '.join(map(str, sides))} values, more than it holds: save it anew")


def _chosen(path: Path, image: pv.ImageData, options: ReadOptions) -> tuple[_Array, str]:
    arrays = _arrays(image)
    if not arrays:
        raise InputError(f"{path} has no array of numbers: save it with an array of labels, greys or colours")
    listed = ", ".join(f"{name} ({array.values.dtype})" for name, array in arrays.items())
    if options.scalars is not None:
        if options.scalars not in arrays:
            raise InputError(f"scalars is '{options.scalars}', but {path} holds {listed}: give one of them")
        return arrays[options.scalars], ""
    if len(arrays) == 1:
        return next(iter(arrays.values())), ""
    if image.active_scalars_name == MATERIAL and "material_numbers" in image.field_data:
        return arrays[MATERIAL], ""
    whole = [array for array in arrays.values() if array.values.dtype.kind in "iu" and array.values.ndim == 1]
    active = arrays.get(str(image.active_scalars_name))
    found = whole[0] if len(whole) == 1 else (active if not whole else None)
    if found is None:
        raise InputError(f"{path} holds {len(arrays)} arrays, {listed}: choose one by scalars (--scalars NAME)")
    return found, f"array {found.name}, of {listed} (scalars)"


def _arrays(image: pv.ImageData) -> dict[str, _Array]:
    """Return the arrays of numbers that an image has, of cells and of points; ghost flags are none."""
    found: dict[str, _Array] = {}
    for association, data in (("cell", image.cell_data), ("point", image.point_data)):
        for name in data.keys():  # noqa: SIM118
            values = np.asarray(data[name])
            if values.dtype.kind in "biuf" and not name.startswith("vtk"):
                found[name] = _Array(name, association, values)
    return found


def _slice_of(path: Path, counts: tuple[int, int, int], options: ReadOptions) -> tuple[int, tuple[int, int, int]]:
    """Return which slice, and the axes of its columns, its rows, and across."""
    across = next((axis for axis in (2, 1, 0) if counts[axis] == 1), 2)
    u, v = (axis for axis in range(3) if axis != across)
    return Stack(str(path), (("frame", counts[across]),)).choose(options)["frame"], (u, v, across)


def _calibration(path: Path, image: pv.ImageData, association: str, plane: tuple[int, int]) -> Calibration:
    """Return spacing and place of an image that has other ones than VTK gives of itself."""
    x, y = (float(image.spacing[axis]) for axis in plane)
    half = 0.5 if association == "point" else 0.0
    first = [float(image.origin[axis]) + (image.extent[2 * axis] - half) * image.spacing[axis] for axis in plane]
    if x == y == 1.0 and all(abs(part) <= half for part in first):
        return Calibration()
    if path.suffix.lower() == ".vti":
        return Calibration(size_of(x, y, "", "VTK spacing"), (first[0], first[1]))
    return Calibration(size_of(x, y, "mm", "MetaImage ElementSpacing"))


def _with_names(picture: Picture, image: pv.ImageData, name: str) -> Picture:
    """Take the names of an image that this package has segmented."""
    if name != MATERIAL or "material_numbers" not in image.field_data:
        return picture
    materials = materials_of(image)
    names: Mapping[int, str] = dict(zip(materials.labels.tolist(), materials.names, strict=True))
    return replace(picture, labels=True, names=names)
