from .absorbing import Absorbed, Absorption, absorb_thin, areas_of_origin, enlarged_labels
from .calibration import Calibration, PixelSize, asked_placement, assert_placement, size_note
from .marks import Marks, marks_of
from .naming import as_told
from .noise import Removal, automatic_limits, list_removed, remove_noise
from .options import AbsorbOptions, DenoiseOptions, ReadOptions, SegmentationOptions
from .picture import Crystal, Picture, picture_of
from .reading import FORMATS, read_picture
from .segmentation import Segmentation, segment_picture
from .selection import Box, assert_solid, crop_image, drop_materials, material_number, sizes_by_number, sizes_by_numbers

__all__ = [
    "FORMATS",
    "AbsorbOptions",
    "Absorbed",
    "Absorption",
    "Box",
    "Calibration",
    "Crystal",
    "DenoiseOptions",
    "Marks",
    "Picture",
    "PixelSize",
    "ReadOptions",
    "Removal",
    "Segmentation",
    "SegmentationOptions",
    "absorb_thin",
    "areas_of_origin",
    "as_told",
    "asked_placement",
    "assert_placement",
    "assert_solid",
    "automatic_limits",
    "crop_image",
    "drop_materials",
    "enlarged_labels",
    "list_removed",
    "marks_of",
    "material_number",
    "picture_of",
    "read_picture",
    "remove_noise",
    "segment_picture",
    "size_note",
    "sizes_by_number",
    "sizes_by_numbers",
]
