"""PyVista's own filters, files and measures on our meshes: they agree with us and keep the meshes sane."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv

from imgquad_core.errors import InputError
from support.images import COLS, ROWS, areas, assert_same, labels, point_image, total_length

MEASURES = ["scaled_jacobian", "min_angle", "max_angle"]


@pytest.fixture(scope="module")
def grid() -> pv.UnstructuredGrid:
    return point_image(spacing=(0.5, 0.5, 1)).imgquad.mesh(size=3)


def test_output_is_what_users_expect(grid: pv.UnstructuredGrid) -> None:
    assert type(grid) is pv.UnstructuredGrid
    assert set(grid.celltypes) == {pv.CellType.QUAD}
    assert grid.active_scalars_name == "material"
    assert grid.cell_data["material"].dtype == np.int32
    assert grid.cell_data["region"].dtype == np.int32
    assert grid.points.dtype == np.float64
    assert list(grid.field_data["material_names"]) == ["material 0", "material 1", "material 2"]
    assert grid.field_data["material_numbers"].tolist() == [0, 1, 2]
    assert grid.field_data["material_colors"].shape == (3, 3)
    assert areas(grid).min() > 0
    assert areas(grid).sum() == pytest.approx(ROWS * COLS / 4)


def test_vtk_and_pyvista_find_the_mesh_valid(grid: pv.UnstructuredGrid) -> None:
    report = grid.validate_mesh()
    assert report.is_valid, report


def test_quality_is_that_of_vtk(grid: pv.UnstructuredGrid) -> None:
    """Also of a mesh whose nodes were moved at random, with concave quads: but for winding, which VTK does not see."""
    spoilt = grid.copy()
    rng = np.random.default_rng(3)
    spoilt.points[:, :2] += rng.normal(0, 0.4, (grid.n_points, 2))
    for mesh in (grid, spoilt):
        ours, theirs = mesh.imgquad.quality(), mesh.cell_quality(MEASURES)
        valid = areas(mesh) > 0
        assert np.abs(ours["scaled_jacobian"] - theirs["scaled_jacobian"])[valid].max() < 1e-9
        for name in ("min_angle", "max_angle"):
            # VTK folds reflex angles of quads whose middle is not inside
            plain = valid & (ours["max_angle"] < 180)
            assert np.abs(ours[name] - theirs[name])[plain].max() < 1e-9
    assert (spoilt.imgquad.quality()["scaled_jacobian"] < 0).any()


def test_quality_tells_clockwise_quads_which_vtk_does_not(grid: pv.UnstructuredGrid) -> None:
    quads = grid.cells_dict[pv.CellType.QUAD].copy()
    quads[:5] = quads[:5, ::-1]
    turned = pv.UnstructuredGrid({pv.CellType.QUAD: quads}, grid.points)
    assert (turned.imgquad.quality()["scaled_jacobian"] < 0).sum() == 5
    assert (turned.cell_quality("scaled_jacobian")["scaled_jacobian"] > 0).all()
    with pytest.raises(InputError, match="more than two quads, or quads overlap"):
        turned.imgquad.optimize()


@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".vtkhdf"])
def test_files_keep_everything(grid: pv.UnstructuredGrid, tmp_path: Path, extension: str) -> None:
    grid.save(tmp_path / f"a{extension}")
    again = pv.read(tmp_path / f"a{extension}")
    assert_same(again, grid)
    assert again.active_scalars_name == "material"
    assert np.array_equal(again.field_data["material_colors"], grid.field_data["material_colors"])
    assert again.imgquad.report() == grid.imgquad.report()


def test_pickle_and_copy_keep_everything(grid: pv.UnstructuredGrid) -> None:
    for again in (pickle.loads(pickle.dumps(grid)), grid.copy(), grid.copy(deep=False)):
        assert_same(again, grid)
        assert again.imgquad.quality()["aspect"].max() == grid.imgquad.quality()["aspect"].max()


def test_materials_apart(grid: pv.UnstructuredGrid) -> None:
    names = dict(zip(map(str, grid.field_data["material_names"]), grid.field_data["material_numbers"], strict=True))
    blocks = grid.split_values({name: int(number) for name, number in names.items()}, scalars="material")
    assert isinstance(blocks, pv.MultiBlock)
    assert blocks.keys() == list(names)
    assert sum(block.n_cells for block in blocks) == grid.n_cells
    for block, label in zip(blocks, names.values(), strict=True):
        assert block.area == pytest.approx((labels() == label).sum() / 4, rel=0.01)
        assert total_length(block.imgquad.boundaries()) > 0
        border = block.extract_feature_edges(
            boundary_edges=True, feature_edges=False, manifold_edges=False, non_manifold_edges=False
        )
        assert total_length(border) == pytest.approx(total_length(block.imgquad.boundaries()))
    assert blocks.combine(merge_points=True).n_points == grid.n_points


def test_parts_are_meshes_too(grid: pv.UnstructuredGrid) -> None:
    disk = grid.threshold(1.5, scalars="material")
    same = grid.extract_cells(grid["material"] == 2)
    for part in (disk, same):
        assert set(part.celltypes) == {pv.CellType.QUAD}
        assert set(part["material"]) == {2}
        assert areas(part).min() > 0
        assert part.imgquad.report()["materials"]["material 2"]["area"] == pytest.approx(areas(part).sum())
        assert part.imgquad.optimize().area == pytest.approx(part.area)
    rest = grid.extract_cells(grid["material"] != 2)
    whole = disk.merge(rest, merge_points=True)
    assert whole.n_points == grid.n_points
    assert whole.n_cells == grid.n_cells
    assert whole.validate_mesh().is_valid


def test_surface_and_clean_merge_no_points_away(grid: pv.UnstructuredGrid) -> None:
    assert grid.clean().n_points == grid.n_points
    surface = grid.extract_surface(algorithm="dataset_surface")
    assert surface.is_all_triangles is False
    assert surface.n_cells == grid.n_cells
    assert surface.n_points == grid.n_points
    assert surface.clean().n_points == grid.n_points
    assert surface.imgquad.quality()["scaled_jacobian"].min() == grid.imgquad.quality()["scaled_jacobian"].min()
    assert surface.triangulate().area == pytest.approx(grid.area)


def test_the_way_into_pymeshlab(grid: pv.UnstructuredGrid, tmp_path: Path) -> None:
    """As arrays, in a process of its own: MeshLab's libraries and VTK's do not get on everywhere."""
    pytest.importorskip("pymeshlab", reason="pymeshlab is not installed")
    surface = grid.extract_surface(algorithm="dataset_surface")
    np.savez(tmp_path / "a.npz", points=surface.points, faces=surface.regular_faces)
    program = """
import sys
import numpy as np, pymeshlab
a = np.load(sys.argv[1])
meshes = pymeshlab.MeshSet()
meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=a["points"], face_list_of_indices=a["faces"].astype(np.int32)))
figures = meshes.get_geometric_measures()
print(figures["surface_area"], meshes.current_mesh().vertex_number())
"""
    command = [sys.executable, "-c", program, str(tmp_path / "a.npz")]
    area, n_points = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()[-2:]
    assert float(area) == pytest.approx(grid.area)
    assert int(n_points) == grid.n_points


def test_multiblock_of_several_meshes(grid: pv.UnstructuredGrid, tmp_path: Path) -> None:
    other = point_image(1 - (labels() == 1).astype(int)).imgquad.mesh(size=5)
    blocks = pv.MultiBlock({"first": grid, "second": other})
    blocks.save(tmp_path / "a.vtm")
    again = pv.read(tmp_path / "a.vtm")
    assert_same(again["first"], grid)
    assert_same(again["second"], other)


def test_transformed_meshes_are_measured_alike(grid: pv.UnstructuredGrid) -> None:
    turned = grid.rotate_vector((1, 2, 3), 50).translate((7, 8, 9))
    ours, theirs = turned.imgquad.quality(), grid.imgquad.quality()
    for name in (*MEASURES, "aspect"):
        assert np.allclose(ours[name], theirs[name], atol=1e-7)
    assert np.array_equal(ours["valence"], theirs["valence"])
    better = turned.imgquad.optimize()
    assert better.bounds == pytest.approx(turned.bounds, abs=1e-9)
    bent = grid.copy()
    bent.points[:, 2] = np.asarray(grid.points)[:, 0] ** 2
    with pytest.raises(InputError, match="away from a plane: flatten"):
        bent.imgquad.quality()


def test_warp_and_clip_run_on_the_mesh(grid: pv.UnstructuredGrid) -> None:
    warped = grid.copy()
    warped["shift"] = np.c_[0.1 * np.sin(np.asarray(grid.points)[:, 1]), np.zeros((grid.n_points, 2))]
    warped = warped.warp_by_vector("shift")
    assert areas(warped).min() > 0
    assert np.array_equal(warped["material"], grid["material"])
    half = grid.clip("x")
    assert half.area == pytest.approx(grid.area / 2, rel=1e-6)
    assert set(half["material"]) <= {0, 1, 2}
    with pytest.raises(InputError, match="no quads"):
        half.imgquad.quality()


def test_boundaries_of_a_mesh_are_those_it_was_made_of() -> None:
    """To the last digit with effort fast; else but for points that the mesher has slid along their curve."""
    lines = point_image().imgquad.boundaries().imgquad.smooth(2.5)
    traced = lines.imgquad.quads().imgquad.boundaries()
    assert total_length(traced) == pytest.approx(total_length(lines), rel=5e-5)
    assert traced.n_points == lines.n_points

    def lengths(poly: pv.PolyData) -> dict[tuple[int, ...], float]:
        sized = poly.compute_cell_sizes()
        total: dict[tuple[int, ...], float] = {}
        for pair, length in zip(poly["boundary_labels"].tolist(), sized["Length"], strict=True):
            total[tuple(sorted(pair))] = total.get(tuple(sorted(pair)), 0.0) + length
        return total

    assert lengths(traced) == pytest.approx(lengths(lines), rel=1e-4)
    unmoved = lines.imgquad.quads(effort="fast").imgquad.boundaries()
    assert lengths(unmoved) == pytest.approx(lengths(lines), rel=1e-12)


def test_quadratic_elements_have_their_middles_on_the_curve(grid: pv.UnstructuredGrid) -> None:
    turned = grid.rotate_x(90)
    for nodes, kind in ((8, pv.CellType.QUADRATIC_QUAD), (9, pv.CellType.BIQUADRATIC_QUAD)):
        raised = turned.imgquad.quadratic(nodes)
        assert set(raised.celltypes) == {kind}
        assert raised.bounds == pytest.approx(turned.bounds, abs=1e-9)
        assert np.array_equal(raised["material"], grid["material"])


def test_optimize_mends_a_spoilt_mesh(grid: pv.UnstructuredGrid) -> None:
    spoilt = grid.copy()
    inner = np.setdiff1d(np.arange(grid.n_points), _on_lines(grid))
    spoilt.points[inner, :2] += np.random.default_rng(1).normal(0, 0.3, (len(inner), 2))
    before, after = spoilt.imgquad.quality(), spoilt.imgquad.optimize()
    assert before["scaled_jacobian"].min() < 0.2
    assert areas(after).min() > 0
    assert after.imgquad.quality()["scaled_jacobian"].min() > 0.5
    was, now = grid.imgquad.report(), after.imgquad.report()
    assert round(now["irregular"] * now["inner_nodes"]) <= round(was["irregular"] * was["inner_nodes"])
    assert total_length(after.imgquad.boundaries()) == pytest.approx(total_length(grid.imgquad.boundaries()))


def _on_lines(grid: pv.UnstructuredGrid) -> np.ndarray:
    lines = grid.imgquad.boundaries()
    return np.array([grid.find_closest_point(point) for point in lines.points])
