"""Periodic cells: opposite sides match, boundaries join at the seam, areas stay, CalculiX takes the equations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from imgquad_core import pipeline
from imgquad_core.boundary.areas import enclosed_areas
from imgquad_core.errors import InputError, TopologyError
from imgquad_core.fe.cohesive import split_interfaces
from imgquad_core.fe.extrusion import extrude
from imgquad_core.fe.periodic_pairs import with_periodic_pairs
from imgquad_core.fe.second_order import second_order
from imgquad_core.fe.sets import fe_mesh
from imgquad_core.measures.quality import scaled_jacobian
from imgquad_core.model import VOID
from imgquad_core.options import MeshOptions
from imgquad_core.pipeline import mesh_image, run
from imgquad_core.writers import write_mesh
from support import naive
from support.ccx import needs_ccx, solve
from support.handmade import staircase
from support.labels import label_image, labels_of_kind


def wrapped_disks(seed: int, n: int = 96, count: int = 12) -> NDArray[np.int32]:
    """Disks of two materials in a third; what leaves the picture on one side comes in on the other."""
    rng = np.random.default_rng(seed)
    at = np.arange(n) + 0.5
    labels = np.zeros((n, n), np.int32)
    for _ in range(count):
        (x, y), radius, label = rng.uniform(0, n, 2), rng.uniform(6, 18), rng.integers(1, 3)
        dx, dy = (np.minimum(np.abs(at - c), n - np.abs(at - c)) for c in (x, y))
        labels[dy[:, None] ** 2 + dx[None, :] ** 2 < radius**2] = label
    return labels


def areas(mesh) -> NDArray[np.float64]:
    return np.bincount(mesh.quad_material, naive.areas(mesh.points, mesh.quads))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("directions", ["x", "y", "xy"])
def test_sides_match_and_areas_stay(seed: int, directions: str) -> None:
    labels = wrapped_disks(seed, 160, 25)
    made = run(labels, MeshOptions(size=4.0, periodic=directions))
    mesh = made.mesh
    tied = with_periodic_pairs(fe_mesh(mesh), directions)
    for direction, pairs in tied.periodic.items():
        axis = "xy".index(direction)
        step = tied.points[pairs[:, 1]] - tied.points[pairs[:, 0]]
        assert (step[:, axis] == 160).all()
        assert (step[:, 1 - axis] == 0).all()
    assert scaled_jacobian(mesh.points, mesh.quads).min() > 0.05
    pixels = np.bincount(labels.ravel())
    of_boundary = np.bincount(made.boundary.region_label, enclosed_areas(made.boundary))
    assert np.abs(of_boundary / pixels - 1).max() < 2e-4
    assert np.abs(areas(mesh) / pixels - 1).max() < 1e-3  # the mesher may give up single points of boundaries


def test_boundaries_of_a_periodic_picture_meet_at_the_seam() -> None:
    mesh = mesh_image(wrapped_disks(4), MeshOptions(size=4.0, periodic="xy"))
    tied = with_periodic_pairs(fe_mesh(mesh), "xy")
    labels = [set(mesh.quad_material[(mesh.quads == node).any(axis=1)]) for node in range(mesh.n_points)]
    same = [labels[a] == labels[b] for pairs in tied.periodic.values() for a, b in pairs]
    assert np.mean(same) > 0.9


def test_any_picture_can_be_made_periodic() -> None:
    noise = np.random.default_rng(5).integers(0, 4, (10, 12)).repeat(7, axis=0).repeat(7, axis=1)
    tied = with_periodic_pairs(fe_mesh(mesh_image(noise, MeshOptions(size=5.0, periodic="xy"))), "xy")
    assert len(tied.periodic["x"]) == len(tied.node_sets["left"]) == len(tied.node_sets["right"])
    assert len(tied.periodic["y"]) == len(tied.node_sets["top"])


@pytest.mark.parametrize("seed", [1000, 1057, 1097, 1215])
def test_sides_match_even_where_the_mesher_cuts_edges_of_one_side(seed: int) -> None:
    rng = np.random.default_rng(seed)
    k, shape = rng.integers(1, 9), rng.integers(4, 12, 2)
    labels = rng.integers(0, rng.integers(1, 5), shape).repeat(k, 0).repeat(k, 1)
    for directions in ("x", "xy"):
        mesh = mesh_image(labels.astype(np.int32), MeshOptions(size=6.0, periodic=directions))
        tied = with_periodic_pairs(fe_mesh(mesh), directions)
        assert all(len(pairs) > 2 for pairs in tied.periodic.values())


def test_edges_that_the_mesher_cut_are_cut_alike_on_both_sides_not_where_it_left_them() -> None:
    options = MeshOptions(size=4.0, periodic="x")
    made = run(wrapped_disks(1, 160, 25), options)  # the mesher cuts its sides five times
    graph = made.boundary
    outer = (graph.chain_regions == VOID).any(axis=1)
    assert (np.diff(graph.chain_offsets) % 2 == 1).all()  # an even number of edges
    at = [graph.points[graph.chain(c)] for c in np.flatnonzero(outer)]
    heights = [np.unique(np.concatenate([p[:, 1] for p in at if (p[:, 0] == x).all()])) for x in (0.0, 160.0)]
    assert np.array_equal(*heights)


def test_sides_that_never_match_are_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pipeline, "rematch", lambda graph, *_: graph)
    with pytest.raises(TopologyError, match="opposite sides of the cell differ after 8 rounds"):
        run(label_image([[0, 1], [1, 0]]), MeshOptions(size=1.0, periodic="x"))


def test_sides_of_which_a_material_was_dropped_match_where_both_are_meshed() -> None:
    labels = np.zeros((40, 40), np.int32)
    labels[5:20, :10] = 1
    labels[12:30, 30:] = 1
    mesh = mesh_image(labels, MeshOptions(size=4.0, periodic="x", drop=("1",)))
    tied = with_periodic_pairs(fe_mesh(mesh), "x")
    a, b = tied.points[tied.periodic["x"].T]
    assert (a[:, 1] == b[:, 1]).all()
    assert set(a[:, 1]) == set(tied.points[tied.node_sets["left"], 1]) & set(tied.points[tied.node_sets["right"], 1])
    assert ((a[:, 1] <= 10) | (a[:, 1] >= 35)).all()
    labels[:, [0, -1]] = 1  # nothing is left on both sides
    assert mesh_image(labels, MeshOptions(size=4.0, periodic="xy", drop=("1",))).n_quads > 0


def test_no_boundary_of_void_leaves_the_picture() -> None:
    labels = labels_of_kind("void", 8, 14, 7, 1040089455)[::-1]
    options = MeshOptions(size=2.5, policy="junction", periodic="x", drop=(2,), join=12.0, min_pixels=3, min_length=5.0)
    points = run(label_image(np.ascontiguousarray(labels)), options).mesh.points
    assert (points >= 0.0).all()
    assert (points <= [14.0, 8.0]).all()


def test_order_two_and_extrusion_carry_the_pairs() -> None:
    mesh = fe_mesh(staircase(wrapped_disks(1, 24, 4)))
    eight = with_periodic_pairs(second_order(mesh), "xy")
    assert len(eight.periodic["x"]) == 49
    hexes = extrude(with_periodic_pairs(mesh, "x"), 2.0, 2)
    step = hexes.points[hexes.periodic["x"][:, 1]] - hexes.points[hexes.periodic["x"][:, 0]]
    assert (step == [24, 0, 0]).all()
    assert len(hexes.periodic["x"]) == 3 * 25
    split = split_interfaces(
        with_periodic_pairs(fe_mesh(staircase(np.repeat([[0], [1]], 4, axis=0).repeat(4, 1))), "x")
    )
    a, b = split.periodic["x"].T  # the node on the interface is there twice on each side
    assert len(a) == 10
    assert [split.cell_material[(split.cells == n).any(axis=1)][0] for n in a] == [
        split.cell_material[(split.cells == n).any(axis=1)][0] for n in b
    ]


def test_sides_that_do_not_match_are_said() -> None:
    across = np.zeros((20, 20), int)
    across[8:12, :10] = 1  # an interface meets the left border, none the right one
    with pytest.raises(InputError, match="pair the sides first, then split"):
        with_periodic_pairs(split_interfaces(fe_mesh(staircase(across))), "x")
    plain = mesh_image(
        np.arange(60)[:, None].repeat(60, 1) * np.ones(60) > np.linspace(10, 45, 60), MeshOptions(size=4.0)
    )
    with pytest.raises(TopologyError, match="periodic: "):
        with_periodic_pairs(fe_mesh(plain), "x")
    with pytest.raises(InputError, match="choose one of x, y, xy"):
        with_periodic_pairs(fe_mesh(plain), "z")
    with pytest.raises(InputError, match="periodic is 'yx'"):
        MeshOptions(periodic="yx")
    island = np.full((8, 8), VOID)
    island[3:5, 3:5] = 0
    with pytest.raises(InputError, match="no element lies on the left border"):
        with_periodic_pairs(fe_mesh(staircase(island)), "x")


@needs_ccx
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("deck", ["tension", "thermal"])
def test_a_periodic_laminate_is_solved_exactly(tmp_path: Path, deck: str, order: int) -> None:
    """Layers across x in series; a quarter of the hard one on the left, three quarters on the right of the seam."""
    row = np.array([1] * 5 + [0] * 30 + [1] * 25)
    mesh = fe_mesh(mesh_image(row[None, :].repeat(40, axis=0), MeshOptions(size=5.0, periodic="xy")))
    mesh = second_order(mesh) if order == 2 else mesh
    values = {"0": {"young": 100.0, "conductivity": 1.0}, "1": {"young": 900.0, "conductivity": 9.0}}
    table = {n: values[str(m)] | {"poisson": 0.0} for m, n in mesh.material_names().items()}
    write_mesh(with_periodic_pairs(mesh, "xy"), tmp_path / "a.inp", properties=table, deck=deck)
    found = solve(tmp_path / "a.inp", "*EL PRINT, ELSET=EALL\n" + ("S" if deck == "tension" else "HFL"))
    mean = 2 / (1 / 100 + 1 / 900) if deck == "tension" else 2 / (1 + 1 / 9)
    load = 1e-3 if deck == "tension" else -1 / 60
    stress = found["stresses"][:, 2] if deck == "tension" else found["heat flux"][:, 2]
    assert np.abs(stress / (mean * load) - 1).max() < 1e-5
    total = found["total force" if deck == "tension" else "total heat generation"].ravel()[0]
    assert abs(total) == pytest.approx(abs(mean * load * 40), rel=1e-6)


@needs_ccx
def test_the_seam_may_lie_anywhere(tmp_path: Path) -> None:
    """Effective stiffness of one periodic structure, cut at two places."""
    labels = wrapped_disks(6, 64, 5) > 0
    found = []
    for shift in (0, 23):
        picture = np.roll(labels, shift, axis=(0, 1))
        mesh = second_order(fe_mesh(mesh_image(picture, MeshOptions(size=2.0, periodic="xy"))))
        table = {n: {"young": 1.0 + 9.0 * m, "poisson": 0.3} for m, n in mesh.material_names().items()}
        write_mesh(with_periodic_pairs(mesh, "xy"), tmp_path / "a.inp", properties=table, deck="tension")
        found.append(solve(tmp_path / "a.inp")["total force"][0, 0])
    assert found[0] == pytest.approx(found[1], rel=1e-2)
    assert 1e-3 < found[0] / 64 < (1 + 9 * labels.mean()) * 1e-3
