"""Gmsh mesh files (text, 4.1 and 2.2) with named physical groups.

Each group is one entity whose tag is the group's: GetFEM reads entities for groups, getdp numbers over all dimensions.
Node tags ascend through the file: OpenFOAM's gmshToFoam takes the n-th node for the one of the n-th smallest tag. Names
come in the order sides, elements, points: ElmerGrid lowers its dimension at each name of a lower one.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Floats, Ints
from imgquad_core.errors import InputError
from imgquad_core.fe.femesh import FEMesh

from .common import Nodes, refuse_six_nodes, rows, safe_names, write_text

NAME_LIMIT = 127
ELEMENT_TYPES = {"point": 15, "tri3": 2, "line2": 1, "line3": 8, "quad4": 3, "quad8": 16, "quad9": 10, "hex8": 5}


class Group(NamedTuple):
    """A physical group: its elements have ids from `first` on."""

    dimension: int
    tag: int
    name: str
    element: int
    nodes: Nodes
    first: int


def write_gmsh(mesh: FEMesh, path: str | Path, *, version: str = "4.1") -> None:
    """Write a Gmsh mesh (``.msh``).

    Parameters
    ----------
    mesh : FEMesh
        Groups are made of its materials, cohesive elements, side sets, and corners. Where two side sets are the same
        edges (both sides of an interface that was not split), the first is written.
    path : path
        File to write; replaced only when all of it was written.
    version : str
        ``4.1``, or ``2.2`` for getdp and other old readers.

    Raises
    ------
    InputError
        Another version, six-node cohesive elements, or a name of more than 127 signs.
    """
    if version not in ("4.1", "2.2"):
        raise InputError(f"Gmsh version '{version}' is not written; choose 4.1 or 2.2")
    refuse_six_nodes(mesh, "Gmsh")
    write_text(path, gmsh_text(mesh, version))


def gmsh_text(mesh: FEMesh, version: str = "4.1", name_limit: int = NAME_LIMIT) -> Iterator[str]:
    """Text of a Gmsh mesh, in parts; names of groups have at most `name_limit` signs."""
    groups = _groups(mesh, name_limit)
    return _text_41(mesh.points, groups) if version == "4.1" else _text_22(mesh.points, groups)


def _groups(mesh: FEMesh, name_limit: int) -> list[Group]:
    found = [*_cell_groups(mesh), *_side_groups(mesh), *_point_groups(mesh)]
    names = safe_names([name for _, name, _, _ in found], name_limit)
    groups, first = [], 1
    for tag, (dimension, name, element, nodes) in enumerate(found, 1):
        groups.append(Group(dimension, tag, names[name], ELEMENT_TYPES[element], nodes, first))
        first += len(nodes)
    return groups


def _cell_groups(mesh: FEMesh) -> Iterator[tuple[int, str, str, Nodes]]:
    for name, ids in mesh.material_cells().items():
        yield mesh.dimension, name, mesh.kind, Nodes(mesh.cells, ids)
    for name, ids in mesh.cohesive_cells().items():
        yield mesh.dimension, name, "hex8" if mesh.dimension == 3 else "quad4", Nodes(mesh.cohesive, ids)


def _side_groups(mesh: FEMesh) -> Iterator[tuple[int, str, str, Nodes]]:
    seen = np.zeros((0, 2), np.int64)
    element = {(2, 2): "line2", (2, 3): "line3", (3, 4): "quad4"}
    for name, sides in mesh.side_sets.items():
        nodes = mesh.side_nodes(sides)
        corners = np.sort(nodes[:, :2] if mesh.dimension == 2 else nodes, axis=1)[:, [0, -1]]
        if not _all_in(corners, seen):
            seen = np.concatenate([seen, corners])
            yield mesh.dimension - 1, name, element[mesh.dimension, nodes.shape[1]], Nodes(nodes)


def _all_in(edges: Ints, seen: Ints) -> bool:
    """Whether all of `edges` are among `seen`; both as (lowest, highest node), which tells sides apart."""
    if not len(seen):
        return False
    base = int(max(edges.max(), seen.max())) + 1
    return bool(np.isin(edges[:, 0] * base + edges[:, 1], seen[:, 0] * base + seen[:, 1]).all())


def _point_groups(mesh: FEMesh) -> Iterator[tuple[int, str, str, Nodes]]:
    for name, ids in mesh.node_sets.items():
        if name.startswith("corner_") and len(ids) == 1:
            yield 0, name, "point", Nodes(ids[:, None])


def _names_text(groups: list[Group]) -> Iterator[str]:
    highest = max(g.dimension for g in groups)
    ordered = sorted(groups, key=lambda g: (g.dimension < highest - 1, g.dimension))
    yield f"$PhysicalNames\n{len(groups)}\n"
    yield from (f'{g.dimension} {g.tag} "{g.name}"\n' for g in ordered)
    yield "$EndPhysicalNames\n"


def _text_41(points: Floats, groups: list[Group]) -> Iterator[str]:
    yield "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
    yield from _names_text(groups)
    yield from _entities(points, groups)
    blocks, place = _node_blocks(len(points), groups), _place_of(points)
    yield f"$Nodes\n{len(blocks)} {len(points)} 1 {len(points)}\n"
    for group, start, end in blocks:
        yield f"{group.dimension} {group.tag} 0 {end - start}\n"
        yield from rows("%d\n", np.arange(start + 1, end + 1))
        yield from rows(f"{place}\n", points[start:end])
    n_elements = groups[-1].first + len(groups[-1].nodes) - 1
    yield f"$EndNodes\n$Elements\n{len(groups)} {n_elements} 1 {n_elements}\n"
    for g in groups:
        yield f"{g.dimension} {g.tag} {g.element} {len(g.nodes)}\n"
        yield from _elements("%d", g)
    yield "$EndElements\n"


def _place_of(points: Floats) -> str:
    return "%.16g %.16g %.16g" if points.shape[1] == 3 else "%.16g %.16g 0"


def _elements(head: str, group: Group) -> Iterator[str]:
    """Rows of ids and nodes of a group's elements; `head` has a place for the id."""
    first = group.first
    for nodes in group.nodes.parts():
        yield from rows(head + " %d" * nodes.shape[1] + "\n", np.arange(first, first + len(nodes)), nodes + 1)
        first += len(nodes)


def _entities(points: Floats, groups: list[Group]) -> Iterator[str]:
    yield "$Entities\n" + " ".join(str(sum(g.dimension == d for g in groups)) for d in range(4)) + "\n"
    for g in sorted(groups, key=lambda g: g.dimension):
        ends = np.array([_bounds(points[nodes]) for nodes in g.nodes.parts()])
        low, high = np.append(ends[:, 0].min(axis=0), 0.0)[:3], np.append(ends[:, 1].max(axis=0), 0.0)[:3]
        box = low if g.dimension == 0 else np.concatenate([low, high])
        yield f"{g.tag} {' '.join(f'{v:.16g}' for v in box)} 1 {g.tag}{' 0' if g.dimension else ''}\n"
    yield "$EndEntities\n"


def _bounds(places: Floats) -> tuple[Floats, Floats]:
    return places.min(axis=(0, 1)), places.max(axis=(0, 1))


def _node_blocks(n_points: int, groups: list[Group]) -> list[tuple[Group, int, int]]:
    """Runs of nodes in the order of their numbers; each in the first group of the lowest dimension that has it."""
    owner = np.full(n_points, -1, np.int32)
    ordered = sorted(groups, key=lambda g: -g.dimension)
    for i, g in reversed(list(enumerate(ordered))):
        for nodes in g.nodes.parts():
            owner[nodes[owner[nodes] < 0]] = i
    starts = np.flatnonzero(np.diff(owner, prepend=-2))
    ends = np.append(starts[1:], n_points)
    return [(ordered[owner[a]], a, b) for a, b in zip(starts.tolist(), ends.tolist(), strict=True)]


def _text_22(points: Floats, groups: list[Group]) -> Iterator[str]:
    yield "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
    yield from _names_text(groups)
    yield f"$Nodes\n{len(points)}\n"
    yield from rows(f"%d {_place_of(points)}\n", np.arange(1, len(points) + 1), points)
    yield f"$EndNodes\n$Elements\n{sum(len(g.nodes) for g in groups)}\n"
    for g in groups:
        yield from _elements(f"%d {g.element} 2 {g.tag} {g.tag}", g)
    yield "$EndElements\n"
