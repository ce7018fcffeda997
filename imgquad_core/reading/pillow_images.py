"""PNG, JPEG, BMP, PPM, GIF and WebP, by Pillow."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from imgquad_core.errors import InputError

from .calibration import Calibration, printing_density
from .decoding import Stack, assert_pixels, decoding, missing_extra, upright
from .options import ReadOptions
from .picture import Picture, picture_of

#: Pillow's names of what it is let to read
FORMATS = ("PNG", "JPEG", "TIFF", "BMP", "DIB", "PPM", "GIF", "WEBP")
_AS_IT_IS = ("1", "L", "LA", "P", "PA", "RGB", "RGBA", "I", "F")


def read_by_pillow(path: Path, options: ReadOptions) -> Picture:
    """Read a picture of one of `FORMATS`.

    Raises
    ------
    InputError
        It is none of them, damaged, too large, or a stack of which none is chosen.
    """
    with _own_pixel_limit(), decoding(path):
        try:
            image = Image.open(path, formats=FORMATS)
        except UnidentifiedImageError as error:
            raise InputError(f"{path} is not a picture that can be read") from error
        with image:
            assert_pixels(path, *image.size, options)
            # a camera's MPO holds previews beside the picture
            n_frames = 1 if image.format == "MPO" else getattr(image, "n_frames", 1)
            image.seek(Stack(str(path), (("frame", n_frames),)).choose(options)["frame"])
            assert_pixels(path, *image.size, options)
            return _picture(image, path)


@contextmanager
def _own_pixel_limit() -> Iterator[None]:
    """Leave the decision on large pictures to `max_pixels`; Pillow keeps a global limit of its own."""
    limit = Image.MAX_IMAGE_PIXELS
    Image.MAX_IMAGE_PIXELS = None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        Image.MAX_IMAGE_PIXELS = limit


def _picture(image: Any, path: Path) -> Picture:
    found = _of_values(image, str(path)) if image.format != "PNG" or not _is_deep(image) else _deep(image, path)
    orientation, note = _orientation(image)
    notes = (*found.notes, *filter(None, (note, _shape_in_alpha(found))))
    return replace(_turned(found, orientation), calibration=Calibration(_density(image)), notes=notes)


def _shape_in_alpha(picture: Picture) -> str:
    """Say so where all that is opaque has one colour: then only alpha tells the shape."""
    if picture.opaque is None or not picture.opaque.any() or picture.palette is not None:
        return ""
    seen = picture.values[picture.opaque]
    is_flat = bool((seen == seen[0]).all())
    return "all that is opaque has one colour: drop-transparent leaves the rest out" if is_flat else ""


def _of_values(image: Any, name: str) -> Picture:
    stretch = _stretch(image)
    if image.mode not in _AS_IT_IS and not image.mode.startswith("I;16"):
        image = image.convert("RGBA" if image.mode in ("RGBa", "La") else "RGB")
    values = np.asarray(image)
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


def _turned(picture: Picture, orientation: int) -> Picture:
    if orientation == 1:
        return picture
    opaque = None if picture.opaque is None else upright(picture.opaque, orientation)
    return replace(picture, values=upright(picture.values, orientation), opaque=opaque)


def _orientation(image: Any) -> tuple[int, str]:
    """Return the orientation to follow, and what to say of it.

    A program that turns the pixels and forgets the tag leaves the size of the picture as it was before (EXIF's
    PixelXDimension and PixelYDimension): the tag is stale then.
    """
    if image.format == "TIFF":
        return 1, ""  # tifffile's tags are followed where the file is read
    exif = image.getexif()
    orientation = int(exif.get(274, 1))
    if orientation not in range(2, 9):
        return 1, ""
    details = exif.get_ifd(0x8769)
    before = (details.get(40962), details.get(40963))
    if orientation >= 5 and before == (image.height, image.width) and image.height != image.width:
        return 1, f"orientation tag {orientation} is older than the pixels (it was {before[0]} wide): not followed"
    return orientation, f"turned upright by its orientation tag {orientation}"


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


def _is_deep(image: Any) -> bool:
    """Whether a PNG holds colours of 16 bits, of which Pillow gives the upper 8."""
    args = image.tile[0][3] if image.tile else ""
    mode = args if isinstance(args, str) else args[0]
    return mode in ("RGB;16B", "RGBA;16B", "LA;16B")


def _deep(image: Any, path: Path) -> Picture:
    try:
        from imagecodecs import png_decode  # an extra
    except ImportError:
        found = _of_values(image, str(path))
        told = f"16 bits a channel, of which the upper 8 are taken: {missing_extra('tiff')} for all"
        return replace(found, notes=(*found.notes, told))
    return picture_of(png_decode(path.read_bytes()), str(path))


def _palette_picture(image: Any, values: NDArray[Any], name: str) -> Picture:
    indices = values if values.ndim == 2 else values[..., 0]
    palette = np.array(image.getpalette("RGB"), np.uint8).reshape(-1, 3)
    n_missing = int(indices.max()) + 1 - len(palette)
    if n_missing > 0:
        palette = np.concatenate([palette, np.zeros((n_missing, 3), np.uint8)])
    opaque = np.ones(256, bool)
    clear = image.info.get("transparency")
    if isinstance(clear, bytes):
        opaque[: len(clear)] = np.frombuffer(clear, np.uint8) >= 128
    elif clear is not None:
        opaque[clear] = False
    seen = opaque[indices] if values.ndim == 2 else values[..., 1] >= 128
    return Picture(indices, palette, None if seen.all() else seen, False, name)


def _density(image: Any) -> Any:
    """Tell a printing density where it is finer than printers are: never taken."""
    try:
        x, y = (float(part) for part in image.info["dpi"][:2])
    except (KeyError, TypeError, ValueError):
        return None
    return printing_density(x, y, "inch", "resolution of the picture") if x > 0.0 and y > 0.0 else None
