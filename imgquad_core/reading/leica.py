"""Leica's LIF files: confocal and wide-field pictures, by liffile."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from .calibration import Calibration, PixelSize, in_handy_unit, size_of
from .decoding import Stack, assert_pixels, decoding, optional
from .numpy_files import chosen_array
from .options import ReadOptions
from .picture import Picture, picture_of

#: what axes are called, other than rows, columns and the samples of a colour
_AXES = {"C": "channel", "T": "time", "Z": "plane", "M": "mosaic tile"}
#: sides of a pixel that differ by less are equal: origins of 1e-20 m are written beside lengths of six digits
SQUARE = 1e-4


def read_lif(path: Path, options: ReadOptions) -> Picture:
    """Read a plane of one of a file's pictures, which `scalars` names; only this plane is loaded.

    Notes
    -----
    The last two axes are rows and columns, whatever they are (xy, xz, xt scans). A channel is one of the picture's; of
    times, planes and wavelengths `frame` counts all together.
    """
    liffile = optional("lif", path)
    with decoding(path), liffile.LifFile(path) as file:
        images = {image.path: image for image in file.images}
        name = chosen_array(path, list(images), options)
        image = images[name]
        axes = [axis for axis in image.dims if axis != "S"]
        outer, (rows, cols) = axes[:-2], axes[-2:]
        assert_pixels(path, image.sizes[cols], image.sizes[rows], options)
        stack = Stack(
            f"{name} of {path}", tuple((_AXES.get(axis, f"axis {axis}"), image.sizes[axis]) for axis in outer)
        )
        place = stack.choose(options) if outer else {}
        plane = image.frame(**{axis: place[_AXES.get(axis, f"axis {axis}")] for axis in outer})
        told = ", ".join(f"{axis} {place[axis]} of {n}" for axis, n in stack.axes if n > 1)
        notes = (f"picture {name}" + (f", {told}, counted from 0" if told else ""),)
        size = _size(image, rows, cols)
        return replace(picture_of(np.array(plane), str(path)), calibration=Calibration(size), notes=notes)


def _size(image: Any, rows: str, cols: str) -> PixelSize | None:
    """Return the size of a pixel where both axes are lengths; of an xt scan they are not."""
    if not {rows, cols} <= {"X", "Y", "Z"} or not {rows, cols} <= set(image.coords):
        return None
    steps = [abs(float(at[-1] - at[0])) / max(len(at) - 1, 1) for at in (image.coords[cols], image.coords[rows])]
    x, y = (steps[0], steps[0]) if abs(steps[1] - steps[0]) <= SQUARE * steps[0] else steps
    found = size_of(x, y, "m", "Leica's DimensionDescription")
    return in_handy_unit(found) if found else None
