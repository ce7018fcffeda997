"""What meshio reads, and with it SfePy, FElupe and others: nodes, elements, materials, sets are ours at any order."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from imgquad_core.errors import InputError
from imgquad_core.fe import FEMesh, fe_mesh, split_quads
from imgquad_core.fe.extrusion import extrude
from imgquad_core.fe.second_order import second_order
from imgquad_core.writers import write_mesh
from support.handmade import disk, jiggle, staircase

meshio = pytest.importorskip("meshio")

PICTURE = disk(10, 3.5)
PICTURE[0, :] = 2
FLAT = fe_mesh(staircase(PICTURE, ("matrix", "disk", "coating"), jiggle))
MESHES = {
    "quad4": FLAT,
    "quad8": second_order(FLAT),
    "quad9": second_order(FLAT, 9),
    "tri3": split_quads(FLAT),
    "hex8": extrude(FLAT, 2.0, 2),
}
CELLS = {"quad4": "quad", "quad8": "quad8", "quad9": "quad9", "tri3": "triangle", "hex8": "hexahedron"}
#: what meshio or the format cannot hold, checked below
REFUSED = {(".bdf", "quad9"), (".inp", "quad8"), (".inp", "quad9"), (".med", "quad9")}


def read(mesh: FEMesh, path: Path, **options: Any) -> Any:
    write_mesh(mesh, path, **options)
    return meshio.read(path)


def places(mesh: FEMesh, read_points: Any) -> None:
    points = mesh.points if mesh.dimension == 3 else np.column_stack([mesh.points, np.zeros(mesh.n_points)])
    flat = np.column_stack([read_points, np.zeros((len(read_points), 3 - read_points.shape[1]))])
    assert np.abs(flat - points).max() < 1e-9


def same_cells(mesh: FEMesh, cells: Any, order: Any = None) -> None:
    ours = mesh.cells if order is None else mesh.cells[order]
    if mesh.kind == "hex8" and not (cells == ours).all():
        assert (np.sort(cells, axis=1) == np.sort(ours, axis=1)).all()
        return
    assert (cells == ours).all()


def same_sets(found: Mapping[str, Any], ours: Mapping[str, Any]) -> None:
    for name, ids in ours.items():
        assert (np.sort(found[name]) == np.sort(ids)).all(), name


@pytest.mark.parametrize("kind", MESHES)
def test_exodus_has_its_sets_under_their_own_names(tmp_path: Path, kind: str) -> None:
    pytest.importorskip("netCDF4")
    mesh = MESHES[kind]
    found = read(mesh, tmp_path / "a.e")
    places(mesh, found.points)
    assert [block.type for block in found.cells] == [CELLS[kind]] * 3
    for block, ids in zip(found.cells, mesh.material_cells().values(), strict=True):
        same_cells(mesh, block.data, ids)
    assert list(found.point_sets) == list(mesh.node_sets)
    same_sets(found.point_sets, mesh.node_sets)


@pytest.mark.parametrize("kind", [k for k in MESHES if (".bdf", k) not in REFUSED])
def test_nastran_keeps_all_nodes_of_an_element(tmp_path: Path, kind: str) -> None:
    mesh = MESHES[kind]
    found = read(mesh, tmp_path / "a.bdf")
    places(mesh, found.points)
    cells = found.cells_dict[CELLS[kind]]
    assert cells.shape == mesh.cells.shape
    numbers = np.concatenate([block.data for block in found.cells])
    order = np.concatenate(list(mesh.material_cells().values()))
    same_cells(mesh, numbers, order)
    assert (np.concatenate(found.cell_data["nastran:ref"]) == mesh.cell_material[order] + 1).all()


@pytest.mark.parametrize("version", ["4.1", "2.2"])
@pytest.mark.parametrize("kind", MESHES)
def test_gmsh_files_have_nodes_materials_and_borders(tmp_path: Path, kind: str, version: str) -> None:
    mesh = MESHES[kind]
    found = read(mesh, tmp_path / "a.msh", version=version)
    places(mesh, found.points)
    tags = {name: int(tag) for name, (tag, _) in found.field_data.items()}
    physical, cells = found.get_cell_data("gmsh:physical", CELLS[kind]), found.cells_dict[CELLS[kind]]
    for name, ids in mesh.material_cells().items():
        same_cells(mesh, cells[physical == tags[name]], ids)
    if mesh.dimension == 2:
        line = "line" if kind in ("quad4", "tri3") else "line3"
        of, lines = found.get_cell_data("gmsh:physical", line), found.cells_dict[line]
        for name in ("left", "right", "bottom", "top"):
            assert (lines[of == tags[name]] == mesh.side_nodes(mesh.side_sets[name])).all(), name
    if version == "4.1":
        assert set(mesh.material_cells()) | {"left", "right", "bottom", "top"} <= set(found.cell_sets)


@pytest.mark.parametrize("kind", [k for k in MESHES if (".inp", k) not in REFUSED])
def test_abaqus_files_have_element_and_node_sets(tmp_path: Path, kind: str) -> None:
    mesh = MESHES[kind]
    found = read(mesh, tmp_path / "a.inp")
    places(mesh, found.points)
    same_cells(mesh, found.cells_dict[CELLS[kind]])
    same_sets(found.point_sets, {name.upper(): ids for name, ids in mesh.node_sets.items()})
    sets = {name: np.concatenate(ids) for name, ids in found.cell_sets.items()}
    same_sets(sets, {name.upper(): ids for name, ids in {**mesh.material_cells(), **mesh.element_sets}.items()})


@pytest.mark.parametrize("kind", MESHES)
def test_xdmf_has_materials_and_sides(tmp_path: Path, kind: str) -> None:
    pytest.importorskip("h5py")
    mesh = MESHES[kind]
    found = read(mesh, tmp_path / "a.xdmf")
    places(mesh, found.points)
    same_cells(mesh, found.cells_dict[CELLS[kind]])
    assert (found.cell_data["material"][0] == mesh.cell_material).all()
    sides = meshio.read(tmp_path / "a_sides.xdmf")
    for number, name in enumerate(list(mesh.side_sets)[:4], 1):
        lines = sides.cells[0].data[sides.cell_data["side_set"][0] == number]
        theirs = {tuple(sorted(line)) for line in lines.tolist()}
        assert theirs == {tuple(sorted(line)) for line in mesh.side_nodes(mesh.side_sets[name]).tolist()}, name


@pytest.mark.parametrize("kind", [k for k in MESHES if (".med", k) not in REFUSED])
def test_med_has_groups(tmp_path: Path, kind: str) -> None:
    pytest.importorskip("h5py")
    pytest.importorskip("gmsh")
    mesh = MESHES[kind]
    found = read(mesh, tmp_path / "a.med")
    index = [block.type for block in found.cells].index(CELLS[kind])
    tags = found.cell_data["cell_tags"][index]
    counts = {found.cell_tags[t][0].strip(): int((tags == t).sum()) for t in np.unique(tags)}
    assert counts == {name: len(ids) for name, ids in mesh.material_cells().items()}


def test_off_of_triangles_is_read(tmp_path: Path) -> None:
    pv = pytest.importorskip("pyvista")
    mesh = MESHES["tri3"]
    found = read(mesh, tmp_path / "a.off")
    places(mesh, found.points)
    same_cells(mesh, found.cells_dict["triangle"])
    grid = pv.read(tmp_path / "a.off")
    assert (grid.n_cells, grid.n_points) == (mesh.n_cells, mesh.n_points)


@pytest.mark.parametrize(("extension", "kind"), sorted(REFUSED))
def test_what_is_said_to_be_refused_is_refused(tmp_path: Path, extension: str, kind: str) -> None:
    if extension == ".med":
        pytest.importorskip("gmsh")
        pytest.importorskip("h5py")
    with pytest.raises((InputError, SystemExit, KeyError)):
        read(MESHES[kind], tmp_path / f"a{extension}")
