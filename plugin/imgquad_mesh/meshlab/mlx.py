"""MeshLab's filter scripts (``.mlx``): read strictly, with line numbers, and written as MeshLab writes them.

MeshLab and pymeshlab drop a value that they cannot read without a word and run the filter with its default. Here
everything that they would drop is a `ScriptError` with file and line.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, TypeAlias
from xml.sax import SAXException
from xml.sax.handler import ContentHandler
from xml.sax.saxutils import quoteattr

import defusedxml.expatreader
from defusedxml.common import DefusedXmlException

from imgquad_core.errors import ScriptError

#: what a parameter may hold: points and colours as tuples, a matrix as 16 numbers row by row
ScriptValue: TypeAlias = bool | int | float | str | tuple[float, ...] | tuple[int, ...] | None
MAX_BYTES = 10_000_000  #: longest script; the longest useful ones have some ten thousand


@dataclass(frozen=True)
class ScriptParameter:
    """One parameter as the script has it.

    Parameters
    ----------
    name, kind : str
        ``stepSmoothNum``, ``RichInt``.
    value : bool, int, float, str or tuple
        None for a camera (``RichShotf``), which scripts cannot hold.
    line : int
        Where it stands in the script.
    choices : tuple of str
        Texts of the values of a ``RichEnum``.
    low, high : float, optional
        Limits of a ``RichDynamicFloat`` or ``RichAbsPerc``.
    label, tooltip : str
        Written for whoever reads the script; not read.
    """

    name: str
    kind: str
    value: ScriptValue
    line: int = 0
    choices: tuple[str, ...] = ()
    low: float | None = None
    high: float | None = None
    label: str = ""
    tooltip: str = ""


@dataclass(frozen=True)
class ScriptFilter:
    """One filter of a script: its display or Python name, its parameters, its line."""

    name: str
    parameters: tuple[ScriptParameter, ...] = ()
    line: int = 0


@dataclass(frozen=True)
class Script:
    """A filter script: the filters in order, and the file that they were read from."""

    filters: tuple[ScriptFilter, ...]
    file: Path | None = None


def read_script(path: str | Path) -> Script:
    """Read a filter script.

    Parameters
    ----------
    path : path-like
        A script as MeshLab, pymeshlab or `script_text` write it.

    Returns
    -------
    Script
        The filters in order, each value in its type.

    Raises
    ------
    ScriptError
        When the file cannot be read, is no filter script, or holds anything that MeshLab would drop or guess.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise ScriptError(f"cannot be read ({error.strerror}); give the path of a filter script", str(path)) from error
    if len(data) > MAX_BYTES:
        raise ScriptError(f"has more than {MAX_BYTES} bytes; split it into several scripts", str(path))
    if re.search(rb"<!DOCTYPE[^>\[]*\[", data):
        raise ScriptError(
            "declares elements, attributes or entities of its own; a filter script needs none", str(path), 1
        )
    handler = _Handler(str(path))
    parser = defusedxml.expatreader.create_parser(forbid_dtd=False, forbid_entities=True, forbid_external=True)
    parser.setContentHandler(handler)
    parser.setProperty("http://xml.org/sax/properties/lexical-handler", handler)
    try:
        parser.parse(io.BytesIO(data))
    except ScriptError:
        raise
    except DefusedXmlException as error:
        raise ScriptError(f"has entities ({error}); a filter script needs none", str(path), handler.line) from error
    except (SAXException, ValueError, LookupError) as error:
        text = error.getMessage() if isinstance(error, SAXException) else str(error)
        raise ScriptError(f"is not XML: {text}", str(path), handler.line) from error
    if not handler.filters:
        raise ScriptError("has no filter: nothing to run", str(path))
    return Script(tuple(handler.filters), path)


class _Handler(ContentHandler):
    """Takes the elements of a script one after the other; anything out of place is an error with its line."""

    def __init__(self, file: str) -> None:
        super().__init__()
        self.file = file
        self.filters: list[ScriptFilter] = []
        self._open: list[str] = []
        self._locator: Any = None

    @property
    def line(self) -> int:
        return int(self._locator.getLineNumber() or 1) if self._locator else 1

    def fail(self, message: str) -> NoReturn:
        raise ScriptError(message, self.file, self.line)

    def startDTD(self, name: str, public: str | None, system: str | None) -> None:
        if name != "FilterScript" or public or system:
            self.fail(f"has the document type {name!r}; a filter script has <!DOCTYPE FilterScript> and nothing else")

    def endDTD(self) -> None:
        pass

    def comment(self, content: str) -> None:
        pass

    def startCDATA(self) -> None:
        pass

    def endCDATA(self) -> None:
        pass

    def characters(self, content: str) -> None:
        if content.strip():
            self.fail(f"has the text {content.strip()[:40]!r} between elements; values belong into attributes")

    def startElement(self, name: str, attrs: Any) -> None:
        depth = len(self._open)
        self._open.append(name)
        if name in ("xmlfilter", "xmlparam"):
            self.fail(
                f"has <{name}>, the form that meshlabserver took until 2020; write <filter name=…> with <Param …/>"
            )
        if depth > 2 or name != ("FilterScript", "filter", "Param")[depth]:
            self.fail(f"has <{name}> where <{('FilterScript', 'filter', 'Param', 'nothing')[min(depth, 3)]}> belongs")
        if depth == 1:
            self.filters.append(ScriptFilter(self._named(name, attrs), (), self.line))
        elif depth == 2:
            self._add_parameter(attrs)

    def endElement(self, name: str) -> None:
        self._open.pop()

    def _named(self, element: str, attrs: Any) -> str:
        name = str(attrs.get("name", "")).strip()
        if not name:
            self.fail(f"has a <{element}> without a name")
        return name

    def _add_parameter(self, attrs: Any) -> None:
        last = self.filters[-1]
        name = self._named("Param", attrs)
        if any(p.name == name for p in last.parameters):
            self.fail(f"filter {last.name!r} has the parameter {name!r} twice")
        parameter = _read_parameter(name, dict(attrs.items()), self)
        self.filters[-1] = ScriptFilter(last.name, (*last.parameters, parameter), last.line)


def _read_parameter(name: str, attrs: Mapping[str, str], at: _Handler) -> ScriptParameter:
    kind = attrs.get("type")
    if kind is None:
        at.fail(f"parameter {name!r} has no type; give one of {', '.join(_READERS)}")
    if kind not in _READERS:
        at.fail(f"parameter {name!r} has the unknown type {kind!r}; use one of {', '.join(_READERS)}")
    try:
        value = _READERS[kind](attrs)
        choices = _choices(attrs, int(value)) if kind == "RichEnum" and isinstance(value, int) else ()
        bounded = kind in ("RichAbsPerc", "RichDynamicFloat")
        low, high = (_number(attrs, "min"), _number(attrs, "max")) if bounded else (None, None)
    except ValueError as error:
        at.fail(f"parameter {name!r} ({kind}): {error}")
    if kind == "RichDynamicFloat" and isinstance(value, float) and not _at_most(low, value, high):
        at.fail(f"parameter {name!r} is {value:g}, outside [{low:g}, {high:g}]; MeshLab would clamp it without a word")
    return ScriptParameter(name, kind, value, at.line, choices, low, high)


def _at_most(low: float | None, value: float, high: float | None) -> bool:
    return low is not None and high is not None and low <= value <= high


def _given(attrs: Mapping[str, str], key: str) -> str:
    if key not in attrs:
        raise ValueError(f"attribute {key!r} is missing")
    return attrs[key]


def _number(attrs: Mapping[str, str], key: str) -> float:
    text = _given(attrs, key)
    try:
        value = float(text)
    except ValueError:
        raise ValueError(f"{key} is {text!r}; give a number") from None
    if not math.isfinite(value):
        raise ValueError(f"{key} is {text!r}; give a finite number")
    return value


def _whole(attrs: Mapping[str, str], key: str = "value", low: int = -(2**31), high: int = 2**31 - 1) -> int:
    text = _given(attrs, key)
    if not re.fullmatch(r"\s*[+-]?[0-9]{1,18}\s*", text):
        raise ValueError(f"{key} is {text!r}; give a whole number")
    if not low <= int(text) <= high:
        raise ValueError(f"{key} is {text}; give a whole number from {low} to {high}")
    return int(text)


def _bool(attrs: Mapping[str, str]) -> bool:
    text = _given(attrs, "value")
    if text not in ("true", "false"):
        raise ValueError(f"value is {text!r}; give true or false")
    return text == "true"


def _choices(attrs: Mapping[str, str], value: int) -> tuple[str, ...]:
    n = _whole(attrs, "enum_cardinality", 1, 10_000)
    texts = tuple(_given(attrs, f"enum_val{i}") for i in range(n))
    if not 0 <= value < n:
        raise ValueError(
            f"value is {value}; give 0 to {n - 1}: " + ", ".join(f"{i} = {t}" for i, t in enumerate(texts))
        )
    return texts


def _open_file(attrs: Mapping[str, str]) -> str:
    _whole(attrs, "exts_cardinality", 0, 10_000)
    return _text(attrs)


def _text(attrs: Mapping[str, str]) -> str:
    text = _given(attrs, "value")
    if "\0" in text:
        raise ValueError("value holds a zero byte")
    return text


def _point(attrs: Mapping[str, str]) -> tuple[float, ...]:
    return tuple(_number(attrs, key) for key in "xyz")


def _matrix(attrs: Mapping[str, str]) -> tuple[float, ...]:
    return tuple(_number(attrs, f"val{i}") for i in range(16))


def _color(attrs: Mapping[str, str]) -> tuple[int, ...]:
    return tuple(_whole(attrs, key, 0, 255) for key in "rgba")


_READERS: Mapping[str, Callable[[Mapping[str, str]], ScriptValue]] = {
    "RichBool": _bool,
    "RichInt": _whole,
    "RichFloat": lambda attrs: _number(attrs, "value"),
    "RichString": _text,
    "RichAbsPerc": lambda attrs: _number(attrs, "value"),
    "RichDynamicFloat": lambda attrs: _number(attrs, "value"),
    "RichEnum": _whole,
    "RichColor": _color,
    "RichPosition": _point,
    "RichDirection": _point,
    "RichPoint3f": _point,
    "RichMatrix44f": _matrix,
    "RichMesh": lambda attrs: _whole(attrs, low=0),
    "RichOpenFile": _open_file,
    "RichSaveFile": _text,
    "RichShotf": lambda attrs: None,
}


def script_text(script: Script) -> str:
    """Return a script in MeshLab's own form: one space a level, no XML declaration."""
    lines = ["<!DOCTYPE FilterScript>", "<FilterScript>"]
    for each in script.filters:
        if not each.parameters:
            lines.append(f" <filter name={quoteattr(each.name)}/>")
            continue
        lines.append(f" <filter name={quoteattr(each.name)}>")
        lines += [f"  <Param {_attributes(p)}/>" for p in each.parameters]
        lines.append(" </filter>")
    return "\n".join([*lines, "</FilterScript>", ""])


def _attributes(parameter: ScriptParameter) -> str:
    attrs = {"type": parameter.kind, "name": parameter.name} | _value_attributes(parameter)
    if parameter.low is not None and parameter.high is not None:
        attrs |= {"min": repr(parameter.low), "max": repr(parameter.high)}
    if parameter.choices:
        attrs |= {"enum_cardinality": str(len(parameter.choices))}
        attrs |= {f"enum_val{i}": text for i, text in enumerate(parameter.choices)}
    attrs |= {"RichOpenFile": {"exts_cardinality": "0"}, "RichSaveFile": {"ext": ""}}.get(parameter.kind, {})
    attrs |= {key: text for key, text in (("description", parameter.label), ("tooltip", parameter.tooltip)) if text}
    return " ".join(f"{key}={quoteattr(text)}" for key, text in attrs.items())


def _value_attributes(parameter: ScriptParameter) -> dict[str, str]:
    value = parameter.value
    if value is None:
        return {}
    if isinstance(value, tuple):
        keys = {3: "xyz", 4: "rgba"}.get(len(value)) or [f"val{i}" for i in range(16)]
        return dict(zip(keys, map(repr, value), strict=True))
    if isinstance(value, bool):
        return {"value": "true" if value else "false"}
    return {"value": value if isinstance(value, str) else repr(value)}
