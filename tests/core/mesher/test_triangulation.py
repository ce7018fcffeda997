"""The constrained Delaunay triangulation: what goes in, what is kept, what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from imgquad_core.errors import TopologyError
from imgquad_core.mesher.triangulation import Triangles, constraint_table, triangulate
from support import naive
from support.faces import areas, polygon_graph, voronoi_graph

SQUARE = np.array([[0.0, 0], [4, 0], [4, 4], [0, 4]])
AROUND = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])


def edges_of(mesh: Triangles) -> set[tuple[int, int]]:
    pairs = np.stack([mesh.triangles.ravel(), np.roll(mesh.triangles, -1, axis=1).ravel()], axis=1)
    return {(a, b) for a, b in np.sort(pairs, axis=1).tolist()}


def grains(seed: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    graph = voronoi_graph(64, 4, 4.0, seed)
    return np.array(graph.points), graph.segments


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("max_area", [None, 6.0])
def test_triangles_are_positive_fill_the_square_and_keep_all_segments(seed: int, max_area: float | None) -> None:
    points, segments = grains(seed)
    mesh = triangulate(points, segments, max_area)
    assert np.array_equal(mesh.points[: len(points)], points)
    area = areas(mesh.points, mesh.triangles)
    assert area.min() > 0
    assert area.sum() == pytest.approx(64**2, rel=1e-12)
    assert {(a, b) for a, b in np.sort(segments, axis=1).tolist()} <= edges_of(mesh)
    assert np.array_equal(mesh.twins, naive.twins(mesh.triangles))
    if max_area is None:
        assert len(mesh.points) == len(points)
    else:
        inside = (mesh.triangles >= len(points)).all(axis=1)  # elsewhere a new point might crowd a constraint
        assert area[inside].max() <= max_area * (1 + 1e-9)
        assert area[~inside].mean() <= max_area


def test_no_point_lies_in_the_circle_of_a_triangle_beside_a_free_edge() -> None:
    points, segments = grains(5)
    mesh = triangulate(points, segments)
    fixed = {(a, b) for a, b in np.sort(segments, axis=1).tolist()}
    checked = 0
    for h in np.flatnonzero(mesh.twins >= 0):
        t, g = h // 3, mesh.twins[h]
        a, b = mesh.triangles[t, h % 3], mesh.triangles[t, (h + 1 - 3 * t) % 3]
        if (min(a, b), max(a, b)) in fixed:
            continue
        corners = mesh.points[mesh.triangles[t]]
        far = mesh.points[mesh.triangles[g // 3, (g + 2 - g // 3 * 3) % 3]]
        lifted = np.column_stack([corners - far, ((corners - far) ** 2).sum(axis=1)])
        assert np.linalg.det(lifted) <= 1e-9 * np.abs(lifted).max() ** 4
        checked += 1
    assert checked > 100


def test_no_small_angles_where_refinement_may_add_points() -> None:
    points, segments = grains(2)
    mesh = triangulate(points, segments, 6.0)
    p = mesh.points[mesh.triangles]
    a, b = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
    angle = np.degrees(np.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], (a * b).sum(axis=-1)))
    inside = (mesh.triangles >= len(points)).all(axis=1)
    assert np.count_nonzero(inside) > 100
    assert angle[inside].min() >= 20


def test_hole_between_two_outlines_is_filled_and_what_lies_outside_is_not() -> None:
    inner = SQUARE / 2 + 1
    points = np.vstack([SQUARE, inner, [[6, 2]]])  # the last point makes a triangle on the right
    segments = np.vstack([AROUND, AROUND + 4, [[1, 8], [8, 2]]])
    mesh = triangulate(points, segments)
    assert areas(mesh.points, mesh.triangles).sum() == pytest.approx(16 + 4)


def test_tiny_areas_are_passed_on_without_an_exponent() -> None:
    graph = polygon_graph(SQUARE / 100, [10] * 4, (1, 1))
    mesh = triangulate(graph.points, graph.segments, 2e-5)
    assert 1.6e-3 / 2e-5 <= len(mesh.triangles) < 400


def test_same_input_gives_same_bytes() -> None:
    points, segments = grains(1)
    one, two = triangulate(points, segments, 5.0), triangulate(points, segments, 5.0)
    assert all(a.tobytes() == b.tobytes() for a, b in zip(one, two, strict=True))


@pytest.mark.parametrize(
    ("points", "segments", "message"),
    [
        (SQUARE, np.vstack([AROUND, [[0, 2], [1, 3]]]), "cross: Triangle added 1"),
        (SQUARE, AROUND[:3], "enclose nothing"),
        (np.array([[0.0, 0], [1, 0], [2, 0]]), np.array([[0, 1], [1, 2]]), "enclose nothing"),
        (SQUARE[:2], AROUND[:1], "2 points with 1 segments"),
        (SQUARE, AROUND[:0], "4 points with 0 segments"),
        (np.where(SQUARE == 4, np.nan, SQUARE), AROUND, "cannot triangulate"),
        (np.where(SQUARE == 4, np.inf, SQUARE), AROUND, "cannot triangulate"),
    ],
    ids=["crossing", "open", "collinear", "two points", "no segments", "nan", "inf"],
)
def test_what_encloses_no_area_or_crosses_is_refused(
    points: NDArray[np.float64], segments: NDArray[np.int64], message: str
) -> None:
    with pytest.raises(TopologyError, match=message):
        triangulate(points, segments)


def test_constraint_table_tells_the_region_on_the_left_of_each_directed_edge() -> None:
    tail, head = np.array([0, 1, 3]), np.array([1, 2, 1])
    left, right = np.array([10, 11, 12]), np.array([20, 21, -1])
    middle = np.array([[7, 70], [8, 80], [9, 90]])
    table = constraint_table(4, tail, head, left, right, middle)
    found = {
        (v, int(table.head[i])): (int(table.region[i]), int(table.middle[i]))
        for v in range(4)
        for i in range(table.offsets[v], table.offsets[v + 1])
    }
    expected = {(0, 1): (10, 7), (1, 0): (20, 70), (1, 2): (11, 8), (2, 1): (21, 80), (3, 1): (12, 9), (1, 3): (-1, 90)}
    assert found == expected
