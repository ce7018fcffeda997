"""Options as texts, read and written: the same on the command line and in scripts."""

from __future__ import annotations

import argparse
import csv
import io
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields
from typing import Any, NamedTuple, TypeVar

from imgquad_core.declared import Declaration
from imgquad_core.errors import InputError

from .spec import Filter, Value

T = TypeVar("T")


class Text(NamedTuple):
    """How an option is read from a text and written as one."""

    read: Callable[[str], Any]
    write: Callable[[Any], str]
    form: str  #: of the text, as the command's help shows it
    script: str = ""  #: how scripts write it: a sentence for filters.xml
    flag: str = ""  #: on the command, where it is repeatable: name of the option,
    item: Callable[[str], Any] | None = None  #: what one of it reads,
    gather: Callable[[list[Any]], Any] = tuple  #: and the option that all of them make


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
    return dict(size_of(item) for item in _items(text))


def _write_sizes(sizes: Mapping[Any, float] | None) -> str:
    return _joined(f"{name}={size!r}" for name, size in (sizes or {}).items())


def _sizes_between(text: str) -> dict[tuple[str, str], float]:
    return dict(size_between(item) for item in _items(text))


def _write_sizes_between(sizes: Mapping[Any, float] | None) -> str:
    return _joined(f"{_joined(map(str, pair))}={size!r}" for pair, size in (sizes or {}).items())


def _merges(text: str) -> dict[tuple[str, ...], str]:
    return dict(merge(item) for item in _items(text))


def _write_merges(merges: Mapping[Any, str] | None) -> str:
    return _joined(f"{_joined(map(str, names))}={name}" for names, name in (merges or {}).items())


def _renames(text: str) -> dict[str, str]:
    return dict(rename(item) for item in _items(text))


def _recolors(text: str) -> dict[str, tuple[int, int, int]]:
    return dict(recolor(item) for item in _items(text))


def _write_names(names: Mapping[Any, str] | None) -> str:
    return _joined(f"{each}={name}" for each, name in (names or {}).items())


def _write_recolors(colors: Mapping[Any, Any] | None) -> str:
    return _joined(f"{name}={_write_colors([color])}" for name, color in (colors or {}).items())


def _cohesive(text: str) -> str | tuple[tuple[str, str], ...] | None:
    return _gathered_pairs([pair(item) for item in _items(text)])


def _gathered_pairs(read: list[str | tuple[str, str]]) -> str | tuple[tuple[str, str], ...] | None:
    pairs = tuple(pair for pair in read if not isinstance(pair, str))
    return "all" if "all" in read else pairs or None


def _write_cohesive(pairs: Any) -> str:
    return pairs if isinstance(pairs, str) else _joined(f"{a}:{b}" for a, b in pairs or ())


def _write_numbers(value: str | float | tuple[float, float]) -> str:
    if isinstance(value, str):
        return value
    return ",".join(repr(float(part)).removesuffix(".0") for part in (value if isinstance(value, tuple) else (value,)))


def point(text: str) -> str | tuple[float, float]:
    """Return what --origin asks for."""
    if text in ("auto", "file"):
        return text
    x, comma, y = text.partition(",")
    if not comma:
        raise argparse.ArgumentTypeError(f"'{text}' is neither X,Y nor auto nor file")
    return number(x), number(y)


def sides(text: str) -> str | float | tuple[float, float]:
    """Return what --pixel-size asks for."""
    if text == "auto" or text.partition(":")[0] == "file":
        return text
    width, comma, height = text.partition(",")
    return (number(width), number(height)) if comma else number(width)


def colors(text: str) -> str | int | list[tuple[int, int, int]]:
    """Return what --colors asks for."""
    if text in ("auto", "exact", "regions"):
        return text
    if text.isdigit():
        return int(text)
    parts = [part.strip() for part in text.split(",")]
    if not all(map(_is_color, parts)):
        raise argparse.ArgumentTypeError(f"'{text}' is none of: auto, exact, regions, a number, '#rrggbb,#rrggbb,...'")
    return [_rgb(part) for part in parts]


def _is_color(text: str) -> bool:
    return bool(re.fullmatch("#[0-9a-fA-F]{6}", text))


def _rgb(text: str) -> tuple[int, int, int]:
    return int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16)


def merge(text: str) -> tuple[tuple[str, ...], str]:
    """Return what --merge asks for."""
    materials, _, name = text.rpartition("=")
    merged = _items(materials)
    if len(merged) < 2 or not name:
        raise argparse.ArgumentTypeError(f"'{text}' is not A,B=NAME, as in quartz,feldspar=hard")
    return tuple(merged), name


def rename(text: str) -> tuple[str, str]:
    """Return what --rename asks for."""
    material, _, name = text.rpartition("=")
    if not material or not name:
        raise argparse.ArgumentTypeError(f"'{text}' is not MATERIAL=NAME, as in grey_87=quartz")
    return material, name


def recolor(text: str) -> tuple[str, tuple[int, int, int]]:
    """Return what --recolor asks for."""
    material, _, color = text.rpartition("=")
    if not material or not _is_color(color):
        raise argparse.ArgumentTypeError(f"'{text}' is not MATERIAL=#rrggbb, as in 'quartz=#ff8000'")
    return material, _rgb(color)


def box(text: str) -> tuple[int, int, int, int]:
    """Return what --crop asks for."""
    if not re.fullmatch(r"-?\d+(,-?\d+){3}", text):
        raise argparse.ArgumentTypeError(f"'{text}' is not X0,Y0,X1,Y1 in whole pixels")
    left, upper, right, lower = map(int, text.split(","))
    return left, upper, right, lower


def size_of(text: str) -> tuple[str, float]:
    """Return what --size-of asks for."""
    material, _, size = text.rpartition("=")
    if not material:
        raise argparse.ArgumentTypeError(f"'{text}' is not MATERIAL=S, as in quartz=2")
    return material, number(size)


def size_between(text: str) -> tuple[tuple[str, str], float]:
    """Return what --size-between asks for."""
    materials, _, size = text.rpartition("=")
    pair = _items(materials)
    if len(pair) != 2:
        raise argparse.ArgumentTypeError(f"'{text}' is not A,B=S, as in quartz,feldspar=2")
    return (pair[0], pair[1]), number(size)


def step(text: str) -> str | float | tuple[float, float]:
    """Return what --step asks for."""
    return text if text == "auto" else sides(text)


def whole_or_auto(text: str) -> int | str:
    """Return 'auto' or a whole number."""
    return text if text == "auto" else whole(text)


def real_or_auto(text: str) -> float | str:
    """Return 'auto' or a number."""
    return text if text == "auto" else number(text)


def whole(text: str) -> int:
    """Return a whole number, 0 or more."""
    if not text.isdigit():
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number")
    return int(text)


def number(text: str) -> float:
    """Return a number."""
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number") from None


def pair(text: str) -> str | tuple[str, str]:
    """Return what --cohesive asks for."""
    if text == "all":
        return text
    a, colon, b = text.partition(":")
    if not (a and colon and b):
        raise argparse.ArgumentTypeError(f"'{text}' is neither all nor A:B, as in quartz:feldspar")
    return a, b


def _none_or(read: Callable[[str], Any], none: str) -> Callable[[str], Any]:
    return lambda text: None if text == none else read(text)


def _write_or(write: Callable[[Any], str], none: str) -> Callable[[Any], str]:
    return lambda value: none if value is None else write(value)


_QUOTED = "a name that holds a comma stands in double quotes"
#: by name of the field: options that are no plain number, flag or choice
TEXTS: Mapping[str, Text] = {
    "colors": Text(
        colors, _write_colors, "auto|exact|regions|N|#rrggbb,#rrggbb", "A palette is written '#rrggbb,#rrggbb'."
    ),
    "marks": Text(_none_or(str, ""), _write_or(str, ""), "FILE", "Empty: none."),
    "merge": Text(
        _merges,
        _write_merges,
        "A,B=NAME",
        'Each in double quotes: "quartz,feldspar=hard","1,7=soft".',
        "merge",
        merge,
        dict,
    ),
    "rename": Text(
        _renames,
        _write_names,
        "MATERIAL=NAME",
        f"Written grey_87=quartz,7=mica; {_QUOTED} with its new name.",
        "rename",
        rename,
        dict,
    ),
    "recolor": Text(
        _recolors,
        _write_recolors,
        "MATERIAL=#rrggbb",
        f"Written quartz=#ff8000,7=#0000ff; {_QUOTED} with its colour.",
        "recolor",
        recolor,
        dict,
    ),
    "min_pixels": Text(whole_or_auto, str, "auto|N"),
    "min_length": Text(real_or_auto, lambda v: v if isinstance(v, str) else repr(v), "auto|LENGTH"),
    "boundary_size": Text(_none_or(number, "auto"), _write_or(repr, "auto"), "LENGTH", "auto: as inside."),
    "frame_size": Text(_none_or(number, "auto"), _write_or(repr, "auto"), "LENGTH", "auto: as inside."),
    "join": Text(
        _none_or(number, "auto"), _write_or(repr, "auto"), "LENGTH", "auto: two data points, or the tolerance."
    ),
    "step": Text(step, lambda v: v if isinstance(v, str) else _write_numbers(v), "auto|K|KX,KY", "Written 4, or 3,2."),
    "sizes_between": Text(
        _sizes_between,
        _write_sizes_between,
        "A,B=LENGTH",
        'Each in double quotes: "quartz,feldspar=2","1,7=1".',
        "size-between",
        size_between,
        dict,
    ),
    "keep": Text(
        lambda text: tuple(_items(text)),
        lambda names: _joined(map(str, names)),
        "MATERIAL",
        f"Separated by commas; {_QUOTED}.",
        "keep",
        str,
    ),
    "material_sizes": Text(
        _sizes,
        _write_sizes,
        "MATERIAL=LENGTH",
        f"Written quartz=2,7=1; {_QUOTED} with its size.",
        "size-of",
        size_of,
        dict,
    ),
    "pixel_size": Text(sides, _write_numbers, "LENGTH|WIDTH,HEIGHT|file[:UNIT]", "Written 0.5, or 0.5,0.7."),
    "origin": Text(point, _write_numbers, "X,Y|file", "Written 500000,4600000."),
    "drop": Text(
        lambda text: tuple(_items(text)),
        lambda names: _joined(map(str, names)),
        "MATERIAL",
        f"Separated by commas; {_QUOTED}.",
        "drop",
        str,
    ),
    "no_data": Text(_none_or(number, ""), _write_or(_write_numbers, ""), "VALUE", "Empty: none."),
    "frame": Text(_none_or(whole, ""), _write_or(str, ""), "N", "Empty: there is one only."),
    "channel": Text(_none_or(whole, ""), _write_or(str, ""), "N", "Empty: there is one only."),
    "scalars": Text(_none_or(str, ""), _write_or(str, ""), "NAME", "Empty: the one that is most likely meant."),
    "cohesive": Text(
        _cohesive,
        _write_cohesive,
        "A:B|all",
        "Written quartz:pyrite,quartz:mica. Empty: none.",
        "cohesive",
        pair,
        _gathered_pairs,
    ),
    "extrude": Text(_none_or(number, ""), _write_or(repr, ""), "THICKNESS", "Empty: the mesh stays flat."),
    "crop": Text(
        _none_or(box, ""),
        _write_or(lambda box: ",".join(map(str, box)), ""),
        "X0,Y0,X1,Y1",
        "Written X0,Y0,X1,Y1. Empty: all of it.",
    ),
}


def flag_of(name: str) -> str:
    """Return the option of the command for a field."""
    named = TEXTS[name].flag if name in TEXTS else ""
    return f"--{named or name.replace('_', '-')}"


def words_of(name: str, value: Any) -> list[str]:
    """Return the words by which the command says the value of a field."""
    if value is True:
        return [flag_of(name)]
    text = TEXTS[name].write(value) if name in TEXTS else str(value)
    each = _items(text) if name in TEXTS and TEXTS[name].item else [text]
    return [word for item in each for word in (flag_of(name), item)]


def help_in_scripts(name: str, declaration: Declaration) -> str:
    """Return what filters.xml says of an option."""
    how = TEXTS[name].script if name in TEXTS else ""
    return f"{declaration.text} {how}".rstrip()


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
        given[parameter.field] = (
            read_text(parameter.field, value, parameter.name) if parameter.kind == "String" else value
        )
    return kind(**given)


def read_text(field: str, text: Value, name: str = "") -> Any:
    """Return the value of a field that a text says; `name` is what to call the field in errors."""
    if field not in TEXTS or not isinstance(text, str):
        return text
    try:
        return TEXTS[field].read(text.strip())
    except (argparse.ArgumentTypeError, ValueError) as error:
        raise InputError(f"parameter {name or field} is {text!r}: {error}") from error


def values_of(options: Any, spec: Filter) -> dict[str, Value]:
    """Return the values of a filter's parameters, by field name, that give these options in `options_from`."""
    values: dict[str, Value] = {}
    for option in fields(options):
        if option.metadata.get("internal"):
            continue
        parameter = spec.parameter(option.name)
        value = getattr(options, option.name)
        if parameter is None:
            raise InputError(f"filter {spec.name!r} has no parameter for the option {option.name}")
        as_text = parameter.kind == "String" and option.name in TEXTS
        values[option.name] = TEXTS[option.name].write(value) if as_text else value
    return values
