"""Each quad cut into two triangles, for programs that know no quads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from imgquad_core.arrays import Ints
from imgquad_core.errors import InputError

from .femesh import FEMesh

#    3-----2     3-----2     The cut runs from corner 0 or from corner 1. Sides of the quad are these sides of the two
#    | b / |     | \ b |     triangles, (triangle, side):
#    | / a |     | a \ |
#    0-----1     0-----1
CORNERS = np.array([[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]])
SIDES = np.array([[(0, 0), (0, 1), (1, 1), (1, 2)], [(0, 0), (1, 0), (1, 1), (0, 2)]])


def split_quads(mesh: FEMesh) -> FEMesh:
    """Return `mesh` with two triangles for each quad.

    Parameters
    ----------
    mesh : FEMesh
        Quads of 4 nodes, perhaps with cohesive elements, which stay as they are.

    Returns
    -------
    FEMesh
        Quad q became the triangles 2 q and 2 q + 1, counter-clockwise, by the diagonal with the larger smallest angle
        (that of Delaunay). Nodes and node sets are those of `mesh`, side sets and element sets keep their names.

    Raises
    ------
    InputError
        The elements are not four-node quads.
    """
    if mesh.kind != "quad4":
        raise InputError(
            f"split quads: four-node quads become triangles, not {mesh.kind}: leave out order 2 and extrusion"
        )
    cut = _cuts(mesh)
    corners = CORNERS[cut]  # (n, 2, 3)
    cells = np.take_along_axis(mesh.cells[:, None, :].repeat(2, axis=1), corners, axis=2).reshape(-1, 3)
    return replace(
        mesh,
        kind="tri3",
        cells=cells,
        cell_material=np.repeat(mesh.cell_material, 2),
        cell_region=np.repeat(mesh.cell_region, 2),
        side_sets={name: _sides(sides, cut) for name, sides in mesh.side_sets.items()},
        element_sets={
            name: np.stack([2 * ids, 2 * ids + 1], axis=1).ravel() for name, ids in mesh.element_sets.items()
        },
    )


def _cuts(mesh: FEMesh) -> Ints:
    """0 where the diagonal from corner 0 is Delaunay's (angles at corners 1 and 3: 180 degrees at most), else 1."""
    p = mesh.points[mesh.cells]
    to = [(p[:, (k - 1) % 4] - p[:, k], p[:, (k + 1) % 4] - p[:, k]) for k in (1, 3)]
    sine = [b[:, 0] * a[:, 1] - b[:, 1] * a[:, 0] for a, b in to]
    cosine = [(a * b).sum(axis=1) for a, b in to]
    return np.asarray(sine[0] * cosine[1] + cosine[0] * sine[1] < 0, np.int64)


def _sides(sides: Ints, cut: Ints) -> Ints:
    found: Ints = SIDES[cut[sides[:, 0]], sides[:, 1]]
    return np.stack([2 * sides[:, 0] + found[:, 0], found[:, 1]], axis=1)
