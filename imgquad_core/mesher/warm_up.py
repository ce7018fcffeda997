"""What the second process of a first start compiles: how faces get quads, and the optimisation of quads."""

from __future__ import annotations

from functools import cache

import numpy as np


@cache
def compile_last_stages() -> None:
    """Compile the optimisation of quads, or load it, by using it on one."""
    # not above: the second process sees to it first that it ends with the first one
    from imgquad_core.cleanup.faces import FaceQuads
    from imgquad_core.cleanup.irregular_nodes import clean_up
    from imgquad_core.cleanup.options import CleanUp
    from imgquad_core.cleanup.relaxation import BAD, GOOD, fit_rim, laplace, newton, part, rings_of, untangle
    from imgquad_core.cleanup.sliding import slide
    from imgquad_core.cleanup.worst_quads import repair
    from imgquad_core.geometry.quad_shape import lower_to_worst, rim_angles

    from .splitting import refine_quads

    points, ids = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), np.arange(4)
    mesh = FaceQuads(points, ids[None, :].copy(), np.zeros(1, np.int64), ids, np.ones(4, np.int64))
    refine_quads(mesh, np.full(4, -1), np.full((4, 1), -1))
    clean_up(mesh, CleanUp((1,), 0.0, 0.0))
    repair(mesh, 2.0)
    rings, none = rings_of(mesh.quads, 4), np.zeros(4, bool)
    newton(points, rings, none, 1, GOOD)
    kind, offsets, chain = np.zeros(4, np.uint8), np.array([0, 4]), ids.copy()
    for values in (kind, offsets, chain):
        values.flags.writeable = False  # as in a mesh
    slide(points, rings, kind, offsets, chain, np.zeros(4))
    fit_rim(points, rings, none, points, 1)
    laplace(points, rings, none, 1)
    untangle(points, rings, none, 1, BAD)
    part(points, rings, none, 0.1, 0.5, none)
    rim_angles(points, mesh.quads, none)
    lower_to_worst(points, mesh.quads, mesh.face, np.ones(1))


def compile_first_quads() -> None:
    """Compile what gives a face its quads by using it on a square."""
    from imgquad_core.model import VOID, BoundaryGraph, PointKind

    from .options import MeshingOptions
    from .strides import composed_quads

    along, zero, ids = np.arange(8.0), np.zeros(8), np.arange(33) % 32
    x, y = np.hstack([along, zero + 8.0, 8.0 - along, zero]), np.hstack([zero, along, zero + 8.0, 8.0 - along])
    graph = BoundaryGraph(
        np.column_stack([x, y]),
        np.full(32, PointKind.FRAME, np.uint8),
        np.array([0, 33]),
        ids,
        np.array([[0, VOID]]),
        np.zeros(1, np.int32),
        np.array([64]),
        (8, 8),
    )
    composed_quads(graph, np.ones(1, bool), 2, MeshingOptions(size=1.0))


if __name__ == "__main__":
    from imgquad_core.ahead import end_with_the_first

    end_with_the_first()
    compile_first_quads()
    compile_last_stages()
