"""Final edges are as long as asked for, and grow as asked for."""

from __future__ import annotations

import numpy as np
import pytest

from imgquad_core.mesher.meshing import mesh_boundaries
from imgquad_core.mesher.options import MeshingOptions
from imgquad_core.model import PointKind
from support import naive
from support.faces import polygon_graph
from support.labels import disc, label_image
from support.meshes import boundaries, irregular_share, meshed, quad_sides


@pytest.mark.parametrize("size", [1.0, 2.0, 4.0])
def test_square_is_a_regular_grid_of_the_size_asked_for(size: float) -> None:
    n = int(32 / size)
    mesh = mesh_boundaries(polygon_graph([[0, 0], [32, 0], [32, 32], [0, 32]], [n] * 4, (32, 32)), MeshingOptions(size))
    assert mesh.n_quads == n**2
    assert np.allclose(quad_sides(mesh), size)
    assert irregular_share(mesh) == 0


@pytest.mark.parametrize(
    ("size", "edge", "within", "count"), [(1.5, 0.1, 0.97, 0.15), (3.0, 0.1, 0.97, 0.15), (5.0, 0.12, 0.97, 0.25)]
)
def test_final_edges_are_about_as_long_as_asked_for(size: float, edge: float, within: float, count: float) -> None:
    # at size 5 the disc is 16 edges wide, four of the level it is meshed on
    mesh = meshed(disc(40, (50, 48), 100), size)
    lengths = quad_sides(mesh)
    assert np.median(lengths) == pytest.approx(size, rel=edge)
    assert np.mean((lengths > size / 2) & (lengths < size * 1.5)) > within
    assert mesh.n_quads == pytest.approx(100**2 / size**2, rel=count)


@pytest.mark.parametrize("inner", [1.5, 3.0])
def test_materials_have_their_own_sizes_and_sizes_grow_between(inner: float) -> None:
    mesh = meshed(disc(25, (60, 60), 120), 5.0, {1: inner})
    inside = mesh.quad_material == 1
    assert np.median(quad_sides(mesh, inside)) == pytest.approx(inner, rel=0.2)
    at_rim = np.isin(mesh.quads, np.flatnonzero(mesh.point_kind == PointKind.FREE)).any(axis=1)
    assert np.median(quad_sides(mesh, at_rim)) == pytest.approx(inner, rel=0.2)
    distance = np.hypot(*(mesh.points[mesh.quads].mean(axis=1) - 60).T)
    rings = [np.median(quad_sides(mesh, (distance > r) & (distance <= r + 12))) for r in range(26, 74, 12)]
    growing = np.minimum(rings, 0.98 * 5.0)  # then it is the size asked for, give or take
    assert growing.tolist() == sorted(growing)
    assert 1.5 * rings[0] < rings[-1] < 5.5 or inner == 3.0
    assert rings[-1] > 0.75 * 5.0


def test_neighbours_are_not_larger_than_growth_allows() -> None:
    graph = boundaries(label_image(disc(6, (60, 60), 120)), 6.0, material_sizes={1: 1.5})
    mesh = mesh_boundaries(graph, MeshingOptions(6.0, 1.3, {1: 1.5}))
    size = np.sqrt(naive.areas(mesh.points, mesh.quads))
    twins = naive.twins(mesh.quads)
    h = np.flatnonzero(twins >= 0)
    ratio = size[h // 4] / size[twins[h] // 4]
    assert np.quantile(ratio, 0.95) < 1.3  # irregular nodes want some play
    assert size.max() / size.min() > 3


def test_slow_growth_takes_more_quads() -> None:
    image = label_image(disc(6, (60, 60), 120))
    counts = []
    for growth in (1.05, 1.3):
        graph = boundaries(image, 6.0, growth=growth, material_sizes={1: 1.0})
        counts.append(mesh_boundaries(graph, MeshingOptions(6.0, growth, {1: 1.0})).n_quads)
    assert counts[0] > 1.2 * counts[1]
