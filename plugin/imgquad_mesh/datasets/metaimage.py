"""Is a MetaImage whole? VTK fills what a cut or damaged one lacks with whatever lies in memory, without an error.

The header is lines of ``Key = value`` up to ``ElementDataFile``: ITK's MetaIO documentation.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from imgquad_core.errors import InputError
from imgquad_core.reading.decoding import assert_pixels
from imgquad_core.reading.options import ReadOptions

#: extensions of pictures that VTK reads
VTK_EXTENSIONS = (".vti", ".mha", ".mhd")
_LONGEST_HEADER = 1 << 16
_BYTES = {
    "CHAR": 1, "UCHAR": 1, "SHORT": 2, "USHORT": 2, "INT": 4, "UINT": 4, "LONG": 4, "ULONG": 4,
    "LONG_LONG": 8, "ULONG_LONG": 8, "FLOAT": 4, "DOUBLE": 8,
}  # fmt: skip
_PIECE = 1 << 20  #: bytes that are unpacked at a time
_CURE = "save it anew"


class _Header(NamedTuple):
    """What a header says of the data."""

    fields: Mapping[str, str]
    end: int  #: bytes of the file before the data
    rest: str  #: lines after the header, for a list of files

    @property
    def is_packed(self) -> bool:
        """Whether the data are deflated."""
        return self.fields.get("CompressedData", "").lower() in ("true", "1")

    @property
    def size(self) -> int:
        """Bytes of the data, unpacked."""
        found = _BYTES[self.fields["ElementType"].removeprefix("MET_").removesuffix("_ARRAY")]
        for side in self.fields["DimSize"].split():
            found *= int(side)
        return found * int(self.fields.get("ElementNumberOfChannels", "1"))


def assert_whole(path: Path, options: ReadOptions) -> None:
    """Raise `InputError` if a MetaImage (.mha, .mhd) does not hold the bytes that its header says.

    Raises
    ------
    InputError
        It has more pixels than `options` allow, the header is none, a file of data is missing, or the data are cut off,
        damaged, or numbers as text.
    """
    try:
        header = _header(path)
        size = header.size
        rows, columns = sorted(int(side) for side in header.fields["DimSize"].split())[-2:]
        assert_pixels(path, columns, rows, options)
        files = [path] if header.fields["ElementDataFile"].upper() == "LOCAL" else list(_files(path, header))
        skipped = header.end if files == [path] else max(int(header.fields.get("HeaderSize", "0")), 0)
    except InputError:
        raise
    except (KeyError, ValueError, TypeError) as error:
        raise InputError(f"{path} has no header of a MetaImage that can be read ({error}): {_CURE}") from error
    if header.fields.get("BinaryData", "True").lower() in ("false", "0"):
        raise InputError(f"{path} holds numbers as text, which is not read: save it with BinaryData = True")
    missing = [file.name for file in files if not file.is_file()]
    if missing:
        raise InputError(f"{path} has its data in {missing[0]}, which is missing: put it there, or save one .mha")
    if header.is_packed:
        found = sum(_unpacked_size(file, skipped, size) for file in files)
    else:
        found = min(sum(file.stat().st_size - skipped for file in files), size)
    if found != size:
        raise InputError(f"{path} is cut off or damaged, it says that it holds {size} bytes: {_CURE}")


def _header(path: Path) -> _Header:
    with path.open("rb") as file:
        start = file.read(_LONGEST_HEADER)
    found = re.search(rb"^ElementDataFile[ \t]*=[ \t]*([^\r\n]*)\r?(\n|$)", start, re.MULTILINE)
    if found is None:
        raise ValueError("no ElementDataFile")
    lines = start[: found.end()].decode("latin-1").splitlines()
    pairs = (line.split("=", 1) for line in lines if "=" in line)
    return _Header(
        {key.strip(): value.strip() for key, value in pairs}, found.end(), start[found.end() :].decode("latin-1")
    )


def _files(path: Path, header: _Header) -> Iterator[Path]:
    """Yield the files of the data: one, a list (one a line), or numbered ones (pattern, first, last, step)."""
    words = header.fields["ElementDataFile"].split()
    if words[0].upper() == "LIST":
        names = [line.strip() for line in header.rest.splitlines() if line.strip()]
    elif "%" in words[0]:
        first, last, step = (int(word) for word in [*words[1:], "1"][:3])
        names = [words[0] % k for k in range(first, last + 1, step)]
    else:
        names = [header.fields["ElementDataFile"]]
    yield from (path.parent / name for name in names)


def _unpacked_size(file: Path, skipped: int, most: int) -> int:
    """Return how many bytes deflated data unpack to; 0 if they are damaged or more than `most`."""
    unpacker, found = zlib.decompressobj(), 0
    with file.open("rb") as stream:
        stream.seek(skipped)
        data = stream.read()
    try:
        while data and not unpacker.eof and found <= most:
            found += len(unpacker.decompress(data, _PIECE))
            data = unpacker.unconsumed_tail
    except zlib.error:
        return 0
    return found if unpacker.eof and found <= most else 0
