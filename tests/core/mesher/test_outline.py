"""Coarse outlines of faces: every second, fourth or sixth point, and which faces stand the coarsest."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from imgquad_core.chains import halved, refined, with_chains_of, without_unused_points
from imgquad_core.mesher.outline import chains_of, coarse_segments, outline, wide_faces, with_short_chains_halved
from imgquad_core.model import VOID, BoundaryGraph, PointKind
from support.faces import graph_of, polygon_graph, voronoi_graph

SQUARE = [[0, 0], [32, 0], [32, 32], [0, 32]]


def everything(graph: BoundaryGraph) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    return np.ones(graph.n_chains, bool)


def split_square(edges: int, bulge: float = 0.0) -> BoundaryGraph:
    """Two halves of a square; the chain between them goes up from (16, 0) to (16, 32), bulging to the right."""
    s = np.arange(edges + 1)[:, None] / edges
    middle = np.hstack([16 + bulge * np.sin(np.pi * s), 32 * s])
    right, left = [[16, 0], [32, 0], [32, 32], [16, 32]], [[16, 32], [0, 32], [0, 0], [16, 0]]
    ways = [np.vstack([np.linspace(a, b, 4, endpoint=False) for a, b in pairwise(way)]) for way in (right, left)]
    points = np.vstack([*ways, middle[1:-1]])
    chains = [[*range(13)], [*range(12, 24), 0], [0, *range(24, 23 + edges), 12]]
    return graph_of(points, chains, [(1, VOID), (0, VOID), (0, 1)], (32, 32))


@pytest.mark.parametrize("stride", [2, 3, 4, 6])
def test_segments_span_stride_edges_and_know_their_middle(stride: int) -> None:
    graph = polygon_graph(SQUARE, [12, 24, 12, 36], (32, 32))
    segments = coarse_segments(graph, everything(graph), stride)
    expected = []
    for c in range(graph.n_chains):
        ids = graph.chain(c).tolist()
        for i in range(0, len(ids) - stride, stride):
            middle = [ids[i + stride // 2], ids[i + (stride + 1) // 2]]
            expected.append((ids[i], ids[i + stride], middle, c))
    assert list(zip(*(a.tolist() for a in segments), strict=True)) == expected
    assert len(expected) == len(graph.segments) // stride


def test_segments_of_some_chains_only() -> None:
    graph = voronoi_graph(64, 3, 4.0, 0)
    chosen = everything(graph)
    chosen[3:] = False
    segments = coarse_segments(graph, chosen, 2)
    assert np.unique(segments.chain).tolist() == [0, 1, 2]
    none = coarse_segments(graph, ~everything(graph), 2)
    assert len(none.tail) == 0


def test_chains_of_a_face_are_those_that_name_it() -> None:
    graph = voronoi_graph(64, 3, 4.0, 1)
    for f in range(9):
        flags = np.arange(9) == f
        assert np.array_equal(chains_of(graph, flags), (graph.chain_regions == f).any(axis=1))
    assert chains_of(graph, np.ones(9, bool)).all()
    assert not chains_of(graph, np.zeros(9, bool)).any()


def test_outline_keeps_ids_and_names_other_faces_void() -> None:
    graph = voronoi_graph(64, 3, 4.0, 2)
    chosen = np.arange(9) == 4
    flat = outline(graph, chosen, 2)
    assert np.array_equal(flat.points, graph.points[flat.ids])
    assert (np.diff(flat.ids) > 0).all()
    chains = np.flatnonzero(chains_of(graph, chosen))
    even = np.unique(np.concatenate([graph.chain(c)[::2] for c in chains]))
    assert np.array_equal(flat.ids, even)
    table = flat.constraints
    assert set(table.region.tolist()) == {4, VOID}
    assert np.count_nonzero(table.region == 4) == len(flat.segments)
    for tail, head in flat.segments:
        at = np.arange(table.offsets[tail], table.offsets[tail + 1])
        assert head in table.head[at]


def test_wide_face_needs_width_and_multiples_of_four() -> None:
    wide = polygon_graph(SQUARE, [16] * 4, (32, 32))
    assert wide_faces(wide, 4, 3.0).tolist() == [True]
    assert wide_faces(wide, 4, 30.0).tolist() == [False]
    assert wide_faces(polygon_graph(SQUARE, [16, 16, 16, 14], (32, 32)), 4, 3.0).tolist() == [False]
    assert wide_faces(polygon_graph(SQUARE, [2] * 4, (32, 32)), 4, 0.1).tolist() == [False]  # two segments only
    narrow = polygon_graph([[0, 0], [32, 0], [32, 2], [0, 2]], [32, 4, 32, 4], (2, 32))
    assert wide_faces(narrow, 4, 3.0).tolist() == [False]


@pytest.mark.parametrize(("edges", "expected"), [(16, True), (14, False)])
def test_chain_of_other_lengths_bars_both_faces_beside_it(edges: int, expected: bool) -> None:
    assert wide_faces(split_square(edges), 4, 1.0).tolist() == [expected] * 2


def test_very_wide_face_needs_multiples_of_six() -> None:
    assert wide_faces(polygon_graph(SQUARE, [36] * 4, (32, 32)), 6, 6.0).tolist() == [True]
    assert wide_faces(polygon_graph(SQUARE, [36, 36, 36, 40], (32, 32)), 6, 6.0).tolist() == [False]
    assert wide_faces(polygon_graph(SQUARE, [30] * 4, (32, 32)), 6, 6.0).tolist() == [False]


@pytest.mark.parametrize(("at", "expected"), [(12, True), (14, False)])
def test_corner_within_a_segment_bars_its_face(at: int, expected: bool) -> None:
    graph = polygon_graph(SQUARE, [36] * 4, (32, 32))
    kind = graph.point_kind.copy()
    kind[graph.chain(0)[at]] = PointKind.CORNER
    assert wide_faces(replace(graph, point_kind=kind), 4, 3.0).tolist() == [expected]


def test_chords_that_would_cross_bar_their_faces() -> None:
    # an island within the bulge of the chain: on the other side of the chain's chords
    bulging = split_square(8, 6.0)
    assert wide_faces(bulging, 4, 0.5).tolist() == [True, True]
    island = np.array(
        [[21.0, 16], [20.6, 16.7], [20, 17], [19.4, 16.7], [19, 16], [19.4, 15.3], [20, 15], [20.6, 15.3]]
    )
    n = len(bulging.points)
    points = np.vstack([bulging.points, island + np.array([0.9, -0.7])])
    chains = [bulging.chain(c).tolist() for c in range(3)] + [[*range(n, n + 8), n]]
    regions = [*map(tuple, bulging.chain_regions.tolist()), (2, 0)]
    graph = graph_of(points, chains, regions, (32, 32))
    assert not wide_faces(graph, 4, 0.5)[:2].any()


def test_halved_chains_gain_mid_points_behind_all_others() -> None:
    graph = voronoi_graph(64, 3, 4.0, 3)
    chosen = everything(graph)
    chosen[::2] = False
    fine = halved(graph, chosen)
    n = len(graph.points)
    assert fine.points[:n].tobytes() == graph.points.tobytes()
    assert np.array_equal(fine.chain_regions, graph.chain_regions)
    for c in range(graph.n_chains):
        old, new = graph.chain(c), fine.chain(c)
        if not chosen[c]:
            assert np.array_equal(old, new)
            continue
        assert np.array_equal(new[::2], old)
        assert (new[1::2] >= n).all()
        assert np.allclose(fine.points[new[1::2]], 0.5 * (graph.points[old[:-1]] + graph.points[old[1:]]))
    added = fine.points[n:]
    on_frame = ((added == 0) | (added == 64)).any(axis=1)
    assert np.array_equal(fine.point_kind[n:], np.where(on_frame, PointKind.FRAME, PointKind.FREE))
    assert on_frame.any()
    assert len(np.unique(fine.chain_points)) == len(fine.points)


def beside_a_strip(height: float, edges: int) -> BoundaryGraph:
    """A square, and on its right a strip of two materials that meet at y = height."""
    h = height
    ways = [
        ([[32, h], [32, 32]], 16, (0, 1)),
        ([[32, 0], [32, h]], edges, (0, 2)),
        ([[32, 32], [0, 32], [0, 0]], 16, (0, VOID)),
        ([[0, 0], [32, 0]], 16, (0, VOID)),
        ([[32, h], [34, h]], 2, (1, 2)),
        ([[34, h], [34, 32], [32, 32]], 8, (1, VOID)),
        ([[32, 0], [34, 0], [34, h]], 2, (2, VOID)),
    ]
    points: dict[tuple[float, float], int] = {}
    chains = []
    for way, n, _ in ways:
        line = [p for a, b in pairwise(way) for p in np.linspace(a, b, n, endpoint=False).tolist()] + [way[-1]]
        chains.append([points.setdefault((float(x), float(y)), len(points)) for x, y in line])
    return graph_of([*points], chains, [sides for *_, sides in ways], (32, 34))


def test_short_chains_are_halved_for_the_wide_face_beside_them_unless_edges_get_tiny() -> None:
    for height, edges, expected in ((3.0, 2, 4), (1.0, 2, 2), (3.0, 6, 6)):
        graph = beside_a_strip(height, edges)
        finer = np.diff(with_short_chains_halved(graph, 3.0).chain_offsets) - 1
        assert finer.tolist() == [16, expected, 32, 16, 2, 16, 4]


def test_halving_nothing_changes_nothing() -> None:
    graph = voronoi_graph(64, 3, 4.0, 3)
    same = halved(graph, ~everything(graph))
    assert same.points.tobytes() == graph.points.tobytes()
    assert np.array_equal(same.chain_points, graph.chain_points)


@pytest.mark.parametrize(
    ("edges", "place", "reach", "split"),
    [
        (10, 3, 0, [2, 3]),  # the segment over edges 2 and 3
        (10, 3, 1, [0, 1, 2, 3, 4, 5]),
        (10, 9, 1, [6, 7, 8, 9]),  # not past the end of the chain
        (12, 5, 0, [4, 5, 6, 7]),  # a multiple of four stays one
        (12, 1, 1, [*range(8)]),
        (10, 4, 0, [2, 3, 4, 5]),  # between two segments
        (12, 4, 0, [*range(8)]),
    ],
)
def test_refined_points_get_even_places(edges: int, place: int, reach: int, split: list[int]) -> None:
    graph = split_square(edges, 3.0)
    fine = refined(graph, graph.chain(2)[[place]], reach)
    old, new = graph.chain(2).tolist(), fine.chain(2).tolist()
    assert new.index(old[place]) % 2 == 0
    assert len(new) - len(old) == len(split)
    assert new == with_new(old, split, len(graph.points))
    assert all(fine.chain(c).tolist() == graph.chain(c).tolist() for c in range(2))
    for k, v in zip(split, range(len(graph.points), len(fine.points)), strict=True):
        assert np.allclose(fine.points[v], (graph.points[old[k]] + graph.points[old[k + 1]]) / 2)


def test_refining_at_a_junction_halves_the_ends_of_all_chains_there() -> None:
    graph = split_square(10)
    fine = refined(graph, np.array([0]), 0)
    assert [len(fine.chain(c)) - len(graph.chain(c)) for c in range(3)] == [4, 4, 2]
    assert all((np.diff(fine.chain_offsets) - 1) % 2 == 0)


def with_new(ids: list[int], split: list[int], first_new: int) -> list[int]:
    """Put a new id behind the first point of each split edge."""
    out = []
    for k, v in enumerate(ids):
        out += [v, first_new + split.index(k)] if k in split else [v]
    return out


def test_chains_of_a_finer_graph_replace_some_and_points_that_none_has_go() -> None:
    graph = voronoi_graph(64, 3, 4.0, 1)
    finer = halved(graph, everything(graph))
    some = np.arange(graph.n_chains) % 3 == 0
    mixed = with_chains_of(graph, finer, some)
    for c in range(graph.n_chains):
        assert mixed.chain(c).tolist() == (finer if some[c] else graph).chain(c).tolist()
    lean, place = without_unused_points(mixed)
    assert len(lean.points) == len(np.unique(lean.chain_points)) < len(mixed.points)
    assert np.array_equal(lean.points[lean.chain_points], mixed.points[mixed.chain_points])
    assert np.array_equal(place[mixed.chain_points], lean.chain_points)
    assert without_unused_points(finer)[0].points.tobytes() == finer.points.tobytes()
