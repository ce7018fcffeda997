"""Solutions on meshes of pictures: patch tests, exact laminates, bounds, Eshelby's inclusion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import fe_figures
from imgquad_core.fe.second_order import second_order
from imgquad_core.fe.sets import fe_mesh
from imgquad_core.model import QuadMesh
from imgquad_core.options import MeshOptions
from imgquad_core.pipeline import mesh_image
from support.ccx import needs_ccx
from support.handmade import disk, round_inclusion, staircase

pytest.importorskip("skfem")


@needs_ccx
@pytest.mark.parametrize("name", ["steel_duplex_ebsd_phase.png", "composite_weave_labels_z75.png"])
def test_patch_tests_on_real_pictures(images: Path, name: str) -> None:
    mesh = fe_mesh(mesh_image(images / name, MeshOptions(size=5.0)))
    assert fe_figures.stress_error(mesh, "plane stress", 210.0, 0.0) < 1e-6
    assert fe_figures.stress_error(mesh, "plane strain", 210 / 0.91, 0.3 * 210 / 0.91) < 1e-6
    assert fe_figures.stress_error(second_order(mesh), "plane stress", 210.0, 0.0) < 1e-6
    assert fe_figures.heat_error(mesh) < 1e-6


@needs_ccx
def test_the_effective_modulus_lies_between_the_bounds_and_converges() -> None:
    labels = disk(96, 30)
    share = labels.mean()
    found = [fe_figures.effective_modulus(labels, size, 1, 1.0, 10.0) for size in (8.0, 4.0, 2.0)]
    assert all(1 / (1 - share + share / 10) < e < 1 - share + 10 * share for e in found)
    assert abs(found[2] - found[1]) < 0.6 * abs(found[1] - found[0])


@needs_ccx
@pytest.mark.parametrize("across", [False, True])
def test_meshed_laminates_are_exact(across: bool) -> None:
    rows = np.repeat([0, 1, 0], [9, 13, 10])
    labels = np.repeat(rows[:, None], 40, axis=1)
    k = np.array([1.0, 9.0])[rows]
    mesh = fe_mesh(mesh_image(labels.T if across else labels, MeshOptions(size=5.0)))
    values = {name: {"conductivity": (1.0, 9.0)[m]} for m, name in mesh.material_names().items()}
    found = abs(fe_figures.calculix(mesh, properties=values, deck="thermal")["total heat generation"][0, 0])
    width, height = labels.T.shape[::-1] if across else labels.shape[::-1]
    exact = (1 / (1 / k).mean() if across else k.mean()) * height / width
    assert found == pytest.approx(exact, rel=1e-3)


@pytest.fixture(scope="module")
def inclusion() -> tuple[QuadMesh, QuadMesh]:
    """A disk of radius 40 in 201 x 201 pixels at size 3, meshed and as a staircase."""
    return mesh_image(disk(201, 40.0), MeshOptions(size=3.0)), staircase(disk(67, 40 / 3)).scaled(3)


@pytest.mark.parametrize("k", [10.0, 0.1])
@pytest.mark.parametrize("element", ["Q4", "Q8", "Q9"])
def test_the_flux_in_a_round_inclusion_is_eshelbys(
    inclusion: tuple[QuadMesh, QuadMesh], k: float, element: str
) -> None:
    found, stairs = (fe_figures.flux_error(mesh, 100.5, 40.0, k, element) for mesh in inclusion)
    assert found.mean < 0.002
    assert found.rms < 0.004
    assert found.element < 0.01  # the largest of all elements
    for ours, theirs in zip(found[:4], stairs[:4], strict=True):
        assert theirs > 5 * ours


@pytest.mark.parametrize("centre", [(0.2, 0.1), (0.35, 0.1), (0.5, 0.5)])
def test_it_is_wherever_the_circle_lies(centre: tuple[float, float]) -> None:
    mesh = mesh_image(disk(161, 40.0, centre), MeshOptions(size=3.0))
    assert fe_figures.flux_error(mesh, np.add(80.5, centre), 40.0, 10.0, "Q8").element < 0.01


def test_the_flux_in_an_exact_disk_is_exact() -> None:
    mesh = round_inclusion(16, 40.0, 201.0, 8)
    assert fe_figures.flux_error(mesh, 100.5, 40.0, 10.0, "Q8").element < 1e-3
