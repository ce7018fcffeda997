"""What tiles leave for each other: arrays in files that are whole or not there."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.whole_files import replacing


def path_of(folder: Path, kind: str, *places: int) -> Path:
    """Return where a kind of arrays of a tile is kept."""
    return folder / ("-".join([kind, *map(str, places)]) + ".npz")


def save_arrays(path: Path, **arrays: Any) -> None:
    """Write arrays; the same arrays give the same bytes."""
    whole = BytesIO()  # NumPy overlooks that a disk is full
    np.savez(whole, **arrays)
    with replacing(path) as temporary:
        temporary.write_bytes(whole.getbuffer())


def load_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of a file."""
    with np.load(path) as found:
        return {name: found[name] for name in found.files}


def save_plane(path: Path, plane: NDArray[Any]) -> None:
    """Write one array that windows are read from."""
    whole = BytesIO()
    np.save(whole, plane)
    with replacing(path) as temporary:
        temporary.write_bytes(whole.getbuffer())
