"""How pictures are segmented, edited and freed of noise; how they are read: `imgquad_core.reading.options`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import sqrt
from numbers import Integral, Real
from typing import Any

from imgquad_core.declared import POLICY, Declaration, check, option
from imgquad_core.errors import InputError
from imgquad_core.frozen import FrozenMapping

_NUMBER = Declaration(0, "", int, least=1, most=256)  # of colours


@dataclass(frozen=True)
class SegmentationOptions:
    """How colours become materials.

    Parameters
    ----------
    colors : "auto", "exact", "regions", int or sequence of RGB
        "auto": label pictures, told by their pixels, keep a material for each value; raw pictures are divided in
        classes that are far apart. "exact": one material per distinct value or colour. "regions": one material per
        connected region of one colour (grain maps). A number: divided in that many classes. A palette (RGB, 0 to
        255): each pixel takes the nearest colour of it.
    flatten : "auto" or "off"
        Whether uneven light is taken out of grey pictures where that separates the classes better.
    marks : path, Picture or array_like, optional
        Pixels whose material is known, from which materials grow; see `imgquad_core.picture.marks.marks_of`.
    learn : bool
        Whether what looks like the marks for sure is a mark, too (needs scikit-learn).
    no_data : float, optional
        Number that stands for nothing where the file does not say so (-9999, 255): its pixels are void.
    fill_void : int
        Void clusters (not indexed, NaN, masked, nodata, -1) of at most so many pixels go to the material with the
        longest common border. 0: void stays void, and is not meshed.
    drop_transparent : bool
        Whether pixels of alpha 0 become `VOID`.
    """

    colors: str | int | Sequence[Sequence[int]] = option(
        "auto",
        "how colours become materials: each its own (exact), each connected region of one colour (regions), divided in "
        "a number of classes, the nearest colour of a palette, or auto: each its own in label pictures, which are told "
        "by their pixels, else as many classes as are far apart; the report states which",
        kind=object,
        topic="picture",
    )
    flatten: str = option(
        "auto",
        "take uneven light out of grey pictures, where that separates the classes better",
        choices=("auto", "off"),
        topic="picture",
    )
    marks: Any = option(
        None,
        "picture of strokes, of the same size, from which materials grow: palette index 0 and clear pixels are not "
        "marked, each other colour is a material",
        topic="picture",
    )
    learn: bool = option(
        False, "let a random forest learn from the marks what else is marked for sure (scikit-learn)", topic="picture"
    )
    no_data: float | None = option(
        None,
        "number of pixels that hold nothing, where the file does not say so (-9999, 255): they are void",
        what="a number",
        topic="picture",
    )
    fill_void: int = option(
        0,
        "void clusters (not indexed, NaN, masked, nodata, -1) of at most so many pixels go to the material with the "
        "longest common border; 0: void stays void, and is not meshed",
        what="a whole number of pixels",
        least=0,
        topic="picture",
    )
    drop_transparent: bool = option(
        False, "leave out pixels of alpha 0: they are not meshed, and their boundary is free", topic="picture"
    )

    def __post_init__(self) -> None:
        check(self)
        _check_colors(self.colors)
        _check_no_data(self.no_data)
        if self.marks is not None and self.colors != "auto":
            raise InputError(f"colors is {self.colors}, but marks name the materials: give one of them")
        if self.learn and self.marks is None:
            raise InputError("learn is on, but there are no marks to learn from: give marks")


def _check_no_data(given: Any) -> None:
    if given is not None and (isinstance(given, bool) or not isinstance(given, Real)):
        raise InputError(f"no_data is {given!r}; give a number")


def _check_colors(colors: Any) -> None:
    if isinstance(colors, str):
        if colors not in ("auto", "exact", "regions"):
            raise InputError(f"colors is '{colors}': give auto, exact, regions, a number of colours or a list of RGB")
    elif isinstance(colors, Integral):
        if not _NUMBER.allows(colors):
            raise InputError(f"colors is {colors}: give a number of colours from 1 to 256")
    elif not _is_palette(colors):
        raise InputError(f"colors is {colors}: give a palette as rows of R, G, B from 0 to 255")


def _is_palette(colors: Any) -> bool:
    try:
        rows = [[float(level) for level in color] for color in colors]
    except (TypeError, ValueError):
        return False
    return bool(rows) and all(len(row) == 3 and all(0 <= level <= 255 for level in row) for row in rows)


@dataclass(frozen=True)
class EditOptions:
    """What the user makes of the materials that were found: merged first, then renamed, then given other colours.

    Parameters
    ----------
    merge : mapping of (str or int, ...) to str
        Names or numbers of materials that become one, and its name.
    rename : mapping of (str or int) to str
        New names.
    recolor : mapping of (str or int) to RGB
        New colours, 0 to 255.
    """

    merge: Mapping[tuple[str | int, ...], str] = option(
        FrozenMapping(), "materials that become one, by names or numbers, and its name", topic="picture"
    )
    rename: Mapping[str | int, str] = option(
        FrozenMapping(), "another name of a material, given by name or number, after merging", topic="picture"
    )
    recolor: Mapping[str | int, Sequence[int]] = option(
        FrozenMapping(), "another colour of a material, given by name or number, after renaming", topic="picture"
    )

    def __post_init__(self) -> None:
        check(self)
        for name, is_right, wanted in _EDITS:
            given = getattr(self, name)
            if not isinstance(given, Mapping) or not all(map(is_right, given.items())):
                raise InputError(f"{name} is {given!r}; give {wanted}")
            made = {key: tuple(map(int, value)) if name == "recolor" else value for key, value in given.items()}
            object.__setattr__(self, name, FrozenMapping(made))


def _is_material(given: Any) -> bool:
    return isinstance(given, (str, Integral)) and not isinstance(given, bool)


def _is_name(given: Any) -> bool:
    """Tell whether a name can be said on a command line and in a script, too."""
    return isinstance(given, str) and given.isprintable() and given == given.strip() != "" and "=" not in given


def _is_merge(item: tuple[Any, Any]) -> bool:
    return isinstance(item[0], tuple) and all(map(_is_material, item[0])) and _is_name(item[1])


def _is_rename(item: tuple[Any, Any]) -> bool:
    return _is_material(item[0]) and _is_name(item[1])


def _is_recolor(item: tuple[Any, Any]) -> bool:
    return _is_material(item[0]) and not isinstance(item[1], str) and _is_palette([item[1]])


_EDITS = (
    ("merge", _is_merge, "a mapping of tuples of materials to a name, as {('quartz', 'mica'): 'hard'}"),
    ("rename", _is_rename, "a mapping of materials to names, as {'grey_87': 'quartz'}"),
    ("recolor", _is_recolor, "a mapping of materials to R, G, B from 0 to 255, as {'quartz': (255, 128, 0)}"),
)


@dataclass(frozen=True)
class DenoiseOptions:
    """What counts as noise.

    Parameters
    ----------
    min_pixels : int
        Clusters of this many pixels or more stay. 0 or 1: nothing is removed.
    min_length : float
        Clusters of this characteristic length or more stay, in pixels. 0: nothing is removed.
    policy : {"minority", "majority", "lower", "diagonal", "junction"}
        What is connected over an ambiguous corner of four pixels: the same as in `ExtractionOptions`.
    step : float
        Width of the picture's data points in pixels, for that.
    """

    min_pixels: int = option(
        0,
        "clusters of this many pixels or more stay; 0: nothing is removed",
        what="a whole number of pixels",
        least=0,
        topic="noise",
    )
    min_length: float = option(
        0.0,
        "clusters of this characteristic length (the longest way inside, also of bent ones) or more stay, in pixels; "
        "0: nothing is removed",
        what="a length",
        least=0.0,
        unit="px",
        topic="noise",
    )
    policy: str = POLICY.field()
    step: float = field(default=1.0, metadata={"internal": True})  # seen in the picture: no filter has it

    def __post_init__(self) -> None:
        check(self)

    def scaled(self, step: tuple[float, float]) -> DenoiseOptions:
        """Return the same limits in pixels where they count data points of that width and height."""
        area = step[0] * step[1]
        return replace(
            self,
            min_pixels=round(self.min_pixels * area),
            min_length=self.min_length * sqrt(area),
            step=0.5 * sum(step),
        )

    @property
    def removes(self) -> bool:
        """Whether any cluster can be noise: a single pixel has the length 1."""
        return self.min_pixels > 1 and self.min_length > 1


@dataclass(frozen=True)
class AbsorbOptions:
    """What is absorbed.

    Parameters
    ----------
    tolerance : float
        Parts of a region that are thinner, and regions below its square, go to their neighbours; in pixels.
    keep : sequence of int
        Materials whose pixels are never given away.
    policy : str
        What is connected over an ambiguous corner of four pixels: the same as in `ExtractionOptions`.
    step : float
        Width of the picture's data points in pixels, for that.
    """

    tolerance: float = option(
        0.0,
        "parts of the picture that are thinner go to their neighbours, boundaries shorter than it are joined, and "
        "outlines smoothed over half of it, in pixels; 0: the picture is taken at its word",
        what="a length",
        least=0.0,
        unit="px",
        topic="boundaries",
    )
    keep: tuple[int, ...] = option(
        (), "materials that the tolerance takes nothing from, by name or number", topic="boundaries"
    )
    policy: str = POLICY.field()
    step: float = field(default=1.0, metadata={"internal": True})  # seen in the picture: no filter has it

    def __post_init__(self) -> None:
        check(self)
        if 0.0 < self.tolerance < 1.0:
            raise InputError(f"tolerance is {self.tolerance:g}; give 0, or a length of at least 1 px")
