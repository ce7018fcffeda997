"""Pairs of nodes on opposite sides of a periodic cell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from imgquad_core.arrays import Ints
from imgquad_core.errors import InputError, TopologyError

from .femesh import FEMesh

BORDERS = {"x": ("left", "right"), "y": ("bottom", "top")}


def with_periodic_pairs(mesh: FEMesh, directions: str) -> FEMesh:
    """Return `mesh` with the pairs of nodes on opposite sides.

    Parameters
    ----------
    mesh : FEMesh
        Plane, of a boundary that `match_opposite_sides` has matched; its interfaces not split yet.
    directions : str
        ``x``, ``y`` or ``xy``.

    Returns
    -------
    FEMesh
        `periodic` has (left, right) nodes as ``x`` and (bottom, top) nodes as ``y``, ascending along the side.

    Raises
    ------
    InputError
        Unknown directions, a side without elements, none that face each other, or a mesh that is split already.
    TopologyError
        Nodes of opposite sides do not match.
    """
    if directions not in ("x", "y", "xy"):
        raise InputError(f"periodic = '{directions}': choose one of x, y, xy")
    return replace(mesh, periodic={d: _node_pairs(mesh, *BORDERS[d], along="yx".index(d)) for d in directions})


def _node_pairs(mesh: FEMesh, low: str, high: str, along: int) -> Ints:
    if len(mesh.cohesive):
        raise InputError("periodic: the interfaces are split already; pair the sides first, then split")
    for name in (low, high):
        if name not in mesh.node_sets:
            raise InputError(f"periodic: no element lies on the {name} border; nothing can be tied to it")
    near = 1e-9 * float(np.ptp(mesh.points, axis=0).max())
    a, b = (_sorted_along(mesh, mesh.node_sets[name], along, near) for name in (low, high))
    if not any(name.startswith("free_") for name in mesh.side_sets):
        if len(a) != len(b):
            raise TopologyError(f"periodic: {len(a)} nodes on the {low} border, {len(b)} on the {high} border")
    else:
        a, b = _common(mesh, a, b, along, near)
    if not len(a):
        raise InputError(
            f"periodic: no element of the {low} border faces one of the {high} border: nothing can be tied; drop less"
        )
    off = np.abs(mesh.points[a, along] - mesh.points[b, along])
    if (off > near).any():
        raise TopologyError(f"periodic: {(off > near).sum()} nodes of the {low} border have no partner on the {high}")
    return np.stack([a, b], axis=1)


def _sorted_along(mesh: FEMesh, ids: Ints, along: int, near: float) -> Ints:
    """Nodes in order along a side."""
    ordered: Ints = ids[np.argsort(np.round(mesh.points[ids, along] / near), kind="stable")]
    return ordered


def _common(mesh: FEMesh, a: Ints, b: Ints, along: int, near: float) -> tuple[Ints, Ints]:
    """Nodes at heights that both sides have as often: where one side is not meshed, none are tied."""
    keys = [np.round(mesh.points[ids, along] / near).astype(np.int64) for ids in (a, b)]
    (values_a, count_a), (values_b, count_b) = (np.unique(key, return_counts=True) for key in keys)
    _, in_a, in_b = np.intersect1d(values_a, values_b, return_indices=True)
    same = values_a[in_a][count_a[in_a] == count_b[in_b]]
    return a[np.isin(keys[0], same)], b[np.isin(keys[1], same)]
