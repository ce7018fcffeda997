"""Boundary nodes slide along their chains: areas stay, within reach, for better quads."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.cleanup.relaxation import rings_of
from imgquad_core.cleanup.sliding import REACH, slide
from imgquad_core.model import PointKind
from support import naive
from support.faces import Ids, Points, grid

#: ids of the nodes on the line x = 3 of a 6 x 6 grid, from below
LINE = np.arange(3, 49, 7)


def slid(points: Points, quads: Ids, kind: PointKind = PointKind.FREE, rounds: int = 20) -> tuple[Points, Points]:
    """Places after some rounds, and how far along the chain each node went."""
    kinds = np.full(len(points), PointKind.INTERIOR, np.uint8)
    kinds[LINE] = kind
    moved, at = points.copy(), np.zeros(len(points))
    for _ in range(rounds):
        slide(moved, rings_of(quads, len(points)), kinds, np.array([0, len(LINE)]), LINE, at)
    return moved, at


def uneven(bulge: float, seed: int) -> tuple[Points, Ids]:
    """Grid whose nodes on the line are unevenly spaced, and bulge to the right."""
    mesh = grid(6, 6)
    points = mesh.points.copy()
    points[LINE[1:-1], 1] += np.random.default_rng(seed).uniform(-0.25, 0.25, 5)
    points[LINE, 0] += bulge * np.sin(np.pi * points[LINE, 1] / 6)
    return points, mesh.quads


def left_area(points: Points) -> float:
    """Area between the line and x = 0."""
    x, y = points[LINE].T
    return float((0.5 * (x[1:] + x[:-1]) * np.diff(y)).sum())


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("bulge", [0.0, 0.5])
def test_quads_get_better_and_areas_stay(seed: int, bulge: float) -> None:
    points, quads = uneven(bulge, seed)
    moved, at = slid(points, quads)
    assert naive.worst_quality(moved, quads) > 0
    assert naive.shape_energy(moved, quads) < naive.shape_energy(points, quads)
    inner = LINE[1:-1]
    others = np.setdiff1d(np.arange(49), inner)
    assert moved[others].tobytes() == points[others].tobytes()
    assert left_area(moved) == pytest.approx(left_area(points), rel=1e-13)
    along = np.hypot(*(moved[inner] - points[inner]).T)
    assert (along <= REACH * np.hypot(*(points[LINE[2:]] - points[LINE[:-2]]).T)).all()
    assert (np.abs(at) <= REACH).all()
    assert (at[others] == 0).all()
    assert at[inner].any()
    if bulge == 0:
        assert (moved[LINE, 0] == 3).all()


def test_nodes_on_a_straight_line_become_evenly_spaced() -> None:
    points, quads = uneven(0.0, 3)
    points[LINE[1:-1], 1] = np.arange(1, 6) + np.array([0.3, -0.25, 0.3, -0.3, 0.25])
    moved, _ = slid(points, quads, rounds=50)
    assert np.abs(moved[LINE, 1] - np.arange(7)).max() < 0.7 * np.abs(points[LINE, 1] - np.arange(7)).max()


@pytest.mark.parametrize("kind", [PointKind.JUNCTION, PointKind.CORNER])
def test_junctions_and_corners_stay(kind: PointKind) -> None:
    points, quads = uneven(0.3, 0)
    moved, at = slid(points, quads, kind)
    assert moved.tobytes() == points.tobytes()
    assert not at.any()


def test_frame_nodes_slide() -> None:
    points, quads = uneven(0.0, 1)
    assert (slid(points, quads, PointKind.FRAME)[0] != points).any()


def test_regular_grid_stays_as_it_is() -> None:
    mesh = grid(6, 6)
    assert slid(mesh.points, mesh.quads)[0].tobytes() == mesh.points.tobytes()
