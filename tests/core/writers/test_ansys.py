"""Ansys archives, read by mapdl-archive."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from imgquad_core.errors import InputError
from imgquad_core.fe import FEMesh, fe_mesh, split_quads
from imgquad_core.fe.cohesive import split_interfaces
from imgquad_core.fe.extrusion import extrude
from imgquad_core.fe.second_order import second_order
from imgquad_core.writers import write_mesh
from support.handmade import disk, jiggle, staircase

PICTURE = disk(10, 3.5)
PICTURE[0, :] = 2
FLAT = fe_mesh(staircase(PICTURE, ("matrix", "disk", "coating"), jiggle))
VALUES = {"*": {"young": 70e9, "poisson": 0.3, "conductivity": 2.0}, "disk": {"young": 210e9}}


@pytest.mark.parametrize("kind", ["quad4", "quad8", "tri3", "hex8"])
def test_mapdl_archive_reads_nodes_elements_materials_and_components(tmp_path: Path, kind: str) -> None:
    mapdl_archive = pytest.importorskip("mapdl_archive")
    made = {"quad4": lambda m: m, "quad8": second_order, "tri3": split_quads, "hex8": lambda m: extrude(m, 2.0, 2)}
    mesh: FEMesh = made[kind](FLAT)
    write_mesh(mesh, tmp_path / "a.cdb", properties=VALUES)
    read = mapdl_archive.Archive(str(tmp_path / "a.cdb"), parse_vtk=False)
    points = mesh.points if mesh.dimension == 3 else np.column_stack([mesh.points, np.zeros(mesh.n_points)])
    assert np.abs(read.nodes - points).max() < 1e-12
    elements = np.array(read.elem)
    assert (elements[:, 10 : 10 + mesh.cells.shape[1]] - 1 == mesh.cells).all()
    assert (elements[:, 0] - 1 == mesh.cell_material).all()
    assert {int(key[1]) for key in read.ekey} == {"quad8": {183}, "hex8": {185}}.get(kind, {182})
    nodes = {name.replace("interface_", "I_").upper(): ids for name, ids in mesh.node_sets.items()}
    sets = {**mesh.material_cells(), **mesh.element_sets}
    cells = {name.replace("interface_", "EI_").upper(): ids for name, ids in sets.items()}
    for ours, theirs in ((nodes, read.node_components), (cells, read.element_components)):
        assert ours.keys() == theirs.keys()
        for name, ids in ours.items():
            assert (np.sort(theirs[name]) - 1 == ids).all(), name


def test_values_of_materials_are_there(tmp_path: Path) -> None:
    write_mesh(FLAT, tmp_path / "a.cdb", analysis="plane strain", properties=VALUES)
    text = (tmp_path / "a.cdb").read_text()
    assert "ET,1,182\nKEYOPT,1,3,2\n" in text
    assert "MP,EX,2,210000000000.\nMP,PRXY,2,0.3\nMP,KXX,2,2.\n" in text


@pytest.mark.parametrize(
    ("mesh", "options", "message"),
    [
        (FLAT, {"analysis": "bending"}, "no quad4 for the analysis 'bending'"),
        (FLAT, {"thickness": 0.0}, "must be positive"),
        (second_order(FLAT, 9), {}, "no quad9"),
        (split_interfaces(FLAT), {}, "has no cohesive elements"),
        (fe_mesh(staircase([[0, 1]], ("a" * 33, "b"))), {}, "has 33 signs, this format takes 32"),
    ],
)
def test_what_cannot_be_written_is_said(tmp_path: Path, mesh: FEMesh, options: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        write_mesh(mesh, tmp_path / "a.cdb", **options)
    assert not list(tmp_path.iterdir())


def test_a_material_named_as_a_border_gets_a_name_of_its_own(tmp_path: Path) -> None:
    write_mesh(fe_mesh(staircase([[0, 1]], ("left", "all"))), tmp_path / "a.cdb")
    text = (tmp_path / "a.cdb").read_text()
    assert "CMBLOCK,LEFT,ELEM" in text
    assert "CMBLOCK,LEFT_2,NODE" in text
    assert "CMBLOCK,ALL_2,ELEM" in text
