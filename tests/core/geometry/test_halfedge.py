"""Half-edges of any polygons, good or broken, against plain dictionaries."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from imgquad_core.geometry.halfedge import components, twins_of
from imgquad_core.grouping import grouped
from support import naive
from support.faces import grid

Ids = NDArray[np.int64]


@st.composite
def polygons(draw: st.DrawFn) -> Ids:
    """Any triangles or quads of few points: with folds, edges of three faces, loose parts."""
    n = draw(st.sampled_from([3, 4]))
    corner = st.permutations(range(7)).map(lambda p: p[:n])
    return np.array(draw(st.lists(corner, min_size=1, max_size=12)))


@settings(max_examples=60, derandomize=True, deadline=None)
@given(polygons())
def test_corners_of_each_point_come_ascending(faces: Ids) -> None:
    offsets, corners = grouped(faces, 9)
    assert len(offsets) == 10
    for v in range(9):
        assert np.array_equal(corners[offsets[v] : offsets[v + 1]], np.flatnonzero(faces.ravel() == v))


@settings(max_examples=100, derandomize=True, deadline=None)
@given(polygons())
def test_twins_are_those_of_a_dictionary_of_edges(faces: Ids) -> None:
    assert np.array_equal(twins_of(faces, 7), naive.twins(faces))


@settings(max_examples=60, derandomize=True, deadline=None)
@given(polygons())
def test_components_are_joined_by_edges_and_numbered_by_first_face(faces: Ids) -> None:
    n = faces.shape[1]
    twins = twins_of(faces, 7)
    part, count = components(twins, n)
    joined = np.flatnonzero(twins >= 0)
    graph = coo_array((np.ones(len(joined)), (joined // n, twins[joined] // n)), shape=(len(faces), len(faces)))
    expected, labels = connected_components(graph, directed=False)
    assert count == expected
    assert len({*zip(part.tolist(), labels.tolist(), strict=True)}) == count
    first = [int(np.flatnonzero(part == k)[0]) for k in range(count)]
    assert first == sorted(first)


def test_grid_has_one_rim_and_mutual_twins() -> None:
    mesh = grid(5, 3)
    twins = twins_of(mesh.quads, len(mesh.points))
    inner = np.flatnonzero(twins >= 0)
    assert np.array_equal(twins[twins[inner]], inner)
    assert np.count_nonzero(twins == -1) == 16


@pytest.mark.parametrize("n", [3, 4])
def test_no_faces_have_no_corners(n: int) -> None:
    faces = np.empty((0, n), np.int64)
    offsets, corners = grouped(faces, 3)
    assert offsets.tolist() == [0, 0, 0, 0]
    assert corners.size == twins_of(faces, 3).size == 0
