"""Meshes drawn by PyVista: by material with a legend, or by quality with irregular nodes marked."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv

import imgquad_core as core
from imgquad_mesh import datasets, outputs

#: limits of the colour bar and colour map of each measure
MEASURES = {
    "scaled_jacobian": ((0.0, 1.0), "RdYlGn"),
    "min_angle": ((0.0, 90.0), "RdYlGn"),
    "max_angle": ((90.0, 180.0), "RdYlGn_r"),
    "aspect": ((1.0, 4.0), "RdYlGn_r"),
}
MOST_IN_LEGEND = 20
MARGIN = 1.06  # of the mesh's size
ROOM = 0.2  # of the width that is left for the legend
_BAR = {
    "vertical": True,
    "width": 0.04,
    "position_x": 0.84,
    "position_y": 0.05,
    "title_font_size": 18,
    "label_font_size": 14,
}
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
    style = _material_style(grid) if scalars == "material" else _measure_style(grid, scalars)
    plotter.add_mesh(**({"show_edges": show_edges, "lighting": False} | style | kwargs))
    if irregular:
        _mark_irregular(plotter, grid)
    look_at(plotter, grid)


def _material_style(grid: pv.UnstructuredGrid | pv.PolyData) -> dict[str, Any]:
    """Return what draws each material in its colour, with its name beside the mesh."""
    numbers = np.asarray(grid.cell_data["material"])
    materials = datasets.materials_of(grid)
    used, index = np.unique(np.searchsorted(materials.labels, numbers), return_inverse=True)
    colors = outputs.material_colors(materials)[used]
    names = {place: materials.names[k] for place, k in enumerate(used[:MOST_IN_LEGEND].tolist())}
    height = min(0.06 * len(used) + 0.06, 0.9)
    return {
        "mesh": grid.copy(),
        "scalars": index.ravel().astype(np.int32),
        "preference": "cell",
        "cmap": [pv.Color(color).hex_rgb for color in colors],
        "n_colors": len(used),
        "clim": (-0.5, len(used) - 0.5),
        "annotations": names,
        "show_scalar_bar": len(used) <= MOST_IN_LEGEND,
        "scalar_bar_args": _BAR | {"title": " ", "n_labels": 0, "height": height, "position_x": 0.95, "width": 0.03},
    }


def _measure_style(grid: pv.UnstructuredGrid | pv.PolyData, scalars: str) -> dict[str, Any]:
    limits, colors = MEASURES[scalars]
    bar = _BAR | {"title": scalars.replace("_", " "), "height": 0.6, "fmt": "%.2g"}
    return {"mesh": grid, "scalars": scalars, "clim": limits, "cmap": colors, "scalar_bar_args": bar}


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
    quads = datasets.quads_of(grid)
    twins = core.geometry.twins_of(quads, grid.n_points)
    material = np.asarray(grid.cell_data.get("material", np.zeros(len(quads), np.int32)))
    own = np.repeat(material, 4)
    bound = np.flatnonzero((twins < 0) | (own != material[np.maximum(twins, 0) // 4]))
    at = np.zeros(grid.n_points, bool)
    at[quads.ravel()[bound]] = at[np.roll(quads, -1, axis=1).ravel()[bound]] = True
    return at


def look_at(plotter: Any, grid: pv.UnstructuredGrid | pv.PolyData) -> None:
    """Look at a plane mesh from its front, in parallel projection, with room on the right for the legend."""
    points, plane = datasets.flattened(grid)
    low, high = points.min(axis=0), points.max(axis=0)
    left, lower, right, upper = plotter.renderer.viewport
    across = plotter.window_size[0] * (right - left) / (plotter.window_size[1] * (upper - lower))
    width, height = high - low
    scale = MARGIN * max(height, width / (across * (1.0 - ROOM))) / 2.0
    middle = plane.place(((low + high) / 2.0 + (scale * across * ROOM, 0.0))[None])[0]
    plotter.enable_parallel_projection()
    plotter.view_vector(np.cross(*plane.axes), viewup=plane.axes[1])
    plotter.camera.position = middle + np.cross(*plane.axes) * 10.0 * scale
    plotter.camera.focal_point = middle
    plotter.camera.parallel_scale = scale
