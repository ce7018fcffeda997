"""Filters of boundaries: smooth them, fill them with quads."""

from __future__ import annotations

from typing import Any, Literal

import pyvista as pv

import imgquad_core as core
from imgquad_core.errors import InputError
from imgquad_mesh.datasets.grids import to_grid
from imgquad_mesh.datasets.lines import from_lines, to_lines
from imgquad_mesh.progress import progress_of

from .grids import Effort
from .images import MaterialSizes, Periodic, Triangulator, Unit, in_pixels
from .parameters import checked


def smooth(
    lines: pv.PolyData,
    size: float = 4.0,
    *,
    boundary_size: float | None = None,
    material_sizes: MaterialSizes = None,
    growth: float = 1.3,
    edge_ratio: float = 1.2,
    max_shift: float = 1.0,
    edge_multiple: Literal[4, 12] = 4,
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
        The same on boundaries.
    material_sizes : mapping, optional
        The same in single materials, by name or number.
    growth : float, default: 1.3
        Largest ratio of the sizes of neighbouring elements.
    edge_ratio : float, default: 1.2
        Largest ratio of the lengths of neighbouring edges on a boundary.
    max_shift : float, default: 1.0
        How far a boundary moves at most, always in pixels.
    edge_multiple : 4 | 12, default: 4
        Very long boundaries get a multiple of this many edges, up to 10 % off the size: with 12 and effort "best" the
        quads of very wide regions are then split in nine.
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
    values = checked(growth=growth, edge_ratio=edge_ratio, max_shift=max_shift, edge_multiple=edge_multiple)
    sizes = checked(size=size, boundary_size=boundary_size, material_sizes=material_sizes)
    repeat = checked(periodic=periodic)["periodic"]
    given = from_lines(lines)
    if given.sizes is not None:
        raise InputError("these boundaries are smooth already: smooth those that image.imgquad.boundaries() gave")
    sizes = in_pixels(sizes, unit, given.placement.pixel_size)
    sizes["material_sizes"] = core.picture.sizes_by_number(given.materials, sizes["material_sizes"])
    options = core.boundary.SmoothingOptions(**sizes, **values)
    with progress_of(progress_bar) as begin:
        begin("smooth")
        shape = given.graph.shape
        graph = core.pipeline.smooth(
            given.graph, options, core.boundary.true_shape(shape, given.placement.sides), repeat
        )
        return to_lines(
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
    threads: int = 1,
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
    threads : int, default: 1
        Number of threads; the mesh does not depend on it.
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
    given = from_lines(lines)
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
        return to_grid(made, given.placement)
