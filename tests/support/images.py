"""Small images of PyVista with known truth, and a guard for tests that render."""

from __future__ import annotations

import functools
import os
import subprocess
import sys

import numpy as np
import pytest
import pyvista as pv

ROWS, COLS = 48, 64


def labels() -> np.ndarray:
    """A square (1), a disk that overlaps its corner (2), in a matrix (0); row 0 on top, without symmetry."""
    y, x = np.mgrid[:ROWS, :COLS] + 0.5
    picture = np.zeros((ROWS, COLS), np.int32)
    picture[8:30, 10:36] = 1
    picture[(x - 40) ** 2 + (y - 30) ** 2 < 100] = 2
    return picture


def point_image(picture: np.ndarray | None = None, name: str = "label", **kwargs: object) -> pv.ImageData:
    """Return a picture as PyVista reads one: points, the top row at the largest y."""
    picture = labels() if picture is None else picture
    image = pv.ImageData(dimensions=(picture.shape[1], picture.shape[0], 1), **kwargs)
    image.point_data[name] = picture[::-1].reshape(-1, *picture.shape[2:])
    return image


def photo() -> np.ndarray:
    """RGB of `labels` with noise and specks: something to quantise and to clean."""
    rng = np.random.default_rng(7)
    colors = np.array([[40, 60, 90], [200, 190, 120], [230, 60, 40]])
    noisy = colors[labels()] + rng.normal(0, 6, (ROWS, COLS, 3))
    noisy[4:6, 50:52] = colors[1]
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def areas(grid: pv.UnstructuredGrid) -> np.ndarray:
    """Signed area of each quad seen from +z: VTK's own measures do not see a quad that runs clockwise."""
    p = np.asarray(grid.points)[grid.cells_dict[pv.CellType.QUAD]][..., :2]
    d, e = p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]
    return (d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0]) / 2


def total_length(lines: pv.PolyData) -> float:
    """Length of all lines; ``lines.length`` is the diagonal of their bounding box."""
    return float(lines.compute_cell_sizes()["Length"].sum())


def assert_same(a: pv.DataSet, b: pv.DataSet) -> None:
    """Fail unless two meshes are the same to the bit: points, cells, materials, regions."""
    assert np.array_equal(a.points, b.points)
    assert np.array_equal(a.cells, b.cells)
    for name in ("material", "region"):
        assert np.array_equal(a.cell_data[name], b.cell_data[name])
    assert list(a.field_data["material_names"]) == list(b.field_data["material_names"])


@functools.cache
def _renders() -> str:
    """Return why nothing can be drawn here, or nothing. Without its libraries VTK ends the process: ask another one."""
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    program = "import pyvista as pv; p = pv.Plotter(off_screen=True); p.add_mesh(pv.Plane()); p.screenshot()"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    return "" if done.returncode == 0 else f"VTK cannot draw here, exit code {done.returncode}: {done.stderr[-200:]}"


def need_renderer() -> None:
    """Skip the test, visibly, where VTK cannot draw."""
    reason = _renders()
    if reason:
        pytest.skip(reason)
    pv.OFF_SCREEN = True
