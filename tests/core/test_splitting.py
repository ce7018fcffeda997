"""Splits of pairs, triangles and quads into quads: counts, areas, who lies where."""

from __future__ import annotations

import numpy as np
import pytest

import naive
from faces import (
    areas,
    assert_valid_faces,
    grid,
    irregularity,
    quads_of,
    valences,
    voronoi_graph,
    with_layers,
)
from imgquad_core.composing import compose
from imgquad_core.halfedge import twins_of
from imgquad_core.model import BoundaryGraph
from imgquad_core.outline import coarse_segments, halved
from imgquad_core.splitting import FaceQuads, middles_of, split_composed, split_quads
from imgquad_core.triangulation import constraint_table


@pytest.mark.parametrize("seed", range(3))
def test_pairs_give_four_quads_and_single_triangles_three(seed: int) -> None:
    graph = voronoi_graph(64, 3, 2.0, seed)
    cut, flat = with_layers(graph, 2.0)
    mate = compose(cut)
    mesh = split_composed(cut, mate, len(flat.ids))
    n_pairs, n_single = np.count_nonzero(mate >= 0) // 2, np.count_nonzero(mate < 0)
    assert len(mesh.quads) == 4 * n_pairs + 3 * n_single
    assert np.allclose(
        np.bincount(mesh.face, weights=areas(mesh.points, mesh.quads)),
        np.bincount(cut.face, weights=areas(cut.points, cut.triangles)),
    )
    assert np.array_equal(mesh.points[: len(cut.points)], cut.points)


@pytest.mark.parametrize("seed", range(3))
def test_rim_is_that_of_the_graph_once_more_split(seed: int) -> None:
    graph = voronoi_graph(64, 3, 2.0, seed)
    mesh = quads_of(graph, 2.0)
    assert_valid_faces(mesh, graph)
    even = np.zeros(len(graph.points), bool)
    for c in range(graph.n_chains):
        even[graph.chain(c)[::2]] = True
    at = np.flatnonzero((mesh.origin >= 0) & even[mesh.origin])
    assert np.array_equal(mesh.points[at], graph.points[mesh.origin[at]])
    odd = np.flatnonzero((mesh.origin >= 0) & ~even[mesh.origin])
    assert (mesh.wanted[odd] == 2).all()
    assert (valences(mesh)[odd] == 2).all()


def test_triangles_alone_give_one_node_of_valence_three_each() -> None:
    cut, flat = with_layers(voronoi_graph(64, 3, 2.0, 1), 2.0)
    mesh = split_composed(cut, np.full(len(cut.triangles), -1), len(flat.ids))
    assert len(mesh.quads) == 3 * len(cut.triangles)
    centres = np.arange(len(mesh.points) - len(cut.triangles), len(mesh.points))
    assert (valences(mesh)[centres] == 3).all()
    assert naive.worst_quality(mesh.points, mesh.quads) > 0


def even_graph(seed: int) -> BoundaryGraph:
    """Four grains whose chains have multiples of four edges."""
    graph = voronoi_graph(64, 2, 4.0, seed)
    return halved(graph, np.ones(graph.n_chains, bool))


def once_more(mesh: FaceQuads) -> FaceQuads:
    twins = twins_of(mesh.quads, len(mesh.points))
    rim = np.where(twins < 0, 1000 + np.arange(twins.size), -1)
    return split_quads(mesh, twins, rim)


def test_split_of_quads_adds_no_irregular_node() -> None:
    mesh = quads_of(even_graph(2), 2.0, 4)
    fine = once_more(mesh)
    assert_valid_faces(fine)
    twins = naive.twins(mesh.quads)
    n_edges = np.count_nonzero(twins >= 0) // 2 + np.count_nonzero(twins == -1)
    assert len(fine.points) == len(mesh.points) + n_edges + len(mesh.quads)
    assert len(fine.quads) == 4 * len(mesh.quads)
    assert np.allclose(areas(fine.points, fine.quads).reshape(-1, 4).sum(axis=1), areas(mesh.points, mesh.quads))
    assert np.array_equal(fine.face, np.repeat(mesh.face, 4))
    assert irregularity(fine) == irregularity(mesh) > 0


def test_quads_begin_at_the_corners_of_the_old_one() -> None:
    mesh = grid(3, 2, 0.2)
    fine = once_more(mesh)
    assert np.array_equal(fine.quads[:, 0], mesh.quads.ravel())
    middle = mesh.points[mesh.quads].mean(axis=1)
    assert np.allclose(fine.points[fine.quads[:, 2]], np.repeat(middle, 4, axis=0))
    ahead = 0.5 * (mesh.points[mesh.quads] + mesh.points[np.roll(mesh.quads, -1, axis=1)])
    assert np.allclose(fine.points[fine.quads[:, 1]], ahead.reshape(-1, 2))


def test_new_rim_points_are_those_named_for_each_half_edge() -> None:
    mesh = grid(3, 2)
    fine = once_more(mesh)
    twins = naive.twins(mesh.quads)
    for h in range(twins.size):
        origin = fine.origin[fine.quads[h, 1]]
        assert origin == (1000 + h if twins[h] < 0 else -1)
    assert (fine.wanted == np.where(fine.origin < 1000, np.where(fine.origin < 0, 4, fine.wanted), 2)).all()
    assert np.array_equal(valences(fine), fine.wanted)


def test_middles_are_looked_up_in_the_graph() -> None:
    graph = even_graph(4)
    pairs = coarse_segments(graph, np.ones(graph.n_chains, bool), 2)
    none = np.zeros(len(pairs.tail), np.int64)
    table = constraint_table(len(graph.points), pairs.tail, pairs.head, none, none, pairs.middle)
    coarse = quads_of(graph, 2.0, 4)
    twins = twins_of(coarse.quads, len(coarse.points))
    middle = middles_of(coarse.quads, twins, coarse.origin, table)
    assert np.array_equal(middle >= 0, twins < 0)
    assert_valid_faces(split_quads(coarse, twins, middle), graph)
