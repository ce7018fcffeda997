"""Clean-up by cavities: fewer irregular nodes, nothing else lost."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from imgquad_core.cleanup.cavity import compact, net_of, scratch
from imgquad_core.cleanup.faces import FaceQuads
from imgquad_core.cleanup.irregular_nodes import CleanUp, _clean_pass, clean_up, memory_of
from imgquad_core.cleanup.relaxation import laplace, rings_of
from imgquad_core.mesher.splitting import split_composed
from support import naive
from support.faces import (
    assert_valid_faces,
    grid,
    irregularity,
    quads_of,
    rim_edges,
    valences,
    voronoi_graph,
    with_layers,
)

NORMAL = CleanUp((16, 40, 80), 0.2, 0.6)


def composed(seed: int) -> FaceQuads:
    """Nine grains, smoothed a little, as the mesher hands them to the clean-up."""
    return smoothed(quads_of(voronoi_graph(64, 3, 2.0, seed), 2.0))


def smoothed(mesh: FaceQuads) -> FaceQuads:
    points = mesh.points.copy()
    laplace(points, rings_of(mesh.quads, len(points)), mesh.origin < 0, 3)
    return mesh._replace(points=points)


def triangles_split(seed: int) -> FaceQuads:
    """The same grains with each triangle split into three quads: irregular everywhere."""
    cut, flat = with_layers(voronoi_graph(64, 3, 2.0, seed), 2.0)
    return smoothed(split_composed(cut, np.full(len(cut.triangles), -1), len(flat.ids)))


def shortfall(mesh: FaceQuads) -> float:
    """Sum of 1 - scaled Jacobian over all quads."""
    return float((1 - naive.corner_sines(mesh.points, mesh.quads).min(axis=1)).sum())


def same(one: FaceQuads, two: FaceQuads) -> bool:
    return all(a.tobytes() == b.tobytes() for a, b in zip(one, two, strict=True))


@pytest.mark.parametrize(
    "how",
    [CleanUp((16,), 0.2, 0.6), NORMAL, CleanUp((16, 40, 80, 160), 1.0, 0.3), CleanUp((40, 160), 0.0, 0.6)],
    ids=["small", "normal", "greedy", "quality"],
)
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("make", [composed, triangles_split])
def test_result_is_valid_more_regular_and_keeps_rim_and_areas(make: type, seed: int, how: CleanUp) -> None:
    old: FaceQuads = make(seed)
    new = clean_up(old, how)
    assert_valid_faces(new)
    assert irregularity(new) <= irregularity(old) - (make is composed)
    assert rim_edges(new) == rim_edges(old)
    kept, before = new.origin >= 0, old.origin >= 0
    assert np.array_equal(new.origin[kept], old.origin[before])
    assert new.points[kept].tobytes() == old.points[before].tobytes()
    assert np.array_equal(new.wanted[kept], old.wanted[before])
    assert np.allclose(
        np.bincount(new.face, weights=naive.areas(new.points, new.quads)),
        np.bincount(old.face, weights=naive.areas(old.points, old.quads)),
    )
    worst_old, worst_new = (naive.worst_quality(m.points, m.quads) for m in (old, new))
    assert worst_new >= min(how.worst, worst_old) - 1e-12
    if how.tolerance == 0:
        assert shortfall(new) <= shortfall(old) + 1e-9
    else:
        paid = how.tolerance * (irregularity(old) - irregularity(new))
        assert shortfall(new) <= shortfall(old) + paid + 1e-9


def test_most_irregular_nodes_vanish() -> None:
    old = composed(0)
    new = clean_up(old, NORMAL)
    odd_old, odd_new = (np.count_nonzero(valences(m) != m.wanted) for m in (old, new))
    assert odd_new < 0.6 * odd_old


def test_larger_cavities_and_more_tolerance_find_more() -> None:
    old = composed(1)
    found = [irregularity(clean_up(old, CleanUp(sizes, 0.4, 0.6))) for sizes in ((16,), (16, 40), (16, 40, 80))]
    assert found[0] > found[1] >= found[2]


def test_same_input_gives_same_bytes_and_is_left_alone() -> None:
    old = composed(2)
    before = [a.tobytes() for a in old]
    assert same(clean_up(old, NORMAL), clean_up(old, NORMAL))
    assert [a.tobytes() for a in old] == before


def test_regular_mesh_stays_as_it_is() -> None:
    old = grid(9, 7, 0.2)
    assert same(clean_up(old, NORMAL), old)


def test_no_quads_stay_none() -> None:
    none = np.empty(0, np.int64)
    empty = FaceQuads(np.empty((0, 2)), np.empty((0, 4), np.int64), none, none, none)
    assert clean_up(empty, NORMAL) is empty


def turn_edge(mesh: FaceQuads, q: int) -> FaceQuads:
    r"""Turn the edge between squares q and q + 1 of a grid: two nodes get valence 3, two valence 5.

    +---+---+      +---+---+
    |   |   |  ->  |    \  |
    +---+---+      +---+---+
    """
    a, b, c, d = mesh.quads[q]
    _, e, f, _ = mesh.quads[q + 1]
    quads = mesh.quads.copy()
    quads[q], quads[q + 1] = [a, b, e, d], [e, f, c, d]
    return smoothed(mesh._replace(quads=quads))


@pytest.mark.parametrize("turned", [[27], [36], [17, 45], [9, 29, 52]])
def test_turned_edges_in_a_grid_are_turned_back(turned: list[int]) -> None:
    old = grid(8, 8)
    for q in turned:
        old = turn_edge(old, q)
    assert irregularity(old) > 2
    new = clean_up(old, CleanUp((16, 40, 80), 0.2, 0.3))
    assert irregularity(new) == 0
    assert len(new.quads) == 64
    assert_valid_faces(new)


def without_memory(mesh: FaceQuads, how: CleanUp) -> FaceQuads:
    """Clean up with every search done anew, whatever the one before has found."""
    net = net_of(mesh, max(how.sizes))
    cavity, canvas = scratch(net, max(how.sizes))
    begins = np.ones(len(net.valence), bool)
    for size in how.sizes:
        memory = memory_of(net, len(net.valence))
        memory.least[:] = -1
        _clean_pass(net, cavity, canvas, begins, memory, size, how.tolerance, how.worst, size > how.thorough)
    return compact(net, mesh)


@pytest.mark.parametrize("sizes", [(16, 40, 80), (40, 160, 160), (80, 16)])
@pytest.mark.parametrize("make", [composed, triangles_split])
def test_searches_that_are_left_out_would_have_been_in_vain(
    make: Callable[[int], FaceQuads], sizes: tuple[int, ...]
) -> None:
    how, differ = CleanUp(sizes, 0.5, 0.6), []
    for mesh in (make(0), make(2)):
        one, other = clean_up(mesh, how), without_memory(mesh, how)
        differ.append(len(one.quads) != len(mesh.quads))
        for a, b in zip(one, other, strict=True):
            np.testing.assert_array_equal(a, b)
    assert differ[0]  # of the second one, of triangles by CDT, nothing can be made better


def test_no_mesh_of_a_face_is_less_irregular_than_its_memory_tells() -> None:
    mesh = composed(1)
    before, after = (memory_of(net_of(m, 80), len(m.points)) for m in (mesh, clean_up(mesh, NORMAL)))
    np.testing.assert_array_equal(before.least, after.least)
    assert (after.cost >= after.least).all()
    assert (after.cost <= before.cost).all()
    assert after.cost.sum() < before.cost.sum()
