"""Texts of variable length in HDF5 files, which lie in heaps that the HDF5 library does not check before it walks them.

A heap whose sizes are damaged is walked for ever: each is walked here first.

    address  "GCOL"  version  size of all
             index  references  size  bytes, padded to 8      an object
             ...
             0      0           size of what is left free     the end: a size of 0 would be no step

HDF5 File Format Specification 3.0, III.E, "Disk Format: Level 1E - Global Heap".
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from imgquad_core.errors import InputError

from .decoding import optional

_MOST_TEXTS = 100_000
_HEAD = 16  #: bytes before the first object of a heap, and before the bytes of each object
_REFERENCE = np.dtype([("length", "<u4"), ("heap", "<u8"), ("index", "<u4")])


def texts_of(path: Path, dataset: Any) -> list[str]:
    """Return the texts of a dataset, in the order of its values.

    Raises
    ------
    InputError
        It has more than a header may, or its texts are damaged.
    """
    if dataset.size is None or dataset.size > _MOST_TEXTS:
        raise InputError(f"{path} holds {dataset.size} texts in {dataset.name}: it is damaged, save it anew")
    if optional("hdf5", path).check_string_dtype(dataset.dtype) is None:
        raise InputError(f"{path} holds no texts in {dataset.name}: it is damaged, save it anew")
    if dataset.dtype.kind == "O":
        _assert_sound_heaps(path, dataset)
    values = np.ravel(dataset[()]).tolist()
    return [value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value) for value in values]


def _assert_sound_heaps(path: Path, dataset: Any) -> None:
    """Walk the heaps that a dataset refers to, where it lies in one piece and addresses have eight bytes."""
    start = dataset.id.get_offset()
    if start is None or dataset.file.id.get_create_plist().get_sizes() != (8, 8):
        return
    base = dataset.file.userblock_size
    with path.open("rb") as file:
        file.seek(start)
        data = file.read(dataset.size * _REFERENCE.itemsize)
        heaps = np.unique(np.frombuffer(data, _REFERENCE, len(data) // _REFERENCE.itemsize)["heap"])
        if not all(_is_sound(file, base + heap) for heap in heaps.tolist() if heap):
            raise InputError(f"{path} is damaged where the texts of {dataset.name} lie: save it anew")


def _is_sound(file: BinaryIO, address: int) -> bool:
    end_of_file = file.seek(0, 2)
    file.seek(min(address, end_of_file))
    head = file.read(_HEAD)
    size = int.from_bytes(head[8:], "little")
    if head[:4] != b"GCOL" or not _HEAD <= size <= end_of_file - address:
        return False
    heap = head + file.read(size - _HEAD)
    place = _HEAD
    while size - place >= _HEAD:
        index, length = struct.unpack_from("<H6xQ", heap, place)
        step = length if index == 0 else _HEAD + -(-length // 8) * 8
        if not _HEAD <= step <= size - place:
            return False
        place += step
    return True
