"""Junctions and border ends go to where the lines of their chains meet."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.arrays import Floats
from imgquad_core.boundary.curves import Curves, Ends, arc_lengths, curves_of
from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.boundary.junctions import place_junctions
from imgquad_core.model import PointKind
from support.labels import Labels, label_image, pixel_centres


def star(angles: Floats, off: Floats, shape: tuple[int, int] = (60, 60)) -> tuple[Curves, Ends]:
    """Chains of straight points from (30, 30) on, 12 px long, whose lines all run through (30, 30) + off."""
    rays = [
        np.vstack(
            [[30.0, 30.0], np.array([30.0, 30.0]) + off + np.arange(1.0, 12.1, 0.5)[:, None] * [np.cos(a), np.sin(a)]]
        )
        for a in angles
    ]
    raw, offsets = np.concatenate(rays), np.cumsum([0] + [len(ray) for ray in rays])
    n = len(angles)
    ends = np.stack([np.zeros(n, np.int64), np.arange(1, n + 1)], axis=1)
    place = np.vstack([[30.0, 30.0], raw[offsets[1:] - 1]])
    kind = np.full(n + 1, PointKind.CORNER, np.uint8)
    kind[0] = PointKind.JUNCTION
    curves = Curves(
        raw, arc_lengths(raw, offsets), np.ones(len(raw)), offsets, ends, np.zeros(n, bool), np.ones(len(raw))
    )
    return curves, Ends(
        place, kind, np.r_[0, n, n + np.arange(1, n + 1)], np.r_[2 * np.arange(n), 2 * np.arange(n) + 1]
    )


def nearest_to_lines(angles: Floats, off: Floats, pull: float) -> Floats:
    """Least squares: the distances to all lines, and `pull` times that from where it is."""
    normal = np.stack([-np.sin(angles), np.cos(angles)], axis=1)
    rows = np.vstack([normal, np.sqrt(pull) * np.eye(2)])
    return np.asarray(np.linalg.lstsq(rows, np.r_[normal @ off, 0.0, 0.0], rcond=None)[0])


@pytest.mark.parametrize("seed", range(6))
def test_a_junction_goes_to_the_point_nearest_to_the_lines_of_its_chains(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angles = rng.random() * 7 + np.arange(3) * 2 * np.pi / 3 + rng.uniform(-0.3, 0.3, 3)
    off = rng.uniform(-0.25, 0.25, 2)
    curves, nodes = star(angles, off)
    placed = place_junctions(curves, nodes, np.full(len(curves.raw), 5.0), (60, 60))
    assert placed[0] - 30.0 == pytest.approx(nearest_to_lines(angles, off, 0.15), abs=1e-9)
    assert np.array_equal(placed[1:], nodes.place[1:])


@pytest.mark.parametrize(("room", "farthest"), [(5.0, 0.5), (0.2, 0.2), (0.0, 0.0)])
def test_a_junction_goes_no_farther_than_half_a_pixel_and_its_room(room: float, farthest: float) -> None:
    curves, nodes = star(np.arange(3) * 2 * np.pi / 3 + 0.2, np.array([1.4, 0.3]))
    placed = place_junctions(curves, nodes, np.full(len(curves.raw), room), (60, 60))
    assert np.hypot(*(placed[0] - 30.0)) == pytest.approx(farthest, abs=1e-9)


def sectors(tip: tuple[float, float], cuts: list[float], n: int) -> Labels:
    x, y = pixel_centres(n, n)
    return np.searchsorted(np.radians(cuts), np.arctan2(y - tip[1], x - tip[0]) % (2 * np.pi)).astype(np.int32) % len(
        cuts
    )


def test_junctions_of_pictures_come_nearer_to_the_truth() -> None:
    before, after = [], []
    for seed in range(16):
        rng = np.random.default_rng(seed)
        tip, turn = 30 + rng.random(2), rng.uniform(0, 100)
        graph = extract_boundaries(label_image(sectors(tip, [turn + 5, turn + 120, turn + 240], 60)))
        curves, nodes = curves_of(graph)
        inner = (nodes.kind == PointKind.JUNCTION) & (np.abs(nodes.place - tip).max(axis=1) < 3)
        placed = place_junctions(curves, nodes, np.full(len(curves.raw), 5.0), graph.shape)
        before.append(np.hypot(*(nodes.place[inner] - tip).T).max())
        after.append(np.hypot(*(placed[inner] - tip).T).max())
    assert np.mean(after) < 0.85 * np.mean(before)
    assert np.max(after) < 0.8


def test_ends_on_the_border_slide_along_it_to_the_line_and_corners_stay() -> None:
    x, y = pixel_centres(60, 60)
    labels = (y < 20.3 + 0.37 * x).astype(np.int32)
    graph = extract_boundaries(label_image(labels))
    curves, nodes = curves_of(graph)
    placed = place_junctions(curves, nodes, np.full(len(curves.raw), 5.0), graph.shape)
    ends = nodes.kind == PointKind.JUNCTION
    assert ends.sum() == 2
    assert np.array_equal(placed[~ends], nodes.place[~ends])
    for was, now in zip(nodes.place[ends], placed[ends], strict=True):
        assert now[0] == was[0]
        true = 20.3 + 0.37 * was[0]
        assert abs(now[1] - true) < 0.12
        assert abs(now[1] - true) <= abs(was[1] - true)
