"""A picture that is turned or mirrored gives the same mesh, turned or mirrored."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from imgquad_core import MeshOptions
from imgquad_core.boundary import ExtractionOptions
from imgquad_core.orientation import TURNS, Turn, turn_of_picture
from imgquad_core.picture.segmentation import SegmentationOptions, segment
from imgquad_core.pipeline import extract, run
from support.labels import KINDS, label_image, labels_of_kind


@pytest.mark.parametrize("turn", TURNS)
def test_points_go_where_their_pixels_go(turn: Turn) -> None:
    labels = np.arange(12, dtype=np.int32).reshape(3, 4)
    row, col = np.divmod(np.arange(12), 4)
    centres = np.stack([col + 0.5, 3 - row - 0.5], axis=1)
    x, y = turn.points(centres, (3, 4)).T
    seen = turn.picture(labels)
    assert (seen[(seen.shape[0] - y).astype(int), x.astype(int)] == labels.ravel()).all()
    assert np.array_equal(turn.points_back(turn.points(centres, (3, 4)), (3, 4)), centres)


@pytest.mark.parametrize("turn", TURNS)
def test_a_graph_that_is_turned_and_turned_back_is_the_same(turn: Turn) -> None:
    graph = extract(label_image(labels_of_kind("cells", 20, 31, 4, 5)))
    back = turn.graph_back(turn.graph(graph))
    for name in ("points", "chain_points", "chain_offsets", "chain_regions", "point_kind"):
        assert np.array_equal(getattr(back, name), getattr(graph, name)), name
    assert back.shape == graph.shape


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (7, 1), (6, 6), (5, 8)])
def test_all_positions_of_a_picture_are_brought_to_the_same(shape: tuple[int, int]) -> None:
    labels = np.random.default_rng(3).integers(0, 3, shape).astype(np.int32)
    brought = {turn_of_picture(seen).picture(seen).tobytes() for seen in (turn.picture(labels) for turn in TURNS)}
    assert len(brought) == 1


@settings(max_examples=25, deadline=None)
@given(
    st.sampled_from(KINDS), st.integers(1, 24), st.integers(1, 24), st.integers(1, 5), st.integers(0, 999),
    st.sampled_from(TURNS[1:]), st.sampled_from([1.5, 2.5, 4.0]), st.sampled_from(["minority", "lower", "junction"]),
)  # fmt: skip
def test_the_mesh_of_a_turned_picture_is_the_turned_mesh(
    kind: str, rows: int, cols: int, colors: int, seed: int, turn: Turn, size: float, policy: str
) -> None:
    labels = labels_of_kind(kind, rows, cols, colors, seed)
    positions = {(seen.shape, seen.tobytes()) for seen in (each.picture(labels) for each in TURNS)}
    assume(len(positions) == len(TURNS))  # the mesh of a symmetric picture need not be symmetric
    options = MeshOptions(size=size, min_pixels=0, min_length=0.0, policy=policy)
    assert_alike(labels, turn, options)


@pytest.mark.parametrize("turn", TURNS[1:])
@pytest.mark.parametrize(
    "options",
    [
        MeshOptions(size=2.5, min_pixels=0, min_length=0.0, tolerance=3.0),
        MeshOptions(size=2.5, min_pixels=0, min_length=0.0, step=2.0),
        MeshOptions(size=3.0, min_pixels=0, min_length=0.0, drop=(2,), frame_size=2.0, growth=1.3),
    ],
    ids=["tolerance", "step", "drop"],
)
def test_so_it_is_with_options(turn: Turn, options: MeshOptions) -> None:
    assert_alike(labels_of_kind("cells", 40, 52, 4, 5), turn, options)


@pytest.mark.parametrize("turn", TURNS[1:])
@pytest.mark.parametrize("seed", range(3))
def test_so_it_is_where_clusters_of_noise_are_of_one_size(turn: Turn, seed: int) -> None:
    assert_alike(labels_of_kind("noise", 15, 21, 3, seed), turn, MeshOptions(size=2.5, min_pixels=6, min_length=5.0))


@pytest.mark.parametrize("turn", TURNS[1:])
def test_so_it_is_with_raw_pictures_and_marks(turn: Turn) -> None:
    noise = np.random.default_rng(2).normal(0, 30, (48, 60))
    grey = np.clip(labels_of_kind("cells", 48, 60, 2, 5) * 90 + 80 + noise, 0, 255).astype(np.uint8)
    colour = np.stack([grey, grey[::-1], grey], axis=2)
    marks = np.where(np.arange(60) < 20, 1, np.where(np.arange(60) > 50, 2, 0)) * np.ones((48, 1), int)
    for values, marked in ((grey, None), (colour, None), (grey, marks)):
        plain = segment(values, SegmentationOptions(marks=marked))
        turned = segment(
            turn.picture(values), SegmentationOptions(marks=None if marked is None else turn.picture(marked))
        )
        assert np.array_equal(turn.picture(plain.labels), turned.labels)
        assert len(np.unique(plain.labels)) > 1


@pytest.mark.parametrize("turn", TURNS[1:])
def test_so_it_is_with_pixels_that_hold_nothing(turn: Turn) -> None:
    values = labels_of_kind("cells", 30, 44, 3, 7) * 80.0 + np.random.default_rng(1).normal(0, 9, (30, 44))
    values[2:9, 5:20] = np.nan
    plain, turned = segment(values), segment(turn.picture(values))
    assert np.array_equal(plain.labels < 0, np.isnan(values))
    assert np.array_equal(turn.picture(plain.labels), turned.labels)


def test_the_diagonal_policy_is_of_the_picture_as_it_lies() -> None:
    labels = np.array([[0, 1], [1, 0]], np.int32)
    diagonal = ExtractionOptions(policy="diagonal")
    assert sorted(extract(label_image(labels), diagonal).region_label.tolist()) == [0, 1, 1]
    assert sorted(extract(label_image(labels[::-1]), diagonal).region_label.tolist()) == [0, 0, 1]


@pytest.mark.parametrize("turn", TURNS[1:])
@pytest.mark.parametrize("directions", ["x", "xy"])
def test_so_it_is_with_periodic_cells(turn: Turn, directions: str) -> None:
    labels = labels_of_kind("cells", 16, 19, 5, 5)
    options = MeshOptions(size=1.0, min_pixels=0, min_length=0.0, periodic=directions)
    assert_alike(labels, turn, options, replace(options, periodic=turn.directions(directions)))


def assert_alike(
    labels: np.ndarray, turn: Turn, options: MeshOptions, turned_options: MeshOptions | None = None
) -> None:
    plain = run(label_image(labels), options).mesh
    turned = run(turn.image(label_image(labels)), turned_options or options).mesh
    assert np.allclose(turn.points(plain.points, labels.shape), turned.points, rtol=0, atol=1e-9)
    assert np.array_equal(plain.quads[:, [0, 3, 2, 1]] if turn.swaps_hands else plain.quads, turned.quads)
    assert np.array_equal(plain.quad_material, turned.quad_material)
