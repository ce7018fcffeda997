"""The grid of a mesh as VTK's writers take it, without PyVista."""

from __future__ import annotations

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import VTK_QUAD, vtkCellArray, vtkUnstructuredGrid

from imgquad_core.arrays import Floats, Ints
from imgquad_core.model import QuadMesh

from .field_texts import put_numbers
from .fields import put_materials
from .placement import PLAIN, Placement


def quad_grid(mesh: QuadMesh, placement: Placement = PLAIN) -> vtkUnstructuredGrid:
    """Return what `to_grid` does, as a grid of VTK."""
    quads = mesh.quads[:, ::-1] if placement.mirrored else mesh.quads
    grid = vtkUnstructuredGrid()
    grid.SetPoints(_points(placement.place(mesh.points)))
    grid.SetCells(VTK_QUAD, _cells(quads))
    put_numbers(grid, "region", mesh.quad_region.astype(np.int32), "Cell")
    put_numbers(grid, "material", mesh.quad_material, "Cell")
    put_materials(grid, mesh.materials)
    if mesh.materials.orientations is not None:
        rows = np.searchsorted(mesh.materials.labels, mesh.quad_material)
        put_numbers(grid, "orientation", mesh.materials.orientations[rows], "Cell")
    grid.GetCellData().SetActiveScalars("material")
    return grid


def _points(places: Floats) -> vtkPoints:
    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(places), deep=True))  # type: ignore[no-untyped-call]
    return points


def _cells(quads: Ints) -> vtkCellArray:
    cells = vtkCellArray()
    offsets = np.arange(0, 4 * len(quads) + 1, 4, dtype=np.int64)
    corners = np.ascontiguousarray(quads, np.int64).ravel()
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(corners, deep=True))  # type: ignore[no-untyped-call]
    return cells
