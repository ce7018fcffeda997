"""The constrained Delaunay triangulation: what goes in, what is kept, what is refused, by whichever library."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from importlib.util import find_spec

import numpy as np
import pytest
from numpy.typing import NDArray

from imgquad_core.errors import InputError, TopologyError
from imgquad_core.mesher import triangulators
from imgquad_core.mesher.triangulation import Triangles, constraint_table, triangulate, triangulator_used
from support import ROOT, naive
from support.faces import polygon_graph, voronoi_graph

SQUARE = np.array([[0.0, 0], [4, 0], [4, 4], [0, 4]])
AROUND = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
LARGEST = {"triangle": 1.0, "cdt": 1.5}  # triangle without a corner on a constraint, over the area asked for
needs_triangle = pytest.mark.skipif(find_spec("triangle") is None, reason="triangle is not installed")
both = pytest.mark.parametrize("by", [pytest.param("triangle", marks=needs_triangle), "cdt"])


def edges_of(mesh: Triangles) -> set[tuple[int, int]]:
    pairs = np.stack([mesh.triangles.ravel(), np.roll(mesh.triangles, -1, axis=1).ravel()], axis=1)
    return {(a, b) for a, b in np.sort(pairs, axis=1).tolist()}


def grains(seed: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    graph = voronoi_graph(64, 4, 4.0, seed)
    return np.array(graph.points), graph.segments


@both
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("max_area", [None, 6.0])
def test_triangles_are_positive_fill_the_square_and_keep_all_segments(
    seed: int, max_area: float | None, by: str
) -> None:
    points, segments = grains(seed)
    mesh = triangulate(points, segments, max_area, by)
    assert np.array_equal(mesh.points[: len(points)], points)
    area = naive.areas(mesh.points, mesh.triangles)
    assert area.min() > 0
    assert area.sum() == pytest.approx(64**2, rel=1e-12)
    assert {(a, b) for a, b in np.sort(segments, axis=1).tolist()} <= edges_of(mesh)
    assert np.array_equal(mesh.twins, naive.twins(mesh.triangles))
    if max_area is None:
        assert len(mesh.points) == len(points)
    else:
        inside = (mesh.triangles >= len(points)).all(axis=1)  # elsewhere a new point might crowd a constraint
        assert area[inside].max() <= LARGEST[by] * max_area * (1 + 1e-9)
        assert area[~inside].mean() <= max_area


@both
def test_no_point_lies_in_the_circle_of_a_triangle_beside_a_free_edge(by: str) -> None:
    points, segments = grains(5)
    mesh = triangulate(points, segments, triangulator=by)
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


@needs_triangle
def test_no_small_angles_where_triangle_may_add_points() -> None:
    points, segments = grains(2)
    mesh = triangulate(points, segments, 6.0, "triangle")
    p = mesh.points[mesh.triangles]
    a, b = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
    angle = np.degrees(np.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], (a * b).sum(axis=-1)))
    inside = (mesh.triangles >= len(points)).all(axis=1)
    assert np.count_nonzero(inside) > 100
    assert angle[inside].min() >= 20


@both
@pytest.mark.parametrize("edges", [4, 16, 64])
def test_triangles_get_larger_away_from_short_constraints(by: str, edges: int) -> None:
    graph = polygon_graph(SQUARE * 16, [edges] * 4, (64, 64))
    mesh = triangulate(graph.points, graph.segments, 64.0, by)
    area, middle = naive.areas(mesh.points, mesh.triangles), mesh.points[mesh.triangles].mean(axis=1)
    to_rim = np.minimum(middle, 64 - middle).min(axis=1)
    assert area[to_rim > 16].mean() >= 0.35 * 64
    beside = area[to_rim < 0.5 * 64 / edges].mean()
    assert beside <= (64 / edges) ** 2
    assert len(mesh.triangles) <= 8 * (64 + 4 * edges), "finer than the sizes ask for"


def test_cdt_adds_points_even_where_constraints_are_longer_than_the_triangles_asked_for() -> None:
    mesh = triangulate(SQUARE, AROUND, 0.05, "cdt")
    area = naive.areas(mesh.points, mesh.triangles)
    assert area.sum() == pytest.approx(16)
    assert np.median(area) <= 0.05
    assert (np.abs(mesh.points[4:] - 2) < 2).all()


@both
def test_hole_between_two_outlines_is_filled_and_what_lies_outside_is_not(by: str) -> None:
    inner = SQUARE / 2 + 1
    points = np.vstack([SQUARE, inner, [[6, 2]]])  # the last point makes a triangle on the right
    segments = np.vstack([AROUND, AROUND + 4, [[1, 8], [8, 2]]])
    mesh = triangulate(points, segments, triangulator=by)
    assert naive.areas(mesh.points, mesh.triangles).sum() == pytest.approx(16 + 4)


@both
def test_tiny_areas_are_passed_on_without_an_exponent(by: str) -> None:
    graph = polygon_graph(SQUARE / 100, [10] * 4, (1, 1))
    mesh = triangulate(graph.points, graph.segments, 2e-5, by)
    assert 1.6e-3 / 2e-5 <= len(mesh.triangles) < 400


@both
def test_same_input_gives_same_bytes(by: str) -> None:
    points, segments = grains(1)
    one, two = triangulate(points, segments, 5.0, by), triangulate(points, segments, 5.0, by)
    assert all(a.tobytes() == b.tobytes() for a, b in zip(one, two, strict=True))


@both
@pytest.mark.parametrize(
    ("points", "segments", "message"),
    [
        (SQUARE, np.vstack([AROUND, [[0, 2], [1, 3]]]), "boundaries cross"),
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
    points: NDArray[np.float64], segments: NDArray[np.int64], message: str, by: str
) -> None:
    with pytest.raises(TopologyError, match=message):
        triangulate(points, segments, triangulator=by)


def test_cdt_refuses_the_same_point_twice() -> None:
    with pytest.raises(TopologyError, match="Duplicate vertex"):
        triangulate(np.vstack([SQUARE, SQUARE[:1]]), AROUND, triangulator="cdt")


@both
def test_crossing_constraints_are_refused_with_a_background_by_cdt_too(by: str) -> None:
    crossing = np.vstack([AROUND, [[0, 2], [1, 3]]])
    if by == "cdt":
        with pytest.raises(TopologyError, match="boundaries cross"):
            triangulate(SQUARE, crossing, 1.0, by)
    else:
        assert len(triangulate(SQUARE, crossing, 1.0, by).points) > 4


@both
@pytest.mark.parametrize("step", [1e-3, 1e-9, 1e-14])
def test_thin_faces_and_points_all_but_on_a_constraint_are_kept(by: str, step: float) -> None:
    points = np.vstack([SQUARE, [[2.0, step], [2.0, 2.0]]])
    mesh = triangulate(points, AROUND, triangulator=by)
    assert set(mesh.triangles.ravel()) == set(range(6))
    assert {(0, 1), (1, 2), (2, 3), (0, 3)} <= edges_of(mesh)
    thin = np.array([[0.0, 0], [4, 0], [4, step], [0, step]])
    assert len(triangulate(thin, AROUND, triangulator=by).triangles) == 2


@both
def test_collinear_constraints_and_a_grid_full_of_ties_are_no_trouble(by: str) -> None:
    n = 12
    y, x = np.divmod(np.arange(n * n), n)
    points = np.stack([x, y], axis=1).astype(float)
    on_frame = np.flatnonzero((x % (n - 1) == 0) | (y % (n - 1) == 0))
    rim = on_frame[np.argsort(np.arctan2(*(points[on_frame] - (n - 1) / 2).T[::-1]))]
    segments = np.stack([rim, np.roll(rim, -1)], axis=1)
    mesh = triangulate(points, segments, triangulator=by)
    assert len(mesh.triangles) == 2 * (n - 1) ** 2
    assert np.array_equal(mesh.twins, naive.twins(mesh.triangles))


@pytest.fixture
def forgotten() -> Iterator[Callable[[str], None]]:
    """Make packages look missing."""
    triangulators._is_installed.cache_clear()
    with pytest.MonkeyPatch.context() as patch:
        yield lambda package: patch.setitem(sys.modules, package, None)
    triangulators._is_installed.cache_clear()


@needs_triangle
def test_auto_is_triangle_where_it_is_installed() -> None:
    assert triangulator_used() == triangulator_used("triangle") == "triangle"
    points, segments = grains(1)
    one, two = triangulate(points, segments, 5.0), triangulate(points, segments, 5.0, "triangle")
    assert all(a.tobytes() == b.tobytes() for a, b in zip(one, two, strict=True))


def test_auto_is_cdt_elsewhere(forgotten: Callable[[str], None]) -> None:
    forgotten("triangle")
    assert triangulator_used() == triangulator_used("cdt") == "cdt"
    with pytest.raises(InputError, match="'triangle', but its Python package is missing: pip install triangle"):
        triangulator_used("triangle")
    assert len(triangulate(SQUARE, AROUND).triangles) == 2


def test_without_either_the_error_names_both(forgotten: Callable[[str], None]) -> None:
    forgotten("triangle")
    forgotten("pythoncdt")
    with pytest.raises(InputError, match=r"'auto', but its .* is missing: pip install pythoncdt or triangle"):
        triangulate(SQUARE, AROUND)


def test_other_names_are_refused() -> None:
    with pytest.raises(InputError, match="triangulator is 'netgen'; give one of auto, triangle, cdt"):
        triangulator_used("netgen")


def test_an_installation_brings_triangle_only_where_it_is_asked_for() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    with_it = {name for name, wanted in extras.items() if any(w.startswith("triangle") for w in wanted)}
    assert with_it == {"triangle", "dev"}
    assert not any("triangle" in wanted for wanted in [*project["dependencies"], *extras["all"]])
    assert any(wanted.startswith("pythoncdt") for wanted in project["dependencies"])


@both
def test_only_the_library_that_is_used_is_imported(by: str) -> None:
    code = (
        "import sys, numpy as np\n"
        "from imgquad_core.mesher.triangulation import triangulate\n"
        f"triangulate(np.array({SQUARE.tolist()}), np.array({AROUND.tolist()}), None, {by!r})\n"
        "print('triangle' in sys.modules, 'pythoncdt' in sys.modules)"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert told.stdout.split() == [str(by == "triangle"), str(by == "cdt")]


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
