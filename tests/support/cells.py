"""Periodic cells: pictures that go on beyond their border, and what must hold of their finite element meshes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.ndimage import gaussian_filter

from imgquad_core.fe import FEMesh
from imgquad_core.writers.abaqus.equations import _ties


def tileable(seed: int, shape: tuple[int, int] = (36, 42)) -> np.ndarray:
    """Filtered noise that goes on beyond its border."""
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=shape), 3, mode="wrap")
    return np.digitize(noise, np.quantile(noise, [0.35, 0.7])).astype(np.int32)


def assert_tied(mesh: FEMesh) -> None:
    """Partners are a period apart, each node has one, and each tie leads from its master over whole periods."""
    period = np.ptp(mesh.points, axis=0)
    for direction, pairs in mesh.periodic.items():
        step = mesh.points[pairs[:, 1]] - mesh.points[pairs[:, 0]]
        expected = np.where(np.arange(mesh.points.shape[1]) == "xyz".index(direction), period, 0.0)
        assert np.abs(step - expected).max() < 1e-6
        assert len(np.unique(pairs[:, 0])) == len(np.unique(pairs[:, 1])) == len(pairs)
    ties = _ties(mesh)
    assert not {master for master, _ in ties.values()} & set(ties)  # no master is a slave
    for slave, (master, steps) in ties.items():
        way = sum(n * period["xyz".index(d)] * np.eye(mesh.points.shape[1])["xyz".index(d)] for d, n in steps.items())
        assert np.abs(mesh.points[slave] - mesh.points[master] - way).max() < 1e-6


def assert_whole(mesh: FEMesh) -> None:
    assert np.array_equal(
        np.unique(np.concatenate([mesh.cells.ravel(), mesh.cohesive.ravel()])), np.arange(mesh.n_points)
    )
    for first, second in pairwise([mesh.cohesive[:, :2], mesh.cohesive[:, [3, 2]]]):
        assert np.abs(mesh.points[first] - mesh.points[second]).max() < 1e-9  # no thickness
