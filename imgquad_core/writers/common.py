"""What the writers share: files that appear whole or not at all, safe names, fast rows of numbers."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from imgquad_core.arrays import Ints
from imgquad_core.errors import InputError
from imgquad_core.fe.femesh import FEMesh, Names
from imgquad_core.whole_files import replacing

ROWS_AT_ONCE = 20_000  # rows formatted in one go: a few MB of text in memory
LOOKED_UP = 100_000  # elements whose nodes are in memory at a time


@dataclass(frozen=True)
class Nodes:
    """Nodes of some elements: looked up part by part, as they may lie in a mapped file."""

    of: Ints  #: nodes of all elements of a kind
    ids: Ints | None = None  #: which of them; None: all

    def __len__(self) -> int:
        return len(self.of if self.ids is None else self.ids)

    def parts(self) -> Iterator[Ints]:
        """Yield the nodes of so many elements, and of the next ones."""
        for start in range(0, len(self), LOOKED_UP):
            part = slice(start, start + LOOKED_UP)
            yield self.of[part] if self.ids is None else self.of[self.ids[part]]


def write_text(path: str | Path, parts: Iterable[str]) -> None:
    """Write `parts` one after the other, as UTF-8, whole or not at all."""
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as stream:
        stream.writelines(parts)


def rows(template: str, *columns: ArrayLike) -> Iterator[str]:
    """Format row by row: `template` takes the values of each row of the columns, as ``%`` does."""
    arrays = [np.asarray(column) for column in columns]
    for start in range(0, len(arrays[0]), ROWS_AT_ONCE):
        lists = [part for array in arrays for part in _as_lists(array[start : start + ROWS_AT_ONCE])]
        yield template * len(lists[0]) % tuple(chain.from_iterable(zip(*lists, strict=True)))


def _as_lists(array: np.ndarray[Any, Any]) -> list[list[Any]]:
    return [array.tolist()] if array.ndim == 1 else array.T.tolist()


def real(value: float) -> str:
    """Format a real with a point or an exponent; CalculiX takes some reals without one for whole numbers."""
    text = f"{value:.12g}"
    return text if "." in text or "e" in text else text + "."


def wrapped(ids: ArrayLike, per_line: int, separator: str = ", ") -> Iterator[str]:
    """Yield numbers, `per_line` to a line."""
    array = np.asarray(ids)
    for begin in range(0, len(array), per_line * ROWS_AT_ONCE):
        values = list(map(str, array[begin : begin + per_line * ROWS_AT_ONCE].tolist()))
        for start in range(0, len(values), per_line):
            yield separator.join(values[start : start + per_line]) + "\n"


def safe_names(
    names: Iterable[str], limit: int, *, reserved: Sequence[str] = (), upper: bool = False
) -> dict[str, str]:
    """Return a name for each of `names` that a solver takes: letters, digits, ``_``; first a letter; no two alike.

    Raises
    ------
    InputError
        A name has more than `limit` signs.
    """
    claimed = Names(reserved)
    safe = {name: claimed.claim(_plain(name, upper)) for name in names}
    for short in safe.values():
        if len(short) > limit:
            raise InputError(
                f"the set name '{short}' has {len(short)} signs, this format takes {limit}; shorten names of materials"
            )
    return safe


def _plain(name: str, upper: bool) -> str:
    text = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    text = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_") or "set"
    text = text if text[0].isalpha() else f"m_{text}"
    return text.upper() if upper else text


def points_3d(mesh: FEMesh) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Points with z = 0 in the plane."""
    return mesh.points if mesh.points.shape[1] == 3 else np.column_stack([mesh.points, np.zeros(mesh.n_points)])


def refuse_cohesive(mesh: FEMesh, form: str) -> None:
    """Raise where `form` cannot hold cohesive elements."""
    if len(mesh.cohesive):
        raise InputError(no_cohesive(form))


def no_cohesive(form: str) -> str:
    """Text of the error where `form` cannot hold cohesive elements."""
    return (
        f"{form} has no cohesive elements; write .inp, .e, .msh, .vtu or .npz, or no elements between the sides "
        "(interfaces: sides)"
    )


def refuse_six_nodes(mesh: FEMesh, form: str, remedy: str = "") -> None:
    """Raise where `form` cannot hold the cohesive elements of second-order quads."""
    if len(mesh.cohesive) and mesh.cohesive.shape[1] == 6:
        raise InputError(
            f"{form} has no six-node cohesive elements, as order 2 makes them ({len(mesh.cohesive)} here); write .vtu "
            f"or .npz, take order 1, {remedy}or no elements between the sides (interfaces: sides)"
        )


def refuse_3d(mesh: FEMesh, form: str) -> None:
    """Raise where `form` holds plane meshes only."""
    if mesh.dimension == 3:
        raise InputError(f"{form} is for plane meshes; write an extruded mesh as .inp, .e, .msh, .bdf or .vtu")
