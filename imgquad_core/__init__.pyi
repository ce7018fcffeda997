from . import (
    boundary,
    cleanup,
    declared,
    fe,
    geometry,
    measures,
    mesher,
    picture,
    pipeline,
    reading,
    remedies,
    tracing,
    writers,
)
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
    "boundary",
    "cleanup",
    "declared",
    "fe",
    "geometry",
    "measures",
    "mesh_image",
    "mesher",
    "picture",
    "pipeline",
    "reading",
    "remedies",
    "run",
    "tracing",
    "writers",
]
