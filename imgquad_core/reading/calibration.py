"""How large the pixels of a picture are and where it lies, as its file says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite
from numbers import Real
from typing import Any, TypeAlias

from imgquad_core.declared import LARGEST
from imgquad_core.errors import InputError

Box = tuple[int, int, int, int]
#: what may be asked for as a pixel size
Size: TypeAlias = "float | tuple[float, float] | str"

#: metres in a unit of length; the first name of each is the one that is told
METRES: Mapping[str, float] = {
    "pm": 1e-12, "angstrom": 1e-10, "nm": 1e-9, "um": 1e-6, "mm": 1e-3, "cm": 1e-2, "dm": 1e-1, "m": 1.0, "km": 1e3,
    "inch": 0.0254, "ft": 0.3048, "us-ft": 1200 / 3937,
}  # fmt: skip
_NAMES: Mapping[str, str] = {
    "a": "angstrom", "å": "angstrom", "Å": "angstrom", "angstroms": "angstrom", "nanometer": "nm", "nanometers": "nm",
    "nanometre": "nm", "µm": "um", "μm": "um", "micron": "um", "microns": "um", "micrometer": "um", "micrometers": "um",
    "micrometre": "um", "millimeter": "mm", "millimeters": "mm", "millimetre": "mm", "centimeter": "cm",
    "centimetre": "cm", "meter": "m", "meters": "m", "metre": "m", "kilometer": "km", "in": "inch", "foot": "ft",
    "picometer": "pm", "\\u00b5m": "um",
}  # fmt: skip
#: relative difference of the two sides below which a pixel counts as square
SQUARE = 1e-3
#: a printing density is told where it means smaller pixels than this, m: then it may come from a microscope
TELLING = 10e-6


def unit_name(text: str) -> str | None:
    """Return the name of a unit of length in `METRES`, however it is spelt; None for what is no length."""
    text = text.strip().strip("\0")
    name = _NAMES.get(text, _NAMES.get(text.lower(), text if text in METRES else text.lower()))
    return name if name in METRES else None


@dataclass(frozen=True)
class PixelSize:
    """What a file says about the size of its pixels.

    Parameters
    ----------
    x, y : float
        Width and height of a pixel.
    unit : str
        Unit of length, one of `METRES`; empty for that of a map without a named one.
    source : str
        What says so, in words: the tag, the header's entry.
    doubt : str
        Why it is not to be trusted; empty if it is.
    """

    x: float
    y: float
    unit: str
    source: str
    doubt: str = ""

    @property
    def is_square(self) -> bool:
        """Whether both sides are equal."""
        return abs(self.x - self.y) <= SQUARE * max(self.x, self.y)

    @property
    def sides(self) -> float | tuple[float, float]:
        """The side of a square pixel, else width and height."""
        return self.x if self.is_square else (self.x, self.y)

    @property
    def text(self) -> str:
        """The size in words, such as ``0.8863 um``."""
        sides = f"{self.x:.6g}" if self.is_square else f"{self.x:.6g} x {self.y:.6g}"
        return f"{sides} {self.unit}".strip()

    def scaled(self, factor: float) -> PixelSize:
        """Return the size of pixels that are `factor` times as wide and high."""
        return replace(self, x=self.x * factor, y=self.y * factor)


def size_of(x: float, y: float, unit: str, source: str, doubt: str = "") -> PixelSize | None:
    """Return a size if it is one: both sides finite and above 0 and the unit a length (or none); else None."""
    name = unit_name(unit) if unit else ""
    if name is None or not (isfinite(x) and isfinite(y) and x > 0.0 and y > 0.0):
        return None
    return PixelSize(float(x), float(y), name, source, doubt)


def printing_density(x: float, y: float, unit: str, source: str) -> PixelSize | None:
    """Tell dots an inch or a centimetre where they are finer than printers are, and that they may be of printing."""
    size = size_of(1.0 / x, 1.0 / y, unit, source, "a resolution tag alone is a printing density")
    return in_handy_unit(size) if size and METRES[size.unit] * size.x < TELLING else None


def in_handy_unit(size: PixelSize) -> PixelSize:
    """Return a size with the unit, of nm, um, mm and m, in which it is between 1 and 1000 where one does that."""
    metres = size.x * METRES[size.unit]
    unit = next((name for name in ("m", "mm", "um") if metres >= METRES[name] * (1.0 - 1e-9)), "nm")
    return replace(size, x=metres / METRES[unit], y=size.y * METRES[size.unit] / METRES[unit], unit=unit)


@dataclass(frozen=True)
class Calibration:
    """Pixel size and place of a picture, as far as its file knows them.

    Parameters
    ----------
    size : PixelSize, optional
        Size of a pixel.
    origin : tuple of float, optional
        x and y of the picture's lower left corner, in the unit of `size`.
    crs : str
        Coordinate reference system of `origin`, such as ``EPSG:32633``.
    placed : bool
        Whether the file is a map: its mesh lies on the map if nothing else is asked for.
    """

    size: PixelSize | None = None
    origin: tuple[float, float] | None = None
    crs: str = ""
    placed: bool = False

    def cropped(self, box: Box, n_rows: int) -> Calibration:
        """Return that of the part within `box` (left, upper, right, lower) of a picture of `n_rows` rows."""
        if self.origin is None or self.size is None:
            return self
        left, _, _, lower = box
        x, y = self.origin
        return replace(self, origin=(x + left * self.size.x, y + (n_rows - lower) * self.size.y))

    def coarsened(self, factor: float) -> Calibration:
        """Return that of a picture of the same place whose pixels are `factor` times as large."""
        return replace(self, size=self.size.scaled(factor)) if self.size else self


def assert_placement(size: Size, origin: tuple[float, float] | str) -> None:
    """Raise `InputError` unless a pixel size and an origin are what `asked_placement` takes."""
    if isinstance(size, str):
        word, colon, unit = size.partition(":")
        if word not in ("auto", "file") or (colon and (word == "auto" or unit_name(unit) is None)):
            raise InputError(f"pixel_size is '{size}'; give a length, auto, file, or file:UNIT as in file:mm")
    elif not all(_is_number(side) and 1 / LARGEST <= side <= LARGEST for side in _parts(size)):
        raise InputError(f"pixel_size is {size!r}; give a length above 0, or a width and a height")
    if isinstance(origin, str):
        if origin not in ("auto", "file"):
            raise InputError(f"origin is '{origin}'; give two numbers, auto or file")
    elif not (_is_pair(origin) and all(map(_is_number, origin))):
        raise InputError(f"origin is {origin!r}; give two numbers")


def _is_pair(value: Any) -> bool:
    return isinstance(value, (tuple, list)) and len(value) == 2


def _parts(size: Any) -> tuple[Any, ...]:
    return tuple(size) if _is_pair(size) else (size,)


def _is_number(value: Any) -> bool:
    return type(value) is not bool and isinstance(value, Real) and isfinite(value)


def asked_placement(
    size: Size, origin: tuple[float, float] | str, found: Calibration, name: str
) -> tuple[float | tuple[float, float], tuple[float, float]]:
    """Return the pixel size and the place of the lower left corner that were asked for.

    Parameters
    ----------
    size : float, (float, float) or str
        A number, or two; "file" or "file:UNIT": what the file says, in its own unit or in another; "auto": that of a
        map, else 1.
    origin : tuple of float or str
        Two numbers; "file": what the file says; "auto": that of a map whose pixel size is taken, too, else 0, 0.
    found : Calibration
        What the file says.
    name : str
        What to call the picture.

    Raises
    ------
    InputError
        "file", where the file says nothing, or nothing that can be trusted.
    """
    sides, factor = _sides(size, found, name)
    if not isinstance(origin, str):
        return sides, (float(origin[0]), float(origin[1]))
    if found.origin is None or (origin == "auto" and not (found.placed and isinstance(size, str))):
        if origin == "file":
            raise InputError(f"{name} says nothing of its place: give origin two numbers")
        return sides, (0.0, 0.0)
    return sides, (found.origin[0] * factor, found.origin[1] * factor)


def _sides(asked: Size, found: Calibration, name: str) -> tuple[float | tuple[float, float], float]:
    """Return the sides of a pixel, and what lengths of the file are multiplied by."""
    if not isinstance(asked, str):
        return asked, 1.0
    if asked == "auto":
        return (found.size.sides if found.placed and found.size else 1.0), 1.0
    size, unit = _trusted(found.size, name), asked.partition(":")[2]
    if not unit:
        return size.sides, 1.0
    if not size.unit:
        raise InputError(f"{name} names no unit of its pixel size {size.text}: give pixel-size file, or a number")
    factor = METRES[size.unit] / METRES[unit_name(unit) or size.unit]
    return size.scaled(factor).sides, factor


def _trusted(size: PixelSize | None, name: str) -> PixelSize:
    if size is None:
        raise InputError(f"{name} says nothing of its pixel size: give pixel-size a number")
    if size.doubt:
        raise InputError(f"{name} says {size.text} a pixel by {size.source}, but {size.doubt}: give a number")
    return size


def size_note(found: Calibration, asked: Size) -> str | None:
    """Say what the file says of the size and the place, and how to take it; None where it says nothing."""
    size = found.size
    if size is None:
        return None
    where = f", lower left corner at {found.origin[0]:.10g}, {found.origin[1]:.10g}" if found.origin else ""
    where += f" ({found.crs})" if found.crs else ""
    told = f"the file says {size.text} a pixel by {size.source}{where}"
    if size.doubt:
        return f"{told}; not taken: {size.doubt}"
    is_taken = isinstance(asked, str) and (asked != "auto" or found.placed)
    return f"{told}; taken" if is_taken else f"{told}: pixel-size file takes it"
