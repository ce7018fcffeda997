"""The stages from labels to quads on pixels of any shape: what the filters and `mesh` are made of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from imgquad_core.boundary.extraction import ExtractionOptions, extract_boundaries
from imgquad_core.boundary.periodic import match_opposite_sides
from imgquad_core.boundary.smoothing import SmoothingOptions, smooth_boundaries
from imgquad_core.errors import InputError
from imgquad_core.mesher.efforts import MeshingOptions
from imgquad_core.model import LabelImage, QuadMesh
from imgquad_core.picture.selection import assert_solid
from imgquad_core.pipeline import MOST_QUADS, fill_boundaries
from imgquad_mesh.datasets.lines import Boundaries
from imgquad_mesh.datasets.placement import Placement


def extracted(labels: LabelImage, placement: Placement, options: ExtractionOptions) -> Boundaries:
    """Return the boundaries of pixels."""
    assert_solid(labels)
    return Boundaries(extract_boundaries(labels, options), labels.materials, placement)


def smoothed(given: Boundaries, options: SmoothingOptions, periodic: str) -> Boundaries:
    """Return smooth boundaries cut into edges, on a placement of square pixels."""
    shape, placement = _true_shape(given.graph.shape, given.placement)
    _assert_feasible(shape, options.size)
    graph = smooth_boundaries(given.graph, options, None if shape == given.graph.shape else shape)
    if periodic != "none":
        graph = match_opposite_sides(graph, periodic)
    sizes = (options.size, options.growth, dict(options.material_sizes or {}))
    return given._replace(graph=graph, placement=placement, sizes=sizes, periodic=periodic)


def filled(given: Boundaries, options: MeshingOptions) -> QuadMesh:
    """Return the quads between smoothed boundaries."""
    return fill_boundaries(given.graph, options, given.materials, given.periodic)[1]


def _true_shape(shape: tuple[int, int], placement: Placement) -> tuple[tuple[int, int], Placement]:
    """Return height and width of a picture in the shorter side of its pixels, and where squares of that side lie.

    Both are rounded to whole numbers, so that squares are square to within half a side over the whole picture.
    """
    old = np.array(shape[::-1])
    sides = np.linalg.norm(placement.axes, axis=1)  # of a column, of a row
    new = np.maximum(np.rint(old * sides / sides.min()), 1).astype(np.int64)
    if (new == old).all():
        return shape, placement
    return (int(new[1]), int(new[0])), replace(placement, axes=placement.axes * (old / new)[:, None])


def _assert_feasible(shape: tuple[int, int], size: float) -> None:
    wanted = shape[0] * shape[1] / size**2
    if wanted > MOST_QUADS:
        raise InputError(
            f"size {size:g} would need about {wanted:.2g} quads for {shape[1]} x {shape[0]} pixels: at most "
            f"{MOST_QUADS:.0e} are made; ask for a larger size, take a part of the image, or mend its spacing"
        )
