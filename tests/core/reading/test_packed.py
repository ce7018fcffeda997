"""Packed bytes that promise or hold too much are refused before they are unpacked."""

from __future__ import annotations

import io
import lzma
import struct
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from imgquad_core.errors import InputError
from imgquad_core.reading.formats import ReadOptions, read_picture

SIDE, MANY = 16, 60_000
#: bytes that a bomb unpacks to, and what reading may use instead
BOMB, MOST = 200_000_000, 30_000_000
PLANE = np.arange(SIDE * SIDE, dtype=np.uint8).reshape(SIDE, SIDE)


def tiff_of(path: Path, compression: int, data: bytes, samples: int = 1) -> Path:
    """Write a TIFF of 16 x 16 pixels whose only strip is `data`."""
    bits, place = 8, 8 + 2 + 10 * 12 + 4
    tags = {
        256: SIDE, 257: SIDE, 258: bits, 259: compression, 262: 1 if samples == 1 else 2, 273: place,
        277: samples, 278: SIDE, 279: len(data), 284: 1,
    }  # fmt: skip
    entries = b"".join(struct.pack("<HHII", code, 4, 1, value) for code, value in tags.items())
    path.write_bytes(b"II*\0" + struct.pack("<I", 8) + struct.pack("<H", len(tags)) + entries + bytes(4) + data)
    return path


def jpeg(width: int) -> bytes:
    file = io.BytesIO()
    Image.fromarray(PLANE).save(file, "JPEG")
    data = bytearray(file.getvalue())
    at = data.find(b"\xff\xc0")
    data[at + 5 : at + 9] = struct.pack(">HH", width, width)
    return bytes(data)


def jpeg2000(width: int) -> bytes:
    data = bytearray(pytest.importorskip("imagecodecs").jpeg2k_encode(PLANE, codecformat="j2k"))
    at = data.find(b"\xff\x4f\xff\x51")
    data[at + 8 : at + 16] = struct.pack(">II", width, width)
    return bytes(data)


def png(width: int) -> bytes:
    file = io.BytesIO()
    Image.fromarray(PLANE).save(file, "PNG")
    data = bytearray(file.getvalue())
    data[16:24] = struct.pack(">II", width, width)
    return bytes(data)


def webp(width: int) -> bytes:
    file = io.BytesIO()
    Image.fromarray(np.dstack([PLANE] * 3)).save(file, "WEBP", lossless=True)
    data = bytearray(file.getvalue())
    side = min(width, 16_384) - 1
    data[21:25] = struct.pack("<I", side | side << 14)
    return bytes(data)


def lerc(width: int) -> bytes:
    data = bytearray(pytest.importorskip("imagecodecs").lerc_encode(PLANE))
    data[14:22] = struct.pack("<II", width, width)
    return bytes(data)


PICTURES: dict[int, Callable[[int], bytes]] = {7: jpeg, 34712: jpeg2000, 34933: png, 50001: webp, 34887: lerc}


@pytest.mark.parametrize("compression", PICTURES)
def test_a_tile_of_another_size_than_its_tag_says_is_refused(tmp_path: Path, compression: int) -> None:
    path = tiff_of(tmp_path / "a.tif", compression, PICTURES[compression](MANY), 3 if compression == 50001 else 1)
    with pytest.raises(InputError, match=r"holds a tile of \d+ x \d+ pixels") as told:
        read_picture(path)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("compression", [7, 34712, 34933, 34887])
def test_a_tile_of_its_size_is_read(tmp_path: Path, compression: int) -> None:
    pytest.importorskip("imagecodecs")
    found = read_picture(tiff_of(tmp_path / "a.tif", compression, PICTURES[compression](SIDE)))
    assert np.abs(found.values.astype(int) - PLANE).max() <= (12 if compression == 7 else 0)


def zstandard(data: bytes) -> bytes:
    return bytes(pytest.importorskip("imagecodecs").zstd_encode(data))


PACKERS: dict[int, Callable[[bytes], bytes]] = {8: zlib.compress, 34925: lzma.compress, 50000: zstandard}


@pytest.mark.parametrize("compression", PACKERS)
def test_a_strip_that_unpacks_to_far_more_is_refused_in_little_memory(tmp_path: Path, compression: int) -> None:
    path = tiff_of(tmp_path / "a.tif", compression, PACKERS[compression](bytes(BOMB)))
    tracemalloc.start()
    with pytest.raises(InputError, match="unpacks to more"):
        read_picture(path)
    used = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert used < MOST


@pytest.mark.parametrize("codec", ["gzip", "zstd", "blosc"])
def test_shards_of_zarr_are_looked_into(tmp_path: Path, codec: str) -> None:
    zarr = pytest.importorskip("zarr")
    codecs = pytest.importorskip("zarr.codecs")
    packer = {"gzip": codecs.GzipCodec, "zstd": codecs.ZstdCodec, "blosc": codecs.BloscCodec}[codec]()
    path, plane = tmp_path / "a.zarr", np.kron(PLANE, np.ones((4, 4), np.uint8))
    array = zarr.create_array(path, shape=(64, 64), chunks=(16, 16), shards=(32, 32), dtype="u1", compressors=packer)
    array[...] = plane
    assert (read_picture(path).values == plane).all()
    for shard in sorted(path.rglob("c/*/*")):
        _put_bomb(shard, codec)
    with pytest.raises(InputError, match="unpacks to more"):
        read_picture(path)
    next(path.rglob("c/0/0")).write_bytes(b"\0" * 20)
    with pytest.raises(InputError, match="cut off"):
        read_picture(path)


def _put_bomb(shard: Path, codec: str) -> None:
    """Make the first chunk of a shard one that unpacks to 200 MB; the index is at the end."""
    numcodecs = pytest.importorskip("numcodecs")
    packer = {"gzip": numcodecs.GZip, "zstd": numcodecs.Zstd, "blosc": numcodecs.Blosc}[codec]()
    bomb = packer.encode(bytes(BOMB))
    index = np.frombuffer(shard.read_bytes()[-68:-4], "<u8").copy()
    index[:2] = 0, len(bomb)
    table = index.tobytes()
    crc32c = pytest.importorskip("google_crc32c")
    shard.write_bytes(bytes(bomb) + table + struct.pack("<I", crc32c.value(table)))


# ------------------------------------------------------------------------------------------------- DICOM


def write_dicom(path: Path, frames: int = 1, **more: object) -> Path:
    pydicom = pytest.importorskip("pydicom")
    uid = pytest.importorskip("pydicom.uid")
    meta = pydicom.dataset.FileMetaDataset()
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = "1.2.840.10008.5.1.4.1.1.2", uid.generate_uid(None)
    meta.TransferSyntaxUID = uid.ExplicitVRLittleEndian
    found = pydicom.dataset.FileDataset(str(path), {}, file_meta=meta, preamble=b"II*\0" + bytes(124))
    found.Rows, found.Columns, found.SamplesPerPixel, found.PhotometricInterpretation = 12, 20, 1, "MONOCHROME2"
    found.BitsAllocated, found.BitsStored, found.HighBit, found.PixelRepresentation = 16, 16, 15, 1
    found.NumberOfFrames, found.PixelSpacing = frames, [0.5, 0.25]
    found.PixelData = np.stack([STORED + k for k in range(frames)]).astype("<i2").tobytes()
    for name, value in more.items():
        setattr(found, name, value)
    found.save_as(path, enforce_file_format=True)
    return path


STORED = np.arange(240, dtype=np.int16).reshape(12, 20) - 100


def test_dicom_gives_the_values_of_the_modality_and_the_spacing(tmp_path: Path) -> None:
    path = write_dicom(tmp_path / "a.dcm", RescaleSlope=2, RescaleIntercept=-1024)
    found = read_picture(path)
    assert found.values.dtype.kind == "i"
    assert (found.values == STORED.astype(int) * 2 - 1024).all()
    assert found.calibration.size is not None
    assert found.calibration.size.text == "0.25 x 0.5 mm"
    (tmp_path / "IM0001").write_bytes(path.read_bytes())  # as scanners name them; its preamble looks like TIFF
    assert (read_picture(tmp_path / "IM0001").values == found.values).all()
    half = read_picture(write_dicom(tmp_path / "h.dcm", RescaleSlope=0.5, RescaleIntercept=0.25))
    assert (half.values == STORED * 0.5 + 0.25).all()


def test_padding_of_dicom_is_void_and_frames_are_chosen(tmp_path: Path) -> None:
    path = write_dicom(tmp_path / "a.dcm", 3, PixelPaddingValue=-100, PixelPaddingRangeLimit=-98)
    with pytest.raises(InputError, match=r"frame = 0 to 2"):
        read_picture(path)
    found = read_picture(path, ReadOptions(frame=1))
    assert found.void is not None
    assert np.argwhere(found.void).tolist() == [[0, 0], [0, 1]]
    assert (found.values[1:] == STORED[1:] + 1).all()


def test_broken_dicom_is_a_one_line_error(tmp_path: Path) -> None:
    whole = write_dicom(tmp_path / "a.dcm").read_bytes()
    path = tmp_path / "x.dcm"
    for n in (1, 100, 132, 140, 300, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:n])
        with pytest.raises(InputError, match=r"x\.dcm") as told:
            read_picture(path)
        assert "\n" not in str(told.value)
    with pytest.raises(InputError, match="more than max_pixels"):
        read_picture(write_dicom(tmp_path / "b.dcm", Rows=60000, Columns=60000))
    with pytest.raises(InputError, match="holds no picture"):
        read_picture(write_dicom(tmp_path / "c.dcm", Rows=None))
