"""Dense curves: what is unpacked, how well each point is known, and the lines beside a point."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.boundary.curves import arc_lengths, curves_of, pin_ends, sample_weights, sides_of, started_at
from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.model import PointKind
from support.labels import disc, label_image, voronoi


@pytest.mark.parametrize("seed", range(3))
def test_every_chain_is_there_with_its_nodes_and_its_arc(seed: int) -> None:
    graph = extract_boundaries(label_image(voronoi(20, 24, 7, seed)))
    curves, ends = curves_of(graph)
    sockets = set()
    for c in range(graph.n_chains):
        ids = graph.chain(c)
        mine = slice(curves.offsets[c], curves.offsets[c + 1])
        assert np.array_equal(curves.raw[mine], graph.points[ids])
        steps = np.hypot(*np.diff(graph.points[ids], axis=0).T)
        assert np.allclose(curves.arc[mine], np.concatenate([[0.0], np.cumsum(steps)]))
        assert curves.is_frame[c] == (graph.point_kind[ids[1]] == PointKind.FRAME)
        for side, k in ((0, 0), (1, -1)):
            node = curves.ends[c, side]
            if node < 0:
                assert ids[0] == ids[-1]
            else:
                assert np.array_equal(ends.place[node], graph.points[ids[k]])
                assert ends.kind[node] == graph.point_kind[ids[k]]
                sockets.add((int(node), 2 * c + side))
    listed = {(v, int(s)) for v in range(len(ends.place)) for s in ends.sockets[ends.offsets[v] : ends.offsets[v + 1]]}
    assert listed == sockets


def test_a_side_at_a_step_weighs_the_square_of_the_lesser_run() -> None:
    #  ___a___b___c___
    #                 |
    #                 s___d___e___f___g___
    top = [(x, 3.0) for x in (0.0, 0.5, 1.0, 1.5, 2.0, 2.5)]  # a turn is cut from mid-side to mid-side
    step = [(3.0, 2.5)]
    low = [(x, 2.0) for x in (3.5, 4.0, 4.5, 5.0, 5.5, 6.0, 6.5, 7.0)]
    points = np.array(top + step + low)
    weight = sample_weights(sides_of(points), np.array([0, len(points)]))
    assert weight[len(top)] == 9.0
    is_side = (points % 1 != 0).any(axis=1)
    others = is_side & (np.arange(len(points)) != len(top))
    assert (weight[others] == 1.0).all()
    assert (weight[1:-1][~is_side[1:-1]] == 0.0).all()
    assert (weight[[0, -1]] == 1.0).all()


def test_a_closed_chain_starts_at_its_first_flagged_point() -> None:
    curves, _ = curves_of(extract_boundaries(label_image(disc(5.0, (8.2, 7.9), 16))))
    c = int(np.flatnonzero(curves.ends[:, 0] < 0)[0])
    first, last = curves.offsets[c], curves.offsets[c + 1] - 1
    flags = np.zeros(len(curves.raw), bool)
    flags[[first + 7, first + 20]] = True
    turned, there = started_at(curves, flags)
    ring = curves.raw[first:last]
    assert np.array_equal(turned.raw[first:last], np.roll(ring, -7, axis=0))
    assert np.array_equal(turned.raw[last], ring[7])
    assert np.flatnonzero(there).tolist() == [first, first + 13, last]
    assert np.array_equal(turned.arc, arc_lengths(turned.raw, curves.offsets))
    outside = np.r_[0:first, last + 1 : len(flags)]
    assert np.array_equal(turned.raw[outside], curves.raw[outside])


def test_ends_go_to_their_nodes_and_the_frame_stays_straight() -> None:
    graph = extract_boundaries(label_image(voronoi(20, 24, 6, 1)))
    curves, ends = curves_of(graph)
    moved = ends.place.copy()
    for v, (x, y) in enumerate(ends.place):
        if ends.kind[v] == PointKind.JUNCTION:
            moved[v] += [0.0 if x in (0, 24) else 0.3, 0.0 if y in (0, 20) else -0.2]
    points = curves.raw.copy()
    pin_ends(points, curves, moved)
    for c in range(graph.n_chains):
        first, last = curves.offsets[c], curves.offsets[c + 1] - 1
        if curves.ends[c, 0] < 0:
            continue
        assert np.array_equal(points[[first, last]], moved[curves.ends[c]])
        if curves.is_frame[c]:
            along = np.diff(points[first : last + 1], axis=0)
            assert ((along == 0).all(axis=0)).any()
            assert np.allclose(along.sum(axis=0), moved[curves.ends[c, 1]] - moved[curves.ends[c, 0]])
        else:
            assert np.array_equal(points[first + 1 : last], curves.raw[first + 1 : last])
