"""From boundaries to quads: valid, sized as told, every effort, the same bytes each time."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from imgquad_core.cleanup.faces import faces_only
from imgquad_core.cleanup.options import Portions
from imgquad_core.errors import InputError, TopologyError
from imgquad_core.measures.quality import quality_report
from imgquad_core.mesher import strides
from imgquad_core.mesher.efforts import EFFORTS, Tuning
from imgquad_core.mesher.meshing import mesh_boundaries
from imgquad_core.mesher.options import MeshingOptions
from imgquad_core.model import VOID, BoundaryGraph, PointKind, QuadMesh
from imgquad_core.options import MeshOptions
from imgquad_core.pipeline import run
from support import naive
from support.faces import Points, graph_of, voronoi_graph
from support.invariants import assert_valid_mesh
from support.labels import disc, label_image, voronoi
from support.meshes import boundaries, irregular_share, meshed

ARRAYS = ("points", "point_kind", "quads", "quad_region", "chain_offsets", "chain_points", "chain_regions")


def same(one: QuadMesh, two: QuadMesh) -> bool:
    return all(getattr(one, name).tobytes() == getattr(two, name).tobytes() for name in ARRAYS)


@pytest.mark.parametrize("effort", EFFORTS)
@pytest.mark.parametrize("size", [1.5, 4.0])
def test_grains_give_a_valid_mesh_with_every_effort(effort: str, size: float) -> None:
    mesh = meshed(voronoi(80, 60, 7, 4), size, effort=effort)
    quality = naive.corner_sines(mesh.points, mesh.quads).min(axis=1)
    assert quality.min() > 0.2
    assert quality.mean() > 0.9


def test_more_effort_leaves_fewer_irregular_nodes() -> None:
    graph = voronoi_graph(128, 3, 2.0, 0)
    share = {e: irregular_share(mesh_boundaries(graph, MeshingOptions(size=2.0, effort=e))) for e in EFFORTS}
    assert share["best"] < share["normal"] < share["fast"] < 0.05


@pytest.mark.parametrize("effort", EFFORTS)
@pytest.mark.parametrize("seed", range(2))
def test_boundary_points_keep_their_ids_and_only_those_inside_chains_slide(seed: int, effort: str) -> None:
    graph = voronoi_graph(64, 3, 2.0, seed, bend=0.03)
    mesh = mesh_boundaries(graph, MeshingOptions(size=2.0, effort=effort))
    n = len(graph.points)
    assert np.array_equal(mesh.point_kind[:n], graph.point_kind)
    assert np.array_equal(mesh.chain_regions, graph.chain_regions)
    assert np.array_equal(mesh.region_label, graph.region_label)
    stays = np.isin(graph.point_kind, [PointKind.JUNCTION, PointKind.CORNER])
    assert mesh.points[:n][stays].tobytes() == graph.points[stays].tobytes()
    pairs = np.sort(np.stack([mesh.quads.ravel(), np.roll(mesh.quads, -1, axis=1).ravel()], axis=1), axis=1)
    assert set(map(tuple, np.sort(mesh.constraints, axis=1).tolist())) <= set(map(tuple, pairs.tolist()))
    for c in range(graph.n_chains):
        old = graph.chain(c)
        new = mesh.chain_points[mesh.chain_offsets[c] : mesh.chain_offsets[c + 1]]
        assert np.array_equal(new[new < n], old)
        assert len(new) == len(old) or len(old) == 3, "a smooth chain gets no more edges, if it has more than two"
        way = np.hypot(*(mesh.points[old[1:-1]] - graph.points[old[1:-1]]).T)
        edge = np.hypot(*np.diff(graph.points[old], axis=0).T)
        assert (way <= (0.35 if effort != "fast" else 0.0) * np.maximum(edge[:-1], edge[1:])).all()


@pytest.mark.parametrize("size", [2.0, 5.0])
def test_boundary_points_are_met_however_the_boundary_bends(size: float) -> None:
    graph = boundaries(label_image(np.random.default_rng(1).integers(0, 3, (40, 40))), size)
    mesh = mesh_boundaries(graph, MeshingOptions(size=size, effort="fast"))
    assert mesh.points[: len(graph.points)].tobytes() == graph.points.tobytes()
    assert naive.worst_quality(mesh.points, mesh.quads) > 0.5


def test_every_face_has_quads_however_bad_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    def worst_there_is(points: Points, quads: Any, face: Any, worst: Points) -> None:
        worst[face] = -1.0

    graph = voronoi_graph(64, 3, 2.0, 0)
    everything = np.ones(len(graph.region_label), bool)
    monkeypatch.setattr(strides, "lower_to_worst", worst_there_is)
    for effort in EFFORTS:
        done = strides.mesh_faces(graph, everything, MeshingOptions(size=2.0, effort=effort), 6 * everything)
        faces = np.concatenate([np.unique(part.face) for part in done.parts])
        assert sorted(faces.tolist()) == list(range(len(everything)))


def test_very_wide_faces_are_split_in_nine_with_the_most_effort() -> None:
    image = label_image(disc(100, (220, 220), 440))
    graph = boundaries(image, 2.0, edge_multiple=12)
    options = MeshingOptions(size=2.0, effort="best")
    nine = mesh_boundaries(graph, options, image.materials)
    assert_valid_mesh(nine, image)
    four = mesh_boundaries(graph, replace(options, tuning=Tuning(very_wide=np.inf)), image.materials)
    ours, theirs = quality_report(nine), quality_report(four)
    assert ours.irregular < 0.8 * theirs.irregular
    assert ours.mean_sj > theirs.mean_sj - 0.003
    assert min(ours.min_sj, theirs.min_sj) > 0.7
    assert ours.n_quads == pytest.approx(theirs.n_quads, rel=0.03)


def test_boundary_nodes_on_the_frame_stay_on_it() -> None:
    mesh = mesh_boundaries(voronoi_graph(64, 3, 2.0, 0), MeshingOptions(size=2.0, effort="best"))
    frame = mesh.points[mesh.point_kind == PointKind.FRAME]
    assert len(frame) > 50
    assert ((frame == 0) | (frame == 64)).any(axis=1).all()


@pytest.mark.parametrize("seed", range(3))
def test_regions_keep_the_area_of_their_outlines(seed: int) -> None:
    graph = voronoi_graph(64, 3, 2.0, seed)
    mesh = mesh_boundaries(graph, MeshingOptions(size=2.0))
    area = naive.areas(mesh.points, mesh.quads)
    assert area.min() > 0
    swept = np.zeros(10)
    (ax, ay), (bx, by) = (graph.points[graph.segments[:, k]].T for k in (0, 1))
    beside = np.repeat(graph.chain_regions, np.diff(graph.chain_offsets) - 1, axis=0)  # VOID is the last of swept
    np.add.at(swept, beside[:, 0], 0.5 * (ax * by - ay * bx))
    np.add.at(swept, beside[:, 1], -0.5 * (ax * by - ay * bx))
    moved = mesh.points[: len(graph.points)].tobytes() != graph.points.tobytes()
    found = np.bincount(mesh.quad_region, weights=area)
    assert np.allclose(found, swept[:-1], rtol=1e-2 if moved else 1e-9)
    assert found.sum() == pytest.approx(64**2)


def test_materials_of_the_picture_are_carried() -> None:
    image = label_image(voronoi(30, 30, 5, 2) * 3 + 2)
    graph = boundaries(image, 2.5)
    assert mesh_boundaries(graph, MeshingOptions(2.5), image.materials).materials is image.materials
    made_up = mesh_boundaries(graph, MeshingOptions(2.5)).materials
    assert np.array_equal(made_up.labels, image.materials.labels)
    assert made_up.names[1] == f"material {image.materials.labels[1]}"


@pytest.mark.parametrize("size", [1.5, 4.0])
def test_void_stays_empty(size: float) -> None:
    labels = voronoi(40, 50, 6, 3)
    labels[disc(9, (20, 20), 50)[:40] == 1] = VOID
    labels[:, 44:] = VOID
    mesh = meshed(labels, size)
    centre = mesh.points[mesh.quads].mean(axis=1)
    assert centre[:, 0].max() < 44.5
    assert np.hypot(centre[:, 0] - 20, centre[:, 1] - 10 - 0).min() > 0
    area = naive.areas(mesh.points, mesh.quads).sum()
    assert area == pytest.approx(np.count_nonzero(labels != VOID), rel=0.02)


def test_no_point_is_placed_on_the_border() -> None:
    """A spoke as long as the picture is high ended there: the edge below was lost, and quads went beyond it."""
    labels = np.zeros((3, 33), np.int32)
    labels[0, :13], labels[1, :14], labels[2, :15] = 1, 1, 1
    labels[0, 3], labels[1, 21] = 0, 1
    image = label_image(labels)
    options = MeshOptions(size=6.0, material_sizes={0: 2.0}, frame_size=0.8, boundary_size=3.0, max_shift=0.0)
    assert_valid_mesh(run(image, replace(options, policy="majority")).mesh, image)


def test_parts_that_do_not_touch() -> None:
    labels = np.full((20, 30), VOID, np.int32)
    labels[2:9, 3:12], labels[11:19, 15:28], labels[1, 29] = 0, 1, 2
    assert set(meshed(labels, 2.0).quad_material.tolist()) == {0, 1, 2}


@pytest.mark.parametrize("n", [1, 2, 7, 30])
@pytest.mark.parametrize("colors", [1, 2, 5])
def test_one_row_or_column(n: int, colors: int) -> None:
    row = np.arange(n, dtype=np.int32)[None] * 7 % colors
    for labels in (row, row.T):
        assert meshed(labels, 2.0).n_quads >= n


@pytest.mark.parametrize("seed", range(2))
def test_same_bytes_each_time_and_for_any_number_of_threads(seed: int) -> None:
    small = Tuning(portions=Portions(batch=300))
    graph = boundaries(label_image(voronoi(90, 80, 14, seed)), 2.0)
    one, again, two = (mesh_boundaries(graph, MeshingOptions(2.0, threads=n, tuning=small)) for n in (1, 1, 2))
    assert one.n_quads > 5 * 300
    assert same(one, again)
    assert same(one, two)


def test_input_is_left_as_it_was() -> None:
    graph = voronoi_graph(64, 3, 2.0, 0)
    before = graph.points.tobytes(), graph.chain_points.tobytes()
    mesh_boundaries(graph, MeshingOptions(size=2.0))
    assert before == (graph.points.tobytes(), graph.chain_points.tobytes())


def way(corners: Any) -> Points:
    """Points along a polygon with 4, 8, 4 edges, without its ends."""
    sides = [np.linspace(a, b, n, endpoint=False) for (a, b), n in zip(pairwise(corners), (4, 8, 4), strict=True)]
    return np.vstack(sides)[1:]


def bands(upper: Points, lower: Points) -> BoundaryGraph:
    """Three regions on top of each other in 8 x 8 pixels, two chains of 8 edges from left to right between them."""
    x = np.arange(9.0)
    low, high = np.stack([x, lower], axis=1), np.stack([x, upper], axis=1)
    below = way([low[0], [0, 0], [8, 0], low[8]])
    above = way([high[8], [8, 8], [0, 8], high[0]])
    beside = [(low[0] + high[0]) / 2, (low[8] + high[8]) / 2]
    n = 18 + len(below)
    m = n + len(above)
    chains = [
        [*range(9)],
        [*range(9, 18)],
        [0, *range(18, n), 8],
        [17, *range(n, m), 9],
        [9, m, 0],
        [8, m + 1, 17],
    ]
    regions = [(1, 0), (2, 1), (0, VOID), (2, VOID), (1, VOID), (1, VOID)]
    return graph_of(np.vstack([low, high, below, above, beside]), chains, regions, (8, 8))


def test_bands_are_meshed() -> None:
    mesh = mesh_boundaries(bands(np.full(9, 5.0), np.full(9, 3.0)), MeshingOptions(1.0))
    assert naive.worst_quality(mesh.points, mesh.quads) > 0.5
    assert set(mesh.quad_region.tolist()) == {0, 1, 2}


def test_chains_of_an_odd_number_of_edges_are_an_error() -> None:
    square = np.array([[0, 0], [2, 0], [4, 0], [4, 4], [0, 4.0]])
    graph = graph_of(square, [[0, 1, 2, 3, 4, 0]], [(0, -1)], (4, 4))
    with pytest.raises(TopologyError, match="chain 0 has 5 edges: give each an even number"):
        mesh_boundaries(graph)


def test_a_face_without_quads_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    graph = boundaries(label_image(voronoi(40, 40, 3, 4)), 4.0)
    composed = strides.split_composed

    def forgetful(*args: Any) -> Any:
        quads = composed(*args)
        return faces_only(quads, np.arange(len(graph.region_label)) != 1)

    monkeypatch.setattr(strides, "split_composed", forgetful)
    with pytest.raises(TopologyError, match=r"the outlines of regions \[1\]"):
        mesh_boundaries(graph, MeshingOptions(size=4.0))


@pytest.mark.parametrize("effort", EFFORTS)
def test_crossing_chains_are_an_error(effort: str) -> None:
    wave = 3 * np.sin(np.linspace(0, np.pi, 9))
    with pytest.raises(TopologyError, match="cross"):
        mesh_boundaries(bands(5 - wave, 3 + wave), MeshingOptions(1.0, effort=effort))


def test_chords_that_contradict_each_other_are_refined() -> None:
    # every second point of both chains alone: the upper chain's chords run below the lower chain's top
    lower = np.array([3, 3, 3, 3.9, 4.4, 3.9, 3, 3, 3.0])
    upper = np.array([5, 5, 4, 4.55, 4.6, 4.55, 4, 5, 5.0])
    graph = bands(upper, lower)
    mesh = mesh_boundaries(graph, MeshingOptions(1.0))
    assert naive.worst_quality(mesh.points, mesh.quads) > 0
    assert naive.areas(mesh.points, mesh.quads).sum() == pytest.approx(64)


def test_island_on_the_wrong_side_of_a_chord_is_kept_on_its_own() -> None:
    s = np.linspace(0, 1, 9)
    graph = bands(np.full(9, 7.0), 3 + 2.5 * np.sin(np.pi * s) ** 8)
    n = len(graph.points)
    turn = 2 * np.pi * np.arange(6) / 6
    island = np.array([4.0, 5.05]) + 0.12 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    chains = [*(graph.chain(c).tolist() for c in range(graph.n_chains)), [*range(n, n + 6), n]]
    regions = [*map(tuple, graph.chain_regions.tolist()), (3, 0)]
    whole = graph_of(np.vstack([graph.points, island]), chains, regions, (8, 8))
    mesh = mesh_boundaries(whole, MeshingOptions(1.0))
    assert naive.worst_quality(mesh.points, mesh.quads) > 0
    assert set(mesh.quad_region.tolist()) == {0, 1, 2, 3}
    assert np.allclose(mesh.points[mesh.quads[mesh.quad_region == 3]].mean(axis=(0, 1)), [4, 5.05], atol=0.05)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"size": 0.0}, "size is 0.0; give a length"),
        ({"size": float("nan")}, "size is nan"),
        ({"size": float("inf")}, "size is inf"),
        ({"material_sizes": {3: -1.0}}, "size of material 3 is -1.0"),
        ({"growth": 1.0}, "growth is 1.0; give a ratio from 1.01"),
        ({"effort": "most"}, "effort is 'most'; give one of fast, normal, best"),
        ({"threads": -1}, "threads is -1; give a whole number of at least 0"),
    ],
)
def test_bad_options_are_named_with_their_value_and_the_remedy(options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        MeshingOptions(**options)


@pytest.mark.parametrize("threads", [1, 3])
def test_the_share_that_is_done_rises_to_one(threads: int) -> None:
    graph = boundaries(label_image(voronoi(120, 120, 30, 5)), 2.0)
    told: list[float] = []
    mesh_boundaries(
        graph, MeshingOptions(size=2.0, threads=threads, tuning=Tuning(portions=Portions(60, 200))), None, told.append
    )
    assert len(told) > 10
    assert (np.diff(told) > 0).all()
    assert told[-1] == pytest.approx(1.0)
