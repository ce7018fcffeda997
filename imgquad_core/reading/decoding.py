"""What all readers share: one message for broken files, limits before decoding, which picture of a stack."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from math import prod
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.errors import InputError

from .options import ReadOptions

#: what each extra of the package installs
EXTRAS = {
    "tiff": "imagecodecs",
    "nrrd": "pynrrd",
    "nifti": "nibabel",
    "mrc": "mrcfile",
    "zarr": "zarr",
    "hdf5": "h5py",
    "dicom": "pydicom",
    "lif": "liffile",
}


@contextmanager
def decoding(path: Path) -> Iterator[None]:
    """Turn whatever a decoder raises on a broken file into one message."""
    try:
        yield
    except InputError:
        raise
    except MemoryError as error:
        raise InputError(
            f"{path} takes more memory to read than there is: end other programs, cut the picture, or make it smaller"
        ) from error
    except Exception as error:
        # decoders raise OSError, SyntaxError, ValueError, struct.error, zlib.error, IndexError ... on broken files
        text = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path} cannot be decoded, it is cut off or damaged ({text[:200]}): save it anew") from error


def missing_extra(extra: str) -> str:
    """Return the remedy for a missing package."""
    return f"pip install {EXTRAS[extra]} (or imgquad-mesh[{extra}])"


def optional(extra: str, path: Path, module: str | None = None) -> Any:
    """Return an optional package, imported; name it in the error if it is missing."""
    try:
        return import_module(module or EXTRAS[extra])
    except ImportError as error:
        raise InputError(f"{path} needs a package that is not installed: {missing_extra(extra)}") from error


def assert_pixels(path: Path | str, width: int, height: int, options: ReadOptions) -> None:
    """Raise `InputError` for no pixels, or more than are allowed."""
    if width * height == 0:
        raise InputError(f"{path} has {width} x {height} pixels: give at least one")
    if width * height > options.max_pixels:
        raise InputError(
            f"{path} has {width} x {height} = {width * height} pixels, more than max_pixels = {options.max_pixels}:"
            " crop or shrink it, or raise max_pixels"
        )


class NoSuchPicture(InputError):
    """A number of a picture that a file does not hold; `n` is how many it holds."""

    def __init__(self, message: str, n: int) -> None:
        super().__init__(message)
        self.n = n

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.n)


class Stack(NamedTuple):
    """The axes of a file that holds several pictures, slowest first: their names and lengths.

    The axis named "channel" is chosen by `channel`, all others together by `frame`.
    """

    name: str
    axes: tuple[tuple[str, int], ...]

    @property
    def size(self) -> int:
        """Number of pictures."""
        return prod(n for _, n in self.axes)

    @property
    def _has_channels(self) -> bool:
        return any(axis == "channel" and n > 1 for axis, n in self.axes)

    def choose(self, options: ReadOptions) -> dict[str, int]:
        """Return the place along each axis.

        Raises
        ------
        InputError
            There are several pictures and none is chosen, or there is no such one.
        """
        others = [(axis, n) for axis, n in self.axes if axis != "channel"]
        n_frames = prod(n for _, n in others)
        frame = self._one("frame", options.frame, n_frames) if n_frames > 1 or not self._has_channels else 0
        channels = prod(n for axis, n in self.axes if axis == "channel")
        places = np.unravel_index(frame, tuple(n for _, n in others)) if others else ()
        found = {axis: int(place) for (axis, _), place in zip(others, places, strict=True)}
        if any(axis == "channel" for axis, _ in self.axes):
            only = channels == self.size and options.channel is None  # then a frame is a channel
            found["channel"] = self._one("channel", options.frame if only else options.channel, channels)
        return found

    def place(self, options: ReadOptions) -> int:
        """Return the number of the chosen picture, the last axis fastest."""
        found = self.choose(options)
        if not self.axes:
            return 0
        return int(np.ravel_multi_index([found[axis] for axis, _ in self.axes], [n for _, n in self.axes]))

    def _one(self, what: str, asked: int | None, n: int) -> int:
        if asked is None and n > 1:
            shape = " x ".join(f"{n} {axis}s" for axis, n in self.axes if n > 1)
            parts = f" of {shape}" if len(self.axes) > 1 else ""
            raise InputError(
                f"{self.name} holds {self.size} pictures (a stack{parts}): choose one with {what} = 0 to {n - 1}"
                f" (--{what} {n // 2}), or save one slice as a picture of its own"
            )
        place = asked or 0
        if place >= n:
            raise NoSuchPicture(f"{what} is {place}, but {self.name} holds {n}: give 0 to {n - 1}", n)
        return place


def upright(values: NDArray[Any], orientation: int) -> NDArray[Any]:
    """Turn pixels as the orientation tag (TIFF 6.0, EXIF) says: where the stored rows and columns start."""
    if orientation in (5, 6, 7, 8):
        values = values.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        values = values[::-1]
    if orientation in (2, 3, 6, 7):
        values = values[:, ::-1]
    return np.ascontiguousarray(values)
