from .marks import Marks, marks_of
from .noise import Removal, automatic_limits, list_removed, remove_noise
from .options import DenoiseOptions, ReadOptions, SegmentationOptions
from .picture import Picture, picture_of
from .reading import read_picture
from .segmentation import Segmentation, segment_picture
from .selection import Box, assert_solid, crop_image, drop_materials, material_number, sizes_by_number

__all__ = [
    "Box",
    "DenoiseOptions",
    "Marks",
    "Picture",
    "ReadOptions",
    "Removal",
    "Segmentation",
    "SegmentationOptions",
    "assert_solid",
    "automatic_limits",
    "crop_image",
    "drop_materials",
    "list_removed",
    "marks_of",
    "material_number",
    "picture_of",
    "read_picture",
    "remove_noise",
    "segment_picture",
    "sizes_by_number",
]
