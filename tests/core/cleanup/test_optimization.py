"""Clean-up and relaxation of meshes that are there already."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from imgquad_core.cleanup.optimization import OptimizationOptions, optimize
from imgquad_core.errors import InputError
from imgquad_core.measures.quality import material_areas, quality_report
from imgquad_core.model import LabelImage, Materials, PointKind, QuadMesh
from imgquad_core.options import MeshOptions
from imgquad_core.pipeline import run
from support.handmade import disk, jiggle, round_inclusion, staircase
from support.invariants import assert_valid_mesh

LABELS = disk(48, 15)
IMAGE = LabelImage(LABELS, Materials([0, 1], ("matrix", "disk"), np.zeros((2, 3))))


def spoilt(mesh: QuadMesh, by: float) -> QuadMesh:
    points = np.array(mesh.points)
    inner = mesh.point_kind == PointKind.INTERIOR
    points[inner] += np.random.default_rng(0).normal(0, by, (np.count_nonzero(inner), 2))
    return replace(mesh, points=points)


@pytest.fixture(scope="module")
def mesh() -> QuadMesh:
    return run(IMAGE, MeshOptions(size=3)).mesh


@pytest.mark.parametrize("by", [0.0, 0.5, 1.2])
def test_a_spoilt_mesh_is_mended(mesh: QuadMesh, by: float) -> None:
    before = spoilt(mesh, by)
    after = optimize(before)
    assert_valid_mesh(after, IMAGE)
    was, now = quality_report(before), quality_report(after)
    assert now.min_sj > 0.5
    assert round(now.irregular * now.inner_nodes) <= round(was.irregular * was.inner_nodes)
    assert by == 0 or now.mean_sj > was.mean_sj


def test_boundary_points_stay_and_keep_their_ids(mesh: QuadMesh) -> None:
    after = optimize(spoilt(mesh, 0.7))
    n = len(np.unique(mesh.chain_points))
    assert np.array_equal(after.points[:n], mesh.points[:n])
    for name in ("chain_points", "chain_offsets", "chain_regions", "region_label"):
        assert np.array_equal(getattr(after, name), getattr(mesh, name))
    assert material_areas(after) == pytest.approx(material_areas(mesh))


def test_a_regular_mesh_stays_regular() -> None:
    before = staircase(disk(12, 4), ("a", "b"), jiggle)
    after = optimize(before)
    assert quality_report(after).irregular == 0
    assert quality_report(after).min_sj >= quality_report(before).min_sj
    ring = round_inclusion(8, 10, 40, 3)
    assert quality_report(optimize(ring)).min_sj >= quality_report(ring).min_sj


def test_parts_that_touch_in_a_point_stay_apart() -> None:
    chess = np.kron([[0, 1], [1, 0]], np.ones((6, 6), int)).astype(np.int32)
    before = staircase(chess, ("a", "b"), jiggle)
    after = optimize(before)
    assert material_areas(after) == pytest.approx(material_areas(before))
    assert quality_report(after).inverted == 0


def test_threads_and_repetition_change_nothing(mesh: QuadMesh) -> None:
    given = spoilt(mesh, 0.7)
    first, second = optimize(given), optimize(given, OptimizationOptions(threads=2))
    assert first.points.tobytes() == second.points.tobytes()
    assert first.quads.tobytes() == second.quads.tobytes()


def test_bad_options_are_named() -> None:
    with pytest.raises(InputError, match="effort is 'none'"):
        OptimizationOptions(effort="none")
    with pytest.raises(InputError, match="threads is -1"):
        OptimizationOptions(threads=-1)
