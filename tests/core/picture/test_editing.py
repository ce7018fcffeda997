"""Materials merged, renamed, given other colours."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from imgquad_core import LabelImage, Materials, MeshOptions, mesh_image, run
from imgquad_core.errors import InputError
from imgquad_core.model import VOID
from imgquad_core.picture import (
    EditOptions,
    area_shares,
    edit_materials,
    merge_materials,
    recolor_materials,
    rename_materials,
)

MATERIALS = Materials(
    np.array([1, 3, 4, 9]),
    ("quartz", "mica", "clay", "pore"),
    np.array([[9, 9, 9], [80, 0, 0], [0, 80, 0], [0, 0, 80]]),
)
IMAGE = LabelImage(np.array([[1, 3, 4, 9], [1, 1, VOID, 3]]), MATERIALS)


def test_merged_materials_take_number_and_colour_of_the_first() -> None:
    made = merge_materials(IMAGE, {("mica", "quartz"): "hard"})
    assert made.labels.tolist() == [[3, 3, 4, 9], [3, 3, VOID, 3]]
    assert made.materials.labels.tolist() == [3, 4, 9]
    assert made.materials.names == ("hard", "clay", "pore")
    assert made.materials.colors[0].tolist() == [80, 0, 0]
    assert IMAGE.labels[0, 0] == 1, "the picture itself is as it was"


def test_merged_materials_take_number_and_colour_of_the_one_that_has_the_name() -> None:
    made = merge_materials(IMAGE, {("mica", "quartz", 9): "quartz"})
    assert made.labels.tolist() == [[1, 1, 4, 1], [1, 1, VOID, 1]]
    assert made.materials.names == ("quartz", "clay")


def test_a_later_merge_may_name_what_an_earlier_one_made() -> None:
    made = merge_materials(IMAGE, {("quartz", "mica"): "hard", ("hard", "clay"): "rock"})
    assert made.materials.names == ("rock", "pore")
    assert set(made.labels.ravel().tolist()) == {1, 9, VOID}


def test_crystals_of_merged_grains_stay_where_they_are_alike() -> None:
    euler = np.array([[1, 2, 3], [1, 2, 3], [4, 5, 6], [7, 8, 9]], float)
    grains = Materials(MATERIALS.labels, MATERIALS.names, MATERIALS.colors, ("Fe", "Fe", "Fe", "Ni"), euler)
    alike = merge_materials(LabelImage(IMAGE.labels, grains), {("quartz", "mica"): "a"}).materials
    assert alike.phases == ("Fe", "Fe", "Ni")
    assert alike.orientations is not None
    assert alike.orientations[0].tolist() == [1, 2, 3]
    other = merge_materials(LabelImage(IMAGE.labels, grains), {("quartz", "clay", "pore"): "b"}).materials
    assert other.phases == ("", "Fe")
    assert other.orientations is not None
    assert np.isnan(other.orientations[0]).all()
    assert other.orientations[1].tolist() == [1, 2, 3]


def test_names_may_change_places() -> None:
    made = rename_materials(IMAGE, {"quartz": "mica", "mica": "quartz", 9: "hole"})
    assert made.materials.names == ("mica", "quartz", "clay", "hole")
    assert made.labels is IMAGE.labels or np.array_equal(made.labels, IMAGE.labels)


def test_colours_are_those_given() -> None:
    made = recolor_materials(IMAGE, {"clay": (1, 2, 3), 9: [255, 0, 255]})
    assert made.materials.colors.tolist() == [[9, 9, 9], [80, 0, 0], [1, 2, 3], [255, 0, 255]]


def test_edits_follow_each_other() -> None:
    options = EditOptions({("quartz", "mica"): "hard"}, {"hard": "rock"}, {"rock": (5, 6, 7)})
    made = edit_materials(IMAGE, options).materials
    assert made.names[0] == "rock"
    assert made.colors[0].tolist() == [5, 6, 7]
    assert edit_materials(IMAGE, EditOptions()) is IMAGE


def test_shares_are_of_the_whole_picture() -> None:
    assert area_shares(IMAGE) == {1: 3 / 8, 3: 2 / 8, 4: 1 / 8, 9: 1 / 8}


@pytest.mark.parametrize(
    ("edits", "said"),
    [
        ({"merge": {("quartz", "gold"): "x"}}, "gold"),
        ({"merge": {("quartz", 1): "x"}}, "one material"),
        ({"merge": {("quartz", "mica"): "clay"}}, "cannot be called 'clay', as material 4 is"),
        ({"merge": {"quartz": "x"}}, "merge is"),
        ({"merge": {("quartz", "mica"): ""}}, "merge is"),
        ({"merge": [1]}, "merge is"),
        ({"rename": {"quartz": "mica"}}, "cannot be called 'mica', as material 3 is"),
        ({"rename": {"quartz": "a", "mica": "a"}}, "cannot be called 'a'"),
        ({"rename": {"quartz": "a=b"}}, "rename is"),
        ({"rename": {"quartz": " a"}}, "rename is"),
        ({"rename": {"quartz": "a\nb"}}, "rename is"),
        ({"rename": {"gold": "a"}}, "gold"),
        ({"rename": {True: "a"}}, "rename is"),
        ({"recolor": {"quartz": "red"}}, "recolor is"),
        ({"recolor": {"quartz": (1, 2)}}, "recolor is"),
        ({"recolor": {"quartz": (1, 2, 300)}}, "recolor is"),
        ({"recolor": {"gold": (1, 2, 3)}}, "gold"),
    ],
)
def test_edits_that_mean_nothing_are_refused_by_name(edits: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as caught:
        mesh_image(IMAGE, MeshOptions(**edits))
    assert said in str(caught.value)


def test_a_mesh_of_merged_materials_has_no_boundary_between_them() -> None:
    labels = np.zeros((24, 36), np.int32)
    labels[:, 12:], labels[:, 24:] = 1, 2
    options = MeshOptions(merge={(0, 1): "both"}, rename={"2": "right"}, recolor={"right": (1, 2, 3)}, drop=())
    made = run(labels, options)
    assert made.mesh.materials.names == ("both", "right")
    assert len(made.boundary.region_label) == 2
    assert made.mesh.materials.colors[1].tolist() == [1, 2, 3]
    areas = {row: (made.mesh.quad_material == row).sum() for row in (0, 2)}
    assert areas[0] == pytest.approx(2 * areas[2], rel=0.1)


def test_later_options_call_materials_by_their_new_names() -> None:
    labels = np.zeros((24, 36), np.int32)
    labels[:, 12:], labels[:, 24:] = 1, 2
    options = MeshOptions(merge={(0, 1): "both"}, rename={2: "right"}, drop=("both",), material_sizes={"right": 2.0})
    assert set(mesh_image(labels, options).quad_material.tolist()) == {2}
