"""Grids of quads in any plane of space, to meshes and back."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from imgquad_core.errors import InputError
from imgquad_core.model import QuadMesh
from imgquad_mesh.convert import Placement
from imgquad_mesh.writers import from_grid

FIELDS = ("material_numbers", "material_names", "material_colors")
FLAT = 1e-6  #: largest distance from the plane, relative to the extent


def quads_of(grid: pv.UnstructuredGrid | pv.PolyData) -> NDArray[np.int64]:
    """Return the points of each quad, shape (n, 4).

    Raises
    ------
    InputError
        There are no cells, or others than quads.
    """
    if isinstance(grid, pv.PolyData):
        faces = grid.faces
        is_quads = grid.n_cells and len(faces) == 5 * grid.n_cells and (faces[::5] == 4).all()
    else:
        is_quads = grid.n_cells and (grid.celltypes == pv.CellType.QUAD).all()
    if not is_quads:
        kinds = "no cells" if not grid.n_cells else "cells that are no quads (VTK_QUAD)"
        raise InputError(f"this {type(grid).__name__} has {kinds}: give a mesh of quads only")
    cells = grid.faces if isinstance(grid, pv.PolyData) else grid.cells
    return np.asarray(cells, np.int64).reshape(-1, 5)[:, 1:]


def plane_of(grid: pv.UnstructuredGrid | pv.PolyData) -> Placement:
    """Return a plane's origin and two axes of length 1, such that most quads run counter-clockwise in it.

    Raises
    ------
    InputError
        The points are in no plane.
    """
    points = np.asarray(grid.points, np.float64)
    corners = points[quads_of(grid)]
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]).sum(axis=0)
    length = np.linalg.norm(normal)
    if length == 0.0:
        raise InputError("the quads have no area, or cancel out: mend the mesh")
    normal = normal / length
    # the axis of space that is farthest from the normal, so that grids in the plane of x and y keep their coordinates
    u = np.eye(3)[np.argmax(np.abs(np.eye(3)) @ (1.0 - np.abs(normal)))]
    u = u - (u @ normal) * normal
    u = u / np.linalg.norm(u)
    origin = normal * (points[0] @ normal)
    away = np.abs((points - origin) @ normal).max()
    if away > FLAT * np.ptp(points, axis=0).max():
        raise InputError(f"points are up to {away:g} away from a plane: flatten the mesh first")
    return Placement(origin, np.stack([u, np.cross(normal, u)]))


def flattened(grid: pv.UnstructuredGrid | pv.PolyData) -> tuple[NDArray[np.float64], Placement]:
    """Return the points of a grid in its plane, shape (n, 2), and the plane."""
    plane = plane_of(grid)
    return (np.asarray(grid.points, np.float64) - plane.origin) @ plane.axes.T, plane


def to_mesh(grid: pv.UnstructuredGrid | pv.PolyData) -> tuple[QuadMesh, Placement]:
    """Return the mesh of a grid, regions and boundaries found anew, and the plane that it lies in."""
    flat, plane = flattened(grid)
    # not a copy of the grid: setting the points of a shallow one moves the grid itself
    level = pv.UnstructuredGrid({pv.CellType.QUAD: quads_of(grid)}, np.column_stack([flat, np.zeros(len(flat))]))
    if "material" in grid.cell_data:
        level.cell_data["material"] = grid.cell_data["material"]
    for name in FIELDS:
        if name in grid.field_data:
            level.field_data[name] = grid.field_data[name]
    return from_grid(level, folded=True), plane
