from .calibration import Calibration, PixelSize, asked_placement, assert_placement, size_note
from .formats import FORMATS, count_pictures, read_picture
from .options import ReadOptions
from .picture import Crystal, Picture, picture_of

__all__ = [
    "FORMATS",
    "Calibration",
    "Crystal",
    "Picture",
    "PixelSize",
    "ReadOptions",
    "asked_placement",
    "assert_placement",
    "count_pictures",
    "picture_of",
    "read_picture",
    "size_note",
]
