"""Between PyVista's datasets and the values of the core."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from pyvista.core.errors import MissingDataError

from imgquad_core.errors import InputError

if TYPE_CHECKING:
    from imgquad_core.model import Materials, QuadMesh


@dataclass(frozen=True, eq=False)
class Placement:
    """Where the pixels of an image lie in space.

    Parameters
    ----------
    origin : float64, shape (3,)
        The image's lower left corner, half a pixel from the centre of its first pixel.
    axes : float64, shape (2, 3)
        One pixel to the right, one pixel up.
    """

    origin: NDArray[np.float64]
    axes: NDArray[np.float64]

    @property
    def mirrored(self) -> bool:
        """Whether a counter-clockwise quad of the picture runs clockwise when seen from above."""
        return bool(np.cross(*self.axes)[2] < 0)

    @property
    def pixel_size(self) -> float:
        """Length of the shorter side of a pixel."""
        return float(np.linalg.norm(self.axes, axis=1).min())

    def place(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points in space, shape (n, 3), of points in pixels, shape (n, 2)."""
        return self.origin + points @ self.axes


#: pixels are unit squares from (0, 0) on
PLAIN = Placement(np.zeros(3), np.eye(2, 3))


def image_array(image: pv.ImageData, scalars: str | None = None) -> NDArray[Any]:
    """Return the picture in a flat image: shape (rows, columns) or (rows, columns, channels), the top row first.

    Parameters
    ----------
    image : pyvista.ImageData
        With one pixel along one of its axes.
    scalars : str, optional
        Name of the array, of points or cells; by default the active one.

    Raises
    ------
    InputError
        The image is a volume or has no pixels.
    KeyError
        It has no array of this name.
    pyvista.core.errors.MissingDataError
        It has no array at all.
    """
    name, association = scalars_of(image, scalars)
    u, v = flat_axes(image, name, association)
    values = np.asarray(image.point_data[name] if association == "point" else image.cell_data[name])
    counts = _pixel_counts(image, association)
    return np.ascontiguousarray(values.reshape(counts[v], counts[u], *values.shape[1:])[::-1])


def image_placement(image: pv.ImageData, scalars: str | None = None) -> Placement:
    """Return where the pixels of a flat image lie; a point of the image is the centre of its pixel."""
    name, association = scalars_of(image, scalars)
    plane = list(flat_axes(image, name, association))
    matrix = np.asarray(image.index_to_physical_matrix)
    first = np.array(image.extent[::2], float)
    if association == "point":
        first[plane] -= 0.5
    return Placement(matrix[:3, :3] @ first + matrix[:3, 3], matrix[:3, plane].T)


def flat_axes(image: pv.ImageData, name: str, association: str) -> tuple[int, int]:
    """Return the axes that a flat image runs along: of the columns and of the rows."""
    counts = _pixel_counts(image, association)
    if min(counts) < 1:
        raise InputError(f"image '{name}' has {' x '.join(map(str, counts))} pixels: there is nothing to mesh")
    thin = [axis for axis in (2, 1, 0) if counts[axis] == 1]
    if not thin:
        raise InputError(
            f"image '{name}' is a stack of {' x '.join(map(str, counts))} voxels: give one slice, "
            "for example image.extract_subset((x0, x1, y0, y1, k, k))"
        )
    u, v = (axis for axis in range(3) if axis != thin[0])
    return u, v


def to_grid(mesh: QuadMesh, placement: Placement = PLAIN) -> pv.UnstructuredGrid:
    """Return a grid of counter-clockwise VTK_QUAD cells.

    Cell arrays `material` (int32, active) and `region` (int32); field arrays `material_numbers` (int32),
    `material_names` and `material_colors` (uint8 RGB), one entry a material.
    """
    quads = mesh.quads[:, ::-1] if placement.mirrored else mesh.quads
    grid = pv.UnstructuredGrid({pv.CellType.QUAD: quads}, placement.place(mesh.points))
    grid.cell_data["region"] = mesh.quad_region.astype(np.int32)
    grid.cell_data["material"] = mesh.quad_material
    put_materials(grid, mesh.materials)
    grid.set_active_scalars("material", preference="cell")
    return grid


def chain_lines(
    points: NDArray[np.float64],
    offsets: NDArray[np.int64],
    chain_points: NDArray[np.int64],
    left_right: NDArray[np.int32],
    point_kind: NDArray[np.uint8],
    placement: Placement = PLAIN,
) -> pv.PolyData:
    """Return chains as polylines with the cell arrays `boundary_labels` (left, right; -1 for none) and `chain`."""
    counts = np.diff(offsets)
    lines = np.insert(chain_points, offsets[:-1], counts)
    poly = pv.PolyData(placement.place(points), lines=lines)
    poly.cell_data["chain"] = np.arange(len(counts), dtype=np.int32)
    poly.cell_data["boundary_labels"] = left_right
    poly.point_data["point_kind"] = point_kind
    return poly


def put_materials(dataset: pv.DataSet, materials: Materials) -> None:
    """Store what the materials are called in the field arrays of a dataset, in place."""
    dataset.field_data["material_numbers"] = materials.labels
    dataset.field_data["material_names"] = list(materials.names)
    dataset.field_data["material_colors"] = materials.colors


def materials_of(dataset: pv.DataSet) -> Materials:
    """Return what `put_materials` stored."""
    from imgquad_core.model import Materials

    fields = dataset.field_data
    return Materials(fields["material_numbers"], tuple(map(str, fields["material_names"])), fields["material_colors"])


def scalars_of(image: pv.ImageData, scalars: str | None = None) -> tuple[str, str]:
    """Return the name and the association ("point" or "cell") of the array that is processed."""
    if scalars is None:
        image = image.copy(deep=False)  # what is chosen must not become active in the input
        pv.set_default_active_scalars(image)
        scalars = image.active_scalars_name
        if scalars is None:
            raise MissingDataError("No data available.")
        return scalars, "point" if image.active_scalars_info.association.name == "POINT" else "cell"
    association = image.get_array_association(scalars, preference="point").name
    if association not in ("POINT", "CELL"):
        raise KeyError(f"Data array ({scalars}) not present in this dataset.")
    return scalars, association.lower()


def _pixel_counts(image: pv.ImageData, association: str) -> tuple[int, int, int]:
    nx, ny, nz = image.dimensions
    return (nx, ny, nz) if association == "point" else (max(nx - 1, 1), max(ny - 1, 1), max(nz - 1, 1))
