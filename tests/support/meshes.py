"""Pictures meshed by the two stages that follow extraction, and what is measured of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.boundary.smoothing import SmoothingOptions, smooth_boundaries
from imgquad_core.mesher.meshing import mesh_boundaries
from imgquad_core.mesher.options import MeshingOptions
from imgquad_core.model import BoundaryGraph, LabelImage, PointKind, QuadMesh

from . import naive
from .faces import Points
from .invariants import assert_valid_mesh
from .labels import Labels, label_image


def boundaries(image: LabelImage, size: float, **more: Any) -> BoundaryGraph:
    return smooth_boundaries(extract_boundaries(image), SmoothingOptions(size=size, **more))


def meshed(labels: Labels, size: float, sizes: dict[int, float] | None = None, **more: Any) -> QuadMesh:
    """Mesh a picture and check that the mesh is valid."""
    image = label_image(labels)
    graph = boundaries(image, size, material_sizes=sizes)
    mesh = mesh_boundaries(graph, MeshingOptions(size=size, material_sizes=sizes, **more), image.materials)
    assert_valid_mesh(mesh, image)
    return mesh


def quad_sides(mesh: QuadMesh, quads: Any = slice(None)) -> Points:
    asked = mesh.quads[quads]
    return naive.lengths(mesh.points, np.stack([asked, np.roll(asked, -1, axis=1)], axis=-1))


def irregular_share(mesh: QuadMesh) -> float:
    inner = mesh.point_kind == PointKind.INTERIOR
    return float((mesh.valence[inner] != 4).mean())
