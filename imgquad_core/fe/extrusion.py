"""A plane mesh drawn out along z: hexes in layers, with all sets."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from imgquad_core.arrays import Ints
from imgquad_core.errors import InputError

from .femesh import FEMesh

BOTTOM, TOP = 4, 5  #: sides of a hex


def extrude(mesh: FEMesh, thickness: float, layers: int = 1) -> FEMesh:
    """Return `mesh` drawn out from z = 0 to `thickness`.

    Parameters
    ----------
    mesh : FEMesh
        Quads of 4 nodes, perhaps with cohesive elements.
    thickness : float
        In the unit of the points.
    layers : int
        Elements over the thickness.

    Returns
    -------
    FEMesh
        Hexes, layer by layer: element e of layer l has number ``l * n_cells + e``, node p of level l the number
        ``l * n_points + p``. Side sets keep their names, node sets have the nodes of all levels, and there are
        `back` (z = 0) and `front` (z = thickness) besides. Cohesive elements become COH3D8: (1-4) on the material of
        lower number, (5-8) over them. Chains are not carried over.

    Raises
    ------
    InputError
        Not four-node quads, no positive thickness, or no layer.
    """
    if mesh.kind != "quad4":
        raise InputError(f"extrusion starts from four-node quads, not from {mesh.kind}: leave out the second order")
    if not (thickness > 0 and math.isfinite(thickness)):
        raise InputError(f"extrusion: the thickness {thickness!r} must be positive")
    if isinstance(layers, bool) or not isinstance(layers, int) or layers < 1:
        raise InputError(f"extrusion: the number of layers {layers!r} must be 1 or more")
    n, levels = mesh.n_points, np.arange(layers + 1)
    flat = np.tile(mesh.points, (layers + 1, 1))
    z = np.repeat(levels * (thickness / layers), n)
    z[-n:] = thickness
    cells = _stacked(np.concatenate([mesh.cells, mesh.cells + n], axis=1), n, layers)
    sides = {name: _stacked(sides, [mesh.n_cells, 0], layers) for name, sides in mesh.side_sets.items()}
    sides |= _caps(mesh, layers)
    nodes = {name: _stacked(ids, n, layers + 1) for name, ids in mesh.node_sets.items()}
    nodes |= {"back": np.arange(n), "front": layers * n + np.arange(n)}
    return replace(
        mesh,
        points=np.column_stack([flat, z]),
        kind="hex8",
        cells=cells,
        cell_material=np.tile(mesh.cell_material, layers),
        cell_region=np.tile(mesh.cell_region, layers),
        node_sets=nodes,
        side_sets=sides,
        point_kind=np.tile(mesh.point_kind, layers + 1),
        chain_offsets=np.zeros(1, np.int64),
        chain_points=np.empty(0, np.int64),
        cohesive=_cohesive(mesh, layers),
        cohesive_pair=np.tile(mesh.cohesive_pair, (layers, 1)),
        periodic={name: _stacked(pairs, n, layers + 1) for name, pairs in mesh.periodic.items()},
        element_sets={name: _stacked(ids, mesh.n_cells, layers) for name, ids in mesh.element_sets.items()},
    )


def _stacked(ids: Ints, step: int | list[int], times: int) -> Ints:
    """Repeat `ids`, `step` higher each time."""
    return np.concatenate([ids + np.asarray(step) * layer for layer in range(times)])


def _caps(mesh: FEMesh, layers: int) -> dict[str, Ints]:
    """Return the sides at z = 0 and at the other end."""
    all_cells = np.arange(mesh.n_cells)
    back = np.column_stack([all_cells, np.full(mesh.n_cells, BOTTOM)])
    front = np.column_stack([all_cells + (layers - 1) * mesh.n_cells, np.full(mesh.n_cells, TOP)])
    return {"back": back, "front": front}


def _cohesive(mesh: FEMesh, layers: int) -> Ints:
    """Join each ``1 2 3 4`` to its copy ``1' 2' 3' 4'`` one level up: below 1' 2' 2 1, above 4' 3' 3 4.

    So the normal of 1' 2' 2 1 points to the side above, as COH3D8 wants it.
    """
    up = mesh.cohesive + mesh.n_points
    one, two, three, four = mesh.cohesive.T
    hexes = np.stack([up[:, 0], up[:, 1], two, one, up[:, 3], up[:, 2], three, four], axis=1)
    return _stacked(hexes, mesh.n_points, layers)
