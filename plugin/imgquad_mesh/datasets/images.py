"""Images whose pixels have a material each: from any image of PyVista, and back into one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from pyvista.core.errors import MissingDataError

import imgquad_core as core
from imgquad_core.errors import InputError
from imgquad_core.model import LabelImage

from .fields import NUMBERS, materials_of, put_materials
from .placement import Placement

#: cell array of the values as `imgquad_mesh.read` gives them, and what it stores beside them
PICTURE, VOID_PIXELS, OPAQUE, PALETTE = "picture", "void", "opaque", "palette"
OF_VTK_TIFF = "Tiff Scalars"  #: what VTK's reader of TIFF calls its array
MATERIAL = "material"  #: array that a segmented image has
QUANTISED = "material_quantised"  #: field array: 1 where colours were quantised and noise is not removed yet


def image_array(image: pv.ImageData, scalars: str | None = None) -> NDArray[Any]:
    """Return the picture in a flat image: shape (rows, columns) or (rows, columns, channels), the top row first.

    Parameters
    ----------
    image : pyvista.ImageData
        With one pixel along one of its axes.
    scalars : str, optional
        Name of the array, of points or cells; by default the active one.

    Raises
    ------
    InputError
        The image is a volume or has no pixels.
    KeyError
        It has no array of this name.
    pyvista.core.errors.MissingDataError
        It has no array at all.
    """
    name, association = scalars_of(image, scalars)
    u, v = flat_axes(image, name, association)
    values = np.asarray(image.point_data[name] if association == "point" else image.cell_data[name])
    counts = pixel_counts(image, association)
    return np.ascontiguousarray(values.reshape(counts[v], counts[u], *values.shape[1:])[::-1])


def image_placement(image: pv.ImageData, scalars: str | None = None) -> Placement:
    """Return where the pixels of a flat image lie; a point of the image is the centre of its pixel."""
    name, association = scalars_of(image, scalars)
    plane = list(flat_axes(image, name, association))
    matrix = np.asarray(image.index_to_physical_matrix)
    first = np.array(image.extent[::2], float)
    if association == "point":
        first[plane] -= 0.5
    return Placement(matrix[:3, :3] @ first + matrix[:3, 3], matrix[:3, plane].T)


def flat_axes(image: pv.ImageData, name: str, association: str) -> tuple[int, int]:
    """Return the axes that a flat image runs along: of the columns and of the rows."""
    counts = pixel_counts(image, association)
    if min(counts) < 1:
        raise InputError(f"image '{name}' has {' x '.join(map(str, counts))} pixels: there is nothing to mesh")
    thin = [axis for axis in (2, 1, 0) if counts[axis] == 1]
    if not thin:
        raise InputError(
            f"image '{name}' is a stack of {' x '.join(map(str, counts))} voxels: give one slice, "
            "for example image.extract_subset((x0, x1, y0, y1, k, k))"
        )
    u, v = (axis for axis in range(3) if axis != thin[0])
    return u, v


def scalars_of(image: pv.ImageData, scalars: str | None = None) -> tuple[str, str]:
    """Return the name and the association ("point" or "cell") of the array that is processed."""
    if scalars is None:
        image = image.copy(deep=False)  # what is chosen must not become active in the input
        pv.set_default_active_scalars(image)
        scalars = image.active_scalars_name
        if scalars is None:
            raise MissingDataError("No data available.")
        return scalars, "point" if image.active_scalars_info.association.name == "POINT" else "cell"
    association = image.get_array_association(scalars, preference="point").name
    if association not in ("POINT", "CELL"):
        raise KeyError(f"Data array ({scalars}) not present in this dataset.")
    return scalars, association.lower()


def pixel_counts(image: pv.ImageData, association: str) -> tuple[int, int, int]:
    """Return the number of pixels along each axis."""
    nx, ny, nz = image.dimensions
    return (nx, ny, nz) if association == "point" else (max(nx - 1, 1), max(ny - 1, 1), max(nz - 1, 1))


def segmented(
    image: pv.ImageData, scalars: str | None = None, options: core.picture.SegmentationOptions | None = None
) -> core.picture.Segmentation:
    """Return the materials of an image: those it has already, else found in its scalars."""
    name, _ = scalars_of(image, scalars)
    values, options = image_array(image, name), options or core.picture.SegmentationOptions()
    if name != MATERIAL or NUMBERS not in image.field_data or options.colors not in ("auto", "exact"):
        found = _segmented(_picture(image, name, values), options)
        return replace(found, warnings=(*garbled(name, values), *found.warnings))
    materials = materials_of(image)
    unknown = np.setdiff1d(values, [-1, *materials.labels])
    if len(unknown):
        raise InputError(f"array 'material' holds {unknown[0]}, 'material_numbers' does not: segment the image anew")
    quantised = QUANTISED in image.field_data and bool(image.field_data[QUANTISED].any())
    return core.picture.Segmentation(LabelImage(values, materials), quantised)


def _segmented(raw: core.reading.Picture, options: core.picture.SegmentationOptions) -> core.picture.Segmentation:
    found = core.picture.segment_picture(raw, options)
    return replace(found, image=core.picture.as_told(found.image, raw))


def garbled(name: str, values: NDArray[Any]) -> tuple[str, ...]:
    """Say where an image looks as VTK's reader of TIFF garbles it (9.4 to 9.7), as far as that can be told."""
    channels = values.shape[2] if values.ndim == 3 else 1
    is_deep = channels >= 3 and values.dtype.itemsize > 1
    is_clear = channels == 4 and not values[..., 3].any()
    if name != OF_VTK_TIFF or not (is_deep or is_clear):
        return ()
    what = "colours of more than 8 bits" if is_deep else "alpha"
    return (f"VTK's reader gets {what} in TIFF files wrong: read the file by imgquad_mesh.read(path)",)


def _picture(image: pv.ImageData, name: str, values: NDArray[Any]) -> core.reading.Picture:
    """Return the picture in an image, with what `imgquad_mesh.read` has stored beside its values."""
    if name != PICTURE or PICTURE not in image.cell_data:
        return core.reading.picture_of(values)
    masks = {key: image_array(image, key) > 0 for key in (VOID_PIXELS, OPAQUE) if key in image.cell_data}
    palette = np.asarray(image.field_data[PALETTE], np.uint8) if PALETTE in image.field_data else None
    found = core.reading.Picture(values, palette) if palette is not None else core.reading.picture_of(values)
    return replace(found, void=masks.get(VOID_PIXELS), opaque=masks.get(OPAQUE))


def with_materials(image: pv.ImageData, found: core.picture.Segmentation, scalars: str | None = None) -> pv.ImageData:
    """Return a copy of an image with the array `material` (int32, active; -1: none) where its scalars are."""
    _, association = scalars_of(image, scalars)
    out = image.copy()
    data = out.point_data if association == "point" else out.cell_data
    data[MATERIAL] = found.image.labels[::-1].ravel()
    put_materials(out, found.image.materials)
    out.field_data[QUANTISED] = np.array([found.quantised], np.uint8)
    out.set_active_scalars(MATERIAL, preference="point" if association == "point" else "cell")
    return out
