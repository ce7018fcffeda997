"""OME-Zarr (NGFF 0.1 to 0.5) and plain Zarr arrays, by zarr.

https://ngff.openmicroscopy.org/0.5/
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from math import prod
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.errors import InputError

from .calibration import Calibration, PixelSize, size_of
from .decoding import Stack, assert_pixels, decoding, optional
from .options import ReadOptions
from .packed import SLACK, assert_unpacks, stated_size, too_large
from .picture import Picture, picture_of

#: axes where the metadata name none (before 0.4)
_AXES = ("t", "c", "z", "y", "x")
#: only chunks that may be packed tighter than this are looked into
TIGHT = 255


class Level(NamedTuple):
    """One level of a multiscale picture."""

    array: Any
    axes: tuple[str, ...]
    scale: tuple[float, ...]  #: of each axis; empty if unknown
    unit: str
    is_labels: bool
    note: str


def is_zarr(path: Path) -> bool:
    """Whether a path is a folder of Zarr: an array, a picture, or a group of them."""
    return path.is_dir() and any((path / name).is_file() for name in (".zgroup", ".zattrs", ".zarray", "zarr.json"))


def read_zarr(path: Path, options: ReadOptions) -> Picture:
    """Read a plane of a multiscale picture, of its label image if it has one, or of an array.

    Notes
    -----
    `scalars` names a label image, or "image" for the picture itself; `level` 0 is the finest.
    """
    zarr = optional("zarr", path)
    with decoding(path):
        node = zarr.open(path, mode="r")
        level = _level(path, node, options)
        values = _plane(path, level, options)
        found = replace(picture_of(values, str(path)), labels=level.is_labels)
        return replace(found, calibration=Calibration(_size(level)), notes=(level.note,) if level.note else ())


class ZarrPlane(NamedTuple):
    """A plane of a Zarr array, of which windows are read."""

    array: Any
    place: tuple[Any, ...]  #: of axes outside the plane; slices stand for rows and columns
    rows_at: int
    shape: tuple[int, int]
    is_labels: bool
    calibration: Calibration

    def at(self, box: tuple[int, int, int, int]) -> tuple[Any, ...]:
        """Return the index of left, upper, right, lower bounds."""
        left, upper, right, lower = box
        index = list(self.place)
        index[self.rows_at], index[self.rows_at + 1] = slice(upper, lower), slice(left, right)
        return tuple(index)


def plane_of_zarr(path: Path, options: ReadOptions) -> ZarrPlane:
    """Return the plane that `read_zarr` would read, without its values."""
    zarr = optional("zarr", path)
    with decoding(path):
        level = _level(path, zarr.open(path, mode="r"), options)
        index = _index(path, level, options)
        rows_at = level.axes.index("y")
        if level.axes.index("x") != rows_at + 1:
            raise InputError(f"{path} has the axes {level.axes}: save it with x behind y")
        shape = (int(level.array.shape[rows_at]), int(level.array.shape[rows_at + 1]))
        return ZarrPlane(level.array, index, rows_at, shape, level.is_labels, Calibration(_size(level)))


# ------------------------------------------------------------------------------------------------- metadata


def _level(path: Path, node: Any, options: ReadOptions) -> Level:
    if hasattr(node, "shape"):
        return Level(node, _named_axes(node), (), "", False, "")
    meta = _metadata(node)
    labels = [str(name) for name in _metadata(node["labels"]).get("labels", [])] if "labels" in node else []
    if labels and options.scalars != "image":
        name = _chosen_label(path, labels, options)
        told = f"label image {name}; the picture itself by scalars image"
        return _of_group(path, node["labels"][name], options)._replace(is_labels=True, note=told)
    if options.scalars not in (None, "image"):
        raise InputError(f"scalars is '{options.scalars}', but {path} has no label images: leave it out")
    if "multiscales" not in meta:
        return _of_group(path, _only_picture(path, node), options)
    return _of_group(path, node, options)


def _metadata(group: Any) -> Mapping[str, Any]:
    """Return the metadata of OME: under a key of their own since 0.5."""
    attributes = dict(group.attrs)
    found = attributes.get("ome", attributes)
    return found if isinstance(found, Mapping) else {}


def _chosen_label(path: Path, labels: Sequence[str], options: ReadOptions) -> str:
    if options.scalars in labels:
        return str(options.scalars)
    if options.scalars is None and len(labels) == 1:
        return labels[0]
    known = ", ".join(labels)
    raise InputError(f"{path} has the label images {known}: choose one by scalars, or image for the picture itself")


def _only_picture(path: Path, node: Any) -> Any:
    """Return the group of pictures within a group that is no picture itself (as bioformats2raw writes it)."""
    found = [name for name, group in node.groups() if "multiscales" in _metadata(group)]
    if len(found) != 1:
        inside = ", ".join(sorted(found or [name for name, _ in node.members()])[:12]) or "nothing"
        raise InputError(f"{path} is no OME-Zarr picture, it holds {inside}: give the path of one of them")
    return node[found[0]]


def _of_group(path: Path, group: Any, options: ReadOptions) -> Level:
    meta = _metadata(group)
    scales = meta["multiscales"][0]
    datasets = scales["datasets"]
    if options.level >= len(datasets):
        raise InputError(f"level is {options.level}, but {path} has {len(datasets)}: give 0 to {len(datasets) - 1}")
    chosen = datasets[options.level]
    array = group[chosen["path"]]
    given = scales.get("axes") or _AXES[-array.ndim :]
    axes = tuple(str(axis["name"] if isinstance(axis, Mapping) else axis).lower() for axis in given)
    units = {str(axis["name"]).lower(): str(axis.get("unit", "")) for axis in given if isinstance(axis, Mapping)}
    unit = units.get("x", "") if units.get("x") == units.get("y") else ""
    return Level(array, axes, _scale(chosen, scales), unit, "image-label" in meta, "")


def _scale(*of: Mapping[str, Any]) -> tuple[float, ...]:
    """Return the product of the scales of a level and of the whole picture."""
    found: tuple[float, ...] = ()
    for meta in of:
        for step in meta.get("coordinateTransformations", []):
            if step.get("type") == "scale" and "scale" in step:
                scale = tuple(float(part) for part in step["scale"])
                found = tuple(a * b for a, b in zip(found, scale, strict=True)) if found else scale
    return found


def _named_axes(array: Any) -> tuple[str, ...]:
    if array.ndim == 3 and array.shape[2] <= 4:
        return ("y", "x", "c")
    return _AXES[-array.ndim :]


def _size(level: Level) -> PixelSize | None:
    if len(level.scale) != len(level.axes) or not level.unit:
        return None
    scale = dict(zip(level.axes, level.scale, strict=True))
    return size_of(scale["x"], scale["y"], level.unit, "OME-Zarr scale")


# --------------------------------------------------------------------------------------------------- values


def _plane(path: Path, level: Level, options: ReadOptions) -> NDArray[Any]:
    index = _index(path, level, options)
    length = dict(zip(level.axes, level.array.shape, strict=True))
    assert_pixels(path, length["x"], length["y"], options)
    _assert_sound(path, level.array, index)
    values = np.asarray(level.array[index])
    return values if level.axes.index("y") < level.axes.index("x") else values.swapaxes(0, 1)


def _index(path: Path, level: Level, options: ReadOptions) -> tuple[Any, ...]:
    """Return the index of the plane that is asked for."""
    array, axes = level.array, level.axes
    if len(axes) != array.ndim or "y" not in axes or "x" not in axes or array.dtype.kind not in "biuf":
        raise InputError(f"{path} has the axes {axes} and shape {array.shape} of {array.dtype}: give a picture of y, x")
    length = dict(zip(axes, array.shape, strict=True))
    colours = axes[-1] == "c" and length["c"] <= 4 and options.channel is None
    inner = "yxc" if colours else "yx"
    names = {"c": "channel", "t": "time", "z": "plane"}
    outer = tuple((names.get(axis, axis), n) for axis, n in length.items() if axis not in inner)
    place = Stack(str(path), outer).choose(options) if outer else {}
    return tuple(slice(None) if axis in inner else place[names.get(axis, axis)] for axis in axes)


def _assert_sound(path: Path, array: Any, index: tuple[Any, ...]) -> None:
    """Raise where a chunk would unpack to far more than it stands for, before memory is used for it."""
    size = int(np.prod(array.chunks, dtype=object)) * array.dtype.itemsize
    most = 2 * int(np.prod(array.shape, dtype=object)) * array.dtype.itemsize + (64 << 20)
    if size > most:
        raise InputError(f"{path} has chunks of {array.chunks} in a picture of {array.shape}: save it in smaller ones")
    for data in _packed(path, array, index):
        if stated_size(data, _codec(array)) > size + SLACK:
            raise too_large(path, size)
        if data[:2] == b"\x1f\x8b" or data[:1] == b"\x78":
            assert_unpacks(path, data, size)


def _packed(path: Path, array: Any, index: tuple[Any, ...]) -> Iterator[bytes]:
    """Give the chunks within `index`, as stored, that are packed tightly."""
    size = int(np.prod(array.chunks, dtype=object)) * array.dtype.itemsize
    folder = Path(str(array.store_path).removeprefix("file://"))
    stored = array.shards or array.chunks
    counts = [-(-n // length) for n, length in zip(array.shape, stored, strict=True)]
    places = zip(index, counts, stored, strict=True)
    touched = [range(n) if isinstance(at, slice) else (at // length,) for at, n, length in places]
    for place in product(*touched):
        file = folder / array.metadata.encode_chunk_key(place)
        if not file.is_file():
            continue
        for start, n in _parts(path, array, file) if array.shards else ((0, file.stat().st_size),):
            if n * TIGHT > size:
                with file.open("rb") as opened:
                    opened.seek(start)
                    yield opened.read(n)


def _parts(path: Path, array: Any, file: Path) -> list[tuple[int, int]]:
    """Return the offset and the length of each chunk of a shard, by the index in it (Zarr 3, sharding_indexed 1.0)."""
    codec = array.metadata.codecs[0]
    n = prod(shard // chunk for shard, chunk in zip(array.shards, array.chunks, strict=True))
    length = 16 * n + 4 * any(type(part).__name__ == "Crc32cCodec" for part in codec.index_codecs)
    with file.open("rb") as opened:
        at_end = str(codec.index_location).lower().endswith("end")
        opened.seek(max(file.stat().st_size - length, 0) if at_end else 0)
        table = np.frombuffer(opened.read(16 * n), "<u8")
    if len(table) < 2 * n:
        raise InputError(f"{path} is cut off: the index of its shard {file.name} is not whole; save it anew")
    return [(start, size) for start, size in table.reshape(-1, 2).tolist() if size < file.stat().st_size]


def _codec(array: Any) -> str:
    """Return the name of the codec that chunks are packed by."""
    codecs = array.compressors  # of a sharded array those of the chunks in a shard
    return type(codecs[0]).__name__.lower() if codecs else ""
