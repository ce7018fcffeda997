"""Elements and sets of the whole picture for solvers' files, found tile by tile.

What lies at a node is known where all quads around it are. So each tile leaves the quads around its rim to its
neighbours, with numbers that hold in the whole picture, and finds the sets of its own nodes and quads::

      r r r r|g g           r: quads that a tile leaves to others
      r . . .|g             g: those that it sees of others
      r . . .|g

As nodes and quads are numbered tile by tile, sets of the whole are those of the tiles one after the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Bytes, Flags, Floats, Ints, Labels
from imgquad_core.fe import FEMesh
from imgquad_core.fe.femesh import name_materials
from imgquad_core.fe.sets import FoundSets, find_sets, name_sets
from imgquad_core.geometry.halfedge import twins_of
from imgquad_core.model import Materials, QuadMesh
from imgquad_core.tracing import boundary_edges, point_kinds


class Ring(NamedTuple):
    """Quads of a tile, their nodes by numbers of the whole picture."""

    quads: Ints  #: (m, 4)
    region: Ints  #: (m,)
    label: Labels  #: (m,)
    node: Ints  #: (n,) numbers of the nodes, each once
    points: Floats  #: (n, 2)


class TileSets(NamedTuple):
    """Sets of a tile's own nodes and quads, by numbers of the whole picture, and the kinds of its own nodes."""

    sets: FoundSets
    kind: Bytes


def ring_of(whole: Ring, rim: Flags) -> Ring:
    """Return the quads of a tile around its rim; `rim` tells the nodes there."""
    order = np.argsort(whole.node)
    at = order[np.searchsorted(whole.node, whole.quads, sorter=order)]
    near = rim[at].any(axis=1)
    used = np.unique(at[near])
    return Ring(whole.quads[near], whole.region[near], whole.label[near], whole.node[used], whole.points[used])


def tile_sets(own: Ring, others: Sequence[Ring], own_nodes: range, first_quad: int, box: Floats) -> TileSets:
    """Find the sets of a tile.

    Parameters
    ----------
    own : Ring
        All quads of the tile.
    others : sequence of Ring
        What its neighbours have left.
    own_nodes : range
        Numbers of the nodes that are its own.
    first_quad : int
        Number of its first quad.
    box : float64, shape (2, 2)
        Least and largest x and y of the picture.
    """
    parts = [own, *others]
    node, first = np.unique(np.concatenate([part.node for part in parts]), return_index=True)
    points = np.concatenate([part.points for part in parts])[first]
    quads = np.searchsorted(node, np.concatenate([part.quads for part in parts]))
    _, at, region = np.unique(np.concatenate([part.region for part in parts]), return_index=True, return_inverse=True)
    label = np.concatenate([part.label for part in parts])[at]
    twin = twins_of(quads, len(node))
    kind = point_kinds(points, boundary_edges(quads, twin, region.ravel())[1], box)
    mesh = _bare_mesh(points, kind, quads, region.ravel(), label)
    is_own = (node >= own_nodes.start) & (node < own_nodes.stop)
    return TileSets(_own_sets(find_sets(mesh, box), len(own.quads), first_quad, node, is_own), kind[is_own])


def _bare_mesh(points: Floats, kind: Bytes, quads: Ints, region: Ints, label: Labels) -> QuadMesh:
    """Return a mesh without chains and names of materials."""
    nobody = Materials(np.empty(0, np.int32), (), np.empty((0, 3), np.uint8))
    none = np.empty(0, np.int64)
    return QuadMesh(points, kind, quads, region, label, np.zeros(1, np.int64), none, none.reshape(0, 2), nobody)


def _own_sets(found: FoundSets, n_quads: int, first_quad: int, node: Ints, is_own: Flags) -> FoundSets:
    """Return what sets have of a tile's own nodes and quads; its own quads are the first ones."""

    def nodes(ids: Ints) -> Ints:
        return np.asarray(node[ids[is_own[ids]]])

    def cells(ids: Ints) -> Ints:
        return ids[ids < n_quads] + first_quad

    sides = {key: ids[ids[:, 0] < n_quads] + np.array([first_quad, 0]) for key, ids in found.sides.items()}
    return FoundSets(
        sides,
        {key: nodes(ids) for key, ids in found.nodes.items()},
        {pair: cells(ids) for pair, ids in found.near.items()},
        cells(found.at_any),
        nodes(found.junctions),
    )


def as_arrays(found: TileSets) -> dict[str, NDArray[Any]]:
    """Return sets as arrays with names, those that are empty left out."""
    arrays: dict[str, NDArray[Any]] = {"kind": found.kind}
    for name, value in found.sets._asdict().items():
        parts = value if isinstance(value, Mapping) else {(): value}
        arrays |= {"/".join([name, *map(str, key)]): ids for key, ids in parts.items() if len(ids)}
    return arrays


def joined_sets(tiles: Iterable[Mapping[str, NDArray[Any]]]) -> FoundSets:
    """Put together what `as_arrays` has made of the sets of all tiles, in their order."""
    parts: dict[str, list[Ints]] = {}
    for arrays in tiles:
        for name, ids in arrays.items():
            parts.setdefault(name, []).append(ids)
    whole: dict[str, dict[Any, Ints]] = {name: {} for name in FoundSets._fields}
    for name, several in parts.items():
        field, *key = name.split("/")
        if field in whole:
            whole[field][tuple(map(int, key))] = np.concatenate(several)
    none = np.empty(0, np.int64)
    lists = {name: whole[name].get((), none) for name in ("at_any", "junctions")}
    return FoundSets(whole["sides"], whole["nodes"], whole["near"], **lists)


class Mapped:
    """Arrays that are written part by part to files and then read as if they were in memory."""

    def __init__(self, folder: Path, columns: Mapping[str, tuple[str, int]]) -> None:
        self._columns = columns
        self._paths = {name: folder / f"{name}.bin" for name in columns}
        self._streams = {name: path.open("wb") for name, path in self._paths.items()}

    def append(self, **parts: NDArray[Any]) -> None:
        """Write what comes next of each array."""
        for name, part in parts.items():
            self._streams[name].write(np.ascontiguousarray(part, self._columns[name][0]).data)

    def arrays(self) -> dict[str, Any]:
        """Return the arrays, mapped; nothing can be added any more."""
        found: dict[str, Any] = {}
        for name, (dtype, width) in self._columns.items():
            self._streams[name].close()
            found[name] = np.memmap(self._paths[name], dtype, "r")
            if width > 1:
                found[name] = found[name].reshape(-1, width)
        return found


#: type and width of each array
COLUMNS = {"points": ("f8", 2), "cells": ("i8", 4), "cell_material": ("i4", 1), "cell_region": ("i8", 1),
           "point_kind": ("u1", 1)}  # fmt: skip


def named_elements(mapped: Mapped, sets: FoundSets, materials: Materials) -> FEMesh:
    """Return the elements of the whole picture, of arrays that are mapped, with all sets named."""
    arrays = mapped.arrays()
    named = name_sets(sets, name_materials(arrays["cell_material"], materials))
    return FEMesh(
        kind="quad4", materials=materials, node_sets=named.nodes, side_sets=named.sides, element_sets=named.elements,
        chain_offsets=np.zeros(1, np.int64), chain_points=np.empty(0, np.int64), **arrays,
    )  # fmt: skip
