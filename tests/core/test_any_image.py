"""Any label picture, at any edge length, turned, mirrored or recoloured, becomes a valid mesh."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.boundary.smoothing import SmoothingOptions, smooth_boundaries
from imgquad_core.mesher import EFFORTS, MeshingOptions
from imgquad_core.mesher.meshing import mesh_boundaries
from imgquad_core.model import VOID, LabelImage, QuadMesh
from imgquad_core.options import MeshOptions
from imgquad_core.pipeline import run
from support.invariants import assert_accounted, assert_sides_long, assert_simplified_mesh, assert_valid_mesh
from support.labels import KINDS, Labels, label_image, labels_of_kind, spiral, voronoi

SIZES = (1.0, 2.5, 6.0)
N_COLORS = 8
TRIANGULATORS = ["cdt", *(["triangle"] if find_spec("triangle") else [])]
bounded = settings(derandomize=True, deadline=None, suppress_health_check=list(HealthCheck))


def valid_mesh(image: LabelImage, size: float, effort: str = "normal", triangulator: str = "auto") -> QuadMesh:
    graph = smooth_boundaries(extract_boundaries(image), SmoothingOptions(size=size))
    mesh = mesh_boundaries(graph, MeshingOptions(size=size, effort=effort, triangulator=triangulator), image.materials)
    assert_valid_mesh(mesh, image)
    return mesh


@st.composite
def pictures(draw: st.DrawFn) -> Labels:
    """Pictures of every kind, which hypothesis makes smaller and plainer where one fails."""
    n_rows, n_cols = draw(st.integers(1, 30)), draw(st.integers(1, 30))
    return labels_of_kind(
        draw(st.sampled_from(KINDS)), n_rows, n_cols, draw(st.integers(1, N_COLORS)), draw(st.integers(0, 10**6))
    )


@st.composite
def small_pictures(draw: st.DrawFn) -> Labels:
    """Pictures drawn pixel by pixel."""
    n_rows, n_cols = draw(st.integers(1, 5)), draw(st.integers(1, 5))
    pixels = st.lists(st.integers(VOID, 3), min_size=n_rows * n_cols, max_size=n_rows * n_cols)
    labels = np.reshape(draw(pixels.filter(lambda p: max(p) > VOID)), (n_rows, n_cols))
    return labels.astype(np.int32)


@settings(bounded, max_examples=70)
@given(pictures(), st.sampled_from(SIZES), st.sampled_from(sorted(EFFORTS)), st.sampled_from(TRIANGULATORS))
def test_any_picture_becomes_a_valid_mesh(labels: Labels, size: float, effort: str, triangulator: str) -> None:
    valid_mesh(label_image(labels), size, effort, triangulator)


@settings(bounded, max_examples=60)
@given(small_pictures(), st.sampled_from(SIZES), st.sampled_from(TRIANGULATORS))
def test_any_few_pixels_become_a_valid_mesh(labels: Labels, size: float, triangulator: str) -> None:
    valid_mesh(label_image(labels), size, triangulator=triangulator)


@settings(bounded, max_examples=25)
@given(
    pictures(),
    st.sampled_from(SIZES),
    st.integers(0, 3),
    st.booleans(),
    st.permutations(range(N_COLORS)),
)
def test_turned_mirrored_and_recoloured_pictures_do_too(
    labels: Labels, size: float, quarters: int, mirror: bool, colors: list[int]
) -> None:
    recolored = np.append(colors, VOID).astype(np.int32)[labels]
    turned = np.rot90(recolored[:, ::-1] if mirror else recolored, quarters)
    valid_mesh(label_image(turned), size)


@pytest.mark.parametrize("triangulator", TRIANGULATORS)
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize(
    "labels",
    [
        np.zeros((1, 1)),
        np.eye(2),
        np.arange(8)[None],
        np.arange(8)[:, None] % 2,
        np.indices((6, 7)).sum(axis=0) % 2,
        np.indices((9, 9)).max(axis=0) % 2,
        np.pad([[1]], 4),
        np.pad([[1]], [(0, 7), (0, 7)]),
        np.where(np.pad([[0]], 3, constant_values=1), 2, VOID),
        spiral(15),
    ],
    ids=["pixel", "2x2", "row", "column", "checkerboard", "hooks", "dot", "dot in a corner", "hole", "spiral"],
)
def test_extremes(labels: Any, size: float, triangulator: str) -> None:
    valid_mesh(label_image(labels), size, triangulator=triangulator)


@settings(bounded, max_examples=40)
@given(pictures(), st.sampled_from(SIZES), st.sampled_from(sorted(EFFORTS)))
def test_no_side_is_shorter_than_is_promised(labels: Labels, size: float, effort: str) -> None:
    assert_sides_long(run(label_image(labels), MeshOptions(size=size, effort=effort)).pixel_mesh)


@st.composite
def simplifications(draw: st.DrawFn) -> MeshOptions:
    """Steps, joins and tolerances of every kind; a material is kept, perhaps."""
    return MeshOptions(
        size=draw(st.sampled_from(SIZES)),
        effort="fast",
        step=draw(st.sampled_from(("auto", 1.0, 2.0, 2.6, (3.0, 2.0)))),
        join=draw(st.sampled_from((None, 0.0, 3.0, 8.0))),
        tolerance=draw(st.sampled_from((0.0, 1.0, 2.5, 4.0, 7.0, 12.0))),
    )


@settings(bounded, max_examples=40)
@given(
    pictures(),
    simplifications(),
    st.integers(1, 3),
    st.integers(0, 3),
    st.booleans(),
    st.permutations(range(N_COLORS)),
    st.booleans(),
)
def test_any_step_join_and_tolerance_gives_a_valid_mesh(
    labels: Labels, options: MeshOptions, times: int, quarters: int, mirror: bool, colors: list[int], keep: bool
) -> None:
    recolored = np.append(colors, VOID).astype(np.int32)[labels]
    turned = np.rot90(recolored[:, ::-1] if mirror else recolored, quarters)
    image = label_image(np.repeat(np.repeat(turned, times, axis=0), times, axis=1))
    done = run(image, replace(options, keep=(int(turned.max()),) if keep else ()))
    assert_accounted(done)
    assert_simplified_mesh(done.mesh, done.labels)


def test_recolouring_changes_the_materials_and_nothing_else() -> None:
    labels = voronoi(30, 24, 6, 1)
    colors = np.array([3, 5, 0, 1, 4, 2], np.int32)
    one, two = valid_mesh(label_image(labels), 2.5), valid_mesh(label_image(colors[labels]), 2.5)
    assert one.points.tobytes() == two.points.tobytes()
    assert one.quads.tobytes() == two.quads.tobytes()
    assert np.array_equal(colors[one.quad_material], two.quad_material)
