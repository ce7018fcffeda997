"""DICOM: a frame of CT, MRI or microscopy, by pydicom."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Flags
from imgquad_core.errors import InputError

from .calibration import Calibration, PixelSize, size_of
from .decoding import Stack, assert_pixels, decoding, optional
from .options import ReadOptions
from .picture import Picture, picture_of

#: where the letters DICM stand, and how many bytes there may be before them (a TIFF header, too)
MAGIC, PREAMBLE = b"DICM", 128


def read_dicom(path: Path, options: ReadOptions) -> Picture:
    """Read a frame of a DICOM file; only this frame is decoded.

    Notes
    -----
    Values are those of the modality (Hounsfield units of CT): rescaled by slope and intercept. Padding is void. The
    pixel spacing is taken; that of a detector or of a scanned film, which is not in the object's plane, is told only.
    """
    pydicom = optional("dicom", path)
    with decoding(path):
        header = pydicom.dcmread(path, stop_before_pixels=True)
        if not header.get("Rows") or not header.get("Columns"):
            raise InputError(f"{path} holds no picture ({header.get('Modality', 'DICOM')}): give one with pixels")
        assert_pixels(path, int(header.Columns), int(header.Rows), options)
        n_frames = int(header.get("NumberOfFrames") or 1)
        k = Stack(str(path), (("frame", n_frames),)).choose(options)["frame"]
        stored = _frame(path, header, k)
        void = _padding(header, stored)
        found = picture_of(_rescaled(header, _without(stored, void)), str(path))
        told = (f"frame {k} of {n_frames}, counted from 0",) if n_frames > 1 else ()
        return replace(found, void=void, calibration=Calibration(_spacing(header)), notes=told)


def _frame(path: Path, header: Any, k: int) -> NDArray[Any]:
    """Return the stored values of a frame: numbers, palette colours, or RGB."""
    pixels = optional("dicom", path, "pydicom.pixels")
    try:
        stored = pixels.pixel_array(path, index=k)
    except (RuntimeError, NotImplementedError) as error:
        name = header.file_meta.TransferSyntaxUID.name
        raise InputError(
            f"{path} is compressed ({name}), which is not decoded here: pip install pylibjpeg[all], or gdcmconv --raw"
        ) from error
    if stored.shape[:2] != (header.Rows, header.Columns):
        raise InputError(f"{path} holds a frame of {stored.shape}, its header says {header.Rows} x {header.Columns}")
    is_palette = header.PhotometricInterpretation == "PALETTE COLOR"
    return np.asarray(pixels.apply_color_lut(stored, header) if is_palette else stored)


def _padding(header: Any, stored: NDArray[Any]) -> Flags | None:
    """Return the pixels that hold padding (PS3.3 C.7.5.1.1.2), None where there are none, or nothing but these."""
    if stored.ndim > 2 or "PixelPaddingValue" not in header:
        return None
    first = int(header.PixelPaddingValue)
    last = int(header.get("PixelPaddingRangeLimit", first))
    void = (stored >= min(first, last)) & (stored <= max(first, last))
    return void if void.any() and not void.all() else None


def _without(stored: NDArray[Any], void: Flags | None) -> NDArray[Any]:
    if void is None:
        return stored
    return np.where(void, stored[~void][0], stored).astype(stored.dtype)


def _rescaled(header: Any, stored: NDArray[Any]) -> NDArray[Any]:
    """Return the modality's values; whole numbers stay whole."""
    slope, intercept = float(header.get("RescaleSlope") or 1), float(header.get("RescaleIntercept") or 0)
    if stored.ndim > 2 or (slope, intercept) == (1.0, 0.0):
        return stored
    if slope.is_integer() and intercept.is_integer() and max(abs(slope), abs(intercept)) < 1 << 15:
        return stored.astype(np.int32) * int(slope) + int(intercept)
    return stored * slope + intercept


def _spacing(header: Any) -> PixelSize | None:
    """Return width and height of a pixel, mm: the file gives that of rows first."""
    for name, doubt in _SPACINGS:
        if header.get(name):
            height, width = (float(step) for step in header[name].value)
            return size_of(width, height, "mm", f"DICOM {name}", doubt)
    return None


_SPACINGS = (
    ("PixelSpacing", ""),
    ("ImagerPixelSpacing", "it is that of the detector, not of the object"),
    ("NominalScannedPixelSpacing", "it is that of the scanned film, not of the object"),
)
