"""Takes the times out of HDF5 files that other libraries have written: the same mesh gives the same bytes.

HDF5 File Format Specification 3.0 (The HDF Group), IV.A.1 (object headers) and IV.A.2.s (modification time). Headers of
version 2 carry a checksum: Bob Jenkins' lookup3 (public domain, 2006).
"""

from __future__ import annotations

import mmap
import re
import struct
from pathlib import Path

_MASK = 0xFFFFFFFF
#: message of type 18 with 8 bytes: flags, 3 reserved, version 1, 3 reserved, then the time
_MESSAGE = re.compile(rb"\x12\x00\x08\x00[\x00-\x0f]\x00\x00\x00\x01\x00\x00\x00", re.DOTALL)
_HEADER = re.compile(rb"OHDR\x02", re.DOTALL)
_WITH_TIMES, _WITH_LIMITS = 0x20, 0x10  # flags of a header


def erase_times(path: Path, start: float, end: float) -> None:
    """Set the times that lie between `start` and `end` (seconds since 1970), when the file was written, to zero."""
    with path.open("r+b") as stream, mmap.mmap(stream.fileno(), 0) as data:
        for match in _MESSAGE.finditer(data):
            if match.end() + 4 <= len(data) and int(start) <= struct.unpack_from("<I", data, match.end())[0] <= end:
                data[match.end() : match.end() + 4] = bytes(4)
        for match in _HEADER.finditer(data):
            _erase_in_header(data, match.start())


def _erase_in_header(data: mmap.mmap, start: int) -> None:
    """Erase the four times of a header of version 2, if it is one: its checksum tells."""
    flags = data[start + 5]
    if not flags & _WITH_TIMES:
        return
    at = start + 22 + (4 if flags & _WITH_LIMITS else 0)
    width = 1 << (flags & 3)
    end = at + width + int.from_bytes(data[at : at + width], "little")
    if end + 4 <= len(data) and struct.pack("<I", _lookup3(data[start:end])) == data[end : end + 4]:
        data[start + 6 : start + 22] = bytes(16)
        data[end : end + 4] = struct.pack("<I", _lookup3(data[start:end]))


def _lookup3(data: bytes) -> int:
    """Bob Jenkins' hash of 32 bits, with the initial value 0."""
    a = b = c = (0xDEADBEEF + len(data)) & _MASK
    if not data:
        return c
    last = (len(data) - 1) // 12 * 12
    for at in range(0, last, 12):
        x, y, z = struct.unpack_from("<3I", data, at)
        a, b, c = _mixed((a + x) & _MASK, (b + y) & _MASK, (c + z) & _MASK)
    x, y, z = struct.unpack("<3I", data[last:].ljust(12, b"\0"))
    return _final((a + x) & _MASK, (b + y) & _MASK, (c + z) & _MASK)


def _turned(x: int, k: int) -> int:
    return ((x << k) | (x >> (32 - k))) & _MASK


def _mixed(a: int, b: int, c: int) -> tuple[int, int, int]:
    for k in (4, 6, 8, 16, 19, 4):  # the three change places at each step
        a = ((a - c) & _MASK) ^ _turned(c, k)
        c = (c + b) & _MASK
        a, b, c = b, c, a
    return a, b, c


def _final(a: int, b: int, c: int) -> int:
    for k in (14, 11, 25, 16, 4, 14, 24):
        c = ((c ^ b) - _turned(b, k)) & _MASK
        a, b, c = b, c, a
    return b
