"""Sets that a solver needs, found on a quad mesh: materials, borders, interfaces, corners, junctions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple, TypeAlias

import numpy as np
import scipy
from numpy.typing import NDArray

from imgquad_core.arrays import Floats, Ints
from imgquad_core.errors import InputError
from imgquad_core.geometry.halfedge import twins_of
from imgquad_core.model import PointKind, QuadMesh

from .femesh import FEMesh, Names, name_materials

BORDERS = ("left", "right", "bottom", "top")
CORNERS = ("bottom_left", "bottom_right", "top_right", "top_left")
BORDER, BETWEEN, FREE = range(3)

#: which sides: (BORDER, place in `BORDERS`, 0), (BETWEEN, material, that it faces), (FREE, material, 0)
Key: TypeAlias = tuple[int, int, int]


def fe_mesh(mesh: QuadMesh) -> FEMesh:
    """Return `mesh` with all its sets named.

    Parameters
    ----------
    mesh : QuadMesh
        At least one quad; quads counter-clockwise.

    Returns
    -------
    FEMesh
        Elements and nodes in the order of `mesh`. Sets that would be empty are not there.

        ==================== ======================================== ==========================================
        name                 sides                                    nodes
        ==================== ======================================== ==========================================
        left right ...       on that border of the picture            of these sides
        interface_A_B        of A that face B                         of these sides (A before B only)
        interface_B_A        of B that face A
        free_A               of A where a material was dropped        of these sides
        corner_bottom_left.. the corner of the picture, if meshed
        junctions            where three or more boundaries meet
        ==================== ======================================== ==========================================

        Sets of elements are `interface_A_B`, those of A and B with a node on their interface, and `interfaces`, those
        with one on any.

    Raises
    ------
    InputError
        The mesh has no quads.
    """
    if mesh.n_quads == 0:
        raise InputError("the mesh has no quads: nothing to write; was every material dropped?")
    box = np.stack([mesh.points.min(axis=0), mesh.points.max(axis=0)])
    named = name_sets(find_sets(mesh, box), name_materials(mesh.quad_material, mesh.materials))
    return FEMesh(
        points=mesh.points,
        kind="quad4",
        cells=mesh.quads,
        cell_material=mesh.quad_material,
        cell_region=mesh.quad_region,
        materials=mesh.materials,
        node_sets=named.nodes,
        side_sets=named.sides,
        point_kind=mesh.point_kind,
        chain_offsets=mesh.chain_offsets,
        chain_points=mesh.chain_points,
        element_sets=named.elements,
    )


class FoundSets(NamedTuple):
    """Sets of a mesh, or of a part of it, without names yet."""

    sides: Mapping[Key, Ints]  #: (element, side), ascending
    nodes: Mapping[Key, Ints]  #: of these sides; of those between two materials where the first has the lower number
    near: Mapping[tuple[int, int], Ints]  #: elements of two materials with a node on their interface, ascending
    at_any: Ints  #: elements with a node on any interface, ascending
    junctions: Ints  #: nodes where three or more boundaries meet, ascending


class NamedSets(NamedTuple):
    """Sets with the names that they have in files."""

    nodes: Mapping[str, Ints]
    sides: Mapping[str, Ints]
    elements: Mapping[str, Ints]


def find_sets(mesh: QuadMesh, box: Floats) -> FoundSets:
    """Find the sets of a mesh.

    Parameters
    ----------
    mesh : QuadMesh
        Of its points' kinds only `FREE`, which are on no border of the picture, and `JUNCTION` count.
    box : float64, shape (2, 2)
        Least and largest x and y of the picture.
    """
    twin = twins_of(mesh.quads, mesh.n_points)
    sides = dict(_sides_found(mesh, twin, box))
    with_nodes = (key for key in sides if key[0] != BETWEEN or key[1] < key[2])
    nodes = {key: np.unique(_ends(mesh, 4 * sides[key][:, 0] + sides[key][:, 1])) for key in with_nodes}
    near, at_any = _at_interfaces(mesh, twin)
    junctions = np.flatnonzero((mesh.point_kind == PointKind.JUNCTION) & (mesh.valence > 0))
    return FoundSets(sides, nodes, near, at_any, junctions)


def name_sets(found: FoundSets, names: Mapping[int, str]) -> NamedSets:
    """Name sets; `names` are those of the materials."""
    claimed = Names()
    of = {key: claimed.claim(_wanted_name(key, names)) for key in sorted(found.sides)}
    node_sets = {name: found.nodes[key] for key, name in of.items() if key in found.nodes}
    node_sets |= _corner_sets(node_sets)
    if len(found.junctions):
        node_sets["junctions"] = found.junctions
    side_sets = {name: found.sides[key] for key, name in of.items()}
    return NamedSets(node_sets, side_sets, _name_near(found, names))


def _wanted_name(key: Key, names: Mapping[int, str]) -> str:
    what, first, second = key
    if what == BORDER:
        return BORDERS[first]
    return f"interface_{names[first]}_{names[second]}" if what == BETWEEN else f"free_{names[first]}"


def _name_near(found: FoundSets, names: Mapping[int, str]) -> dict[str, Ints]:
    if not len(found.at_any):
        return {}
    claimed = Names(names.values())
    sets = {claimed.claim("interfaces"): found.at_any}
    for a, b in sorted(found.near):
        sets[claimed.claim(f"interface_{names[a]}_{names[b]}")] = found.near[a, b]
    return sets


def without_interfaces(mesh: FEMesh) -> FEMesh:
    """Return `mesh` without the sides that two elements share: its side sets are the boundary, and no more.

    For programs that take every named side for a piece of the boundary. Node sets and sides of split interfaces stay.
    """
    sides = np.concatenate([np.empty((0, 2), np.int64), *mesh.side_sets.values()])
    corners = 2 if mesh.dimension == 2 else 4
    nodes = np.sort(mesh.side_nodes(sides)[:, :corners], axis=1)
    _, of, times = np.unique(nodes, axis=0, return_inverse=True, return_counts=True)
    is_outer = np.split(times[of.ravel()] == 1, np.cumsum([len(s) for s in mesh.side_sets.values()])[:-1])
    outer = {name: s[kept] for (name, s), kept in zip(mesh.side_sets.items(), is_outer, strict=False) if kept.any()}
    return replace(mesh, side_sets=outer)


def _ends(mesh: QuadMesh, half_edges: Ints) -> Ints:
    """Tail and head of half-edges, shape (n, 2)."""
    cell, side = half_edges // 4, half_edges % 4
    return np.stack([mesh.quads[cell, side], mesh.quads[cell, (side + 1) % 4]], axis=1)


def _sides(half_edges: Ints) -> Ints:
    return np.stack([half_edges // 4, half_edges % 4], axis=1)


def _sides_found(mesh: QuadMesh, twin: Ints, box: Floats) -> Iterator[tuple[Key, Ints]]:
    """Sides of borders, interfaces and free borders, each in the order of the elements."""
    outer = np.flatnonzero(twin < 0)
    border = _border_of(mesh, _ends(mesh, outer), box)
    for b in range(len(BORDERS)):
        if (border == b).any():
            yield (BORDER, b, 0), _sides(outer[border == b])
    yield from _interfaces(mesh, twin)
    free = outer[border < 0]
    material = mesh.quad_material[free // 4]
    for m in np.unique(material):
        yield (FREE, int(m), 0), _sides(free[material == m])


def _border_of(mesh: QuadMesh, ends: Ints, box: Floats) -> NDArray[np.int8]:
    """Index in `BORDERS` of each border edge, -1 where the edge is not on the picture's border."""
    low, high = box
    near = 1e-9 * float((high - low).max())
    # an edge of a dropped material may lie on the bounding box by chance: its nodes are FREE, those of a border never
    held = (mesh.point_kind[ends] != PointKind.FREE).all(axis=1)
    border = np.full(len(ends), -1, np.int8)
    for b, (axis, value) in enumerate(((0, low[0]), (0, high[0]), (1, low[1]), (1, high[1]))):
        border[held & (np.abs(mesh.points[ends, axis] - value) <= near).all(axis=1)] = b
    return border


def _interfaces(mesh: QuadMesh, twin: Ints) -> Iterator[tuple[Key, Ints]]:
    inner = np.flatnonzero(twin >= 0)
    own, other = mesh.quad_material[inner // 4], mesh.quad_material[twin[inner] // 4]
    differ = own != other
    pairs = np.stack([own, other], axis=1)[differ]
    unique, of = np.unique(pairs, axis=0, return_inverse=True)
    order = np.argsort(of.ravel(), kind="stable")
    groups = np.split(inner[differ][order], np.cumsum(np.bincount(of.ravel(), minlength=len(unique)))[:-1])
    for (a, b), half_edges in zip(unique, groups, strict=False):
        yield (BETWEEN, int(a), int(b)), _sides(half_edges)


def _corner_sets(node_sets: Mapping[str, Ints]) -> dict[str, Ints]:
    empty = np.empty(0, np.int64)
    corners = {}
    for corner in CORNERS:
        vertical, horizontal = corner.split("_")
        both = np.intersect1d(node_sets.get(vertical, empty), node_sets.get(horizontal, empty))
        if len(both):
            corners[f"corner_{corner}"] = both
    return corners


def _at_interfaces(mesh: QuadMesh, twin: Ints) -> tuple[dict[tuple[int, int], Ints], Ints]:
    """Elements with a node on an interface: of each two materials, and of all."""
    inner = np.flatnonzero(twin >= 0)
    own, other = mesh.quad_material[inner // 4], mesh.quad_material[twin[inner] // 4]
    lower = inner[own < other]
    if not len(lower):
        return {}, np.empty(0, np.int64)
    pairs, of = np.unique(np.stack([own, other], axis=1)[own < other], axis=0, return_inverse=True)
    cell, pair = _touching(mesh, _ends(mesh, lower), of.ravel(), len(pairs))
    between = (mesh.quad_material[cell][:, None] == pairs[pair]).any(axis=1)
    order = np.lexsort((cell[between], pair[between]))
    ends = np.cumsum(np.bincount(pair[between], minlength=len(pairs)))
    groups = np.split(cell[between][order], ends[:-1])
    return {(a, b): cells for (a, b), cells in zip(pairs.tolist(), groups, strict=True)}, np.unique(cell)


def _touching(mesh: QuadMesh, ends: Ints, pair: Ints, n_pairs: int) -> tuple[Ints, Ints]:
    """(element, pair) for each element and pair of materials that have a node in common, each once."""
    coo_array = scipy.sparse.coo_array
    on = coo_array((np.ones(2 * len(pair)), (ends.ravel(), np.repeat(pair, 2))), shape=(mesh.n_points, n_pairs))
    corners = np.repeat(np.arange(mesh.n_quads), 4)
    of = coo_array((np.ones(len(corners)), (corners, mesh.quads.ravel())), shape=(mesh.n_quads, mesh.n_points))
    cell, pairs = (of.tocsr() @ on.tocsr()).nonzero()
    return cell.astype(np.int64), pairs.astype(np.int64)
