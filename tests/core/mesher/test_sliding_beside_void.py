"""Boundary nodes slide along their chains; beside void nothing but a test keeps them from others."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.boundary import SmoothingOptions, extract_boundaries, smooth_boundaries
from imgquad_core.geometry.conflicts import CROSSING, find_conflicts
from imgquad_core.mesher import meshing
from imgquad_core.mesher.meshing import mesh_boundaries
from imgquad_core.mesher.options import MeshingOptions
from imgquad_core.mesher.outline import coarse_segments
from imgquad_core.model import VOID, PointKind
from imgquad_core.options import MeshOptions
from imgquad_core.pipeline import run
from support.faces import Points
from support.labels import label_image, labels_of_kind


def test_no_node_slides_over_void_out_of_the_picture() -> None:
    labels = labels_of_kind("void", 38, 16, 2, 565211775)
    made = run(label_image(labels), MeshOptions(size=1.0, tolerance=6.0, periodic="y", pixel_size=(3.0, 1.0)))
    assert (made.mesh.points >= 0.0).all()
    assert (made.mesh.points <= [48.0, 38.0]).all()


def test_nodes_that_would_meet_others_over_void_do_not_slide(monkeypatch: pytest.MonkeyPatch) -> None:
    labels = np.zeros((30, 30), np.int32)
    labels[8:14, 5:25] = labels[16:22, 5:25] = VOID  # two slots, 2 px apart
    graph = smooth_boundaries(extract_boundaries(label_image(labels)), SmoothingOptions(size=2.0))

    def jump(points: Points, _: object, kind: Points, *__: object) -> None:
        """Throw the nodes that may slide over the void."""
        points[kind == PointKind.FREE, 1] += 7.0

    monkeypatch.setattr(meshing, "slide", jump)
    mesh = mesh_boundaries(graph, MeshingOptions(2.0))
    segments = coarse_segments(mesh, np.ones(len(mesh.chain_regions), bool), 1)
    pairs = np.stack([segments.tail, segments.head], axis=1)
    marks = find_conflicts(mesh.points, pairs, segments.chain, np.ones(len(mesh.chain_regions), bool), (30, 30))
    assert (marks < CROSSING).all()
