"""TIFF files as instruments and programs write them: which page, which channel, what the numbers mean."""

from __future__ import annotations

import struct
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray

from imgquad_core.errors import InputError
from imgquad_core.reading.formats import ReadOptions, read_picture

GREY = (np.arange(40 * 60).reshape(40, 60) % 251).astype(np.uint8)
RGB = np.stack([GREY, GREY[::-1], 255 - GREY], axis=-1)


def written(path: Path, array: NDArray[Any], **options: Any) -> Path:
    tifffile.imwrite(path, array, **options)
    return path


def raw_tiff(path: Path, tags: list[tuple[int, int, int, int]], data: bytes) -> Path:
    """Write a TIFF of one strip by hand: tags as (code, type, count, value); the strip follows the directory."""
    tags = sorted([*tags, (273, 4, 1, 8 + 2 + 12 * (len(tags) + 2) + 4), (279, 4, 1, len(data))])
    directory = struct.pack("<H", len(tags)) + b"".join(struct.pack("<HHII", *tag) for tag in tags) + b"\0\0\0\0"
    path.write_bytes(b"II*\0" + struct.pack("<I", 8) + directory + data)
    return path


def size_tags(cols: int, rows: int, bits: int) -> list[tuple[int, int, int, int]]:
    return [(256, 4, 1, cols), (257, 4, 1, rows), (258, 3, 1, bits), (259, 3, 1, 1), (277, 3, 1, 1), (278, 4, 1, rows)]


def one_line_or_right(path: Path) -> bool:
    """Whether a file gives an error of one line or the whole picture."""
    try:
        return read_picture(path).shape == GREY.shape
    except InputError as error:
        return "\n" not in str(error)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_inverted_grey_keeps_the_numbers_that_are_stored(tmp_path: Path, dtype: type) -> None:
    labels = (GREY % 6).astype(dtype)
    path = written(tmp_path / "a.tif", labels, photometric="miniswhite")
    assert (read_picture(path).values == labels).all()


def test_a_file_without_a_photometric_tag_is_grey(tmp_path: Path) -> None:
    path = raw_tiff(tmp_path / "a.tif", size_tags(60, 40, 8), GREY.tobytes())
    assert (read_picture(path).values == GREY).all()


def test_twelve_and_four_bits_a_pixel_are_read(tmp_path: Path) -> None:
    four = GREY % 16
    packed = (four[:, ::2] << 4) | four[:, 1::2]
    path = raw_tiff(tmp_path / "four.tif", [*size_tags(60, 40, 4), (262, 3, 1, 1)], packed.tobytes())
    assert (read_picture(path).values == four).all()
    twelve = GREY.astype(np.uint16) * 16 + 3
    a, b = twelve[:, ::2], twelve[:, 1::2]
    packed = np.stack([a >> 4, (a & 15) << 4 | b >> 8, b & 255], axis=-1).astype(np.uint8)
    path = raw_tiff(tmp_path / "twelve.tif", [*size_tags(60, 40, 12), (262, 3, 1, 1)], packed.tobytes())
    assert (read_picture(path).values == twelve).all()


@pytest.mark.parametrize("compression", ["lzw", "zlib", "packbits", "lzma", "zstd", "lerc", "jpeg2000", "png"])
def test_every_compression_is_read_with_imagecodecs(tmp_path: Path, compression: str) -> None:
    pytest.importorskip("imagecodecs")
    options: dict[str, Any] = {"compressionargs": {"level": 0}} if compression == "jpeg2000" else {}
    path = written(tmp_path / "a.tif", GREY, compression=compression, **options)
    assert (read_picture(path).values == GREY).all()


@pytest.mark.parametrize(("compression", "is_read"), [("lzw", True), ("zlib", True), ("lerc", False), ("png", False)])
def test_without_imagecodecs_the_compression_and_the_package_are_named(
    tmp_path: Path, compression: str, is_read: bool
) -> None:
    pytest.importorskip("imagecodecs")
    written(tmp_path / "a.tif", GREY, compression=compression)
    code = (
        "import sys; sys.modules['imagecodecs'] = None\n"
        "from imgquad_core.reading.formats import read_picture\n"
        "try: print(read_picture('a.tif').values.sum())\n"
        "except ValueError as error: print(error)"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    if is_read:
        assert int(run.stdout) == GREY.sum()
    else:
        assert compression.upper() in run.stdout
        assert "pip install imagecodecs" in run.stdout
        assert run.stdout.count("\n") == 1


def test_two_bands_are_asked_for_and_alpha_is_not(tmp_path: Path) -> None:
    two = np.dstack([GREY, GREY[::-1]])
    path = written(
        tmp_path / "a.tif", two, photometric="minisblack", planarconfig="contig", extrasamples=["unspecified"]
    )
    with pytest.raises(InputError, match="2 channels: choose one by channel = 0 to 1"):
        read_picture(path)
    assert (read_picture(path, ReadOptions(channel=1)).values == GREY[::-1]).all()
    with pytest.raises(InputError, match="channel is 2"):
        read_picture(path, ReadOptions(channel=2))
    path = written(
        tmp_path / "b.tif", two, photometric="minisblack", planarconfig="contig", extrasamples=["unassalpha"]
    )
    assert (read_picture(path).opaque == (GREY[::-1] > 127)).all()


def test_three_slices_taken_for_colours_are_told_and_can_be_chosen(tmp_path: Path) -> None:
    stack = np.stack([GREY, GREY // 2, GREY // 3])
    with pytest.warns(DeprecationWarning, match="photometric"):
        path = written(tmp_path / "a.tif", stack)
    picture = read_picture(path)
    assert picture.values.shape == (40, 60, 3)
    assert "slices" in picture.notes[0]
    assert (read_picture(path, ReadOptions(channel=2)).values == GREY // 3).all()


def test_a_mask_page_makes_void_and_is_no_picture_of_the_stack(tmp_path: Path) -> None:
    inside = np.hypot(*np.mgrid[-20:20, -30:30]) < 18
    path = tmp_path / "a.tif"
    with tifffile.TiffWriter(path) as file:
        file.write(GREY, photometric="minisblack")
        file.write(inside, photometric="mask", subfiletype=4)
        file.write(GREY[::2, ::2], photometric="minisblack", subfiletype=1)
    picture = read_picture(path)
    assert (picture.values == GREY).all()
    assert picture.void is not None
    assert (picture.void == ~inside).all()
    coarse = read_picture(path, ReadOptions(level=1))
    assert (coarse.values == GREY[::2, ::2]).all()
    with pytest.raises(InputError, match=r"level is 2.*0 .finest. to 1"):
        read_picture(path, ReadOptions(level=2))


def test_channels_times_and_planes_of_a_hyperstack(tmp_path: Path) -> None:
    stack = np.arange(2 * 4 * 3, dtype=np.uint16).reshape(2, 4, 3, 1, 1) * 100 + GREY
    for name, options in (("i.tif", {"imagej": True}), ("o.ome.tif", {"ome": True})):
        path = written(tmp_path / name, stack, metadata={"axes": "TZCYX"}, **options)
        with pytest.raises(InputError, match="frame = 0 to 7"):
            read_picture(path, ReadOptions(channel=1))
        with pytest.raises(InputError, match=r"2 times x 4 planes x 3 channels.*channel = 0 to 2"):
            read_picture(path, ReadOptions(frame=1))
        picture = read_picture(path, ReadOptions(frame=6, channel=2))
        assert (picture.values == stack[1, 2, 2]).all()


def test_levels_of_an_ome_pyramid_keep_the_size_of_the_whole(tmp_path: Path) -> None:
    path = tmp_path / "a.ome.tif"
    meta = {
        "axes": "YX",
        "PhysicalSizeX": 0.5,
        "PhysicalSizeY": 0.5,
        "PhysicalSizeXUnit": "µm",
        "PhysicalSizeYUnit": "µm",
    }
    with tifffile.TiffWriter(path, ome=True) as file:
        file.write(GREY, subifds=1, metadata=meta, tile=(16, 16))
        file.write(GREY[::2, ::2], subfiletype=1, tile=(16, 16))
    picture = read_picture(path)
    assert picture.calibration.size is not None
    assert picture.calibration.size.text == "0.5 um"
    coarse = read_picture(path, ReadOptions(level=1))
    assert (coarse.values == GREY[::2, ::2]).all()
    assert coarse.calibration.size is not None
    assert coarse.calibration.size.text == "1 um"


@pytest.mark.parametrize("layout", [{"tile": (16, 32)}, {"rowsperstrip": 7}, {"tile": (16, 16), "compression": "zlib"}])
@pytest.mark.parametrize("planar", [False, True])
def test_a_crop_of_a_too_large_picture_reads_its_tiles_only(tmp_path: Path, layout: Any, planar: bool) -> None:
    array = np.moveaxis(RGB, -1, 0) if planar else RGB
    plan = "separate" if planar else "contig"
    path = written(tmp_path / "a.tif", array, photometric="rgb", planarconfig=plan, **layout)
    box = (33, 17, 50, 31)
    with tifffile.TiffFile(path) as file:
        page = file.pages.first
        places = [page.decode(None, k)[1] for k in range(len(page.dataoffsets))]
        outside = [k for k, place in enumerate(places) if place[2] >= 32]
        offsets = [(page.dataoffsets[k], page.databytecounts[k]) for k in outside]
    assert offsets
    whole = bytearray(path.read_bytes())
    for start, n in offsets:
        whole[start : start + n] = b"\xff" * n  # what is not needed is not looked at
    path.write_bytes(whole)
    picture = read_picture(path, ReadOptions(max_pixels=1000, crop=box))
    assert (picture.values == RGB[17:31, 33:50]).all()
    assert picture.window == box
    assert "17 x 14 of 60 x 40" in picture.notes[0]
    with pytest.raises(InputError, match="no box"):
        read_picture(path, ReadOptions(max_pixels=1000, crop=(50, 0, 61, 3)))
    with pytest.raises(InputError, match="more than max_pixels = 100"):
        read_picture(path, ReadOptions(max_pixels=100, crop=box))


def test_no_data_is_void_for_every_type(tmp_path: Path) -> None:
    for dtype, text in ((np.uint8, "255"), (np.int16, "-9999"), (np.int32, "-2147483648"),
                        (np.float32, "-3.4e+38"),
                        (np.float32, "-3.4028234663852886e+38"), (np.float64, "nan"),
                        (np.uint16, "65535")):  # fmt: skip
        values = (GREY % 7).astype(dtype)
        values[5:9, 3:20] = np.float64(text).astype(dtype) if dtype in (np.float32, np.float64) else int(text)
        path = written(tmp_path / "a.tif", values, extratags=[(42113, "s", len(text) + 1, text, True)])
        picture = read_picture(path)
        assert picture.void is not None, (dtype, text)
        assert np.argwhere(picture.void).tolist() == [[r, c] for r in range(5, 9) for c in range(3, 20)]
        assert picture.values.min() >= 0
        assert picture.values.max() < 7
    path = written(tmp_path / "b.tif", GREY, extratags=[(42113, "s", 6, "-9999", True)])
    assert read_picture(path).void is None


def test_packed_bytes_that_unpack_to_far_more_are_refused(tmp_path: Path) -> None:
    bomb = zlib.compress(bytes(300_000_000), 9)
    tags = [tag if tag[0] != 259 else (259, 3, 1, 8) for tag in size_tags(60, 40, 8)]
    path = raw_tiff(tmp_path / "a.tif", [*tags, (262, 3, 1, 1)], bomb)
    with pytest.raises(InputError, match="unpacks to more"):
        read_picture(path)


def test_huge_sizes_and_counts_in_tags_are_one_line_errors(tmp_path: Path) -> None:
    for code, value in ((256, 2**31), (257, 2**32 - 1), (278, 0), (277, 65535), (258, 999), (259, 60000), (262, 999)):
        tags = [tag if tag[0] != code else (*tag[:3], value) for tag in [*size_tags(60, 40, 8), (262, 3, 1, 1)]]
        path = raw_tiff(tmp_path / "a.tif", tags, GREY.tobytes())
        assert one_line_or_right(path)
    many = [*size_tags(60, 40, 8), (262, 3, 1, 1), (270, 2, 2**31 - 1, 8), (33550, 12, 2**30, 8)]
    assert (read_picture(raw_tiff(tmp_path / "b.tif", many, GREY.tobytes())).values == GREY).all()


def test_samples_of_instruments(samples: Path) -> None:
    fei = read_picture(samples / "FEI-Helios-Ebeam-8bits.tif")
    assert fei.calibration.size is not None
    assert fei.calibration.size.text == "3.3724 um"  # Scan.PixelWidth; its resolution tag says 96 dots per inch
    assert "442 to 470" in fei.notes[-1]
    assert read_picture(samples / "FEI-Helios-Ebeam-8bits.tif", ReadOptions(info_bar="crop")).shape == (442, 512)
    zeiss = read_picture(samples / "test_tiff_Zeiss_SEM_512pix.tif", ReadOptions(info_bar="crop"))
    assert zeiss.shape == (350, 512)
    assert zeiss.calibration.size is not None
    assert zeiss.calibration.size.text == "11.6504 nm"
    assert read_picture(samples / "stardist_mask2d.tif").values.max() > 100
    cog = read_picture(samples / "cogeo.tif")
    assert cog.values.shape == (1024, 1024, 3)
    assert cog.calibration.crs == "EPSG:3857"


def test_no_data_of_a_palette_map_is_void(tmp_path: Path) -> None:
    values = (GREY % 7).astype(np.uint8)
    values[5:9, 3:20] = 255
    table = np.random.default_rng(0).integers(0, 65536, (3, 256)).astype(np.uint16)
    tags = [(42113, "s", 4, "255", True)]
    path = written(tmp_path / "a.tif", values, photometric="palette", colormap=table, extratags=tags)
    picture = read_picture(path)
    assert picture.palette is not None
    assert picture.void is not None
    assert np.argwhere(picture.void).tolist() == [[r, c] for r in range(5, 9) for c in range(3, 20)]
    assert (picture.values[~picture.void] == values[~picture.void]).all()
    assert picture.values.max() < 7
