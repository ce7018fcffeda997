"""Parameters of filters, refused the way PyVista refuses them: by its own validation, within declared limits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from numbers import Number
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
import pyvista_validation

import imgquad_core as core
from imgquad_mesh.progress import DOING, progress_bar_if

_validation: Any = pyvista_validation  # its overloads are too many for type checkers
UNITS = ("pixels", "world")


def checked(**values: Any) -> dict[str, Any]:
    """Return the values of parameters in plain Python types, by name.

    Raises
    ------
    TypeError
        A value has another type than it should.
    ValueError
        It is outside the limits or none of the choices. Limits that hang on the picture are the core's to check.
    """
    return {name: _value(name, value) for name, value in values.items()}


def _value(name: str, value: Any) -> Any:
    if name in _OWN:
        return _OWN[name](value, name)
    declared = _declared()[name]
    if declared.choices:
        return choice(value, name, declared.choices)
    if declared.kind is bool:
        return _flag(value, name)
    return _number(value, name, declared.kind is int, _limits(declared))


@cache
def _declared() -> Mapping[str, core.declared.Declaration]:
    return core.declared.declarations(core.boundary.SmoothingOptions) | core.declared.declarations(core.MeshOptions)


def _limits(declared: core.declared.Declaration) -> tuple[float, float] | None:
    return None if declared.least is None or declared.most is None else (declared.least, declared.most)


def _number(value: Any, name: str, whole: bool = False, limits: tuple[float, float] | None = None) -> Any:
    if not isinstance(value, (Number, np.ndarray)):  # what NumPy says of these does not name the parameter
        raise TypeError(f"{name} must be a number. Got {type(value)} instead.")
    made = _validation.validate_number(
        value, must_be_finite=True, must_be_real=True, must_be_integer=whole, must_be_in_range=limits, name=name
    )
    return int(made) if whole else float(made)


def _length(value: Any, name: str) -> float:
    length = float(_number(value, name))
    _validation.check_greater_than(length, 0.0, name=name)
    return length


def _length_or_none(value: Any, name: str) -> float | None:
    return None if value is None else _length(value, name)


def _flag(value: Any, name: str) -> bool:
    _validation.check_instance(value, bool, name=name)
    return bool(value)


def choice(value: Any, name: str, choices: Iterable[Any]) -> Any:
    """Return a value that is one of the choices."""
    if not isinstance(value, (str, int)) or isinstance(value, bool):  # an array is equal to none and many
        raise TypeError(f"{name} must be one of {list(choices)}. Got {type(value)} instead.")
    _validation.check_contains(list(choices), must_contain=value, name=name)
    return value


def _limit_of_noise(value: Any, name: str) -> Any:
    if isinstance(value, str):
        return choice(value, name, ["auto"])
    made = _number(value, name, whole=name == "min_pixels")
    _validation.check_nonnegative(made, name=name)
    return made


def _colors(value: Any, name: str) -> Any:
    if isinstance(value, str):
        return choice(value, name, ("auto", "exact", "regions"))
    if isinstance(value, Iterable):
        palette = _validation.validate_array(
            value, must_have_shape=(-1, 3), must_be_in_range=(0, 255), must_be_finite=True, name=name
        )
        return [tuple(map(int, color)) for color in palette]
    return _number(value, name, whole=True, limits=(1, 256))


def _marks(value: Any, name: str) -> Any:
    return value if value is None or isinstance(value, (str, Path)) else _validation.validate_array(value, name=name)


def _sizes(value: Any, name: str) -> dict[str | int, float]:
    return {_material(key, name): _length(size, f"{name}[{key!r}]") for key, size in _mapping(value, name).items()}


def _sizes_between(value: Any, name: str) -> dict[tuple[str | int, str | int], float]:
    return {_pair(key, name): _length(size, f"{name}[{key!r}]") for key, size in _mapping(value, name).items()}


def _merges(value: Any, name: str) -> dict[tuple[str | int, ...], str]:
    return {
        tuple(_material(each, name) for each in _tuple(key, f"{name}: materials")): _name(new, f"{name}[{key!r}]")
        for key, new in _mapping(value, name).items()
    }


def _new_names(value: Any, name: str) -> dict[str | int, str]:
    return {_material(key, name): _name(new, f"{name}[{key!r}]") for key, new in _mapping(value, name).items()}


def _new_colors(value: Any, name: str) -> dict[str | int, tuple[int, ...]]:
    return {_material(key, name): _rgb(color, f"{name}[{key!r}]") for key, color in _mapping(value, name).items()}


def _rgb(value: Any, name: str) -> tuple[int, ...]:
    try:
        return tuple(pv.Color(value).int_rgb)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} is {value!r}, which is no colour; give a name, '#rrggbb' or R, G, B") from error


def _mapping(value: Any, name: str) -> Mapping[Any, Any]:
    if value is None:
        return {}
    _validation.check_instance(value, Mapping, name=name)
    return dict(value)


def _tuple(value: Any, name: str) -> tuple[Any, ...]:
    _validation.check_instance(value, tuple, name=name)
    return tuple(value)


def _name(value: Any, name: str) -> str:
    _validation.check_instance(value, str, name=name)
    return str(value)


def _pair(value: Any, name: str) -> tuple[str | int, str | int]:
    _validation.check_instance(value, tuple, name=f"{name}: two materials")
    _validation.check_length(value, exact_length=2, name=f"{name}: two materials")
    return _material(value[0], name), _material(value[1], name)


def _step(value: Any, name: str) -> Any:
    if isinstance(value, str):
        return choice(value, name, ["auto"])
    sides = list(value) if isinstance(value, (tuple, list)) else [value, value]
    _validation.check_length(sides, exact_length=2, name=name)
    return tuple(_number(side, name, limits=(1.0, 1000.0)) for side in sides)


def _length_or_nothing(value: Any, name: str) -> float:
    length = float(_number(value, name))
    _validation.check_nonnegative(length, name=name)
    return length


def _materials(value: Any, name: str) -> tuple[str | int, ...]:
    return tuple(_material(each, name) for each in _several(value, name))


def _names(value: Any, name: str) -> tuple[str, ...]:
    several = _several(value, name)
    _validation.check_iterable_items(several, str, name=name)
    return tuple(several)


def _several(value: Any, name: str) -> list[Any]:
    if isinstance(value, str):
        return [value]
    _validation.check_iterable(value, name=name)
    return list(value)


def _material(value: Any, name: str) -> str | int:
    return value if isinstance(value, str) else int(_number(value, f"{name}: a material", whole=True))


#: parameters that are no plain numbers, choices or flags in filters.xml, or not in it
_OWN: Mapping[str, Callable[[Any, str], Any]] = {
    "size": _length,
    "boundary_size": _length_or_none,
    "frame_size": _length_or_none,
    "material_sizes": _sizes,
    "sizes_between": _sizes_between,
    "step": _step,
    "tolerance": _length_or_nothing,
    "join": lambda value, name: None if value is None else _length_or_nothing(value, name),
    "keep": _materials,
    "colors": _colors,
    "marks": _marks,
    "no_data": lambda value, name: None if value is None else _number(value, name),
    "merge": _merges,
    "rename": _new_names,
    "recolor": _new_colors,
    "min_pixels": _limit_of_noise,
    "min_length": _limit_of_noise,
    "drop": _materials,
    "materials": _materials,
    "sample": _names,
    "progress_bar": _flag,
    "unit": lambda value, name: choice(value, name, UNITS),
}


@contextmanager
def progress_of(wanted: bool) -> Iterator[Callable[[str], None]]:
    """Give a function to call with the name of each stage that starts."""
    pyvista_validation.check_instance(wanted, bool, name="progress_bar")
    stages = list(DOING)
    with progress_bar_if(wanted) as show:
        yield lambda stage: show(stage, stages.index(stage), len(stages))
