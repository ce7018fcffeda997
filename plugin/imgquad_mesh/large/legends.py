"""Legends in files: what values mean which materials, so that a run that goes on decides nothing anew."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from imgquad_core.model import Materials
from imgquad_core.picture import Legend


def legend_as_json(legend: Legend) -> dict[str, Any]:
    """Return a legend as values that JSON holds, without loss."""
    found = {field.name: _plain(getattr(legend, field.name)) for field in fields(legend)}
    materials = {name: _plain(getattr(legend.materials, name)) for name in ("labels", "names", "colors")}
    return found | {"materials": materials}


def legend_from_json(found: dict[str, Any]) -> Legend:
    """Return the legend that `legend_as_json` was given."""
    made = {name: _array(value) for name, value in found.items()}
    made["materials"] = Materials(**{name: _array(value) for name, value in found["materials"].items()})
    return Legend(**made | {"warnings": tuple(found["warnings"])})


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return {"dtype": value.dtype.str, "shape": list(value.shape), "values": value.ravel().tolist()}
    return value.item() if isinstance(value, np.generic) else value


def _array(value: Any) -> Any:
    if isinstance(value, dict) and "dtype" in value:
        return np.array(value["values"], value["dtype"]).reshape(value["shape"])
    return value
