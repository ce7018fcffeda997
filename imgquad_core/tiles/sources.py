"""Windows of large pictures: read without the rest of the picture."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from imgquad_core.errors import InputError
from imgquad_core.picture import assert_box
from imgquad_core.reading import Calibration, Picture, ReadOptions, picture_of, read_picture
from imgquad_core.reading.decoding import decoding, optional
from imgquad_core.reading.picture import part_of
from imgquad_core.reading.zarr_images import is_zarr, plane_of_zarr

from .files import save_plane
from .grid import Box

MOST_SAMPLED, WINDOWS = 1 << 24, 64  #: pixels of a sample, and windows that it is made of where the picture has more
SPREAD = (0.7548776662466927, 0.5698402909980532)  #: steps of places that fill a square evenly (R2, the plastic number)
TIFF = (".tif", ".tiff", ".btf", ".svs", ".ndpi", ".scn")


@dataclass(frozen=True)
class Source:
    """A picture of which windows are read.

    Parameters
    ----------
    path : str
        Its file or folder: .npy (mapped), .zarr, tiled TIFF and pyramids.
    shape : tuple of int
        (n_rows, n_cols).
    name : str
        What to call it.
    options : ReadOptions
        Level and channel.
    calibration : Calibration
        Pixel size and place, as far as the file knows them.
    corner : tuple of int
        Column and row in the file where the picture begins.
    """

    path: str
    shape: tuple[int, int]
    name: str
    options: ReadOptions
    calibration: Calibration
    corner: tuple[int, int] = (0, 0)

    def cropped(self, box: Box) -> Source:
        """Return the part of the picture within a box as a picture of its own; raise `InputError` where it is none."""
        assert_box(box, self.shape)
        left, upper, right, lower = box
        corner = self.corner[0] + left, self.corner[1] + upper
        placed = self.calibration.cropped(box, self.shape[0])
        return replace(self, shape=(lower - upper, right - left), calibration=placed, corner=corner)

    def read(self, box: Box) -> Picture:
        """Return the part of the picture within left, upper, right, lower bounds."""
        across, down = self.corner
        box = left, upper, right, lower = box[0] + across, box[1] + down, box[2] + across, box[3] + down
        path = Path(self.path)
        with decoding(path):
            if path.suffix == ".npy":
                values = np.load(path, mmap_mode="r")[upper:lower, left:right]
                return picture_of(np.ascontiguousarray(values), self.name)
            if is_zarr(path):
                array = plane_of_zarr(path, self.options)
                return replace(picture_of(np.asarray(array.array[array.at(box)]), self.name), labels=array.is_labels)
            limited = replace(self.options, crop=box, max_pixels=max((right - left) * (lower - upper), 1))
            found = read_picture(path, limited)
            return replace(found, name=self.name) if found.window else part_of(found, box)


def source_of(path: Path, options: ReadOptions, scratch: Path) -> Source:
    """Return a source of windows of a file.

    Parameters
    ----------
    path : Path
        The picture.
    options : ReadOptions
        How it is read; a picture that can be decoded as a whole only must keep to `max_pixels`.
    scratch : Path
        Where such a picture is kept for its windows, ``.npy``.

    Raises
    ------
    InputError
        It cannot be read, or its windows cannot.
    """
    if is_zarr(path):
        optional("zarr", path)
        found = plane_of_zarr(path, options)
        return Source(str(path), found.shape, path.name, options, found.calibration)
    if path.suffix == ".npy":
        with decoding(path):
            shape = np.load(path, mmap_mode="r").shape
        if len(shape) not in (2, 3) or (len(shape) == 3 and shape[2] > 4):
            raise InputError(f"{path} has the shape {shape}: give (rows, columns) or (rows, columns, 1 to 4)")
        return Source(str(path), (int(shape[0]), int(shape[1])), path.name, options, Calibration())
    if path.suffix.lower() in TIFF:
        whole = _tiff(path, options)
        if whole is not None:
            return whole
    return _decoded(path, options, scratch)


def _tiff(path: Path, options: ReadOptions) -> Source | None:
    """Return the source of a TIFF file that is read tile by tile; None where it has to be decoded as a whole."""
    import tifffile  # not above: other pictures do without it

    with decoding(path), tifffile.TiffFile(path) as file:
        page = file.pages.first
        if not page.is_tiled and page.rowsperstrip >= page.imagelength:
            return None
        levels = file.series[0].levels
        if options.level >= len(levels):
            n = len(levels)
            raise InputError(f"level is {options.level}, but {path} has {n}: give 0 (finest) to {n - 1}")
        first: Any = levels[options.level].pages[0]
        first = first.aspage()
        shape = (int(first.imagelength), int(first.imagewidth))
    trial = Source(str(path), shape, path.name, options, Calibration())
    if shape[0] * shape[1] < 2:
        return None
    lower = max(min(shape[0] - 1, 8), 1)
    found = trial.read((0, 0, max(shape[1] - 1, 1), lower)).calibration
    return replace(trial, calibration=found.cropped((0, 0, 0, shape[0]), lower))  # from there down to the lower edge


def _decoded(path: Path, options: ReadOptions, scratch: Path) -> Source:
    """Decode a picture as a whole, once, and keep its pixels for windows."""
    found = read_picture(path, options)
    values = found.values if found.palette is None else found.palette[found.values]
    lost = [name for name in ("void", "opaque") if getattr(found, name) is not None]
    if lost:
        raise InputError(f"{path} has pixels that hold nothing or are transparent: save it as .zarr or tiled TIFF")
    if not scratch.exists():
        save_plane(scratch, values)
    return Source(str(scratch), found.shape, path.name, options, found.calibration)


def sample_boxes(shape: tuple[int, int]) -> Sequence[Box]:
    """Return the windows that a sample of a picture is made of: all of it, or some that are spread evenly."""
    rows, cols = shape
    if rows * cols <= MOST_SAMPLED:
        return [(0, 0, cols, rows)]
    side = int((MOST_SAMPLED // WINDOWS) ** 0.5)
    height, width = min(side, rows), min(side, cols)
    boxes = []
    for i in range(WINDOWS):
        top, left = (
            int((0.5 + i * step) % 1.0 * (room + 1))
            for step, room in zip(SPREAD, (rows - height, cols - width), strict=True)
        )
        boxes.append((left, top, left + width, top + height))
    return boxes


def stamp_of(path: Path) -> Any:
    """Return what changes when a file or a folder of Zarr is written: sizes and times."""
    if path.is_file():
        found = path.stat()
        return [found.st_size, found.st_mtime_ns]
    whole = hashlib.blake2b(digest_size=16)
    for part in sorted(path.rglob("*")):
        if part.is_file():
            found = part.stat()
            whole.update(f"{part.relative_to(path)} {found.st_size} {found.st_mtime_ns}\n".encode())
    return whole.hexdigest()
