"""The accessor `.imgquad` on PyVista's images."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
import pyvista as pv

from imgquad_core.errors import InputError


@pytest.fixture
def disc() -> pv.ImageData:
    image = pv.ImageData(dimensions=(60, 40, 1))
    image["label"] = np.where(np.hypot(*(image.points[:, :2] - (25, 24)).T) < 11, 3, 1)
    return image


def shoelace(grid: pv.UnstructuredGrid) -> np.ndarray:
    p = grid.points[grid.cells_dict[pv.CellType.QUAD]][..., :2]
    d, e = p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]
    return (d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0]) / 2


def test_mesh_covers_the_cells_bounds_with_quads(disc: pv.ImageData) -> None:
    grid = disc.imgquad.mesh(size=3)
    assert set(grid.celltypes) == {pv.CellType.QUAD}
    assert grid.bounds == pytest.approx(disc.points_to_cells("label").bounds)
    assert shoelace(grid).min() > 0
    assert grid.active_scalars_name == "material"
    assert grid.cell_data["material"].dtype == np.int32
    assert set(grid.cell_data["material"]) == {1, 3}
    inside = grid.extract_cells(grid["material"] == 3)
    assert inside.center == pytest.approx((25, 24, 0), abs=0.05)
    assert grid.validate_mesh().is_valid


def test_names_and_colors_travel(disc: pv.ImageData) -> None:
    grid = disc.imgquad.mesh()
    assert grid.field_data["material_numbers"].tolist() == [1, 3]
    assert len(grid.field_data["material_names"]) == 2
    assert grid.field_data["material_colors"].shape == (2, 3)


def test_input_is_untouched(disc: pv.ImageData) -> None:
    before = disc.copy()
    disc.imgquad.mesh(size=4)
    assert disc == before
    assert disc.active_scalars_name == before.active_scalars_name


def test_cells_and_points_give_the_same_mesh(disc: pv.ImageData) -> None:
    of_points, of_cells = disc.imgquad.mesh(), disc.points_to_cells("label").imgquad.mesh()
    assert np.array_equal(of_points.points, of_cells.points)
    assert np.array_equal(of_points.cells, of_cells.cells)


def test_mirrored_image_keeps_quads_counter_clockwise(disc: pv.ImageData) -> None:
    disc.direction_matrix = np.diag([-1.0, 1, 1])
    grid = disc.imgquad.mesh()
    assert shoelace(grid).min() > 0
    assert grid.bounds == pytest.approx(disc.points_to_cells("label").bounds)


def test_bad_size_is_a_value_error(disc: pv.ImageData) -> None:
    with pytest.raises(ValueError, match="size is 0"):
        disc.imgquad.mesh(size=0)
    with pytest.raises(InputError, match="gold"):
        disc.imgquad.mesh(material_sizes={"gold": 1})


def test_nothing_heavy_is_loaded_before_the_first_mesh() -> None:
    """PyVista finds the accessor by itself; registration costs under 50 ms and leaves Numba alone."""
    script = """
import sys, time
import pyvista as pv
image = pv.ImageData(dimensions=(4, 4, 1))
start = time.perf_counter()
image.imgquad
took = time.perf_counter() - start
from imgquad_mesh.__main__ import build_parser
build_parser().format_help()
print(took, "numba" in sys.modules)
"""
    out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    seconds, numba_loaded = out.split()
    assert numba_loaded == "False"
    assert float(seconds) < 0.05
