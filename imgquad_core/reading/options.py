"""How pictures are read. No NumPy here: the command's help waits for this."""

from __future__ import annotations

from dataclasses import dataclass, field

from imgquad_core.declared import check, option

from .calibration import Box


@dataclass(frozen=True)
class ReadOptions:
    """How a file is read.

    Parameters
    ----------
    max_pixels : int
        Larger pictures are refused before they are decoded (decompression bombs).
    frame : int, optional
        Which picture of a stack (TIFF pages, animation frames, slices of a volume, first axis of a NPY array), counted
        from 0; of a hyperstack, times and planes together, planes fastest.
    channel : int, optional
        Which channel of a picture that has several and is not to be taken as colours, counted from 0.
    level : int
        Which level of a pyramid: 0 is the finest.
    scalars : str, optional
        Which array of a file that holds several (HDF5, NPZ, VTI, label images of OME-Zarr); of an EBSD map "phases"
        or "grains".
    info_bar : "keep" or "crop"
        What becomes of the bar with text that electron microscopes add below the picture.
    grain_angle : float
        Of an EBSD map: disorientation from which neighbours belong to two grains, degrees.
    crop : tuple of int, optional
        Left, upper, right, lower bound of the part that is needed: of a larger picture than `max_pixels`, only this
        part is decoded.
    """

    max_pixels: int = option(
        100_000_000,
        "larger pictures are refused before they are decoded",
        what="a number of pixels",
        least=1,
        told="100 million",
        topic="picture",
    )
    frame: int | None = option(
        None,
        "which picture of a stack (pages, slices, times), counted from 0",
        kind=int,
        least=0,
        topic="picture",
    )
    channel: int | None = option(
        None, "which channel of a picture that has several, counted from 0", kind=int, least=0, topic="picture"
    )
    level: int = option(0, "which level of a pyramid: 0 is the finest", least=0, topic="picture")
    scalars: str | None = option(
        None,
        "which array of a file that holds several; of an EBSD map phases or grains",
        kind=str,
        what="a name",
        topic="picture",
    )
    info_bar: str = option(
        "keep",
        "what becomes of the bar with text that electron microscopes add below a picture",
        choices=("keep", "crop"),
        topic="picture",
    )
    grain_angle: float = option(
        5.0,
        "of an EBSD map: neighbours whose crystals are turned by more than this, in degrees, belong to two grains",
        what="an angle",
        above=0.0,
        most=180.0,
        unit="degrees",
        topic="picture",
    )
    crop: Box | None = field(default=None, metadata={"internal": True})

    def __post_init__(self) -> None:
        check(self)
