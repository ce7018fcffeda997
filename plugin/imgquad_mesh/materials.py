"""Images whose pixels have a material each: from any image of PyVista, and back into one."""

from __future__ import annotations

import numpy as np
import pyvista as pv

from imgquad_core.errors import InputError
from imgquad_core.model import LabelImage
from imgquad_core.segmentation import Segmentation, SegmentationOptions, segment_picture
from imgquad_mesh.convert import image_array, materials_of, put_materials, scalars_of

MATERIAL = "material"  #: array that a segmented image has
QUANTISED = "material_quantised"  #: field array: 1 where colours were quantised and noise is not removed yet


def segmented(
    image: pv.ImageData, scalars: str | None = None, options: SegmentationOptions | None = None
) -> Segmentation:
    """Return the materials of an image: those it has already, else found in its scalars."""
    name, _ = scalars_of(image, scalars)
    values, options = image_array(image, name), options or SegmentationOptions()
    if name != MATERIAL or "material_numbers" not in image.field_data or options.colors not in ("auto", "exact"):
        return segment_picture(values, options)
    materials = materials_of(image)
    unknown = np.setdiff1d(values, [-1, *materials.labels])
    if len(unknown):
        raise InputError(f"array 'material' holds {unknown[0]}, 'material_numbers' does not: segment the image anew")
    quantised = QUANTISED in image.field_data and bool(image.field_data[QUANTISED].any())
    return Segmentation(LabelImage(values, materials), quantised)


def with_materials(image: pv.ImageData, found: Segmentation, scalars: str | None = None) -> pv.ImageData:
    """Return a copy of an image with the array `material` (int32, active; -1: none) where its scalars are."""
    _, association = scalars_of(image, scalars)
    out = image.copy()
    data = out.point_data if association == "point" else out.cell_data
    data[MATERIAL] = found.image.labels[::-1].ravel()
    put_materials(out, found.image.materials)
    out.field_data[QUANTISED] = np.array([found.quantised], np.uint8)
    out.set_active_scalars(MATERIAL, preference="point" if association == "point" else "cell")
    return out
