from .efforts import EFFORTS
from .meshing import Filled, fill_faces, fill_held, mesh_boundaries
from .options import MeshingOptions
from .strides import WIDEST
from .triangulators import triangulator_used

__all__ = [
    "EFFORTS",
    "WIDEST",
    "Filled",
    "MeshingOptions",
    "fill_faces",
    "fill_held",
    "mesh_boundaries",
    "triangulator_used",
]
