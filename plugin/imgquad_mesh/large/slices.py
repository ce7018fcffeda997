"""The slices of a stack: files, the pictures within a file, planes of an array."""

from __future__ import annotations

import glob
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from imgquad_core.errors import InputError
from imgquad_core.reading import Picture, ReadOptions, count_pictures, picture_of, read_picture


class Slice(NamedTuple):
    """One slice: where it is."""

    name: str
    path: str | None = None  #: None for a plane of an array, which is handed on beside it
    frame: int | None = None  #: of a file that holds several


class Slices(NamedTuple):
    """All slices, and the planes of those that are no files."""

    of: tuple[Slice, ...]
    planes: tuple[Any, ...]  #: arrays, of NumPy or Dask; None for files


def slices_of(source: Any, options: ReadOptions) -> Slices:
    """Return the slices that a source names.

    Parameters
    ----------
    source : str, path, sequence of these, or array
        A pattern (``slices/*.png``), files in the order they lie, one file that holds a stack, or an array, of NumPy
        or Dask, of shape (n, rows, columns) or (n, rows, columns, 3).
    options : ReadOptions
        How files are read.

    Raises
    ------
    InputError
        Nothing is found, or an array is no stack.
    """
    if hasattr(source, "ndim") and hasattr(source, "shape"):
        return _of_array(source)
    given = [source] if isinstance(source, (str, Path)) else list(source)
    paths = [path for each in given for path in _matching(str(each))]
    if len(paths) != 1:
        return _of_files([Slice(Path(path).name, path) for path in paths])
    n = count_pictures(paths[0], options)
    name = Path(paths[0]).name
    return _of_files([Slice(f"{name}[{k}]", paths[0], k) for k in range(n)] if n > 1 else [Slice(name, paths[0])])


def read_slice(which: Slice, plane: Any, options: ReadOptions) -> Picture:
    """Return the picture of a slice."""
    if which.path is None:
        return replace(picture_of(np.asarray(plane), which.name))
    return replace(read_picture(which.path, replace(options, frame=which.frame)), name=which.name)


def _of_files(found: Sequence[Slice]) -> Slices:
    return Slices(tuple(found), (None,) * len(found))


def _matching(text: str) -> list[str]:
    """Return the files that a pattern matches, numbers in their names in order; a file itself as it is."""
    if Path(text).exists():
        return [text]
    found = sorted(glob.glob(text), key=_natural)
    if not found:
        raise InputError(f"no file is called {text}: give a pattern in quotes, such as 'slices/*.png', or a file")
    return found


def _natural(name: str) -> list[Any]:
    """Return a key by which slice2 comes before slice10."""
    return [(part.isdigit(), int(part) if part.isdigit() else 0, part) for part in re.split(r"(\d+)", name)]


def _of_array(source: Any) -> Slices:
    if source.ndim not in (3, 4) or source.shape[0] == 0 or (source.ndim == 4 and source.shape[3] > 4):
        raise InputError(f"the array has the shape {tuple(source.shape)}: give (n, rows, columns) or with 3 channels")
    n = int(source.shape[0])
    return Slices(tuple(Slice(f"slice {k}") for k in range(n)), tuple(source[k] for k in range(n)))
