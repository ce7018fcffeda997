"""Filters of grids of quads: optimise, measure, draw. `imgquad_mesh.filters` has them, too."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, Literal, TypeAlias

import numpy as np
import pyvista as pv

import imgquad_core as core
from imgquad_mesh import datasets

from .parameter_types import Effort
from .parameters import checked, choice, progress_of
from .plotting import MEASURES, add_to_plotter

Grid: TypeAlias = "pv.UnstructuredGrid | pv.PolyData"


def optimize(
    grid: Grid, *, effort: Effort = "normal", threads: int = 0, progress_bar: bool = False
) -> pv.UnstructuredGrid:
    """Lower the number of irregular nodes of a mesh of quads and raise its worst scaled Jacobian.

    Points on the border and between materials stay where they are.

    Parameters
    ----------
    grid : pyvista.UnstructuredGrid | pyvista.PolyData
        Quads in any plane, with the cell array ``material`` (one material without it).
    effort : "fast" | "normal" | "best", default: "normal"
        How far irregular nodes are hunted.
    threads : int, default: 0
        Number of threads, 0: one for each core that may be used; the mesh does not depend on it.
    progress_bar : bool, default: False
        Display a progress bar.

    Returns
    -------
    pyvista.UnstructuredGrid
        As `mesh` gives it. Other arrays are not carried: points and cells are new.
    """
    options = core.cleanup.OptimizationOptions(**checked(effort=effort, threads=threads))
    with progress_of(progress_bar) as begin:
        begin("mesh")
        given, plane = datasets.to_mesh(grid)
        return datasets.to_grid(core.cleanup.optimize(given, options), plane)


def quality(grid: Grid) -> Grid:
    """Measure the shape of quads and the order of their points.

    Parameters
    ----------
    grid : pyvista.UnstructuredGrid | pyvista.PolyData
        Quads in any plane.

    Returns
    -------
    pyvista.UnstructuredGrid | pyvista.PolyData
        A copy with the cell arrays ``scaled_jacobian`` (active; unlike VTK's it is negative where quads turn the wrong
        way), ``min_angle``, ``max_angle`` (degrees) and ``aspect`` (longest by shortest edge), and the point array
        ``valence`` (quads at each point).

    See Also
    --------
    pyvista.DataObjectFilters.cell_quality
    """
    corners, (points, _) = datasets.quads_of(grid), datasets.flattened(grid)
    angles = core.measures.corner_angles(points, corners)
    out = grid.copy()
    out.cell_data["scaled_jacobian"] = core.measures.scaled_jacobian(points, corners)
    out.cell_data["min_angle"], out.cell_data["max_angle"] = angles.min(axis=1), angles.max(axis=1)
    out.cell_data["aspect"] = core.measures.aspect(points, corners)
    out.point_data["valence"] = np.bincount(corners.ravel(), minlength=grid.n_points).astype(np.int32)
    out.set_active_scalars("scaled_jacobian", preference="cell")
    return out


def report(grid: Grid) -> dict[str, Any]:
    """Return figures of a mesh: size, quality, and its materials.

    Parameters
    ----------
    grid : pyvista.UnstructuredGrid | pyvista.PolyData
        Quads in any plane.

    Returns
    -------
    dict
        The fields of `imgquad_core.measures.QualityReport`, and under ``materials`` for each name its ``number``,
        ``quads``, ``regions`` and ``area`` (in the unit of the points, squared).
    """
    made, _ = datasets.to_mesh(grid)
    materials = {
        made.materials.name_of(number): {
            "number": number,
            "quads": int(np.count_nonzero(made.quad_material == number)),
            "regions": int(np.count_nonzero(made.region_label == number)),
            "area": area,
        }
        for number, area in core.measures.material_areas(made).items()
    }
    return asdict(core.measures.quality_report(made)) | {"materials": materials}


def boundaries_of_mesh(grid: Grid) -> pv.PolyData:
    """Return the border of a mesh and the boundaries between its materials as polylines.

    Parameters
    ----------
    grid : pyvista.UnstructuredGrid | pyvista.PolyData
        Quads in any plane.

    Returns
    -------
    pyvista.PolyData
        One polyline for each chain between two junctions, or closed, with the arrays ``boundary_labels``, ``chain`` and
        ``point_kind`` as `boundaries` gives them.
    """
    made, plane = datasets.to_mesh(grid)
    left_right = np.append(made.region_label, np.int32(-1))[made.chain_regions]
    used, ids = np.unique(made.chain_points, return_inverse=True)
    return datasets.chain_lines(made.points[used], made.chain_offsets, ids, left_right, made.point_kind[used], plane)


def quadratic(grid: Grid, nodes: Literal[8, 9] = 8) -> pv.UnstructuredGrid:
    """Raise a mesh to second order, with the nodes on boundaries on a smooth curve.

    Parameters
    ----------
    grid : pyvista.UnstructuredGrid | pyvista.PolyData
        Quads in any plane.
    nodes : 8 | 9, default: 8
        Nodes of each element.

    Returns
    -------
    pyvista.UnstructuredGrid
        VTK_QUADRATIC_QUAD or VTK_BIQUADRATIC_QUAD cells, and the sets of the mesh as point arrays.
    """
    made, plane = datasets.to_mesh(grid)
    out = datasets.to_fe_grid(core.fe.make_elements(made, core.fe.ElementOptions(order=2, nodes=nodes)))
    out.points = plane.place(np.asarray(out.points)[:, :2])
    return out


def plot(
    grid: Grid,
    /,
    scalars: Literal["material", "scaled_jacobian", "min_angle", "max_angle", "aspect"] = "material",
    *,
    show_edges: bool = True,
    irregular: bool | None = None,
    plotter: pv.Plotter | None = None,
    off_screen: bool | None = None,
    window_size: list[int] | None = None,
    screenshot: Any = None,
    **kwargs: Any,
) -> Any:
    """Draw a mesh of quads by material with a legend, or by quality.

    Parameters
    ----------
    grid : pyvista.UnstructuredGrid | pyvista.PolyData
        Quads in any plane.
    scalars : str, default: "material"
        ``"material"``, or a measure: ``"scaled_jacobian"``, ``"min_angle"``, ``"max_angle"``, ``"aspect"``.
    show_edges : bool, default: True
        Draw the edges of the quads.
    irregular : bool, optional
        Mark inner nodes that have fewer (red) or more (blue) than four quads. Defaults to True for measures.
    plotter : pyvista.Plotter, optional
        Draw into this one and return it, without showing it.
    off_screen, window_size, screenshot
        As for :meth:`pyvista.DataSet.plot`.
    **kwargs
        Passed on to :meth:`pyvista.Plotter.add_mesh`.

    Returns
    -------
    Any
        What :meth:`pyvista.Plotter.show` returns, or `plotter`.
    """
    choice(scalars, "scalars", ["material", *MEASURES])
    target = plotter or pv.Plotter(off_screen=off_screen, window_size=window_size)
    marked = scalars != "material" if irregular is None else irregular
    add_to_plotter(target, quality(grid), scalars, marked, show_edges, **kwargs)
    return target if plotter else target.show(screenshot=screenshot)
