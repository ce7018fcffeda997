"""Files as instruments and programs write them: a test for each row of ../shared/design/inputs.md of severity 2 and 3.

What is written here is written by the libraries that write such files. Rows of real files look for `../shared/samples`.
Rows of packed bits, mask pages, missing codecs and colours of 16 bits: tests/core/reading, test_tiff and test_formats.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from scipy.spatial import cKDTree

import imgquad_mesh
from imgquad_core.errors import InputError
from imgquad_core.picture.options import SegmentationOptions
from imgquad_core.picture.segmentation import Segmentation, segment_picture
from imgquad_core.reading.options import ReadOptions
from imgquad_mesh.datasets.images import image_array
from imgquad_mesh.datasets.pictures import read_any

ROWS, COLS = 240, 300
Array = NDArray[Any]
Saver = Callable[[Path, Array], Path]


def grains(n: int) -> Array:
    """Voronoi grains, numbered from 0."""
    centres = np.random.default_rng(8).uniform(0, 1, (n, 2)) * (ROWS, COLS)
    return np.asarray(cKDTree(centres).query(np.argwhere(np.ones((ROWS, COLS), bool)))[1].reshape(ROWS, COLS))


def cells(n: int) -> Array:
    """Cells with ground between them."""
    numbers = grains(n)
    ground = np.zeros(numbers.shape, bool)
    ground[:, 1:] |= numbers[:, 1:] != numbers[:, :-1]
    ground[1:] |= numbers[1:] != numbers[:-1]
    return np.where(ground, 0, numbers + 1)


def shades(n: int, low: float = 40.0, high: float = 210.0) -> Array:
    """A micrograph of n phases, the noise a fifth of a step."""
    levels = np.linspace(low, high, n)
    noise = np.random.default_rng(1).normal(0, (levels[1] - levels[0]) / 5, (ROWS, COLS))
    return np.asarray(levels[grains(60) % n] + noise)


LUT = np.random.default_rng(1).integers(0, 256, (3, 256)).astype(np.uint8)


def save_png(path: Path, values: Array) -> Path:
    Image.fromarray(values).save(path.with_suffix(".png"))
    return path.with_suffix(".png")


def save_npy(path: Path, values: Array) -> Path:
    np.save(path.with_suffix(".npy"), values)
    return path.with_suffix(".npy")


def save_palette_png(path: Path, values: Array) -> Path:
    image = Image.frombytes("P", (COLS, ROWS), values.astype(np.uint8).tobytes())
    image.putpalette(LUT.T.tobytes())
    image.save(path.with_suffix(".png"))
    return path.with_suffix(".png")


def save_tif(**options: Any) -> Saver:
    def save(path: Path, values: Array) -> Path:
        tifffile.imwrite(path.with_suffix(".tif"), values, **options)
        return path.with_suffix(".tif")

    return save


def no_data_tag(text: str) -> list[tuple[Any, ...]]:
    return [(42113, "s", len(text) + 1, text, True)]


def found_in(path: Path, reading: dict[str, Any] | None = None, **options: Any) -> Segmentation:
    """Read and segment a file as the command does; a word on the console is a fault."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return segment_picture(read_any(path, ReadOptions(**(reading or {}))), SegmentationOptions(**options))


# ---------------------------------------------------------------------------------------------------- labels


class Row(NamedTuple):
    """Labels of a type and the way they are saved."""

    row: str
    labels: Array
    save: Saver


LABEL_ROWS = [
    Row("16-bit label PNG, 600 cells", cells(600).astype(np.uint16), save_png),
    Row("16-bit label TIFF, 600 cells", cells(600).astype(np.uint16), save_tif()),
    Row("16-bit label TIFF, 600 cells, as .npy", cells(600).astype(np.uint16), save_npy),
    Row("8-bit label PNG with 33 labels", grains(33).astype(np.uint8), save_png),
    Row("8-bit label PNG with 40 labels", grains(40).astype(np.uint8), save_png),
    Row("8-bit TIFF of ImageJ with LUT, 120 labels", grains(120).astype(np.uint8),
        save_tif(imagej=True, metadata={"LUTs": [LUT]})),
    Row("palette PNG with 40 indices", grains(40), save_palette_png),
    Row("palette TIFF (Fiji, 8-bit glasbey), 120", grains(120).astype(np.uint8),
        save_tif(photometric="palette", colormap=LUT.astype(np.uint16) * 257)),
    Row("GeoTIFF with colour table after the pixels, 60 classes", grains(60).astype(np.uint8),
        save_tif(extratags=[(320, "H", 768, (LUT.astype(np.uint16) * 257).ravel().tolist(), True)])),
    Row("float32 labels (ImageJ 32-bit, MorphoLibJ), 120", grains(120).astype(np.float32), save_tif(imagej=True)),
    Row("float .npy, 600 labels", grains(600).astype(np.float32), save_npy),
    Row("MinIsWhite, 8 bit, labels 0 to 5", (grains(60) % 6).astype(np.uint8), save_tif(photometric="miniswhite")),
    Row("MinIsWhite, 16 bit, labels 0 to 5", (grains(60) % 6).astype(np.uint16), save_tif(photometric="miniswhite")),
    Row("16-bit RGB PNG and 32-bit labels in TIFF, 600", grains(600).astype(np.int32), save_tif(compression="zlib")),
]  # fmt: skip


@pytest.mark.parametrize("row", LABEL_ROWS, ids=[row.row for row in LABEL_ROWS])
def test_each_label_is_a_material(row: Row, tmp_path: Path) -> None:
    found = found_in(row.save(tmp_path / "a", row.labels))
    assert not found.quantised
    assert (found.image.labels == row.labels).all()


def test_ebsd_map_as_ipf_colours_has_a_material_for_each_colour(tmp_path: Path) -> None:
    colors = np.random.default_rng(3).integers(0, 256, (300, 3)).astype(np.uint8)
    found = found_in(save_png(tmp_path / "a", colors[grains(300)]))
    assert (found.image.materials.colors[found.image.labels] == colors[grains(300)]).all()


def test_grains_that_are_too_small_are_minus_2_in_defdap_and_void_on_the_command(tmp_path: Path) -> None:
    numbers = grains(83).astype(float) - 2  # as DefDAP's warped map: -1 boundary, -2 too small
    path = save_npy(tmp_path / "a", numbers)
    with pytest.raises(InputError, match=r"labels from -2 to 80: .*no_data = -2"):
        found_in(path)
    found = found_in(path, no_data=-2)
    assert (found.image.labels == np.where(numbers < 0, -1, numbers)).all()


# ------------------------------------------------------------------------------------------------------ greys


@pytest.mark.parametrize("dtype", [np.int16, np.int32, np.uint32])
def test_grey_tiff_of_a_signed_or_32_bit_type_is_divided(tmp_path: Path, dtype: type) -> None:
    path = save_tif()(tmp_path / "a", (shades(4) * 20 + 1000).astype(dtype))
    assert len(found_in(path).image.materials.labels) == 4
    assert len(found_in(path, colors=3).image.materials.labels) == 3


@pytest.mark.parametrize("factor", [1, 100])
def test_grey_npy_of_8_or_16_bits_is_what_the_array_is(tmp_path: Path, factor: int) -> None:
    values = (shades(6) * factor).astype(np.uint8 if factor == 1 else np.uint16)
    found = found_in(save_npy(tmp_path / "a", values))
    assert len(found.image.materials.labels) == 6
    assert (found.image.labels == segment_picture(values).image.labels).all()


@pytest.mark.parametrize("dtype", [np.int16, np.int8])
def test_ct_in_hounsfield_units_and_other_negative_grey_is_meshed_as_grey(tmp_path: Path, dtype: type) -> None:
    values = shades(4) * 16 - 1700 if dtype == np.int16 else shades(4) - 128
    assert len(found_in(save_tif()(tmp_path / "a", values.astype(dtype))).image.materials.labels) == 4


@pytest.mark.parametrize("n", [2, 9])
def test_float_ct_with_hot_pixels_keeps_its_classes(tmp_path: Path, n: int) -> None:
    values = (shades(6) / 255).astype(np.float32)
    values.ravel()[np.random.default_rng(0).integers(0, values.size, n)] = 900.0
    assert len(found_in(save_npy(tmp_path / "a", values)).image.materials.labels) == 6


@pytest.mark.parametrize("outside", [np.nan, np.inf, 0.0])
def test_what_lies_outside_of_a_ct_is_void_or_a_class_that_adds_no_other(tmp_path: Path, outside: float) -> None:
    y, x = np.mgrid[:ROWS, :COLS]
    beyond = np.hypot(x - 150, y - 120) > 115
    found = found_in(save_npy(tmp_path / "a", np.where(beyond, outside, shades(4)).astype(np.float32)))
    assert ((found.image.labels == (0 if outside == 0 else -1)) == beyond).mean() > 0.999
    assert len(found.image.materials.labels) == (5 if outside == 0 else 4)


# ---------------------------------------------------------------------------------------------------- no data


@pytest.mark.parametrize("text", ["-9999", "-3.4e38", "-3.4028234663852886e+38"])
@pytest.mark.parametrize("what", ["land cover", "DEM"])
def test_no_data_of_a_float_geotiff_is_left_out_and_the_classes_stay(tmp_path: Path, text: str, what: str) -> None:
    values = (grains(80) % 14 + 1 if what == "land cover" else shades(4)).astype(np.float32)
    values[:7, :200] = np.float32(text)
    found = found_in(save_tif(extratags=no_data_tag(text))(tmp_path / "a", values))
    assert len(found.image.materials.labels) == (14 if what == "land cover" else 4)
    assert ((found.image.labels == -1) == (values == np.float32(text))).all()


@pytest.mark.parametrize("number", [-9999.0, -3.4e38, 1e20])
@pytest.mark.parametrize("rows", [3, 60])
def test_no_data_that_no_tag_tells_takes_no_class_away_and_is_told_with_its_option(
    tmp_path: Path, number: float, rows: int
) -> None:
    values = shades(4).astype(np.float32)
    values[:rows, :200] = number
    path = save_npy(tmp_path / "a", values)
    found = found_in(path)
    assert len(found.image.materials.labels) == 5
    assert f"grey_{np.float32(number):.0f}" in found.image.materials.names
    assert any(f"no_data = {np.float32(number):.8g}" in text for text in found.warnings)
    left_out = found_in(path, no_data=number)
    assert len(left_out.image.materials.labels) == 4
    assert ((left_out.image.labels == -1) == (values == np.float32(number))).all()


@pytest.mark.parametrize(
    ("dtype", "text"),
    [(np.uint8, "255"), (np.uint16, "65535"), (np.int16, "-9999"), (np.int16, "-32768"), (np.int32, "-2147483648")],
)
def test_no_data_of_an_integer_geotiff_is_void(tmp_path: Path, dtype: type, text: str) -> None:
    values: Array = (grains(80) % 22).astype(dtype)
    values[:120] = int(text)  # half of them, as in pylandstats' map
    found = found_in(save_tif(extratags=no_data_tag(text))(tmp_path / "a", values))
    assert (found.image.labels == np.where(values == int(text), -1, values.astype(np.int64))).all()
    path = save_tif()(tmp_path / "b", values)
    if int(text) < 0:
        with pytest.raises(InputError, match=f"no_data = {text}"):
            found_in(path)
    assert (found_in(path, no_data=int(text)).image.labels == found.image.labels).all()


def test_unindexed_pixels_of_an_ebsd_map_go_to_the_grains_around(tmp_path: Path) -> None:
    numbers = grains(300).astype(np.int32)
    holes = np.random.default_rng(1).random(numbers.shape) < 0.01
    path = save_npy(tmp_path / "a", np.where(holes, -1, numbers))
    assert any("fill_void = 16" in text for text in found_in(path).warnings)
    assert (found_in(path, fill_void=16).image.labels == numbers).mean() > 0.998


# ------------------------------------------------------------------------------------------ pages and channels


def test_two_bands_are_asked_for(tmp_path: Path) -> None:
    two = np.dstack([shades(4), shades(4)[::-1]]).astype(np.uint8)
    path = save_tif(photometric="minisblack", planarconfig="contig", extrasamples=["unspecified"])(tmp_path / "a", two)
    with pytest.raises(InputError, match="2 channels: choose one by channel = 0 to 1"):
        found_in(path)
    assert len(found_in(path, {"channel": 1}).image.materials.labels) == 4


@pytest.mark.parametrize("n", [3, 4])
def test_slices_that_tifffile_stores_as_colours_are_told(tmp_path: Path, n: int) -> None:
    stack = np.stack([(shades(4) / (k + 1)).astype(np.uint8) for k in range(n)])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        path = save_tif()(tmp_path / "a", stack)
    assert any(f"slices, give channel 0 to {n - 1}" in note for note in read_any(path).notes)
    assert (read_any(path, ReadOptions(channel=n - 1)).values == stack[n - 1]).all()


def test_a_whole_slide_is_cropped_without_decoding_it(tmp_path: Path) -> None:
    base = np.dstack([shades(4).astype(np.uint8)] * 3)
    path = tmp_path / "a.svs"
    text = "Aperio Image Library v12.0.5\n300x240 (64x64) JPEG/RGB|AppMag = 20|MPP = 0.499"
    with tifffile.TiffWriter(path) as file:
        file.write(base, tile=(64, 64), description=text, photometric="rgb", metadata=None)
        file.write(base[::4, ::4], description="Aperio Image Library v12.0.5", photometric="rgb", metadata=None)
        file.write(base[::2, ::2], tile=(64, 64), description=text, photometric="rgb", metadata=None)
    assert (read_any(path).values == base).all()
    part = read_any(path, ReadOptions(max_pixels=5000, crop=(70, 80, 120, 130)))
    assert (part.values == base[80:130, 70:120]).all()
    assert part.calibration.size is not None
    assert part.calibration.size.text == "0.499 um"


def test_cogs_and_geotiffs_with_a_mask_are_one_picture_masked(tmp_path: Path, samples: Path) -> None:
    path, inside = tmp_path / "a.tif", np.hypot(*np.mgrid[-120:120, -150:150]) < 110
    with tifffile.TiffWriter(path) as file:
        file.write((grains(60) % 9).astype(np.uint8), photometric="minisblack")
        file.write(inside, photometric="mask", subfiletype=4)
    assert (found_in(path).image.labels == np.where(inside, grains(60) % 9, -1)).all()
    assert read_any(samples / "cogeo.tif").shape == (1024, 1024)


def test_a_map_whose_rows_start_in_the_south_is_upright(tmp_path: Path) -> None:
    matrix = [30.0, 0, 0, 5e5, 0, 30.0, 0, 4.6e6, 0, 0, 0, 0, 0, 0, 0, 1]
    labels = (grains(60) % 9).astype(np.uint8)
    picture = read_any(save_tif(extratags=[(34264, "d", 16, matrix, True)])(tmp_path / "a", labels))
    assert (picture.values == labels[::-1]).all()
    assert any("south" in note for note in picture.notes)


# ---------------------------------------------------------------------------------------- sizes and info bars


@pytest.mark.parametrize(("name", "shape", "size"), [
    ("FEI-Helios-Ebeam-8bits.tif", (442, 512), "3.3724 um"),
    ("test_tiff_Zeiss_SEM_512pix.tif", (350, 512), "11.6504 nm"),
])  # fmt: skip
def test_sem_pictures_tell_their_bar_and_their_pixel_size(
    samples: Path, name: str, shape: tuple[int, int], size: str
) -> None:
    picture = read_any(samples / name)
    assert any("info-bar crop leaves them out" in note for note in picture.notes)
    assert read_any(samples / name, ReadOptions(info_bar="crop")).shape == shape
    assert picture.calibration.size is not None
    assert picture.calibration.size.text == size
    assert imgquad_mesh.read(samples / name).spacing[0] == pytest.approx(float(size.split()[0]), rel=1e-4)


@pytest.mark.parametrize("ink", [0, 255])
def test_a_scale_that_is_drawn_into_a_micrograph_is_told_where_it_is(tmp_path: Path, ink: int) -> None:
    image = Image.fromarray(shades(3).clip(5, 250).astype(np.uint8))
    draw = ImageDraw.Draw(image)
    draw.rectangle((210, 222, 270, 226), fill=ink)
    draw.text((225, 205), "20 um", fill=ink)
    image.save(tmp_path / "a.png")
    assert read_any(tmp_path / "a.png").notes == (
        "rows 222 to 226, columns 210 to 270 look like a drawn scale, which is meshed: crop it",
    )
    clipped = save_png(tmp_path / "b", shades(3, -20, 270).clip(0, 255).astype(np.uint8))
    assert read_any(clipped).notes == ()
    drawing = save_png(tmp_path / "c", (grains(60) % 6 * 40).astype(np.uint8))
    assert read_any(drawing).notes == ()


@pytest.mark.parametrize(("options", "size"), [
    ({"imagej": True, "resolution": (1 / 0.1687, 1 / 0.1687), "metadata": {"unit": "um"}}, "0.1687 um"),
    ({"ome": True, "metadata": {"axes": "YX", "PhysicalSizeX": 0.65, "PhysicalSizeY": 0.65}}, "0.65 um"),
    ({"extratags": [(65003, "s", 3, "um", True), (65004, "s", 3, "um", True), (65009, "d", 1, 0.1687, True),
                    (65010, "d", 1, 0.1687, True)]}, "0.1687 um"),  # DigitalMicrograph's
    ({"resolution": (96, 96), "resolutionunit": "inch"}, None),  # a screen's: no millimetres from it
])  # fmt: skip
def test_pixel_sizes_in_tags_are_told_and_those_of_screens_are_not(
    tmp_path: Path, options: dict[str, Any], size: str | None
) -> None:
    path = save_tif(**options)(tmp_path / "a", shades(4).astype(np.uint8))
    found = read_any(path).calibration.size
    assert (found.text if found else None) == size
    assert imgquad_mesh.read(path).spacing[0] == (pytest.approx(float(size.split()[0]), rel=1e-4) if size else 1.0)


# ------------------------------------------------------------------ what VTK's reader of TIFF garbles, by `read`


READ_ROWS: Sequence[tuple[str, Any, dict[str, Any]]] = [
    ("tiled, 16 bits", np.uint16, {"tile": (64, 64)}),
    ("tiled, 32 bits", np.float32, {"tile": (64, 64)}),
    ("16-bit RGB", np.uint16, {"photometric": "rgb"}),
    ("LZW", np.uint8, {"compression": "lzw"}),
    ("compressed RGB", np.uint8, {"photometric": "rgb", "compression": "zlib", "rowsperstrip": 16}),
    ("ZSTD", np.uint16, {"compression": "zstd"}),
    ("LERC", np.uint16, {"compression": "lerc"}),
    ("JPEG-2000", np.uint8, {"compression": "jpeg2000", "compressionargs": {"level": 0}}),
    ("JPEG-XL", np.uint8, {"compression": "jpegxl", "compressionargs": {"lossless": True}}),
    ("PNG", np.uint16, {"compression": "png"}),
    ("64 bits", np.float64, {}),
    ("float16", np.float16, {}),
    ("MinIsWhite, 16 bits", np.uint16, {"photometric": "miniswhite"}),
]


@pytest.mark.parametrize(("row", "dtype", "options"), READ_ROWS, ids=[row[0] for row in READ_ROWS])
def test_read_gives_what_was_written(tmp_path: Path, row: str, dtype: Any, options: dict[str, Any]) -> None:
    if options.get("compression") in ("lzw", "zstd", "lerc", "jpeg2000", "jpegxl", "png"):
        pytest.importorskip("imagecodecs")
    values = (grains(60) * (1 if dtype == np.uint8 else 7)).astype(dtype)
    values = np.dstack([values, values[::-1], values[:, ::-1]]) if options.get("photometric") == "rgb" else values
    path = save_tif(**options)(tmp_path / "a", values)
    assert (image_array(imgquad_mesh.read(path)) == values).all()


def test_a_thumbnail_before_the_picture_is_an_error_that_names_the_way(tmp_path: Path) -> None:
    large = Image.fromarray((grains(6) * 40).astype(np.uint8))
    for mode, compression in (("1", "group4"), ("RGB", "jpeg"), ("CMYK", "jpeg")):
        pages = [large.resize((20, 20)).convert(mode), large.convert(mode)]
        pages[0].save(tmp_path / "a.tif", save_all=True, append_images=pages[1:], compression=compression)
        with pytest.raises(InputError, match="frame = 0 to 1"):
            imgquad_mesh.read(tmp_path / "a.tif")
        assert imgquad_mesh.read(tmp_path / "a.tif", frame=1).dimensions == (COLS + 1, ROWS + 1, 1)


@pytest.mark.parametrize("name", ["a.jpg", "a.tif"])
def test_read_follows_the_orientation_as_the_command_does(tmp_path: Path, name: str) -> None:
    image, exif = Image.fromarray((grains(6) * 40).astype(np.uint8)), Image.Exif()
    exif[274] = 6
    image.save(tmp_path / name, exif=exif)
    assert read_any(tmp_path / name).shape == (COLS, ROWS)
    assert (image_array(imgquad_mesh.read(tmp_path / name)) == read_any(tmp_path / name).values).all()


@pytest.mark.parametrize(("name", "mode"), [("a.gif", "L"), ("a.bmp", "1")])
def test_gif_and_1_bit_bmp_lie_as_png_does(tmp_path: Path, name: str, mode: str) -> None:
    image = Image.fromarray((grains(6) * 40 > 100).astype(np.uint8) * 255).convert(mode)
    image.save(tmp_path / name)
    found = segment_picture(read_any(tmp_path / name)).image.labels
    seen = np.asarray(image.convert("L")) > 100
    assert (found == np.where(seen, found[seen][0], found[~seen][0])).all()
    assert (found == segment_picture(image_array(imgquad_mesh.read(tmp_path / name))).image.labels).all()
    assert image_array(imgquad_mesh.read(tmp_path / name)).shape == (ROWS, COLS)


# ------------------------------------------------------------------------------------------------------ formats


def test_pickled_arrays_of_cellpose_name_the_way(tmp_path: Path) -> None:
    np.save(tmp_path / "a_seg.npy", {"masks": cells(20)}, allow_pickle=True)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"numpy\.save .*'masks'"):
        found_in(tmp_path / "a_seg.npy")


def test_a_shape_that_only_alpha_holds_is_told_and_does_not_grow(tmp_path: Path) -> None:
    distance = np.hypot(*np.mgrid[-120:120, -150:150]) - 80
    alpha = np.clip(127.5 - 40 * distance, 0, 255).astype(np.uint8)
    path = save_png(tmp_path / "a", np.dstack([np.full((ROWS, COLS, 3), 30, np.uint8), alpha]))
    assert any("drop-transparent" in note for note in read_any(path).notes)
    found = found_in(path, drop_transparent=True)
    assert ((found.image.labels != -1) == (alpha > 127)).all()


NOT_READ = ["dm3", "dm4", "emd", "bcf", "cpr", "crc", "csv", "asc", "jxl", "jp2", "nd2", "oib", "raw", "vol", "am"]


@pytest.mark.parametrize("extension", NOT_READ)
def test_a_format_that_is_not_read_is_named_with_the_line_that_turns_it(tmp_path: Path, extension: str) -> None:
    path = tmp_path / f"a.{extension}"
    path.write_bytes(b"\0\1\2 any content\n" * 40)
    with pytest.raises(InputError, match="not read directly: ") as told:
        read_any(path)
    assert "\n" not in str(told.value)


def test_what_a_folder_of_another_program_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.zarr").mkdir()
    with pytest.raises(InputError, match=r"a\.zarr"):
        read_any(tmp_path / "a.zarr")
    (tmp_path / "b.xyz_unknown").write_bytes(b"any")
    with pytest.raises(InputError, match="not a picture that can be read: give PNG"):
        read_any(tmp_path / "b.xyz_unknown")
