"""Options that are not plain numbers, as the texts that scripts hold: the same texts as on the command line."""

from __future__ import annotations

import argparse
import csv
import io
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields
from typing import Any, NamedTuple, TypeVar

from imgquad_core.errors import InputError
from imgquad_mesh.cli import fe as elements
from imgquad_mesh.cli import options as command
from imgquad_mesh.spec import Filter, Value

T = TypeVar("T")


class Text(NamedTuple):
    """How an option is read from a text and written as one."""

    read: Callable[[str], Any]
    write: Callable[[Any], str]


def _items(text: str) -> list[str]:
    """Split at commas; an item that holds one stands in double quotes."""
    return [item for item in next(csv.reader([text], skipinitialspace=True), []) if item]


def _joined(items: Iterable[str]) -> str:
    out = io.StringIO()
    csv.writer(out, lineterminator="").writerow(items)
    return out.getvalue()


def _write_colors(value: Any) -> str:
    if isinstance(value, (str, int)):
        return str(value)
    return ",".join("#{:02x}{:02x}{:02x}".format(*map(int, color)) for color in value)


def _sizes(text: str) -> dict[str, float]:
    return dict(command.size_of(item) for item in _items(text))


def _write_sizes(sizes: Mapping[Any, float] | None) -> str:
    return _joined(f"{name}={size!r}" for name, size in (sizes or {}).items())


def _cohesive(text: str) -> str | tuple[tuple[str, str], ...] | None:
    read = [elements.pair(item) for item in _items(text)]
    pairs = tuple(pair for pair in read if not isinstance(pair, str))
    return "all" if "all" in read else pairs or None


def _write_cohesive(pairs: Any) -> str:
    return pairs if isinstance(pairs, str) else _joined(f"{a}:{b}" for a, b in pairs or ())


_LENGTH_OR_AUTO = Text(
    lambda text: None if text == "auto" else command.number(text), lambda v: "auto" if v is None else repr(v)
)

#: by name of the field
TEXTS: Mapping[str, Text] = {
    "colors": Text(command.colors, _write_colors),
    "min_pixels": Text(command.whole_or_auto, str),
    "min_length": Text(command.real_or_auto, lambda v: v if isinstance(v, str) else repr(v)),
    "boundary_size": _LENGTH_OR_AUTO,
    "material_sizes": Text(_sizes, _write_sizes),
    "drop": Text(lambda text: tuple(_items(text)), lambda names: _joined(map(str, names))),
    "frame": Text(lambda text: command.whole(text) if text else None, lambda v: "" if v is None else str(v)),
    "cohesive": Text(_cohesive, _write_cohesive),
    "extrude": Text(lambda text: command.number(text) if text else None, lambda v: "" if v is None else repr(v)),
    "crop": Text(lambda text: command.box(text) if text else None, lambda box: ",".join(map(str, box)) if box else ""),
}


def options_from(kind: type[T], spec: Filter, values: Mapping[str, Any]) -> T:
    """Make a filter's options.

    Parameters
    ----------
    kind : type
        Dataclass of the options.
    spec : Filter
        The filter.
    values : mapping
        Value of each parameter that is given, by field name.

    Raises
    ------
    InputError
        When a text cannot be read, or the options refuse a value.
    """
    given: dict[str, Any] = {}
    for parameter in spec.parameters:
        value = values.get(parameter.field, parameter.default)
        given[parameter.field] = _read(parameter.name, parameter.field, value) if parameter.kind == "String" else value
    return kind(**given)


def _read(name: str, field: str, text: Value) -> Any:
    if field not in TEXTS or not isinstance(text, str):
        return text
    try:
        return TEXTS[field].read(text.strip())
    except (argparse.ArgumentTypeError, ValueError) as error:
        raise InputError(f"parameter {name} is {text!r}: {error}") from error


def values_of(options: Any, spec: Filter) -> dict[str, Value]:
    """Return the values of a filter's parameters, by field name, that give these options in `options_from`."""
    values: dict[str, Value] = {}
    for option in fields(options):
        parameter = spec.parameter(option.name)
        value = getattr(options, option.name)
        if parameter is None:
            raise InputError(f"filter {spec.name!r} has no parameter for the option {option.name}")
        as_text = parameter.kind == "String" and option.name in TEXTS
        values[option.name] = TEXTS[option.name].write(value) if as_text else value
    return values
