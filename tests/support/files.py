"""Small files of every format that is read, with known truth."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray
from PIL import Image

from imgquad_core.errors import InputError
from imgquad_core.reading.options import ReadOptions

VOLUME = (np.arange(3 * 20 * 30).reshape(3, 20, 30) // 7 % 200).astype(np.uint8)
PLANE = VOLUME[1]
PHASES = "# Phase 2\n# MaterialName \tFerrite\n# Symmetry  43\n# Phase 1\n# MaterialName  Quartz\n# Symmetry 32\n"
CTF = "Channel Text File\r\nPrj x\r\nXCells\t20\r\nYCells\t12\r\nPhases\t2\r\n" \
    "4.9;4.9;5.5\t90;90;120\tQuartz-new\t7\t152\r\n3,6;3,6;3,6\t90;90;90\tCopper\t11\t225\r\n" \
    "Phase\tX\tY\tBands\tError\tEuler1\tEuler2\tEuler3\tMAD\tBC\tBS\r\n"  # fmt: skip


def write_nrrd(path: Path, volume: NDArray[Any], **header: Any) -> Path:
    nrrd = pytest.importorskip("nrrd")
    nrrd.write(str(path), volume, header, index_order="C")
    return path


def write_nifti(path: Path) -> Path:
    nibabel = pytest.importorskip("nibabel")
    nibabel.save(nibabel.Nifti1Image(VOLUME.T.copy(), np.eye(4)), path)
    return path


def write_mrc(path: Path) -> Path:
    mrcfile = pytest.importorskip("mrcfile")
    with mrcfile.new(path, overwrite=True) as file:
        file.set_data(VOLUME.astype(np.float32))
    return path


def write_npz(path: Path) -> Path:
    np.savez_compressed(path, a=VOLUME)
    return path


def write_ome(path: Path, version: str, planes: NDArray[Any], axes: str, scale: float = 0.65, **more: Any) -> Path:
    """Write a multiscale picture of two levels as OME-Zarr 0.4 or 0.5, by zarr alone."""
    zarr = pytest.importorskip("zarr")
    group = zarr.open_group(path, mode="w", zarr_format=2 if version == "0.4" else 3)
    kinds = {"c": "channel", "t": "time"}
    units = {"x": "micrometer", "y": "micrometer"}
    named = [{"name": a, "type": kinds.get(a, "space"), **({"unit": units[a]} if a in units else {})} for a in axes]
    levels = [planes, planes[..., ::2, ::2]]
    datasets = []
    for k, level in enumerate(levels):
        chunks = (1,) * (level.ndim - 2) + (8, 16)
        array = group.create_array(f"s{k}", shape=level.shape, dtype=level.dtype, chunks=chunks)
        array[...] = level
        steps = [scale * 2**k if a in "yx" else 1.0 for a in axes]
        datasets.append({"path": f"s{k}", "coordinateTransformations": [{"type": "scale", "scale": steps}]})
    meta = {"multiscales": [{"version": version, "axes": named, "datasets": datasets, "name": "x"}], **more}
    group.attrs.update(meta if version == "0.4" else {"ome": {"version": version, **meta}})
    return path


def write_oina(path: Path, rows: int = 12, cols: int = 20) -> Path:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["Format Version"] = [b"5.0"]
        header, data = file.create_group("1/EBSD/Header"), file.create_group("1/EBSD/Data")
        for name, value in (("X Cells", cols), ("Y Cells", rows), ("X Step", 0.2), ("Y Step", 0.2)):
            header[name] = np.array([value])
        for k, (name, laue) in enumerate((("Iron bcc", 11), ("Quartz", 7)), 1):
            phase = header.create_group(f"Phases/{k}")
            phase["Phase Name"], phase["Laue Group"] = [name.encode()], np.array([laue], np.int32)
        phase = np.ones((rows, cols), np.uint8)
        phase[:, 9:] = 2
        phase[2, 3] = 0
        euler = np.zeros((rows, cols, 3), np.float32)
        euler[6:] = 0.7
        data["Phase"], data["Euler"] = phase.reshape(-1, 1), euler.reshape(-1, 3)
        data["Band Contrast"] = np.full((rows * cols, 1), 9, np.uint8)
    return path


def write_dream3d(path: Path, **options: Any) -> Path:
    h5py = pytest.importorskip("h5py")
    ids = np.ones((1, 20, 30, 1), np.int32)
    ids[0, :, 10:] = 2
    ids[0, 0, 0] = 0
    euler = np.zeros((1, 20, 30, 3), np.float32)
    euler[0, :, 10:] = (0.4, 0.2, 0.1)
    with h5py.File(path, "w") as file:
        cells = file.create_group("DataContainers/Synthetic/CellData")
        cells.create_dataset("FeatureIds", data=ids, **options)
        cells["EulerAngles"], cells["Phases"] = euler, np.ones_like(ids)
        cells["Confidence Index"] = np.random.default_rng(0).random(ids.shape).astype(np.float32)
        file["DataContainers/Synthetic/_SIMPL_GEOMETRY/SPACING"] = np.array([0.25, 0.25, 1.0], np.float32)
        ensemble = file.create_group("DataContainers/Synthetic/CellEnsembleData")
        ensemble["CrystalStructures"] = np.array([[999], [1]], np.uint32)
        ensemble["PhaseName"] = [b"Unknown", b"Nickel"]
    return path


def ang_text(points: NDArray[np.float64], header: str = PHASES) -> str:
    n_rows, n_cols = (len(np.unique(points[:, axis].round(6))) for axis in (4, 3))
    grid = f"# NCOLS_ODD: {n_cols}\n# NCOLS_EVEN: {n_cols}\n# NROWS: {n_rows}\n"
    rows = "\n".join(" ".join(f"{value:.5f}" for value in row[:7]) + f" {int(row[7])} 0 1.2" for row in points)
    return f"# TEM_PIXperUM 1.0\n{header}# GRID: SqrGrid\n{grid}#\n{rows}\n"


def points_of(
    phase: NDArray[Any], euler: NDArray[Any], step: float = 0.25, hexagonal: bool = False
) -> NDArray[np.float64]:
    rows, cols = np.indices(phase.shape)
    x = cols * step + (rows % 2) * (step / 2 if hexagonal else 0.0)
    y = rows * step * (np.sqrt(3) / 2 if hexagonal else 1.0)
    quality = np.ones(phase.shape)
    columns = [*np.moveaxis(euler, -1, 0), x, y, 50 * quality, 0.9 * quality, phase]
    return np.stack([np.asarray(column, float).ravel() for column in columns], axis=1)


def two_halves() -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    phase = np.ones((12, 20), np.int32)
    phase[:, 11:] = 2
    euler = np.zeros((12, 20, 3))
    euler[6:, :11] = (1.0, 0.5, 0.2)
    euler[:, 11:] = (2.0, 0.9, 0.1)
    return phase, euler


def ctf_text(phase: NDArray[Any], euler: NDArray[Any], comma: bool = False) -> str:
    points = points_of(phase, np.degrees(euler))
    rows = "\r\n".join(
        "\t".join(
            [str(int(p[7])), f"{p[3]:.4f}", f"{p[4]:.4f}", "6", "0", *(f"{a:.4f}" for a in p[:3]), "1.1", "9", "9"]
        )
        for p in points
    )
    return CTF + (rows.replace(".", ",") if comma else rows) + "\r\n"


def write_ang(path: Path) -> Path:
    """Two phases, one of two grains."""
    path.write_text(ang_text(points_of(*two_halves())))
    return path


def write_ctf(path: Path) -> Path:
    """The same map."""
    path.write_bytes(ctf_text(*two_halves()).encode())
    return path


def write_vtk_image(path: Path) -> Path:
    """Grey values on points, as a .vti or a MetaImage."""
    pv = pytest.importorskip("pyvista")
    image = pv.ImageData(dimensions=(*PLANE.shape[::-1], 1))
    image.point_data["grey"] = PLANE.ravel()
    if path.suffix == ".vti":
        image.save(path)
        return path
    writer = pytest.importorskip("vtkmodules.vtkIOImage").vtkMetaImageWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(image)
    writer.SetCompression(True)
    writer.Write()
    return path


def write_raster(path: Path) -> Path:
    """By Pillow, in the format that the name says."""
    Image.fromarray(PLANE).save(path)
    return path


def tiff_writer(**options: Any) -> Callable[[Path], Path]:
    """Return what writes a TIFF in a way of storing."""

    def write(path: Path) -> Path:
        tifffile.imwrite(path, PLANE, **options)
        return path

    return write


#: names that hold `VOLUME`
STACKS = (".npz", ".nrrd", ".nii", ".nii.gz", ".mrc")

#: what writes a small file of each format, by the name of a file
WRITERS: dict[str, Callable[[Path], Path]] = {
    **{f"a.{kind}": write_raster for kind in ("png", "bmp", "pgm", "gif", "jpg", "webp")},
    "a.tif": tiff_writer(),
    "tiles.tif": tiff_writer(tile=(16, 16), compression="zlib", predictor=True),
    "a.ome.tif": tiff_writer(ome=True, metadata={"axes": "YX", "PhysicalSizeX": 0.5}),
    "a.npy": lambda path: (np.save(path, PLANE), path)[1],
    "a.npz": write_npz,
    "a.nrrd": lambda path: write_nrrd(path, VOLUME, encoding="raw"),
    "g.nrrd": lambda path: write_nrrd(path, VOLUME, encoding="gzip"),
    "a.nii": write_nifti,
    "a.nii.gz": write_nifti,
    "a.mrc": write_mrc,
    "a.h5oina": write_oina,
    "a.dream3d": write_dream3d,
    "a.ang": write_ang,
    "a.ctf": write_ctf,
    "a.vti": write_vtk_image,
    "a.mha": write_vtk_image,
    "a.ome.zarr": lambda path: write_ome(path, "0.4", PLANE, "yx"),
    "b.ome.zarr": lambda path: write_ome(path, "0.5", PLANE, "yx"),
}


def damage(path: Path, rng: np.random.Generator) -> None:
    """Change some bytes of a file (of one of a folder), most of them near its start, and cut it off at times."""
    files = sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path]
    file = files[int(rng.integers(len(files)))]
    data = bytearray(file.read_bytes())
    for _ in range(int(rng.integers(1, 9))):
        near = min(len(data), 1500) if rng.random() < 0.7 else len(data)
        data[int(rng.integers(near))] = int(rng.integers(256))
    file.write_bytes(data[: int(rng.integers(1, len(data) + 1))] if rng.random() < 0.3 else data)


def options_for(path: Path) -> ReadOptions:
    """Return how the one picture of a file, or the middle one of a stack, is read."""
    return ReadOptions(max_pixels=10_000, frame=1 if path.name.endswith(STACKS) else None)


def assert_read_or_refused(path: Path) -> bool:
    """Return whether a file is a picture; where it is none, the error is one line that names it."""
    from imgquad_mesh.datasets.pictures import read_any

    try:
        return min(read_any(path, options_for(path)).shape) > 0
    except InputError as error:
        told = str(error)
    assert "\n" not in told, told
    assert path.name in told, told
    return False


def write_lif(path: Path, images: dict[str, NDArray[Any]], step: float = 1e-7) -> Path:
    """Write pictures, shape (n_channels, n_slices, n_rows, n_cols), uint8, as Leica does: XML, then the memory."""

    def dimension(axis: int, n: int, stride: int) -> str:
        text = f'DimID="{axis}" NumberOfElements="{n}" Origin="0" Length="{step * (n - 1)!r}" Unit="m"'
        return f'<DimensionDescription {text} BitInc="0" BytesInc="{stride}"/>'

    def element(name: str, values: NDArray[Any], k: int) -> str:
        channels, slices, rows, cols = values.shape
        size = values[0].size
        told = "".join(
            f'<ChannelDescription DataType="0" ChannelTag="0" Resolution="8" NameOfMeasuredQuantity="" Min="0"'
            f' Max="255" Unit="" LUTName="Gray" IsLUTInverted="0" BytesInc="{c * size}" BitInc="0"/>'
            for c in range(channels)
        )
        axes = dimension(1, cols, 1) + dimension(2, rows, cols) + dimension(3, slices, rows * cols)
        image = f"<Channels>{told}</Channels><Dimensions>{axes}</Dimensions>"
        return (
            f'<Element Name="{name}" Visibility="1" CopyOption="1" UniqueID="{k}"><Data><Image TextDescription="">'
            f"<ImageDescription>{image}</ImageDescription></Image></Data>"
            f'<Memory Size="{values.size}" MemoryBlockID="MemBlock_{k}"/></Element>'
        )

    def text(content: str) -> bytes:
        return b"\x2a" + struct.pack("<I", len(content)) + content.encode("utf-16-le")

    def block(content: bytes) -> bytes:
        return struct.pack("<II", 0x70, len(content)) + content

    inside = "".join(element(name, values, k) for k, (name, values) in enumerate(images.items()))
    head = f'<Element Name="a.lif"><Children>{inside}</Children><Memory Size="0" MemoryBlockID=""/></Element>'
    content = block(text(f'<LMSDataContainerHeader Version="2">{head}</LMSDataContainerHeader>'))
    for k, values in enumerate(images.values()):
        content += block(b"\x2a" + struct.pack("<Q", values.size) + text(f"MemBlock_{k}")) + values.tobytes()
    path.write_bytes(content)
    return path
