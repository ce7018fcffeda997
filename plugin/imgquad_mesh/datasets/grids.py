"""Grids of quads in any plane of space, to meshes and back."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

import imgquad_core as core
from imgquad_core.errors import InputError
from imgquad_core.model import QuadMesh
from imgquad_core.writers.common import safe_names

from .fields import MATERIAL_FIELDS, materials_of, put_materials
from .placement import PLAIN, Placement
from .quad_grids import quad_grid

FLAT = 1e-6  #: largest distance from the plane, relative to the extent
#: VTK cell of each element kind
CELLS = {
    "tri3": pv.CellType.TRIANGLE,
    "quad4": pv.CellType.QUAD,
    "quad8": pv.CellType.QUADRATIC_QUAD,
    "quad9": pv.CellType.BIQUADRATIC_QUAD,
    "hex8": pv.CellType.HEXAHEDRON,
}
COHESIVE_CELLS = {4: pv.CellType.QUAD, 6: pv.CellType.QUADRATIC_LINEAR_QUAD, 8: pv.CellType.HEXAHEDRON}


def to_grid(mesh: QuadMesh, placement: Placement = PLAIN) -> pv.UnstructuredGrid:
    """Return a grid of counter-clockwise VTK_QUAD cells.

    Cell arrays `material` (int32, active) and `region` (int32); field arrays `material_numbers` (int32),
    `material_names` and `material_colors` (uint8 RGB), one entry a material. Of grains also the cell array
    `orientation` (Bunge's Euler angles, degrees, shape (n, 3)) and the field arrays `material_phases` and
    `material_orientations`.
    """
    return pv.UnstructuredGrid(quad_grid(mesh, placement))


def quads_of(grid: pv.DataObject) -> NDArray[np.int64]:
    """Return the points of each quad, shape (n, 4).

    Raises
    ------
    InputError
        There are no cells, or others than quads.
    """
    if isinstance(grid, pv.UnstructuredGrid):
        n_quads, cells = int((grid.celltypes == pv.CellType.QUAD).sum()), grid.cells
    elif isinstance(grid, pv.PolyData):
        cells = grid.faces
        n_quads = grid.n_cells if len(cells) == 5 * grid.n_cells and (cells[::5] == 4).all() else 0
    else:
        raise InputError(f"{type(grid).__name__} holds no quads: give an UnstructuredGrid or PolyData")
    if n_quads != grid.n_cells or n_quads == 0:
        raise InputError(
            f"{grid.n_cells - n_quads} of {grid.n_cells} cells are no quads (VTK_QUAD): extract the quads, "
            "or mesh the picture with image.imgquad.mesh()"
        )
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
    for name in MATERIAL_FIELDS:
        if name in grid.field_data:
            level.GetFieldData().AddArray(grid.GetFieldData().GetAbstractArray(name))
    return from_grid(level, folded=True), plane


def from_grid(dataset: Any, *, folded: bool = False) -> QuadMesh:
    """Return the mesh in a flat grid of quads, the inverse of `to_grid`; see `trace_mesh`."""
    points = np.asarray(dataset.points, np.float64)
    if len(points) and np.ptp(points[:, 2]) > 1e-9 * max(np.ptp(points[:, :2]), 1e-300):
        raise InputError("the mesh is not in a plane z = constant: turn it there first, for example rotate_x(90)")
    quads = quads_of(dataset)
    used, numbered = np.unique(quads, return_inverse=True)
    cell_data = dataset.cell_data
    material = np.asarray(cell_data["material"]) if "material" in cell_data else np.zeros(len(quads), np.int32)
    corners, materials = numbered.reshape(-1, 4), materials_of(dataset, material)
    return core.tracing.trace_mesh(points[used, :2], corners, material, materials, folded=folded)


def to_fe_grid(mesh: core.fe.FEMesh) -> pv.UnstructuredGrid:
    """Return a grid of all elements of `mesh`.

    Cell arrays `material` (int32; -1 of cohesive elements), `region` and, if there are cohesive elements,
    `cohesive_pair` (the materials below and above, -1 of others); point arrays ``set left`` and so on (uint8,
    1 in the set); field arrays `material_numbers`, `material_names`, `material_colors`.
    """
    points = mesh.points if mesh.dimension == 3 else np.column_stack([mesh.points, np.zeros(mesh.n_points)])
    kinds = [np.full(mesh.n_cells, CELLS[mesh.kind]), np.full(len(mesh.cohesive), 0)]
    rows = [np.insert(mesh.cells, 0, mesh.cells.shape[1], axis=1).ravel()]
    if len(mesh.cohesive):
        width = mesh.cohesive.shape[1]
        kinds[1][:] = COHESIVE_CELLS[width]
        rows.append(np.insert(mesh.cohesive, 0, width, axis=1).ravel())
    grid = pv.UnstructuredGrid(np.concatenate(rows), np.concatenate(kinds).astype(np.uint8), points)
    none = np.full(len(mesh.cohesive), -1)
    grid.cell_data["region"] = np.concatenate([mesh.cell_region, none]).astype(np.int32)
    grid.cell_data["material"] = np.concatenate([mesh.cell_material, none]).astype(np.int32)
    if len(mesh.cohesive):
        solid = np.full((mesh.n_cells, 2), -1, np.int32)
        grid.cell_data["cohesive_pair"] = np.concatenate([solid, mesh.cohesive_pair])
    for name, ids in mesh.node_sets.items():
        member = np.zeros(mesh.n_points, np.uint8)
        member[ids] = 1
        grid.point_data[f"set {name}"] = member
    put_materials(grid, mesh.materials)
    grid.set_active_scalars("material", preference="cell")
    return grid


def plain_grid(mesh: core.fe.FEMesh) -> pv.UnstructuredGrid:
    """Return a grid for readers that know arrays of numbers only: no field arrays, no blanks in names.

    Cell arrays `material` and, for SfePy, `mat_id`: 1, 2, ... in the order of `FEMesh.material_names`, then the sets of
    cohesive elements; `region`. Point arrays `set_left` and so on.
    """
    grid = to_fe_grid(mesh)
    number = np.empty(grid.n_cells, np.int32)
    cohesive = [mesh.n_cells + ids for ids in mesh.cohesive_cells().values()]
    for i, ids in enumerate([*mesh.material_cells().values(), *cohesive], 1):
        number[ids] = i
    grid.clear_field_data()
    grid.clear_cell_data()
    grid.cell_data["material"] = grid.cell_data["mat_id"] = number
    grid.cell_data["region"] = np.append(mesh.cell_region, np.full(len(mesh.cohesive), -1)).astype(np.int32)
    for name, safe in safe_names([f"set_{name}" for name in mesh.node_sets], 255).items():
        member = grid.point_data.pop(f"set {name[4:]}")
        grid.point_data[safe] = member.astype(np.int32)  # VTK writes bytes as colours, which meshio does not know
    grid.set_active_scalars(None, preference="point")
    grid.set_active_scalars("material", preference="cell")  # MFEM looks for them
    return grid
