"""EBSD maps: the phase and the orientation of each point of a regular grid, and the picture that is meshed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Floats, Ints, Labels
from imgquad_core.errors import InputError

from .calibration import Calibration, PixelSize, size_of
from .decoding import assert_pixels
from .grains import euler_angles_of, find_grains, mean_orientations, quaternions_of
from .options import ReadOptions
from .picture import Crystal, Picture

#: grains of fewer points than this are told
SMALL_GRAIN = 5
#: share of a step that a point may lie beside its place on the grid
LOOSE = 0.1


class Phase(NamedTuple):
    """A phase of a map."""

    name: str
    laue: str  #: Laue group, as for `grains.crystal_symmetries`


@dataclass(frozen=True, eq=False)
class CrystalMap:
    """What was measured, on square pixels.

    Parameters
    ----------
    phase : int32, shape (n_rows, n_cols)
        Phase of each pixel, -1 where none was indexed.
    euler : float64, shape (n_rows, n_cols, 3)
        Bunge's Euler angles, radians.
    phases : mapping of int to Phase
        Those that `phase` may hold.
    size : PixelSize, optional
        Size of a pixel.
    notes : tuple of str
        What was found, in words.
    """

    phase: Labels
    euler: Floats
    phases: Mapping[int, Phase]
    size: PixelSize | None = None
    notes: tuple[str, ...] = field(default=())


class Points(NamedTuple):
    """Measured points, in any order."""

    x: Floats
    y: Floats
    phase: Labels  #: below 0: not indexed
    euler: Floats  #: (n, 3), radians


def crystal_picture(path: Path, found: CrystalMap, options: ReadOptions) -> Picture:
    """Return the picture of a map: its phases where there are several, else its grains; `scalars` chooses."""
    if options.scalars not in (None, "phases", "grains"):
        raise InputError(f"scalars is '{options.scalars}', but {path} is an EBSD map: give phases or grains")
    present = np.unique(found.phase[found.phase >= 0]).tolist()
    if not present:
        raise InputError(f"no point of {path} is indexed: index it, or give another map")
    base = _phase_picture(path, found, present)
    if options.scalars == "grains" or (options.scalars is None and len(present) == 1):
        return _grain_picture(found, options.grain_angle, base)
    told = f"{len(present)} phases: {', '.join((base.names or {}).values())}; its grains by scalars grains"
    return replace(base, notes=(*base.notes, told))


def _phase_picture(path: Path, found: CrystalMap, present: list[int]) -> Picture:
    missing = found.phase < 0
    names = {number: found.phases[number].name for number in present}
    notes = found.notes
    if missing.any():
        notes = (*notes, f"{np.count_nonzero(missing)} of {missing.size} points are not indexed: void")
    return Picture(
        found.phase, labels=True, name=str(path), void=missing if missing.any() else None, names=names,
        calibration=Calibration(found.size), notes=notes,
    )  # fmt: skip


def _grain_picture(found: CrystalMap, angle: float, base: Picture) -> Picture:
    laue = {number: phase.laue for number, phase in found.phases.items()}
    turns = quaternions_of(found.euler)
    grains = find_grains(found.phase, turns, laue, angle)
    crystals = crystals_of(grains, found.phase, turns, found.phases)
    small = int(np.count_nonzero(np.bincount(grains[grains > 0])[1:] < SMALL_GRAIN))
    told = f"{len(crystals)} grains, of less than {angle:g} degrees between neighbours (grain-angle)"
    told += f"; {small} have fewer than {SMALL_GRAIN} points: min-pixels {SMALL_GRAIN} removes them" if small else ""
    return replace(base, values=grains, names=grain_names(crystals), notes=(*base.notes, told), crystals=crystals)


def crystals_of(grains: Labels, phase: Labels, turns: Floats, phases: Mapping[int, Phase]) -> dict[int, Crystal]:
    """Return the phase and the mean orientation of each grain.

    Parameters
    ----------
    grains : int32, shape (n_rows, n_cols)
        Grain of each pixel, below 1 for none.
    phase : int32, shape (n_rows, n_cols)
        Phase of each pixel; that of a grain is its first pixel's.
    turns : float64, shape (n_rows, n_cols, 4)
        Orientation of each pixel.
    phases : mapping of int to Phase
        Those of `phase`.
    """
    numbers, first = np.unique(grains, return_index=True)
    numbers_of_phases = phase.ravel()[first].tolist()
    unnamed = Phase("phase", "-1")
    phase_of = {
        grain: phases.get(number, unnamed)
        for grain, number in zip(numbers.tolist(), numbers_of_phases, strict=True)
        if grain > 0
    }
    means = mean_orientations(grains, turns, {grain: found.laue for grain, found in phase_of.items()})
    return {grain: Crystal(phase_of[grain].name, _degrees(mean)) for grain, mean in means.items()}


def _degrees(turn: Floats) -> tuple[float, float, float]:
    first, middle, last = np.degrees(euler_angles_of(turn)).tolist()
    return first, middle, last


def grain_names(crystals: Mapping[int, Crystal]) -> dict[int, str]:
    """Return a name for each grain: its phase and its number."""
    return {grain: f"{crystal.phase}_{grain}" for grain, crystal in crystals.items()}


# --------------------------------------------------------------------------------------------------- grids


def on_pixels(path: Path, points: Points, phases: Mapping[int, Phase], unit: str, options: ReadOptions) -> CrystalMap:
    """Put measured points on square pixels: a pixel a point, or on a hexagonal grid the nearest of its row.

    Notes
    -----
    Rows of a hexagonal grid lie ``sqrt(3) / 2`` steps apart, every second one half a step to the right. Pixels get the
    height of a row, so that every row is one of pixels; a step is then 1.15 pixels wide, and no point is lost::

         o   o   o   o      |o |o| o| o |
           o   o   o   o    | |o |o| o| o|
    """
    assert_pixels(path, len(points.x), 1, options)
    step_x, step_y, row = _steps(path, points)
    shift = _shifts(points.x, row, step_x)
    columns = (points.x - points.x.min()) / step_x - shift[row]
    column = np.rint(columns).astype(np.int64)
    if np.mean(np.abs(columns - column) > LOOSE) > 0.01:
        raise InputError(f"{path} holds points that lie on no regular grid: give a map, not single points")
    n_rows, n_cols = int(row.max()) + 1, int(column.max()) + 1
    assert_pixels(path, n_cols, n_rows, options)
    if n_rows * n_cols > 16 * len(points.x):
        raise InputError(f"{path} holds {len(points.x)} points for a grid of {n_cols} x {n_rows}: give a whole map")
    at = np.full((n_rows, n_cols), -1, np.int64)
    at[row, column] = np.arange(len(points.x))
    notes: tuple[str, ...] = ()
    if shift.any():
        at = _squared(at, shift, step_x / step_y)
        step_x, notes = step_y, ("hexagonal grid: each pixel takes the nearest point of its row",)
    size = size_of(step_x, step_y, unit, "step of the map")
    phase = np.where(at >= 0, points.phase[at], -1).astype(np.int32)
    return CrystalMap(phase, points.euler[at], phases, size, notes)


def _steps(path: Path, points: Points) -> tuple[float, float, Ints]:
    """Return the steps along and between rows, and the row of each point."""
    order = np.lexsort((points.x, points.y))
    x, y = points.x[order], points.y[order]
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise InputError(f"{path} holds points without a place: save it anew")
    along = np.diff(x)[(np.diff(y) == 0) & (np.diff(x) > 0)]
    between = np.diff(np.unique(y))
    if len(along) == 0 and len(between) == 0:
        raise InputError(f"{path} holds a single point: give a map")
    step_x = float(np.median(along)) if len(along) else float(np.median(between))
    step_y = float(np.median(between)) if len(between) else step_x
    rows = (points.y - y[0]) / step_y
    row = np.rint(rows).astype(np.int64)
    if np.mean(np.abs(rows - row) > LOOSE) > 0.01:
        raise InputError(f"{path} holds points that lie on no regular grid: give a map, not single points")
    return step_x, step_y, row


def _shifts(x: Floats, row: Ints, step: float) -> Floats:
    """Return by which part of a step each row starts to the right: 0 or, on a hexagonal grid, one half."""
    parts = ((x - x.min()) / step) % 1.0
    is_half = np.abs(parts - 0.5) < 0.25
    share = np.bincount(row, is_half) / np.maximum(np.bincount(row), 1)
    return np.where(share > 0.5, 0.5, 0.0)


def _squared(at: Ints, shift: Floats, wide: float) -> Ints:
    """Return for each pixel as wide as a row is high which point of its row is nearest; a step is `wide` pixels."""
    n_rows, n_cols = at.shape
    n_pixels = int(np.rint((n_cols + shift.max()) * wide))
    places = (np.arange(n_pixels) + 0.5) / wide - 0.5
    column = np.clip(np.rint(places[None] - shift[:, None]).astype(np.int64), 0, n_cols - 1)
    found = np.take_along_axis(at, column, axis=1)
    if n_cols > 1:  # every second row may be one point shorter
        shorter = (column == n_cols - 1) & (at[:, -1:] < 0)
        found = np.where(shorter, np.take_along_axis(at, np.full((n_rows, 1), n_cols - 2), axis=1), found)
    return found
