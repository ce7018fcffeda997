"""Algorithms that turn a picture of a structure into an all-quadrilateral, multi-material mesh."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .model import BoundaryGraph, LabelImage, Materials, QuadMesh
    from .pipeline import MeshOptions, Run, mesh_image, run

__all__ = ["BoundaryGraph", "LabelImage", "Materials", "MeshOptions", "QuadMesh", "Run", "mesh_image", "run"]


def __getattr__(name: str) -> Any:
    """Import what is asked for when it is: the pipeline brings Numba with it, which takes about a second."""
    if name not in __all__:
        raise AttributeError(f"module 'imgquad_core' has no attribute '{name}'")
    home = "model" if name in ("BoundaryGraph", "LabelImage", "Materials", "QuadMesh") else "pipeline"
    return getattr(import_module(f".{home}", __name__), name)
