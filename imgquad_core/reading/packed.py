"""What packed bytes unpack to, asked before memory is used: a few bytes can stand for gigabytes."""

from __future__ import annotations

import lzma
import struct
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path

from imgquad_core.errors import InputError

#: what is unpacked may be larger than what it stands for by this many bytes
SLACK = 1 << 16
#: deflate packs no tighter
DEFLATE = 1032


def assert_unpacks(path: Path | str, data: bytes, size: int) -> None:
    """Raise `InputError` if deflated bytes (zlib or gzip) unpack to more than `size`; memory stays below that."""
    unpacker = zlib.decompressobj(wbits=47)  # either header
    if len(unpacker.decompress(data, size + SLACK)) >= size + SLACK:
        raise too_large(path, size)


def too_large(path: Path | str, size: int) -> InputError:
    """Return the error for packed bytes that unpack to more than `size`."""
    return InputError(f"{path} unpacks to more than its {size} bytes: it is damaged, save it anew")


def stated_size(data: bytes, codec: str) -> int:
    """Return the size that packed bytes say they unpack to (Zstandard, Blosc, LZ4); 0 where they say nothing."""
    if data[:4] == b"\x28\xb5\x2f\xfd":
        return _zstd_size(data)
    if "blosc" in codec and len(data) >= 16:
        return int.from_bytes(data[4:8], "little")
    if "lz4" in codec and len(data) >= 4:
        return int.from_bytes(data[:4], "little")
    return 0


def _zstd_size(data: bytes) -> int:
    """Read the size of the content from a frame's header (RFC 8878, 3.1.1.1)."""
    flags = data[4]
    single = bool(flags & 0x20)
    start = 5 + (0 if single else 1) + (0, 1, 2, 4)[flags & 3]
    n = ((1 if single else 0), 2, 4, 8)[flags >> 6]
    return int.from_bytes(data[start : start + n], "little") + (256 if n == 2 else 0)


# ------------------------------------------------------------------------------------------- tiles of TIFF


def assert_tile(path: Path | str, data: bytes, compression: int, pixels: int, size: int) -> None:
    """Raise `InputError` if a tile or strip of TIFF unpacks to far more than it stands for.

    Parameters
    ----------
    path : Path or str
        For the message.
    data : bytes
        As stored.
    compression : int
        TIFF's number.
    pixels, size : int
        Pixels and bytes of a tile.
    """
    if compression in _DEFLATE and len(data) * DEFLATE > size:
        assert_unpacks(path, data, size + SLACK)
    elif compression in _LZMA:
        if len(lzma.LZMADecompressor().decompress(data, size + SLACK)) >= size + SLACK:
            raise too_large(path, size)
    elif compression in _ZSTD:
        if len(data) > 13 and stated_size(data, "zstd") > size + SLACK:
            raise too_large(path, size)
    elif compression in _PICTURES:
        width, height = _PICTURES[compression](data)
        if width * height > 2 * pixels + SLACK:
            raise InputError(f"{path} holds a tile of {width} x {height} pixels in place of {pixels}: save it anew")


def _jpeg_shape(data: bytes) -> tuple[int, int]:
    """Return columns and rows by the frame's header (ITU T.81, B.2.2); 0, 0 where there is none."""
    at = 2
    while at + 9 <= len(data):
        marker, length = data[at + 1], int.from_bytes(data[at + 2 : at + 4], "big")
        if data[at] != 0xFF:
            break
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack(">HH", data[at + 5 : at + 9])
            return width, height
        at += 2 + length
    return 0, 0


def _jpeg2000_shape(data: bytes) -> tuple[int, int]:
    """Return columns and rows by the SIZ marker of the code stream (ITU T.800, A.5.1)."""
    at = data.find(b"\xff\x4f\xff\x51")
    if at < 0 or at + 24 > len(data):
        return 0, 0
    width, height, left, upper = struct.unpack(">IIII", data[at + 8 : at + 24])
    return width - left, height - upper


def _png_shape(data: bytes) -> tuple[int, int]:
    width, height = struct.unpack(">II", data[16:24]) if len(data) >= 24 else (0, 0)
    return width, height


def _webp_shape(data: bytes) -> tuple[int, int]:
    """Return columns and rows by the first chunk (RFC 9649)."""
    kind = data[12:16]
    if kind == b"VP8X":
        return 1 + int.from_bytes(data[24:27], "little"), 1 + int.from_bytes(data[27:30], "little")
    if kind == b"VP8L":
        bits = int.from_bytes(data[21:25], "little")
        return 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
    return int.from_bytes(data[26:28], "little") & 0x3FFF, int.from_bytes(data[28:30], "little") & 0x3FFF


def _lerc_shape(data: bytes) -> tuple[int, int]:
    """Return columns and rows by the header of Lerc2: name, version, check sum from version 3 on, rows, columns."""
    if data[:6] != b"Lerc2 " or len(data) < 22:
        return 0, 0
    start = 14 if int.from_bytes(data[6:10], "little") >= 3 else 10
    height, width = struct.unpack("<II", data[start : start + 8])
    return width, height


_DEFLATE, _LZMA, _ZSTD = (8, 32946), (34925,), (50000, 34926)
_PICTURES: Mapping[int, Callable[[bytes], tuple[int, int]]] = {
    **dict.fromkeys((6, 7, 33007, 34892), _jpeg_shape),
    **dict.fromkeys((33003, 33004, 33005, 34712), _jpeg2000_shape),
    **dict.fromkeys((34933,), _png_shape),
    **dict.fromkeys((34927, 50001), _webp_shape),
    **dict.fromkeys((34887,), _lerc_shape),
}
