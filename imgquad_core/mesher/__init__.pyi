from .efforts import EFFORTS, MeshingOptions
from .meshing import mesh_boundaries

__all__ = [
    "EFFORTS",
    "MeshingOptions",
    "mesh_boundaries",
]
