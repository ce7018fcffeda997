"""Means of a picture over quads, against polygons clipped by shapely pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from imgquad_core.measures.sampling import area_means
from support.handmade import disk, jiggle, staircase

PICTURE = np.random.default_rng(2).random((9, 13, 2)) * 255


def clipped_mean(quad: np.ndarray) -> np.ndarray:
    polygon, total = shapely.Polygon(quad), np.zeros(2)
    for row in range(9):
        for column in range(13):
            pixel = shapely.box(column, 8 - row, column + 1, 9 - row)
            total += polygon.intersection(pixel).area * PICTURE[row, column]
    return total / polygon.area


def test_means_are_exact_for_any_quad() -> None:
    rng = np.random.default_rng(5)
    corners = np.array([[0.1, 0.1], [1, 0.15], [0.95, 1], [0.05, 0.9]])
    quads = [corners * rng.uniform(0.5, 6, 2) + rng.uniform(0, 3, 2) for _ in range(30)]
    quads += [np.array([[2, 3], [5, 3], [5, 6], [2, 6.0]]), np.array([[0, 0], [13, 0], [13, 9], [0, 9.0]])]
    quads += [np.array([[4, 1], [6, 3], [4, 5], [2, 3.0]])]  # edges through corners of pixels
    means = area_means(PICTURE, np.concatenate(quads), np.arange(4 * len(quads)).reshape(-1, 4))
    for quad, mean in zip(quads, means, strict=True):
        assert mean == pytest.approx(clipped_mean(quad), rel=1e-10)


def test_the_integral_over_a_mesh_is_that_of_the_picture() -> None:
    mesh = staircase(disk(9, 3), ("a", "b"), jiggle)
    values = PICTURE[:, :9, 0]
    x, y = np.moveaxis(mesh.points[mesh.quads], 2, 0)
    area = 0.5 * ((x[:, 2] - x[:, 0]) * (y[:, 3] - y[:, 1]) - (x[:, 3] - x[:, 1]) * (y[:, 2] - y[:, 0]))
    means = area_means(values, mesh.points, mesh.quads)
    assert means.shape == (mesh.n_quads,)
    assert (means * area).sum() == pytest.approx(values.sum())
