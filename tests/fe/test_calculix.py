"""CalculiX solves our decks as they are: a solver that nobody here wrote."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from imgquad_core.fe.second_order import second_order
from imgquad_core.fe.sets import fe_mesh
from imgquad_core.model import VOID
from imgquad_core.writers import write_mesh
from support.ccx import needs_ccx, solve
from support.handmade import disk, jiggle, jiggle_beside, round_inclusion, staircase

pytestmark = needs_ccx
DISK = staircase(disk(12, 4), ("matrix", "disk"), jiggle)
SAME = {"*": {"young": 210e3, "poisson": 0.3, "conductivity": 2.0}}


@pytest.mark.parametrize(("analysis", "stress"), [("plane stress", 210.0), ("plane strain", 210 / 0.91)])
def test_patch_test_in_tension(tmp_path: Path, analysis: str, stress: float) -> None:
    write_mesh(DISK, tmp_path / "a.inp", analysis=analysis, properties=SAME, deck="tension")
    found = solve(tmp_path / "a.inp", "*EL PRINT, ELSET=EALL\nS")
    across = 0.3 * stress if analysis == "plane strain" else 0.0
    assert np.abs(found["stresses"][:, 2:] - [stress, 0, across, 0, 0, 0]).max() < 1e-6 * stress
    assert found["total force"][0, 0] == pytest.approx(12 * stress, rel=1e-6)


def test_patch_test_in_heat(tmp_path: Path) -> None:
    write_mesh(DISK, tmp_path / "a.inp", properties=SAME, deck="thermal")
    found = solve(tmp_path / "a.inp", "*NODE PRINT, NSET=NALL\nNT")["temperatures"]
    assert np.abs(found[:, 1] - DISK.points[found[:, 0].astype(int) - 1, 0] / 12).max() < 1e-6


@pytest.mark.parametrize("across", [False, True])
def test_laminates_against_the_exact_answer(tmp_path: Path, across: bool) -> None:
    layers = np.repeat([0, 1, 0], 4)[:, None].repeat(12, axis=1)
    mesh = staircase(layers.T if across else layers, ("soft", "hard"), jiggle_beside(0 if across else 1, 4, 8))
    values = {"soft": {"conductivity": 1.0}, "hard": {"conductivity": 7.0}}
    write_mesh(mesh, tmp_path / "a.inp", properties=values, deck="thermal")
    flux = np.abs(solve(tmp_path / "a.inp")["total heat generation"][0, 0])
    exact = 1 / (2 / 3 + 1 / 3 / 7) if across else 2 / 3 + 7 / 3
    assert flux == pytest.approx(exact, rel=1e-3)


def test_parts_that_hang_on_no_border_do_not_stop_the_solver(tmp_path: Path) -> None:
    image = np.zeros((9, 9), int)
    image[2:7, 2:7] = VOID
    image[4, 4] = 1
    mesh = staircase(image, ("ring", "island"))
    for deck in ("tension", "thermal"):
        write_mesh(mesh, tmp_path / "a.inp", properties=SAME, deck=deck)
        solve(tmp_path / "a.inp")


def test_surfaces_take_a_load(tmp_path: Path) -> None:
    write_mesh(DISK, tmp_path / "a.inp", properties=SAME, deck="tension")
    text = (tmp_path / "a.inp").read_text()
    step = text.index("*STEP")
    end = text.index("*NODE PRINT")
    (tmp_path / "a.inp").write_text(text[:step] + "*STEP\n*STATIC\n*DSLOAD\nS_RIGHT, P, -10.\n" + text[end:])
    found = solve(tmp_path / "a.inp", "*EL PRINT, ELSET=EALL\nS")["stresses"]
    assert np.abs(found[:, 2] - 10).max() < 1e-5


@pytest.mark.parametrize(("analysis", "stress"), [("plane stress", 210.0), ("plane strain", 210 / 0.91)])
@pytest.mark.parametrize("reduced", [False, True])
def test_patch_test_with_eight_nodes(tmp_path: Path, analysis: str, stress: float, reduced: bool) -> None:
    mesh = second_order(fe_mesh(round_inclusion(4, 10, 40, 3)))
    write_mesh(mesh, tmp_path / "a.inp", analysis=analysis, reduced=reduced, properties=SAME, deck="tension")
    found = solve(tmp_path / "a.inp", "*EL PRINT, ELSET=EALL\nS")
    across = 0.3 * stress if analysis == "plane strain" else 0.0
    assert np.abs(found["stresses"][:, 2:] - [stress, 0, across, 0, 0, 0]).max() < 1e-6 * stress


def test_patch_test_in_heat_with_eight_nodes(tmp_path: Path) -> None:
    mesh = second_order(fe_mesh(round_inclusion(4, 10, 40, 3)))
    write_mesh(mesh, tmp_path / "a.inp", properties=SAME, deck="thermal")
    found = solve(tmp_path / "a.inp", "*NODE PRINT, NSET=NALL\nNT")["temperatures"]
    assert np.abs(found[:, 1] - mesh.points[found[:, 0].astype(int) - 1, 0] / 40).max() < 1e-6


@pytest.mark.parametrize("order", [1, 2])
def test_heat_flows_through_a_tube_in_axisymmetric_elements(tmp_path: Path, order: int) -> None:
    mesh = fe_mesh(staircase(np.zeros((4, 30), int), ("tube",), lambda p: 0.5 * jiggle(p)))
    mesh = replace(mesh, points=np.add(mesh.points, [10.0, 0.0]))
    mesh = second_order(mesh) if order == 2 else mesh
    write_mesh(mesh, tmp_path / "a.inp", analysis="axisymmetric", properties=SAME, deck="thermal")
    found = solve(tmp_path / "a.inp", "*NODE PRINT, NSET=NALL\nNT")["temperatures"]
    exact = np.log(mesh.points[found[:, 0].astype(int) - 1, 0] / 10) / np.log(4)
    assert np.abs(found[:, 1] - exact).max() < (1e-3 if order == 1 else 2e-5)
