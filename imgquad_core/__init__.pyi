from .model import BoundaryGraph, LabelImage, Materials, QuadMesh
from .options import MeshOptions
from .pipeline import Run, mesh_image, run

__all__ = [
    "BoundaryGraph",
    "LabelImage",
    "Materials",
    "MeshOptions",
    "QuadMesh",
    "Run",
    "mesh_image",
    "run",
]
