"""The size of a pixel in the tags that microscopes and programs write into TIFF files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from .calibration import PixelSize, in_handy_unit, printing_density, size_of

RESIZED = "the file says it of {} columns and has {}: it was resized"


def tiff_pixel_size(file: Any, page: Any) -> PixelSize | None:
    """Return what a TIFF file says about the size of its pixels: the first of the sources that says something.

    Parameters
    ----------
    file : tifffile.TiffFile
        The open file.
    page : tifffile.TiffPage
        The picture in it.
    """
    return next((size for find in _SOURCES for size in _quietly(find, file, page)), None)


def _quietly(find: Callable[[Any, Any], PixelSize | None], file: Any, page: Any) -> Iterator[PixelSize]:
    """Give what `find` finds; tags that break their own format say nothing."""
    try:
        size = find(file, page)
    except Exception:  # what a broken tag raises is as various as in decoders
        return
    if size is not None:
        yield size


def _fei(file: Any, page: Any) -> PixelSize | None:
    tags = file.fei_metadata
    if not tags or "PixelWidth" not in tags.get("Scan", {}):
        return None
    columns = tags.get("Image", {}).get("ResolutionX", page.imagewidth)
    doubt = "" if columns == page.imagewidth else RESIZED.format(columns, page.imagewidth)
    scan = tags["Scan"]
    size = size_of(scan["PixelWidth"], scan["PixelHeight"], "m", "FEI Scan.PixelWidth", doubt)
    return in_handy_unit(size) if size else None


def _zeiss(file: Any, page: Any) -> PixelSize | None:
    """Divide the width of the field by the columns: the tag named Pixel Size counts for the columns of the scan."""
    tags = file.sem_metadata or {}
    if "ap_width" not in tags or "ap_height" not in tags:
        return None
    (_, width, unit), (_, height, unit_of_height) = tags["ap_width"], tags["ap_height"]
    if unit != unit_of_height:
        return None
    size = size_of(width / page.imagewidth, height / page.imagelength, unit, "Zeiss AP_WIDTH / columns")
    return in_handy_unit(_rounded_square(size)) if size else None


def _rounded_square(size: PixelSize) -> PixelSize:
    """Take sides for equal that differ by less than the four digits of the field's width and height allow."""
    if abs(size.x - size.y) > 2e-3 * size.x:
        return size
    return PixelSize(size.x, size.x, size.unit, size.source, size.doubt)


def _ome(file: Any, page: Any) -> PixelSize | None:
    if not file.is_ome:
        return None
    from defusedxml.ElementTree import fromstring  # not above: other pictures do without it

    pixels = next(node for node in fromstring(file.ome_metadata).iter() if node.tag.endswith("}Pixels"))
    given = pixels.attrib
    if "PhysicalSizeX" not in given or "PhysicalSizeY" not in given:
        return None
    units = {given.get(f"PhysicalSize{axis}Unit", "µm") for axis in "XY"}
    columns = int(given.get("SizeX", page.imagewidth))
    doubt = "" if columns == page.imagewidth else RESIZED.format(columns, page.imagewidth)
    if len(units) > 1:
        return None
    sides = float(given["PhysicalSizeX"]), float(given["PhysicalSizeY"])
    return size_of(*sides, units.pop(), "OME PhysicalSizeX", doubt)


def _imagej(file: Any, page: Any) -> PixelSize | None:
    """Take ImageJ's unit where it is a metric length: "inch" stands for a printing density, "pixel" for nothing."""
    unit = (file.imagej_metadata or {}).get("unit", "")
    if not isinstance(unit, str) or unit.strip('"').lower() in ("", "inch", "in", "pixel", "pixels", "cm_", "ft"):
        return None
    x, y = (_ratio(page.tags.valueof(code)) for code in (282, 283))
    return size_of(1.0 / x, 1.0 / y, unit.strip('"'), "ImageJ XResolution")


def _digital_micrograph(file: Any, page: Any) -> PixelSize | None:
    """Read the private tags of Gatan's export: units 65003 and 65004, steps 65009 and 65010."""
    found = [page.tags.valueof(code) for code in (65003, 65004, 65009, 65010)]
    if any(value is None for value in found):
        return None
    units = [value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value) for value in found[:2]]
    if units[0] != units[1]:
        return None
    return size_of(float(found[2]), float(found[3]), units[0], "DigitalMicrograph's tag 65009")


def _aperio(file: Any, page: Any) -> PixelSize | None:
    if not file.is_svs:
        return None
    words = dict(part.split("=", 1) for part in file.pages[0].description.split("|") if "=" in part)
    mpp = next(float(value) for name, value in words.items() if name.strip() == "MPP")
    return size_of(mpp, mpp, "um", "Aperio MPP").scaled(file.pages[0].imagewidth / page.imagewidth)  # type: ignore[union-attr]


def _density(file: Any, page: Any) -> PixelSize | None:
    """Tell a printing density where it is finer than printers are: never taken."""
    unit = {2: "inch", 3: "cm"}.get(int(page.tags.valueof(296, default=2)))
    x, y = (_ratio(page.tags.valueof(code)) for code in (282, 283))
    return printing_density(x, y, unit, "TIFF XResolution") if unit else None


def _ratio(value: tuple[int, int]) -> float:
    return value[0] / value[1]


_SOURCES = (_fei, _zeiss, _ome, _imagej, _digital_micrograph, _aperio, _density)
