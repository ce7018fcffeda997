from .field_texts import for_vtu
from .fields import MATERIAL_FIELDS, materials_of, put_calibration, put_materials
from .grids import flattened, from_grid, plain_grid, quads_of, to_fe_grid, to_grid, to_mesh
from .images import image_array, image_placement, scalars_of, segmented, with_materials
from .lines import Boundaries, chain_lines, from_lines, to_lines
from .metaimage import VTK_EXTENSIONS
from .placement import Placement
from .quad_grids import quad_grid
from .vtk_pictures import read_vtk, silent_vtk

__all__ = [
    "MATERIAL_FIELDS",
    "VTK_EXTENSIONS",
    "Boundaries",
    "Placement",
    "chain_lines",
    "flattened",
    "for_vtu",
    "from_grid",
    "from_lines",
    "image_array",
    "image_placement",
    "materials_of",
    "plain_grid",
    "put_calibration",
    "put_materials",
    "quad_grid",
    "quads_of",
    "read_vtk",
    "scalars_of",
    "segmented",
    "silent_vtk",
    "to_fe_grid",
    "to_grid",
    "to_lines",
    "to_mesh",
    "with_materials",
]
