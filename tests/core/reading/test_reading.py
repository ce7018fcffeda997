"""Reading: what each format's values mean, and what is refused."""

from __future__ import annotations

import io
import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray
from PIL import Image

from imgquad_core.errors import InputError
from imgquad_core.reading.formats import ReadOptions, picture_of, read_picture

GREY = (np.arange(12).reshape(3, 4) * 20).astype(np.uint8)
RGB = np.stack([GREY, GREY[::-1], 255 - GREY], axis=-1)
COLORMAP = (np.arange(768).reshape(256, 3) % 251).astype(np.uint8)


def saved(path: Path, array: NDArray[Any], mode: str | None = None, **options: Any) -> Path:
    image = Image.frombytes(mode, array.shape[1::-1], array.tobytes()) if mode else Image.fromarray(array)
    image.save(path, **options)
    return path


@pytest.mark.parametrize("name", ["a.png", "a.bmp", "a.tif", "a.pgm", "a.gif", "a.webp", "a.npy"])
def test_grey_values_and_labels_come_as_they_are_stored(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    if name == "a.npy":
        np.save(path, GREY)
    else:
        saved(path, GREY, lossless=True) if name == "a.webp" else saved(path, GREY)
    picture = read_picture(path)
    if name == "a.webp":  # WebP knows RGB only
        assert (picture.values == GREY[..., None]).all()
    else:
        values = picture.values if picture.palette is None else picture.palette[picture.values][..., 0]
        assert (values == GREY).all()
    assert not picture.labels  # what a format does not say is judged by the pixels


@pytest.mark.parametrize("name", ["a.png", "a.bmp", "a.tif", "a.ppm"])
def test_colours_come_as_they_are_stored(tmp_path: Path, name: str) -> None:
    picture = read_picture(saved(tmp_path / name, RGB))
    assert picture.values.dtype == np.uint8
    assert (picture.values == RGB).all()


def test_a_jpeg_comes_near_its_colours_grey_or_cmyk(tmp_path: Path) -> None:
    flat = np.full((16, 16, 3), (200, 60, 30), np.uint8)
    assert abs(read_picture(saved(tmp_path / "a.jpg", flat)).values.astype(int) - flat).max() <= 3
    Image.fromarray(flat).convert("CMYK").save(tmp_path / "c.jpg")
    assert abs(read_picture(tmp_path / "c.jpg").values.astype(int) - flat).max() <= 3
    assert read_picture(saved(tmp_path / "g.jpg", flat[..., 0].copy())).values.shape == (16, 16)


def test_palette_indices_are_kept_with_their_colours(tmp_path: Path) -> None:
    image = Image.frombytes("P", (4, 3), (GREY // 20).tobytes())
    image.putpalette(COLORMAP[:12].tobytes())
    for name in ("p.png", "p.gif", "p.bmp"):
        image.save(tmp_path / name)
        picture = read_picture(tmp_path / name)
        assert picture.palette is not None
        assert (picture.values == GREY // 20).all()
        assert (picture.palette[picture.values] == COLORMAP[GREY // 20]).all()
    tifffile.imwrite(tmp_path / "p.tif", GREY, photometric="palette", colormap=COLORMAP.T.astype(np.uint16) * 257)
    picture = read_picture(tmp_path / "p.tif")
    assert (picture.values == GREY).all()
    assert picture.palette is not None
    assert (picture.palette == COLORMAP).all()


@pytest.mark.parametrize(
    "dtype", [np.uint8, np.uint16, np.int16, np.int32, np.uint32, np.float32, np.float64], ids=lambda t: t.__name__
)
@pytest.mark.parametrize("order", ["<", ">"])
def test_tiff_keeps_the_values_of_every_type(tmp_path: Path, dtype: type, order: str) -> None:
    values = (GREY.astype(float) * (300 if np.dtype(dtype).itemsize > 1 else 1) / 2).astype(dtype)
    tifffile.imwrite(tmp_path / "a.tif", values, byteorder=order)
    picture = read_picture(tmp_path / "a.tif")
    assert picture.values.dtype == dtype
    assert (picture.values == values).all()
    assert not picture.labels


def test_tiff_of_16_bit_colours_planes_and_inverted_grey(tmp_path: Path) -> None:
    deep = RGB.astype(np.uint16) * 257
    tifffile.imwrite(tmp_path / "a.tif", deep, photometric="rgb", compression="zlib")
    assert (read_picture(tmp_path / "a.tif").values == deep).all()
    tifffile.imwrite(tmp_path / "b.tif", np.moveaxis(RGB, -1, 0), photometric="rgb", planarconfig="separate")
    assert (read_picture(tmp_path / "b.tif").values == RGB).all()
    tifffile.imwrite(tmp_path / "c.tif", GREY, photometric="miniswhite")
    assert (read_picture(tmp_path / "c.tif").values == GREY).all()  # the numbers that were stored
    Image.fromarray(RGB).save(tmp_path / "d.tif", compression="tiff_lzw")  # tifffile alone has no LZW
    assert (read_picture(tmp_path / "d.tif").values == RGB).all()


def test_16_bit_png_and_small_ranges_are_not_stretched(tmp_path: Path) -> None:
    deep = GREY.astype(np.uint16) * 200
    assert (read_picture(saved(tmp_path / "a.png", deep)).values == deep).all()
    (tmp_path / "a.pgm").write_text("P2\n3 2\n4\n0 1 2 3 4 0\n")
    assert read_picture(tmp_path / "a.pgm").values.tolist() == [[0, 1, 2], [3, 4, 0]]
    (tmp_path / "b.pgm").write_text("P2\n3 2\n1000\n0 1 2 3 1000 0\n")
    assert read_picture(tmp_path / "b.pgm").values.tolist() == [[0, 1, 2], [3, 1000, 0]]
    saved(tmp_path / "p4.png", GREY // 20, "L")
    four_bit = _png_of_4_bit_grey(GREY // 20)
    (tmp_path / "four.png").write_bytes(four_bit)
    assert (read_picture(tmp_path / "four.png").values == GREY // 20).all()


def _png_of_4_bit_grey(values: NDArray[np.uint8]) -> bytes:
    import struct
    import zlib

    rows, cols = values.shape
    packed = (values[:, 0::2] << 4) | values[:, 1::2]
    data = b"".join(b"\0" + row.tobytes() for row in packed)

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", cols, rows, 4, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b"")


def test_transparent_pixels_are_not_opaque(tmp_path: Path) -> None:
    alpha = np.where(GREY > 100, 255, 0).astype(np.uint8)
    alpha[0, 1], alpha[2, 1] = 127, 128  # a soft edge ends in its middle
    for array in (np.dstack([RGB, alpha]), np.dstack([GREY, alpha])):
        picture = read_picture(saved(tmp_path / "a.png", array))
        assert picture.opaque is not None
        assert (picture.opaque == (alpha > 127)).all()
    saved(tmp_path / "rgb.png", RGB, transparency=tuple(int(v) for v in RGB[1, 2]))
    picture = read_picture(tmp_path / "rgb.png")
    assert picture.opaque is not None
    assert np.argwhere(~picture.opaque).tolist() == [[1, 2]]
    image = Image.frombytes("P", (4, 3), (GREY // 20).tobytes())
    image.putpalette(COLORMAP[:12].tobytes())
    image.save(tmp_path / "p.png", transparency=5)
    picture = read_picture(tmp_path / "p.png")
    assert picture.opaque is not None
    assert np.argwhere(~picture.opaque).tolist() == [[1, 1]]
    assert read_picture(saved(tmp_path / "full.png", np.dstack([RGB, GREY | 128]))).opaque is None


@pytest.mark.parametrize("orientation", range(1, 9))
def test_the_orientation_tag_is_followed_as_viewers_do(tmp_path: Path, orientation: int) -> None:
    from PIL import ImageOps

    exif = Image.Exif()
    exif[274] = orientation
    path = saved(tmp_path / "a.png", RGB, exif=exif)
    with Image.open(path) as image:
        seen = np.asarray(ImageOps.exif_transpose(image))
    assert (read_picture(path).values == seen).all()
    tifffile.imwrite(tmp_path / "a.tif", RGB, photometric="rgb", extratags=[(274, "H", 1, orientation, True)])
    assert (read_picture(tmp_path / "a.tif").values == seen).all()


def test_a_stack_names_its_remedy_and_the_remedy_works(tmp_path: Path) -> None:
    stack = np.tile(np.stack([GREY, GREY[::-1], GREY // 2]), (1, 1, 2))
    tifffile.imwrite(tmp_path / "s.tif", stack, photometric="minisblack")
    tifffile.imwrite(tmp_path / "i.tif", stack, imagej=True)
    Image.fromarray(stack[0]).save(
        tmp_path / "s.gif", save_all=True, append_images=[Image.fromarray(s) for s in stack[1:]]
    )
    np.save(tmp_path / "s.npy", stack)
    for name in ("s.tif", "i.tif", "s.gif", "s.npy"):
        with pytest.raises(InputError, match=r"holds \d pictures .*(frame|channel) = 0 to 2"):
            read_picture(tmp_path / name)
        assert read_picture(tmp_path / name, ReadOptions(frame=0)).shape[0] == 3
        with pytest.raises(InputError, match=r"(frame|channel) is 9"):
            read_picture(tmp_path / name, ReadOptions(frame=9))
    assert (read_picture(tmp_path / "s.tif", ReadOptions(frame=1)).values == stack[1]).all()


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.tif", "a.bmp", "a.npy", "a.ppm", "z.tif"])
def test_a_file_cut_off_at_any_place_gives_an_input_error_or_the_picture(tmp_path: Path, name: str) -> None:
    noise = np.random.default_rng(1).integers(0, 255, (40, 50, 3)).astype(np.uint8)
    path = tmp_path / name
    if name == "a.npy":
        np.save(path, noise)
    elif name == "z.tif":
        tifffile.imwrite(path, noise, photometric="rgb", compression="zlib")
    else:
        saved(path, noise)
    whole = path.read_bytes()
    for part in (1, 5, 30, 100, 128, 200, len(whole) // 2, len(whole) - 100):
        path.write_bytes(whole[:part])
        with pytest.raises(InputError, match=name):
            read_picture(path)


@pytest.mark.parametrize("content", [b"", b"hello", b"%PDF-1.4 something", b"\x89PNG\r\n\x1a\n", b"II*\0", b"\0" * 500])
def test_what_is_no_picture_is_refused(tmp_path: Path, content: bytes) -> None:
    for name in ("a.png", "a.npy", "a.tif", "a.txt"):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=name):
            read_picture(tmp_path / name)


def test_missing_files_folders_and_vtk_files_say_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"missing\.png.*No such file"):
        read_picture(tmp_path / "missing.png")
    with pytest.raises(InputError, match="directory"):
        read_picture(tmp_path)
    with pytest.raises(InputError, match=r"imgquad_mesh\.read"):
        read_picture(tmp_path / "a.vti")
    if os.geteuid() != 0:
        saved(tmp_path / "a.png", GREY).chmod(0)
        with pytest.raises(InputError, match="Permission"):
            read_picture(tmp_path / "a.png")


def test_the_pixel_limit_is_asked_before_decoding_and_can_be_raised(tmp_path: Path) -> None:
    for name in ("a.png", "a.tif", "a.npy"):
        path = tmp_path / name
        if name == "a.npy":
            np.save(path, GREY)
        else:
            saved(path, GREY)
        with pytest.raises(InputError, match=r"4 x 3 = 12 pixels, more than max_pixels = 11.*raise max_pixels"):
            read_picture(path, ReadOptions(max_pixels=11))
        assert read_picture(path, ReadOptions(max_pixels=12)).shape == (3, 4)
    # a bomb: its header promises 2 * 10^9 pixels
    buffer = io.BytesIO()
    Image.new("1", (8, 8)).save(buffer, "PNG")
    bomb = bytearray(buffer.getvalue())
    bomb[16:24] = (50_000).to_bytes(4, "big") + (40_000).to_bytes(4, "big")
    import zlib

    bomb[29:33] = zlib.crc32(bytes(bomb[12:29])).to_bytes(4, "big")
    (tmp_path / "bomb.png").write_bytes(bomb)
    with pytest.raises(InputError, match="2000000000 pixels"):
        read_picture(tmp_path / "bomb.png")
    assert Image.MAX_IMAGE_PIXELS is not None


def test_arrays_that_are_no_pictures_are_refused() -> None:
    for bad, words in (
        (np.zeros((3, 0)), "no pixels"),
        (np.zeros(5), "one plane"),
        (np.zeros((3, 4, 5)), "one slice"),
        (np.zeros((2, 3, 4, 5)), "one slice"),
        (np.array([[np.inf, np.nan]]), "no finite number"),
        (np.array([["a"]]), "type"),
        (np.array([[1j]]), "complex"),
        (np.full((2, 2, 3), -1), "from -1"),
        (np.full((2, 2, 3), 70000), "70000"),
        (np.full((2, 2, 3), 1e9), "1 \\(float\\)"),
    ):
        with pytest.raises(InputError, match=words):
            picture_of(bad)


def test_nan_is_void_and_empty_files_are_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "nan.npy", np.array([[0.0, np.nan]]))
    picture = read_picture(tmp_path / "nan.npy")
    assert picture.void is not None
    assert picture.void.tolist() == [[False, True]]
    np.save(tmp_path / "zero.npy", np.zeros((0, 3), int))
    with pytest.raises(InputError, match="pixels: give at least one"):
        read_picture(tmp_path / "zero.npy")
    np.save(tmp_path / "objects.npy", np.array([[None]]), allow_pickle=True)
    (tmp_path / "pickle.npy").write_bytes(pickle.dumps(np.zeros((3, 3))))
    for name in ("objects.npy", "pickle.npy"):
        with pytest.raises(InputError, match=r"Python objects .*never loaded: .*numpy\.save") as caught:
            read_picture(tmp_path / name)
        assert "allow_pickle" not in str(caught.value)


def test_a_picture_is_called_by_its_name_in_messages(tmp_path: Path) -> None:
    path = tmp_path / "upload.picture"
    Image.fromarray(GREY).save(path, format="PNG")
    assert read_picture(path, name="steel.png").name == "steel.png"
    with pytest.raises(InputError, match=r"^steel\.png has 4 x 3 = 12 pixels, more than"):
        read_picture(path, ReadOptions(max_pixels=11), "steel.png")
    for data in (b"", b"hello", path.read_bytes()[:40]):
        path.write_bytes(data)
        with pytest.raises(InputError) as caught:
            read_picture(path, name="steel.png")
        assert "steel.png" in str(caught.value)
        assert "upload" not in str(caught.value)


HUNGRY = """
import resource, sys
from imgquad_core.errors import InputError
from imgquad_core.reading import read_picture
read_picture(sys.argv[1])
now = next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith("VmSize"))
resource.setrlimit(resource.RLIMIT_AS, (now * 1024 + 8 * 2**20, resource.RLIM_INFINITY))
try:
    read_picture(sys.argv[2])
except InputError as error:
    print(error)
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="a limit of memory that Linux keeps")
def test_memory_that_runs_out_is_not_told_as_a_damaged_file(tmp_path: Path) -> None:
    small = saved(tmp_path / "small.png", GREY)
    large = saved(tmp_path / "large.png", np.zeros((5000, 5000), np.uint8))
    asked = [sys.executable, "-c", HUNGRY, str(small), str(large)]
    said = subprocess.run(asked, capture_output=True, text=True, check=True).stdout
    assert said.startswith(f"{large} takes more memory to read than there is: ")


def test_half_floats_are_labels_without_a_warning(recwarn: pytest.WarningsRecorder) -> None:
    labels = np.array([[0, 1], [60000, 1]], np.float16)
    assert (picture_of(labels).values == labels).all()
    assert not recwarn.list


def test_arrays_in_memory_mean_what_files_mean() -> None:
    assert picture_of(GREY).is_grey
    assert picture_of(GREY[..., None]).values.shape == (3, 4)
    assert picture_of(GREY > 50).values.max() == 1
    assert not picture_of(GREY.astype(int)).labels
    assert (picture_of(RGB / 255).values == RGB).all()
    assert (picture_of(RGB.astype(float)).values == RGB).all()
    assert (picture_of(RGB.astype(int)).values == RGB).all()
    assert (picture_of(RGB.astype(">u2") * 256).values == RGB.astype(int) * 256).all()
    picture = picture_of(np.dstack([RGB, GREY]))
    assert picture.opaque is not None
    assert (picture.opaque == (GREY > 127)).all()


def test_all_real_pictures_are_read(images: Path) -> None:
    paths = sorted([*images.glob("*.png"), *images.glob("*.jpg")])
    assert len(paths) == 17
    for path in paths:
        with Image.open(path) as image:
            assert read_picture(path).shape == image.size[::-1]
