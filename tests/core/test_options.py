"""Options of the wrong kind or size: one `InputError` that names the option and the value, before any work."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from imgquad_core import MeshOptions, mesh_image
from imgquad_core.boundary import SmoothingOptions
from imgquad_core.errors import InputError
from imgquad_core.fe import ElementOptions, make_elements
from imgquad_core.measures.quality import require_quality
from imgquad_core.mesher import MeshingOptions

LABELS = np.zeros((12, 16), np.int32)
LABELS[4:9, 5:11] = 1
REALS = ("size", "boundary_size", "growth", "edge_ratio", "max_shift", "pixel_size", "min_length")
WRONG: list[tuple[str, Any]] = [
    *((name, value) for name in REALS for value in ("4", math.nan, math.inf, -1.0, 1e308, [1], True, 1j)),
    *((name, None) for name in ("size", "growth", "edge_ratio", "max_shift", "pixel_size", "threads", "max_pixels")),
    *((name, 0) for name in ("size", "boundary_size", "pixel_size", "max_pixels")),
    *((name, v) for name in ("threads", "max_pixels", "frame") for v in (2.5, "2", -1, True, math.nan)),
    *(("crop", value) for value in ((0, 0, 10.5, 10), (1, 2, 3), "abcd", 5, (0, 0, 0, 0), (0, 0, 99, 9), (5, 5, 2, 9))),
    *(("drop", value) for value in (1.5, [None], [1.5], object())),
    *(("drop", value) for value in ("nothing", [7], [""])),
    *(("colors", value) for value in (["a"], 0, 257, 2.5, None, "many", [[1, 2]], [[1, 2, 300]], [])),
    *(("material_sizes", value) for value in ([1, 2], "a", {1: "2"}, {1: math.nan}, {1: 0}, {"nothing": 2.0})),
    *((name, v) for name in ("effort", "policy", "periodic") for v in ("x y", 1, None, ["fast"])),
    *(("min_pixels", value) for value in (-1, 2.5, "few", math.nan, None)),
]


@pytest.mark.parametrize(("name", "value"), WRONG, ids=lambda v: str(v)[:20])
def test_a_wrong_option_is_one_input_error(name: str, value: Any) -> None:
    with pytest.raises(InputError) as caught:
        mesh_image(LABELS, MeshOptions(**{name: value}))
    said = str(caught.value)
    assert "\n" not in said
    assert name in said or name.replace("material_sizes", "material") in said or name == "drop"


@pytest.mark.parametrize("options", [SmoothingOptions, MeshingOptions])
@pytest.mark.parametrize("value", ["4", None, math.nan, 0.0, 1e308])
def test_stages_check_their_own_options(options: Any, value: Any) -> None:
    with pytest.raises(InputError, match="size"):
        options(size=value)


def test_sizes_of_materials_are_named_as_the_user_does() -> None:
    with pytest.raises(InputError, match="size of material quartz is nan"):
        MeshOptions(material_sizes={"clay": 2.0, "quartz": math.nan})


def test_one_material_to_drop_may_stand_alone() -> None:
    assert MeshOptions(drop="material 1").drop == ("material 1",)
    assert mesh_image(LABELS, MeshOptions(drop=1)).n_quads == mesh_image(LABELS, MeshOptions(drop=[1])).n_quads


def test_options_that_are_none_and_pictures_that_are_no_arrays() -> None:
    with pytest.raises(InputError, match="MeshOptions"):
        mesh_image(LABELS, {"size": 3})  # type: ignore[arg-type]
    with pytest.raises(InputError, match="rows of one length"):
        mesh_image([[1, 2], [3]])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "values",
    [{"frame": 1}, {"channel": 0}, {"level": 1}, {"scalars": "a"}, {"info_bar": "crop"}, {"grain_angle": 9.0}],
)
def test_what_only_files_have_is_refused_of_arrays(values: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=f"{next(iter(values))} is .*, which is of files"):
        mesh_image(LABELS, MeshOptions(**values))


@pytest.mark.parametrize(
    "values", [{"layers": 3}, {"nodes": 9}, {"order": 2, "nodes": 7}, {"extrude": 1.0, "layers": 0}]
)
def test_elements_that_an_option_cannot_be_of_are_refused(values: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"layers|nodes"):
        ElementOptions(**values)


def test_a_periodic_cell_whose_sides_never_face_each_other_is_refused() -> None:
    labels = np.zeros((6, 12), np.int32)
    labels[0, 1:4] = labels[5, 7:10] = labels[1:5, 3:8] = 1
    mesh = mesh_image(labels, MeshOptions(size=2.0, periodic="y", drop=(0,)))
    with pytest.raises(InputError, match="nothing can be tied"):
        make_elements(mesh, ElementOptions(periodic="y"))


def test_a_quality_that_is_no_number_is_refused() -> None:
    with pytest.raises(InputError, match="min_quality"):
        require_quality(mesh_image(LABELS), math.nan)
