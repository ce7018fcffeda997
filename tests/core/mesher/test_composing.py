"""Cross field, points in layers, and triangles composed to quads."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.cleanup.faces import wanted_quads
from imgquad_core.mesher.composing import WIDE_CORNER, WORST_PAIR, compose
from imgquad_core.mesher.crossfield import CrossField, cross_field
from imgquad_core.mesher.cutting import CutMesh, FaceConflict, cut_at_constraints
from imgquad_core.mesher.frontal import EXCLUSION, frontal_points, spokes_of_rim
from imgquad_core.mesher.triangulation import Triangles, constraint_table, triangulate
from imgquad_core.model import VOID, BoundaryGraph
from support import naive
from support.faces import Ids, Points, cut_of, graph_of, grid, polygon_graph, quads_of, voronoi_graph, with_layers

SQUARE = np.array([[0.0, 0], [32, 0], [32, 32], [0, 32]])


def turned(points: Points, degrees: float) -> Points:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    out: Points = (points - 16) @ np.array([[c, s], [-s, c]]) + 16
    return out


def square_graph(degrees: float = 0.0, edges: int = 16) -> BoundaryGraph:
    return polygon_graph(turned(SQUARE, degrees), [edges] * 4, (32, 32))


def ring_graph(inner: float = 6.0, outer: float = 16.0, edges: int = 48) -> BoundaryGraph:
    """A ring between two circles."""
    turn = 2 * np.pi * np.arange(edges) / edges
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    points = np.vstack([16 + outer * circle, 16 + inner * circle])
    chains = [[*range(edges), 0], [*range(edges, 2 * edges), edges]]
    return graph_of(points, chains, [(0, VOID), (VOID, 0)], (32, 32))


def field_on(graph: BoundaryGraph, size: float, growth: float = 0.3) -> tuple[CutMesh, CrossField]:
    cut, _ = cut_of(graph, 1, 2.5 * size**2)
    return cut, cross_field(cut, np.full(len(cut.points), size), growth)


def edges_of(cut: CutMesh) -> tuple[Ids, Ids]:
    return cut.triangles.ravel(), np.roll(cut.triangles, -1, axis=1).ravel()


@pytest.mark.parametrize("degrees", [0.0, 17.0, 45.0])
def test_crosses_in_a_square_follow_its_sides(degrees: float) -> None:
    _, field = field_on(square_graph(degrees), 2.0)
    turn = np.radians(4 * degrees)
    assert np.allclose(field.cross, [np.cos(turn), np.sin(turn)], atol=1e-9)


def test_crosses_in_a_ring_follow_the_circles() -> None:
    cut, field = field_on(ring_graph(), 2.0)
    around = 4 * np.arctan2(*(cut.points - 16).T[::-1])
    along = field.cross @ np.array([1, 0]) * np.cos(around) + field.cross @ np.array([0, 1]) * np.sin(around)
    assert along[cut.on_rim].min() > 0.999
    assert along.min() > 0.9
    assert np.allclose(np.hypot(*field.cross.T), 1)


@pytest.mark.parametrize("growth", [0.1, 0.35])
def test_sizes_grow_from_the_rim_no_faster_than_told(growth: float) -> None:
    graph = polygon_graph(SQUARE, [64, 16, 8, 16], (32, 32))
    cut, field = field_on(graph, 4.0, growth)
    a, b = edges_of(cut)
    length = np.hypot(*(cut.points[a] - cut.points[b]).T)
    assert (np.abs(field.size[a] - field.size[b]) <= growth * length * (1 + 1e-6)).all()
    assert field.size.max() <= 4.0
    low = cut.points[:, 1] == 0
    assert np.allclose(field.size[low], 0.5, atol=growth * 0.5 * (1 + 1e-9))  # the corners have a longer edge too
    far = cut.points[:, 1] > 16
    assert field.size[far & ~cut.on_rim].max() > (2.0 if growth == 0.1 else 3.5)


@pytest.mark.parametrize("degrees", [0.0, 30.0])
def test_points_in_a_square_stand_on_the_grid_of_its_sides(degrees: float) -> None:
    cut, field = field_on(square_graph(degrees), 2.0)
    points = turned(frontal_points(cut, field), -degrees)
    assert len(points) == 15**2
    assert np.allclose(points / 2, np.round(points / 2), atol=1e-6)
    assert len(np.unique(np.round(points / 2), axis=0)) == 15**2


def test_layers_are_complete_one_after_the_other() -> None:
    cut, field = field_on(square_graph(), 2.0)
    depth = np.round(np.min([*frontal_points(cut, field).T, *(32 - frontal_points(cut, field)).T], axis=0) / 2)
    assert (np.diff(depth) >= 0).all()


def test_fronts_meet_in_phase() -> None:
    irregular, inner = 0, 0
    for seed in range(8):
        part = quads_of(voronoi_graph(200, 3, 2.0, seed), 2.0)
        valence = np.bincount(part.quads.ravel(), minlength=len(part.points))[part.origin < 0]
        irregular, inner = irregular + np.count_nonzero(valence != 4), inner + len(valence)
    assert irregular < 0.0335 * inner  # .0356 where spokes do not heed the points around their ends, else .0314


@pytest.mark.parametrize("seed", range(3))
def test_points_keep_apart_and_lie_inside_their_faces(seed: int) -> None:
    graph = voronoi_graph(64, 3, 4.0, seed)
    cut, field = field_on(graph, 4.0)
    points = frontal_points(cut, field)
    assert points.tobytes() == frontal_points(cut, field).tobytes()
    assert ((points > 0) & (points < 64)).all()
    full, flat = with_layers(graph, 4.0, 1)
    assert not full.on_rim[full.origin >= len(flat.ids)].any()
    face = np.zeros(len(full.points), np.int64)
    face[full.triangles] = full.face[:, None]
    smallest = field.size.min()
    for f in range(9):
        own = full.points[(face == f) & ~full.on_rim]
        others = full.points[face == f]
        gap = np.hypot(*(own[:, None] - others[None]).transpose(2, 0, 1))
        assert np.sort(gap, axis=1)[:, 1].min() >= EXCLUSION * smallest * (1 - 1e-9)
        assert len(own) >= 0.6 * np.abs(naive.areas(full.points, full.triangles)[full.face == f]).sum() / 16 - 40


def test_quads_wanted_in_a_sector_come_nearest_to_right_angles() -> None:
    degrees = np.array([5.0, 44, 90, 134, 136, 180, 224, 226, 270, 316, 360])
    assert wanted_quads(np.radians(degrees)).tolist() == [1, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4]


def test_spokes_begin_at_the_rim_edge_that_leaves() -> None:
    cut, _ = cut_of(square_graph(), 1, None)
    spokes = spokes_of_rim(cut)
    corner = {0: 0.0, 16: 90.0, 32: 180.0, 48: 270.0}
    for v, origin in enumerate(cut.origin.tolist()):
        assert spokes.quads[v] == (1 if origin in corner else 2)
        if origin in corner:
            assert np.degrees(spokes.start[v]) % 360 == pytest.approx(corner[origin])
        assert v in cut.triangles[spokes.triangle[v]]


def pairs_of(cut: CutMesh, mate: Ids) -> Ids:
    """Corners of each pair of triangles, counter-clockwise."""
    h = np.flatnonzero(mate >= 0)
    h = mate[h[mate[h] < cut.twins[mate[h]]]]
    g = cut.twins[h]
    t, k, u, j = h // 3, h % 3, g // 3, g % 3
    corners = [(t, (k + 2) % 3), (t, k), (u, (j + 2) % 3), (t, (k + 1) % 3)]
    return np.stack([cut.triangles[at] for at in corners], axis=1)


@pytest.mark.parametrize("seed", range(4))
def test_pairs_are_mutual_good_and_as_many_as_fit(seed: int) -> None:
    cut, _ = with_layers(voronoi_graph(64, 3, 2.0, seed), 2.0)
    mate = compose(cut)
    paired = np.flatnonzero(mate >= 0)
    assert np.array_equal(mate[paired] // 3, paired)
    assert (cut.twins[mate[paired]] >= 0).all()
    assert np.array_equal(mate[cut.twins[mate[paired]] // 3], cut.twins[mate[paired]])
    quads = pairs_of(cut, mate)
    assert len(quads) == len(paired) // 2
    assert naive.areas(cut.points, quads).sum() == pytest.approx(naive.areas(cut.points, cut.triangles[paired]).sum())
    sines = naive.corner_sines(cut.points, quads)
    assert sines.min() > WORST_PAIR
    wide = np.sqrt(1 - WIDE_CORNER**2)  # sine of the widest corner: a wider one has a smaller sine
    p = cut.points[quads]
    cosine = ((np.roll(p, -1, axis=1) - p) * (np.roll(p, 1, axis=1) - p)).sum(-1)
    new_corner = np.array([False, True, False, True])  # the two where both triangles have a corner
    assert not (cut.on_rim[quads] & (cosine < 0) & (sines < wide) & new_corner).any()
    assert len(paired) > 0.85 * len(mate)
    assert mate.tobytes() == compose(cut).tobytes()


def test_no_two_single_triangles_could_be_a_square() -> None:
    cut, _ = with_layers(voronoi_graph(64, 3, 2.0, 5), 2.0)
    mate = compose(cut)
    single = np.flatnonzero(mate < 0)
    assert len(single)
    for t in single:
        for h in range(3 * t, 3 * t + 3):
            if cut.twins[h] >= 0 and mate[cut.twins[h] // 3] < 0:
                both = mate.copy()
                both[:] = -1
                both[t], both[cut.twins[h] // 3] = h, cut.twins[h]
                quad = pairs_of(cut, both)
                sines = naive.corner_sines(cut.points, quad)
                assert sines.min() <= WORST_PAIR or cut.on_rim[quad].any()


def cut_of_triangles(points: Points, triangles: Ids) -> CutMesh:
    """Cut mesh of one face of just these triangles."""
    twins = naive.twins(triangles)
    rim = np.flatnonzero(twins == -1)
    tail, head = triangles.ravel()[rim], np.roll(triangles, -1, axis=1).ravel()[rim]
    nothing = np.zeros(len(rim), np.int64)
    table = constraint_table(len(points), tail, head, nothing, nothing - 1, np.stack([nothing, nothing], axis=1))
    cut = cut_at_constraints(Triangles(points, triangles, twins), table)
    assert not isinstance(cut, FaceConflict)
    return cut


def test_single_pair_single_becomes_two_pairs() -> None:
    # the square in the middle is the best pair; with it both triangles beside it stay single
    points = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1], [-0.45, 0.22], [1.45, 0.78]])
    triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [1, 5, 2]])
    cut = cut_of_triangles(points, triangles)
    quads = pairs_of(cut, compose(cut))
    assert len(quads) == 2
    expected = [{0, 1, 5, 2}, {0, 2, 3, 4}]
    assert sorted(map(sorted, cut.origin[quads].tolist())) == sorted(map(sorted, expected))


@pytest.mark.parametrize("apex", [0.3, 0.6, 0.9])
def test_wide_corner_on_the_rim_is_not_closed_by_one_quad(apex: float) -> None:
    # the corners at the ends of the common edge: 154 and 110 degrees, 130 twice, 110 and 154
    points = np.array([[0.0, 0], [1.2, 0], [apex, 1.3], [apex, -1.3]])
    cut = cut_of_triangles(points, np.array([[0, 1, 2], [1, 0, 3]]))
    assert naive.corner_sines(points, np.array([[2, 0, 3, 1]])).min() > WORST_PAIR
    assert len(pairs_of(cut, compose(cut))) == 0


def test_corner_less_wide_is_closed_by_one_quad() -> None:
    points = np.array([[0.0, 0], [2, 0], [1.0, 0.6], [1.0, -0.6]])  # 118 degrees at 2 and 3, 62 at 0 and 1
    cut = cut_of_triangles(points, np.array([[0, 1, 2], [1, 0, 3]]))
    assert len(pairs_of(cut, compose(cut))) == 1


def test_lattice_is_composed_to_its_squares() -> None:
    squares = grid(6, 5)
    graph = polygon_graph([[0, 0], [6, 0], [6, 5], [0, 5]], [6, 5, 6, 5], (5, 6))
    inner = squares.points[squares.origin < 0]
    flat = triangulate(np.vstack([graph.points, inner]), np.array(graph.segments))
    n = np.zeros(graph.segments.shape[0], np.int64)
    table = constraint_table(
        len(graph.points), graph.segments[:, 0], graph.segments[:, 1], n, n - 1, np.stack([n, n], axis=1)
    )
    cut = cut_at_constraints(flat, table)
    assert not isinstance(cut, FaceConflict)
    quads = pairs_of(cut, compose(cut))
    assert len(quads) == 30
    assert np.allclose(naive.corner_sines(cut.points, quads), 1)


def test_layers_give_few_irregular_nodes_in_a_square() -> None:
    mesh = quads_of(square_graph(), 2.0)
    assert np.allclose(naive.corner_sines(mesh.points, mesh.quads), 1)
    assert np.array_equal(np.bincount(mesh.quads.ravel()), mesh.wanted)
