"""Arrays saved by NumPy: .npy and .npz."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from imgquad_core.errors import InputError

from .decoding import Stack, assert_pixels, decoding
from .options import ReadOptions
from .picture import Picture, picture_of

#: unpickling runs what its author wrote, so the way round it is for those who trust the file, and not told here
_OBJECTS = (
    "holds Python objects (pickles), which are never loaded: where the file was made, save the bare array in it by "
    "numpy.save (of Cellpose, what is under 'masks')"
)
_PICKLE = b"\x80"  #: how a pickle starts, whatever the file is called


def read_npy(path: Path, options: ReadOptions) -> Picture:
    """Read an array of (rows, columns[, channels]); a stack has one more axis in front."""
    with decoding(path):
        with path.open("rb") as file:
            _assert_no_objects(path, file)
        array = np.load(path, mmap_mode="r", allow_pickle=False)
        return plane_of(path, array, options)


def read_npz(path: Path, options: ReadOptions) -> Picture:
    """Read one array of several; `scalars` names it."""
    with decoding(path), zipfile.ZipFile(path) as archive:
        names = [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]
        name = chosen_array(path, names, options)
        with archive.open(f"{name}.npy") as file:
            shape, _ = _assert_no_objects(path, file)
            _assert_few(path, shape, options)
        with archive.open(f"{name}.npy") as file:
            array = npy.read_array(file, allow_pickle=False)  # type: ignore[no-untyped-call]
        return plane_of(path, array, options)


def chosen_array(path: Path, names: list[str], options: ReadOptions, most_likely: str | None = None) -> str:
    """Return the name of the array that is asked for, the only one, or the one that is `most_likely` meant."""
    if options.scalars in names:
        return str(options.scalars)
    known = ", ".join(names[:20]) + (" ..." if len(names) > 20 else "")
    if options.scalars is not None:
        raise InputError(f"scalars is '{options.scalars}', but {path} holds {known or 'no array'}: give one of them")
    if len(names) == 1 or most_likely is not None:
        return most_likely or names[0]
    raise InputError(f"{path} holds {len(names)} arrays ({known}): choose one by scalars (--scalars NAME)")


def plane_of(path: Path, array: NDArray[Any], options: ReadOptions) -> Picture:
    """Return the picture in an array of 2 axes, 3 (the last one short: channels; else a stack) or 4."""
    if array.ndim == 4 or (array.ndim == 3 and array.shape[2] > 4):
        array = array[Stack(str(path), (("frame", len(array)),)).choose(options)["frame"]]
    if array.ndim >= 2:
        assert_pixels(path, array.shape[1], array.shape[0], options)
    if options.channel is not None and array.ndim == 3:
        array = array[..., Stack(str(path), (("channel", array.shape[2]),)).choose(options)["channel"]]
    return replace(picture_of(np.array(array), str(path)))


def _assert_no_objects(path: Path, file: Any) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Return shape and type of what a file holds, read from its header; raise for Python objects."""
    if file.read(1) == _PICKLE:
        raise InputError(f"{path} {_OBJECTS}")
    file.seek(0)
    version = npy.read_magic(file)  # type: ignore[no-untyped-call]
    read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, _, dtype = read(file)  # type: ignore[no-untyped-call]
    if dtype.hasobject:
        raise InputError(f"{path} {_OBJECTS}")
    return shape, dtype


def _assert_few(path: Path, shape: tuple[int, ...], options: ReadOptions) -> None:
    n = int(np.prod(shape, dtype=object)) if shape else 1
    if n > 4 * options.max_pixels:
        raise InputError(f"{path} holds {n} values, more than four times max_pixels = {options.max_pixels}: raise it")
