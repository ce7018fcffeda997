"""Interfaces open under load as their stiffness says, in CalculiX."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from imgquad_core.fe.cohesive import split_interfaces
from imgquad_core.fe.femesh import FEMesh
from imgquad_core.fe.second_order import second_order
from imgquad_core.fe.sets import fe_mesh
from imgquad_core.options import MeshOptions
from imgquad_core.pipeline import mesh_image
from imgquad_core.writers import write_mesh
from support.ccx import needs_ccx, solve
from support.handmade import jiggle_beside, round_inclusion, staircase

pytestmark = needs_ccx


def two_blocks(order: int) -> FEMesh:
    halves = np.repeat([0, 1], 4)[None, :].repeat(6, axis=0)
    mesh = fe_mesh(staircase(halves, ("a", "b"), jiggle_beside(0, 4)))
    return second_order(mesh) if order == 2 else mesh


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("shear", [1000.0, 250.0])
def test_a_bar_with_an_interface_opens_as_springs_in_series(tmp_path: Path, order: int, shear: float) -> None:
    mesh = split_interfaces(two_blocks(order))
    values = {
        "*": {"young": 2000.0, "poisson": 0.0},
        "*:*": {"normal_stiffness": 1000.0, "shear_stiffness": shear},
    }
    write_mesh(mesh, tmp_path / "a.inp", properties=values, deck="tension")
    found = solve(tmp_path / "a.inp", "*EL PRINT, ELSET=EALL\nS\n*NODE PRINT, NSET=NALL\nU")
    stress = 0.008 / (8 / 2000 + 1 / 1000)
    assert np.abs(found["stresses"][:, 2:] - [stress, 0, 0, 0, 0, 0]).max() < 1e-6 * stress
    u = found["displacements"][:, 1:3]
    for below, above in ((0, 3), (1, 2)):
        opening = u[mesh.cohesive[:, above]] - u[mesh.cohesive[:, below]]
        assert np.abs(opening - [stress / 1000, 0]).max() < 1e-6 * stress / 1000


def test_springs_may_be_stiffer_than_a_whole_number_is_large(tmp_path: Path) -> None:
    values = {"*": {"young": 75e9, "poisson": 0.0}, "*:*": {"normal_stiffness": 3e12, "shear_stiffness": 1e12}}
    write_mesh(split_interfaces(two_blocks(1)), tmp_path / "a.inp", properties=values, deck="tension")
    force = solve(tmp_path / "a.inp")["total force"][0, 0]
    assert force == pytest.approx(6 * 0.008 / (8 / 75e9 + 1 / 3e12), rel=1e-6)


@pytest.mark.parametrize("order", [1, 2])
def test_a_slanted_interface_is_stiff_along_its_own_axes(tmp_path: Path, order: int) -> None:
    mesh = two_blocks(order)
    mesh = split_interfaces(replace(mesh, points=mesh.points + 0.5 * mesh.points[:, [1, 1]] * [1, 0]))
    values = {
        "*": {"young": 1e9, "poisson": 0.0},
        "*:*": {"normal_stiffness": 1000.0, "shear_stiffness": 250.0},
    }
    write_mesh(mesh, tmp_path / "a.inp", properties=values, deck="tension")
    text = (tmp_path / "a.inp").read_text()
    text = text.replace("*STEP\n*STATIC\n*BOUNDARY\n", "*STEP\n*STATIC\n*BOUNDARY\nLEFT, 2, 2\nRIGHT, 2, 2\n")
    (tmp_path / "a.inp").write_text(text)
    force = solve(tmp_path / "a.inp")["total force"][0, :2]
    along = np.array([3.0, 6.0])
    length = np.linalg.norm(along)
    t = along / length
    n = np.array([t[1], -t[0]])
    stiffness = length * (1000 * np.outer(n, n) + 250 * np.outer(t, t))
    pulled = 1e-3 * np.ptp(mesh.points[:, 0])
    assert force == pytest.approx(stiffness @ [pulled, 0], rel=1e-4)


@pytest.mark.parametrize("order", [1, 2])
def test_stiff_interfaces_hold_a_mesh_with_junctions_together(tmp_path: Path, order: int) -> None:
    at = np.array([[6, 7], [25, 5], [15, 18], [5, 27], [26, 26]])
    pixels = np.stack(np.mgrid[0:32, 0:32], axis=-1).reshape(-1, 1, 2)
    labels = np.square(pixels - at).sum(axis=2).argmin(axis=1).reshape(32, 32) % 4
    whole = fe_mesh(mesh_image(labels.astype(np.int32), MeshOptions(size=4.0)))
    assert len(whole.node_sets["junctions"]) == 8
    whole = second_order(whole) if order == 2 else whole
    stiff = {"normal_stiffness": 1e10, "shear_stiffness": 1e10}
    values = {f"material {m}": {"young": 10.0 * 3**m, "poisson": 0.3} for m in range(4)} | {"*:*": stiff}
    pulls = []
    for mesh in (whole, split_interfaces(whole)):  # in plane stress CalculiX ties strain across the plane at nodes
        write_mesh(mesh, tmp_path / "a.inp", analysis="plane strain", properties=values, deck="tension")
        pulls.append(solve(tmp_path / "a.inp")["total force"][0, 0])
    assert pulls[1] == pytest.approx(pulls[0], rel=1e-5)


def test_a_weak_interface_lets_an_inclusion_go(tmp_path: Path) -> None:
    whole = fe_mesh(round_inclusion(6, 10, 40, 3))
    split = split_interfaces(whole)
    pulls = []
    for stiffness in (1e-3, 1.0, 1e6):
        values = {
            "*": {"young": 1000.0, "poisson": 0.3},
            "matrix:disk": {"normal_stiffness": stiffness, "shear_stiffness": stiffness},
        }
        write_mesh(split, tmp_path / "a.inp", properties=values, deck="tension")
        pulls.append(solve(tmp_path / "a.inp")["total force"][0, 0])
    write_mesh(whole, tmp_path / "a.inp", properties=values, deck="tension")
    bonded = solve(tmp_path / "a.inp")["total force"][0, 0]
    assert pulls[0] < pulls[1] < pulls[2] < bonded
    assert pulls[2] == pytest.approx(bonded, rel=1e-3)
    assert pulls[0] < 0.85 * bonded
