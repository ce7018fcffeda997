"""TIFF files as instruments and programs write them: which page, which channel, what its numbers mean."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Flags
from imgquad_core.errors import InputError

from .calibration import Box, Calibration
from .decoding import Stack, assert_pixels, decoding, missing_extra, upright
from .georeference import georeference, no_data
from .options import ReadOptions
from .packed import assert_tile
from .picture import Picture, either, picture_of
from .pillow_images import read_by_pillow
from .tiff_pixel_size import tiff_pixel_size

#: how the file starts, classic and BigTIFF
MAGIC = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_PLAIN = ("MINISBLACK", "MINISWHITE", "RGB", "PALETTE")


@dataclass(frozen=True)
class Plane:
    """One picture of a file.

    Parameters
    ----------
    page : tifffile.TiffPage
        The page that holds it.
    mask : tifffile.TiffPage, optional
        The page that says which of its pixels are valid.
    offset : int, optional
        Where its values start in the file, if it has no page of its own (long ImageJ stacks).
    coarse : float
        How much larger its pixels are than those of the full picture.
    channel : int, optional
        Which of its samples is asked for.
    """

    page: Any
    mask: Any = None
    offset: int | None = None
    coarse: float = 1.0
    channel: int | None = None


def read_tiff(path: Path, options: ReadOptions) -> Picture:
    """Read a picture from a TIFF file: by tifffile, or what it cannot decode by Pillow."""
    import tifffile  # not above: other pictures do without it

    with decoding(path), _silent(), tifffile.TiffFile(path) as file:
        plane = _chosen(path, file, options)
        page = plane.page
        if page.imagewidth * page.imagelength > options.max_pixels and options.crop:
            return _part(path, file, plane, options, options.crop)
        assert_pixels(path, page.imagewidth, page.imagelength, options)
        values = _values(plane, file)
        if values is None:
            picture = _by_pillow(path, plane, file, options)
        else:
            picture = _picture(plane, values, str(path))
        if plane.mask is not None:
            _assert_no_bomb(plane.mask, file, range(len(plane.mask.dataoffsets)))
            picture = _with_void(picture, plane.mask.asarray(), page.tags.valueof(274, default=1))
        return replace(_placed(picture, file, plane), bar_rows=_bar_rows(file, page))


@contextmanager
def _silent() -> Iterator[None]:
    """Keep tifffile from logging what the notes and errors here say, or what is of no account."""
    log = logging.getLogger("tifffile")
    before, log.disabled = log.disabled, True
    try:
        yield
    finally:
        log.disabled = before


def _bar_rows(file: Any, page: Any) -> int:
    """Return the rows below the scanned ones, by the tags of FEI and Thermo Fisher."""
    image = (file.fei_metadata or {}).get("Image", {})
    if image.get("ResolutionX") != page.imagewidth:
        return 0
    return max(int(page.imagelength) - int(image.get("ResolutionY", page.imagelength)), 0)


# ---------------------------------------------------------------------------------------------- which page


def _chosen(path: Path, file: Any, options: ReadOptions) -> Plane:
    """Return the page that the options ask for, or the only one there is."""
    if file.is_ome or file.is_imagej:
        return _of_series(path, file.series[0], options)
    every = list(_each_page(path, file.series[0].pages if file.is_svs else file.pages))
    full = [page for page in every if not page.is_reduced and not _is_mask(page)] or every
    stack = Stack(str(path), (("frame", len(full)),))
    page = full[stack.choose(options).get("frame", 0)]
    if len(full) == 1 and file.series and file.series[0].size > page.size:
        raise InputError(f"{path} is a stack of the shape {file.series[0].shape}: save one slice as a picture")
    if options.level:
        return _coarser(path, file, every, page, options)
    return Plane(page, next((mask for mask in every if _masks(mask, page)), None), channel=options.channel)


def _each_page(path: Path, pages: Any) -> Iterator[Any]:
    """Return the pages; of a damaged file they may come again and again, which tifffile sees at the hundredth only."""
    seen: set[int] = set()
    for page in pages:
        if page.offset in seen:
            raise InputError(f"{path} is damaged, its pages go round in a circle: save it anew")
        seen.add(page.offset)
        yield page.aspage()


def _is_mask(page: Any) -> bool:
    return bool(page.is_mask or getattr(page.photometric, "name", "") == "MASK" or int(page.photometric or 0) == 4)


def _masks(mask: Any, page: Any) -> bool:
    return _is_mask(mask) and (mask.imagewidth, mask.imagelength) == (page.imagewidth, page.imagelength)


def _coarser(path: Path, file: Any, every: list[Any], page: Any, options: ReadOptions) -> Plane:
    """Return a level of a pyramid: reduced pages, those below the page, or the levels of a whole slide."""
    if file.is_svs:
        found = [part.pages[0].aspage() for part in file.series[0].levels[1:]]
    else:
        below = [sub.aspage() for sub in (page.pages or ())]
        found = [p for p in every if p.is_reduced and not _is_mask(p)] + below
    found.sort(key=lambda p: -int(p.imagewidth))
    if options.level > len(found):
        raise InputError(f"level is {options.level}, but {path} has {len(found) + 1}: give 0 (finest) to {len(found)}")
    chosen = found[options.level - 1]
    mask = next((mask for mask in every if _masks(mask, chosen)), None)
    return Plane(chosen, mask, coarse=page.imagewidth / chosen.imagewidth, channel=options.channel)


def _of_series(path: Path, series: Any, options: ReadOptions) -> Plane:
    """Return the page of a hyperstack: axes and their order are known."""
    if options.level >= len(series.levels):
        n = len(series.levels)
        raise InputError(f"level is {options.level}, but {path} has {n}: give 0 (finest) to {n - 1}")
    fine, series = series, series.levels[options.level]
    first = series.pages[0].aspage()
    outer = [(axis, n) for axis, n in zip(series.axes, series.shape, strict=True) if axis not in "YXS"]
    stack = Stack(str(path), tuple((_AXES.get(axis, axis), n) for axis, n in outer))
    place = stack.place(options)
    coarse = fine.pages[0].aspage().imagewidth / first.imagewidth
    channel = None if "C" in series.axes else options.channel
    if len(series.pages) == stack.size:
        return Plane(series.pages[place].aspage(), coarse=coarse, channel=channel)
    if series.dataoffset is None or first.planarconfig != 1:
        raise InputError(f"{path} is a stack of the shape {series.shape} within one page: save one slice as a picture")
    size = int(np.prod([n for axis, n in zip(series.axes, series.shape, strict=True) if axis in "YXS"]))
    offset = int(series.dataoffset) + place * size * series.dtype.itemsize
    return Plane(first, offset=offset, coarse=coarse, channel=channel)


_AXES: Mapping[str, str] = {"C": "channel", "T": "time", "Z": "plane"}


# ------------------------------------------------------------------------------------------------- decoding


def _values(plane: Plane, file: Any) -> NDArray[Any] | None:
    """Return the values of a page as they are stored; None if tifffile has no decoder for them."""
    page = plane.page
    if plane.offset is not None:
        shape = (page.imagelength, page.imagewidth, page.samplesperpixel)
        with file.filehandle.lock:
            file.filehandle.seek(plane.offset)
            values = file.filehandle.read_array(file.byteorder + page.dtype.char, int(np.prod(shape))).reshape(shape)
        return np.asarray(values[..., 0] if shape[2] == 1 else values)
    if getattr(page.photometric, "name", "MINISBLACK") not in _PLAIN:
        return None
    _assert_no_bomb(page, file, range(len(page.dataoffsets)))
    try:
        values = page.asarray()
    except (ValueError, KeyError, ImportError, NotImplementedError):
        return None  # a codec that tifffile lacks; Pillow brings its own
    return np.moveaxis(values, 0, -1) if page.axes.startswith("S") else values


def _assert_no_bomb(page: Any, file: Any, indices: Any) -> None:
    """Raise if packed bytes unpack to far more than the pixels they stand for, before memory is used for them."""
    height = page.tilelength if page.is_tiled else page.rowsperstrip
    width = page.tilewidth if page.is_tiled else page.imagewidth
    pixels = width * min(height, max(page.imagelength, page.tilelength or 0))
    size = pixels * page.samplesperpixel * ((page.bitspersample + 7) // 8)
    for index in indices:
        file.filehandle.seek(page.dataoffsets[index])
        data = file.filehandle.read(page.databytecounts[index])
        assert_tile(file.filename, data, int(page.compression), pixels, size)


def _by_pillow(path: Path, plane: Plane, file: Any, options: ReadOptions) -> Picture:
    """Let Pillow decode a page, or say what is missing."""
    page = plane.page
    place = next((k for k, other in enumerate(file.pages) if other.offset == page.offset), 0)
    try:
        picture = read_by_pillow(path, replace(options, frame=place, channel=None, level=0))
    except InputError as error:
        _assert_no_bomb(page, file, range(len(page.dataoffsets)))
        found = _values_by_tifffile(page)
        if found is not None:
            return _picture(plane, found, str(path))
        name = getattr(page.compression, "name", str(page.compression))
        raise InputError(f"{path} cannot be decoded here (compression {name}): {missing_extra('tiff')}") from error
    if getattr(page.photometric, "name", "") == "MINISWHITE" and picture.values.dtype.kind in "bu":
        bits = page.bitspersample
        return replace(picture, values=((1 << bits) - 1 if bits < 16 else 65535) - picture.values)
    return picture


def _values_by_tifffile(page: Any) -> NDArray[Any] | None:
    """Return RGB of a page that is stored as YCbCr or the like and that Pillow cannot decode."""
    try:
        values = page.asarray()
    except Exception:
        return None
    is_jpeg = getattr(page.compression, "name", "").startswith(("JPEG", "APERIO"))
    return np.asarray(values) if is_jpeg and values.ndim == 3 and values.shape[2] == 3 else None


def _part(path: Path, file: Any, plane: Plane, options: ReadOptions, box: Box) -> Picture:
    """Read a part of a picture that is too large as a whole: only the tiles or strips that it touches."""
    page = plane.page
    left, upper, right, lower = box
    width, height = page.imagewidth, page.imagelength
    if not (0 <= left < right <= width and 0 <= upper < lower <= height):
        raise InputError(f"crop {left},{upper},{right},{lower} is no box in {path} of {width} x {height} pixels")
    assert_pixels(path, right - left, lower - upper, options)
    if page.tags.valueof(274, default=1) != 1 or plane.offset is not None:
        raise InputError(f"{path} is too large and cannot be read in part: save the part, or raise max_pixels")
    values = _tiles(path, file, page, box)
    picture = replace(_picture(plane, values, str(path)), window=box)
    if plane.mask is not None:
        picture = replace(picture, void=either(picture.void, _tiles(path, file, plane.mask, box) == 0))
    placed = _placed(picture, file, plane)
    told = f"read {right - left} x {lower - upper} of {width} x {height} pixels"
    return replace(placed, calibration=placed.calibration.cropped(box, height), notes=(told, *placed.notes))


def _tiles(path: Path, file: Any, page: Any, box: Box) -> NDArray[Any]:
    left, upper, right, lower = box
    shape = (lower - upper, right - left, page.samplesperpixel)
    found = np.zeros(shape, page.dtype)
    indices = list(_touched(page, box))
    _assert_no_bomb(page, file, [index for index, _ in indices])
    tables = page.jpegtables if page.compression in (6, 7, 34892, 33007) else None
    for index, (sample, _, top, start, _) in indices:
        file.filehandle.seek(page.dataoffsets[index])
        data = file.filehandle.read(page.databytecounts[index])
        try:
            tile = page.decode(data, index, **({"jpegtables": tables} if tables else {}))[0]
        except (ValueError, ImportError, NotImplementedError) as error:
            name = getattr(page.compression, "name", str(page.compression))
            raise InputError(f"{path} cannot be decoded in part ({name}): {missing_extra('tiff')}") from error
        if tile is None:  # a tile that was never written
            continue
        rows, cols = _overlap(top, tile.shape[1], upper, lower), _overlap(start, tile.shape[2], left, right)
        part = tile[0, rows[0] : rows[1], cols[0] : cols[1]]
        at = (slice(rows[2], rows[2] + part.shape[0]), slice(cols[2], cols[2] + part.shape[1]))
        found[at[0], at[1], slice(None) if page.planarconfig == 1 else slice(sample, sample + 1)] = part
    return found[..., 0] if shape[2] == 1 else found


def _touched(page: Any, box: Box) -> Iterator[tuple[int, tuple[int, ...]]]:
    """Give the number and the place of each tile or strip that a box touches."""
    left, upper, right, lower = box
    for index in range(len(page.dataoffsets)):
        _, place, shape = page.decode(None, index)
        top, start = place[2], place[3]
        if top < lower and top + shape[1] > upper and start < right and start + shape[2] > left:
            yield index, place


def _overlap(start: int, length: int, low: int, high: int) -> tuple[int, int, int]:
    """Return where a tile's part within a range starts and ends, in the tile, and where it starts in the range."""
    first = max(low - start, 0)
    return first, min(high - start, length), start + first - low


# ----------------------------------------------------------------------------------------- what it means


def _picture(plane: Plane, values: NDArray[Any], name: str) -> Picture:
    page = plane.page
    turned = upright(values, page.tags.valueof(274, default=1))
    photometric = getattr(page.photometric, "name", "MINISBLACK")
    if photometric == "PALETTE" and turned.ndim == 2:
        void = no_data(page, turned)
        return Picture(_without(turned, void), (page.colormap.T >> 8).astype(np.uint8), name=name, void=void)
    turned, notes = _channels(plane, turned, name)
    void = no_data(page, turned)
    picture = picture_of(_without(turned, void), name)
    return replace(picture, void=either(picture.void, void), notes=(*picture.notes, *notes))


def _channels(plane: Plane, values: NDArray[Any], name: str) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Return the channel that is asked for, or all of a picture that is grey or RGB, with or without alpha."""
    page, samples = plane.page, values.shape[2] if values.ndim == 3 else 1
    if plane.channel is not None:
        return _one_channel(values, name, plane.channel), ()
    extra = [int(kind) for kind in page.extrasamples or ()]
    colours = 3 if getattr(page.photometric, "name", "") not in ("MINISBLACK", "MINISWHITE") else 1
    has_alpha = bool(extra) and extra[0] in (1, 2)
    if samples == 1:
        return values, ()
    if samples == colours + len(extra) and samples <= 4 and (has_alpha or not extra):
        if page.is_shaped and page.planarconfig == 2:  # so tifffile stores 3 or 4 slices, too
            what = "three planes taken as red, green and blue" if samples == 3 else "the fourth plane taken as alpha"
            return values, (f"{what}: if they are slices, give channel 0 to {samples - 1}",)
        return values, ()
    if colours == 3 and samples == 4:
        return values[..., :3], ("the fourth channel is no alpha and is left aside: channel 3 takes it",)
    raise InputError(f"{name} has {samples} channels: choose one by channel = 0 to {samples - 1}")


def _one_channel(values: NDArray[Any], name: str, channel: int) -> NDArray[Any]:
    n = values.shape[2] if values.ndim == 3 else 1
    if channel >= n:
        raise InputError(f"channel is {channel}, but {name} has {n}: give 0 to {n - 1}")
    return values[..., channel] if values.ndim == 3 else values


def _without(values: NDArray[Any], void: Flags | None) -> NDArray[Any]:
    """Put a value of the others where there is no data, so that it takes no part in ranges and types."""
    if void is None or void.all():
        return values
    filled = values.copy()
    filled[void] = values[~void][0]
    return filled


def _with_void(picture: Picture, mask: NDArray[Any], orientation: int) -> Picture:
    """Make void what a mask page says is not valid."""
    outside = upright(mask == 0, orientation)
    return replace(picture, void=either(picture.void, outside)) if outside.any() else picture


def _placed(picture: Picture, file: Any, plane: Plane) -> Picture:
    """Add what the tags say of pixel size and place; rows that start in the south are turned."""
    first = file.pages[0].aspage()
    place = georeference(plane.page) or (georeference(first) if plane.coarse != 1.0 else None)
    if place is None:
        size = tiff_pixel_size(file, plane.page)
        return replace(picture, calibration=Calibration(size).coarsened(plane.coarse))
    notes = (*picture.notes, place.note) if place.note else picture.notes
    found = replace(picture, calibration=place.calibration.coarsened(plane.coarse), notes=notes)
    return _north_up(found) if place.south_up else found


def _north_up(picture: Picture) -> Picture:
    def turned(values: NDArray[Any] | None) -> Any:
        return None if values is None else np.ascontiguousarray(values[::-1])

    return replace(
        picture, values=turned(picture.values), opaque=turned(picture.opaque), void=turned(picture.void),
        notes=(*picture.notes, "rows run from south to north: turned upright"),
    )  # fmt: skip
