"""Filters of images that leave them: to the boundaries of their materials, and all at once to a mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

import imgquad_core as core
from imgquad_mesh import datasets

from .materials import columns_of, marked, warn
from .parameter_types import (
    Auto,
    Colors,
    Effort,
    Flatten,
    Marks,
    MaterialSizes,
    Merge,
    Periodic,
    Policy,
    Recolor,
    Rename,
    SizesBetween,
    Step,
    Triangulator,
    Unit,
)
from .parameters import checked, progress_of


def boundaries(
    image: pv.ImageData, scalars: str | None = None, *, policy: Policy = "minority", progress_bar: bool = False
) -> pv.PolyData:
    """Extract the boundaries between all materials as polylines along the sides and corners of pixels.

    Parameters
    ----------
    image : pyvista.ImageData
        One pixel thick; segmented first where it is not yet.
    scalars : str, optional
        Name of scalars to process. Defaults to currently active scalars.
    policy : str, default: "minority"
        What happens where two materials form a checkerboard of 2 x 2 pixels: the one with fewer pixels nearby is joined
        (``"minority"``), the other one (``"majority"``), the one of the lower number (``"lower"``), always the same
        diagonal (``"diagonal"``), or none (``"junction"``).
    progress_bar : bool, default: False
        Display a progress bar.

    Returns
    -------
    pyvista.PolyData
        One polyline cell for each chain between two junctions, or closed. Cell arrays ``boundary_labels`` (materials on
        the left and right, -1 for none, as in :meth:`pyvista.ImageDataFilters.contour_labels`), ``boundary_regions``
        and ``chain``; point array ``point_kind`` (0 inside a chain, 1 junction, 2 on the border, 3 corner).
    """
    options = core.boundary.ExtractionOptions(**checked(policy=policy))
    with progress_of(progress_bar) as begin:
        begin("boundary")
        labels = datasets.segmented(image, scalars).image
        graph = core.pipeline.extract(labels, options)
        return datasets.to_lines(datasets.Boundaries(graph, labels.materials, datasets.image_placement(image, scalars)))


def mesh(
    image: pv.ImageData,
    scalars: str | None = None,
    *,
    size: float = 4.0,
    boundary_size: float | None = None,
    frame_size: float | None = None,
    material_sizes: MaterialSizes = None,
    sizes_between: SizesBetween = None,
    growth: float = 1.3,
    colors: Colors = "auto",
    flatten: Flatten = "auto",
    marks: Marks = None,
    learn: bool = False,
    no_data: float | None = None,
    fill_void: int = 0,
    min_pixels: int | Auto = "auto",
    min_length: float | Auto = "auto",
    policy: Policy = "minority",
    edge_ratio: float = 1.2,
    max_shift: float = 1.0,
    step: Step = "auto",
    tolerance: float = 0.0,
    keep: Sequence[str | int] = (),
    join: float | None = None,
    merge: Merge = None,
    rename: Rename = None,
    recolor: Recolor = None,
    drop: Sequence[str | int] = (),
    drop_transparent: bool = False,
    periodic: Periodic = "none",
    effort: Effort = "normal",
    threads: int = 0,
    triangulator: Triangulator = "auto",
    unit: Unit = "pixels",
    sample: str | Sequence[str] = (),
    progress_bar: bool = False,
) -> pv.UnstructuredGrid:
    """Mesh the materials of a flat image with quadrilaterals: all stages in one call.

    Parameters
    ----------
    image : pyvista.ImageData
        One pixel thick, of points or cells, in any plane, with any spacing, origin and direction.
    scalars : str, optional
        Name of scalars to process: material numbers, greys, or RGB(A), of points or cells. Defaults to currently
        active scalars.
    size : float, default: 4.0
        Length of the final edges.
    boundary_size : float, optional
        The same on boundaries inside the picture.
    frame_size : float, optional
        The same on the picture's border.
    material_sizes : mapping, optional
        The same in single materials, by name or number.
    sizes_between : mapping, optional
        The same on boundaries between two materials, by pairs of names or numbers.
    growth : float, default: 1.3
        Largest ratio of the sizes of neighbouring elements.
    colors : "auto" | "exact" | "regions" | int | sequence, default: "auto"
        How colours become materials, see `segment`.
    flatten : "auto" | "off", default: "auto"
        Take uneven light out of grey images, where that separates the classes better.
    marks : str | path | array_like, optional
        Pixels whose material is known, from which materials grow, see `segment`.
    learn : bool, default: False
        Let a random forest learn from the marks what else is marked for sure (scikit-learn).
    no_data : float, optional
        Number of pixels that hold nothing (-9999, 255): they are void.
    fill_void : int, default: 0
        Void clusters (NaN, -1) of at most so many pixels go to the material with the longest common border.
    min_pixels, min_length : float | "auto", default: "auto"
        Clusters of fewer pixels that are also shorter (in pixels) are removed, see `remove_noise`.
    policy : str, default: "minority"
        Which pair is joined at an ambiguous corner of four pixels, see `boundaries`.
    edge_ratio : float, default: 1.2
        Largest ratio of the lengths of neighbouring edges on a boundary.
    max_shift : float, default: 1.0
        How far smoothing moves a boundary at most, always in data points.
    step : "auto" | float | (float, float), default: "auto"
        Width (and height) of the picture's data points, always in pixels: their stairs are smoothed as those of pixels
        are, and limits of noise count them. "auto" sees it.
    tolerance : float, default: 0.0
        Parts of the image that are thinner go to their neighbours, boundaries shorter than this between two junctions
        are joined, and outlines smoothed over half of it.
    keep : sequence, optional
        Materials that `tolerance` takes nothing from, by name or number.
    join : float, optional
        Boundaries shorter than this between two junctions are joined, where sectors around stay wide. Defaults to two
        data points, or the tolerance; 0 for none.
    merge : mapping, optional
        Materials that become one, and its name; see `merge_materials`.
    rename : mapping, optional
        Other names of materials, after merging; all other parameters call them by these.
    recolor : mapping, optional
        Other colours of materials.
    drop : sequence, optional
        Materials that are left out, by name or number.
    drop_transparent : bool, default: False
        Leave pixels of alpha 0 out, too.
    periodic : "none" | "x" | "y" | "xy", default: "none"
        Opposite sides get nodes at the same places, for a periodic cell.
    effort : "fast" | "normal" | "best", default: "normal"
        How far the mesh is optimised.
    threads : int, default: 0
        Number of threads, 0: one for each core that may be used; the mesh does not depend on it.
    triangulator : "auto" | "triangle" | "cdt", default: "auto"
        Who makes the Delaunay triangles that quads come from: Triangle (not for commercial use), CDT, or ``auto``:
        Triangle where it is installed, else CDT.
    unit : "pixels" | "world", default: "pixels"
        Unit of all sizes: sides of pixels (the shorter ones where they differ), or the unit of the image's spacing.
    sample : str | sequence, optional
        Names of arrays of the image that the cells of the mesh get too: means by area.
    progress_bar : bool, default: False
        Display a progress bar.

    Returns
    -------
    pyvista.UnstructuredGrid
        Counter-clockwise VTK_QUAD cells with the cell arrays ``material`` (int32, active) and ``region``, and the field
        arrays ``material_numbers``, ``material_names`` and ``material_colors``. It covers the bounds that
        :meth:`pyvista.ImageDataFilters.points_to_cells` gives the image (those of a cell image itself).

    Raises
    ------
    imgquad_core.errors.InputError
        The image is a stack or empty, a material does not exist, or a size cannot be met. It is a ValueError.
    TypeError, ValueError, KeyError, pyvista.core.errors.MissingDataError
        As PyVista's own filters raise them.

    Warns
    -----
    UserWarning
        Thin features force many times more quads than the area over the square of the size, a material loses half or
        more of its area to `tolerance`, or it is doubtful what the materials are.

    Examples
    --------
    >>> import numpy as np
    >>> import pyvista as pv
    >>> image = pv.ImageData(dimensions=(60, 40, 1))
    >>> image["label"] = (np.hypot(*(image.points[:, :2] - (30, 20)).T) < 12).astype(int)
    >>> mesh = image.imgquad.mesh("label", size=3)
    >>> mesh.bounds[:4]
    (-0.5, 59.5, -0.5, 39.5)
    """
    sizes = checked(size=size, boundary_size=boundary_size, frame_size=frame_size, material_sizes=material_sizes)
    sizes |= checked(sizes_between=sizes_between, tolerance=tolerance, join=join)
    values = checked(step=step, keep=keep)
    values |= checked(growth=growth, policy=policy, edge_ratio=edge_ratio, max_shift=max_shift, effort=effort)
    values |= checked(threads=threads, triangulator=triangulator, periodic=periodic)
    values |= checked(min_pixels=min_pixels, min_length=min_length, drop=drop)
    values |= checked(merge=merge, rename=rename, recolor=recolor)
    early = checked(colors=colors, flatten=flatten, learn=learn, no_data=no_data, fill_void=fill_void)
    early |= checked(drop_transparent=drop_transparent)
    early |= marked(image, scalars, marks)
    placement = datasets.image_placement(image, scalars)
    values |= in_pixels(sizes, unit, placement.pixel_size)
    options = core.MeshOptions(**values, pixel_size=placement.sides)
    columns = columns_of(image, checked(sample=sample)["sample"], scalars)
    with progress_of(progress_bar) as begin:
        begin("segment")
        found = datasets.segmented(image, scalars, core.picture.SegmentationOptions(**early))
        done = core.pipeline.run(found, options, lambda stage, *_: begin(stage))
    many = core.remedies.thin_features(done.labels, done.pixel_mesh, options)
    warn((*found.warnings, *core.remedies.lost_materials(done), *([many] if many else [])))
    grid = datasets.to_grid(done.pixel_mesh, placement.divided(done.labels.shape, done.boundary.shape))
    _sample(grid, done.pixel_mesh, columns, done.boundary.shape)
    return grid


def in_pixels(sizes: dict[str, Any], unit: Unit, pixel_size: float) -> dict[str, Any]:
    """Return sizes in pixels: a length, None, or lengths by material."""
    if checked(unit=unit)["unit"] == "pixels":
        return sizes
    return {
        name: {m: length / pixel_size for m, length in value.items()} if isinstance(value, dict)
        else None if value is None else value / pixel_size
        for name, value in sizes.items()
    }  # fmt: skip


def _sample(
    grid: pv.UnstructuredGrid, made: core.QuadMesh, columns: Mapping[str, NDArray[Any]], shape: tuple[int, int]
) -> None:
    """Put means of arrays over each quad into a grid, in place; `made` lies on a picture of `shape` (height, width)."""
    for name, values in columns.items():
        to_pixels = np.array(values.shape[1::-1]) / np.array(shape[::-1])
        grid.cell_data[name] = core.measures.area_means(values, made.points * to_pixels, made.quads)
    grid.set_active_scalars("material", preference="cell")
