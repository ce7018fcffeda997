"""Repair of poor quads: the best filling of a small outline, and never anything worse."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.cleanup.faces import FaceQuads
from imgquad_core.cleanup.relaxation import laplace, rings_of
from imgquad_core.cleanup.worst_quads import LEAST_GAIN, repair
from support import naive
from support.faces import Ids, Points, assert_valid_faces, grid, quads_of, rim_edges, voronoi_graph


def rough_polygon(n: int, seed: int) -> Points:
    """Nodes around a rough circle, counter-clockwise."""
    rng = np.random.default_rng(seed)
    turn = 2 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n
    points: Points = rng.uniform(0.8, 1.3, (n, 1)) * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return points


def only(points: Points, quads: Ids) -> FaceQuads:
    """Mesh of one face whose points are all on the rim."""
    n = len(points)
    return FaceQuads(points, quads, np.zeros(len(quads), np.int64), np.arange(n), np.bincount(quads.ravel()))


def worst(mesh: FaceQuads) -> float:
    return naive.worst_quality(mesh.points, mesh.quads)


def fans(n: int) -> Ids:
    """Cut a polygon into quads at its corner 0."""
    return np.array([[0, i, i + 1, i + 2] for i in range(1, n - 1, 2)])


@pytest.mark.parametrize("n", [6, 8, 10])
@pytest.mark.parametrize("seed", range(25))
def test_outline_gets_the_best_of_all_fillings(n: int, seed: int) -> None:
    old = only(rough_polygon(n, seed), fans(n))
    new, _ = repair(old, 1.0)
    best = naive.best_quads(old.points)
    assert worst(new) >= worst(old)
    if best > 0 and best > worst(old) + LEAST_GAIN:
        assert worst(new) >= best - 1e-12
    if len(new.points) == n:  # without the star's new node there is nothing better
        assert worst(new) <= best + 1e-12
    if worst(new) > 0:
        assert np.array_equal(new.points[:n], old.points)
        assert naive.areas(new.points, new.quads).sum() == pytest.approx(naive.areas(old.points, np.arange(n)[None])[0])
        assert rim_edges(new) == {(0, i, (i + 1) % n) for i in range(n)}


def test_star_takes_over_where_nodes_alone_do_not_do() -> None:
    turn = 2 * np.pi * np.arange(6) / 6
    hexagon = np.stack([np.cos(turn), np.sin(turn)], axis=1) * np.tile([[1.0], [0.6]], (3, 1))
    new, _ = repair(only(hexagon, fans(6)), 1.0)
    assert len(new.points) == 7
    assert len(new.quads) == 3
    assert naive.best_quads(hexagon) < 0.3
    assert worst(new) == pytest.approx(np.sin(np.pi / 3), abs=1e-3)
    assert np.allclose(new.points[6], 0, atol=1e-2)
    assert new.origin[6] == -1
    assert new.wanted[6] == 4


@pytest.mark.parametrize("seed", range(6))
def test_centre_of_the_star_is_about_the_best(seed: int) -> None:
    turn = 2 * np.pi * np.arange(6) / 6
    shape = np.stack([np.cos(turn), np.sin(turn)], axis=1) * np.tile([[1.0], [0.6]], (3, 1))
    shape[seed] *= 1.6
    new, _ = repair(only(shape, fans(6)), 1.0)
    assert worst(new) >= max(naive.best_star(shape), naive.best_quads(shape)) - 0.02


def test_good_mesh_is_returned_as_it_is() -> None:
    mesh = grid(6, 5, 0.1)
    assert repair(mesh, 0.5)[0] is mesh
    none = FaceQuads(np.empty((0, 2)), np.empty((0, 4), np.int64), *[np.empty(0, np.int64)] * 3)
    assert repair(none, 0.5)[0] is none


def test_folded_quads_are_replaced() -> None:
    mesh = grid(5, 5)
    points = mesh.points.copy()
    points[14] += [1.3, 0.1]  # over its neighbour
    old = mesh._replace(points=points)
    assert worst(old) < 0
    new, _ = repair(old, 0.5)
    assert worst(new) > max(0.0, worst(old))
    assert rim_edges(new) == rim_edges(old)
    assert naive.areas(new.points, new.quads).sum() == pytest.approx(25)


@pytest.mark.parametrize("below", [0.5, 0.8])
@pytest.mark.parametrize("seed", range(4))
def test_grains_lose_poor_quads_and_nothing_else(seed: int, below: float) -> None:
    mesh = quads_of(voronoi_graph(64, 3, 2.0, seed), 2.0)
    points = mesh.points.copy()
    laplace(points, rings_of(mesh.quads, len(points)), mesh.origin < 0, 3)
    old = mesh._replace(points=points)
    new, _ = repair(old, below)
    assert_valid_faces(new)
    assert worst(new) >= worst(old)
    assert rim_edges(new) == rim_edges(old)
    assert new.points[new.origin >= 0].tobytes() == old.points[old.origin >= 0].tobytes()
    before, after = (np.bincount(m.face, weights=naive.areas(m.points, m.quads)) for m in (old, new))
    assert np.allclose(before, after)
    poor = [np.count_nonzero(naive.corner_sines(m.points, m.quads).min(axis=1) < below) for m in (old, new)]
    assert poor[1] < poor[0] or (poor[0] == 0 and new is old)
    again, _ = repair(old, below)
    assert all(a.tobytes() == b.tobytes() for a, b in zip(new, again, strict=True))
