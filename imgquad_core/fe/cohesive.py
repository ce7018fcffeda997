"""Zero-thickness elements between materials: nodes on interfaces are split, one copy for each side.

::

        B              3---4         4, 3 are copies of 1, 2 at the same places: the element has no
    ---p---q---  ->    1   2  with   thickness. Its first side lies on A (the lower material), its
        A              -------       normal points from A to B.

In a periodic cell the seam is whole: elements on its two sides count as neighbours that nothing cuts, so copies of a
node on one side are tied to the copies of its partner on the other::

    right   |   left       A crack between A and B that goes on across the seam has two nodes on either side: a tied
     A  b'  |  b  A        to a', b to b'. Where it ends at the seam, as the picture does not go on there, it ends
    ----    |    ----      closed as inside a material: one node.
     B  a'  |  a  B
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from imgquad_core.arrays import Ints
from imgquad_core.errors import InputError
from imgquad_core.geometry.halfedge import twins_of
from imgquad_core.grouping import linked

from .femesh import FEMesh


def split_interfaces(mesh: FEMesh, pairs: str | Iterable[tuple[str, str]] = "all") -> FEMesh:
    """Return `mesh` with cohesive elements between chosen materials.

    Parameters
    ----------
    mesh : FEMesh
        Plane, of quads with 4, 8 or 9 nodes, not split before; a periodic one with its pairs.
    pairs : ``all`` or pairs of material names
        Between which materials. A name twice: between all elements of this material.

    Returns
    -------
    FEMesh
        `cohesive` has the elements in the order of COH2D4 in Abaqus: (1, 2) on the material of lower number, seen
        from there from right to left, (3, 4) on the other, 4 over 1 and 3 over 2; with 8- or 9-node quads then the
        middles of (1, 2) and (4, 3). A node is copied once for each group of elements around it that no cut parts;
        the group with the lowest element keeps the number. So at a junction of three cut interfaces there are three
        nodes, and where a cut ends inside a material both ends of an element are the same node. The node set of a
        side set has the nodes of that side; `interface_B_A` gets one of its own. `periodic` has the pairs of copies.

    Raises
    ------
    InputError
        No such material, the two do not touch, the mesh was split or extruded before, or sides of a periodic cell meet
        nowhere but in nodes that are split.
    """
    if mesh.dimension == 3 or len(mesh.cohesive):
        raise InputError(
            "cohesive elements are put into a plane mesh once: split before extruding, all pairs at a time"
        )
    lower, upper = _cut_half_edges(mesh, _chosen(mesh, pairs))
    group = _groups_of_corners(mesh, np.concatenate([lower, upper]))
    cells, origin = _split_nodes(mesh, group, np.concatenate([lower, upper]), upper)
    halves = replace(
        mesh,
        points=mesh.points[origin],
        cells=cells,
        point_kind=mesh.point_kind[origin],
        chain_offsets=np.zeros(1, np.int64),
        chain_points=np.empty(0, np.int64),
        periodic=_periodic_copies(mesh, group, cells),
    )
    below, above = (halves.side_nodes(np.stack([h // 4, h % 4], axis=1)) for h in (lower, upper))
    # each side runs counter-clockwise around its own element, so the two run against each other
    columns = [below[:, 1], below[:, 0], above[:, 1], above[:, 0], *below[:, 2:].T, *above[:, 2:].T]
    material = mesh.cell_material
    split = replace(
        halves,
        cohesive=np.stack(columns, axis=1),
        cohesive_pair=np.stack([material[lower // 4], material[upper // 4]], axis=1),
    )
    return replace(split, node_sets=_node_sets(split, origin))


def open_interfaces(mesh: FEMesh) -> FEMesh:
    """Return a split `mesh` without its cohesive elements: both sides of an interface stay, as sets, apart.

    So any format and any order can hold it; for contact, and for solvers that put cohesive laws between sides.
    """
    return replace(mesh, cohesive=np.empty((0, 4), np.int64), cohesive_pair=np.empty((0, 2), np.int32))


def closed_ends(mesh: FEMesh) -> int:
    """Return how many interfaces end closed at the seam of a periodic cell: there the picture does not go on."""
    tied = np.unique(np.concatenate([np.empty(0, np.int64), *(pairs.ravel() for pairs in mesh.periodic.values())]))
    ends = mesh.cohesive[:, [[0, 3], [1, 2]]].reshape(-1, 2)  # both nodes at either end of each element
    closed = np.unique(ends[ends[:, 0] == ends[:, 1], 0])
    return int(np.isin(closed, tied).sum())


def _chosen(mesh: FEMesh, pairs: str | Iterable[tuple[str, str]]) -> list[tuple[int, int]]:
    """Numbers of the materials of each pair, lower first; none for all pairs."""
    if pairs == "all":
        return []
    if isinstance(pairs, str):
        raise InputError(f"cohesive pairs = '{pairs}': give 'all' or pairs of material names")
    numbers = {name: m for m, name in mesh.material_names().items()}
    chosen = set()
    for pair in pairs:
        for name in pair:
            if name not in numbers:
                raise InputError(f"cohesive: there is no material '{name}'; there are: {', '.join(numbers)}")
        chosen.add((min(numbers[n] for n in pair), max(numbers[n] for n in pair)))
    if not chosen:
        raise InputError("cohesive: no pair of materials was given")
    return sorted(chosen)


def _cut_half_edges(mesh: FEMesh, chosen: list[tuple[int, int]]) -> tuple[Ints, Ints]:
    """Half-edges of chosen interfaces: of the material (the element) of lower number, ascending, and their twins."""
    twin = _twins_of_sides(mesh)
    own, other = mesh.cell_material[np.arange(len(twin)) // 4], mesh.cell_material[twin // 4]
    is_inside = any(a == b for a, b in chosen)
    first = (own < other) | ((own == other) & (np.arange(len(twin)) < twin) & is_inside)
    lower = np.flatnonzero((twin >= 0) & first)
    if chosen:
        names = mesh.material_names()
        is_chosen = np.zeros(len(lower), bool)
        for a, b in chosen:
            of_pair = (own[lower] == a) & (other[lower] == b)
            if not of_pair.any() and a == b:
                raise InputError(
                    f"cohesive: {(names[a], names[b])!r} must be two materials, or one with two elements side by side"
                )
            if not of_pair.any():
                raise InputError(f"cohesive: '{names[a]}' and '{names[b]}' do not touch; leave this pair out")
            is_chosen |= of_pair
        lower = lower[is_chosen]
    if not len(lower):
        raise InputError("cohesive: no two materials touch, there is nothing to split")
    return lower, twin[lower]


def _twins_of_sides(mesh: FEMesh) -> Ints:
    return twins_of(np.ascontiguousarray(mesh.cells[:, :4]), mesh.n_points)


def _split_nodes(mesh: FEMesh, group: Ints, cut: Ints, upper: Ints) -> tuple[Ints, Ints]:
    """Nodes of the elements after splitting along the half-edges `cut`, and the old node of each new one.

    Corners of elements around a node stay together where they are of one group. The middle of a cut edge is copied
    for the `upper` side.
    """
    corners = mesh.cells[:, :4].ravel()
    # across the seam of a periodic cell a group has several nodes
    group = np.unique(group * mesh.n_points + corners, return_inverse=True)[1].ravel()
    first = np.full(group.max() + 1, len(group))
    np.minimum.at(first, group, np.arange(len(group)))  # first corner of each group
    is_cut = np.zeros(mesh.n_points, bool)
    heads = np.roll(mesh.cells[:, :4], -1, axis=1).ravel()
    is_cut[corners[cut]] = is_cut[heads[cut]] = True
    keeper = np.full(mesh.n_points, len(group))  # first corner of all at each node: its group keeps the number
    np.minimum.at(keeper, corners, np.arange(len(corners)))
    copied = np.sort(first[is_cut[corners[first]] & (first != keeper[corners[first]])])
    number = corners[first]
    number[group[copied]] = mesh.n_points + np.arange(len(copied))
    cells = mesh.cells.copy()
    cells[:, :4] = number[group].reshape(-1, 4)
    origin = [np.arange(mesh.n_points), corners[copied]]
    if mesh.cells.shape[1] > 4:
        middles = (upper // 4, 4 + upper % 4)
        origin.append(mesh.cells[middles])
        cells[middles] = mesh.n_points + len(copied) + np.arange(len(upper))
    return cells, np.concatenate(origin)


def _groups_of_corners(mesh: FEMesh, cut: Ints) -> Ints:
    """Return the group of each corner ``4 cell + k`` of the elements.

    Corners around a node are of one group where their elements share an edge that is not cut, or the seam.
    """
    twin = _twins_of_sides(mesh)
    twin[cut] = -1
    tail = np.flatnonzero(twin >= 0)
    head_of_twin = twin[tail] // 4 * 4 + (twin[tail] + 1) % 4
    seam = [_corners_across(mesh, pairs) for pairs in mesh.periodic.values()]
    rows, columns = np.concatenate([np.stack([tail, head_of_twin]), *seam], axis=1)
    return linked(rows, columns, 4 * mesh.n_cells)[0]


def _corners_across(mesh: FEMesh, pairs: Ints) -> Ints:
    """Return pairs of corners that face each other across the seam, shape (2, n): both ends of each edge on it.

    ::

        -q'  |  q-      the edge (p', q') of an element on the one side is (q, p) of an element on the other
             |
        -p'  |  p-
    """
    partner = np.full(mesh.n_points, -1)
    partner[pairs[:, 0]] = pairs[:, 1]
    tails = mesh.cells[:, :4].ravel()
    heads = np.roll(mesh.cells[:, :4], -1, axis=1).ravel()
    next_corner = np.arange(len(tails)) // 4 * 4 + (np.arange(len(tails)) + 1) % 4
    outer = np.flatnonzero(_twins_of_sides(mesh) < 0)
    near = outer[(partner[tails[outer]] >= 0) & (partner[heads[outer]] >= 0)]
    key = heads[outer] * mesh.n_points + tails[outer]
    order = np.argsort(key)
    wanted = partner[tails[near]] * mesh.n_points + partner[heads[near]]
    at = np.searchsorted(key[order], wanted).clip(max=len(key) - 1)
    facing = key[order][at] == wanted
    near, far = near[facing], outer[order][at][facing]
    return np.stack([np.concatenate([near, next_corner[near]]), np.concatenate([next_corner[far], far])])


def _periodic_copies(mesh: FEMesh, group: Ints, cells: Ints) -> dict[str, Ints]:
    copies = {d: _paired_copies(mesh, pairs, group, cells) for d, pairs in mesh.periodic.items()}
    for direction, pairs in copies.items():
        if not len(pairs):
            raise InputError(
                f"periodic: in {direction} both sides meet in single nodes only, which interfaces part: "
                "nothing can be tied; drop less"
            )
    return copies


def _paired_copies(mesh: FEMesh, pairs: Ints, group: Ints, cells: Ints) -> Ints:
    """Return the pairs of copies of paired nodes: those whose corners are of one group; middles have no copies."""
    n, corners = mesh.n_points, mesh.cells[:, :4].ravel()
    key, first = np.unique(group * n + corners, return_index=True)  # each copy once
    copy = cells[:, :4].ravel()[first]
    place, partner = np.full(n, -1), np.full(n, -1)
    place[pairs[:, 0]], partner[pairs[:, 0]] = np.arange(len(pairs)), pairs[:, 1]
    master = np.flatnonzero(place[key % n] >= 0)
    wanted = key[master] // n * n + partner[key[master] % n]
    slave = np.searchsorted(key, wanted).clip(max=len(key) - 1)
    found = key[slave] == wanted
    copies = np.stack([copy[master], copy[slave]], axis=1)[found]
    middles = np.flatnonzero(~np.isin(pairs[:, 0], corners))
    order = np.concatenate([place[key[master] % n][found], middles])
    both: Ints = np.concatenate([copies, pairs[middles]])
    return np.asarray(both[np.lexsort((both[:, 0], order))])


def _node_sets(mesh: FEMesh, origin: Ints) -> dict[str, Ints]:
    """Give each side set a node set, of that side, and the others all copies of their nodes."""
    sets = {name: np.unique(mesh.side_nodes(sides)) for name, sides in mesh.side_sets.items()}
    others = {name: ids for name, ids in mesh.node_sets.items() if name not in sets}
    return sets | {name: np.flatnonzero(np.isin(origin, ids)) for name, ids in others.items()}
