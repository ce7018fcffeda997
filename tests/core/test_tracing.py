"""Meshes from bare quads have the boundaries that the mesh they came from had."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from imgquad_core.errors import InputError
from imgquad_core.fe.sets import fe_mesh
from imgquad_core.model import VOID, PointKind, QuadMesh
from imgquad_core.tracing import trace_mesh
from support.handmade import disk, jiggle, round_inclusion, staircase

PICTURE = disk(12, 4)
PICTURE[:, 9:] = 2
PICTURE[:3, :3] = VOID


def traced(mesh: QuadMesh, clockwise: bool = False) -> QuadMesh:
    quads = mesh.quads[:, ::-1] if clockwise else mesh.quads
    return trace_mesh(mesh.points, quads, mesh.quad_material, mesh.materials)


@pytest.mark.parametrize("clockwise", [False, True])
def test_sets_come_out_as_before(clockwise: bool) -> None:
    mesh = staircase(PICTURE, ("a", "b", "c"), jiggle)
    before, after = fe_mesh(mesh), fe_mesh(traced(mesh, clockwise))
    assert before.node_sets.keys() == after.node_sets.keys()
    for name, ids in before.node_sets.items():
        assert (ids == after.node_sets[name]).all(), name
    sides = {name: before.points[np.sort(before.side_nodes(s), axis=1)] for name, s in before.side_sets.items()}
    for name, ends in sides.items():
        other = after.points[np.sort(after.side_nodes(after.side_sets[name]), axis=1)]
        assert sorted(map(str, ends.tolist())) == sorted(map(str, other.tolist())), name


def test_chains_cover_each_boundary_edge_once_with_its_regions() -> None:
    mesh = staircase(PICTURE, move=jiggle)
    again = traced(mesh)
    edges = np.sort(again.constraints, axis=1)
    assert sorted(map(tuple, edges)) == sorted(map(tuple, np.sort(mesh.constraints, axis=1)))
    corner = {
        (a, b): r
        for q, r in zip(again.quads, again.quad_region, strict=True)
        for a, b in zip(q, np.roll(q, -1), strict=True)
    }
    for c, (left, right) in enumerate(again.chain_regions):
        chain = again.chain_points[again.chain_offsets[c] : again.chain_offsets[c + 1]]
        for a, b in pairwise(chain):
            assert corner.get((a, b), VOID) == left
            assert corner.get((b, a), VOID) == right


def test_a_circle_is_smooth_and_a_square_has_corners() -> None:
    again = traced(round_inclusion(6, 10, 40, 2))
    assert (again.point_kind == PointKind.CORNER).sum() == 4
    square = np.zeros((6, 6), int)
    square[2:4, 2:4] = 1
    assert (traced(staircase(square)).point_kind == PointKind.CORNER).sum() == 8


def test_quads_that_are_no_mesh_are_refused() -> None:
    mesh = staircase(np.zeros((2, 2), int))
    quads = mesh.quads.copy()
    quads[1] = quads[1, ::-1]
    with pytest.raises(InputError, match="quad 1 turns clockwise"):
        trace_mesh(mesh.points, quads, mesh.quad_material, mesh.materials)
    quads[1] = quads[0]
    with pytest.raises(InputError, match="more than two quads"):
        trace_mesh(mesh.points, quads, mesh.quad_material, mesh.materials)
