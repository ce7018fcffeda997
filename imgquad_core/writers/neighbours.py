"""Formats of more than one file: what is written along with a file, and whether it may be replaced."""

from __future__ import annotations

import re
from pathlib import Path

from imgquad_core.errors import InputError
from imgquad_core.whole_files import foreign_file

#: endings of what is written along with a file of each extension, after its name without the extension
NEIGHBOURS = {".xdmf": (".h5", "_sides.xdmf", "_sides.h5"), ".obj": (".mtl",)}


def files_of(path: Path) -> list[Path]:
    """Return `path` and all files that are written along with it."""
    endings = NEIGHBOURS.get(path.suffix.lower(), ())
    return [path, *(path.with_name(path.stem + ending) for ending in endings)]


def check_neighbours(path: Path) -> None:
    """Raise `InputError` where a file that would be written along with `path` is somebody else's."""
    for place in files_of(path)[1:] if path.suffix.lower() == ".xdmf" else ():
        if place.exists() and not is_of_xdmf(place):
            raise InputError(foreign_file(place, path))


def is_of_xdmf(path: Path) -> bool:
    """Return whether a file is one that is written along with an `.xdmf`: names of its arrays, or its side sets."""
    if path.suffix.lower() == ".xdmf":
        return b"side_set" in path.read_bytes()
    import h5py  # an extra

    try:
        with h5py.File(path, "r") as file:
            return all(re.fullmatch(r"data\d+", name) for name in file)
    except OSError:  # no HDF5
        return False
