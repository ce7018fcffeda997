"""The command: what it writes, what it says, how it fails."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from PIL import Image

from imgquad_mesh.__main__ import main

SECONDS = ["read", "segment", "denoise", "absorb", "boundary", "smooth", "mesh", "write", "total"]


def disc_labels() -> np.ndarray:
    """A disc of material 3 in material 1, in 40 x 60 pixels, above the middle."""
    y, x = np.mgrid[:40, :60] + 0.5
    return np.where(np.hypot(x - 25, y - 16) < 11, 3, 1).astype(np.uint8)


@pytest.fixture
def disc(tmp_path: Path) -> Path:
    path = tmp_path / "disc.png"
    Image.fromarray(disc_labels()).save(path)
    return path


def run(*args: object) -> int:
    return main(["run", *map(str, args)])


def test_run_writes_all_that_is_asked_for(disc: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = ("mesh.vtu", "labels.npy", "lines.vtp", "report.json", "mesh.png")
    mesh, labels, lines, report, picture = (tmp_path / name for name in names)
    flags = ("--labels-out", labels, "--boundaries-out", lines, "--report", report, "--picture", picture)
    assert run(disc, mesh, "--size", 3, "--pixel-size", 0.5, *flags) == 0

    grid = pv.read(mesh)
    assert set(grid.celltypes) == {pv.CellType.QUAD}
    assert grid.cell_data["material"].dtype == np.int32
    assert grid.bounds == pytest.approx((0, 30, 0, 20, 0, 0))
    assert np.array_equal(np.load(labels), disc_labels())
    assert np.load(labels).dtype == np.int32
    inside = grid.extract_cells(grid.cell_data["material"] == 3)
    assert inside.center[:2] == pytest.approx((12.5, 12.0), abs=0.05)  # above the middle, in halves of a pixel
    assert inside.area == pytest.approx(np.sum(disc_labels() == 3) / 4, rel=1e-3)

    polylines = pv.read(lines)
    assert set(map(tuple, polylines.cell_data["boundary_labels"])) <= {(1, 3), (3, 1), (1, -1), (-1, 1)}
    assert Image.open(picture).width > 500

    told = json.loads(report.read_text())
    assert list(told["seconds"]) == SECONDS
    assert told["quality"]["inverted"] == 0
    assert [row["material"] for row in told["materials"]] == [1, 3]
    assert told["materials"][1]["pixels"] == told["materials"][1]["clean_pixels"] == np.sum(disc_labels() == 3)
    assert told["materials"][1]["error"] == pytest.approx(0, abs=1e-3)
    assert told["counts"]["regions"] == {"picture": 2, "clean": 2, "meshed": 2}
    assert told["options"]["size"] == 3
    assert told["versions"]["numpy"] == np.__version__
    assert told["peak_memory_mb"] > 10
    pixels, quads = told["rows"] * told["columns"], told["quality"]["n_quads"]
    assert told["peak_bytes_per_pixel"] * pixels == pytest.approx(1e6 * told["peak_memory_mb"], rel=1e-3)
    assert told["peak_bytes_per_quad"] * quads == pytest.approx(1e6 * told["peak_memory_mb"], rel=1e-3)

    printed = capsys.readouterr()
    assert f"{told['quality']['n_quads']} quads" in printed.out
    assert printed.err == "" or printed.err.startswith("first run")  # no progress bar where there is no terminal


def test_same_input_gives_the_same_bytes(disc: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        assert run(disc, tmp_path / f"{name}.vtu", "--quiet", "--picture", tmp_path / f"{name}.png") == 0
    for kind in ("vtu", "png"):
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()


def test_quiet_prints_nothing(disc: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(disc, tmp_path / "mesh.vtu", "--quiet") == 0
    assert capsys.readouterr() == ("", "")


def test_dropped_material_leaves_a_hole(disc: Path, tmp_path: Path) -> None:
    labels = tmp_path / "labels.npy"
    assert run(disc, tmp_path / "mesh.vtu", "--drop", 3, "--labels-out", labels, "--quiet") == 0
    grid = pv.read(tmp_path / "mesh.vtu")
    assert set(grid.cell_data["material"]) == {1}
    assert grid.area == pytest.approx(np.sum(disc_labels() == 1), rel=1e-3)
    assert np.array_equal(np.load(labels), np.where(disc_labels() == 3, -1, 1))


def test_materials_are_merged_renamed_and_recoloured(disc: Path, tmp_path: Path) -> None:
    edits = ("--rename", "3=the, disc", "--recolor", "the, disc=#ff8000", "--rename", "1=ground")
    assert run(disc, tmp_path / "a.vtu", *edits, "--drop", "ground", "--report", tmp_path / "a.json", "--quiet") == 0
    grid = pv.read(tmp_path / "a.vtu")
    assert list(grid.field_data["material_names"]) == ["ground", "the, disc"]
    assert grid.field_data["material_colors"][1].tolist() == [255, 128, 0]
    told = json.loads((tmp_path / "a.json").read_text())
    assert told["options"]["rename"] == {"3": "the, disc", "1": "ground"}
    assert [row["name"] for row in told["materials"]] == ["ground", "the, disc"]
    assert run(disc, tmp_path / "b.vtu", "--merge", "1,3=all", "--report", tmp_path / "b.json", "--quiet") == 0
    assert set(pv.read(tmp_path / "b.vtu").cell_data["material"]) == {1}
    assert json.loads((tmp_path / "b.json").read_text())["options"]["merge"] == {"1,3": "all"}


def test_crop_counts_from_the_upper_left_corner(disc: Path, tmp_path: Path) -> None:
    labels = tmp_path / "labels.npy"
    assert run(disc, tmp_path / "mesh.vtu", "--crop", "10,5,40,25", "--labels-out", labels, "--quiet") == 0
    assert np.array_equal(np.load(labels), disc_labels()[5:25, 10:40])
    assert pv.read(tmp_path / "mesh.vtu").bounds[:4] == pytest.approx((0, 30, 0, 20))


def test_size_of_one_material(disc: Path, tmp_path: Path) -> None:
    assert run(disc, tmp_path / "plain.vtu", "--size", 4, "--quiet") == 0
    assert run(disc, tmp_path / "fine.vtu", "--size", 4, "--size-of", "3=1.5", "--quiet") == 0
    count = [np.sum(pv.read(tmp_path / f"{name}.vtu").cell_data["material"] == 3) for name in ("plain", "fine")]
    assert count[1] > 3 * count[0]


def test_label_picture_shows_the_materials(disc: Path, tmp_path: Path) -> None:
    labels = tmp_path / "labels.png"
    assert run(disc, tmp_path / "mesh.vtu", "--labels-out", labels, "--quiet") == 0
    assert np.array_equal(np.asarray(Image.open(labels)), disc_labels())


def test_image_data_of_vtk_is_read_top_row_first(disc: Path, tmp_path: Path) -> None:
    pv.read(disc).save(tmp_path / "disc.vti")
    labels = tmp_path / "labels.npy"
    assert run(tmp_path / "disc.vti", tmp_path / "mesh.vtu", "--labels-out", labels, "--quiet") == 0
    assert np.array_equal(np.load(labels), disc_labels())


def test_unmet_quality_is_code_3_with_the_mesh_and_the_places(
    disc: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mesh, report = tmp_path / "mesh.vtu", tmp_path / "report.json"
    assert run(disc, mesh, "--min-quality", 1.0, "--quiet", "--report", report) == 3
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert "scaled Jacobian below 1" in message
    assert "at (" in message
    assert pv.read(mesh).n_cells > 100
    quality = json.loads(report.read_text())["quality"]
    assert quality["below_limit"] > 0
    assert quality["worst"][0]["scaled_jacobian"] == pytest.approx(quality["min_sj"])
    assert run(disc, mesh, "--min-quality", 0.1, "--quiet") == 0


def test_demo_writes_picture_mesh_and_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", str(tmp_path / "new" / "demo")]) == 0
    names = {path.name for path in (tmp_path / "new" / "demo").iterdir()}
    assert names == {"rock.png", "rock.vtu", "rock.json", "mesh.png"}
    assert "noise: " in capsys.readouterr().out
