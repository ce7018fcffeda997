"""Where a GeoTIFF lies: pixel size, lower left corner, coordinate reference system, pixels of no data.

OGC GeoTIFF 1.1 (19-008r4), https://docs.ogc.org/is/19-008r4/19-008r4.html; no data: GDAL's tag 42113.
"""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from numpy.typing import NDArray

from imgquad_core.arrays import Flags

from .calibration import Calibration, size_of
from .picture import where_equal

#: EPSG codes of units of length that maps use
_UNITS = {9001: "m", 9002: "ft", 9003: "us-ft", 9036: "km"}
_DEGREES = "degrees are no length: warp it to a projected CRS, for example by gdalwarp -t_srs EPSG:3857"
_USER_DEFINED = 32767


class Georeference(NamedTuple):
    """Place of a picture on a map."""

    calibration: Calibration
    south_up: bool  #: whether row 0 lies in the south
    note: str = ""  #: what could not be taken


def georeference(page: Any) -> Georeference | None:
    """Return where a page lies; None where it does not say so.

    Parameters
    ----------
    page : tifffile.TiffPage
        A page with the tags 33550 and 33922, or 34264.
    """
    affine = _affine(page)
    if affine is None:
        return None
    a, b, c, d, e, f = affine
    if b or d:
        return Georeference(Calibration(), False, "the map is turned against the pixels: its place is not taken")
    keys = page.geotiff_tags or {}
    crs, unit, doubt = _crs(keys)
    if keys.get("GTRasterTypeGeoKey") == 2:  # the tie point is a pixel's centre
        c, f = c - a / 2, f - e / 2
    size = size_of(abs(a), abs(e), unit, "GeoTIFF ModelPixelScale", doubt)
    if size is None or a < 0:
        return None
    lowest = min(f, f + e * page.imagelength)
    placed = not doubt
    return Georeference(Calibration(size, (c, lowest), crs, placed), south_up=e > 0)


def _affine(page: Any) -> tuple[float, ...] | None:
    """Return a, b, c, d, e, f with x = a column + b row + c and y = d column + e row + f, of the pixels' corners."""
    matrix = page.tags.valueof(34264)
    if matrix is not None and len(matrix) == 16:
        return (matrix[0], matrix[1], matrix[3], matrix[4], matrix[5], matrix[7])
    scale, tie = page.tags.valueof(33550), page.tags.valueof(33922)
    if scale is None or tie is None or len(scale) < 2 or len(tie) != 6:
        return None
    column, row, _, x, y, _ = tie
    return (scale[0], 0.0, x - column * scale[0], 0.0, -scale[1], y + row * scale[1])


def _crs(keys: dict[str, Any]) -> tuple[str, str, str]:
    """Return the name of the CRS, its unit of length and the doubt that it has one."""
    projected, geographic = keys.get("ProjectedCSTypeGeoKey"), keys.get("GeographicTypeGeoKey")
    if keys.get("GTModelTypeGeoKey") == 2 or (projected is None and geographic is not None):
        return _name(keys, geographic), "", _DEGREES
    unit = _UNITS.get(int(keys.get("ProjLinearUnitsGeoKey", 0)), "")
    return _name(keys, projected), unit, ""


def _name(keys: dict[str, Any], code: Any) -> str:
    if code is not None and int(code) not in (0, _USER_DEFINED):
        return f"EPSG:{int(code)}"
    for key in ("PCSCitationGeoKey", "GTCitationGeoKey", "GeogCitationGeoKey"):
        text = str(keys.get(key) or "")
        quoted = re.search(r'(?:PROJCS|GEOGCS|PROJCRS)\["([^"]+)"', text)  # ESRI writes well-known text here
        name = quoted.group(1) if quoted else text.strip("| ")
        if name and name not in ("unknown", "unnamed"):
            return name
    return ""


def no_data(page: Any, values: NDArray[Any]) -> Flags | None:
    """Return where a page has no data by GDAL's tag, shape (n_rows, n_cols); None where it has everywhere.

    Of several channels, a pixel has no data where all channels hold the value. A value that the type cannot hold
    stands nowhere.
    """
    text = page.tags.valueof(42113)
    if not isinstance(text, str):
        return None
    try:
        value = float(text.strip(" \0"))
    except ValueError:
        return None
    return where_equal(values, value)
