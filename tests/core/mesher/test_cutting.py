"""Cutting at constraints: faces that share no point, each sector with its angle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from imgquad_core.mesher.cutting import CutMesh, FaceConflict, cut_at_constraints
from imgquad_core.mesher.outline import outline
from imgquad_core.mesher.triangulation import constraint_table, triangulate
from imgquad_core.model import VOID, BoundaryGraph
from support import naive
from support.faces import Ids, Points, cut_of, graph_of, polygon_graph, voronoi_graph


def two_squares(left: int = 0, right: int = 1) -> CutMesh | FaceConflict:
    """Two unit squares beside each other."""
    points = np.array([[0.0, 0], [1, 0], [2, 0], [2, 1], [1, 1], [0, 1]])
    tail, head = np.array([0, 1, 2, 3, 4, 5, 1]), np.array([1, 2, 3, 4, 5, 0, 4])
    at_left = np.array([left, right, right, right, left, left, left])
    at_right = np.array([VOID] * 6 + [right])
    table = constraint_table(6, tail, head, at_left, at_right, np.arange(14).reshape(7, 2) // 2)
    return cut_at_constraints(triangulate(points, np.stack([tail, head], axis=1)), table)


def face_areas(cut: CutMesh, n_faces: int) -> Points:
    total = np.zeros(n_faces)
    np.add.at(total, cut.face, naive.areas(cut.points, cut.triangles))
    return total


def assert_cut(cut: CutMesh) -> None:
    """Check that twins are true, the rim is marked, and each copy has one sector."""
    assert np.array_equal(cut.twins, naive.twins(cut.triangles))
    rim = np.flatnonzero(cut.twins == -1)
    leaving = np.bincount(cut.triangles.ravel()[rim], minlength=len(cut.points))
    assert leaving.max() == 1
    assert np.array_equal(leaving > 0, cut.on_rim)
    inner = np.flatnonzero(cut.twins >= 0)
    assert np.array_equal(cut.face[inner // 3], cut.face[cut.twins[inner] // 3])
    assert np.array_equal(cut.middle >= 0, cut.twins == -1)
    assert np.allclose(cut.angle[~cut.on_rim], 2 * np.pi)


def test_points_on_the_shared_side_get_two_copies() -> None:
    cut = two_squares()
    assert isinstance(cut, CutMesh)
    assert_cut(cut)
    assert np.bincount(cut.origin).tolist() == [1, 2, 1, 1, 2, 1]
    assert np.allclose(cut.angle, np.pi / 2)
    assert face_areas(cut, 2).tolist() == [1, 1]
    shared = np.flatnonzero(cut.middle == 6)
    assert sorted(cut.face[shared // 3].tolist()) == [0, 1]


def test_face_without_region_is_dropped() -> None:
    cut = two_squares(right=VOID)
    assert isinstance(cut, CutMesh)
    assert_cut(cut)
    assert face_areas(cut, 1).tolist() == [1]
    assert set(cut.origin.tolist()) == {0, 1, 4, 5}


def test_outlines_that_name_two_regions_for_one_face_are_a_conflict() -> None:
    points = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    tail = np.arange(4)
    table = constraint_table(
        4, tail, (tail + 1) % 4, np.array([2, 2, 5, 2]), np.full(4, VOID), np.zeros((4, 2), np.int64)
    )
    cut = cut_at_constraints(triangulate(points, np.stack([tail, (tail + 1) % 4], axis=1)), table)
    assert isinstance(cut, FaceConflict)
    assert cut.regions.tolist() == [2, 5]


def test_a_side_that_is_no_edge_is_a_conflict() -> None:
    """A point on it would have cut it in two."""
    points = np.array([[0.0, 0], [2, 0], [2, 2], [0, 2], [1, 0]])
    tail, head = np.arange(4), np.array([1, 2, 3, 0])
    table = constraint_table(4, tail, head, np.full(4, 5), np.full(4, VOID), np.zeros((4, 2), np.int64))
    cut = cut_at_constraints(triangulate(points, np.stack([tail, head], axis=1)), table)
    assert isinstance(cut, FaceConflict)
    assert cut.regions.tolist() == [5]


def hourglass() -> BoundaryGraph:
    """A square of region 0 with two triangles of regions 1 and 2 that touch in the middle."""
    square = [[0, 0], [4, 0], [8, 0], [8, 4], [8, 8], [4, 8], [0, 8], [0, 4]]
    inner = [[4, 4], [2, 6], [2, 4], [2, 2], [6, 2], [6, 4], [6, 6]]
    chains = [[*range(8), 0], [8, 9, 10, 11, 8], [8, 12, 13, 14, 8]]
    return graph_of(square + inner, chains, [(0, VOID), (1, 0), (2, 0)], (8, 8))


def test_face_that_touches_itself_gets_a_copy_of_the_point_for_each_sector() -> None:
    cut, _ = cut_of(hourglass(), 1, None)
    assert_cut(cut)
    at_middle = np.flatnonzero(cut.origin == 8)
    assert len(at_middle) == 4
    assert np.allclose(cut.angle[at_middle], np.pi / 2)
    assert face_areas(cut, 3).tolist() == [64 - 8, 4, 4]


def test_island_leaves_a_hole() -> None:
    outer, inner = polygon_graph([[0, 0], [8, 0], [8, 8], [0, 8]], [2] * 4, (8, 8)), np.array([[2, 2], [6, 2], [4, 6]])
    points = np.vstack([outer.points, inner])
    cut, _ = cut_of(graph_of(points, [outer.chain(0).tolist(), [8, 9, 10, 8]], [(0, VOID), (1, 0)], (8, 8)), 1, None)
    assert_cut(cut)
    assert face_areas(cut, 2).tolist() == [56, 8]
    for origin, angle in ((8, 63.435), (10, 53.130)):  # the triangle's corners, seen from within and from without
        sectors = np.degrees(cut.angle[cut.origin == origin])
        assert sorted(sectors.tolist()) == pytest.approx([angle, 360 - angle], abs=1e-3)


def neighbours_around(graph: BoundaryGraph) -> list[set[int]]:
    beside: list[set[int]] = [set() for _ in graph.points]
    for a, b in graph.segments.tolist():
        beside[a].add(b)
        beside[b].add(a)
    return beside


def sectors(points: Points, v: int, beside: Sequence[int]) -> Points:
    turn = np.sort([np.arctan2(*(points[w] - points[v])[::-1]) for w in beside])
    return np.sort(np.diff(turn, append=turn[0] + 2 * np.pi))


@pytest.mark.parametrize(("seed", "max_area"), [(0, None), (1, 4.0), (2, 30.0)])
def test_grains_keep_their_areas_and_points_their_sectors(seed: int, max_area: float | None) -> None:
    graph = voronoi_graph(64, 4, 4.0, seed)
    cut, flat = cut_of(graph, 1, max_area)
    assert_cut(cut)
    assert np.array_equal(flat.ids, np.arange(len(graph.points)))
    left, right = shoelace(graph)
    assert np.allclose(face_areas(cut, 16), left - right)
    for v, beside in enumerate(neighbours_around(graph)):
        found = np.sort(cut.angle[cut.origin == v])
        expected = sectors(graph.points, v, sorted(beside))
        on_frame = ((graph.points[v] == 0) | (graph.points[v] == 64)).any()
        if on_frame:  # the sector outside is not meshed
            assert len(found) == len(expected) - 1
            assert found.sum() == pytest.approx(2 * np.pi - expected.max())
        else:
            assert np.allclose(found, expected)


def shoelace(graph: BoundaryGraph) -> tuple[Points, Points]:
    """What each face's outline sweeps where it lies on the left and on the right of a chain."""
    n_faces = len(graph.region_label)
    swept: Ids = np.array(graph.segments)
    a, b = graph.points[swept[:, 0]], graph.points[swept[:, 1]]
    area = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    beside = np.repeat(graph.chain_regions, np.diff(graph.chain_offsets) - 1, axis=0)
    left, right = np.zeros((2, n_faces + 1))  # VOID is the last
    np.add.at(left, beside[:, 0], area)
    np.add.at(right, beside[:, 1], area)
    return left[:-1], right[:-1]


def test_some_faces_only() -> None:
    graph = voronoi_graph(64, 4, 4.0, 3)
    chosen = np.zeros(16, bool)
    chosen[[0, 5, 6, 15]] = True
    flat = outline(graph, chosen, 1)
    cut = cut_at_constraints(triangulate(flat.points, flat.segments), flat.constraints)
    assert isinstance(cut, CutMesh)
    assert_cut(cut)
    assert set(cut.face.tolist()) == {0, 5, 6, 15}
    left, right = shoelace(graph)
    assert np.allclose(face_areas(cut, 16), np.where(chosen, left - right, 0))
