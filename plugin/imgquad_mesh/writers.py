"""Solver files through PyVista: ``grid.save("a.inp", analysis="plane strain")``.

The functions are named by the entry point group `pyvista.writers`. There is no reader of ``.inp``: PyVista's own is for
AVS files, and a second one would break it.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyvista as pv

from imgquad_core.errors import InputError

if TYPE_CHECKING:
    from imgquad_core.femesh import FEMesh
    from imgquad_core.model import Materials, QuadMesh

#: VTK cell of each element kind
CELLS = {
    "quad4": pv.CellType.QUAD,
    "quad8": pv.CellType.QUADRATIC_QUAD,
    "quad9": pv.CellType.BIQUADRATIC_QUAD,
    "hex8": pv.CellType.HEXAHEDRON,
}
COHESIVE_CELLS = {4: pv.CellType.QUAD, 6: pv.CellType.QUADRATIC_LINEAR_QUAD, 8: pv.CellType.HEXAHEDRON}


def save_grid(dataset: Any, path: str | Path, **options: Any) -> None:
    """Write a plane grid of quads in the format of the extension of `path`.

    Parameters
    ----------
    dataset : pyvista.UnstructuredGrid or pyvista.PolyData
        Quads in a plane of constant z, with the cell array `material` (one material without it) and perhaps the field
        arrays `material_numbers` and `material_names` as `ImageData.imgquad.mesh` gives them.
    path : path
        File to write; replaced only when all of it was written.
    **options
        Of the writer in `imgquad_core.writers`; and before it ``order=2`` (and ``nodes=9``), ``cohesive="all"`` or
        pairs of names (``interfaces="sides"`` for no elements between), ``extrude=thickness`` and ``layers=n``.

    Raises
    ------
    InputError
        Cells that are no quads, a grid that is not flat, an unknown option, or what the writer refuses.

    Examples
    --------
    >>> grid.save("part.inp", analysis="plane strain", order=2)  # doctest: +SKIP
    """
    from imgquad_core.writers import write_mesh
    from imgquad_mesh.elements import ElementOptions, make_elements

    names = [name for name in ("order", "nodes", "cohesive", "extrude", "layers", "periodic") if name in options]
    sides = options.get("interfaces") == "sides"
    if sides:
        del options["interfaces"]
    elements = ElementOptions(**{name: options.pop(name) for name in names}, open_interfaces=sides)
    write_mesh(make_elements(from_grid(dataset), elements), path, **options)


def from_grid(dataset: Any, *, folded: bool = False) -> QuadMesh:
    """Return the mesh in a flat grid of quads, the inverse of `imgquad_mesh.convert.to_grid`; see `trace_mesh`."""
    from imgquad_core.tracing import trace_mesh

    points = np.asarray(dataset.points, np.float64)
    if len(points) and np.ptp(points[:, 2]) > 1e-9 * max(np.ptp(points[:, :2]), 1e-300):
        raise InputError("the mesh is not in a plane z = constant: turn it there first, for example rotate_x(90)")
    quads = _quads(dataset)
    used, numbered = np.unique(quads, return_inverse=True)
    cell_data = dataset.cell_data
    material = np.asarray(cell_data["material"]) if "material" in cell_data else np.zeros(len(quads), np.int32)
    corners, materials = numbered.reshape(-1, 4), _materials(dataset, material)
    return trace_mesh(points[used, :2], corners, material, materials, folded=folded)


def to_fe_grid(mesh: FEMesh) -> pv.UnstructuredGrid:
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
    grid.field_data["material_numbers"] = mesh.materials.labels
    grid.field_data["material_names"] = np.array(mesh.materials.names, np.str_)
    grid.field_data["material_colors"] = mesh.materials.colors
    grid.set_active_scalars("material", preference="cell")
    return grid


def _quads(dataset: Any) -> np.ndarray[Any, np.dtype[np.int64]]:
    if isinstance(dataset, pv.UnstructuredGrid):
        counts, cells = (dataset.celltypes == pv.CellType.QUAD).sum(), dataset.cells
        n_cells = dataset.n_cells
    elif isinstance(dataset, pv.PolyData):
        n_cells, cells = dataset.n_cells, dataset.faces
        counts = n_cells if len(cells) == 5 * n_cells and (cells[::5] == 4).all() else 0
    else:
        raise InputError(f"{type(dataset).__name__} holds no quads: write an UnstructuredGrid or PolyData")
    if counts != n_cells or n_cells == 0:
        raise InputError(
            f"{n_cells - counts} of {n_cells} cells are no quads (VTK_QUAD): extract the quads, "
            "or mesh the picture with image.imgquad.mesh()"
        )
    return np.asarray(cells, np.int64).reshape(-1, 5)[:, 1:]


def _materials(dataset: Any, material: Any) -> Materials:
    from imgquad_core.model import Materials

    fields = dataset.field_data
    if "material_numbers" in fields and "material_names" in fields:
        numbers, names = np.asarray(fields["material_numbers"]), tuple(map(str, fields["material_names"]))
        colors = np.asarray(fields["material_colors"]) if "material_colors" in fields else np.full((len(names), 3), 128)
        return Materials(numbers, names, colors)
    numbers = np.unique(material)
    return Materials(numbers, tuple(f"material {m}" for m in numbers), np.full((len(numbers), 3), 128))
