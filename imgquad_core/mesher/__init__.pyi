from .efforts import EFFORTS, MeshingOptions
from .meshing import mesh_boundaries
from .triangulators import triangulator_used

__all__ = [
    "EFFORTS",
    "MeshingOptions",
    "mesh_boundaries",
    "triangulator_used",
]
