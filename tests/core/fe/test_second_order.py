"""Quads of 8 and 9 nodes: on the boundary's curve, never folded, sets complete."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from imgquad_core.arrays import Floats
from imgquad_core.errors import InputError
from imgquad_core.fe.femesh import FEMesh
from imgquad_core.fe.second_order import second_order, serendipity_slopes
from imgquad_core.fe.sets import fe_mesh
from imgquad_core.writers import write_mesh
from support import naive
from support.handmade import disk, jiggle, round_inclusion, staircase

GAUSS = np.sqrt(0.6) * np.array([-1, 0, 1])
WEIGHTS = np.array([5, 8, 5]) / 9


def jacobians(mesh: FEMesh) -> Floats:
    """Jacobian at 3 x 3 Gauss points, shape (n_cells, 9), written apart from the code that keeps them positive."""
    found = []
    for s in GAUSS:
        for t in GAUSS:
            if mesh.kind == "quad8":
                slopes = serendipity_slopes(s, t)
            else:
                slopes = lagrange_slopes(s, t)
            (a, b), (c, d) = np.einsum("ka,nai->kin", slopes, mesh.points[mesh.cells])
            found.append(a * d - b * c)
    return np.stack(found, axis=1)


def lagrange_slopes(s: float, t: float) -> Floats:
    """Derivatives of the 9 biquadratic functions, corners, middles, centre."""
    value = {v: [v * (v - 1) / 2, 1 - v * v, v * (v + 1) / 2] for v in (s, t)}
    slope = {v: [v - 0.5, -2 * v, v + 0.5] for v in (s, t)}
    places = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)]
    return np.array([[slope[s][i] * value[t][j] for i, j in places], [value[s][i] * slope[t][j] for i, j in places]])


def area(mesh: FEMesh, material: int) -> float:
    of = jacobians(mesh)[mesh.cell_material == material]
    return float((of * np.outer(WEIGHTS, WEIGHTS).ravel()).sum())


@pytest.mark.parametrize("nodes", [8, 9])
def test_middles_approach_a_circle_with_the_fourth_power_of_the_size(nodes: int) -> None:
    errors = []
    for n in (4, 8, 16):
        mesh = second_order(fe_mesh(round_inclusion(n, 10, 40, 3)), nodes)
        middles = mesh.side_nodes(mesh.side_sets["interface_disk_matrix"])[:, 2]
        errors.append(np.abs(np.linalg.norm(mesh.points[middles] - 20, axis=1) - 10).max())
        assert jacobians(mesh).min() > 0
    assert errors[0] < 0.01
    assert np.log2(errors[0] / errors[1]) > 3.8
    assert np.log2(errors[1] / errors[2]) > 3.8


def test_the_area_of_a_disk_is_a_hundred_times_nearer_than_with_straight_sides() -> None:
    mesh = fe_mesh(round_inclusion(8, 10, 40, 3))
    straight = naive.areas(mesh.points, mesh.cells[mesh.cell_material == 1]).sum()
    curved = area(second_order(mesh), 1)
    assert abs(curved - 100 * np.pi) < 0.01 * abs(straight - 100 * np.pi)
    assert area(second_order(mesh), 0) + curved == pytest.approx(1600, abs=1e-9)


@pytest.mark.parametrize("nodes", [8, 9])
def test_corners_stay_sharp_and_the_frame_straight(nodes: int) -> None:
    mesh = second_order(fe_mesh(round_inclusion(6, 10, 40, 3)), nodes)
    for name, axis, value in (("left", 0, 0), ("right", 0, 40), ("bottom", 1, 0), ("top", 1, 40)):
        assert mesh.points[mesh.node_sets[name], axis] == pytest.approx(value, abs=1e-12)
        assert len(mesh.node_sets[name]) == 13
    assert len(mesh.node_sets["corner_top_left"]) == 1


def test_a_curve_that_would_fold_an_element_is_made_flat() -> None:
    plain = round_inclusion(4, 10, 40, 4)
    points = plain.points.copy()
    ring = np.unique(plain.chain_points[plain.chain_offsets[1] :])
    outside = ring + 16  # the next ring of nodes, pressed almost onto the chords of the circle
    points[outside] = 20 + (points[ring] - 20) * 1.002
    mesh = second_order(fe_mesh(replace(plain, points=points)))
    straight = second_order(fe_mesh(replace(plain, points=points, chain_offsets=[0], chain_points=[])))
    assert jacobians(straight).min() > 0
    assert jacobians(mesh).min() > 0
    bulge = np.abs(mesh.points - straight.points).max(axis=1)
    middles = mesh.side_nodes(mesh.side_sets["interface_disk_matrix"])[:, 2]
    assert (bulge[middles] < 0.2).all()


def test_noise_on_the_boundary_folds_nothing() -> None:
    for scale in (1.0, 1.8):
        plain = staircase(disk(20, 7), move=lambda p, scale=scale: scale * jiggle(p))
        p = plain.points[plain.quads]
        e = np.roll(p, -1, axis=1) - p
        turn = e[..., 0] * np.roll(e, -1, axis=1)[..., 1] - e[..., 1] * np.roll(e, -1, axis=1)[..., 0]
        convex = (turn > 0).all(axis=1)
        mesh = second_order(fe_mesh(plain))
        assert convex.sum() > 300
        assert jacobians(mesh)[convex].min() > 0


def test_order_two_is_raised_once_and_in_the_plane() -> None:
    mesh = fe_mesh(round_inclusion(4, 10, 40, 3))
    with pytest.raises(InputError, match="8 or 9 nodes, not 6"):
        second_order(mesh, 6)
    with pytest.raises(InputError, match="not from quad8"):
        second_order(second_order(mesh))


@pytest.mark.parametrize("nodes", [8, 9])
def test_readers_of_others_see_the_same_curved_elements(tmp_path: Path, nodes: int) -> None:
    mesh = second_order(fe_mesh(round_inclusion(4, 10, 40, 3)), nodes)
    skfem = pytest.importorskip("skfem")
    write_mesh(mesh, tmp_path / "a.msh")
    if nodes == 9:  # scikit-fem has no serendipity mesh
        read = skfem.MeshQuad2.load(str(tmp_path / "a.msh"))
        one = skfem.Functional(lambda w: 1.0 + 0 * w.x[0])
        assert one.assemble(skfem.Basis(read, skfem.ElementQuad2(), elements="disk")) == pytest.approx(area(mesh, 1))
    pv = pytest.importorskip("pyvista")
    write_mesh(mesh, tmp_path / "a.e")
    blocks = pv.read(tmp_path / "a.e")["Element Blocks"]
    assert set(blocks["disk"].celltypes) == {23 if nodes == 8 else 28}
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "a.msh"))
        elements = gmsh.model.mesh.getElementsByType(16 if nodes == 8 else 10)[0]
        assert len(elements) == mesh.n_cells
        assert min(gmsh.model.mesh.getElementQualities(elements, "minDetJac")) > 0
    finally:
        gmsh.finalize()


def test_nastran_has_cquad8_and_the_formats_without_it_say_so(tmp_path: Path) -> None:
    plain = fe_mesh(round_inclusion(4, 10, 40, 3))
    read_bdf = pytest.importorskip("pyNastran.bdf.bdf").read_bdf
    eight = second_order(plain, 8)
    write_mesh(eight, tmp_path / "a.bdf")
    model = read_bdf(str(tmp_path / "a.bdf"), debug=False)
    nodes = np.array([model.elements[i + 1].node_ids for i in range(eight.n_cells)])
    assert (nodes - 1 == eight.cells).all()
    nine = second_order(plain, 9)
    for extension, message in ((".bdf", "no quad9"), (".inp", "no quad9")):
        with pytest.raises(InputError, match=message):
            write_mesh(nine, tmp_path / f"b{extension}")
