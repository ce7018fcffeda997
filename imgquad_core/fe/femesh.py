"""The value that solvers' files are written from: nodes, elements of one kind, named sets."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from imgquad_core.arrays import Bytes, Floats, Ints, Labels, Value, read_only
from imgquad_core.frozen import FrozenMapping
from imgquad_core.model import Materials


class Kind(NamedTuple):
    """What an element kind is made of: number of dimensions and of nodes, and the nodes of each side."""

    dimension: int
    n_nodes: int
    sides: tuple[tuple[int, ...], ...]


#        7          3---6---2   side k runs from corner k to corner k + 1, its middle node is 4 + k.
#       / \         |       |   A hex stands on its quad: corners 0-3 below, 4-7 above;
#      3 . 2        7   8   5   sides 0-3 stand on the quad's sides, side 4 is the bottom, side 5 the top.
#                   |       |   Sides of hexes are listed so that their normals point outwards.
#                   0---4---1
KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "tri3": Kind(2, 3, ((0, 1), (1, 2), (2, 0))),
        "quad4": Kind(2, 4, ((0, 1), (1, 2), (2, 3), (3, 0))),
        "quad8": Kind(2, 8, ((0, 1, 4), (1, 2, 5), (2, 3, 6), (3, 0, 7))),
        "quad9": Kind(2, 9, ((0, 1, 4), (1, 2, 5), (2, 3, 6), (3, 0, 7))),
        "hex8": Kind(3, 8, ((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (0, 3, 2, 1), (4, 5, 6, 7))),
    }
)


def _frozen_sets(sets: Mapping[str, ArrayLike]) -> Mapping[str, Ints]:
    return FrozenMapping({name: read_only(ids, np.int64) for name, ids in sets.items()})


@dataclass(frozen=True, eq=False)
class FEMesh(Value):
    """Nodes, elements and named sets, ready for a solver.

    Parameters
    ----------
    points : float64, shape (n_points, 2) or (n_points, 3)
        Nodes, in the user's unit.
    kind : str
        One of `KINDS`: what all solid elements are.
    cells : int64, shape (n_cells, n_nodes)
        Nodes of each element, counter-clockwise corners first, then the middles of the sides, then the centre.
    cell_material : int32, shape (n_cells,)
        Material of each element.
    cell_region : int64, shape (n_cells,)
        Region (connected, of one material) of each element.
    materials : Materials
        Number, name and colour of the materials.
    node_sets : mapping of str to int64 array
        Ids of nodes, ascending.
    side_sets : mapping of str to int64 array, shape (n, 2)
        (element, side) of each side, in the order of the elements.
    point_kind : uint8, shape (n_points,)
        A `PointKind` each, of the corners of elements.
    chain_offsets, chain_points : int64
        Boundary polylines as in `QuadMesh` (empty once nodes were split or the mesh was extruded).
    cohesive : int64, shape (n_cohesive, 4, 6 or 8)
        Zero-thickness elements: see `imgquad_core.fe.cohesive`. Their ids follow those of `cells`.
    cohesive_pair : int32, shape (n_cohesive, 2)
        Material below and above each of them; the normal points from the first to the second.
    periodic : mapping of str to int64 array, shape (n, 2)
        Pairs of nodes (master, slave) that a periodic cell ties, by direction `x`, `y`.
    element_sets : mapping of str to int64 array
        Ids of solid elements, ascending; sets besides those of materials and regions.
    """

    points: Floats
    kind: str
    cells: Ints
    cell_material: Labels
    cell_region: Ints
    materials: Materials
    node_sets: Mapping[str, Ints]
    side_sets: Mapping[str, Ints]
    point_kind: Bytes
    chain_offsets: Ints
    chain_points: Ints
    cohesive: Ints = field(default_factory=lambda: np.empty((0, 4), np.int64))
    cohesive_pair: Labels = field(default_factory=lambda: np.empty((0, 2), np.int32))
    periodic: Mapping[str, Ints] = field(default_factory=dict)
    element_sets: Mapping[str, Ints] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("node_sets", "side_sets", "periodic", "element_sets"):
            object.__setattr__(self, name, _frozen_sets(getattr(self, name)))

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return KINDS[self.kind].dimension

    @property
    def n_points(self) -> int:
        """Number of nodes."""
        return len(self.points)

    @property
    def n_cells(self) -> int:
        """Number of solid elements."""
        return len(self.cells)

    def side_nodes(self, sides: Ints) -> Ints:
        """Nodes of (element, side) pairs, shape (n, nodes of a side): ends first, then the middle."""
        table = np.array(KINDS[self.kind].sides, np.int64)
        nodes: Ints = self.cells[sides[:, :1], table[sides[:, 1]]]
        return nodes

    def material_names(self) -> dict[int, str]:
        """Name of each material that occurs, by number, ascending; no two alike."""
        return name_materials(self.cell_material, self.materials)

    def material_cells(self) -> dict[str, Ints]:
        """Elements of each material, by name, in the order of the materials' numbers."""
        return {name: np.flatnonzero(self.cell_material == m) for m, name in self.material_names().items()}

    def region_cells(self) -> dict[str, Ints]:
        """Elements of each region: `quartz_region_1`, ... counted within each material in order of region."""
        order = np.argsort(self.cell_region, kind="stable")
        starts = np.flatnonzero(np.diff(self.cell_region[order], prepend=-1))
        names, counts, sets = self.material_names(), dict[int, int](), dict[str, Ints]()
        for cells in np.split(order, starts[1:]) if len(order) else ():
            material = int(self.cell_material[cells[0]])
            counts[material] = counts.get(material, 0) + 1
            sets[f"{names[material]}_region_{counts[material]}"] = np.sort(cells)
        return sets

    def cohesive_cells(self) -> dict[str, Ints]:
        """Rows of `cohesive` between each two materials, by name `cohesive_A_B`."""
        names = self.material_names()
        pairs, of = np.unique(self.cohesive_pair, axis=0, return_inverse=True)
        claimed = Names()
        return {
            claimed.claim(f"cohesive_{names[int(a)]}_{names[int(b)]}"): np.flatnonzero(of.ravel() == i)
            for i, (a, b) in enumerate(pairs)
        }


def nodes_of_sides(mesh: FEMesh) -> dict[str, Ints]:
    """Return the node sets of `mesh`, those named like a side set made anew from its sides."""
    return {
        name: np.unique(mesh.side_nodes(mesh.side_sets[name])) if name in mesh.side_sets else ids
        for name, ids in mesh.node_sets.items()
    }


def name_materials(labels: Labels, materials: Materials) -> dict[int, str]:
    """Name of each material among `labels`, by number, ascending; no two alike."""
    names = Names()
    return {int(m): names.claim(materials.name_of(int(m))) for m in np.unique(labels)}


class Names:
    """Names already given: a second `quartz` becomes `quartz_2`. Case does not tell names apart."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._taken = {name.casefold() for name in taken}

    def claim(self, name: str) -> str:
        """Return `name`, or `name` with the lowest free number behind it."""
        free, number = name, 1
        while free.casefold() in self._taken:
            number += 1
            free = f"{name}_{number}"
        self._taken.add(free.casefold())
        return free
