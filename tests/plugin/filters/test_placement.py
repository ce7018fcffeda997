"""Where images lie: spacing, origin, direction, plane; the mesh lies there too, in true shape."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from scipy.ndimage import gaussian_filter

from imgquad_core.errors import InputError
from support.images import COLS, ROWS, areas, assert_same, labels, point_image

TURNED = pv.Transform().rotate_vector((1, 2, 3), 40).matrix[:3, :3]
PLACES = {
    "plain": {},
    "scaled": {"spacing": (0.25, 0.25, 3)},
    "far away": {"origin": (1e4, -2e4, 7.5)},
    "wide pixels": {"spacing": (2.0, 1.0, 1.0)},
    "tall pixels": {"spacing": (0.1, 0.13, 1.0)},
    "mirrored": {"direction_matrix": np.diag([-1.0, 1, 1])},
    "on its head": {"direction_matrix": np.diag([1.0, -1, -1])},
    "tilted": {"spacing": (0.5, 0.5, 1), "origin": (1, 2, 3), "direction_matrix": TURNED},
}


@pytest.mark.parametrize("place", PLACES.values(), ids=PLACES)
@pytest.mark.parametrize("as_cells", [False, True])
def test_mesh_covers_the_bounds_and_every_material_its_pixels(place: dict, as_cells: bool) -> None:
    image = point_image(**place)
    cells = image.points_to_cells("label")
    grid = (cells if as_cells else image).imgquad.mesh("label", size=3)
    extent = np.ptp(np.reshape(cells.bounds, (3, 2)), axis=1).max()
    assert np.allclose(grid.bounds, cells.bounds, rtol=0, atol=1e-9 * extent)
    assert grid.validate_mesh().is_valid
    to_index = np.linalg.inv(cells.index_to_physical_matrix)
    column, row, _ = np.floor(to_index[:3, :3] @ np.asarray(grid.cell_centers().points).T + to_index[:3, 3:]).astype(
        int
    )
    same = labels()[::-1][row, column] == grid["material"]
    assert same.mean() > 0.97  # not where a centre lies within a pixel of a boundary
    if not np.array_equal(place.get("direction_matrix"), TURNED):
        assert areas(grid).min() > 0


@pytest.mark.parametrize(("dimensions", "up", "thin"), [((COLS, 1, ROWS), 2, 1), ((1, COLS, ROWS), 2, 0)])
def test_images_in_upright_planes(dimensions: tuple[int, int, int], up: int, thin: int) -> None:
    image = pv.ImageData(dimensions=dimensions, origin=(5, 6, 7), spacing=(2, 2, 2))
    image["label"] = labels()[::-1].ravel()
    grid = image.imgquad.mesh(size=4)
    assert np.ptp(np.asarray(grid.points)[:, thin]) == 0
    assert grid.bounds[2 * up : 2 * up + 2] == pytest.approx((7 - 1, 7 + 2 * ROWS - 1))
    flat = point_image(spacing=(2, 2, 2)).imgquad.mesh(size=4)
    assert np.array_equal(flat["material"], grid["material"])
    assert np.array_equal(flat.cells, grid.cells)
    for made in (grid.imgquad.quality()["scaled_jacobian"], grid.cell_quality("scaled_jacobian")["scaled_jacobian"]):
        assert made == pytest.approx(flat.imgquad.quality()["scaled_jacobian"])
    assert grid.imgquad.optimize().bounds == pytest.approx(grid.bounds)


def test_stretched_pixels_are_meshed_in_true_shape() -> None:
    """A disk in pixels twice as wide as high is meshed like the same disk in square pixels."""
    y, x = np.mgrid[:60, :120] + 0.5
    disk = ((x - 60) ** 2 + (y - 30) ** 2 < 400).astype(int)
    square = point_image(disk)
    y, x = np.mgrid[:60, :60] + 0.5
    wide = point_image(((2 * x - 60) ** 2 + (y - 30) ** 2 < 400).astype(int), spacing=(2, 1, 1))
    a, b = square.imgquad.mesh(size=4), wide.imgquad.mesh(size=4)
    assert b.n_cells == pytest.approx(a.n_cells, rel=0.15)
    for grid in (a, b):
        quality = grid.imgquad.quality()
        assert quality["aspect"].mean() < 1.4
        assert quality["scaled_jacobian"].min() > 0.5
        assert areas(grid)[grid["material"] == 1].sum() == pytest.approx(400 * np.pi, rel=0.02)


def test_sizes_in_the_unit_of_the_world() -> None:
    image, fine = point_image(), point_image(spacing=(0.01, 0.01, 1))
    same = fine.imgquad.mesh(size=0.03, unit="world")
    other = fine.imgquad.mesh(size=3)
    assert same.n_cells == pytest.approx(image.imgquad.mesh(size=3).n_cells, rel=0.02)  # 0.03 / 0.01 is not quite 3
    assert other.n_cells == pytest.approx(same.n_cells, rel=0.02)
    sizes = {"boundary_size": 0.02, "material_sizes": {1: 0.015}}
    assert fine.imgquad.mesh(size=0.03, unit="world", **sizes).n_cells > 1.3 * other.n_cells


def test_dots_per_inch_of_a_tiff_give_millimetres(tmp_path: object) -> None:
    from PIL import Image

    path = f"{tmp_path}/a.tif"
    Image.fromarray(labels().astype(np.uint8)).save(path, dpi=(254, 254))
    image = pv.read(path)
    assert image.spacing[0] == pytest.approx(0.1)
    grid = image.imgquad.mesh(size=4)
    assert grid.bounds[1] - grid.bounds[0] == pytest.approx(0.1 * COLS)
    again = point_image(labels().astype(np.uint8), spacing=image.spacing)
    assert_same(grid, again.imgquad.mesh(size=4))


def test_part_of_an_image_lies_where_it_was() -> None:
    image = point_image(spacing=(0.5, 0.5, 1))
    part = image.extract_subset((10, 40, 5, 44, 0, 0))
    grid = part.imgquad.mesh(size=3)
    assert grid.bounds[:4] == pytest.approx((10 * 0.5 - 0.25, 40 * 0.5 + 0.25, 5 * 0.5 - 0.25, 44 * 0.5 + 0.25))


def test_absurd_spacing_is_refused() -> None:
    image = point_image(spacing=(1, 1e9, 1))
    with pytest.raises(InputError, match=r"would need about .* or mend its spacing"):
        image.imgquad.mesh()


def test_a_slice_of_a_stack_lies_at_its_height() -> None:
    stack = pv.ImageData(dimensions=(COLS, ROWS, 3), spacing=(1, 1, 2))
    stack["label"] = np.stack([labels()[::-1]] * 3).ravel()
    with pytest.raises(InputError, match=r"extract_subset\(\(x0, x1, y0, y1, k, k\)\)"):
        stack.imgquad.mesh()
    grid = stack.extract_subset((0, COLS - 1, 0, ROWS - 1, 2, 2)).imgquad.mesh()
    assert set(np.asarray(grid.points)[:, 2]) == {4.0}


@pytest.mark.parametrize("seed", [3, 22])
def test_long_pixels_of_a_speckled_picture(seed: int) -> None:
    """Pixels eight times as high as wide, thin regions everywhere: the boundary still never crosses itself."""
    rough = gaussian_filter(np.random.default_rng(seed).normal(size=(20, 12)), 0.8)
    picture = np.digitize(rough, [-0.1, 0.1]).astype(np.int32)
    image = point_image(picture, spacing=(1, 8, 1))
    grid = image.imgquad.mesh(size=2)
    assert areas(grid).min() > 0
    assert areas(grid).sum() == pytest.approx(8 * picture.size)
    assert grid.validate_mesh().is_valid
