"""Sets of a quad mesh: complete, disjoint where they must be, named once."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.errors import InputError
from imgquad_core.fe.cohesive import split_interfaces
from imgquad_core.fe.extrusion import extrude
from imgquad_core.fe.femesh import KINDS, FEMesh, Names
from imgquad_core.fe.sets import fe_mesh, without_interfaces
from imgquad_core.model import VOID
from support.handmade import disk, jiggle, staircase

THREE = np.array([[0, 0, 1, 1], [0, 0, 1, 1], [2, 2, 2, 2]])


def three() -> FEMesh:
    return fe_mesh(staircase(THREE, ("air", "clay", "iron")))


def test_each_side_set_lies_where_its_name_says() -> None:
    mesh = three()
    for name, axis, value in (("left", 0, 0), ("right", 0, 4), ("bottom", 1, 0), ("top", 1, 3)):
        nodes = mesh.side_nodes(mesh.side_sets[name])
        assert (mesh.points[nodes, axis] == value).all()
        assert len(nodes) == (3 if axis == 0 else 4)
        assert set(mesh.node_sets[name]) == set(nodes.ravel())


def test_an_interface_has_the_sides_of_both_materials_and_one_node_set() -> None:
    mesh = three()
    sides = mesh.side_sets
    assert len(sides["interface_air_clay"]) == len(sides["interface_clay_air"]) == 2
    assert len(sides["interface_air_iron"]) == len(sides["interface_clay_iron"]) == 2
    assert (mesh.cell_material[sides["interface_iron_air"][:, 0]] == 2).all()
    ours = np.sort(mesh.side_nodes(sides["interface_air_clay"]), axis=1)
    theirs = np.sort(mesh.side_nodes(sides["interface_clay_air"]), axis=1)
    assert {tuple(s) for s in ours} == {tuple(s) for s in theirs}
    assert "interface_clay_air" not in mesh.node_sets


def test_corners_and_junctions() -> None:
    mesh = three()
    assert [tuple(mesh.points[mesh.node_sets[f"corner_{c}"][0]]) for c in ("bottom_left", "top_right")] == [
        (0, 0),
        (4, 3),
    ]
    assert {tuple(p) for p in mesh.points[mesh.node_sets["junctions"]]} == {(2, 1), (2, 3), (0, 1), (4, 1)}


def test_every_outer_side_is_in_exactly_one_border_or_free_set() -> None:
    image = np.zeros((8, 8), int)
    image[2:5, 3:6] = VOID  # a hole
    image[0, 5:] = VOID  # a bite out of the top border
    image[6:, 6:] = 1
    mesh = fe_mesh(staircase(image, ("a", "b")))
    outer = [s for name, s in mesh.side_sets.items() if not name.startswith("interface")]
    sides = np.concatenate(outer)
    assert len(np.unique(sides, axis=0)) == len(sides)
    assert len(mesh.side_sets["free_a"]) == 12 + 4  # the hole, and the bite: three below, one beside
    assert len(mesh.side_sets["top"]) == 5
    assert "corner_top_right" not in mesh.node_sets
    edges = np.sort(np.concatenate([mesh.cells[:, list(s)] for s in KINDS["quad4"].sides]), axis=1)
    _, count = np.unique(edges, axis=0, return_counts=True)
    assert len(sides) == (count == 1).sum()


def test_a_free_border_on_the_bounding_box_is_not_a_border_of_the_picture() -> None:
    image = np.full((6, 6), VOID)
    image[2:4, 2:4] = 0
    mesh = fe_mesh(staircase(image, ("island",)))
    assert list(mesh.side_sets) == ["free_island"]
    assert len(mesh.side_sets["free_island"]) == 8


def test_materials_and_regions_partition_the_elements() -> None:
    image = np.zeros((9, 9), int)
    image[1:3, 1:3] = image[5:8, 5:8] = 1
    mesh = fe_mesh(staircase(image, ("matrix", "fibre"), jiggle))
    materials, regions = mesh.material_cells(), mesh.region_cells()
    assert list(regions) == ["matrix_region_1", "fibre_region_1", "fibre_region_2"]
    for sets in (materials, regions):
        assert (np.sort(np.concatenate(list(sets.values()))) == np.arange(mesh.n_cells)).all()
    assert len(regions["fibre_region_1"]) == 4
    assert set(regions["fibre_region_2"]) < set(materials["fibre"])


def test_sets_do_not_change_with_the_unit() -> None:
    mesh = staircase(disk(12, 4), ("matrix", "disk"))
    small, large = fe_mesh(mesh.scaled(1e-6)), fe_mesh(mesh.scaled(1e5))
    assert small.side_sets.keys() == large.side_sets.keys()
    assert all((small.side_sets[name] == large.side_sets[name]).all() for name in small.side_sets)


def test_names_that_would_meet_are_told_apart() -> None:
    mesh = fe_mesh(staircase([[0, 1, 2, 3]], ("a", "b_c", "a_b", "c")))
    assert {"interface_a_b_c", "interface_a_b_c_2"} < set(mesh.side_sets)
    assert list(fe_mesh(staircase([[0, 1]], ("Same", "same"))).material_cells()) == ["Same", "same_2"]
    names = Names(["x"])
    assert [names.claim("X"), names.claim("X"), names.claim("x_2")] == ["X_2", "X_3", "x_2_2"]


def test_a_mesh_without_quads_is_refused() -> None:
    mesh = staircase([[0]])
    empty = type(mesh)(
        points=np.empty((0, 2)), point_kind=[], quads=np.empty((0, 4)), quad_region=[], region_label=[],
        chain_offsets=[0], chain_points=[], chain_regions=np.empty((0, 2)), materials=mesh.materials,
    )  # fmt: skip
    with pytest.raises(InputError, match="no quads"):
        fe_mesh(empty)


def test_elements_at_an_interface_touch_it_with_a_node() -> None:
    mesh = fe_mesh(staircase(np.repeat(np.repeat(THREE, 3, axis=0), 3, axis=1), ("air", "clay", "iron"), jiggle))
    names = {0: "air", 1: "clay", 2: "iron"}
    everywhere = set()
    for a, b in ((0, 1), (0, 2), (1, 2)):
        on = mesh.node_sets[f"interface_{names[a]}_{names[b]}"]
        expected = np.isin(mesh.cells, on).any(axis=1) & np.isin(mesh.cell_material, (a, b))
        assert (mesh.element_sets[f"interface_{names[a]}_{names[b]}"] == np.flatnonzero(expected)).all()
        everywhere |= set(np.flatnonzero(np.isin(mesh.cells, on).any(axis=1)))
    assert set(mesh.element_sets["interfaces"]) == everywhere
    assert fe_mesh(staircase(np.zeros((2, 2), int))).element_sets == {}


def test_without_interfaces_the_named_sides_are_the_boundary() -> None:
    mesh = without_interfaces(three())
    assert set(mesh.side_sets) == {"left", "right", "bottom", "top"}
    assert sum(len(sides) for sides in mesh.side_sets.values()) == 14
    assert mesh.node_sets.keys() == three().node_sets.keys()
    extruded = without_interfaces(extrude(three(), 1.0))
    assert set(extruded.side_sets) == {"left", "right", "bottom", "top", "back", "front"}
    split = split_interfaces(three(), [("air", "clay")])  # what was split is boundary
    assert {n for n in without_interfaces(split).side_sets if n.startswith("interface")} == {
        "interface_air_clay",
        "interface_clay_air",
    }
