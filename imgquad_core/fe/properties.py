"""Material values for solver decks, from a small TOML file.

.. code-block:: toml

    ["*"]                      # every material that has no table of its own
    young = 70e9               # Pa, or any consistent unit
    poisson = 0.3

    [quartz]
    young = 95e9
    poisson = 0.08
    conductivity = 7.7         # W/(m K)

    ["quartz:feldspar"]        # a cohesive interface; "*:*" for all of them
    normal_stiffness = 1e14    # Pa/m
    shear_stiffness = 1e14
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
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
Properties = Mapping[str, Mapping[str, float]]


def read_properties(source: str | Path | Mapping[str, Mapping[str, float]]) -> Properties:
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


def values_of(properties: Properties, name: str) -> Mapping[str, float]:
    """Return the values of material `name` on top of those of ``*``; empty if it has none."""
    return {**properties.get("*", {}), **properties.get(name, {})}


def interface_values(properties: Properties, a: str, b: str) -> Mapping[str, float]:
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


def _checked(name: str, table: Any) -> Mapping[str, float]:
    if not isinstance(table, Mapping):
        raise InputError(
            f"material values: '{name} = {table!r}' stands outside a table; write it below a line [material]"
        )
    for key, value in table.items():
        if key not in LIMITS:
            raise InputError(f"material values: [{name}] has an unknown value '{key}'; known: {', '.join(LIMITS)}")
        low, high = LIMITS[key]
        if isinstance(value, bool) or not isinstance(value, int | float) or not low < value < high:
            raise InputError(f"material values: [{name}] {key} = {value!r} must be a number between {low} and {high}")
    return {key: float(value) for key, value in table.items()}
