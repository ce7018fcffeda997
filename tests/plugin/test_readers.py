"""Our .vtu files: meshio takes them, and PyVista finds texts where others find bytes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista as pv
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from imgquad_core.fe import make_elements
from imgquad_core.fe.elements import ElementOptions
from imgquad_mesh.datasets import from_grid, materials_of, to_grid
from imgquad_mesh.datasets.field_texts import put_texts, restore_texts
from imgquad_mesh.outputs.files import write_mesh_file
from support.handmade import disk, jiggle, staircase

NAMES = ("quartz", 'Größe <α> & "β"\'s')
MESH = staircase(disk(10, 3.5), NAMES, jiggle)
KINDS = {
    "quad": ElementOptions(),
    "quad8": ElementOptions(order=2),
    "quad9": ElementOptions(order=2, nodes=9),
    "triangle": ElementOptions(split_quads=True),
    "hexahedron": ElementOptions(extrude=2.0),
}


def as_vtk_reads(path: Path) -> Any:
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    return pv.wrap(reader.GetOutput())


def test_pyvista_finds_names_as_texts(tmp_path: Path) -> None:
    write_mesh_file(MESH, tmp_path / "a.vtu")
    for grid in (pv.read(tmp_path / "a.vtu"), pv.get_reader(tmp_path / "a.vtu").read()):
        assert tuple(map(str, grid.field_data["material_names"])) == NAMES
        assert list(grid.field_data.keys()) == list(to_grid(MESH).field_data.keys())


@pytest.mark.parametrize("kind", KINDS)
def test_meshio_reads_what_is_written_by_default(tmp_path: Path, kind: str) -> None:
    meshio = pytest.importorskip("meshio")
    write_mesh_file(MESH, tmp_path / "a.vtu", KINDS[kind])
    ours, read = make_elements(MESH, KINDS[kind]), meshio.read(tmp_path / "a.vtu")
    assert np.abs(read.points[:, : ours.dimension] - ours.points).max() < 1e-9
    assert (read.cells_dict[kind] == ours.cells).all()
    assert (read.cell_data_dict["material"][kind] == ours.cell_material).all()
    columns = read.field_data["material_names"].T
    assert tuple(bytes(column).rstrip(b"\0").decode() for column in columns) == NAMES
    if kind != "quad":  # the grid of quads alone has no sets
        for name, ids in ours.node_sets.items():
            assert (np.flatnonzero(read.point_data[f"set {name}"]) == ids).all(), name


def test_names_are_there_without_our_reader(tmp_path: Path) -> None:
    write_mesh_file(MESH, tmp_path / "a.vtu")
    grid = as_vtk_reads(tmp_path / "a.vtu")
    array = grid.GetFieldData().GetAbstractArray("material_names")
    assert array.GetDataTypeAsString() == "unsigned char"
    assert array.GetComponentName(0) == "quartz"  # ParaView shows these
    assert materials_of(grid).names == NAMES
    assert from_grid(grid).materials.names == NAMES
    assert grid.imgquad.quality().n_cells == grid.n_cells  # filters take the grid as it is
    grid.save(tmp_path / "b.vtu")
    assert tuple(map(str, pv.read(tmp_path / "b.vtu").field_data["material_names"])) == NAMES


@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".vtkhdf"])
def test_saved_grids_keep_names_that_are_not_ascii(tmp_path: Path, extension: str) -> None:
    grid = to_grid(MESH)
    grid.save(tmp_path / f"a{extension}")
    write_mesh_file(MESH, tmp_path / f"b{extension}")
    for name in "ab":
        assert tuple(map(str, pv.read(tmp_path / f"{name}{extension}").field_data["material_names"])) == NAMES


def test_bytes_of_others_stay_bytes() -> None:
    grid = to_grid(MESH)
    grid.field_data["flags"] = np.zeros((3, 2), np.uint8)
    grid.field_data["rgb"] = np.array([[65, 66, 67]], np.uint8)
    for column, name in enumerate(("R", "G", "B")):
        grid.GetFieldData().GetAbstractArray("rgb").SetComponentName(column, name)
    grid.field_data["broken"] = np.array([[255], [254]], np.uint8)
    grid.GetFieldData().GetAbstractArray("broken").SetComponentName(0, "x")
    before = {name: np.array(grid.field_data[name]) for name in grid.field_data.keys()}  # noqa: SIM118
    restore_texts(grid)
    for name, values in before.items():
        assert values.dtype == grid.field_data[name].dtype
        assert (values == grid.field_data[name]).all()


def test_texts_without_signs_are_kept(tmp_path: Path) -> None:
    def add(grid: Any) -> None:
        put_texts(grid, "unit", [""])
        put_texts(grid, "two", ["", "b"])

    write_mesh_file(MESH, tmp_path / "a.vtu", None, add)
    grid = pv.read(tmp_path / "a.vtu")
    assert list(grid.field_data["unit"]) == [""]
    assert list(grid.field_data["two"]) == ["", "b"]
