"""Pictures from files, through Pillow, tifffile and NumPy."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.errors import InputError

from .options import ReadOptions
from .picture import Picture, picture_of

__all__ = ["Picture", "ReadOptions", "picture_of", "read_picture"]
FORMATS = ("PNG", "JPEG", "TIFF", "BMP", "DIB", "PPM", "GIF", "WEBP")
KNOWN = "PNG, JPEG, TIFF, BMP, PPM/PGM/PBM, GIF, WebP or NPY"


def read_picture(path: str | Path, options: ReadOptions | None = None) -> Picture:
    """Read a picture from a file.

    Parameters
    ----------
    path : str or Path
        PNG, JPEG, TIFF, BMP, PPM/PGM/PBM, GIF, WebP by their content; NPY by its name. VTK files (.vti) are for
        PyVista: ``pyvista.read(path).imgquad``.
    options : ReadOptions, optional
        Pixel limit, and which frame of a stack.

    Returns
    -------
    Picture
        Grey values and labels as they are stored (8, 16, 32 bit or float; a small range that the format stretches is
        put back: 2 and 4 bit PNG, PGM with a maximum other than 255), palette indices with their palette, or RGB.
        CMYK, YCbCr and the like are turned into RGB. Alpha 0 becomes not opaque. 16 bit RGB is kept from TIFF; of a
        PNG, Pillow gives the upper 8 bits.

    Raises
    ------
    InputError
        If the file is missing, not a picture, cut off, too large, a stack, or holds no pixels or no finite numbers.

    Notes
    -----
    The orientation tag of a camera (EXIF, TIFF) is followed: the mesh lies as every viewer shows the picture.
    """
    path, options = Path(path), options or ReadOptions()
    if path.suffix.lower() in (".vti", ".vtk", ".vtkhdf"):
        raise InputError(f"{path} is for VTK: read it by pyvista.read and mesh it by image.imgquad.mesh(...)")
    try:
        with path.open("rb") as file:
            start = file.read(4)
    except OSError as error:
        raise InputError(f"cannot open the picture {path} ({error.strerror}): give a file that can be read") from error
    if not start:
        raise InputError(f"{path} is empty: give a picture ({KNOWN})")
    if path.suffix.lower() == ".npy":
        return _read_npy(path, options)
    if start in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
        return _read_tiff(path, options)
    return _read_by_pillow(path, options)


@contextmanager
def _decoding(path: Path) -> Iterator[None]:
    """Turn whatever a decoder raises on a broken file into one message."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        # decoders raise OSError, SyntaxError, ValueError, struct.error, zlib.error, IndexError ... on broken files
        text = str(error).strip() or type(error).__name__
        raise InputError(f"{path} cannot be decoded, it is cut off or damaged ({text}): save it anew") from error


def _assert_pixels(path: Path, width: int, height: int, options: ReadOptions) -> None:
    if width * height == 0:
        raise InputError(f"{path} has {width} x {height} pixels: give at least one")
    if width * height > options.max_pixels:
        raise InputError(
            f"{path} has {width} x {height} = {width * height} pixels, more than max_pixels = {options.max_pixels}:"
            " crop or shrink it, or raise max_pixels"
        )


def _chosen_frame(path: Path, n_frames: int, options: ReadOptions) -> int:
    if options.frame is None and n_frames > 1:
        raise InputError(
            f"{path} holds {n_frames} pictures (a stack): choose one with frame = 0 to {n_frames - 1}"
            f" (ReadOptions(frame={n_frames // 2})), or save one slice as a picture of its own"
        )
    frame = options.frame or 0
    if frame >= n_frames:
        raise InputError(f"frame is {frame}, but {path} holds {n_frames}: give 0 to {n_frames - 1}")
    return frame


def _read_npy(path: Path, options: ReadOptions) -> Picture:
    with _decoding(path):
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    stack = array.ndim == 4 or (array.ndim == 3 and array.shape[2] > 4)
    if stack:
        array = array[_chosen_frame(path, len(array), options)]
    if array.ndim >= 2:
        _assert_pixels(path, array.shape[1], array.shape[0], options)
    return picture_of(np.array(array), str(path))


def _read_tiff(path: Path, options: ReadOptions) -> Picture:
    import tifffile

    with _decoding(path), tifffile.TiffFile(path) as file:
        every: list[Any] = list(file.pages)
        pages = [page for page in every if not page.is_reduced] or every
        page = pages[_chosen_frame(path, len(pages), options)].aspage()
        _assert_pixels(path, page.imagewidth, page.imagelength, options)
        if len(pages) == 1 and file.series and file.series[0].size > page.size:
            raise InputError(f"{path} is a stack of the shape {file.series[0].shape}: save one slice as a picture")
        try:
            plain = page.photometric.name in ("MINISBLACK", "MINISWHITE", "RGB", "PALETTE")
            values = page.asarray() if plain else None
        except (ValueError, KeyError, ImportError):
            values = None  # a codec that tifffile lacks; Pillow brings its own
        if values is None:
            return _read_by_pillow(path, options)
        return _tiff_picture(page, values, str(path))


def _tiff_picture(page: Any, values: NDArray[Any], name: str) -> Picture:
    if page.axes.startswith("S"):
        values = np.moveaxis(values, 0, -1)
    if page.photometric.name == "MINISWHITE" and values.dtype.kind in "bu":
        values = ~values
    values = _upright(values, page.tags.valueof(274, default=1))
    if page.photometric.name == "PALETTE" and values.ndim == 2:
        return Picture(values, (page.colormap.T >> 8).astype(np.uint8), name=name)
    extra = len(page.extrasamples or ())
    samples = values.shape[2] if values.ndim == 3 else 1
    if samples > 4 or (samples - extra, extra) not in ((1, 0), (1, 1), (3, 0), (3, 1)):
        raise InputError(f"{name} has {samples} channels: give grey or RGB, with or without alpha")
    return picture_of(values, name)


def _upright(values: NDArray[Any], orientation: int) -> NDArray[Any]:
    """Turn pixels as the orientation tag (TIFF 6.0, EXIF) says: where the stored rows and columns start."""
    if orientation in (5, 6, 7, 8):
        values = values.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        values = values[::-1]
    if orientation in (2, 3, 6, 7):
        values = values[:, ::-1]
    return np.ascontiguousarray(values)


@contextmanager
def _own_pixel_limit() -> Iterator[None]:
    """Leave the decision on large pictures to `max_pixels`; Pillow keeps a global limit of its own."""
    from PIL import Image

    limit = Image.MAX_IMAGE_PIXELS
    Image.MAX_IMAGE_PIXELS = None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        Image.MAX_IMAGE_PIXELS = limit


def _read_by_pillow(path: Path, options: ReadOptions) -> Picture:
    from PIL import Image, UnidentifiedImageError

    with _own_pixel_limit(), _decoding(path):
        try:
            image = Image.open(path, formats=FORMATS)
        except UnidentifiedImageError as error:
            raise InputError(f"{path} is not a picture that can be read: give {KNOWN}") from error
        with image:
            _assert_pixels(path, *image.size, options)
            # a camera's MPO holds previews beside the picture
            n_frames = 1 if image.format == "MPO" else getattr(image, "n_frames", 1)
            image.seek(_chosen_frame(path, n_frames, options))
            _assert_pixels(path, *image.size, options)
            return _pillow_picture(image, str(path))


def _pillow_picture(image: Any, name: str) -> Picture:
    stretch = _stretch(image)
    if image.mode not in ("1", "L", "LA", "P", "PA", "RGB", "RGBA", "I", "F") and not image.mode.startswith("I;16"):
        image = image.convert("RGBA" if image.mode in ("RGBa", "La") else "RGB")
    values = np.asarray(image)
    orientation = 1 if image.format == "TIFF" else image.getexif().get(274, 1)
    values = _upright(values, orientation)
    if image.mode == "I" and image.format in ("PNG", "PPM"):
        values = values.astype(np.uint16)
    if image.mode in ("P", "PA"):
        return _palette_picture(image, values, name)
    clear = image.info.get("transparency")
    picture = picture_of(values, name)
    if clear is not None and picture.opaque is None:
        same = np.atleast_3d(values) == np.atleast_1d(clear)
        picture = replace(picture, opaque=~same.all(axis=2))
    if stretch != 1 and picture.is_grey:
        unstretched = np.rint(picture.values * stretch).astype(picture.values.dtype)
        picture = replace(picture, values=unstretched)
    return picture


def _stretch(image: Any) -> float:
    """Return what undoes Pillow's stretching of a small range of grey values to 8 or 16 bits."""
    if not image.tile:
        return 1.0
    args = image.tile[0][3]
    mode = args if isinstance(args, str) else args[0]
    if image.format == "PNG" and mode in ("L;2", "L;4"):
        return 3 / 255 if mode == "L;2" else 15 / 255
    if image.format == "PPM" and mode == "L" and isinstance(args, tuple) and isinstance(args[-1], int):
        return args[-1] / (255 if image.mode == "L" else 65535)
    return 1.0


def _palette_picture(image: Any, values: NDArray[Any], name: str) -> Picture:
    indices = values if values.ndim == 2 else values[..., 0]
    palette = np.array(image.getpalette("RGB"), np.uint8).reshape(-1, 3)
    n_missing = int(indices.max()) + 1 - len(palette)
    if n_missing > 0:
        palette = np.concatenate([palette, np.zeros((n_missing, 3), np.uint8)])
    opaque = np.ones(256, bool)
    clear = image.info.get("transparency")
    if isinstance(clear, bytes):
        opaque[: len(clear)] = np.frombuffer(clear, np.uint8) > 0
    elif clear is not None:
        opaque[clear] = False
    seen = opaque[indices] if values.ndim == 2 else values[..., 1] > 0
    return Picture(indices, palette, None if seen.all() else seen, False, name)
