"""From a picture to a solved model with one command and no edited file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv

from imgquad_mesh.__main__ import main
from support.ccx import needs_ccx, solve
from support.handmade import disk

STEEL = (
    '["*"]\nyoung = 210e3\npoisson = 0.3\nconductivity = 2.0\n["*:*"]\nnormal_stiffness = 1e9\nshear_stiffness = 1e9\n'
)


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    np.save(tmp_path / "disk.npy", disk(48, 15).astype(np.uint8))
    (tmp_path / "steel.toml").write_text(STEEL)
    return tmp_path / "disk.npy"


def run(picture: Path, output: str, *options: str) -> int:
    return main(["run", str(picture), str(picture.parent / output), "--quiet", *options])


@needs_ccx
@pytest.mark.parametrize(
    "options",
    [
        [],
        ["--analysis", "plane strain"],
        ["--order", "2"],
        ["--order", "2", "--reduced"],
        ["--extrude", "6", "--layers", "2"],
        ["--cohesive", "all"],
        ["--pixel-size", "1e-3"],
    ],
)
def test_calculix_runs_what_the_command_wrote(picture: Path, options: list[str]) -> None:
    toml = str(picture.parent / "steel.toml")
    assert run(picture, "a.inp", "--deck", "tension", "--properties", toml, *options) == 0
    stress = solve(picture.parent / "a.inp", "*EL PRINT, ELSET=EALL\nS")["stresses"]
    exact = 210 / 0.91 if "plane strain" in options else 210.0
    off = np.abs(stress[:, [2, 3, 5, 6, 7]] - [exact, 0, 0, 0, 0]).max()
    assert off < (1e-6 if "--cohesive" not in options else 1e-2) * exact


@needs_ccx
def test_calculix_conducts_heat_evenly(picture: Path) -> None:
    toml = str(picture.parent / "steel.toml")
    assert run(picture, "a.inp", "--deck", "thermal", "--properties", toml) == 0
    lines = (picture.parent / "a.inp").read_text().split("*NODE, NSET=NALL\n")[1].split("*")[0].splitlines()
    x = np.array([float(line.split(",")[1]) for line in lines])
    found = solve(picture.parent / "a.inp", "*NODE PRINT, NSET=NALL\nNT")["temperatures"][:, 1]
    assert np.abs(found - x / 48).max() < 1e-6


@pytest.mark.parametrize("output", ["a.inp", "a.msh", "a.e", "a.bdf", "a.vtu", "a.npz", "a.obj"])
def test_split_sides_without_elements_go_to_any_format(picture: Path, output: str) -> None:
    assert run(picture, output, "--cohesive", "all", "--interfaces", "sides", "--order", "2") == 0
    assert (picture.parent / output).stat().st_size > 1000


def test_grids_take_all_elements(picture: Path) -> None:
    assert run(picture, "a.vtu", "--order", "2", "--nodes", "9") == 0
    assert set(pv.read(picture.parent / "a.vtu").celltypes) == {pv.CellType.BIQUADRATIC_QUAD}
    assert run(picture, "a.vtu", "--extrude", "6", "--layers", "2", "--cohesive", "all") == 0
    grid = pv.read(picture.parent / "a.vtu")
    assert set(grid.celltypes) == {pv.CellType.HEXAHEDRON}
    assert grid.volume == pytest.approx(48 * 48 * 6)


@pytest.mark.parametrize(
    ("output", "options", "message"),
    [
        ("a.msh", ["--analysis", "heat"], ".msh files have no --analysis"),
        ("a.inp", ["--msh-version", "2.2"], ".inp files have no --msh-version"),
        ("a.inp", ["--properties", "none.toml"], "cannot read the material values none.toml"),
        ("a.inp", ["--deck", "tension"], "needs young and poisson of material"),
        ("a.inp", ["--order", "2", "--extrude", "3"], "exclude each other"),
        ("a.inp", ["--order", "2", "--nodes", "9"], "no quad9 for the analysis"),
        ("a.inp", ["--cohesive", "quartz:sand"], "there is no material 'quartz'"),
        ("a.inp", ["--extrude", "-2"], "extrude is -2.0; give a length above 0"),
        ("a.inp", ["--order", "2", "--cohesive", "all"], "write springs (interfaces: springs) or no elements between"),
        ("a.msh", ["--order", "2", "--cohesive", "all"], "Gmsh has no six-node cohesive elements"),
        ("a.e", ["--order", "2", "--cohesive", "all"], "Exodus has no six-node cohesive elements"),
        ("a.bdf", ["--cohesive", "all"], "Nastran has no cohesive elements; write .inp"),
        ("a.cdb", ["--cohesive", "all"], "An Ansys archive has no cohesive elements"),
        ("a.inp", ["--split-quads", "--extrude", "2"], "exclude each other"),
        ("a.msh", ["--plain"], ".msh files have no --plain"),
        ("a.unv", ["--order", "2", "--nodes", "9"], "UNV has no quads of nine nodes"),
        ("a.e", ["--interfaces", "sides"], "say which, with cohesive"),
        ("a.inp", ["--interfaces", "springs"], "no interface was split"),
        ("a.inp", ["--analysis", "heat", "--reduced"], "no elements of reduced integration"),
        ("a.msh", ["--interfaces", "springs", "--cohesive", "all"], ".msh files have no --interfaces springs"),
    ],
)
def test_what_cannot_be_written_is_said_in_one_line(
    picture: Path, capsys: pytest.CaptureFixture[str], output: str, options: list[str], message: str
) -> None:
    assert run(picture, output, *options) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (picture.parent / output).exists()


@needs_ccx
@pytest.mark.parametrize("directions", ["x", "xy"])
def test_calculix_runs_a_periodic_cell(picture: Path, directions: str) -> None:
    np.save(picture, np.roll(disk(48, 15), 20, axis=(0, 1)).astype(np.uint8))
    toml = str(picture.parent / "steel.toml")
    assert run(picture, "a.inp", "--periodic", directions, "--deck", "tension", "--properties", toml) == 0
    stress = solve(picture.parent / "a.inp", "*EL PRINT, ELSET=EALL\nS")["stresses"]
    assert np.abs(stress[:, [2, 3, 5]] - [210, 0, 0]).max() < 1e-4


def test_the_command_takes_the_options_of_other_programs(picture: Path) -> None:
    assert run(picture, "a.msh", "--interfaces", "none", "--split-quads", "--msh-version", "2.2") == 0
    text = (picture.parent / "a.msh").read_text()
    assert "interface" not in text
    assert '"left"' in text
    assert run(picture, "a.vtu", "--plain") == 0
    assert set(np.unique(pv.read(picture.parent / "a.vtu")["mat_id"])) == {1, 2}
    assert run(picture, "a.inp", "--cohesive", "material 1:material 1") == 0
    assert "ELSET=COHESIVE_MATERIAL_1_MATERIAL_1" in (picture.parent / "a.inp").read_text()


def test_cohesive_elements_are_refused_before_anything_is_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(tmp_path / "there is no such picture.npy", "a.bdf", "--cohesive", "all") == 2
    assert "Nastran has no cohesive elements" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--order", "2", "--msh-version", "2.2"], True),
        (["--order", "2"], False),
        (["--msh-version", "2.2"], False),
        (["--order", "2", "--nodes", "9", "--msh-version", "2.2"], False),
    ],
)
def test_who_misreads_a_file_without_a_word_is_named(picture: Path, options: list[str], told: bool) -> None:
    assert run(picture, "a.msh", *options, "--report", str(picture.parent / "a.json")) == 0
    notes = json.loads((picture.parent / "a.json").read_text())["notes"]
    assert any("NGSolve and FiPy take 8-node quads" in note for note in notes) == told
