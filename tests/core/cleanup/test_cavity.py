"""Cavities: what grows has the outline of its quads, what is taken out and put back is the mesh again."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from imgquad_core.cleanup import cavity as cv
from imgquad_core.cleanup.faces import FaceQuads
from imgquad_core.jit import kernel
from support import naive
from support.faces import grid, irregularity, quads_of, voronoi_graph

CONCAVE = 2  # quads that a straight side needs at a node: more are needed where it is concave


@kernel
def grow(net: cv.Net, cavity: cv.Cavity, v: int, largest: int, pushes: int) -> bool:
    """Begin at the quads of a node, settle, and push all sides."""
    cv.begin(cavity)
    cv.add_ring(net, cavity, v)
    fine = cv.settle(net, cavity, largest, CONCAVE)
    for _ in range(pushes):
        if fine and cv.push_all(net, cavity):
            fine = cv.settle(net, cavity, largest, CONCAVE)
    return fine


@kernel
def take_out(net: cv.Net, cavity: cv.Cavity) -> None:
    """Take the quads of a settled cavity out."""
    cv.remove(net, cavity)


def outline(quads: np.ndarray) -> dict[int, int]:
    """Next node of each node on the outline of quads that have no pinch."""
    edges = Counter((a, b) for q in quads.tolist() for a, b in zip(q, q[1:] + q[:1], strict=True))
    return {a: b for a, b in edges if (b, a) not in edges}


def grains() -> FaceQuads:
    return quads_of(voronoi_graph(48, 2, 2.0, 1), 2.0)


@pytest.mark.parametrize("mesh", [grid(9, 8), grains()], ids=["grid", "grains"])
def test_a_net_that_nobody_changed_is_the_mesh(mesh: FaceQuads) -> None:
    net = cv.net_of(mesh, 16)
    assert all(np.array_equal(a, b) for a, b in zip(cv.compact(net, mesh), mesh, strict=True))
    assert np.array_equal(net.twins[: 4 * len(mesh.quads)], naive.twins(mesh.quads))
    for v in range(len(mesh.points)):
        at = set(net.ring[v, : net.valence[v]].tolist())
        assert at == set(np.flatnonzero((mesh.quads == v).any(axis=1)).tolist())


@pytest.mark.parametrize("pushes", [0, 1, 2])
def test_the_outline_runs_counter_clockwise_round_the_quads(pushes: int) -> None:
    mesh = grains()
    net = cv.net_of(mesh, 160)
    cavity, _ = cv.scratch(net, 160)
    grown = 0
    for v in range(0, len(mesh.points), 7):
        if not grow(net, cavity, v, 160, pushes):
            continue
        grown += 1
        inside = cavity.members[: cavity.tally[cv.MEMBERS]]
        assert len(set(inside.tolist())) == len(inside)
        ahead = outline(mesh.quads[inside])
        loop = cavity.loop[: cavity.tally[cv.OUTLINE]].tolist()
        assert ahead == dict(zip(loop, loop[1:] + loop[:1], strict=True))
        corners = cavity.corner[: cavity.tally[cv.CORNERS]]
        lengths = cavity.length[: cavity.tally[cv.CORNERS]]
        if len(corners):
            assert lengths.sum() == len(loop)
            assert np.array_equal(np.diff(corners), lengths[:-1])
    assert grown > 5


def test_a_cavity_larger_than_allowed_is_refused() -> None:
    mesh = grid(9, 9)
    net = cv.net_of(mesh, 40)
    cavity, _ = cv.scratch(net, 40)
    middle = 5 * 10 + 5
    assert grow(net, cavity, middle, 4, 0)
    assert not grow(net, cavity, middle, 3, 0)
    assert not grow(net, cavity, middle, 15, 1)
    assert grow(net, cavity, middle, 16, 1)


def test_quads_that_are_taken_out_are_gone_with_the_nodes_that_only_they_had() -> None:
    mesh = grid(9, 9)
    net = cv.net_of(mesh, 40)
    cavity, _ = cv.scratch(net, 40)
    assert grow(net, cavity, 5 * 10 + 5, 40, 1)
    out = set(cavity.members[: cavity.tally[cv.MEMBERS]].tolist())
    assert len(out) == 16
    take_out(net, cavity)
    rest = cv.compact(net, mesh)
    assert len(rest.quads) == 81 - 16
    assert len(rest.points) == 100 - 9
    left = np.array([q for k, q in enumerate(mesh.quads) if k not in out])
    assert np.array_equal(rest.points[rest.quads], mesh.points[left])
    assert net.tops[cv.QUADS] == len(net.quads) - len(rest.quads)
    assert net.tops[cv.POINTS] == len(net.valence) - len(rest.points)


@kernel
def cost_of(net: cv.Net, v: int) -> int:
    """Penalty of one node."""
    return cv.penalty(net.valence[v], net.wanted[v], net.rim[v])


def test_irregularity_is_that_of_all_nodes_told_one_by_one() -> None:
    mesh = grains()
    net = cv.net_of(mesh, 16)
    total = sum(cost_of(net, v) for v in range(len(mesh.points)))
    assert total == irregularity(mesh) > 0
