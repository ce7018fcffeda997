"""What our filters are: read from ``filters.xml``, MeshLab's own filter description vocabulary (MFI 2.0).

``filters.xml`` names the filters, and tells scripts their parameters: tests hold these against the declarations of the
core's options. The checker of scripts, the methods put on ``pymeshlab.MeshSet`` and the tables in docs/ come from here.
"""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias
from xml.etree.ElementTree import Element

import defusedxml.ElementTree

from imgquad_core.errors import InputError

Value: TypeAlias = bool | int | float | str
#: type in filters.xml -> type in a script; a bounded number (ABSPERC_GUI, SLIDER_GUI) has its own
_SCRIPT_TYPES = {
    "Boolean": "RichBool",
    "Int": "RichInt",
    "Real": "RichFloat",
    "String": "RichString",
    "Enum": "RichEnum",
}
_BOUNDED_TYPES = {"ABSPERC_GUI": "RichAbsPerc", "SLIDER_GUI": "RichDynamicFloat"}
_ENUM = re.compile(r"Enum \{(.*)\}")


def python_name(name: str) -> str:
    """Return the Python name that MeshLab gives to a filter's display name or to a parameter.

    Parameters
    ----------
    name : str
        For example ``Subdivision Surfaces: Loop`` or ``stepSmoothNum``.

    Returns
    -------
    str
        For example ``subdivision_surfaces_loop`` or ``stepsmoothnum``; a Python keyword gets a trailing underscore.
    """
    bare = re.sub(r"[().,'\":+]+", "", re.sub(r"[ /-]", "_", name.lower()))
    return bare + "_" if keyword.iskeyword(bare) else bare


@dataclass(frozen=True)
class Parameter:
    """One parameter of a filter.

    Parameters
    ----------
    name : str
        As in scripts, in MeshLab's camel case: ``maxShift``.
    kind : str
        ``Boolean``, ``Int``, ``Real``, ``String`` or ``Enum``.
    default : bool, int, float or str
        The text of the choice where `kind` is ``Enum``.
    choices : tuple of str
        The values of an ``Enum``, in the order of their numbers.
    low, high : float, optional
        Limits, both included.
    label, help : str
        A few words for a form; what the user must know.
    important : bool
        False for what few users need.
    widget : str
        Element that describes the input field: ``EDIT_GUI``, ``SLIDER_GUI``, …
    """

    name: str
    kind: str
    default: Value
    choices: tuple[str, ...]
    low: float | None
    high: float | None
    label: str
    help: str
    important: bool
    widget: str

    @property
    def python_name(self) -> str:
        """Name in calls of MeshLab's kind: ``maxshift``."""
        return python_name(self.name)

    @property
    def field(self) -> str:
        """Name in our options and, with dashes, on the command line: ``max_shift``."""
        return re.sub(r"(?<=[a-z0-9])([A-Z])", r"_\1", self.name).lower()

    @property
    def script_type(self) -> str:
        """Type in a filter script: ``RichDynamicFloat``."""
        return _BOUNDED_TYPES.get(self.widget, _SCRIPT_TYPES[self.kind])

    def checked(self, value: Any) -> Value:
        """Return `value` in this parameter's type.

        Raises
        ------
        InputError
            When it has another type, is outside the limits or none of the choices.
        """
        if self.kind == "Enum":
            return self._checked_choice(value)
        if self.kind == "Boolean":
            if not isinstance(value, bool):
                raise InputError(f"parameter {self.name} is {value!r}; give true or false")
            return value
        if self.kind == "String":
            if not isinstance(value, str):
                raise InputError(f"parameter {self.name} is {value!r}; give a text")
            return value
        return self._checked_number(value)

    def _checked_choice(self, value: Any) -> str:
        if isinstance(value, int) and not isinstance(value, bool) and 0 <= value < len(self.choices):
            return self.choices[value]
        if value not in self.choices:
            named = ", ".join(f"{n} = {choice}" for n, choice in enumerate(self.choices))
            raise InputError(f"parameter {self.name} is {value!r}; give one of {named}")
        return str(value)

    def _checked_number(self, value: Any) -> float | int:
        whole = self.kind == "Int"
        right = isinstance(value, int if whole else (int, float)) and not isinstance(value, bool)
        if not right or not math.isfinite(value):
            kind = "a whole number" if whole else "a finite number"
            raise InputError(f"parameter {self.name} is {value!r}; give {kind}")
        if (self.low is not None and value < self.low) or (self.high is not None and value > self.high):
            raise InputError(f"parameter {self.name} is {value:g}; give a number from {self.low:g} to {self.high:g}")
        return int(value) if whole else float(value)


@dataclass(frozen=True)
class Filter:
    """One filter of ours.

    Parameters
    ----------
    name : str
        Display name, used in scripts: ``Image to Quad Mesh``.
    function : str
        Python name: ``generate_quad_mesh_from_image``.
    classes : tuple of str
        MeshLab's classes of filters.
    takes_image : bool
        Whether the current picture is its input.
    takes_mesh : bool
        Whether the current mesh is its input.
    help : str
        What it does.
    parameters : tuple of Parameter
        In the order of ``filters.xml``.
    """

    name: str
    function: str
    classes: tuple[str, ...]
    takes_image: bool
    takes_mesh: bool
    help: str
    parameters: tuple[Parameter, ...]

    @cached_property
    def _by_name(self) -> dict[str, Parameter]:
        return {key: p for p in self.parameters for key in (p.name, p.python_name, p.field)}

    def parameter(self, name: str) -> Parameter | None:
        """Return the parameter of this name (``maxShift``, ``maxshift`` or ``max_shift``), or None."""
        return self._by_name.get(name)

    @property
    def defaults(self) -> dict[str, Value]:
        """Default of each parameter, by field name."""
        return {p.field: p.default for p in self.parameters}


def filters_file() -> Path:
    """Return the path of ``filters.xml``: inside the package when installed, at the root of a checkout."""
    here = Path(__file__).resolve().parent
    for path in (here / "filters.xml", here.parents[1] / "filters.xml"):
        if path.is_file():
            return path
    raise InputError(f"filters.xml is neither in {here} nor at the root of the checkout; reinstall imgquad-mesh")


def read_filters(path: Path | str) -> Mapping[str, Filter]:
    """Read a filter description file.

    Parameters
    ----------
    path : path-like
        A file in MeshLab's filter description vocabulary.

    Returns
    -------
    mapping of str to Filter
        By Python name, in the order of the file.
    """
    root = defusedxml.ElementTree.parse(path, forbid_dtd=True).getroot()
    found = [_filter(element) for element in root.iterfind("PLUGIN/FILTER")]
    return MappingProxyType({f.function: f for f in found})


@cache
def filters() -> Mapping[str, Filter]:
    """All our filters by Python name, in the order of ``filters.xml``."""
    return read_filters(filters_file())


def find_filter(name: str) -> Filter | None:
    """Return our filter with this display name or Python name, or None."""
    return next((f for f in filters().values() if name in (f.name, f.function)), None)


def _filter(element: Element) -> Filter:
    return Filter(
        name=element.attrib["filterName"],
        function=element.attrib["filterFunction"],
        classes=tuple(element.attrib["filterClass"].split(" | ")),
        takes_image=element.attrib["filterRasterArity"] == "SingleRaster",
        takes_mesh=element.attrib["filterArity"] == "SingleMesh",
        help=_text(element, "FILTER_HELP"),
        parameters=tuple(_parameter(p) for p in element.iterfind("PARAM")),
    )


def _parameter(element: Element) -> Parameter:
    kind = element.attrib["parType"]
    enum = _ENUM.fullmatch(kind)
    choices = tuple(item.split(":")[0].strip() for item in enum[1].split("|")) if enum else ()
    kind = "Enum" if enum else kind
    gui = next(child for child in element if child.tag.endswith("_GUI"))
    low, high = (float(gui.attrib[key]) if key in gui.attrib else None for key in ("guiMin", "guiMax"))
    return Parameter(
        name=element.attrib["parName"],
        kind=kind,
        default=_default(element.attrib["parDefault"], kind, choices),
        choices=choices,
        low=low,
        high=high,
        label=gui.attrib["guiLabel"],
        help=_text(element, "PARAM_HELP"),
        important=element.attrib["parIsImportant"] == "true",
        widget=gui.tag,
    )


def _default(text: str, kind: str, choices: tuple[str, ...]) -> Value:
    """Evaluate a default: a literal of JavaScript, as the vocabulary has it."""
    if kind == "Boolean":
        return {"true": True, "false": False}[text]
    if kind == "Enum":
        return choices[int(text)]
    if kind == "String":
        return text[1:-1]
    return int(text) if kind == "Int" else float(text)


def _text(element: Element, tag: str) -> str:
    return " ".join((element.findtext(tag) or "").split())
