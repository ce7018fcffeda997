"""Solver files through PyVista's own save, and grids of all element kinds."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv

from imgquad_core.errors import InputError
from imgquad_core.fe import ElementOptions, make_elements
from imgquad_core.fe.sets import fe_mesh
from imgquad_core.writers import write_mesh
from imgquad_mesh.datasets.grids import from_grid, to_fe_grid, to_grid
from imgquad_mesh.outputs.files import write_mesh_file
from support.handmade import disk, jiggle, round_inclusion, staircase

MESH = staircase(disk(10, 3), ("matrix", "disk"), jiggle)


def test_a_grid_becomes_the_mesh_it_was_made_of() -> None:
    again = from_grid(to_grid(MESH))
    assert (again.points == MESH.points).all()
    assert (again.quads == MESH.quads).all()
    assert (again.quad_material == MESH.quad_material).all()
    assert again.materials.names == MESH.materials.names
    assert fe_mesh(again).side_sets.keys() == fe_mesh(MESH).side_sets.keys()


@pytest.mark.parametrize("extension", [".inp", ".msh", ".bdf", ".e"])
def test_save_writes_the_same_bytes_as_the_core(tmp_path: Path, extension: str) -> None:
    to_grid(MESH).save(tmp_path / f"a{extension}")
    write_mesh(from_grid(to_grid(MESH)), tmp_path / f"b{extension}")
    assert (tmp_path / f"a{extension}").read_bytes() == (tmp_path / f"b{extension}").read_bytes()


def test_options_reach_the_writer_and_the_elements(tmp_path: Path) -> None:
    grid = to_grid(MESH)
    grid.save(tmp_path / "a.inp", analysis="plane strain", order=2)
    assert "TYPE=CPE8" in (tmp_path / "a.inp").read_text()
    grid.save(tmp_path / "a.inp", cohesive=[("disk", "matrix")], extrude=2.0, layers=2)
    assert "TYPE=COH3D8" in (tmp_path / "a.inp").read_text()
    with pytest.raises(InputError, match="no option 'analysys'"):
        grid.save(tmp_path / "a.inp", analysys="plane strain")


def test_plugins_are_found_by_name_and_inp_is_still_read_as_avs(tmp_path: Path) -> None:
    program = (
        "import sys, pyvista as pv\n"
        "grid = pv.ImageData(dimensions=(4, 4, 1)).cast_to_structured_grid().cast_to_unstructured_grid()\n"
        "assert 'imgquad_mesh' not in sys.modules\n"
        "grid.save(sys.argv[1])\n"
        "open(sys.argv[2], 'w').write('4 1 0 0 0\\n1 0 0 0\\n2 1 0 0\\n3 1 1 0\\n4 0 1 0\\n1 1 quad 1 2 3 4\\n')\n"
        "assert pv.read(sys.argv[2]).n_cells == 1\n"
    )
    avs = tmp_path / "avs.inp"
    subprocess.run([sys.executable, "-W", "error", "-c", program, str(tmp_path / "a.inp"), str(avs)], check=True)
    assert "*ELEMENT, TYPE=CPS4" in (tmp_path / "a.inp").read_text()


def test_what_is_no_flat_grid_of_quads_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no quads"):
        pv.ImageData(dimensions=(3, 3, 1)).cast_to_structured_grid().save(tmp_path / "a.inp")
    with pytest.raises(InputError, match="9 of 9 cells are no quads"):
        pv.ImageData(dimensions=(4, 4, 1)).cast_to_unstructured_grid().save(tmp_path / "a.inp")
    with pytest.raises(InputError, match="z = constant"):
        to_grid(MESH).rotate_x(90).save(tmp_path / "a.inp")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("options", "cells"),
    [
        (ElementOptions(), {9: 352}),
        (ElementOptions(order=2), {23: 352}),
        (ElementOptions(order=2, nodes=9), {28: 352}),
        (ElementOptions(cohesive="all"), {9: 352 + 32}),
        (ElementOptions(order=2, cohesive="all"), {23: 352, 30: 32}),
        (ElementOptions(extrude=4.0, layers=3), {12: 3 * 352}),
    ],
)
def test_grids_of_all_kinds_have_the_area_and_the_sets(tmp_path: Path, options: ElementOptions, cells: dict) -> None:
    mesh = make_elements(round_inclusion(8, 10, 40, 3), options)
    to_fe_grid(mesh).save(tmp_path / "a.vtu")
    grid = pv.read(tmp_path / "a.vtu")
    kinds, counts = np.unique(grid.celltypes, return_counts=True)
    assert dict(zip(kinds.tolist(), counts.tolist(), strict=True)) == cells
    size = grid.compute_cell_sizes()
    total = size["Volume"].sum() if options.extrude else size["Area"].sum()
    assert total == pytest.approx(1600 * (options.extrude or 1), rel=1e-9)
    assert grid.point_data["set left"].sum() == len(mesh.node_sets["left"])
    assert list(grid.field_data["material_names"]) == ["matrix", "disk"]


@pytest.mark.parametrize(("order", "kind"), [(1, 9), (2, 30)])
def test_cohesive_cells_open_in_the_grid_by_as_much_as_their_sides_part(tmp_path: Path, order: int, kind: int) -> None:
    mesh = make_elements(round_inclusion(8, 10, 40, 3), ElementOptions(order=order, cohesive="all"))
    to_fe_grid(mesh).save(tmp_path / "a.vtu")
    grid = pv.read(tmp_path / "a.vtu")
    cohesive = grid.extract_cells(np.arange(mesh.n_cells, grid.n_cells))
    assert set(cohesive.celltypes) == {kind}
    assert (cohesive["cohesive_pair"] == [0, 1]).all()
    assert (grid["cohesive_pair"][: mesh.n_cells] == -1).all()
    rows = grid.cell_connectivity[-mesh.cohesive.size :].reshape(mesh.cohesive.shape)
    assert (rows == mesh.cohesive).all()
    upper = np.unique(np.concatenate([mesh.cohesive[:, 2:4], mesh.cohesive[:, 5:]], axis=1))  # on the disk
    shrunk = grid.points.copy()
    shrunk[upper] = [20, 20, 0] + 0.99 * (shrunk[upper] - [20, 20, 0])
    grid.points = shrunk
    opened = grid.extract_cells(np.arange(mesh.n_cells, grid.n_cells)).compute_cell_sizes()["Area"].sum()
    ring = np.pi * 100 * (1 - 0.99**2)
    assert opened == pytest.approx(ring, rel=1e-2 if order == 1 else 2e-3)  # VTK measures sides as two chords


def test_interfaces_may_be_left_open(tmp_path: Path) -> None:
    grid = to_grid(MESH)
    grid.save(tmp_path / "a.e", cohesive="all", interfaces="sides", order=2)
    read = pv.read(tmp_path / "a.e")
    assert list(read["Element Blocks"].keys()) == ["matrix", "disk"]
    assert {"interface_matrix_disk", "interface_disk_matrix"} <= set(read["Side Sets"].keys())
    with pytest.raises(InputError, match="say which, with cohesive"):
        grid.save(tmp_path / "b.e", interfaces="sides")


def test_orders_that_are_not_made_are_refused() -> None:
    with pytest.raises(InputError, match="order is 3"):
        ElementOptions(order=3)
    with pytest.raises(InputError, match="exclude each other"):
        ElementOptions(order=2, extrude=1.0)


@pytest.mark.parametrize("extension", [".vtu", ".vtk"])
@pytest.mark.parametrize(
    "options",
    [ElementOptions(), ElementOptions(order=2), ElementOptions(order=2, nodes=9), ElementOptions(extrude=2.0)],
)
def test_meshio_reads_plain_grids(tmp_path: Path, extension: str, options: ElementOptions) -> None:
    meshio = pytest.importorskip("meshio")
    write_mesh_file(MESH, tmp_path / f"a{extension}", options, plain=True)
    mesh, read = make_elements(MESH, options), meshio.read(tmp_path / f"a{extension}")
    (block,) = read.cells
    assert (block.data == mesh.cells).all()
    assert np.abs(read.points[:, :2] - mesh.points[:, :2]).max() < 1e-9
    for name in ("material", "mat_id"):
        assert (read.cell_data[name][0].ravel() == mesh.cell_material + 1).all()
    for name, ids in mesh.node_sets.items():
        assert (np.flatnonzero(read.point_data[f"set_{name}"]) == ids).all()
    grid = pv.read(tmp_path / f"a{extension}")
    assert (grid["material"] == mesh.cell_material + 1).all()
    assert "1 matrix, 2 disk" in (tmp_path / f"a{extension}").read_text()[:200]


def test_a_grid_without_its_names_is_read_by_meshio(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    grid = to_grid(MESH)
    grid.save(tmp_path / "a.vtu")
    with pytest.raises(SystemExit):  # PyVista's own form; the command writes bytes, see docs/fe/meshio.md
        meshio.read(tmp_path / "a.vtu")
    del grid.field_data["material_names"]
    grid.save(tmp_path / "a.vtu")
    assert (meshio.read(tmp_path / "a.vtu").cells_dict["quad"] == MESH.quads).all()


def test_interfaces_may_be_left_out(tmp_path: Path) -> None:
    grid = to_grid(MESH)
    grid.save(tmp_path / "a.msh", interfaces="none")
    assert "interface" not in (tmp_path / "a.msh").read_text()
    grid.save(tmp_path / "a.inp", interfaces="none")
    text = (tmp_path / "a.inp").read_text()
    assert "S_INTERFACE" not in text
    assert "*NSET, NSET=INTERFACE_MATRIX_DISK" in text


def test_triangles_are_cut_of_quads(tmp_path: Path) -> None:
    to_grid(MESH).save(tmp_path / "a.inp", split_quads=True)
    assert "TYPE=CPS3" in (tmp_path / "a.inp").read_text()
    write_mesh_file(MESH, tmp_path / "a.vtu", ElementOptions(split_quads=True))
    assert set(pv.read(tmp_path / "a.vtu").celltypes) == {pv.CellType.TRIANGLE}
