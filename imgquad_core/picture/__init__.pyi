from .absorbing import Absorbed, Absorption, absorb_thin, areas_of_origin, enlarged_labels, widest_part
from .editing import area_shares, edit_materials, merge_materials, recolor_materials, rename_materials
from .legend import Legend, counts_labels, label_by, legend_of, sample_of, tally_labels
from .marks import Marks, marks_of
from .naming import as_told
from .noise import Removal, automatic_limits, list_removed, remove_in_order, remove_noise
from .options import AbsorbOptions, DenoiseOptions, EditOptions, SegmentationOptions
from .segmentation import Segmentation, segment_picture
from .selection import (
    Box,
    assert_box,
    assert_solid,
    crop_image,
    drop_materials,
    material_number,
    sizes_by_number,
    sizes_by_numbers,
)

__all__ = [
    "AbsorbOptions",
    "Absorbed",
    "Absorption",
    "Box",
    "DenoiseOptions",
    "EditOptions",
    "Legend",
    "Marks",
    "Removal",
    "Segmentation",
    "SegmentationOptions",
    "absorb_thin",
    "area_shares",
    "areas_of_origin",
    "as_told",
    "assert_box",
    "assert_solid",
    "automatic_limits",
    "counts_labels",
    "crop_image",
    "drop_materials",
    "edit_materials",
    "enlarged_labels",
    "label_by",
    "legend_of",
    "list_removed",
    "marks_of",
    "material_number",
    "merge_materials",
    "recolor_materials",
    "remove_in_order",
    "remove_noise",
    "rename_materials",
    "sample_of",
    "segment_picture",
    "sizes_by_number",
    "sizes_by_numbers",
    "tally_labels",
    "widest_part",
]
