"""Pictures from files, as values of the core and as PyVista's images."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from imgquad_core.picture.naming import as_told
from imgquad_core.picture.segmentation import segment_picture
from imgquad_core.reading.formats import called, read_picture
from imgquad_core.reading.options import ReadOptions
from imgquad_core.reading.picture import Picture

from .field_texts import put_texts
from .fields import put_calibration, put_materials
from .images import MATERIAL, OPAQUE, PALETTE, PICTURE, VOID_PIXELS
from .metaimage import VTK_EXTENSIONS
from .vtk_pictures import read_vtk


def read_any(path: str | Path, options: ReadOptions | None = None, name: str | None = None) -> Picture:
    """Read a picture from a file of any format that the command reads; see `imgquad_core.reading.read_picture`."""
    path, options = Path(path), options or ReadOptions()
    if path.suffix.lower() not in VTK_EXTENSIONS:
        return read_picture(path, options, name)
    with called(path, name):
        found = read_vtk(path, options)
    return replace(found, name=name) if name else found


def read(path: str | Path, **options: Any) -> pv.ImageData:
    """Read a picture as an image of PyVista, right for every format that the command reads.

    Parameters
    ----------
    path : str or Path
        The file.
    **options
        Fields of `imgquad_core.reading.ReadOptions`: `frame`, `channel`, `level`, `scalars`, `info_bar`,
        `grain_angle`, `max_pixels`, `crop`.

    Returns
    -------
    pyvista.ImageData
        One cell a pixel, y up: its bounds are those of the picture. Spacing and origin are those of the file where it
        has any that can be trusted (field arrays ``pixel_size_unit``, ``pixel_size_source``, ``crs``), else 1 and 0.
        The cell array ``picture`` (active) holds the values; ``void`` and ``opaque`` (0 or 1) and the field array
        ``palette`` what belongs to them. Of labels that the format itself names (phases and grains of an EBSD map, an
        OME-Zarr label image), it is the array ``material`` (-1: none) with the field arrays of the materials. The
        field array ``notes`` holds what the reader chose.

    Raises
    ------
    imgquad_core.errors.InputError
        The file cannot be read; the text names the remedy. It is a ValueError.

    Examples
    --------
    >>> import imgquad_mesh
    >>> image = imgquad_mesh.read("steel.ang", scalars="grains")  # doctest: +SKIP
    >>> mesh = image.imgquad.mesh(size=4)  # doctest: +SKIP
    """
    return to_image(read_any(path, ReadOptions(**options)))


def to_image(picture: Picture) -> pv.ImageData:
    """Return a picture as an image, one cell a pixel, y up."""
    rows, cols = picture.shape
    image = pv.ImageData(dimensions=(cols + 1, rows + 1, 1))
    put_calibration(image, picture.calibration)
    put_texts(image, "notes", picture.notes or [""])
    if picture.labels:
        labels = as_told(segment_picture(picture).image, picture)
        image.cell_data[MATERIAL] = _upwards(labels.labels)
        put_materials(image, labels.materials)
        image.set_active_scalars(MATERIAL, preference="cell")
        return image
    image.cell_data[PICTURE] = _upwards(picture.values)
    for name, mask in ((VOID_PIXELS, picture.void), (OPAQUE, picture.opaque)):
        if mask is not None:
            image.cell_data[name] = _upwards(mask.astype(np.uint8))
    if picture.palette is not None:
        image.field_data[PALETTE] = picture.palette
    image.set_active_scalars(PICTURE, preference="cell")
    return image


def _upwards(values: NDArray[Any]) -> NDArray[Any]:
    if values.dtype == np.float16:  # VTK has none
        values = values.astype(np.float32)
    return np.ascontiguousarray(values[::-1]).reshape(-1, *values.shape[2:])
