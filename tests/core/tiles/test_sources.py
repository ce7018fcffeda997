"""Windows of large pictures: the same pixels whatever they are read from."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from PIL import Image

from imgquad_core.errors import InputError
from imgquad_core.reading import ReadOptions
from imgquad_core.tiles import source_of, stamp_of
from imgquad_core.tiles.sources import sample_boxes

BOX = (30, 17, 90, 101)
OPTIONS = ReadOptions()


def grey() -> np.ndarray:
    return np.random.default_rng(0).integers(0, 200, (150, 210)).astype(np.uint8)


def rgb() -> np.ndarray:
    return np.random.default_rng(1).integers(0, 200, (150, 210, 3)).astype(np.uint8)


def write(picture: np.ndarray, path: Path) -> Path:
    if path.suffix == ".npy":
        np.save(path, picture)
    elif path.suffix == ".tif":
        tifffile.imwrite(path, picture, tile=(32, 48))
    elif path.suffix == ".png":
        Image.fromarray(picture).save(path)
    else:
        zarr = pytest.importorskip("zarr")
        chunks = (64, 64, 3)[: picture.ndim]
        zarr.create_array(str(path), shape=picture.shape, chunks=chunks, dtype="u1")[:] = picture
    return path


@pytest.mark.parametrize("name", ["a.npy", "a.tif", "a.png", "a.zarr"])
@pytest.mark.parametrize("drawn", [grey, rgb])
def test_windows_are_those_of_the_picture(name: str, drawn: Any, tmp_path: Path) -> None:
    picture = drawn()
    source = source_of(write(picture, tmp_path / name), OPTIONS, tmp_path / "scratch.npy")
    assert source.shape == picture.shape[:2]
    left, upper, right, lower = BOX
    assert np.array_equal(source.read(BOX).values, picture[upper:lower, left:right])
    assert np.array_equal(source.read((0, 0, 210, 150)).values, picture)
    assert np.array_equal(source.read((209, 149, 210, 150)).values, picture[149:, 209:])
    assert (tmp_path / "scratch.npy").exists() == (name == "a.png")


def test_a_level_of_a_pyramid(tmp_path: Path) -> None:
    picture = grey()
    with tifffile.TiffWriter(tmp_path / "a.tif") as file:
        file.write(picture, tile=(32, 32), subifds=1)
        file.write(picture[::2, ::2], tile=(32, 32), subfiletype=1)
    source = source_of(tmp_path / "a.tif", ReadOptions(level=1), tmp_path / "scratch.npy")
    assert source.shape == (75, 105)
    assert np.array_equal(source.read((10, 20, 60, 70)).values, picture[::2, ::2][20:70, 10:60])
    with pytest.raises(InputError, match="level is 2"):
        source_of(tmp_path / "a.tif", ReadOptions(level=2), tmp_path / "scratch.npy")


def test_a_channel_and_a_plane_of_zarr(tmp_path: Path) -> None:
    zarr = pytest.importorskip("zarr")
    volume = np.random.default_rng(2).integers(0, 99, (4, 60, 70)).astype(np.uint16)
    zarr.create_array(str(tmp_path / "a.zarr"), shape=volume.shape, chunks=(1, 32, 32), dtype="u2")[:] = volume
    source = source_of(tmp_path / "a.zarr", ReadOptions(frame=2), tmp_path / "scratch.npy")
    assert np.array_equal(source.read((5, 6, 50, 40)).values, volume[2, 6:40, 5:50])


def test_what_is_written_anew_has_another_stamp(tmp_path: Path) -> None:
    path = write(grey(), tmp_path / "a.npy")
    before = stamp_of(path)
    assert stamp_of(path) == before
    np.save(path, grey()[:-1])
    assert stamp_of(path) != before


def test_samples_are_the_whole_or_windows_spread_in_it() -> None:
    assert sample_boxes((3000, 4000)) == [(0, 0, 4000, 3000)]
    boxes = np.array(sample_boxes((30_000, 40_000)))
    assert len(boxes) == 64
    assert ((boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])).sum() <= 1 << 24
    assert boxes.min() >= 0
    assert boxes[:, 2].max() <= 40_000
    assert boxes[:, 3].max() <= 30_000
    quarters = set(zip((boxes[:, 0] > 20_000).tolist(), (boxes[:, 1] > 15_000).tolist(), strict=True))
    assert len(quarters) == 4
