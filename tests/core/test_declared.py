"""What is declared of an option, and what is refused by it."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass, fields
from inspect import getdoc
from typing import Any

import numpy as np
import pytest

from imgquad_core import MeshOptions
from imgquad_core.boundary import ExtractionOptions, SmoothingOptions
from imgquad_core.cleanup import OptimizationOptions
from imgquad_core.cleanup.optimization import CLEAN_UPS
from imgquad_core.declared import check, declarations, option, same_as
from imgquad_core.errors import InputError
from imgquad_core.fe import ElementOptions
from imgquad_core.mesher import EFFORTS, MeshingOptions
from imgquad_core.picture import DenoiseOptions, SegmentationOptions
from imgquad_core.reading import ReadOptions

OPTIONS = (
    MeshOptions,
    ReadOptions,
    SegmentationOptions,
    DenoiseOptions,
    ExtractionOptions,
    SmoothingOptions,
    MeshingOptions,
    OptimizationOptions,
    ElementOptions,
)
#: fields that users do not set one by one
INNER = {"periodic", "open_interfaces", "mark_interfaces"}


@dataclass(frozen=True)
class Shoe:
    size: float = option(42.0, "length of the shoe", what="a length", least=15, most=60, unit="cm")
    laces: int = option(2, "number of laces", least=0)
    kind: str = option("boot", "what kind of shoe it is", choices=("boot", "clog"))
    width: float | None = option(None, "width of the shoe", kind=float, above=0, told="as usual")
    heel: float | str = option("flat", "height of the heel", kind=float, least=0, word="flat")
    prices: Any = option(None, "price in each shop", kind=float, least=0, each="price in {}")
    waterproof: bool = option(False, "keep water out")

    def __post_init__(self) -> None:
        check(self)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"size": 14.9}, "size is 14.9; give a length from 15 to 60 cm"),
        ({"size": "42"}, "size is '42'; give a length from 15 to 60 cm"),
        ({"size": None}, "size is None; give a length from 15 to 60 cm"),
        ({"size": True}, "size is True; give a length"),
        ({"size": float("nan")}, "size is nan; give a length"),
        ({"laces": -1}, "laces is -1; give a whole number of at least 0"),
        ({"laces": 1.5}, "laces is 1.5; give a whole number"),
        ({"laces": float("inf")}, "laces is inf; give a whole number"),
        ({"kind": "sock"}, "kind is 'sock'; give one of boot, clog"),
        ({"kind": None}, "kind is None; give one of boot, clog"),
        ({"width": 0}, "width is 0; give a number above 0"),
        ({"heel": "high"}, "heel is 'high'; give flat, or a number of at least 0"),
        ({"prices": {"Bonn": -1}}, "price in Bonn is -1; give a number of at least 0"),
        ({"prices": 3}, "prices is 3; give a mapping to a number of at least 0"),
        ({"waterproof": 1}, "waterproof is 1; give true or false"),
    ],
)
def test_values_outside_what_is_declared_are_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as caught:
        Shoe(**given)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "given",
    [
        {"size": 15},
        {"size": np.float32(60)},
        {"laces": np.int64(3)},
        {"laces": 2.0},
        {"width": None},
        {"heel": "flat"},
        {"heel": 3},
        {"prices": {"Bonn": 50, 3: 0}},
    ],
)
def test_values_within_are_taken(given: dict[str, Any]) -> None:
    Shoe(**given)


def test_an_option_taken_over_keeps_what_is_not_changed() -> None:
    @dataclass(frozen=True)
    class Sandal:
        size: float = same_as(Shoe, "size", default=40.0)

    old, new = declarations(Shoe)["size"], declarations(Sandal)["size"]
    assert Sandal().size == 40.0
    assert (new.help, new.least, new.most, new.unit) == (old.help, old.least, old.most, old.unit)


@pytest.mark.parametrize("options", OPTIONS)
def test_every_option_is_declared(options: type) -> None:
    declared = declarations(options)
    assert {f.name for f in fields(options) if not f.metadata.get("internal")} - set(declared) <= INNER
    for name, declaration in declared.items():
        assert declaration.help[0].islower() or declaration.help[0].isdigit()
        assert not declaration.help.endswith(".")
        assert f"\n{name} : " in (getdoc(options) or ""), f"{name} is not in the docstring of {options.__name__}"
        declaration.check(name, declaration.default)


@pytest.mark.parametrize("options", OPTIONS[1:-2])
def test_what_mesh_options_take_over_is_as_the_stage_says(options: type) -> None:
    whole = declarations(MeshOptions)
    for name, declaration in declarations(options).items():
        if name in whole:
            limits = (declaration.kind, declaration.least, declaration.most, declaration.choices, declaration.topic)
            taken = whole[name]
            assert (taken.kind, taken.least, taken.most, taken.choices, taken.topic) == limits, name
            if not taken.word and name not in ("material_sizes", "sizes_between"):
                assert taken.default == declaration.default


def test_efforts_are_those_declared() -> None:
    assert tuple(EFFORTS) == tuple(CLEAN_UPS) == declarations(MeshingOptions)["effort"].choices


def test_options_are_there_without_numpy() -> None:
    heavy = "numpy", "numba", "scipy", "skimage", "pyvista"
    code = "import sys; from imgquad_core import MeshOptions;"
    code += f"print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
