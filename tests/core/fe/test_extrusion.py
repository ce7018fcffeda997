"""Hexes: of positive volume, in all sets, read by others, exact in CalculiX."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from imgquad_core.errors import InputError
from imgquad_core.fe.cohesive import split_interfaces
from imgquad_core.fe.extrusion import extrude
from imgquad_core.fe.second_order import second_order
from imgquad_core.fe.sets import fe_mesh
from imgquad_core.writers import write_mesh
from support.ccx import needs_ccx, solve
from support.handmade import disk, jiggle, staircase

FLAT = fe_mesh(staircase(disk(8, 2.6), ("matrix", "disk"), jiggle))


def test_volumes_sets_and_numbers() -> None:
    mesh = extrude(FLAT, 3.0, 4)
    p = mesh.points[mesh.cells]
    volume = np.einsum("nk,nk->n", p[:, 1] - p[:, 0], np.cross(p[:, 3] - p[:, 0], p[:, 4] - p[:, 0]))
    assert (volume > 0).all()
    assert (mesh.points[:, 2].min(), mesh.points[:, 2].max()) == (0.0, 3.0)
    assert mesh.n_cells == 4 * FLAT.n_cells
    for name, sides in FLAT.side_sets.items():
        assert len(mesh.side_sets[name]) == 4 * len(sides)
        flat_nodes = np.unique(FLAT.side_nodes(sides))
        assert set(mesh.side_nodes(mesh.side_sets[name]).ravel() % FLAT.n_points) == set(flat_nodes)
    assert (mesh.points[mesh.side_nodes(mesh.side_sets["back"]), 2] == 0).all()
    assert (mesh.points[mesh.side_nodes(mesh.side_sets["front"]), 2] == 3).all()
    assert {len(ids) for name, ids in mesh.material_cells().items()} == {
        4 * len(ids) for ids in FLAT.material_cells().values()
    }
    assert len(mesh.node_sets["corner_top_left"]) == 5


def test_normals_of_sides_point_outwards() -> None:
    mesh = extrude(FLAT, 2.0, 2)
    centre = mesh.points[mesh.cells].mean(axis=1)
    for sides in mesh.side_sets.values():
        p = mesh.points[mesh.side_nodes(sides)]
        normal = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
        assert (np.einsum("nk,nk->n", normal, p.mean(axis=1) - centre[sides[:, 0]]) > 0).all()


def test_cohesive_hexes_have_their_normal_from_below_to_above() -> None:
    flat = split_interfaces(FLAT)
    mesh = extrude(flat, 2.0, 2)
    p = mesh.points[mesh.cohesive]
    assert (p[:, :4] == p[:, 4:]).all()
    normal = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    outwards = [4.0, 4.0, 1.0] - p[:, :4].mean(axis=1)  # disk is material 1: above lies towards the centre
    assert (np.einsum("nk,nk->n", normal[:, :2], outwards[:, :2]) > 0).all()
    assert (np.sort(np.unique(mesh.cohesive[:, :4])) == mesh.node_sets["interface_matrix_disk"]).all()


def test_gmsh_nastran_and_exodus_hold_the_hexes(tmp_path: Path) -> None:
    mesh = extrude(FLAT, 3.0, 2)
    skfem = pytest.importorskip("skfem")
    write_mesh(mesh, tmp_path / "a.msh")
    read = skfem.Mesh.load(str(tmp_path / "a.msh"))
    assert set(read.boundaries) == {*FLAT.side_sets, "back", "front"} - {"interface_disk_matrix"}
    one = skfem.Functional(lambda w: 1.0 + 0 * w.x[0])
    assert one.assemble(skfem.Basis(read, skfem.ElementHex1())) == pytest.approx(8 * 8 * 3)
    pv = pytest.importorskip("pyvista")
    write_mesh(mesh, tmp_path / "a.e")
    read = pv.read(tmp_path / "a.e")
    assert sum(block.volume for block in read["Element Blocks"]) == pytest.approx(8 * 8 * 3)
    for name in ("left", "back", "front", "interface_disk_matrix"):
        mine = mesh.points[np.unique(mesh.side_nodes(mesh.side_sets[name]))]
        theirs = read["Side Sets"][name].points
        assert np.abs(np.unique(mine.round(5), axis=0) - np.unique(theirs.astype(float).round(5), axis=0)).max() < 1e-4
    read_bdf = pytest.importorskip("pyNastran.bdf.bdf").read_bdf
    write_mesh(mesh, tmp_path / "a.bdf")
    model = read_bdf(str(tmp_path / "a.bdf"), debug=False)
    assert sum(e.Volume() for e in model.elements.values()) == pytest.approx(8 * 8 * 3)


@needs_ccx
def test_calculix_passes_the_patch_test_on_hexes(tmp_path: Path) -> None:
    values = {"*": {"young": 210.0, "poisson": 0.3, "conductivity": 2.0}}
    write_mesh(extrude(FLAT, 3.0, 2), tmp_path / "a.inp", properties=values, deck="tension")
    found = solve(tmp_path / "a.inp", "*EL PRINT, ELSET=EALL\nS")["stresses"]
    assert np.abs(found[:, 2:] - [0.21, 0, 0, 0, 0, 0]).max() < 1e-6 * 0.21
    write_mesh(extrude(FLAT, 3.0, 2), tmp_path / "b.inp", properties=values, deck="thermal")
    flux = solve(tmp_path / "b.inp")["total heat generation"][0, 0]
    assert abs(flux) == pytest.approx(2 / 8 * 8 * 3, rel=1e-6)


def test_what_cannot_be_extruded_or_written_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="thickness -1"):
        extrude(FLAT, -1)
    with pytest.raises(InputError, match="layers 0"):
        extrude(FLAT, 1, 0)
    with pytest.raises(InputError, match="not from quad8"):
        extrude(second_order(FLAT), 1)
    for extension in (".obj", ".stl", ".svg"):
        with pytest.raises(InputError, match="plane meshes"):
            write_mesh(extrude(FLAT, 1), tmp_path / f"a{extension}")
    with pytest.raises(InputError, match="no hex8 for the analysis 'plane stress'"):
        write_mesh(extrude(FLAT, 1), tmp_path / "a.inp", analysis="plane stress")
