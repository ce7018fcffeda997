"""Sides so short that their quads are triangles to the eye: angles do not tell."""

from __future__ import annotations

import numpy as np

from imgquad_core import MeshOptions, run
from imgquad_core.measures.quality import scaled_jacobian
from imgquad_core.orientation import TURNS
from support.labels import label_image, labels_of_kind


def test_a_node_is_parted_from_its_neighbour_where_angles_hold_it_there() -> None:
    """An inner node lay .0006 px from the boundary, in edges of .7 px; every way out of it made an angle worse."""
    labels = TURNS[3].picture(labels_of_kind("void", 31, 34, 3, 186078025))
    options = MeshOptions(size=6.0, effort="fast", policy="diagonal", sizes_between={(2, 0): 0.7}, threads=1)
    mesh = run(label_image(labels), options).pixel_mesh
    sides = np.linalg.norm(mesh.points[mesh.quads] - mesh.points[np.roll(mesh.quads, -1, axis=1)], axis=2)
    assert (sides.min(axis=1) / sides.max(axis=1)).min() > 0.02
    assert scaled_jacobian(mesh.points, mesh.quads).min() > 0.5
