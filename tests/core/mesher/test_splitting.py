"""Splits of pairs, triangles and quads into quads: counts, areas, who lies where."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from imgquad_core.cleanup.faces import FaceQuads
from imgquad_core.geometry.halfedge import twins_of
from imgquad_core.mesher.composing import compose
from imgquad_core.mesher.outline import coarse_segments
from imgquad_core.mesher.splitting import points_between, refine_quads, split_composed
from imgquad_core.mesher.triangulation import constraint_table
from imgquad_core.model import BoundaryGraph
from support import naive
from support.faces import (
    assert_valid_faces,
    graph_of,
    grid,
    irregularity,
    quads_of,
    valences,
    voronoi_graph,
    with_layers,
)


@pytest.mark.parametrize("seed", range(3))
def test_pairs_give_four_quads_and_single_triangles_three(seed: int) -> None:
    graph = voronoi_graph(64, 3, 2.0, seed)
    cut, flat = with_layers(graph, 2.0)
    mate = compose(cut)
    mesh = split_composed(cut, mate, len(flat.ids))
    n_pairs, n_single = np.count_nonzero(mate >= 0) // 2, np.count_nonzero(mate < 0)
    assert len(mesh.quads) == 4 * n_pairs + 3 * n_single
    assert np.allclose(
        np.bincount(mesh.face, weights=naive.areas(mesh.points, mesh.quads)),
        np.bincount(cut.face, weights=naive.areas(cut.points, cut.triangles)),
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


def finer_graph(seed: int, n: int = 2) -> BoundaryGraph:
    """Four grains, n edges for each of an even number on every chain."""
    graph = voronoi_graph(64, 2, 4.0, seed)
    points, chains = [*graph.points], []
    for c in range(graph.n_chains):
        ids = graph.chain(c).tolist()
        chain = ids[:1]
        for u, w in pairwise(ids):
            chain += [*range(len(points), len(points) + n - 1), w]
            points += [graph.points[u] + k / n * (graph.points[w] - graph.points[u]) for k in range(1, n)]
        chains.append(chain)
    return graph_of(np.array(points), chains, [*map(tuple, graph.chain_regions.tolist())], graph.shape)


def in_parts(mesh: FaceQuads, n: int) -> FaceQuads:
    """Split with ids 1000 + 10 h + i for the points on the way along each rim half-edge h."""
    twins = twins_of(mesh.quads, len(mesh.points))
    ids = 1000 + 10 * np.arange(twins.size)[:, None] + np.arange(n - 1)
    return refine_quads(mesh, twins, np.where(twins[:, None] < 0, ids, -1))


@pytest.mark.parametrize("n", [2, 3])
def test_split_of_quads_adds_no_irregular_node(n: int) -> None:
    mesh = quads_of(finer_graph(2), 2.0, 4)
    fine = in_parts(mesh, n)
    assert_valid_faces(fine)
    twins = naive.twins(mesh.quads)
    n_edges = np.count_nonzero(twins >= 0) // 2 + np.count_nonzero(twins == -1)
    assert len(fine.points) == len(mesh.points) + (n - 1) * n_edges + (n - 1) ** 2 * len(mesh.quads)
    assert len(fine.quads) == n**2 * len(mesh.quads)
    assert np.allclose(
        naive.areas(fine.points, fine.quads).reshape(-1, n**2).sum(axis=1), naive.areas(mesh.points, mesh.quads)
    )
    assert np.array_equal(fine.face, np.repeat(mesh.face, n**2))
    assert irregularity(fine) == irregularity(mesh) > 0


@pytest.mark.parametrize("n", [2, 3])
def test_quads_lie_row_by_row_in_the_old_one(n: int) -> None:
    mesh = grid(3, 2, 0.2)
    fine = in_parts(mesh, n)
    a, b, c, d = np.moveaxis(mesh.points[mesh.quads], 1, 0)
    for j in range(n):
        for i in range(n):
            corner = fine.points[fine.quads[n * j + i :: n**2]]
            for k, (x, y) in enumerate(((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))):
                s, t = x / n, y / n
                expected = (1 - t) * ((1 - s) * a + s * b) + t * ((1 - s) * d + s * c)
                assert np.allclose(corner[:, k], expected)


@pytest.mark.parametrize("n", [2, 3])
def test_new_rim_points_are_those_named_on_the_way_along_each_half_edge(n: int) -> None:
    mesh = grid(3, 2)
    fine = in_parts(mesh, n)
    twins = naive.twins(mesh.quads)
    named = np.flatnonzero(fine.origin >= 1000)
    assert len(named) == (n - 1) * np.count_nonzero(twins < 0)
    for p in named:
        h, i = divmod(int(fine.origin[p]) - 1000, 10)
        u, w = mesh.points[mesh.quads[h // 4, h % 4]], mesh.points[mesh.quads[h // 4, (h + 1) % 4]]
        assert np.allclose(fine.points[p], u + (i + 1) / n * (w - u))
    assert (fine.wanted == np.where(fine.origin < 1000, np.where(fine.origin < 0, 4, fine.wanted), 2)).all()
    assert np.array_equal(valences(fine), fine.wanted)


@pytest.mark.parametrize("n", [2, 3])
def test_points_on_the_way_are_looked_up_in_the_graph(n: int) -> None:
    graph = finer_graph(4, n)
    segments = coarse_segments(graph, np.ones(graph.n_chains, bool), n)
    none = np.zeros(len(segments.tail), np.int64)
    table = constraint_table(len(graph.points), segments.tail, segments.head, none, none, segments.middle)
    coarse = quads_of(graph, 2.0, 2 * n)
    twins = twins_of(coarse.quads, len(coarse.points))
    between = points_between(coarse.quads, twins, coarse.origin, table, n)
    assert np.array_equal(between >= 0, np.repeat(twins[:, None] < 0, n - 1, axis=1))
    assert_valid_faces(refine_quads(coarse, twins, between), graph)
