"""Material values for solver decks, from a small TOML file.

.. code-block:: toml

    ["*"]                      # every material that has no table of its own
    young = 70e9               # Pa, or any consistent unit
    poisson = 0.3

    [quartz]
    young = 95e9
    poisson = 0.08
    conductivity = 7.7         # W/(m K)

    ["quartz_region_3"]        # one grain, on top of the values of its material
    user_material = [45.0, 10.0, 0.0]         # constants of a material routine of one's own (UMAT, VUMAT)
    depvar = 12                               # its number of state variables
    orientation = [1, 0, 0, 0, 1, 0]          # a point on the first axis, and one in the plane of the first two
    abaqus = ["*PLASTIC", "200e6, 0.0"]       # rows of the .inp below *MATERIAL, as they are

    ["quartz:feldspar"]        # a cohesive interface; "*:*" for all of them
    normal_stiffness = 1e14    # Pa/m
    shear_stiffness = 1e14

`user_material`, `depvar`, `orientation` and `abaqus` are of ``.inp`` files only.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from imgquad_core.errors import InputError

#: name of each value, and the open interval it must lie in
LIMITS: Mapping[str, tuple[float, float]] = {
    "young": (0.0, math.inf),
    "poisson": (-1.0, 0.5),
    "density": (0.0, math.inf),
    "expansion": (-math.inf, math.inf),
    "conductivity": (0.0, math.inf),
    "specific_heat": (0.0, math.inf),
    "normal_stiffness": (0.0, math.inf),
    "shear_stiffness": (0.0, math.inf),
}

#: how many values each list has, at least and at most
LENGTHS: Mapping[str, tuple[int, int]] = {"user_material": (1, 100_000), "orientation": (6, 6)}

#: floats; tuples of floats as `user_material` and `orientation`, the int `depvar`, the text `abaqus`
Values = Mapping[str, Any]
Properties = Mapping[str, Values]


def read_properties(source: str | Path | Mapping[str, Mapping[str, Any]]) -> Properties:
    """Return checked material values.

    Parameters
    ----------
    source : path or mapping
        A TOML file as shown above, or the same as nested mappings.

    Raises
    ------
    InputError
        The file cannot be read, is no TOML, or has an unknown or impossible value.
    """
    tables = source if isinstance(source, Mapping) else _read_toml(Path(source))
    return {name: _checked(name, table) for name, table in tables.items()}


def values_of(properties: Properties, name: str) -> Values:
    """Return the values of material `name` on top of those of ``*``; empty if it has none."""
    return {**properties.get("*", {}), **properties.get(name, {})}


def interface_values(properties: Properties, a: str, b: str) -> Values:
    """Return the values of the interface ``a:b`` or ``b:a`` on top of those of ``*:*``."""
    return {**properties.get("*:*", {}), **properties.get(f"{b}:{a}", {}), **properties.get(f"{a}:{b}", {})}


def _read_toml(path: Path) -> Mapping[str, Any]:
    try:
        with path.open("rb") as stream:
            return tomllib.load(stream)
    except OSError as error:
        raise InputError(f"cannot read the material values {path}: {error.strerror}") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path} is not TOML: {error}; names with other signs than a-z 0-9 _ - need quotes") from error


def _checked(name: str, table: Any) -> Values:
    if not isinstance(table, Mapping):
        raise InputError(
            f"material values: '{name} = {table!r}' stands outside a table; write it below a line [material]"
        )
    return {key: _value(f"[{name}] {key} = {value!r}", name, key, value) for key, value in table.items()}


def _value(said: str, name: str, key: str, value: Any) -> Any:
    if key in LIMITS:
        low, high = LIMITS[key]
        if not (_is_number(value) and low < value < high):
            raise InputError(f"material values: {said} must be a number between {low} and {high}")
        return float(value)
    if key in LENGTHS:
        return _numbers(said, value, *LENGTHS[key])
    if key == "depvar":
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise InputError(f"material values: {said} must be a whole number of state variables, 1 or more")
        return value
    if key == "abaqus":
        return _rows(said, value)
    known = ", ".join([*LIMITS, *LENGTHS, "depvar", "abaqus"])
    raise InputError(f"material values: [{name}] has an unknown value '{key}'; known: {known}")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _numbers(said: str, value: Any, least: int, most: int) -> tuple[float, ...]:
    is_list = isinstance(value, Sequence) and not isinstance(value, str)
    if not (is_list and all(map(_is_number, value)) and all(map(math.isfinite, value)) and least <= len(value) <= most):
        count = f"{least}" if least == most else f"{least} or more"
        raise InputError(f"material values: {said} must be a list of {count} numbers, as [1.0, 0.0, ...]")
    return tuple(map(float, value))


def _rows(said: str, value: Any) -> tuple[str, ...]:
    """Rows of the file; the first one must be a keyword, else it would belong to what stands before."""
    rows = value.splitlines() if isinstance(value, str) else value
    if not isinstance(rows, Sequence) or not all(isinstance(row, str) for row in rows):
        raise InputError(f"material values: {said} must be text, or a list of rows of text")
    kept = tuple(row.rstrip() for row in rows if row.strip())
    if not kept or not kept[0].startswith("*") or any("\n" in row for row in kept):
        raise InputError(f"material values: {said} must be rows of the file, the first one a keyword such as *PLASTIC")
    return kept
