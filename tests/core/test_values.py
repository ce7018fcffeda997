"""Every value can be pickled and copied, and stays what it was: frozen, its arrays read-only."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, fields, is_dataclass
from multiprocessing import get_context
from typing import Any

import numpy as np
import pytest

from imgquad_core import MeshOptions, mesh_image, run
from imgquad_core.errors import ImgquadError, InputError, QualityError, ScriptError
from imgquad_core.fe import ElementOptions, make_elements
from imgquad_core.frozen import FrozenMapping
from imgquad_core.ledger import material_ledger, region_errors
from imgquad_core.measures.quality import quality_report

LABELS = np.zeros((20, 30), np.int32)
LABELS[5:15, 8:20] = 1
OPTIONS = [
    MeshOptions(size=3),
    MeshOptions(material_sizes={1: 2.0}, drop=["material 0"], colors=[[0, 0, 0], [9, 9, 9]], crop=[0, 0, 5, 5]),
    MeshOptions(colors=np.zeros((2, 3)), drop="material 1"),
    ElementOptions(cohesive="all", periodic="xy"),
]
WAYS: dict[str, Callable[[Any], Any]] = {
    "pickle": lambda value: pickle.loads(pickle.dumps(value)),
    "oldest pickle": lambda value: pickle.loads(pickle.dumps(value, 0)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}


def values() -> list[Any]:
    made = run(LABELS, MeshOptions(size=3, periodic="xy"))
    elements = make_elements(made.mesh, ElementOptions(order=2, cohesive="all", periodic="xy"))
    ledger = material_ledger(made.picture, made.labels, made.boundary, made.mesh, (1.0, 1.0))
    others = (elements, quality_report(made.mesh), region_errors(made.boundary), made.options.segmentation())
    stages = (made.options.smoothing(None), made.options.meshing(None), made.options.noise(True, (9, 9)))
    return [made, made.mesh, made.boundary, made.labels, made.labels.materials, *ledger, *others, *stages, *OPTIONS]


def assert_alike(a: Any, b: Any) -> None:
    assert type(a) is type(b)
    if is_dataclass(a):
        for field in fields(a):
            assert_alike(getattr(a, field.name), getattr(b, field.name))
    elif isinstance(a, np.ndarray):
        assert a.dtype == b.dtype
        assert a.flags.writeable == b.flags.writeable
        assert np.array_equal(a, b)
    elif isinstance(a, dict):
        assert list(a) == list(b)
        for name in a:
            assert_alike(a[name], b[name])
    elif isinstance(a, tuple):
        assert len(a) == len(b)
        for x, y in zip(a, b, strict=True):
            assert_alike(x, y)
    else:
        assert a == b


@pytest.mark.parametrize("way", WAYS)
def test_values_are_copied_whole(way: str) -> None:
    for value in values():
        assert_alike(value, WAYS[way](value))


def test_copies_of_meshes_are_frozen() -> None:
    mesh = pickle.loads(pickle.dumps(mesh_image(LABELS)))
    with pytest.raises(ValueError, match="read-only"):
        mesh.points[0] = 0.0


@pytest.mark.parametrize("options", OPTIONS)
def test_options_are_hashed_and_taken_apart(options: Any) -> None:
    assert hash(options) == hash(copy.deepcopy(options))
    assert options in {options}
    assert asdict(options)


def test_a_frozen_mapping_cannot_be_changed() -> None:
    sizes = MeshOptions(material_sizes={"a": 2.0}).material_sizes
    assert isinstance(sizes, FrozenMapping)
    for change in (
        lambda: sizes.update(b=1),
        lambda: sizes.pop("a"),
        lambda: sizes.clear(),
        lambda: sizes.setdefault("b", 1),
        lambda: sizes.__setitem__("b", 1),
        lambda: sizes.__delitem__("a"),
    ):
        with pytest.raises(TypeError, match="frozen"):
            change()


@pytest.mark.parametrize("error", [InputError("a"), QualityError("b", None, (1,)), ScriptError("c", "f.mlx", 3)])
def test_errors_come_back_from_other_processes(error: ImgquadError) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), vars(again)) == (type(error), str(error), vars(error))


def test_pictures_are_meshed_in_other_processes() -> None:
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        made = list(pool.map(mesh_image, [LABELS] * 2, [MeshOptions(size=3)] * 2))
    alone = mesh_image(LABELS, MeshOptions(size=3))
    for mesh in made:
        assert_alike(mesh, alone)
