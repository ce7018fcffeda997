"""Filters of boundaries: smooth them, fill them with quads."""

from __future__ import annotations

from typing import Any, Literal

import pyvista as pv

import imgquad_core as core
from imgquad_core.errors import InputError
from imgquad_mesh import datasets

from .images import in_pixels
from .parameter_types import Effort, MaterialSizes, Periodic, SizesBetween, Step, Triangulator, Unit
from .parameters import checked, progress_of


def smooth(
    lines: pv.PolyData,
    size: float = 4.0,
    *,
    boundary_size: float | None = None,
    frame_size: float | None = None,
    material_sizes: MaterialSizes = None,
    sizes_between: SizesBetween = None,
    growth: float = 1.3,
    edge_ratio: float = 1.2,
    max_shift: float = 1.0,
    step: Step = "auto",
    tolerance: float = 0.0,
    join: float | None = None,
    edge_multiple: Literal[4, 12] = 4,
    threads: int = 0,
    periodic: Periodic = "none",
    unit: Unit = "pixels",
    progress_bar: bool = False,
) -> pv.PolyData:
    """Smooth boundaries of materials and cut them into edges of the wanted length.

    Corners stay sharp, regions keep their areas, and no two boundaries cross or touch.

    Parameters
    ----------
    lines : pyvista.PolyData
        What `boundaries` gave.
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
    edge_ratio : float, default: 1.2
        Largest ratio of the lengths of neighbouring edges on a boundary.
    max_shift : float, default: 1.0
        How far a boundary moves at most, always in data points.
    step : "auto" | float | (float, float), default: "auto"
        Width (and height) of the picture's data points, always in pixels: their stairs are smoothed as those of pixels
        are, and limits of noise count them. "auto" sees it.
    tolerance : float, default: 0.0
        Outlines are smoothed over half of it, and boundaries shorter than it joined; `mesh` absorbs thin parts, too.
    join : float, optional
        Boundaries shorter than this between two junctions are joined, where sectors around stay wide. Defaults to two
        data points, or the tolerance; 0 for none.
    edge_multiple : 4 | 12, default: 4
        Very long boundaries get a multiple of this many edges, up to 10 % off the size: with 12 and effort "best" the
        quads of very wide regions are then split in nine.
    threads : int, default: 0
        Number of threads, 0: one for each core that may be used; the boundaries do not depend on it.
    periodic : "none" | "x" | "y" | "xy", default: "none"
        Opposite sides get nodes at the same places, for a periodic cell.
    unit : "pixels" | "world", default: "pixels"
        Unit of all sizes: sides of pixels (the shorter ones where they differ), or the unit of the image's spacing.
    progress_bar : bool, default: False
        Display a progress bar.

    Returns
    -------
    pyvista.PolyData
        The boundaries that are meshed, with the same arrays.
    """
    values = checked(growth=growth, edge_ratio=edge_ratio, max_shift=max_shift, edge_multiple=edge_multiple, step=step)
    sizes = checked(size=size, boundary_size=boundary_size, frame_size=frame_size, material_sizes=material_sizes)
    sizes |= checked(sizes_between=sizes_between, tolerance=tolerance, join=join)
    values |= checked(threads=threads)
    repeat = checked(periodic=periodic)["periodic"]
    given = datasets.from_lines(lines)
    if given.sizes is not None:
        raise InputError("these boundaries are smooth already: smooth those that image.imgquad.boundaries() gave")
    sizes = in_pixels(sizes, unit, given.placement.pixel_size)
    sizes["material_sizes"] = core.picture.sizes_by_number(given.materials, sizes["material_sizes"])
    sizes["sizes_between"] = core.picture.sizes_by_numbers(given.materials, sizes["sizes_between"])
    options = core.boundary.SmoothingOptions(**sizes, **values)
    with progress_of(progress_bar) as begin:
        begin("smooth")
        shape = given.graph.shape
        graph = core.pipeline.smooth(
            given.graph, options, core.boundary.true_shape(shape, given.placement.sides), repeat
        )
        return datasets.to_lines(
            given._replace(
                graph=graph,
                placement=given.placement.divided(shape, graph.shape),
                sizes=(options.size, options.growth, dict(options.material_sizes or {})),
                periodic=repeat,
            )
        )


def quads(
    lines: pv.PolyData,
    size: float | None = None,
    *,
    material_sizes: MaterialSizes = None,
    growth: float | None = None,
    effort: Effort = "normal",
    threads: int = 0,
    triangulator: Triangulator = "auto",
    unit: Unit = "pixels",
    progress_bar: bool = False,
) -> pv.UnstructuredGrid:
    """Fill smoothed boundaries with quadrilaterals.

    Parameters
    ----------
    lines : pyvista.PolyData
        What `smooth` gave.
    size : float, optional
        Length of the final edges inside. Defaults to that of the boundaries' smoothing, as do the next two.
    material_sizes : mapping, optional
        The same in single materials, by name or number.
    growth : float, optional
        Largest ratio of the sizes of neighbouring elements.
    effort : "fast" | "normal" | "best", default: "normal"
        How far the mesh is optimised.
    threads : int, default: 0
        Number of threads, 0: one for each core that may be used; the mesh does not depend on it.
    triangulator : "auto" | "triangle" | "cdt", default: "auto"
        Who makes the Delaunay triangles that quads come from, see `mesh`.
    unit : "pixels" | "world", default: "pixels"
        Unit of the sizes, see `smooth`.
    progress_bar : bool, default: False
        Display a progress bar.

    Returns
    -------
    pyvista.UnstructuredGrid
        As `mesh` gives it.
    """
    given = datasets.from_lines(lines)
    if given.sizes is None:
        raise InputError("these boundaries are not smoothed: call .imgquad.smooth(size=...) on them first")
    values: dict[str, Any] = dict(zip(("size", "growth", "material_sizes"), given.sizes, strict=True))
    asked = {"size": size, "material_sizes": material_sizes}
    sizes = checked(**{name: value for name, value in asked.items() if value is not None})
    values |= in_pixels(sizes, unit, given.placement.pixel_size)
    values["material_sizes"] = core.picture.sizes_by_number(given.materials, values["material_sizes"])
    values |= checked(effort=effort, threads=threads, triangulator=triangulator)
    values |= {} if growth is None else checked(growth=growth)
    options = core.mesher.MeshingOptions(**values)
    with progress_of(progress_bar) as begin:
        begin("mesh")
        _, made = core.pipeline.fill_boundaries(given.graph, options, given.materials, given.periodic)
        return datasets.to_grid(made, given.placement)
