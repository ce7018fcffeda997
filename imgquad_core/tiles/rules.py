"""What holds for all parts of a picture, or slices of a stack: legend, limits of noise, width of data points."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from imgquad_core.boundary import ExtractionOptions, as_step, extract_boundaries, find_step
from imgquad_core.model import LabelImage, Materials
from imgquad_core.options import MeshOptions
from imgquad_core.picture import DenoiseOptions, Legend
from imgquad_core.whole_files import replacing


class Rules(NamedTuple):
    """What holds for all parts."""

    legend: Legend
    options: MeshOptions  #: with the limits of noise and the width of data points as numbers

    @property
    def step(self) -> tuple[float, float]:
        """Width and height of data points."""
        assert self.options.step != "auto"
        return as_step(self.options.step)

    @property
    def noise(self) -> DenoiseOptions:
        """Limits of noise, for pixels."""
        return self.options.noise(self.legend.quantised, (1, 1)).scaled(self.step)

    @property
    def extraction(self) -> ExtractionOptions:
        """What is joined over corners."""
        return ExtractionOptions(self.options.policy, self.noise.step)


def rules_of(legend: Legend, image: LabelImage, shape: tuple[int, int], options: MeshOptions) -> Rules:
    """Return what holds for all parts.

    Parameters
    ----------
    legend : Legend
        Of all.
    image : LabelImage
        One part, whose stairs tell the width of data points.
    shape : tuple of int
        (n_rows, n_cols) that the limits of noise are made for.
    options : MeshOptions
        As asked.
    """
    noise = options.noise(legend.quantised, shape)
    if options.step == "auto":
        step = find_step(extract_boundaries(image, ExtractionOptions(options.policy)))
    else:
        step = as_step(options.step)
    return Rules(legend, replace(options, min_pixels=noise.min_pixels, min_length=noise.min_length, step=step))


def save_rules(path: Path, key: str, rules: Rules) -> None:
    """Write rules for what `key` stands for."""
    names = ("min_pixels", "min_length", "step")
    limits = {name: _plain(getattr(rules.options, name)) for name in names}
    found = {"key": key, "limits": limits, "legend": legend_as_json(rules.legend)}
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(found), encoding="utf-8")


def load_rules(path: Path, key: str, options: MeshOptions) -> Rules | None:
    """Return the rules in a file; None if there are none for `key`."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if found["key"] != key:
        return None
    limits = found["limits"] | {"step": tuple(found["limits"]["step"])}
    return Rules(legend_from_json(found["legend"]), replace(options, **limits))


def legend_as_json(legend: Legend) -> dict[str, Any]:
    """Return a legend as values that JSON holds, without loss."""
    found = {field.name: _plain(getattr(legend, field.name)) for field in fields(legend)}
    materials = {name: _plain(getattr(legend.materials, name)) for name in ("labels", "names", "colors")}
    return found | {"materials": materials}


def legend_from_json(found: Mapping[str, Any]) -> Legend:
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
