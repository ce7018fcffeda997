"""EBSD maps as text: .ang of EDAX (and EMsoft, ASTAR), .ctf of Oxford Instruments; by NumPy alone."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from dataclasses import replace
from io import StringIO
from math import prod
from pathlib import Path

import numpy as np

from imgquad_core.arrays import Floats, Labels
from imgquad_core.errors import InputError

from .crystal_map import Phase, Points, crystal_picture, on_pixels
from .decoding import decoding
from .grains import LAUE_GROUPS
from .options import ReadOptions
from .picture import Picture

#: what EDAX calls a symmetry -> Laue group; x lies along a in trigonal crystals
_EDAX = {
    "1": "-1", "2": "2/m", "20": "2/m", "22": "mmm", "4": "4/m", "42": "4/mmm", "3": "-3", "32": "-3m x", "6": "6/m",
    "62": "6/mmm", "23": "m-3", "43": "m-3m", "m3m": "m-3m", "432": "m-3m", "m-3m": "m-3m", "622": "6/mmm",
    "6/mmm": "6/mmm", "mmm": "mmm", "222": "mmm", "422": "4/mmm", "4/mmm": "4/mmm", "321": "-3m x", "-3m": "-3m x",
}  # fmt: skip
#: Euler angles from which EDAX marks a point as not indexed: 4 pi
_NOT_INDEXED = 12.5
#: no header is longer, in bytes
_LONGEST_HEADER = 4_000_000


def read_ang(path: Path, options: ReadOptions) -> Picture:
    """Read an .ang map: its phases, or its grains.

    Notes
    -----
    Columns: phi1, Phi, phi2 (radians), x, y (um), image quality, confidence index, phase. Not indexed: confidence
    below 0, Euler angles of 4 pi, phase 0 of a map with several phases.
    """
    with decoding(path):
        text = _text(path)
        header = [line for line in text[:_LONGEST_HEADER].splitlines() if line.startswith("#")]
        phases = _phases_of_ang(header)
        table = _table(path, text, range(8), comments="#")
        phase = _phases_of_points(path, table, phases)
        lost = (table[:, 6] < 0) | (table[:, :3] > _NOT_INDEXED).all(axis=1)
        points = Points(table[:, 3], table[:, 4], np.where(lost, -1, phase).astype(np.int32), table[:, :3])
        found = on_pixels(path, points, phases, "um", options)
    return _told_of_loss(crystal_picture(path, found, options), _promised_by_ang(header), len(table))


def read_ctf(path: Path, options: ReadOptions) -> Picture:
    """Read a .ctf map: its phases, or its grains. Euler angles are in degrees, steps in um, phase 0 is not indexed."""
    with decoding(path):
        text = _text(path)
        head, names, body = _parts_of_ctf(path, text)
        phases = _phases_of_ctf(path, head)
        wanted = ("Phase", "X", "Y", "Euler1", "Euler2", "Euler3")
        missing = [name for name in wanted if name not in names]
        if missing:
            raise InputError(f"{path} has no column {missing[0]}: export the map with it")
        table = _table(path, body, [names.index(name) for name in wanted])
        phase = table[:, 0].astype(np.int32)
        _assert_known(path, phase, phases)
        indexed = np.where(phase > 0, phase, -1).astype(np.int32)
        points = Points(table[:, 1], table[:, 2], indexed, np.radians(table[:, 3:]))
        found = on_pixels(path, points, phases, "um", options)
    return _told_of_loss(crystal_picture(path, found, options), _promised_by_ctf(head), len(table))


def _told_of_loss(picture: Picture, promised: int, n_points: int) -> Picture:
    """Add a note where a header promises more points than its table has; headers are stale at times, so no error."""
    if n_points >= promised:
        return picture
    note = f"its header promises {promised} points, its table has {n_points}: the file may be cut off"
    return replace(picture, notes=(*picture.notes, note))


def _product_of(lines: Sequence[str], names: tuple[str, str]) -> int:
    """Return the product of two whole numbers of a header, by the names before them; 0 where one is missing."""
    found = [re.search(rf"^[# ]*{name}:?\s+(\d+)\s*$", "\n".join(lines), re.MULTILINE) for name in names]
    return prod(int(number.group(1)) if number else 0 for number in found)


def _promised_by_ang(header: Sequence[str]) -> int:
    """Rows times columns; of hexagonal grids, whose rows differ by one, one row of two is a point shorter."""
    odd, even = (_product_of(header, ("NROWS", f"NCOLS_{which}")) for which in ("ODD", "EVEN"))
    return min(odd, even)


def _promised_by_ctf(head: Sequence[str]) -> int:
    return _product_of(head, ("XCells", "YCells"))


def _text(path: Path) -> str:
    return path.read_bytes().decode("utf-8", "replace").replace("\r\n", "\n").replace("\r", "\n")


def _table(path: Path, text: str, columns: Sequence[int], comments: str | None = None) -> Floats:
    """Return columns of numbers; a decimal comma is one point."""
    commas = StringIO(text.replace(",", ".") if "," in text else text)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that there are no points is said below
            table = np.loadtxt(commas, comments=comments, usecols=columns, ndmin=2)
    except ValueError as error:
        said = " ".join(str(error).split())[:150]
        raise InputError(f"{path} holds no table of numbers as its format has ({said}): export it anew") from error
    if len(table) == 0:
        raise InputError(f"{path} holds no points: export it anew")
    return table


# ---------------------------------------------------------------------------------------------------- .ang


def _phases_of_ang(header: Sequence[str]) -> dict[int, Phase]:
    """Return the phases by number; those without a number count from 1."""
    found: dict[int, Phase] = {}
    number, name = 0, ""
    for line in header:
        key, _, value = line.lstrip("# ").replace("\t", " ").partition(" ")
        if re.fullmatch(r"# *Phase[ \t]+\d+[ \t]*", line):
            number, name = int(value), ""
        elif key == "MaterialName":
            number = number if number not in found and number else max(found, default=0) + 1
            name = value.strip()
        elif key == "Symmetry" and number:
            found[number] = Phase(name or f"phase {number}", _EDAX.get(value.strip().lower(), "-1"))
    return found or {1: Phase("phase 1", "-1")}


def _phases_of_points(path: Path, table: Floats, phases: dict[int, Phase]) -> Floats:
    phase = table[:, 7].copy()
    if len(phases) == 1:
        phase[phase == 0] = next(iter(phases))  # a map of one phase counts from 0
    _assert_known(path, phase, phases)
    return np.where(phase > 0, phase, -1)


def _assert_known(path: Path, phase: Floats | Labels, phases: dict[int, Phase]) -> None:
    unknown = np.setdiff1d(phase, [-1, 0, *phases])
    if len(unknown):
        raise InputError(f"{path} holds phase {unknown[0]:g}, its header names {sorted(phases)}: export it anew")


# ---------------------------------------------------------------------------------------------------- .ctf


def _parts_of_ctf(path: Path, text: str) -> tuple[list[str], list[str], str]:
    """Return the header's lines, the names of the columns, and the table."""
    found = re.search(r"^Phase\t.*$", text[:_LONGEST_HEADER], re.MULTILINE)
    if not text.startswith("Channel Text File") or found is None:
        raise InputError(f"{path} is no channel text file (.ctf) with a table of points: export it anew")
    return text[: found.start()].splitlines(), found.group().strip().split("\t"), text[found.end() :]


def _phases_of_ctf(path: Path, head: Sequence[str]) -> dict[int, Phase]:
    at = next((k for k, line in enumerate(head) if line.startswith("Phases")), None)
    if at is None:
        raise InputError(f"{path} names no phases: export it anew")
    n = int(head[at].split()[-1])
    return {k + 1: _phase_of_ctf(line) for k, line in enumerate(head[at + 1 : at + 1 + n])}


def _phase_of_ctf(line: str) -> Phase:
    """Read ``a;b;c <tab> alpha;beta;gamma <tab> name <tab> Laue group from 1 <tab> ...``."""
    parts = line.split("\t")
    group = int(parts[3])
    return Phase(parts[2].strip(), LAUE_GROUPS[group - 1] if 1 <= group <= len(LAUE_GROUPS) else "-1")
