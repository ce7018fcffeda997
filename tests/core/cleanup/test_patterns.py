"""Patterns of quads: every one drawn on a convex polygon, its nodes counted."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from imgquad_core.cleanup import patterns
from imgquad_core.cleanup.patterns import QUADS, Canvas, draw_line, piece_fits, smooth_drawn, spoke
from imgquad_core.jit import kernel
from support import naive
from support.faces import Ids, Points

ROOM = 2000


@kernel
def choose_cut(points: Points, loop: Ids, corner: Ids, length: Ids, n: int, best: Ids) -> bool:
    return patterns.choose_cut(points, loop, corner, length, n, best)


@kernel
def piece_quads(length: Ids, n: int) -> int:
    return patterns.piece_quads(length, n)


@kernel
def cut_quads(length: Ids, n: int, cut: Ids) -> int:
    return patterns.cut_quads(length, n, cut)


@kernel
def draw_piece(canvas: Canvas, length: Ids, n: int) -> None:
    patterns.draw_piece(canvas, length, n)


@kernel
def draw_cut(canvas: Canvas, loop: Ids, corner: Ids, length: Ids, n: int, cut: Ids) -> None:
    patterns.draw_cut(canvas, loop, corner, length, n, cut)


def polygon(length: Ids) -> tuple[Points, Ids]:
    """Nodes around a regular polygon (two arcs for 2 corners), and the places of its corners."""
    n = len(length)
    turn = 2 * np.pi * np.arange(n + 1) / n
    corners = 10 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    sides = []
    for i in range(n):
        s = np.arange(length[i])[:, None] / length[i]
        side = (1 - s) * corners[i] + s * corners[i + 1]
        if n == 2:
            side = 10 * np.stack([np.cos(np.pi * (s[:, 0] + i)), np.sin(np.pi * (s[:, 0] + i))], axis=1)
        sides.append(side)
    return np.concatenate(sides), np.cumsum([0, *length[:-1]])


def canvas_on(points: Points) -> Canvas:
    """Empty canvas behind the nodes of an outline."""
    n = len(points)
    room = np.vstack([points, np.full((ROOM, 2), np.nan)])
    a, b, c, d = np.full((4, ROOM), -1)
    return Canvas(room, n, np.full((ROOM, 4), -1), np.zeros(2, np.int64), a, b, c, d, np.empty((ROOM, 3)))


def drawn(canvas: Canvas) -> tuple[Points, Ids]:
    n_points, n_quads = canvas.tally
    return canvas.points[: canvas.first + n_points], canvas.quads[:n_quads]


def assert_pattern(canvas: Canvas, outline: Points, corner: Ids, irregular: list[int]) -> None:
    """Check that quads fill the outline, valid, regular on it, with just these irregular valences inside."""
    points, quads = drawn(canvas)
    n = len(outline)
    assert naive.worst_quality(points, quads) > 1e-6
    assert np.array_equal(np.unique(quads), np.arange(len(points)))
    twins = naive.twins(quads)
    rim = np.flatnonzero(twins == -1)
    tail, head = quads.ravel()[rim], np.roll(quads, -1, axis=1).ravel()[rim]
    assert sorted(zip(tail.tolist(), head.tolist(), strict=True)) == [(i, (i + 1) % n) for i in range(n)]
    assert naive.areas(points, quads).sum() == pytest.approx(naive.areas(points, np.arange(n)[None])[0])
    valence = np.bincount(quads.ravel())
    expected = np.full(n, 2)
    expected[corner] = 1
    assert np.array_equal(valence[:n], expected)
    assert sorted(valence[n:][valence[n:] != 4].tolist()) == irregular
    assert canvas.points[:n].tobytes() == outline.tobytes()


def fitting(n: int, most: int) -> list[Ids]:
    """All lengths of n sides up to `most` that one pattern fits, the first side the longest."""
    ways = (np.array(way) for way in product(range(1, most + 1), repeat=n) if way[0] == max(way))
    return [way for way in ways if piece_fits(way, n)]


def piece_on(length: Ids) -> tuple[Canvas, Points, Ids]:
    outline, corner = polygon(length)
    canvas = canvas_on(outline)
    canvas.poly[: len(outline)] = np.arange(len(outline))
    draw_piece(canvas, length, len(length))
    return canvas, outline, corner


@pytest.mark.parametrize(("n", "most", "irregular"), [(3, 8, [3]), (4, 7, []), (5, 5, [5])])
def test_every_whole_pattern(n: int, most: int, irregular: list[int]) -> None:
    ways = fitting(n, most)
    assert len(ways) > 20
    for length in ways:
        canvas, outline, corner = piece_on(length)
        assert canvas.tally[QUADS] == piece_quads(length, n)
        assert_pattern(canvas, outline, corner, irregular)
        smooth_drawn(canvas, 3)
        assert_pattern(canvas, outline, corner, irregular)


def test_four_sides_fit_where_opposite_ones_are_equal() -> None:
    for length in product(range(1, 5), repeat=4):
        assert piece_fits(np.array(length), 4) == (length[0] == length[2] and length[1] == length[3])


def test_three_sides_fit_where_even_and_shorter_than_the_other_two() -> None:
    for a, b, c in product(range(1, 8), repeat=3):
        expected = (a + b + c) % 2 == 0 and a < b + c and b < a + c and c < a + b
        assert piece_fits(np.array([a, b, c]), 3) == expected


@pytest.mark.parametrize("n", [3, 5])
def test_sides_are_the_sum_of_the_spokes_beside_their_ends(n: int) -> None:
    for way in product(range(1, 4), repeat=n):
        length = np.array([way[i - 1] + way[(i + 1) % n] for i in range(n)])
        assert [spoke(length, n, i) for i in range(n)] == list(way)
        assert piece_fits(length, n)
        assert piece_quads(length, n) == sum(way[i] * way[i - 1] for i in range(n))
    odd = np.array([2] * (n - 1) + [3])
    assert not piece_fits(odd, n)


@pytest.mark.parametrize("n", [1, 2, 6, 7])
def test_no_whole_pattern_for_other_numbers_of_corners(n: int) -> None:
    assert not piece_fits(np.full(n, 4), n)


def cut_on(length: Ids) -> tuple[Canvas, Points, Ids, Ids] | None:
    """Draw the best cut; None where there is none."""
    outline, corner = polygon(length)
    canvas, loop, cut = canvas_on(outline), np.arange(len(outline)), np.zeros(5, np.int64)
    if not choose_cut(outline, loop, corner, length, len(length), cut):
        return None
    draw_cut(canvas, loop, corner, length, len(length), cut)
    return canvas, outline, corner, cut


@pytest.mark.parametrize(
    ("n", "least", "most", "irregular", "fewest"),
    [(2, 1, 12, [3, 3], 20), (4, 1, 7, [3, 5], 80), (6, 3, 5, [5, 5], 10)],
)
def test_every_cut(n: int, least: int, most: int, irregular: list[int], fewest: int) -> None:
    found = 0
    for way in product(range(least, most + 1), repeat=n):
        length = np.array(way)
        if way[0] != max(way) or piece_fits(length, n):
            continue
        result = cut_on(length)
        if sum(way) % 2:
            assert result is None
        if result is None:
            continue
        canvas, outline, corner, cut = result
        assert canvas.tally[QUADS] == cut_quads(length, n, cut)
        assert_pattern(canvas, outline, corner, irregular)
        smooth_drawn(canvas, 5)
        assert canvas.points[: len(outline)].tobytes() == outline.tobytes()
        found += 1
    assert found >= fewest


def edges_on_length(outline: Points, corner: Ids, cut: Ids) -> float:
    """How many of the outline's mean edges a straight cut is long."""
    n, n_loop, (i, j, a, b) = len(corner), len(outline), cut[:4]
    ends = outline[[(corner[i] + a) % n_loop, (corner[j % n] + b) % n_loop]]
    return float(np.hypot(*(ends[0] - ends[1])) / np.hypot(*(outline - np.roll(outline, -1, axis=0)).T).mean())


def all_cuts(length: Ids) -> list[Ids]:
    """Every cut that leaves two pieces with patterns, whatever its length."""
    n, apart = len(length), {2: 1, 4: 1, 6: 3}[len(length)]
    found = []
    for i in range(n if n == 4 else n // 2):
        j = i + apart
        sides = np.roll(length, -i)
        for a, b, edges in product(range(1, sides[0]), range(1, sides[apart]), range(1, 20)):
            one = np.array([sides[0] - a, *sides[1:apart], b, edges])
            two = np.array([sides[apart] - b, *sides[apart + 1 :], a, edges])
            if piece_fits(one, len(one)) and piece_fits(two, len(two)):
                found.append(np.array([i, j, a, b, edges]))
    return found


@pytest.mark.parametrize("n", [2, 4, 6])
def test_no_cut_suits_its_length_better(n: int) -> None:
    random, found = np.random.default_rng(n), 0
    for _ in range(200):
        length, cut = random.integers(3, 8, n), np.zeros(5, np.int64)
        outline, corner = polygon(length)
        outline = outline + random.uniform(-1, 1, outline.shape)
        off = [abs(edges_on_length(outline, corner, way) - way[4]) for way in all_cuts(length)]
        if choose_cut(outline, np.arange(len(outline)), corner, length, n, cut):
            assert abs(edges_on_length(outline, corner, cut) - cut[4]) == pytest.approx(min(off))
            found += 1
        else:
            assert min(off, default=9.0) > 1.0
    assert found >= 10


def test_line_is_straight_and_evenly_spaced() -> None:
    canvas = canvas_on(np.array([[0.0, 0], [6, 3]]))
    out = np.full(5, -1)
    draw_line(canvas, 0, 1, 3, out, 1)
    assert out.tolist() == [-1, 0, 2, 3, 1]
    assert np.allclose(canvas.points[2:4], [[2, 1], [4, 2]])


def test_smoothing_reaches_the_mean_of_the_neighbours() -> None:
    canvas, _, _ = piece_on(np.array([6, 5, 5]))
    smooth_drawn(canvas, 500)
    points, quads = drawn(canvas)
    pairs = np.stack([quads.ravel(), np.roll(quads, -1, axis=1).ravel()], axis=1)
    for v in range(canvas.first, len(points)):
        beside = np.unique(pairs[pairs[:, 0] == v, 1])
        assert np.allclose(points[v], points[beside].mean(axis=0))
