"""The exact crossing test beside fractions, and the room that segments keep."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from imgquad_core.arrays import Bytes, Flags, Floats, Ints
from imgquad_core.geometry.conflicts import CLOSE, CROSSING, FREE, UNITS, find_conflicts, snapped
from support import naive

SIDE = 6


def some_segments(seed: int, step: float) -> tuple[Floats, Ints]:
    """Return 16 points of a small grid, so that many lie on one line, and 9 segments between them."""
    rng = np.random.default_rng(seed)
    place = rng.choice((SIDE + 1) ** 2, 16, replace=False)
    points = np.stack(np.divmod(place, SIDE + 1), axis=1) * step
    pairs = np.array(list(combinations(range(16), 2)))
    return points, rng.choice(pairs, 9, replace=False)


def expected(points: Floats, segments: Ints, new: Flags) -> Bytes:
    """Compare all pairs: a common id is no crossing unless one segment runs back over the other."""
    marks = np.full(len(segments), FREE, np.uint8)
    whole = np.rint(points * UNITS).astype(int)
    for i, j in combinations(range(len(segments)), 2):
        (a, b), (c, d) = segments[[i, j]].tolist()
        shared = {a, b} & {c, d}
        if not (new[i] or new[j]):
            continue
        if shared:
            ends = ((sum((a, b)) - min(shared), (c, d)), (sum((c, d)) - min(shared), (a, b)))
            mark = CROSSING if any(naive.is_on(whole[x], *whole[list(s)]) for x, s in ends) else FREE
        elif naive.segments_meet(*whole[[a, b, c, d]]):
            mark = CROSSING
        else:
            gaps = [
                naive.distance(points[x], *points[[u, v]]) / np.linalg.norm(points[v] - points[u])
                for u, v, others in ((a, b, (c, d)), (c, d, (a, b)))
                for x in others
            ]
            mark = CLOSE if min(gaps) < 0.25 - 1e-12 else FREE
        marks[[i, j]] = np.maximum(marks[[i, j]], mark)
    return marks


@pytest.mark.parametrize("step", [1.0, 1.0 / UNITS, 9.0])
def test_marks_are_those_of_fractions(step: float) -> None:
    seen = set()
    for seed in range(60):
        points, segments = some_segments(seed, step)
        shape = (int(SIDE * step) + 1, int(SIDE * step) + 1)
        own = np.arange(len(segments))
        marks = find_conflicts(points, segments, own, np.ones(len(segments), bool), shape)
        assert np.array_equal(marks, expected(points, segments, np.ones(len(segments), bool))), seed
        seen |= set(marks.tolist())
    assert seen == {FREE, CLOSE, CROSSING}


def test_only_pairs_with_a_new_chain_are_compared() -> None:
    for seed in range(20):
        points, segments = some_segments(seed, 2.0)
        new = np.arange(len(segments)) < 2
        marks = find_conflicts(points, segments, np.arange(len(segments)), new, (13, 13))
        assert np.array_equal(marks, expected(points, segments, new)), seed


@pytest.mark.parametrize("off", [0.0, 1.0 / UNITS])
def test_a_point_on_a_segment_is_told_from_one_a_grid_step_beside_it(off: float) -> None:
    points = np.array([[0.0, 0.0], [4000.0, 2000.0], [2000.0, 1000.0 + off], [1990.0, 3000.0]])
    marks = find_conflicts(points, np.array([[0, 1], [2, 3]]), np.arange(2), np.ones(2, bool), (4001, 4001))
    assert (marks == (CLOSE if off else CROSSING)).all()


def test_a_segment_without_length_is_a_conflict() -> None:
    points = np.array([[1.0, 1.0], [1.0, 1.0], [5.0, 5.0], [6.0, 5.0]])
    marks = find_conflicts(points, np.array([[0, 1], [2, 3]]), np.arange(2), np.ones(2, bool), (8, 8))
    assert marks.tolist() == [CROSSING, FREE]


def test_no_segments_have_no_conflicts() -> None:
    none = np.empty((0, 2), np.int64)
    assert len(find_conflicts(np.empty((0, 2)), none, np.empty(0, np.int64), np.ones(1, bool), (4, 4))) == 0


def test_snapped_points_lie_on_the_grid_and_near() -> None:
    points = np.random.default_rng(0).random((50, 2)) * 700
    assert np.array_equal(np.rint(snapped(points) * UNITS), snapped(points) * UNITS)
    assert np.abs(snapped(points) - points).max() <= 0.5 / UNITS
