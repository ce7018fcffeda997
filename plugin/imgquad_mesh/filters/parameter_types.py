"""Types of the filters' parameters, for all that have them: what type checkers and editors show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal, TypeAlias

import pyvista as pv
from numpy.typing import ArrayLike

Auto: TypeAlias = Literal["auto"]
Unit: TypeAlias = Literal["pixels", "world"]
Policy: TypeAlias = Literal["minority", "majority", "lower", "diagonal", "junction"]
Periodic: TypeAlias = Literal["none", "x", "y", "xy"]
Triangulator: TypeAlias = Literal["auto", "triangle", "cdt"]
Colors: TypeAlias = "Literal['auto', 'exact', 'regions'] | int | Sequence[Sequence[int]]"
Flatten: TypeAlias = Literal["auto", "off"]
Marks: TypeAlias = "str | Path | ArrayLike | None"
MaterialSizes: TypeAlias = "Mapping[str | int, float] | None"
SizesBetween: TypeAlias = "Mapping[tuple[str | int, str | int], float] | None"
Merge: TypeAlias = "Mapping[tuple[str | int, ...], str] | None"
Rename: TypeAlias = "Mapping[str | int, str] | None"
Recolor: TypeAlias = "Mapping[str | int, pv.ColorLike] | None"
Step: TypeAlias = "Literal['auto'] | float | tuple[float, float]"
Effort: TypeAlias = Literal["fast", "normal", "best"]
