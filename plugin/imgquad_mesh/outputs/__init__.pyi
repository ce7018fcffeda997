from .files import (
    GRID_EXTENSIONS,
    check_files,
    check_target,
    mesh_extensions,
    replace_file,
    write_boundaries,
    write_json,
    write_labels,
    write_mesh_file,
    write_picture,
    write_run,
)
from .mesh_picture import draw_materials, material_colors
from .report import build_report, element_notes, versions
from .rock_picture import draw_rock, rock_labels, small_pictures
from .vtk_files import save_dataset, save_legacy, save_with_comment

__all__ = [
    "GRID_EXTENSIONS",
    "build_report",
    "check_files",
    "check_target",
    "draw_materials",
    "draw_rock",
    "element_notes",
    "material_colors",
    "mesh_extensions",
    "replace_file",
    "rock_labels",
    "save_dataset",
    "save_legacy",
    "save_with_comment",
    "small_pictures",
    "versions",
    "write_boundaries",
    "write_json",
    "write_labels",
    "write_mesh_file",
    "write_picture",
    "write_run",
]
