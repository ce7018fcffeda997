"""Nodes drawn back: only as far, and only where, they are in conflict."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.arrays import Floats
from imgquad_core.boundary.curves import curves_of
from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.boundary.nodes import Nodes, number_nodes, place_nodes, points_at
from imgquad_core.boundary.oblong_pixels import stretch
from imgquad_core.boundary.options import SmoothingOptions
from imgquad_core.boundary.smoothing import smooth_boundaries
from imgquad_core.boundary.withdrawal import Draft, Patience, _least_segments, _with_neighbours, place_freely
from imgquad_core.geometry.conflicts import UNITS, snapped
from imgquad_core.measures.quality import scaled_jacobian
from imgquad_core.options import MeshOptions
from imgquad_core.pipeline import run
from support.labels import label_image, labels_of_kind, voronoi


def draft(push: float = 0.0, size: float = 3.0) -> Draft:
    """Three boundaries across a picture, 6 and 20 px apart; the first one's middle pushed towards the second."""
    labels = np.searchsorted([20, 26, 46], np.arange(60), side="right").astype(np.int32)
    graph = extract_boundaries(label_image(np.tile(labels, (40, 1))))
    curves, ends = curves_of(graph)
    smooth = curves.raw.copy()
    first = smooth[:, 0] == 20
    smooth[first, 0] += push * np.sin(np.pi * smooth[first, 1] / 40) ** 2
    n = len(smooth)
    return Draft(curves, ends, smooth, ends.place, np.zeros(n, bool), np.full(n, size), 1.2, False, graph.shape)


def test_nodes_without_conflicts_stay_where_they_were_placed() -> None:
    d = draft()
    nodes, gently = place_freely(d, d.limit)
    assert gently
    expected = points_at(d.smooth, nodes.placed.at)
    assert nodes.points[nodes.chain_points] == pytest.approx(expected, abs=1 / UNITS)
    assert np.array_equal(nodes.points, snapped(nodes.points))


def of_chain(nodes: Nodes, c: int) -> Floats:
    return nodes.points[nodes.chain_points[nodes.placed.offsets[c] : nodes.placed.offsets[c + 1]]]


def test_a_chain_pushed_over_its_neighbour_comes_back_and_far_ones_stay() -> None:
    calm, pushed = draft(), draft(12.0)
    before, after = (place_freely(d, d.limit)[0] for d in (calm, pushed))
    same = [np.array_equal(of_chain(before, c), of_chain(after, c)) for c in range(len(calm.curves.ends))]
    assert 0 < np.sum(same) < len(same)
    off = np.hypot(*(after.points[after.chain_points] - points_at(pushed.smooth, after.placed.at)).T)
    assert off.max() > 1.0


def test_with_no_patience_chains_have_the_points_of_the_pixels() -> None:
    d = draft(12.0)
    nodes, gently = place_freely(d, d.limit, Patience(closer=0, gentle=0, curved=0, most=0))
    assert not gently
    at = nodes.placed.at
    assert at * 2 == pytest.approx(np.round(at * 2), abs=1e-9)
    assert nodes.points[nodes.chain_points] == pytest.approx(points_at(d.curves.raw, at), abs=1 / UNITS)


@pytest.mark.parametrize(
    ("shape", "n_colors", "seed", "options"),
    [
        ((24, 24), 8, 9100929, MeshOptions(size=2.5, step=1.0, join=8.0, tolerance=7.0)),
        ((22, 24), 5, 9100629, MeshOptions(size=1.0, tolerance=4.0, keep=(4,))),
    ],
)
def test_areas_make_no_sharp_sector_where_others_are_sharp_already(
    shape: tuple[int, int], n_colors: int, seed: int, options: MeshOptions
) -> None:
    mesh = run(label_image(labels_of_kind("void", *shape, n_colors, seed)), options).mesh
    assert scaled_jacobian(mesh.points, mesh.quads).min() > 0.45  # 0.15 and 0.27 where areas mind crossings only


def test_faces_keep_three_coarse_segments() -> None:
    #  0, 1: two chains between the same nodes; 2: alone; 3: a loop at a node; 4: a closed chain
    ends = np.array([[0, 1], [1, 0], [1, 2], [2, 2], [-1, -1]])
    assert _least_segments(ends).tolist() == [2, 2, 1, 3, 4]


def test_neighbours_are_the_chains_that_meet_there() -> None:
    ends = np.array([[0, 1], [1, 2], [2, 3], [-1, -1], [3, 0]])
    for chosen in range(5):
        flags = np.arange(5) == chosen
        mine = set(ends[chosen].tolist()) - {-1}
        expected = [k == chosen or bool(mine & set(pair)) for k, pair in enumerate(ends.tolist())]
        assert _with_neighbours(ends, flags, 4).tolist() == expected


@pytest.mark.parametrize("shape", [(40, 100), (61, 50)])
def test_a_stretched_picture_has_its_corners_frame_and_areas(shape: tuple[int, int]) -> None:
    graph = extract_boundaries(label_image(voronoi(40, 50, 7, 4)))
    curves, ends = curves_of(graph)
    stretched, moved, node, smooth = stretch(curves, ends, ends.place, curves.raw, graph.shape, shape)
    share = np.array([shape[1] / 50, shape[0] / 40])
    assert np.allclose(stretched.raw, curves.raw * share)
    assert np.array_equal(node, moved.place)
    assert np.array_equal(smooth, stretched.raw)
    assert set(np.unique(stretched.raw[curves.raw[:, 0] == 50, 0])) == {float(shape[1])}
    made = smooth_boundaries(graph, SmoothingOptions(size=4.0), shape)
    assert made.shape == shape
    assert np.allclose(made.region_pixels, graph.region_pixels * share.prod(), atol=0.5)
    step = np.hypot(*(stretched.raw[1] - stretched.raw[0]))
    assert stretched.arc[1] - stretched.arc[0] == pytest.approx(step)


def test_ids_of_the_nodes_do_not_hang_on_where_they_lie() -> None:
    d = draft()
    n = len(d.curves.ends)
    placed = place_nodes(d.curves, d.limit, d.limit, d.is_corner, np.full(n, 1), np.zeros(n, bool), False)
    one = number_nodes(d.curves, len(d.node), points_at(d.smooth, placed.at), placed)
    two = number_nodes(d.curves, len(d.node), points_at(d.smooth, placed.at) + 1.0, placed)
    assert np.array_equal(one.chain_points, two.chain_points)
    assert np.array_equal(one.points + 1.0, two.points)
