"""Smoothed boundaries: valid on any picture, true to known shapes, areas kept, nodes where the mesher wants them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from skimage.draw import polygon2mask

from imgquad_core.boundary import withdrawal
from imgquad_core.boundary.areas import enclosed_areas, restore_areas
from imgquad_core.boundary.curves import curves_of, per_point
from imgquad_core.boundary.extraction import ExtractionOptions, extract_boundaries
from imgquad_core.boundary.smoothing import SmoothingOptions, smooth_boundaries
from imgquad_core.errors import InputError
from imgquad_core.geometry.corner_rule import POLICIES
from imgquad_core.model import BoundaryGraph, Chains, PointKind
from support import naive
from support.labels import any_labels, disc, half_plane, label_image, spiral, square, voronoi, wedge
from support.planar import check_meshable, check_planar

SIZES = (1.0, 2.5, 6.0)


def smoothed(labels: NDArray[np.int32], size: float, **options: object) -> BoundaryGraph:
    return smooth_boundaries(extract_boundaries(label_image(labels)), SmoothingOptions(size, **options))  # type: ignore[arg-type]


def interface(graph: BoundaryGraph) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Midpoints and lengths of all edges between two regions."""
    chain = np.repeat(np.arange(graph.n_chains), np.diff(graph.chain_offsets) - 1)
    ends = graph.points[graph.segments[(graph.chain_regions[chain] >= 0).all(axis=1)]]
    return ends.mean(axis=1), np.hypot(*(ends[:, 1] - ends[:, 0]).T)


def edge_lengths(graph: BoundaryGraph) -> NDArray[np.float64]:
    return naive.lengths(graph.points, graph.segments)


def assert_truth(off: NDArray[np.float64], length: float, true_length: float) -> None:
    assert np.sqrt((off**2).mean()) < 0.10
    assert np.abs(off).max() < 0.40
    assert length == pytest.approx(true_length, rel=0.005)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("seed", range(100, 140))
def test_any_picture_gives_planar_polylines(seed: int, size: float) -> None:
    labels = any_labels(seed)
    graph = smoothed(labels, size)
    check_meshable(graph)
    assert (enclosed_areas(graph) > 0).all()


@pytest.mark.parametrize("policy", POLICIES)
def test_any_policy_gives_planar_polylines(policy: str) -> None:
    labels = np.random.default_rng(3).integers(0, 3, (20, 20))
    check_meshable(smooth_boundaries(extract_boundaries(label_image(labels), ExtractionOptions(policy))))


@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), turns=st.integers(0, 3), mirror=st.booleans(), shift=st.integers(0, 7))
def test_turned_mirrored_relabelled_pictures_give_planar_polylines(
    seed: int, turns: int, mirror: bool, shift: int
) -> None:
    labels = np.rot90(any_labels(seed), turns)
    labels = np.where(labels < 0, labels, (labels + shift) % 8)
    check_meshable(smoothed(labels[::-1] if mirror else labels, 2.5))


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize(
    "labels",
    [np.random.default_rng(1).integers(0, 8, (64, 64)), np.indices((40, 40)).sum(axis=0) % 2, spiral(41)],
    ids=["noise", "checkerboard", "spiral"],
)
def test_hard_pictures_give_planar_polylines(labels: NDArray[np.int32], size: float) -> None:
    check_meshable(smoothed(labels, size))


def test_a_window_with_two_samples_leaves_its_point() -> None:
    # beside the corner of colour 2 a quadratic would be fitted to two mid-sides
    labels = np.ones((7, 6), np.int32)
    labels[:3, :3] = labels[3, :4] = 0
    labels[0, :2] = labels[1, 0] = 2
    check_meshable(smoothed(labels, 6.0))


@pytest.mark.parametrize("size", [0.4, 3.0])
@pytest.mark.parametrize("rounds", [14, 0])
def test_hopeless_curves_fall_back_to_the_pixel_boundary(size: float, rounds: int) -> None:
    patience = withdrawal.Patience(gentle=min(rounds, 8), curved=rounds, most=rounds + 6)
    raw = extract_boundaries(label_image(np.random.default_rng(8).integers(0, 3, (14, 14))))
    curves, ends = curves_of(raw)
    wild = curves.raw + np.random.default_rng(1).normal(0.0, 2.0, curves.raw.shape)
    wild = np.clip(wild, 0.0, 14.0)
    wild[per_point(curves, curves.is_frame)] = curves.raw[per_point(curves, curves.is_frame)]
    limit, nowhere = np.full(len(wild), size), np.zeros(len(wild), bool)
    draft = withdrawal.Draft(curves, ends, wild, ends.place, nowhere, limit, 1.2, False, raw.shape)
    nodes, _ = withdrawal.place_freely(draft, limit, patience)
    graph = replace(
        raw,
        points=nodes.points,
        point_kind=np.zeros(len(nodes.points), np.uint8),
        chain_offsets=nodes.placed.offsets,
        chain_points=nodes.chain_points,
    )
    check_planar(graph, 1)
    check_planar(graph, 2)


def test_the_checker_sees_a_crossing() -> None:
    graph = smoothed(disc(9.0, (12.3, 12.1), 24), 2.0)
    points = graph.points.copy()
    free = np.flatnonzero(graph.point_kind == PointKind.FREE)
    points[free[0]], points[free[5]] = points[free[5]], points[free[0]]
    with pytest.raises(AssertionError):
        check_planar(replace(graph, points=points), 1)


def test_the_checker_sees_an_island_in_the_wrong_face() -> None:
    labels = np.zeros((12, 12), int)
    labels[:, 6:] = 1
    labels[5, 2] = 2
    graph = smoothed(labels, 2.0)
    points = graph.points.copy()
    island = np.unique(graph.chain(int(np.flatnonzero((graph.chain_regions == 2).any(axis=1))[0])))
    points[island, 0] += 6
    with pytest.raises(AssertionError):
        check_planar(replace(graph, points=points), 1)


@pytest.mark.parametrize(("radius", "size"), [(9.0, 1.5), (20.0, 3.0), (32.0, 3.0), (47.5, 3.0), (95.0, 3.0)])
@pytest.mark.parametrize("seed", range(3))
def test_circles_are_true(radius: float, size: float, seed: int) -> None:
    n = int(2 * radius + 14)
    cx, cy = n / 2 + np.random.default_rng(seed).random(2) - 0.5
    graph = smoothed(disc(radius, (cx, cy), n), size)
    middle, length = interface(graph)
    assert_truth(np.hypot(middle[:, 0] - cx, middle[:, 1] - cy) - radius, length.sum(), 2 * np.pi * radius)
    assert not ((graph.point_kind == PointKind.CORNER)[4:]).any()


@pytest.mark.parametrize("degrees", [2, 5, 7, 11, 23, 37, 52, 67, 75, 88, 97, 120, 142, 150, 178])
def test_straight_edges_are_true(degrees: float) -> None:
    n = 128
    through = n / 2 + np.random.default_rng(degrees).random(2) - 0.5
    t = np.radians(degrees)
    middle, length = interface(smoothed(half_plane(degrees, (through[0], through[1]), n), 3.0))
    steps = [(o - c) / u for u, c in ((np.cos(t), through[0]), (np.sin(t), through[1])) for o in (0, n)]
    true_length = sorted(steps)[2] - sorted(steps)[1]
    assert_truth((middle - through) @ [-np.sin(t), np.cos(t)], length.sum(), true_length)


@pytest.mark.parametrize("degrees", [0, 10, 30, 45, 60, 85])
def test_a_square_keeps_its_corners(degrees: float) -> None:
    centre = 35 + np.random.default_rng(degrees).random(2) - 0.5
    labels, corners = square(36.0, degrees, (centre[0], centre[1]), 70)
    graph = smoothed(labels, 3.0)
    sharp = graph.points[graph.point_kind == PointKind.CORNER]
    for corner in corners:
        assert np.hypot(*(sharp - corner).T).min() < 0.75
    chain = graph.chain(int(np.flatnonzero((graph.chain_regions >= 0).all(axis=1))[0]))
    places = np.flatnonzero(graph.point_kind[chain] == PointKind.CORNER)
    assert len(places) == 5
    assert (places % 4 == 0).all()


@pytest.mark.parametrize("degrees", [40, 45, 50, 60])
@pytest.mark.parametrize("seed", range(8))
def test_a_wedge_keeps_its_tip_and_its_angle(degrees: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn, tip = rng.uniform(0, 360), 55 + rng.random(2)
    graph = smoothed(wedge(degrees, turn, tip, 45.0, 110), 3.0)
    off = np.hypot(*(graph.points - tip).T)
    v = int(off.argmin())
    assert graph.point_kind[v] == PointKind.CORNER
    assert off[v] < 0.8
    ends = graph.segments[(graph.segments == v).any(axis=1)]
    a, b = graph.points[ends[ends != v]] - graph.points[v]
    angle = np.degrees(np.arccos(a @ b / np.hypot(*a) / np.hypot(*b)))
    assert angle == pytest.approx(degrees, abs=4.0)


def test_areas_are_given_back_without_turning_the_sides_of_corners() -> None:
    corners = np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]])
    ring, turn = np.array([0, 1, 2, 3, 0]), np.array([0, 5])
    sides, area = np.array([[0, -1]]), np.array([100.0])
    moved, _ = restore_areas(corners, Chains(turn, ring, sides), area, np.full(5, 2.0), np.zeros(1))
    assert np.allclose(moved, 1.25 * (corners - 4.0) + 4.0, atol=1e-3)


def test_a_corner_near_an_end_keeps_no_face_from_the_coarse_level() -> None:
    labels = np.zeros((60, 80), int)
    labels[7:, 40:] = 1
    labels[:7, 60:] = 1  # the boundary turns 7 px below the border, less than two edges of 4
    graph = smoothed(labels, 4.0)
    chain = graph.chain(int(np.flatnonzero((graph.chain_regions >= 0).all(axis=1))[0]))
    places = np.flatnonzero(graph.point_kind[chain[1:-1]] == PointKind.CORNER) + 1
    assert len(places) == 2
    assert (places % 4 == 0).all()


@pytest.mark.parametrize("size", [2.0, 5.0])
def test_regions_of_fifty_pixels_keep_their_areas(size: float) -> None:
    graph = smoothed(voronoi(200, 200, 60, 5), size)
    large = graph.region_pixels >= 50
    error = np.abs(enclosed_areas(graph) - graph.region_pixels) / graph.region_pixels
    assert large.sum() > 40
    assert error[large].max() < 1e-3


@pytest.mark.parametrize("bend", [((52, 88), (60, 78)), ((52, 86), (62, 80))])
def test_a_tolerance_smooths_bends_to_and_fro(bend: tuple[tuple[int, int], ...]) -> None:
    #  ________        two tips of 40 to 60 degrees, of one chain
    #         /_____
    outline = [(52, -5), *bend, (bend[1][0], 165), (130, 165), (130, -5)]  # row, column
    labels = polygon2mask((120, 160), outline).astype(np.int32)
    graph = smooth_boundaries(extract_boundaries(label_image(labels)), SmoothingOptions(16.0, tolerance=16.0))
    check_planar(graph, 1)
    assert naive.lengths(graph.points, graph.segments).min() > 8.0


def test_no_point_moves_farther_than_allowed() -> None:
    labels = voronoi(48, 48, 16, 2)
    for limit in (0.0, 0.3, 1.0):
        graph = smoothed(labels, 2.0, max_shift=limit)
        raw = extract_boundaries(label_image(labels))
        steps = np.linspace(0, 1, 11)[:, None, None]
        ends = raw.points[raw.segments]
        dense = (ends[:, 0] + steps * (ends[:, 1] - ends[:, 0])).reshape(-1, 2)
        middle = graph.points[graph.point_kind == PointKind.FREE]
        apart = np.sqrt(((middle[:, None] - dense) ** 2).sum(axis=2).min(axis=1))
        assert apart.max() <= limit + 0.08  # a node between two dense points of a bend, and the points tested


def test_frame_points_lie_exactly_on_the_border() -> None:
    graph = smoothed(voronoi(61, 43, 20, 7), 2.0)
    x, y = graph.points[graph.point_kind == PointKind.FRAME].T
    assert ((x == 0) | (x == 43) | (y == 0) | (y == 61)).all()
    corners = {tuple(xy) for xy in graph.points[graph.point_kind == PointKind.CORNER]}
    assert {(0, 0), (43, 0), (0, 61), (43, 61)} <= corners


def test_edges_have_the_asked_size_and_neighbours_the_asked_ratio() -> None:
    graph = smoothed(disc(60.0, (70.2, 69.7), 140), 3.0)
    assert edge_lengths(graph).mean() == pytest.approx(3.0, rel=0.08)
    for c in range(graph.n_chains):
        length = np.hypot(*np.diff(graph.points[graph.chain(c)], axis=0).T)
        assert (np.maximum(length[1:], length[:-1]) / np.minimum(length[1:], length[:-1])).max() <= 1.2


def test_long_chains_have_counts_divisible_by_four() -> None:
    graph = smoothed(voronoi(300, 300, 12, 4), 3.0)
    counts = np.diff(graph.chain_offsets) - 1
    assert (counts[counts > 6] % 4 == 0).all()
    assert (counts > 6).sum() > 20


def test_a_material_and_the_boundary_have_sizes_of_their_own() -> None:
    labels = disc(30.0, (64.2, 63.9), 128)
    fine = smoothed(labels, 8.0, material_sizes={1: 2.0})
    assert interface(fine)[1].mean() == pytest.approx(2.0, rel=0.1)
    assert edge_lengths(fine).max() > 5
    assert interface(smoothed(labels, 8.0, boundary_size=3.0))[1].mean() == pytest.approx(3.0, rel=0.1)


@pytest.mark.parametrize("radius", [10.0, 31.5, 33.0, 35.2, 37.0, 60.0])
def test_very_long_pieces_get_a_multiple_of_twelve_edges_if_asked(radius: float) -> None:
    labels = disc(radius, (64.2, 63.9), 128)
    free, length = (interface(smoothed(labels, 3.0, edge_multiple=asked))[1] for asked in (4, 12))
    if radius == 10.0:
        assert np.array_equal(free, length)
    else:
        assert len(length) % 12 == 0
        assert len(length) == pytest.approx(len(free), rel=0.1)
        assert length.max() < 1.25 * length.min()


def test_a_thin_line_gets_edges_of_its_width() -> None:
    labels = np.zeros((60, 60), int)
    labels[30] = 1
    length = interface(smoothed(labels, 6.0))[1]
    assert 0.6 < length.mean() < 1.6


def test_a_size_beyond_the_picture_still_gives_a_graph() -> None:
    check_meshable(smoothed(disc(8.0, (10.0, 10.0), 20), 1000.0))


def test_half_pixel_edges() -> None:
    graph = smoothed(disc(5.0, (8.1, 8.2), 16), 0.5)
    check_meshable(graph)
    assert edge_lengths(graph).mean() == pytest.approx(0.5, rel=0.15)


def test_the_same_picture_gives_the_same_bytes() -> None:
    labels = voronoi(60, 60, 20, 9)
    assert smoothed(labels, 2.0).points.tobytes() == smoothed(labels, 2.0).points.tobytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"size": 0.0}, "size is 0.0"),
        ({"size": float("nan")}, "size is nan"),
        ({"material_sizes": {3: -1.0}}, "size of material 3 is -1.0"),
        ({"boundary_size": -2.0}, "boundary_size is -2.0"),
        ({"growth": 0.9}, "growth is 0.9"),
        ({"edge_ratio": 1.0}, "edge_ratio is 1.0"),
        ({"max_shift": -1.0}, "max_shift is -1.0"),
    ],
)
def test_bad_options_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        SmoothingOptions(**options)  # type: ignore[arg-type]
