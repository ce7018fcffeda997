"""Moving nodes: valid stays valid, fixed stays fixed, derivatives are true, folds come out."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from imgquad_core.arrays import Flags
from imgquad_core.cleanup.faces import FaceQuads
from imgquad_core.cleanup.relaxation import (
    BAD,
    GOOD,
    Rings,
    _corner_energy,
    fit_rim,
    laplace,
    newton,
    part,
    ring_quality,
    rings_of,
    untangle,
)
from imgquad_core.geometry.quad_shape import lower_to_worst, quad_area, quad_quality, rim_angles
from imgquad_core.measures.quality import scaled_jacobian
from support import naive
from support.faces import Points, grid, quads_of, voronoi_graph

Move = Callable[[Points, Rings, Flags], object]
MOVES: dict[str, Move] = {
    "laplace": lambda points, rings, free: laplace(points, rings, free, 8),
    "newton": lambda points, rings, free: newton(points, rings, free, 8, GOOD),
    "untangle": lambda points, rings, free: untangle(points, rings, free, 2, 0.9),
}


def rough(seed: int) -> FaceQuads:
    """Grid whose nodes are moved as far as all quads stay convex."""
    mesh = grid(9, 8, 0.34, seed)
    regular = grid(9, 8)
    for v in np.flatnonzero(mesh.origin < 0):
        beside = (mesh.quads == v).any(axis=1)
        if naive.worst_quality(mesh.points, mesh.quads[beside]) <= 0.02:
            mesh.points[v] = regular.points[v]
    return mesh if naive.worst_quality(mesh.points, mesh.quads) > 0 else grid(9, 8, 0.2, seed)


def moved(mesh: FaceQuads, move: Move, free: Flags | None = None) -> Points:
    points = mesh.points.copy()
    move(points, rings_of(mesh.quads, len(points)), mesh.origin < 0 if free is None else free)
    return points


@pytest.mark.parametrize("name", MOVES)
@pytest.mark.parametrize("seed", range(6))
def test_no_quad_is_ever_inverted_and_fixed_nodes_stay_bitwise(seed: int, name: str) -> None:
    mesh = rough(seed)
    free = (mesh.origin < 0) & (np.random.default_rng(seed).random(len(mesh.points)) < 0.8)
    points = moved(mesh, MOVES[name], free)
    assert naive.worst_quality(points, mesh.quads) > 0
    assert points[~free].tobytes() == mesh.points[~free].tobytes()
    assert (points[free] != mesh.points[free]).any()
    assert points.tobytes() == moved(mesh, MOVES[name], free).tobytes()


@pytest.mark.parametrize("seed", range(6))
def test_laplace_keeps_rings_above_its_guard_or_what_they_had(seed: int) -> None:
    mesh = rough(seed)
    before, after = mesh.points, moved(mesh, MOVES["laplace"])
    assert naive.worst_quality(after, mesh.quads) >= min(0.6, naive.worst_quality(before, mesh.quads)) - 1e-12
    mean = [naive.corner_sines(p, mesh.quads).min(axis=1).mean() for p in (before, after)]
    assert mean[1] > mean[0]


@pytest.mark.parametrize("name", MOVES)
def test_thin_bend_is_not_cut_short(name: str) -> None:
    # the mean of the neighbours along the bend lies beyond its inner side
    mesh = grid(5, 2)
    turn, radius = np.radians(55 * mesh.points[:, 0]), 1 + 0.1 * mesh.points[:, 1]
    bent = mesh._replace(points=np.stack([-radius * np.cos(turn), radius * np.sin(turn)], axis=1))
    assert naive.worst_quality(bent.points, bent.quads) > 0.5
    assert naive.worst_quality(moved(bent, MOVES[name]), bent.quads) > 0.5


@pytest.mark.parametrize("seed", range(6))
def test_newton_lowers_the_energy(seed: int) -> None:
    mesh = rough(seed)
    before = naive.shape_energy(mesh.points, mesh.quads)
    after = naive.shape_energy(moved(mesh, MOVES["newton"]), mesh.quads)
    assert 4 * len(mesh.quads) <= after < before


@pytest.mark.parametrize("seed", range(6))
def test_untangle_never_lowers_the_worst_quad(seed: int) -> None:
    mesh = rough(seed)
    assert naive.worst_quality(moved(mesh, MOVES["untangle"]), mesh.quads) >= naive.worst_quality(
        mesh.points, mesh.quads
    )


@pytest.mark.parametrize("name", MOVES)
def test_regular_grid_does_not_move(name: str) -> None:
    mesh = grid(6, 6)
    assert moved(mesh, MOVES[name]).tobytes() == mesh.points.tobytes()


@pytest.mark.parametrize("floor", [0.0, 0.5])
def test_a_node_that_all_but_touches_another_is_parted_from_it(floor: float) -> None:
    #      2---1
    #     /     \     6, the middle of a hexagon, has edges to 0, 2 and 4,
    #    3     6-0     and all but touches 0: all angles are fair
    #     \     /
    #      4---5
    angle = np.arange(6) * np.pi / 3
    points = np.append(np.stack([np.cos(angle), np.sin(angle)], axis=1), [[0.99, 0.0]], axis=0)
    quads, free = np.array([[6, 0, 1, 2], [6, 2, 3, 4], [6, 4, 5, 0]]), np.arange(7) == 6
    before = naive.worst_quality(points, quads)
    mended = np.zeros(7, bool)
    part(points, rings_of(quads, 7), free, 0.1, floor, mended)
    assert not mended.any()
    lengths = np.hypot(*(points[6] - points[[0, 2, 4]]).T)
    assert lengths.min() >= 0.1 * lengths.max()
    assert naive.worst_quality(points, quads) >= min(before, floor)
    rested = points.copy()
    part(points, rings_of(quads, 7), free, 0.1, floor, mended)
    assert np.array_equal(points, rested), "long enough"


def test_smoothing_brings_a_rough_grid_back() -> None:
    mesh = rough(1)
    points = moved(mesh, lambda p, r, f: (laplace(p, r, f, 200), newton(p, r, f, 50, 1.0)))
    assert np.abs(points - grid(9, 8).points).max() < 0.1


def corner_energy(corner: Points, which: int) -> tuple[float, ...]:
    """Energy and derivatives of a corner (three points: itself, the next, the one before)."""
    (px, py), (nx, ny), (bx, by) = corner.tolist()
    return _corner_energy(px, py, nx, ny, bx, by, which)


def test_derivatives_agree_with_finite_differences() -> None:
    rng = np.random.default_rng(3)
    step = 1e-4
    for _ in range(20):
        corner = np.array([[0.0, 0], [1, 0], [0, 1]]) + rng.uniform(-0.3, 0.3, (3, 2))
        for which in range(3):

            def energy(dx: float, dy: float, corner: Points = corner, which: int = which) -> float:
                at = corner.copy()
                at[which] += [dx, dy]
                return float(corner_energy(at, which)[0])

            middle = energy(0, 0)
            (e, w), (n, s) = ((energy(step, 0), energy(-step, 0)), (energy(0, step), energy(0, -step)))
            gradient = [(e - w) / 2 / step, (n - s) / 2 / step]
            mixed = energy(step, step) - energy(step, -step) - energy(-step, step) + energy(-step, -step)
            hessian = [(e - 2 * middle + w) / step**2, mixed / 4 / step**2, (n - 2 * middle + s) / step**2]
            found = corner_energy(corner, which)
            scale = max(1.0, np.abs(found).max())
            assert found[1:3] == pytest.approx(gradient, abs=1e-5 * scale)
            assert found[3:] == pytest.approx(hessian, abs=1e-4 * scale)


def test_energy_is_one_for_a_square_corner_and_infinite_for_a_folded_one() -> None:
    assert _corner_energy(0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 0)[:3] == (1.0, 0.0, 0.0)
    assert _corner_energy(0.0, 0.0, 1.0, 0.0, 1.0, -1.0, 0)[0] == np.inf


@pytest.mark.parametrize("shift", [(1.4, 0.2), (-1.2, 1.1), (0.1, -1.6)])
def test_untangle_takes_out_a_fold(shift: tuple[float, float]) -> None:
    mesh = grid(6, 6)
    folded = mesh.points.copy()
    folded[24] += shift
    assert naive.worst_quality(folded, mesh.quads) < 0
    points = folded.copy()
    left = untangle(points, rings_of(mesh.quads, len(points)), mesh.origin < 0, 4, BAD)
    assert left == 0
    assert naive.worst_quality(points, mesh.quads) >= BAD
    assert points[mesh.origin >= 0].tobytes() == folded[mesh.origin >= 0].tobytes()


def test_untangle_raises_corners_beside_a_worse_one_that_does_not_feel_the_node() -> None:
    points = np.array([[0.0, 0.0], [4.0, 0.0], [4.6, 0.5], [-1.2, 0.3]])
    quad = np.array([[0, 1, 2, 3]])
    (opposite, *felt), after = naive.corner_sines(points, quad)[0], points.copy()
    untangle(after, rings_of(quad, 4), np.arange(4) == 2, 2, 0.9)
    assert opposite < min(felt)
    assert naive.corner_sines(after, quad)[0, 1:].min() > min(felt) + 0.2


def test_untangle_counts_what_it_cannot_help() -> None:
    mesh = grid(4, 4)
    points = mesh.points.copy()
    points[2] += [0, 1.7]  # a rim node, which is fixed, pushed over the row behind it
    left = untangle(points, rings_of(mesh.quads, len(points)), mesh.origin < 0, 3, 0.9)
    worst = [ring_quality(points, rings_of(mesh.quads, 25), v) for v in np.flatnonzero(mesh.origin < 0)]
    assert left == np.count_nonzero(np.array(worst) < 0.9) > 0


@pytest.mark.parametrize("seed", range(3))
def test_rim_goes_to_its_targets_and_inner_nodes_make_room(seed: int) -> None:
    graph = voronoi_graph(64, 3, 2.0, seed)
    mesh = quads_of(graph, 2.0)
    rim = mesh.origin >= 0
    points = mesh.points.copy()
    assert not np.array_equal(points[rim], graph.points[mesh.origin[rim]])
    late = fit_rim(points, rings_of(mesh.quads, len(points)), rim, graph.points[mesh.origin], 6)
    assert naive.worst_quality(points, mesh.quads) > 0
    assert not late[~rim].any()
    there = rim & ~late
    assert points[there].tobytes() == graph.points[mesh.origin[there]].tobytes()
    assert late.sum() <= 0.01 * rim.sum()


def test_target_that_would_fold_quads_is_not_reached() -> None:
    mesh = grid(3, 3)
    targets = mesh.points.copy()
    targets[1] = [1.0, 2.9]  # straight up across the mesh
    points = mesh.points.copy()
    late = fit_rim(points, rings_of(mesh.quads, 16), mesh.origin >= 0, targets, 6)
    assert np.flatnonzero(late).tolist() == [1]
    assert naive.worst_quality(points, mesh.quads) > 0


@pytest.mark.parametrize("seed", range(3))
def test_measures_agree_with_their_definitions(seed: int) -> None:
    mesh = grid(7, 6, 0.6, seed)  # with folds
    sines = naive.corner_sines(mesh.points, mesh.quads)
    quality = [quad_quality(mesh.points, mesh.quads, q) for q in range(len(mesh.quads))]
    assert np.allclose(quality, sines.min(axis=1))
    assert np.allclose(quality, scaled_jacobian(mesh.points, mesh.quads))
    assert np.allclose(
        [quad_area(mesh.points, mesh.quads, q) for q in range(len(mesh.quads))], naive.areas(mesh.points, mesh.quads)
    )
    rings = rings_of(mesh.quads, len(mesh.points))
    for v in range(len(mesh.points)):
        assert ring_quality(mesh.points, rings, v) == pytest.approx(sines[(mesh.quads == v).any(axis=1)].min())
    face = np.arange(len(mesh.quads)) % 3
    worst = np.ones(5)
    lower_to_worst(mesh.points, mesh.quads, face, worst)
    assert np.allclose(worst, [*(sines[face == f].min() for f in range(3)), 1, 1])


def test_sector_angles_of_a_valid_mesh() -> None:
    mesh = rough(4)
    angle = np.degrees(rim_angles(mesh.points, mesh.quads, mesh.origin >= 0))
    assert np.allclose(angle, np.where(mesh.origin >= 0, 90 * mesh.wanted, 0))
