"""Periodic cells with cohesive interfaces: copies of nodes on both sides are tied, whatever the picture."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core import MeshOptions, mesh_image
from imgquad_core.errors import InputError
from imgquad_core.fe import ElementOptions, make_elements
from imgquad_core.fe.cohesive import closed_ends
from imgquad_core.writers.abaqus.equations import _ties
from support.cells import assert_tied, assert_whole, tileable
from support.handmade import staircase


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("order", [1, 2])
def test_tileable_pictures_make_periodic_cells_with_cohesive_interfaces(seed: int, order: int) -> None:
    mesh = mesh_image(tileable(seed), MeshOptions(size=3.0, periodic="xy", effort="fast"))
    made = make_elements(mesh, ElementOptions(order=order, cohesive="all", periodic="xy"))
    plain = make_elements(mesh, ElementOptions(order=order, periodic="xy"))
    assert_tied(made)
    assert_whole(made)
    assert all(len(made.periodic[d]) >= len(plain.periodic[d]) for d in "xy")


def test_any_picture_does_with_its_interfaces_closed_where_they_do_not_go_on() -> None:
    labels = np.array([[0, 0], [0, 1], [1, 0], [0, 0]], np.int32)
    made = make_elements(mesh_image(labels, MeshOptions(periodic="x")), ElementOptions(cohesive="all", periodic="x"))
    assert_tied(made)
    assert_whole(made)
    assert closed_ends(made) > 0


def test_sides_that_meet_in_a_node_that_is_split_are_refused() -> None:
    labels = np.array([[0, 0, 3, 1], [0, 0, 3, 1], [2, 2, 0, 0], [2, 2, 0, 0]], np.int32)  # 2 ends where 1 begins
    mesh = mesh_image(labels, MeshOptions(periodic="x", drop=(0,)))
    assert len(make_elements(mesh, ElementOptions(periodic="x")).periodic["x"]) == 1
    with pytest.raises(InputError, match="meet in single nodes only"):
        make_elements(mesh, ElementOptions(cohesive="all", periodic="x"))


def test_an_interface_across_the_seam_is_split_on_both_sides() -> None:
    layers = np.repeat([0, 1, 0], 4)[:, None].repeat(6, 1)
    mesh = make_elements(staircase(layers), ElementOptions(cohesive="all", periodic="xy"))
    assert closed_ends(mesh) == 0
    assert_tied(mesh)
    a, b = mesh.periodic["x"].T
    assert len(a) == 13 + 2  # both interfaces have two nodes on either side
    materials = [
        {int(m) for m in mesh.cell_material[(mesh.cells == n).any(axis=1)]} for n in np.stack([a, b]).T.ravel()
    ]
    assert materials[::2] == materials[1::2]


def test_the_seam_is_whole_where_materials_differ_across_it() -> None:
    halves = np.repeat([0, 1], 3)[None, :].repeat(4, 0)  # 0 meets 1 in the middle and again across the seam
    mesh = make_elements(staircase(halves), ElementOptions(cohesive="all", periodic="x"))
    assert len(mesh.cohesive) == 4
    assert len(mesh.periodic["x"]) == 5
    assert_tied(mesh)


def test_corners_that_are_tied_over_the_other_diagonal_lose_no_tie() -> None:
    """At the corner of the cell interfaces can part the lower left from the rest: the upper left is the master."""
    for seed in range(30):
        labels = np.random.default_rng(seed).integers(0, 3, (5, 6)).astype(np.int32)
        mesh = make_elements(staircase(labels), ElementOptions(cohesive="all", periodic="xy"))
        assert_tied(mesh)
        tied = {frozenset(pair) for pairs in mesh.periodic.values() for pair in pairs.tolist()}
        ties = _ties(mesh)
        for a, b in map(tuple, tied):
            assert ties.get(a, (a, {}))[0] == ties.get(b, (b, {}))[0]  # of one group
