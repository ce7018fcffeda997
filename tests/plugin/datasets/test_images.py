"""Images of PyVista to arrays and back to where they lie; meshes to grids."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from pyvista.core.errors import MissingDataError

from imgquad_core.errors import InputError
from imgquad_mesh.datasets.images import image_array, image_placement

PICTURE = np.arange(24).reshape(4, 6)  # 4 rows, 6 columns


def point_image(**kwargs: object) -> pv.ImageData:
    image = pv.ImageData(dimensions=(6, 4, 1), **kwargs)
    image["label"] = PICTURE[::-1].ravel()  # VTK's first row is the lowest
    return image


def test_points_and_cells_give_the_picture_the_top_row_first() -> None:
    image = point_image()
    assert np.array_equal(image_array(image), PICTURE)
    assert np.array_equal(image_array(image.points_to_cells("label")), PICTURE)


def test_colours_keep_their_channels() -> None:
    image = point_image()
    image["rgb"] = np.arange(72, dtype=np.uint8).reshape(24, 3)
    assert image_array(image, "rgb").shape == (4, 6, 3)
    assert np.array_equal(image_array(image, "rgb")[-1, 0], [0, 1, 2])


@pytest.mark.parametrize("as_cells", [False, True])
def test_pixels_lie_in_the_bounds_of_points_to_cells(as_cells: bool) -> None:
    image = point_image(spacing=(0.5, 0.25, 1), origin=(10, 20, 5))
    cells = image.points_to_cells("label")
    place = image_placement(cells if as_cells else image).place(np.array([[0.0, 0.0], [6.0, 4.0]]))
    bounds = np.reshape(cells.bounds, (3, 2)).T
    assert place == pytest.approx(bounds)


def test_tilted_image_is_followed() -> None:
    image = point_image(spacing=(2, 2, 2), origin=(1, 2, 3))
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    image.direction_matrix = turn
    middle_of_second_pixel = image_placement(image).place(np.array([[1.5, 0.5]]))
    assert middle_of_second_pixel[0] == pytest.approx(image.points[1])
    assert not image_placement(image).mirrored
    image.direction_matrix = np.diag([-1.0, 1, 1])
    assert image_placement(image).mirrored


@pytest.mark.parametrize(("dimensions", "axes"), [((6, 1, 4), (0, 2)), ((1, 6, 4), (1, 2))])
def test_planes_that_stand_upright(dimensions: tuple[int, int, int], axes: tuple[int, int]) -> None:
    image = pv.ImageData(dimensions=dimensions)
    image["label"] = PICTURE[::-1].ravel()
    assert np.array_equal(image_array(image), PICTURE)
    assert np.flatnonzero(image_placement(image).axes.any(axis=0)).tolist() == list(axes)


def test_one_row_of_pixels_lies_in_the_plane_of_x_and_y() -> None:
    image = pv.ImageData(dimensions=(6, 1, 1))
    image["label"] = np.arange(6)
    assert image_array(image).shape == (1, 6)
    assert np.array_equal(image_placement(image).axes, [[1, 0, 0], [0, 1, 0]])


def test_stack_is_refused_with_the_way_to_a_slice() -> None:
    image = pv.ImageData(dimensions=(3, 3, 3))
    image["label"] = np.zeros(27)
    with pytest.raises(InputError, match="extract_subset"):
        image_array(image)


def test_missing_arrays() -> None:
    with pytest.raises(MissingDataError):
        image_array(pv.ImageData(dimensions=(3, 3, 1)))
    with pytest.raises(KeyError, match="nope"):
        image_array(point_image(), "nope")
