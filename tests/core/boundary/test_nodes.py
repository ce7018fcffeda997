"""Nodes on curves: equal steps of ds / size, the paper's bisector move, ids, and sectors that are too sharp."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.arrays import Floats
from imgquad_core.boundary.curves import Curves, Ends, arc_lengths, curves_of
from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.boundary.nodes import (
    Placement,
    even_out,
    mark_sharp,
    number_nodes,
    on_stride,
    place_nodes,
    points_at,
)
from imgquad_core.geometry.conflicts import FREE, SHARP
from support.labels import label_image, voronoi


def drawn() -> tuple[Curves, Ends]:
    return curves_of(extract_boundaries(label_image(voronoi(40, 50, 7, 4))))


def cost_of(curves: Curves, size: Floats, c: int) -> Floats:
    """Integral of ds / size along a chain, by the trapezoid of sizes."""
    mine = slice(curves.offsets[c], curves.offsets[c + 1])
    steps = np.diff(curves.arc[mine]) / (0.5 * (size[mine][1:] + size[mine][:-1]))
    return np.concatenate([[0.0], np.cumsum(steps)])


@pytest.mark.parametrize("edge_multiple", [4, 12])
@pytest.mark.parametrize("asked", [0.7, 3.0])
def test_nodes_lie_at_equal_steps_of_cost_between_corners(asked: float, edge_multiple: int) -> None:
    curves, _ = drawn()
    n = len(curves.raw)
    limit = np.full(n, asked)
    size = asked * (0.6 + 0.4 * np.cos(curves.raw[:, 0] / 9) ** 2)
    is_corner = np.zeros(n, bool)
    inner = curves.offsets[:-1][np.diff(curves.offsets) > 40] + 20
    is_corner[inner] = True
    at_least = np.full(len(curves.ends), 3)
    placed = place_nodes(curves, size, limit, is_corner, at_least, np.zeros(len(curves.ends), bool), edge_multiple)
    for c in range(len(curves.ends)):
        first, last = curves.offsets[c], curves.offsets[c + 1] - 1
        at = placed.at[placed.offsets[c] : placed.offsets[c + 1]]
        corner = placed.is_corner[placed.offsets[c] : placed.offsets[c + 1]]
        assert (at[0], at[-1]) == (first, last)
        assert (np.diff(at) > 0).all()
        assert len(at) - 1 >= 6
        assert set(at[corner].tolist()) == set(np.flatnonzero(is_corner[first:last]) + first)
        cost = np.interp(at - first, np.arange(last - first + 1), cost_of(curves, size, c))
        for begin, end in zip(*(cuts := np.r_[0, np.flatnonzero(corner), len(at) - 1], cuts[1:]), strict=False):
            if end > begin:
                assert (end - begin) % 2 == 0
                steps = np.diff(cost[begin : end + 1])
                assert np.ptp(steps) < 1e-9 * steps.mean()
                if cost[end] - cost[begin] > 12:
                    assert steps.mean() == pytest.approx(1.0, abs=0.17)


def test_an_exact_chain_has_its_dense_points_as_coarse_nodes() -> None:
    curves, _ = drawn()
    n, exact = len(curves.raw), np.arange(len(curves.ends)) == 3
    size = np.full(n, 4.0)
    ones = np.ones(len(exact), np.int64)
    placed = place_nodes(curves, size, size, np.zeros(n, bool), ones, exact, 4)
    at = placed.at[placed.offsets[3] : placed.offsets[4]]
    assert np.array_equal(at, np.arange(2 * curves.offsets[3], 2 * curves.offsets[4] - 1) / 2)
    assert len(placed.at[placed.offsets[4] : placed.offsets[5]]) < curves.offsets[5] - curves.offsets[4]


def bisector_place(points: Floats, low: float, high: float) -> float:
    """Where the curve is equally far from its points at `low` and `high`, by trying many places."""
    tried = np.linspace(low, high, 200_001)
    a, b = points_at(points, np.array([low, high]))
    there = points_at(points, tried)
    return float(tried[np.abs(np.hypot(*(there - a).T) - np.hypot(*(there - b).T)).argmin()])


@pytest.mark.parametrize("start", [3.0, 9.3, 36.5])
def test_a_node_goes_halfway_to_the_bisector_in_each_sweep(start: float) -> None:
    t = np.linspace(0.0, 2.5, 41)
    points = np.stack([10 * np.cos(t), 7 * np.sin(t)], axis=1)
    placed = Placement(np.array([0, 3]), np.array([0.0, start, 40.0]), np.zeros(3, bool))
    goal = bisector_place(points, 0.0, 40.0)
    even_out(points, placed, np.zeros(1, bool), 1.0)
    assert placed.at[1] == pytest.approx(goal + (start - goal) / 8, abs=0.02)
    assert placed.at[[0, 2]].tolist() == [0.0, 40.0]


@pytest.mark.parametrize(("ratio", "corner", "exact"), [(100.0, False, False), (1.0, True, False), (1.0, False, True)])
def test_a_node_within_the_ratio_a_corner_and_an_exact_chain_stay(ratio: float, corner: bool, exact: bool) -> None:
    points = np.stack([np.arange(41.0), np.zeros(41)], axis=1)
    placed = Placement(np.array([0, 3]), np.array([0.0, 9.0, 40.0]), np.array([False, corner, False]))
    even_out(points, placed, np.array([exact]), ratio)
    assert placed.at.tolist() == [0.0, 9.0, 40.0]


def test_ids_of_nodes_are_shared_at_the_ends_and_the_coarse_level_has_every_second_node() -> None:
    curves, ends = drawn()
    n, none = len(curves.raw), np.zeros(len(curves.ends), bool)
    size = np.full(n, 3.0)
    placed = place_nodes(curves, size, size, np.zeros(n, bool), np.full(len(none), 4), none, False)
    nodes = number_nodes(curves, len(ends.place), points_at(curves.raw, placed.at), placed)
    assert len(np.unique(nodes.points, axis=0)) == len(nodes.points)
    assert np.array_equal(nodes.points[nodes.chain_points], points_at(curves.raw, placed.at))
    assert np.array_equal(nodes.points[: len(ends.place)], ends.place)
    for step in (1, 2):
        level = on_stride(nodes, step)
        pairs = [
            (nodes.chain_points[a:b:step][k], nodes.chain_points[a:b:step][k + 1], c)
            for c, (a, b) in enumerate(zip(placed.offsets, placed.offsets[1:], strict=False))
            for k in range((b - a - 1) // step)
        ]
        assert [(*s, c) for s, c in zip(level.segments.tolist(), level.chain.tolist(), strict=True)] == pairs
        assert np.array_equal(nodes.points[level.chain_points], points_at(curves.raw, level.at))


@pytest.mark.parametrize("degrees", [20.0, 34.0, 36.0, 80.0])
def test_sectors_sharper_than_asked_are_marked_at_nodes_and_within_chains(degrees: float) -> None:
    a = np.radians(degrees)
    #      2               chain 0: 0-1, chain 1: 0-2-3, where 3 turns back at 2 by the same angle
    #    /  \              chain 2: 0-4, away from both
    #  0-----1
    points = np.array([[0, 0], [4, 0], [4 * np.cos(a), 4 * np.sin(a)], [0, 0], [-5, -1]], float)
    back = points[0] - points[2]
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    points[3] = points[2] + turn @ back * 0.9
    chain_points, offsets = np.array([0, 1, 0, 2, 3, 0, 4]), np.array([0, 2, 5, 7])
    node_offsets, sockets = np.array([0, 3]), np.array([0, 2, 4])
    marks = np.zeros(4, np.uint8)
    mark_sharp(points, chain_points, offsets, node_offsets, sockets, np.radians(35.0), marks)
    assert marks.tolist() == ([SHARP, SHARP, SHARP, FREE] if degrees < 35 else [FREE] * 4)


def test_places_between_dense_points_lie_on_the_polyline() -> None:
    points = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 4.0]])
    assert points_at(points, np.array([0.25, 1.0, 1.5, 2.0])).tolist() == [[0.5, 0], [2, 0], [2, 2], [2, 4]]
    assert np.allclose(arc_lengths(points, np.array([0, 3])), [0, 2, 6])
