"""Ansys archive files (CDWRITE, blocked): nodes, elements with a material each, components, material values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from imgquad_core.arrays import Ints
from imgquad_core.errors import InputError
from imgquad_core.fe.femesh import FEMesh, Names
from imgquad_core.fe.properties import Properties, Values, read_properties, values_of

from .common import points_3d, real, refuse_cohesive, rows, safe_names, write_text

NAME_LIMIT = 32
RESERVED = ("ALL", "STAT", "DEFA")


class Element(NamedTuple):
    """Number of an element type of Ansys, and its KEYOPT(3): what is assumed across the plane."""

    number: int
    across: int | None


#: element by analysis and kind; a triangle is a quad whose last two corners are one
ELEMENTS: Mapping[str, Mapping[str, Element]] = {
    "plane stress": {"tri3": Element(182, 3), "quad4": Element(182, 3), "quad8": Element(183, 3)},
    "plane strain": {"tri3": Element(182, 2), "quad4": Element(182, 2), "quad8": Element(183, 2)},
    "axisymmetric": {"tri3": Element(182, 1), "quad4": Element(182, 1), "quad8": Element(183, 1)},
    "heat": {"tri3": Element(55, 0), "quad4": Element(55, 0), "quad8": Element(77, 0), "hex8": Element(70, None)},
    "solid": {"hex8": Element(185, None)},
}
#: label in MP of each value
VALUES = {
    "young": "EX",
    "poisson": "PRXY",
    "density": "DENS",
    "expansion": "ALPX",
    "conductivity": "KXX",
    "specific_heat": "C",
}


def write_ansys(
    mesh: FEMesh,
    path: str | Path,
    *,
    analysis: str | None = None,
    thickness: float = 1.0,
    properties: str | Path | Mapping[str, Any] | None = None,
) -> None:
    """Write an Ansys archive (``.cdb``, read by ``CDREAD,DB,name,cdb``): a mesh with materials and components.

    Parameters
    ----------
    mesh : FEMesh
        Quads of 4 or 8 nodes, triangles, or hexes, without cohesive elements.
    path : path
        File to write; replaced only when all of it was written.
    analysis : str, optional
        ``plane stress`` (PLANE182 or 183 with thickness, the default in the plane), ``plane strain``, ``axisymmetric``
        (x is the radius), ``heat`` (PLANE55, PLANE77, SOLID70) or ``solid``
        (SOLID185, the default of hexes).
    thickness : float
        Out of the plane, in plane stress.
    properties : path or mapping, optional
        Material values: see `imgquad_core.fe.properties`.

    Notes
    -----
    Components are node sets, and element sets of materials and of elements at interfaces. As their names are short,
    `interface_A_B` is I_A_B of nodes and EI_A_B of elements.

    Raises
    ------
    InputError
        Ansys has no such element, or a component's name has more than 32 signs.
    """
    refuse_cohesive(mesh, "An Ansys archive")
    chosen = analysis or ("solid" if mesh.dimension == 3 else "plane stress")
    if mesh.kind not in ELEMENTS.get(chosen, {}):
        known = "; ".join(f"{a}: {', '.join(kinds)}" for a, kinds in ELEMENTS.items())
        raise InputError(f"Ansys: no {mesh.kind} for the analysis '{chosen}'; there are {known}")
    if not thickness > 0:
        raise InputError(f"thickness = {thickness!r} must be positive")
    values = read_properties(properties) if properties is not None else {}
    write_text(path, _text(mesh, ELEMENTS[chosen][mesh.kind], thickness, values))


def _text(mesh: FEMesh, element: Element, thickness: float, values: Properties) -> Iterator[str]:
    yield f"/COM,imgquad-mesh\n/PREP7\nET,1,{element.number}\n"
    if element.across is not None:
        yield f"KEYOPT,1,3,{element.across}\nR,1,{real(thickness)}\n"
    yield f"NBLOCK,6,SOLID,{mesh.n_points:10d},{mesh.n_points:10d}\n(3i9,6e21.13e3)\n"
    yield from rows("%9d        0        0%21.13E%21.13E%21.13E\n", np.arange(1, mesh.n_points + 1), points_3d(mesh))
    yield f"N,R5.3,LOC,       -1,\nEBLOCK,19,SOLID,{mesh.n_cells:10d},{mesh.n_cells:10d}\n(19i9)\n"
    yield from _elements(mesh)
    yield "       -1\n"
    for number, name in enumerate(mesh.material_names().values(), 1):
        yield from _material(number, values_of(values, name))
    yield from _components(mesh)
    yield "FINISH\n"


def _elements(mesh: FEMesh) -> Iterator[str]:
    nodes = np.column_stack([mesh.cells, mesh.cells[:, 2]]) if mesh.kind == "tri3" else mesh.cells
    material = 1 + np.searchsorted(list(mesh.material_names()), mesh.cell_material)
    count = nodes.shape[1]
    # material, type, constants, section, system, alive, solid model, shape, number of nodes, unused, element
    head = f"%9d        1        1        1        0        0        0        0{count:9d}        0%9d"
    yield from rows(head + "%9d" * count + "\n", material, np.arange(1, mesh.n_cells + 1), nodes + 1)


def _material(number: int, values: Values) -> Iterator[str]:
    for key, label in VALUES.items():
        if key in values:
            yield f"MP,{label},{number},{real(values[key])}\n"


def _components(mesh: FEMesh) -> Iterator[str]:
    elements = {**mesh.material_cells(), **mesh.element_sets}
    named = [("ELEM", name, ids) for name, ids in elements.items()]
    named += [("NODE", name, ids) for name, ids in mesh.node_sets.items()]
    claimed = Names(RESERVED)  # one name space for both kinds
    for what, name, ids in named:
        label = claimed.claim(_label(what, name))
        yield from _component(label, what, _ranges(ids + 1))


def _label(what: str, name: str) -> str:
    if name.startswith("interface_"):
        name = ("EI_" if what == "ELEM" else "I_") + name.removeprefix("interface_")
    return safe_names([name], NAME_LIMIT, upper=True)[name]


def _component(name: str, what: str, items: Ints) -> Iterator[str]:
    yield f"CMBLOCK,{name},{what},{len(items):8d}\n(8i10)\n"
    for start in range(0, len(items), 8):
        yield "".join(f"{item:10d}" for item in items[start : start + 8].tolist()) + "\n"


def _ranges(ids: Ints) -> Ints:
    """Ascending ids; a run from a to b is a, -b."""
    starts = np.flatnonzero(np.diff(ids, prepend=-2) != 1)
    ends = np.append(starts[1:], len(ids)) - 1
    pairs = np.stack([ids[starts], -ids[ends]], axis=1).ravel()
    kept = np.stack([np.ones(len(starts), bool), ends > starts], axis=1).ravel()
    return np.asarray(pairs[kept])
