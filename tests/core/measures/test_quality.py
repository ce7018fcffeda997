"""Figures of quality on quads whose angles are known, and against PyVista's (Verdict's) own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from imgquad_core import mesh_image
from imgquad_core.measures import quality
from imgquad_core.model import Materials, PointKind, QuadMesh

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
ONE = np.array([[0, 1, 2, 3]])


def grid(n: int, split_at: int) -> QuadMesh:
    """n x n unit squares, material 0 left of column `split_at`, material 1 right of it."""
    ids = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([ids[:-1, :-1], ids[:-1, 1:], ids[1:, 1:], ids[1:, :-1]], axis=-1).reshape(-1, 4)
    points = np.stack(np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0)), axis=-1).reshape(-1, 2)
    right, left = np.r_[ids[0, split_at:], ids[1:, -1], ids[-1, split_at:-1][::-1]], ids[-1, : split_at + 1][::-1]
    left = np.r_[left, ids[:-1, 0][::-1], ids[0, 1 : split_at + 1]]
    chains = [right, left, ids[:, split_at]]
    kind = np.full(len(points), PointKind.INTERIOR, np.uint8)
    kind[np.concatenate(chains)] = PointKind.FREE
    return QuadMesh(
        points=points,
        point_kind=kind,
        quads=quads,
        quad_region=np.tile(np.arange(n) >= split_at, n).astype(int),
        region_label=np.array([0, 1]),
        chain_offsets=np.cumsum([0, *(len(c) for c in chains)]),
        chain_points=np.concatenate(chains),
        chain_regions=np.array([[1, -1], [0, -1], [0, 1]]),
        materials=Materials(np.array([0, 1]), ("a", "b"), np.zeros((2, 3))),
    )


@pytest.mark.parametrize("angle", [10.0, 45.0, 60.0, 90.0, 135.0])
def test_rhombus_has_the_sine_of_its_angle(angle: float) -> None:
    t = np.radians(angle)
    points = np.array([[0, 0], [1, 0], [1 + np.cos(t), np.sin(t)], [np.cos(t), np.sin(t)]])
    assert quality.scaled_jacobian(points, ONE)[0] == pytest.approx(np.sin(t))
    assert quality.corner_angles(points, ONE)[0] == pytest.approx([angle, 180 - angle, angle, 180 - angle])


def test_concave_clockwise_and_degenerate_quads_are_not_good() -> None:
    concave = np.array([[0.0, 0.0], [2.0, 0.0], [0.5, 0.5], [0.0, 2.0]])
    assert quality.scaled_jacobian(concave, ONE)[0] < 0
    assert quality.corner_angles(concave, ONE).max() > 180
    assert quality.scaled_jacobian(SQUARE, ONE[:, ::-1])[0] == -1
    collapsed = SQUARE[[0, 0, 2, 3]]
    assert quality.scaled_jacobian(collapsed, ONE)[0] == 0
    assert quality.aspect(collapsed, ONE)[0] == np.inf


def test_random_quads_agree_with_verdict() -> None:
    pv = pytest.importorskip("pyvista")
    rng = np.random.default_rng(0)
    points = (SQUARE + rng.uniform(-0.35, 0.35, (500, 4, 2))).reshape(-1, 2)
    quads = np.arange(len(points)).reshape(-1, 4)
    convex = quality.scaled_jacobian(points, quads) > 0
    quads = quads[convex]
    assert len(quads) > 300
    cells = pv.UnstructuredGrid({pv.CellType.QUAD: quads}, np.column_stack([points, np.zeros(len(points))]))
    verdict = cells.cell_quality(["scaled_jacobian", "min_angle", "max_angle"])
    angles = quality.corner_angles(points, quads)
    assert np.allclose(verdict["scaled_jacobian"], quality.scaled_jacobian(points, quads), atol=1e-9)
    assert np.allclose(verdict["min_angle"], angles.min(axis=1), atol=1e-9)
    assert np.allclose(verdict["max_angle"], angles.max(axis=1), atol=1e-9)


def test_report_of_a_square_grid() -> None:
    mesh = grid(4, 2)
    report = quality.quality_report(mesh)
    assert (report.n_points, report.n_quads, report.inverted) == (25, 16, 0)
    assert (report.min_sj, report.mean_sj, report.good_angles, report.max_aspect) == pytest.approx((1, 1, 1, 1))
    assert (report.inner_nodes, report.irregular, report.max_valence) == (6, 0.0, 4)
    assert quality.material_areas(mesh) == {0: 8.0, 1: 8.0}


def test_sectors_are_what_the_boundary_forces() -> None:
    mesh = grid(4, 2)
    sectors = quality.sector_angles(mesh)
    corner = {0: 90.0, 1: 180.0, 2: 90.0, 6: 360.0, 7: 180.0}  # a corner, a side, the interface's end, inside, on it
    for point, angle in corner.items():
        assert sectors[mesh.quads == point] == pytest.approx(angle)
    assert not quality.forced_quads(mesh, 0.9).any()


@pytest.mark.parametrize(
    ("sector", "best"), [(30, 0.5), (90, 1), (120, np.sqrt(0.75)), (130, np.sin(np.radians(65))), (180, 1), (360, 1)]
)
def test_best_that_a_sector_allows(sector: float, best: float) -> None:
    assert quality.best_sine(np.array([float(sector)]))[0] == pytest.approx(best)


def test_bad_place_names_where_and_whether_the_picture_forces_it() -> None:
    mesh = grid(4, 2)
    points = mesh.points.copy()
    points[6] = (0.4, 0.4)  # moved towards the corner (0, 0): its quad gets an angle of the mesh's own making
    bad = quality.bad_places(replace(mesh, points=points), limit=0.95)
    assert bad[0].scaled_jacobian < 0.95
    assert (bad[0].material, bad[0].forced) == (0, False)
    points = mesh.points.copy()
    points[1], points[0] = (1.0, 0.9), (0.0, 0.0)  # the border itself narrows the corner to 48 degrees
    bad = quality.bad_places(replace(mesh, points=points), limit=0.9)
    assert any(place.forced and place.sector_angle == pytest.approx(48.01, abs=0.01) for place in bad)


def test_bad_places_are_told_as_the_whole_mesh_has_them() -> None:
    labels = np.random.default_rng(2).integers(0, 3, (12, 15)).repeat(4, 0).repeat(4, 1)
    mesh = mesh_image(labels)
    sectors, sj = quality.sector_angles(mesh), quality.scaled_jacobian(mesh.points, mesh.quads)
    places = quality.bad_places(mesh, limit=0.9, most=40)
    assert [place.quad for place in places] == np.argsort(sj, kind="stable")[:40].tolist()
    forced = quality.forced_quads(mesh, 0.9)
    for place in places:
        touching = np.isin(mesh.quads, mesh.quads[place.quad]).any(axis=1)
        assert place.sector_angle == sectors[place.quad].min()
        assert place.forced == forced[place.quad]
        assert {place.material, *place.neighbours} == set(mesh.quad_material[touching].tolist())
