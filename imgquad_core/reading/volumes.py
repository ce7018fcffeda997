"""Volumes and their slices: NRRD by pynrrd, NIfTI by nibabel, MRC by mrcfile. The first stored row is on top."""

from __future__ import annotations

import bz2
import gzip
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.errors import InputError

from .calibration import Calibration, PixelSize, size_of
from .decoding import Stack, assert_pixels, decoding, optional
from .options import ReadOptions
from .picture import Picture, picture_of


def _slice_picture(path: Path, plane: NDArray[Any], size: PixelSize | None, told: str = "") -> Picture:
    found = picture_of(np.array(plane), str(path))
    return replace(found, calibration=Calibration(size), notes=(told,) if told else ())


# ---------------------------------------------------------------------------------------------------- NRRD

#: kinds of an axis that holds the components of one pixel
_COMPONENTS = ("RGB-color", "RGBA-color", "vector", "list", "2-vector", "3-vector", "4-vector", "3-color", "4-color")


def read_nrrd(path: Path, options: ReadOptions) -> Picture:
    """Read a slice of an NRRD file: axes are fastest first, columns, rows, slices; components lie before them."""
    nrrd = optional("nrrd", path, "nrrd")
    with decoding(path):
        with path.open("rb") as file:
            header = nrrd.read_header(file)
            start = file.tell()
        if "data file" in header or "datafile" in header:
            raise InputError(f"{path} keeps its values in other files: save it as .nrrd")
        sizes = [int(n) for n in header["sizes"]]
        kinds = header.get("kinds", [""] * len(sizes))
        channels = sizes[0] if len(sizes) > 2 and kinds[0] in _COMPONENTS else 1
        lengths = sizes[1:] if channels > 1 or kinds[0] in _COMPONENTS else sizes
        if len(lengths) not in (2, 3) or min(sizes) < 1:
            raise InputError(f"{path} has the sizes {sizes}: give columns, rows and perhaps slices")
        assert_pixels(path, lengths[0], lengths[1], options)
        n_slices = lengths[2] if len(lengths) == 3 else 1
        k = Stack(str(path), (("frame", n_slices),)).choose(options)["frame"]
        plane = _nrrd_plane(path, nrrd, header, start, (lengths[1], lengths[0], channels), k)
        is_colour = channels in (3, 4) and kinds[0] in ("RGB-color", "RGBA-color") and options.channel is None
        if channels > 1 and not is_colour:
            plane = plane[..., Stack(str(path), (("channel", channels),)).choose(options)["channel"]]
        return _slice_picture(path, plane, _nrrd_spacing(header, len(sizes) - len(lengths)), _of(k, n_slices))


def _of(k: int, n: int) -> str:
    return f"slice {k} of {n}, counted from 0" if n > 1 else ""


def _nrrd_plane(path: Path, nrrd: Any, header: Any, start: int, shape: tuple[int, int, int], k: int) -> NDArray[Any]:
    """Read one slice: what lies before it is skipped, and never more is unpacked than is needed."""
    kind = np.dtype(nrrd.reader._TYPEMAP_NRRD2NUMPY[header["type"]])
    dtype = kind.newbyteorder(">" if header.get("endian") == "big" else "<")
    size = int(np.prod(shape)) * dtype.itemsize
    with path.open("rb") as file:
        file.seek(start)
        encoding = header["encoding"]
        if encoding == "raw":
            file.seek(start + int(header.get("byte skip", header.get("byteskip", 0))) + k * size)
            data = file.read(size)
        elif encoding in ("gzip", "gz", "bzip2", "bz2"):
            unpacked = gzip.GzipFile(fileobj=file) if encoding in ("gzip", "gz") else bz2.BZ2File(file)
            unpacked.seek(k * size)
            data = unpacked.read(size)
        else:
            raise InputError(f"{path} is stored as {encoding}: save it as raw or gzip")
    if len(data) < size:
        raise InputError(f"{path} is cut off: slice {k} has {len(data)} of {size} bytes; save it anew")
    values = np.frombuffer(data, dtype).reshape(shape)
    return values[..., 0] if shape[2] == 1 else values


def _nrrd_spacing(header: Any, first: int) -> PixelSize | None:
    """Return the spacing of columns and rows, from the axes' directions or the plain entry."""
    units = header.get("space units") or header.get("units") or []
    unit = str(units[0 if "space units" in header else first]) if len(units) > 0 else ""
    directions = header.get("space directions")
    if directions is not None:
        steps = [float(np.linalg.norm(axis)) for axis in np.asarray(directions, float)[first : first + 2]]
    else:
        steps = [float(step) for step in list(header.get("spacings", []))[first : first + 2]]
    if len(steps) < 2:
        return None
    # ITK and Slicer write millimetres without saying so: then the size has no unit
    return size_of(steps[0], steps[1], unit if unit not in ("", "none", "?") else "", "NRRD space directions")


# --------------------------------------------------------------------------------------------------- NIfTI


def read_nifti(path: Path, options: ReadOptions) -> Picture:
    """Read a slice along the third axis of a NIfTI file; times count as further slices."""
    nibabel = optional("nifti", path)
    with decoding(path):
        image = nibabel.load(path)
        shape = tuple(int(n) for n in image.shape)
        if len(shape) < 2 or min(shape) < 1:
            raise InputError(f"{path} has the shape {shape}: give columns, rows and slices")
        assert_pixels(path, shape[0], shape[1], options)
        outer = tuple(zip(("slice", "time", "axis 5", "axis 6", "axis 7"), shape[2:], strict=False))[::-1]
        found = Stack(str(path), outer).choose(options) if outer else {}
        index = (slice(None), slice(None), *(found[axis] for axis, _ in reversed(outer)))
        plane = np.asarray(image.dataobj[index]).T
        n_slices = int(np.prod(shape[2:])) if outer else 1
        told = ", ".join(f"{axis} {found[axis]} of {n}" for axis, n in outer if n > 1)
        zooms, unit = image.header.get_zooms(), image.header.get_xyzt_units()[0]
        size = size_of(float(zooms[0]), float(zooms[1]), unit, "NIfTI zooms") if unit != "unknown" else None
        return _slice_picture(path, plane, size, told if n_slices > 1 else "")


# ----------------------------------------------------------------------------------------------------- MRC


def read_mrc(path: Path, options: ReadOptions) -> Picture:
    """Read a section of an MRC file; only this section is loaded."""
    mrcfile = optional("mrc", path)
    with decoding(path), mrcfile.mmap(path, mode="r", permissive=False) as file:
        data = file.data
        if data.dtype.kind not in "iuf":
            raise InputError(f"{path} holds values of type {data.dtype}: give a picture, not its transform")
        assert_pixels(path, data.shape[-1], data.shape[-2], options)
        outer = tuple(("volume" if k < data.ndim - 3 else "section", n) for k, n in enumerate(data.shape[:-2]))
        place = Stack(str(path), outer).choose(options) if outer else {}
        plane = data[tuple(place[axis] for axis, _ in outer)]
        if data.dtype == np.int8 and not _has_signed_bytes(file.header):
            plane = plane.view(np.uint8)
        voxel = file.voxel_size
        size = size_of(float(voxel.x), float(voxel.y), "angstrom", "MRC voxel size")
        told = ", ".join(f"{axis} {place[axis]} of {n}" for axis, n in outer if n > 1)
        return _slice_picture(path, plane, size, told)


_IMOD = 1146047817  #: stamp of IMOD in a header


def _has_signed_bytes(header: Any) -> bool:
    """Tell how bytes are meant: signed (MRC2014), or unsigned as IMOD says by a flag, others by their largest value.

    References
    ----------
    The MRC file format used by IMOD, https://bio3d.colorado.edu/imod/doc/mrc_format.txt (bytes 152 and 156).
    """
    words = np.frombuffer(bytes(header.extra2), header.dtype["nx"])  # from byte 112 on, in the order of the file
    stamp, flags = words[10:12].tolist()
    if stamp == _IMOD:
        return bool(flags & 1)
    return not float(header.dmax) > np.iinfo(np.int8).max
