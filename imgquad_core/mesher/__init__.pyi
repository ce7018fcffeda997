from .efforts import EFFORTS
from .meshing import mesh_boundaries
from .options import MeshingOptions
from .triangulators import triangulator_used

__all__ = [
    "EFFORTS",
    "MeshingOptions",
    "mesh_boundaries",
    "triangulator_used",
]
