"""Our figures agree with MeshLab's and PyVista's, and a figure that is wrong is found."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from imgquad_core.errors import QualityError
from imgquad_core.model import Materials, QuadMesh
from imgquad_core.options import MeshOptions
from imgquad_core.pipeline import mesh_image
from imgquad_core.tracing import trace_mesh
from imgquad_mesh.meshlab import crosscheck as module
from imgquad_mesh.meshlab.crosscheck import Comparison, crosscheck, touching_points
from imgquad_mesh.meshlab.pymeshlab_filters import MissingMeshLab, meshlab_filters
from support import ROOT

IMAGES = ROOT.parent / "shared" / "images"
CLEAN = (
    "rock_sandstone_labels_2a", "composite_weave_labels_z75", "im2mesh_7phases", "geology_hamersley_west",
    "steel_duplex_ebsd_phase", "concrete_crack_segmented", "brain_labels_s01_axial",
)  # fmt: skip

try:
    meshlab_filters()
    _MISSING = ""
except MissingMeshLab as error:
    _MISSING = str(error)

pytestmark = pytest.mark.skipif(bool(_MISSING), reason=_MISSING or "-")


def wobbly_grid(n: int, hole: bool = False) -> QuadMesh:
    """n x n quads, shaken, of three materials; with `hole` two squares are cut out that touch in one point."""
    rng = np.random.default_rng(n)
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
    points = np.stack([x.ravel(), y.ravel()], axis=1) + rng.uniform(-0.2, 0.2, ((n + 1) ** 2, 2))
    first = np.array([j * (n + 1) + i for j in range(n) for i in range(n)])
    quads = first[:, None] + np.array([0, 1, n + 2, n + 1])
    col, row = first % (n + 1), first // (n + 1)
    material = np.where((abs(col - n / 2) < n / 6) & (abs(row - n / 2) < n / 6), 7, np.where(col < n / 2, 1, 3))
    if hole:
        a, b = n // 4, n // 2
        keep = ~((col >= a) & (col < b) & (row >= a) & (row < b)) & ~(
            (col >= b) & (col < b + a) & (row >= b) & (row < b + a)
        )
        quads, material = quads[keep], material[keep]
    used, corners = np.unique(quads, return_inverse=True)
    materials = Materials(np.array([1, 3, 7]), ("a", "b", "c"), np.array([[10, 0, 0], [20, 0, 0], [200, 1, 2]]))
    return trace_mesh(points[used], corners.reshape(-1, 4), material, materials)


@pytest.mark.parametrize("hole", [False, True])
def test_figures_agree_on_shaken_grids(hole: bool) -> None:
    mesh = wobbly_grid(24, hole)
    found = crosscheck(mesh)
    assert found.passed, found.table
    found.require(mesh)
    assert touching_points(mesh) == hole
    names = " ".join(c.name for c in found.comparisons)
    for word in ("area of a", "perimeter of c", "interfaces", "border edges", "components", "right angle", "Jacobian"):
        assert word in names


def test_figures_agree_on_a_mesh_of_ours() -> None:
    labels = np.zeros((40, 50), np.int32)
    row, col = np.indices(labels.shape)
    labels[(row - 20) ** 2 + (col - 25) ** 2 < 144] = 2
    mesh = mesh_image(labels, MeshOptions(size=3, drop=("0",)))
    assert crosscheck(mesh).passed
    assert crosscheck(mesh_image(labels, MeshOptions(size=3, pixel_size=1e-3))).passed


@pytest.mark.parametrize("name", ["quad_areas", "corner_angles", "scaled_jacobian"])
def test_wrong_measure_is_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    right = getattr(module, name)

    def wrong(*values: Any) -> Any:
        return right(*values) * (1 + 1e-4)

    monkeypatch.setattr(module, name, wrong)
    mesh = wobbly_grid(8)
    found = crosscheck(mesh)
    assert not found.passed
    with pytest.raises(QualityError, match="figures differ") as raised:
        found.require(mesh)
    assert raised.value.mesh is mesh


def test_wrong_region_or_chain_is_found() -> None:
    mesh = wobbly_grid(8)
    region = mesh.quad_region.copy()
    region[region == 0] = 1  # the interface between them is still in the chains
    assert not crosscheck(replace(mesh, quad_region=region)).passed
    sides = mesh.chain_regions.copy()
    sides[0] = sides[0, 0]
    assert not crosscheck(replace(mesh, chain_regions=sides)).passed


def test_difference_is_relative_to_the_scale() -> None:
    assert Comparison("x", "MeshLab", 1.0, 1.0, 0.0).agrees
    assert Comparison("x", "MeshLab", 100.0, 100.0009, 100.0).agrees
    assert not Comparison("x", "MeshLab", 100.0, 100.0011, 100.0).agrees
    assert not Comparison("x", "MeshLab", 1.0, float("nan"), 1.0).agrees


def test_table_has_a_line_a_figure() -> None:
    found = crosscheck(wobbly_grid(6))
    assert len(found.table.splitlines()) == len(found.comparisons) + 1


@pytest.mark.parametrize("name", CLEAN)
def test_figures_agree_on_clean_pictures(name: str) -> None:
    path = IMAGES / f"{name}.png"
    if not path.is_file():
        pytest.skip(f"{path} is not here")
    mesh = mesh_image(path, MeshOptions(size=10.0, effort="fast"))
    found = crosscheck(mesh)
    assert found.passed, found.table


def test_command_checks_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from imgquad_mesh.__main__ import main

    np.save(tmp_path / "labels.npy", np.kron(np.eye(3, dtype=np.int32), np.ones((8, 8), np.int32)))
    arguments = ["run", str(tmp_path / "labels.npy"), str(tmp_path / "m.vtu"), "--crosscheck"]
    assert main([*arguments, "--save-script", str(tmp_path / "m.mlx")]) == 0
    assert "length of interfaces" in capsys.readouterr().out
    arguments = ["script", str(tmp_path / "m.mlx"), "--input", str(tmp_path / "labels.npy"), "--quiet"]
    assert main([*arguments, "--output", str(tmp_path / "again.vtu")]) == 0
    assert (tmp_path / "again.vtu").read_bytes() == (tmp_path / "m.vtu").read_bytes()


def test_command_ends_with_code_three_where_figures_differ(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from imgquad_mesh.__main__ import main

    monkeypatch.setattr(module, "touching_points", lambda mesh: 5)
    np.save(tmp_path / "labels.npy", np.zeros((8, 8), np.int32))
    assert main(["run", str(tmp_path / "labels.npy"), str(tmp_path / "m.vtu"), "--crosscheck", "--quiet"]) == 3
    assert "points where two parts touch" in capsys.readouterr().err
    assert (tmp_path / "m.vtu").is_file()
