"""Pictures of meshes, drawn off screen and looked at by their colours."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

from support.images import labels, need_renderer, point_image

COLORS = np.array([[250, 200, 60], [40, 90, 200], [40, 170, 70]], np.uint8)


@pytest.fixture(scope="module", autouse=True)
def _renders() -> None:
    need_renderer()


@pytest.fixture(scope="module")
def grid() -> pv.UnstructuredGrid:
    return point_image(COLORS[labels()]).imgquad.mesh(size=4)


def drawn(grid: pv.UnstructuredGrid, *args: object, **kwargs: object) -> np.ndarray:
    plotter = pv.Plotter(off_screen=True, window_size=[400, 320])
    grid.imgquad.plot(*args, plotter=plotter, **kwargs)
    picture = plotter.screenshot(return_img=True)
    plotter.close()
    return picture


def share(picture: np.ndarray, color: np.ndarray | list[int], tolerance: int = 12) -> float:
    """Share of the picture's pixels that have a colour."""
    return float((np.abs(picture.astype(int) - np.asarray(color, int)).max(axis=2) <= tolerance).mean())


def test_materials_have_their_colours_and_areas(grid: pv.UnstructuredGrid) -> None:
    picture = drawn(grid, show_edges=False)
    found = np.array([share(picture, color) for color in COLORS])
    expected = np.bincount(labels().ravel()) / labels().size
    assert found.sum() > 0.4  # the mesh fills the window
    assert found / found.sum() == pytest.approx(expected, abs=0.03)  # the legend covers some of it
    with_edges = drawn(grid)
    assert share(with_edges, [0, 0, 0], 60) > share(picture, [0, 0, 0], 60) + 0.02


def test_measure_marks_irregular_nodes(grid: pv.UnstructuredGrid) -> None:
    marked, plain = (drawn(grid, "scaled_jacobian", irregular=mark, show_edges=False) for mark in (None, False))
    valence = grid.imgquad.quality().point_data["valence"]
    assert (valence > 4).any()  # there is something to mark
    changed = (marked.astype(int) - plain.astype(int) != 0).any(axis=2)
    assert 0 < changed.mean() < 0.05


def test_upright_mesh_is_seen_from_its_front() -> None:
    image = pv.ImageData(dimensions=(64, 1, 48))
    image["rgb"] = COLORS[labels()][::-1].reshape(-1, 3)
    picture = drawn(image.imgquad.mesh(size=4), show_edges=False)
    assert share(picture, COLORS[0]) > 0.25


def test_show_returns_what_pyvista_returns(grid: pv.UnstructuredGrid, tmp_path: object) -> None:
    grid.imgquad.plot(off_screen=True, window_size=[200, 160], screenshot=f"{tmp_path}/a.png")
    assert pv.read(f"{tmp_path}/a.png").dimensions == (200, 160, 1)
