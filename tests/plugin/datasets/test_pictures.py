"""`imgquad_mesh.read`: right pixels, names, spacing and origin; and VTK's own files with several arrays."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista as pv
import tifffile
from numpy.typing import NDArray
from PIL import Image

import imgquad_mesh
from imgquad_core import MeshOptions
from imgquad_core.errors import InputError
from imgquad_mesh.__main__ import main
from imgquad_mesh.datasets.images import image_array
from imgquad_mesh.datasets.pictures import read_any

LABELS = np.ones((30, 40), np.int32)
LABELS[8:20, 10:30] = 2


def vti(path: Path, active: str | None, spacing: float = 1.0, **arrays: NDArray[Any]) -> Path:
    image = pv.ImageData(dimensions=(41, 31, 2), spacing=(spacing, spacing, 1.0))
    for name, values in arrays.items():
        image.cell_data[name] = np.ascontiguousarray(values[::-1]).ravel()
    image.set_active_scalars(active)
    image.save(path)
    return path


NOISE = np.random.default_rng(0).random((30, 40))


@pytest.mark.parametrize("active", ["Confidence", None])
def test_the_one_array_of_integers_is_taken_whatever_is_active(tmp_path: Path, active: str | None) -> None:
    path = vti(tmp_path / "a.vti", active, Confidence=NOISE, FeatureIds=LABELS)
    picture = read_any(path)
    assert (picture.values == LABELS).all()
    assert "FeatureIds" in picture.notes[0]
    assert np.allclose(image_array(imgquad_mesh.read(path, scalars="Confidence")), NOISE)
    with pytest.raises(InputError, match=r"scalars is 'x', but .*FeatureIds \(int32\)"):
        imgquad_mesh.read(path, scalars="x")


def test_several_arrays_of_integers_are_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = vti(tmp_path / "a.vti", None, Phases=LABELS, FeatureIds=LABELS * 3)
    assert main(["run", str(path), str(tmp_path / "a.vtu"), "--quiet"]) == 2
    said = capsys.readouterr().err
    assert "Phases (int32), FeatureIds (int32): choose one by scalars (--scalars NAME)" in said
    assert said.count("\n") == 1


def test_slices_spacing_and_headers_that_promise_too_much(tmp_path: Path) -> None:
    image = pv.ImageData(dimensions=(40, 30, 3), spacing=(0.5, 0.5, 2.0))
    image["a"] = np.arange(3600, dtype=np.int32)
    image.save(tmp_path / "a.vti")
    with pytest.raises(InputError, match="frame = 0 to 2"):
        imgquad_mesh.read(tmp_path / "a.vti")
    found = imgquad_mesh.read(tmp_path / "a.vti", frame=2)
    assert found.spacing[:2] == (0.5, 0.5)
    assert (found.cell_data["picture"] == np.arange(2400, 3600)).all()
    text = (tmp_path / "a.vti").read_text(errors="replace")
    (tmp_path / "b.vti").write_text(text.replace("0 39 0 29 0 2", "0 39999 0 29999 0 2"), errors="replace")
    with pytest.raises(InputError, match="more than"):
        imgquad_mesh.read(tmp_path / "b.vti")


def test_a_metaimage_lies_as_itks_programs_show_it(tmp_path: Path) -> None:
    header = "ObjectType = Image\nNDims = 2\nDimSize = 40 30\nElementType = MET_UCHAR\nElementSpacing = 0.2 0.2\n"
    path = tmp_path / "a.mha"
    path.write_bytes(f"{header}ElementDataFile = LOCAL\n".encode() + LABELS.astype(np.uint8).tobytes())
    picture = read_any(path)
    assert (picture.values == LABELS).all()
    assert picture.calibration.size is not None
    assert picture.calibration.size.text == "0.2 mm"
    path.write_bytes(f"{header}ElementDataFile = LOCAL\n".replace("40 30", "90000 90000").encode() + b"\0" * 99)
    with pytest.raises(InputError, match="more than max_pixels"):
        read_any(path)


TILED = {"tile": (16, 16)}


@pytest.mark.parametrize(
    "options", [TILED, {"compression": "zlib", "rowsperstrip": 9}, {**TILED, "compression": "lzw"}]
)
@pytest.mark.parametrize("dtype", [np.uint16, np.float32])
def test_what_vtks_own_reader_garbles_comes_right(tmp_path: Path, options: dict[str, Any], dtype: type) -> None:
    values = np.random.default_rng(1).integers(0, 60000, (50, 70)).astype(dtype)
    tifffile.imwrite(tmp_path / "a.tif", values, **options)
    image = imgquad_mesh.read(tmp_path / "a.tif")
    assert (image_array(image) == values).all()
    assert image.bounds[:4] == (0, 70, 0, 50)


def test_an_image_as_vtk_garbles_it_is_told_with_the_remedy(tmp_path: Path) -> None:
    deep = np.dstack([LABELS * 20000] * 3).astype(np.uint16)
    tifffile.imwrite(tmp_path / "a.tif", deep, photometric="rgb")
    with pytest.warns(UserWarning, match=r"more than 8 bits in TIFF files wrong.*imgquad_mesh\.read"):
        pv.read(tmp_path / "a.tif").imgquad.segment()
    right = imgquad_mesh.read(tmp_path / "a.tif").imgquad.segment()
    assert np.bincount(right["material"]).tolist() == [LABELS.size - 240, 240]
    grey = (LABELS * 100).astype(np.uint8)
    tifffile.imwrite(tmp_path / "b.tif", grey)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pv.read(tmp_path / "b.tif").imgquad.segment()


def test_colours_palettes_and_void_come_with_the_image(tmp_path: Path) -> None:
    palette = Image.fromarray((LABELS * 3).astype(np.uint8), mode="P")
    palette.putpalette(list(range(30)))
    palette.save(tmp_path / "p.png")
    image = imgquad_mesh.read(tmp_path / "p.png")
    assert image.field_data["palette"].shape == (10, 3)
    found = image.imgquad.segment()
    assert found.field_data["material_numbers"].tolist() == [3, 6]
    assert found.field_data["material_colors"][0].tolist() == [9, 10, 11]
    values = LABELS.astype(np.int16)
    values[0, :5] = -9999
    tifffile.imwrite(tmp_path / "n.tif", values, extratags=[(42113, "s", 6, "-9999", True)])
    mesh = imgquad_mesh.read(tmp_path / "n.tif").imgquad.mesh(size=4)
    assert mesh.compute_cell_sizes()["Area"].sum() == pytest.approx(LABELS.size - 5, abs=0.01)


def geotiff(path: Path, scale: tuple[float, float] = (30.0, 30.0), epsg: int = 32633) -> Path:
    keys = (1, 1, 0, 3, 1024, 0, 1, 1, 3072, 0, 1, epsg, 3076, 0, 1, 9001)
    tags = [
        (33550, "d", 3, (*scale, 0.0), True),
        (33922, "d", 6, (0, 0, 0, 500000.0, 4600000.0, 0), True),
        (34735, "H", len(keys), keys, True),
    ]
    tifffile.imwrite(path, LABELS.astype(np.uint8), extratags=tags)
    return path


def run(path: Path, *flags: str) -> tuple[Any, dict[str, Any]]:
    out, report = path.with_suffix(".vtu"), path.with_suffix(".json")
    assert main(["run", str(path), str(out), "--size", "6", "--quiet", "--report", str(report), *flags]) == 0
    return pv.read(out), json.loads(report.read_text())


def test_a_geotiff_is_meshed_where_the_map_is(tmp_path: Path) -> None:
    path = geotiff(tmp_path / "a.tif")
    mesh, report = run(path)
    assert mesh.bounds[:4] == pytest.approx((500000, 501200, 4599100, 4600000))
    assert mesh.field_data["crs"].tolist() == ["EPSG:32633"]
    assert report["picture"]["file"]["pixel_size"]["unit"] == "m"
    assert any("30 m a pixel" in note and "taken" in note for note in report["notes"])
    assert report["materials"][0]["error"] == pytest.approx(0, abs=1e-5)
    mesh, _ = run(path, "--crop", "10,8,30,20")
    assert mesh.bounds[:4] == pytest.approx((500300, 500900, 4599400, 4599760))
    mesh, _ = run(path, "--pixel-size", "1")
    assert mesh.bounds[:4] == pytest.approx((0, 40, 0, 30))
    mesh, _ = run(path, "--pixel-size", "file:km", "--origin", "file")
    assert mesh.bounds[:4] == pytest.approx((500.0, 501.2, 4599.1, 4600.0))
    mesh, _ = run(path, "--origin", "7,8")
    assert mesh.bounds[:4] == pytest.approx((7, 1207, 8, 908))
    image = imgquad_mesh.read(path)
    assert image.bounds[:4] == pytest.approx((500000, 501200, 4599100, 4600000))
    assert image.imgquad.mesh(size=6).bounds[:4] == pytest.approx((500000, 501200, 4599100, 4600000))


def test_pixels_of_a_map_that_are_not_square_keep_their_sides(tmp_path: Path) -> None:
    mesh, report = run(geotiff(tmp_path / "a.tif", (30.0, 20.0)))
    assert mesh.bounds[:4] == pytest.approx((500000, 501200, 4599400, 4600000))
    assert report["picture"]["mesh"]["pixel_size"] == [30.0, 20.0]


def test_a_script_of_a_run_keeps_size_and_place_to_the_bit(tmp_path: Path) -> None:
    path = geotiff(tmp_path / "a.tif", (0.5971640348434448, 0.5971640348434448))
    mesh, _ = run(path, "--save-script", str(tmp_path / "a.mlx"))
    assert 'value="0.5971640348434448"' in (tmp_path / "a.mlx").read_text()
    assert mesh.bounds[0] == 500000.0


def test_a_pixel_size_is_taken_only_when_asked_for_or_on_a_map(tmp_path: Path) -> None:
    meta = {"axes": "YX", "PhysicalSizeX": 0.65, "PhysicalSizeY": 0.65}
    path = tmp_path / "a.ome.tif"
    tifffile.imwrite(path, LABELS.astype(np.uint8), ome=True, metadata=meta)
    mesh, report = run(path)
    assert mesh.bounds[:4] == pytest.approx((0, 40, 0, 30))
    assert "the file says 0.65 um a pixel by OME PhysicalSizeX: pixel-size file takes it" in report["notes"]
    mesh, _ = run(path, "--pixel-size", "file")
    assert mesh.bounds[:4] == pytest.approx((0, 26, 0, 19.5))
    mesh, _ = run(path, "--pixel-size", "file:mm")
    assert mesh.bounds[:4] == pytest.approx((0, 0.026, 0, 0.0195))
    Image.fromarray(LABELS.astype(np.uint8)).save(tmp_path / "b.png", dpi=(96, 96))
    assert main(["run", str(tmp_path / "b.png"), str(tmp_path / "b.vtu"), "--pixel-size", "file"]) == 2


@pytest.mark.parametrize("value", ["file:kg", "auto:mm", "files", -1.0, (1.0, 0.0), (1.0, 2.0, 3.0), True, None])
def test_a_nonsense_pixel_size_is_refused(value: Any) -> None:
    with pytest.raises(InputError, match="pixel_size is"):
        MeshOptions(pixel_size=value)


@pytest.mark.parametrize("value", ["middle", (1.0, float("nan")), (1.0,), 3.0, None])
def test_a_nonsense_origin_is_refused(value: Any) -> None:
    with pytest.raises(InputError, match="origin is"):
        MeshOptions(origin=value)


def test_grains_of_an_ebsd_map_carry_their_orientation_to_the_mesh(tmp_path: Path, samples: Path) -> None:
    path = tmp_path / "a.ctf"
    path.write_bytes((samples / "testdata_sqr.ctf").read_bytes())
    mesh, report = run(path)
    assert mesh.field_data["material_phases"].tolist() == ["Glaucophane"] * 4
    assert np.allclose(mesh.field_data["material_orientations"][0], (32, 30, 7), atol=1)
    assert mesh.cell_data["orientation"].shape == (mesh.n_cells, 3)
    assert np.allclose(mesh.cell_data["orientation"][mesh.cell_data["material"] == 2], (77, 72, 59), atol=1)
    assert report["materials"][1]["name"] == "Glaucophane_2"
    image = imgquad_mesh.read(path)
    assert image.active_scalars_name == "material"
    assert image.imgquad.mesh(size=6).field_data["material_names"][3] == "Glaucophane_4"
