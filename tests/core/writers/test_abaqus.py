"""Abaqus input files, read back by their own rules (the solver itself reads them in tests/fe)."""

from __future__ import annotations

from itertools import chain
from pathlib import Path

import numpy as np
import pytest

from imgquad_core.errors import InputError
from imgquad_core.fe.sets import fe_mesh
from imgquad_core.writers import write_mesh
from support.handmade import disk, jiggle, staircase

MESH = staircase(disk(8, 3), ("matrix", "Ein Kreis!"), jiggle)
STEEL = {"*": {"young": 210e9, "poisson": 0.3, "conductivity": 50.0}}


def keyword_blocks(path: Path) -> dict[str, list[list[str]]]:
    """Data lines below each keyword line."""
    blocks: dict[str, list[list[str]]] = {}
    for line in path.read_text().splitlines():
        if line.startswith("*"):
            data = blocks.setdefault(line, [])
        else:
            data.append(line.split(", "))
    return blocks


def test_nodes_elements_and_sets_come_back(tmp_path: Path) -> None:
    write_mesh(MESH, tmp_path / "a.inp", analysis="plane strain", regions=True)
    blocks, mesh = keyword_blocks(tmp_path / "a.inp"), fe_mesh(MESH)
    nodes = np.array(blocks["*NODE, NSET=NALL"], float)
    elements = np.array(blocks["*ELEMENT, TYPE=CPE4, ELSET=EALL"], int)
    assert np.abs(nodes[:, 1:] - mesh.points).max() < 1e-11
    assert (elements[:, 1:] - 1 == mesh.cells).all()
    kreis = np.array(list(chain.from_iterable(blocks["*ELSET, ELSET=EIN_KREIS"])), int)
    assert (kreis - 1 == mesh.material_cells()["Ein Kreis!"]).all()
    assert "*ELSET, ELSET=MATRIX_REGION_1" in blocks
    left = np.array(list(chain.from_iterable(blocks["*NSET, NSET=LEFT"])), int)
    assert (left - 1 == mesh.node_sets["left"]).all()
    side = np.array([[e, s[1:]] for e, s in blocks["*SURFACE, NAME=S_INTERFACE_EIN_KREIS_MATRIX, TYPE=ELEMENT"]], int)
    assert (side - 1 == mesh.side_sets["interface_Ein Kreis!_matrix"]).all()


def test_reals_and_lines_are_as_short_as_calculix_wants(tmp_path: Path) -> None:
    mesh = MESH.scaled(-1 / 3 * 1e-120).scaled(-1.0)
    write_mesh(mesh, tmp_path / "a.inp")
    nodes = keyword_blocks(tmp_path / "a.inp")["*NODE, NSET=NALL"]
    assert max(len(v) for row in nodes for v in row) <= 20
    assert max(map(len, (tmp_path / "a.inp").read_text().splitlines())) <= 132


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"analysis": "plane"}, "no analysis 'plane'"),
        ({"analysis": "solid"}, "no quad4 for the analysis 'solid'"),
        ({"deck": "bending"}, "no deck 'bending'"),
        ({"deck": "tension"}, "needs young and poisson of material 'matrix'"),
        ({"deck": "tension", "properties": {"matrix": {"young": 1, "poisson": 0}}}, "of material 'Ein Kreis!'"),
        ({"properties": {"*": {"young": -1}}}, r"\[\*\] young = -1 must be"),
        ({"properties": {"*": {"E": 1}}}, "unknown value 'E'"),
        ({"thickness": 0}, "thickness"),
        ({"colour": "red"}, "no option 'colour'; options: analysis"),
    ],
)
def test_what_cannot_be_written_is_said_and_leaves_no_file(tmp_path: Path, options: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        write_mesh(MESH, tmp_path / "a.inp", **options)
    assert list(tmp_path.iterdir()) == []


def test_a_radius_must_not_be_negative(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="x is the radius"):
        write_mesh(MESH.scaled(-1), tmp_path / "a.inp", analysis="axisymmetric")


def test_a_name_too_long_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="takes 80"):
        write_mesh(staircase([[0, 1]], ("a" * 50, "b" * 50)), tmp_path / "a.inp")


def test_names_that_are_one_in_the_file_are_told_apart(tmp_path: Path) -> None:
    write_mesh(staircase([[0, 1, 2]], ("α quartz", "Quartz", "eall")), tmp_path / "a.inp")
    text = (tmp_path / "a.inp").read_text()
    for name in ("QUARTZ", "QUARTZ_2", "EALL_2"):
        assert f"*ELSET, ELSET={name}\n" in text


def test_properties_from_toml(tmp_path: Path) -> None:
    toml = tmp_path / "values.toml"
    toml.write_text('["*"]\nyoung = 2e9\npoisson = 0.25\n["Ein Kreis!"]\nyoung = 1e9\n')
    write_mesh(MESH, tmp_path / "a.inp", properties=toml)
    text = (tmp_path / "a.inp").read_text()
    assert "*MATERIAL, NAME=MATRIX\n*ELASTIC\n2000000000., 0.25\n" in text
    assert "*MATERIAL, NAME=EIN_KREIS\n*ELASTIC\n1000000000., 0.25\n" in text
    toml.write_text("young = 3\n")
    with pytest.raises(InputError, match="outside a table"):
        write_mesh(MESH, tmp_path / "a.inp", properties=toml)
    toml.write_text("[quartz\n")
    with pytest.raises(InputError, match="is not TOML"):
        write_mesh(MESH, tmp_path / "a.inp", properties=toml)
    with pytest.raises(InputError, match="cannot read the material values"):
        write_mesh(MESH, tmp_path / "a.inp", properties=tmp_path / "none.toml")


def test_same_mesh_same_bytes(tmp_path: Path) -> None:
    write_mesh(MESH, tmp_path / "a.inp", deck="tension", properties=STEEL)
    write_mesh(MESH, tmp_path / "b.inp", deck="tension", properties=STEEL)
    assert (tmp_path / "a.inp").read_bytes() == (tmp_path / "b.inp").read_bytes()


GRAINS = """
["*"]
young = 1.0
["Ein Kreis!"]
user_material = [1, 2.5, 3, 4, 5, 6, 7, 8, 9]
depvar = 12
orientation = [1, 0, 0, 0, 1, 0]
["matrix_region_2"]
user_material = [0.0, 45.0, 0.0]
abaqus = ["*PLASTIC", "200., 0."]
"""


def test_grains_have_constants_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "g.toml").write_text(GRAINS)
    picture = disk(12, 3)
    picture[:, 1] = 1  # cuts a strip off the matrix, region 1 or 2
    mesh = fe_mesh(staircase(picture, ("matrix", "Ein Kreis!")))
    write_mesh(mesh, tmp_path / "a.inp", properties=tmp_path / "g.toml")
    text = (tmp_path / "a.inp").read_text()
    assert (
        "*MATERIAL, NAME=EIN_KREIS\n*ELASTIC\n1., 0.\n*DEPVAR\n12\n*USER MATERIAL, CONSTANTS=9\n"
        "1., 2.5, 3., 4., 5., 6., 7., 8.\n9.\n*ORIENTATION, NAME=O_EIN_KREIS, SYSTEM=RECTANGULAR\n"
        "1., 0., 0., 0., 1., 0.\n*SOLID SECTION, ELSET=EIN_KREIS, MATERIAL=EIN_KREIS, ORIENTATION=O_EIN_KREIS\n"
    ) in text
    assert (
        "*MATERIAL, NAME=MATRIX_REGION_2\n*ELASTIC\n1., 0.\n*USER MATERIAL, CONSTANTS=3\n0., 45., 0.\n"
        "*PLASTIC\n200., 0.\n*SOLID SECTION, ELSET=MATRIX_REGION_2, MATERIAL=MATRIX_REGION_2\n"
    ) in text
    blocks = keyword_blocks(tmp_path / "a.inp")
    sections = [line.split("ELSET=")[1].split(",")[0] for line in text.splitlines() if line.startswith("*SOLID")]
    elements = [int(i) for name in sections for row in blocks[f"*ELSET, ELSET={name}"] for i in row]
    assert sorted(elements) == list(range(1, mesh.n_cells + 1))  # each element has one section


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"matrix": {"user_material": [1, "x"]}}, "must be a list of 1 or more numbers"),
        ({"matrix": {"user_material": 3}}, "must be a list"),
        ({"matrix": {"orientation": [1, 0, 0]}}, "must be a list of 6 numbers"),
        ({"matrix": {"depvar": 1.5}}, "must be a whole number"),
        ({"matrix": {"abaqus": ["200., 0."]}}, "the first one a keyword"),
        ({"matrix_region_9": {"young": 1}}, "there is no region 'matrix_region_9'"),
    ],
)
def test_values_of_ones_own_are_checked(tmp_path: Path, table: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        write_mesh(MESH, tmp_path / "a.inp", properties=table)
    assert list(tmp_path.iterdir()) == []
