"""Meshes drawn by PyVista: by material with a legend, or by quality with irregular nodes marked."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv

from imgquad_mesh.convert import materials_of
from imgquad_mesh.picture import material_colors

#: limits of the colour bar and colour map of each measure
MEASURES = {
    "scaled_jacobian": ((0.0, 1.0), "RdYlGn"),
    "min_angle": ((0.0, 90.0), "RdYlGn"),
    "max_angle": ((90.0, 180.0), "RdYlGn_r"),
    "aspect": ((1.0, 4.0), "RdYlGn_r"),
}
MOST_IN_LEGEND = 16
FEW, MANY = (0.85, 0.1, 0.1), (0.1, 0.2, 0.85)  #: colours of nodes with too few and too many quads


def add_to_plotter(
    plotter: Any,
    grid: pv.UnstructuredGrid | pv.PolyData,
    scalars: str,
    irregular: bool,
    show_edges: bool,
    **kwargs: Any,
) -> None:
    """Draw a mesh with its measures in a plotter, seen from its front."""
    if scalars == "material":
        _add_materials(plotter, grid, show_edges, **kwargs)
    else:
        limits, colors = MEASURES[scalars]
        bar = {"title": scalars.replace("_", " "), "vertical": True, "height": 0.6, "width": 0.05}
        bar |= {"position_x": 0.87, "position_y": 0.2, "title_font_size": 14, "label_font_size": 12, "fmt": "%.2g"}
        defaults = {"clim": limits, "cmap": colors, "scalar_bar_args": bar}
        plotter.add_mesh(grid, scalars=scalars, show_edges=show_edges, lighting=False, **(defaults | kwargs))
    if irregular:
        _mark_irregular(plotter, grid)
    look_at(plotter, grid)


def _add_materials(plotter: Any, grid: pv.UnstructuredGrid | pv.PolyData, show_edges: bool, **kwargs: Any) -> None:
    shown = grid.copy(deep=False)
    numbers = np.asarray(grid.cell_data["material"])
    materials = materials_of(grid)
    colors = np.round(255 * material_colors(materials)).astype(np.uint8)
    shown.cell_data["color"] = colors[np.searchsorted(materials.labels, numbers)]
    plotter.add_mesh(shown, scalars="color", rgb=True, show_edges=show_edges, lighting=False, **kwargs)
    used = [i for i, number in enumerate(materials.labels) if number in numbers][:MOST_IN_LEGEND]
    labels = [[materials.names[i], tuple(colors[i] / 255.0)] for i in used]
    size = (0.22, 0.035 * len(labels) + 0.02)
    plotter.add_legend(labels, face="rectangle", bcolor="white", loc="upper right", size=size)


def _mark_irregular(plotter: Any, grid: pv.UnstructuredGrid | pv.PolyData) -> None:
    """Mark inner nodes that have other than four quads."""
    valence, inner = np.asarray(grid.point_data["valence"]), ~on_boundary(grid)
    for name, chosen, color in (("3 or fewer quads", valence < 4, FEW), ("5 or more quads", valence > 4, MANY)):
        at = inner & chosen & (valence > 0)
        if at.any():
            plotter.add_points(
                grid.points[at], color=color, point_size=7, render_points_as_spheres=True, name=name, label=name
            )


def on_boundary(grid: pv.UnstructuredGrid | pv.PolyData) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Tell of each point whether it lies on the border or between two materials."""
    from imgquad_core.halfedge import twins_of
    from imgquad_mesh.grids import quads_of

    quads = quads_of(grid)
    twins = twins_of(quads, grid.n_points)
    material = np.asarray(grid.cell_data.get("material", np.zeros(len(quads), np.int32)))
    own = np.repeat(material, 4)
    bound = np.flatnonzero((twins < 0) | (own != material[np.maximum(twins, 0) // 4]))
    at = np.zeros(grid.n_points, bool)
    at[quads.ravel()[bound]] = at[np.roll(quads, -1, axis=1).ravel()[bound]] = True
    return at


def look_at(plotter: Any, grid: pv.UnstructuredGrid | pv.PolyData) -> None:
    """Look at a plane mesh from its front, in parallel projection, filling the window."""
    from imgquad_mesh.grids import plane_of

    plane = plane_of(grid)
    normal = np.cross(*plane.axes)
    plotter.enable_parallel_projection()
    plotter.view_vector(normal, viewup=plane.axes[1])
    plotter.reset_camera(bounds=grid.bounds)
    plotter.camera.zoom(1.1)
