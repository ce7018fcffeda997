"""Volumes, OME-Zarr, HDF5 and NumPy's archives: slices, channels, levels, names, sizes, and what is refused."""

from __future__ import annotations

import json
import shutil
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from PIL import Image

from imgquad_core.errors import InputError
from imgquad_core.reading.formats import CONVERTED_BY, ReadOptions, read_picture
from support.files import PLANE, VOLUME, write_dream3d, write_lif, write_nifti, write_nrrd, write_oina, write_ome


def size_text(path: Path, **options: Any) -> str | None:
    found = read_picture(path, ReadOptions(**options)).calibration.size
    return found.text if found else None


# ------------------------------------------------------------------------------------------------- volumes


@pytest.mark.parametrize("encoding", ["raw", "gzip", "bzip2"])
@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32, ">u2"])
def test_a_slice_of_an_nrrd_volume(tmp_path: Path, encoding: str, dtype: Any) -> None:
    path = write_nrrd(tmp_path / "a.nrrd", VOLUME.astype(dtype), encoding=encoding, spacings=[0.5, 0.5, 2.0])
    with pytest.raises(InputError, match=r"3 pictures.*frame = 0 to 2"):
        read_picture(path)
    found = read_picture(path, ReadOptions(frame=1))
    assert (found.values == PLANE).all()
    assert found.notes == ("slice 1 of 3, counted from 0",)
    assert size_text(path, frame=1) == "0.5"


def test_an_nrrd_plane_its_directions_and_colours(tmp_path: Path) -> None:
    space = {"space": "left-posterior-superior", "space directions": [[0.0, 0.25], [0.25, 0.0]], "space dimension": 2}
    space.pop("space")
    path = write_nrrd(tmp_path / "a.nrrd", PLANE, **space)
    assert (read_picture(path).values == PLANE).all()
    assert size_text(path) == "0.25"
    colours = np.stack([PLANE, 255 - PLANE, PLANE // 2], axis=-1)
    path = write_nrrd(tmp_path / "b.nrrd", colours, kinds=["RGB-color", "domain", "domain"])
    assert (read_picture(path).values == colours).all()
    assert (read_picture(path, ReadOptions(channel=2)).values == PLANE // 2).all()


def test_a_slice_of_a_nifti_file_with_its_zooms(tmp_path: Path) -> None:
    nibabel = pytest.importorskip("nibabel")
    for name in ("a.nii", "a.nii.gz"):
        image = nibabel.Nifti1Image(VOLUME.T.astype(np.int16), np.diag([0.3, 0.3, 5.0, 1.0]))
        image.header.set_xyzt_units("mm")
        nibabel.save(image, tmp_path / name)
        found = read_picture(tmp_path / name, ReadOptions(frame=1))
        assert (found.values == PLANE).all()
        assert size_text(tmp_path / name, frame=1) == "0.3 mm"
    plain = nibabel.Nifti1Image(PLANE.T.copy(), np.eye(4))
    nibabel.save(plain, tmp_path / "b.nii")
    assert (read_picture(tmp_path / "b.nii").values == PLANE).all()
    assert read_picture(tmp_path / "b.nii").calibration.size is None  # without a unit, zooms are placeholders


def test_a_section_of_an_mrc_file_with_its_voxels(tmp_path: Path) -> None:
    mrcfile = pytest.importorskip("mrcfile")
    with mrcfile.new(tmp_path / "a.mrc") as file:
        file.set_data(VOLUME.astype(np.float32))
        file.voxel_size = 1.7
    assert (read_picture(tmp_path / "a.mrc", ReadOptions(frame=1)).values == PLANE).all()
    assert size_text(tmp_path / "a.mrc", frame=1) == "1.7 angstrom"


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(("stamp", "flags", "largest", "signed"), [
    (1146047817, 12, 0.0, False), (1146047817, 13, 0.0, True), (0, 0, 199.0, False), (0, 0, 100.0, True),
])  # fmt: skip
def test_bytes_of_an_mrc_file_are_unsigned_where_it_says_so(
    tmp_path: Path, order: str, stamp: int, flags: int, largest: float, signed: bool
) -> None:
    mrcfile = pytest.importorskip("mrcfile")
    path = tmp_path / "a.mrc"
    with mrcfile.new(path) as file:
        file.set_data(PLANE.view(np.int8))
    content = bytearray(path.read_bytes())
    struct.pack_into("<f", content, 80, largest)
    struct.pack_into("<ii", content, 152, stamp, flags)
    if order == ">":  # every number of the header but texts, and the stamp of the machine
        words = np.frombuffer(content, "<u4", 56).astype(">u4").tobytes()
        content[: len(words)] = words
        content[104:108], content[208:216] = b"\0" * 4, b"MAP \x11\x11\0\0"
    path.write_bytes(content)
    assert (read_picture(path).values == (PLANE.view(np.int8) if signed else PLANE)).all()


# ---------------------------------------------------------------------------------------------------- Zarr


def add_labels(path: Path, version: str, names: list[str]) -> None:
    zarr = pytest.importorskip("zarr")
    for name in names:
        write_ome(path / "labels" / name, version, PLANE.astype(np.uint32) + len(name), "yx", **{"image-label": {}})
    if version == "0.4":
        (path / "labels" / ".zgroup").write_text('{"zarr_format": 2}')
        (path / "labels" / ".zattrs").write_text(json.dumps({"labels": names}))
    else:
        meta = {"zarr_format": 3, "node_type": "group", "attributes": {"ome": {"version": "0.5", "labels": names}}}
        (path / "labels" / "zarr.json").write_text(json.dumps(meta))
    assert "labels" in zarr.open_group(path, mode="r")


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_ome_zarr_pictures_channels_and_levels(tmp_path: Path, version: str) -> None:
    path = write_ome(tmp_path / "a.zarr", version, np.stack([VOLUME, 199 - VOLUME])[:, None], "ctzyx"[:5])
    options = ReadOptions(channel=1, frame=1)
    assert (read_picture(path, options).values == 199 - PLANE).all()
    assert size_text(path, channel=1, frame=1) == "0.65 um"
    with pytest.raises(InputError, match=r"channel = 0 to 1"):
        read_picture(path, ReadOptions(frame=1))
    coarse = read_picture(path, ReadOptions(channel=0, frame=1, level=1))
    assert (coarse.values == PLANE[::2, ::2]).all()
    assert size_text(path, channel=0, frame=1, level=1) == "1.3 um"
    with pytest.raises(InputError, match="level is 2"):
        read_picture(path, ReadOptions(level=2))


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_the_label_image_of_an_ome_zarr_picture(tmp_path: Path, version: str) -> None:
    path = write_ome(tmp_path / "a.zarr", version, PLANE, "yx")
    assert not read_picture(path).labels
    add_labels(path, version, ["cells"])
    found = read_picture(path)
    assert found.labels
    assert (found.values == PLANE.astype(int) + 5).all()
    assert "label image cells" in found.notes[0]
    assert (read_picture(path, ReadOptions(scalars="image")).values == PLANE).all()
    inside = read_picture(path / "labels" / "cells")
    assert inside.labels
    assert (inside.values == found.values).all()
    add_labels(path, version, ["cells", "nuclei"])
    with pytest.raises(InputError, match="cells, nuclei"):
        read_picture(path)
    assert (read_picture(path, ReadOptions(scalars="nuclei")).values == PLANE.astype(int) + 6).all()


def test_plain_zarr_arrays_and_groups_of_pictures(tmp_path: Path) -> None:
    zarr = pytest.importorskip("zarr")
    array = zarr.create_array(tmp_path / "p.zarr", shape=PLANE.shape, dtype=PLANE.dtype)
    array[...] = PLANE
    assert (read_picture(tmp_path / "p.zarr").values == PLANE).all()
    group = zarr.open_group(tmp_path / "g.zarr", mode="w")
    group.create_group("a")
    with pytest.raises(InputError, match="it holds a"):
        read_picture(tmp_path / "g.zarr")
    write_ome(tmp_path / "g.zarr" / "0", "0.5", PLANE, "yx")
    assert (read_picture(tmp_path / "g.zarr").values == PLANE).all()


@pytest.mark.parametrize("codec", ["zlib", "gzip", "blosc", "zstd"])
def test_chunks_of_zarr_that_unpack_to_far_more_are_refused(tmp_path: Path, codec: str) -> None:
    zarr = pytest.importorskip("zarr")
    numcodecs = pytest.importorskip("numcodecs")
    packer = {"zlib": numcodecs.Zlib, "gzip": numcodecs.GZip, "blosc": numcodecs.Blosc, "zstd": numcodecs.Zstd}[codec]()
    array = zarr.create_array(
        tmp_path / "a.zarr", shape=PLANE.shape, dtype=PLANE.dtype, chunks=(20, 30), zarr_format=2, compressors=packer
    )
    array[...] = PLANE
    chunk = next(path for path in (tmp_path / "a.zarr").rglob("*") if path.is_file() and not path.name.startswith("."))
    chunk.write_bytes(packer.encode(bytes(200_000_000)))
    with pytest.raises(InputError, match="unpacks to more"):
        read_picture(tmp_path / "a.zarr")


# ---------------------------------------------------------------------------------------------------- HDF5


@pytest.mark.parametrize(("name", "kind"), [("Phases/1/Phase Name", "texts"), ("Phases/1/Laue Group", "numbers")])
def test_what_is_neither_text_nor_number_is_refused(tmp_path: Path, name: str, kind: str) -> None:
    """The HDF5 library may end the process over values that damage has made rows of bytes."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(write_oina(tmp_path / "a.h5oina"), "r+") as file:
        del file[f"1/EBSD/Header/{name}"]
        file.create_dataset(f"1/EBSD/Header/{name}", (1,), h5py.vlen_dtype(np.uint8))
    with pytest.raises(InputError, match=f"holds no {kind} in .*{name}"):
        read_picture(tmp_path / "a.h5oina")


def test_an_h5oina_map(tmp_path: Path) -> None:
    path = write_oina(tmp_path / "a.h5oina")
    found = read_picture(path)
    assert found.names == {1: "Iron bcc", 2: "Quartz"}
    assert found.void is not None
    assert np.argwhere(found.void).tolist() == [[2, 3]]
    assert size_text(path) == "0.2 um"
    grains = read_picture(path, ReadOptions(scalars="grains"))
    assert grains.values.max() == 4
    assert grains.crystals is not None
    assert np.allclose(np.radians(grains.crystals[4].euler), 0.7, atol=1e-4)


def test_dream3d_gives_its_grains_and_any_other_array(tmp_path: Path) -> None:
    path = write_dream3d(tmp_path / "a.dream3d")
    found = read_picture(path)
    assert found.labels
    assert found.names == {1: "Nickel_1", 2: "Nickel_2"}
    assert found.void is not None
    assert np.argwhere(found.void).tolist() == [[0, 0]]  # feature 0 is none
    assert found.crystals is not None
    assert np.allclose(np.radians(found.crystals[2].euler), (0.4, 0.2, 0.1), atol=1e-5)
    assert size_text(path) == "0.25"
    assert not read_picture(path, ReadOptions(scalars="Confidence Index")).labels
    with pytest.raises(InputError, match="channel = 0 to 2"):
        read_picture(path, ReadOptions(scalars="EulerAngles"))
    with pytest.raises(InputError, match=r"scalars is 'Nothing', but .*FeatureIds"):
        read_picture(path, ReadOptions(scalars="Nothing"))


def test_other_hdf5_files_name_their_arrays(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["exported_data"] = VOLUME
        file["a/b"] = PLANE
    with pytest.raises(InputError, match=r"2 arrays .*a/b, exported_data"):
        read_picture(tmp_path / "a.h5")
    assert (read_picture(tmp_path / "a.h5", ReadOptions(scalars="exported_data", frame=1)).values == PLANE).all()
    assert (read_picture(tmp_path / "a.h5", ReadOptions(scalars="b")).values == PLANE).all()


def test_chunks_of_hdf5_that_unpack_to_far_more_are_refused(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    path = write_dream3d(tmp_path / "a.dream3d", chunks=(1, 20, 30, 1), compression="gzip")
    assert read_picture(path).labels
    with h5py.File(path, "r+") as file:
        dataset = file["DataContainers/Synthetic/CellData/FeatureIds"]
        dataset.id.write_direct_chunk((0, 0, 0, 0), zlib.compress(bytes(200_000_000), 9))
    with pytest.raises(InputError, match="unpacks to more"):
        read_picture(path)


# --------------------------------------------------------------------------------------------------- NumPy


def test_an_archive_of_arrays(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "one.npz", labels=PLANE)
    assert (read_picture(tmp_path / "one.npz").values == PLANE).all()
    np.savez(tmp_path / "two.npz", labels=PLANE, other=VOLUME)
    with pytest.raises(InputError, match=r"2 arrays .*labels, other"):
        read_picture(tmp_path / "two.npz")
    assert (read_picture(tmp_path / "two.npz", ReadOptions(scalars="other", frame=1)).values == PLANE).all()
    np.savez_compressed(tmp_path / "bomb.npz", labels=np.zeros(400_000_000, np.uint8).reshape(20000, 20000))
    with pytest.raises(InputError, match="raise"):
        read_picture(tmp_path / "bomb.npz", ReadOptions(max_pixels=10_000))


# --------------------------------------------------------------------------------------------------- Leica


def test_a_plane_of_one_of_the_pictures_of_a_lif_file(tmp_path: Path) -> None:
    pytest.importorskip("liffile")
    stack = np.stack([VOLUME, 199 - VOLUME]).astype(np.uint8)
    path = write_lif(tmp_path / "a.lif", {"first": stack, "second": stack[:1, :1]})
    with pytest.raises(InputError, match="first, second"):
        read_picture(path)
    with pytest.raises(InputError, match=r"3 planes.*channel = 0 to 1|channel = 0 to 1"):
        read_picture(path, ReadOptions(scalars="first", frame=1))
    found = read_picture(path, ReadOptions(scalars="first", frame=1, channel=1))
    assert (found.values == 199 - PLANE).all()
    assert "plane 1 of 3" in found.notes[0]
    assert size_text(path, scalars="second") == "100 nm"
    assert (read_picture(path, ReadOptions(scalars="second")).values == VOLUME[0]).all()
    with pytest.raises(InputError, match="more than max_pixels"):
        read_picture(path, ReadOptions(scalars="second", max_pixels=10))


def test_a_lif_file_that_is_cut_off_or_promises_too_much_is_a_one_line_error(tmp_path: Path) -> None:
    pytest.importorskip("liffile")
    path = write_lif(tmp_path / "a.lif", {"first": VOLUME[None].astype(np.uint8)})
    whole = path.read_bytes()
    large = whole.replace(*(f'NumberOfElements="{n}"'.encode("utf-16-le") for n in ("30", "99")))
    for content in (large, *(whole[:n] for n in (4, 9, 60, 400, len(whole) - 900, len(whole) - 5))):
        path.write_bytes(content)
        with pytest.raises(InputError, match=r"a\.lif") as told:
            read_picture(path, ReadOptions(frame=2))
        assert "\n" not in str(told.value)


# ------------------------------------------------------------------------------------------- other formats


@pytest.mark.parametrize("extension", sorted(CONVERTED_BY))
def test_what_is_not_read_names_the_line_that_converts_it(tmp_path: Path, extension: str) -> None:
    path = tmp_path / f"a{extension}"
    path.write_bytes(b"1 2 3\n" * 40)
    with pytest.raises(InputError, match="not read directly") as told:
        read_picture(path)
    assert "FILE" not in str(told.value)
    assert "\n" not in str(told.value)


def test_a_picture_of_a_wrong_name_is_told_by_its_content(tmp_path: Path) -> None:
    Image.fromarray(PLANE).save(tmp_path / "a.png")
    shutil.copy(tmp_path / "a.png", tmp_path / "a.csv")
    assert (read_picture(tmp_path / "a.csv").values == PLANE).all()
    tifffile.imwrite(tmp_path / "b.tif", PLANE)
    shutil.copy(tmp_path / "b.tif", tmp_path / "b.png")
    assert (read_picture(tmp_path / "b.png").values == PLANE).all()


def test_16_bit_colours_of_a_png_come_whole_or_are_told(tmp_path: Path) -> None:
    deep = np.stack([PLANE, PLANE + 1, PLANE + 2], axis=-1).astype(np.uint16) * 256 + 7
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in deep)

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", 30, 20, 16, 2, 0, 0, 0)
    path = tmp_path / "a.png"
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    )
    found = read_picture(path)
    if found.values.dtype == np.uint16:
        assert (found.values == deep).all()
    else:
        assert (found.values == deep >> 8).all()
        assert "upper 8" in found.notes[0]


def test_a_shape_that_only_alpha_holds_is_told_and_ends_at_half(tmp_path: Path) -> None:
    alpha = np.clip(255 - 40 * (np.hypot(*np.mgrid[-10:10, -15:15]) - 6), 0, 255).astype(np.uint8)
    Image.fromarray(np.dstack([np.full((20, 30, 3), 9, np.uint8), alpha])).save(tmp_path / "a.png")
    found = read_picture(tmp_path / "a.png")
    assert "drop-transparent" in found.notes[0]
    assert found.opaque is not None
    assert (found.opaque == (alpha > 127)).all()
    Image.fromarray(np.dstack([PLANE, PLANE, PLANE, alpha[:20, :30]])).save(tmp_path / "b.png")
    assert read_picture(tmp_path / "b.png").notes == ()


def test_an_orientation_that_is_older_than_the_pixels_is_not_followed(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[274] = 6
    exif.get_ifd(0x8769).update({40962: 20, 40963: 30})  # as it was before a program turned the pixels
    Image.fromarray(PLANE).save(tmp_path / "stale.png", exif=exif)
    found = read_picture(tmp_path / "stale.png")
    assert (found.values == PLANE).all()
    assert "older than the pixels" in found.notes[0]
    exif.get_ifd(0x8769).update({40962: 30, 40963: 20})
    Image.fromarray(PLANE).save(tmp_path / "turned.png", exif=exif)
    assert read_picture(tmp_path / "turned.png").shape == (30, 20)


# ------------------------------------------------------------------------------------------- hostile files


def test_headers_that_promise_too_much_are_refused_before_memory_is_used(tmp_path: Path) -> None:
    path = write_nrrd(tmp_path / "a.nrrd", PLANE, encoding="gzip")
    path.write_bytes(path.read_bytes().replace(b"sizes: 30 20", b"sizes: 900000 900000"))
    with pytest.raises(InputError, match="more than max_pixels"):
        read_picture(path)
    path.write_bytes(path.read_bytes().replace(b"sizes: 900000 900000", b"sizes: 9000 9000"))
    with pytest.raises(InputError, match=r"cut off"):
        read_picture(path)
    header = bytearray(write_nifti(tmp_path / "a.nii").read_bytes())
    header[42:46] = struct.pack("<hh", 32000, 32000)
    (tmp_path / "a.nii").write_bytes(header)
    with pytest.raises(InputError, match="more than max_pixels"):
        read_picture(tmp_path / "a.nii", ReadOptions(frame=0))


@pytest.mark.parametrize("name", [".zgroup", ".zattrs", "s0/.zarray", "s0/0.0"])
def test_broken_parts_of_a_zarr_folder_are_one_line_errors(tmp_path: Path, name: str) -> None:
    for k, content in enumerate(
        (b"", b"{", b"[]", b'{"multiscales": [{"datasets": [{"path": "../.."}]}]}', b"\xff" * 99)
    ):
        path = write_ome(tmp_path / f"a{k}.zarr", "0.4", PLANE, "yx")
        target = path / name
        assert target.parent.is_dir()
        target.write_bytes(content)
        try:
            read_picture(path)
        except InputError as error:
            assert "\n" not in str(error)  # noqa: PT017
