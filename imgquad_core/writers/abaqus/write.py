"""Abaqus and CalculiX input files: elements, sets, surfaces, sections, and a deck that runs if asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from imgquad_core.arrays import Ints
from imgquad_core.errors import InputError
from imgquad_core.fe.femesh import FEMesh, Names
from imgquad_core.fe.properties import Properties, Values, read_properties, values_of
from imgquad_core.writers.common import real, rows, safe_names, wrapped, write_text

from .cohesive import interface_text
from .decks import DECKS, deck_text
from .equations import driver_names, equation_text

#: element type by analysis and kind; a reduced one has an R behind it
ELEMENTS: Mapping[str, Mapping[str, str]] = {
    "plane stress": {"tri3": "CPS3", "quad4": "CPS4", "quad8": "CPS8"},
    "plane strain": {"tri3": "CPE3", "quad4": "CPE4", "quad8": "CPE8"},
    "axisymmetric": {"tri3": "CAX3", "quad4": "CAX4", "quad8": "CAX8"},
    "heat": {"tri3": "DC2D3", "quad4": "DC2D4", "quad8": "DC2D8", "hex8": "DC3D8"},
    "axisymmetric heat": {"tri3": "DCAX3", "quad4": "DCAX4", "quad8": "DCAX8"},
    "solid": {"hex8": "C3D8"},
}
NAME_LIMIT = 80  # of CalculiX and of Abaqus
REAL = "%.12g"  # at most 19 signs; CalculiX reads 20
#: side of an element in Abaqus: sides 0-3 of a hex stand on those of its quad, 4 is its bottom, 5 its top
SIDES: Mapping[str, tuple[int, ...]] = {"tri": (1, 2, 3), "quad": (1, 2, 3, 4), "hex": (3, 4, 5, 6, 1, 2)}


@dataclass(frozen=True)
class Labels:
    """Names in the file of the sets of a mesh: separate name spaces, as in Abaqus."""

    elements: Mapping[str, str]
    nodes: Mapping[str, str]
    surfaces: Mapping[str, str]


def write_abaqus(
    mesh: FEMesh,
    path: str | Path,
    *,
    analysis: str | None = None,
    reduced: bool = False,
    thickness: float = 1.0,
    properties: str | Path | Mapping[str, Any] | None = None,
    deck: str | None = None,
    regions: bool = False,
    interfaces: str | None = None,
) -> None:
    """Write an Abaqus input file (``.inp``) that CalculiX reads too.

    Parameters
    ----------
    mesh : FEMesh
        Quads of 4 or 8 nodes, triangles, or hexes.
    path : path
        File to write; replaced only when all of it was written.
    analysis : str, optional
        ``plane stress`` (CPS4; the default in the plane), ``plane strain`` (CPE4), ``axisymmetric`` (CAX4, x is the
        radius), ``heat`` (DC2D4, DC3D8), ``axisymmetric heat`` (DCAX4), ``solid`` (C3D8; the default of hexes).
        Abaqus conducts heat in the ``heat`` elements only; CalculiX has none of them and conducts in all others.
    reduced : bool
        Reduced integration: CPS4R and so on.
    thickness : float
        Out of the plane, in the unit of the points.
    properties : path or mapping, optional
        Material values: see `imgquad_core.fe.properties`. Without them each material is a stub to fill in.
        A region that has values of its own becomes a material with a section of its own.
    deck : str, optional
        ``tension`` (left held, right pulled by 0.1 % of the width) or ``thermal`` (left at 0, right at 1): a model
        that runs as it is (in CalculiX; for Abaqus give ``thermal`` the analysis ``heat``).
    regions : bool
        Also write an element set for each connected region.
    interfaces : str, optional
        Cohesive elements as ``elements`` (COH2D4, COH3D8) or as ``springs`` (SPRING2: CalculiX has no cohesive
        elements; the default in a deck). Second-order quads have springs only.

    Raises
    ------
    InputError
        Unknown analysis, an element the analysis does not have, a set name too long, or a deck without the values
        or the borders it needs.
    """
    chosen = analysis or ("solid" if mesh.dimension == 3 else "plane stress")
    element = element_type(mesh, chosen, reduced)
    if chosen.startswith("axisymmetric") and mesh.points[:, 0].min() < 0:
        raise InputError(
            f"axisymmetric: x is the radius, but the smallest x is {mesh.points[:, 0].min():g}; move the mesh"
        )
    if not thickness > 0:
        raise InputError(f"thickness = {thickness!r} must be positive")
    if interfaces is not None and not len(mesh.cohesive):
        raise InputError(f"interfaces = '{interfaces}', but no interface was split: say which, with cohesive")
    values = read_properties(properties) if properties is not None else {}
    sections = _sections_of(mesh, values)
    if deck is not None and deck not in DECKS:
        raise InputError(f"there is no deck '{deck}'; choose one of: {', '.join(DECKS)}")
    sets = {**mesh.material_cells(), **(mesh.region_cells() if regions else {})}
    sets |= {**{name: section.cells for name, section in sections.items()}, **mesh.element_sets}
    labels = Labels(
        safe_names([*sets, *mesh.cohesive_cells()], NAME_LIMIT, reserved=("EALL",), upper=True),
        safe_names(mesh.node_sets, NAME_LIMIT, reserved=("NALL", *driver_names(mesh).values()), upper=True),
        safe_names([f"S_{name}" for name in mesh.side_sets], NAME_LIMIT, upper=True),
    )
    parts = [_head(mesh, element), _sets(mesh, sets, labels), _sections(mesh, sections, labels, thickness)]
    if len(mesh.cohesive):
        chosen_form = interfaces or ("springs" if deck else "elements")
        parts.append(interface_text(mesh, labels.elements, values, thickness, chosen_form))
    if mesh.periodic:
        parts.append(equation_text(mesh, heat="heat" in chosen or deck == "thermal"))
    if deck is not None:
        parts.append(deck_text(mesh, deck, values, labels.elements, labels.nodes))
    write_text(path, chain.from_iterable(parts))


def element_type(mesh: FEMesh, analysis: str, reduced: bool) -> str:
    """Name of the element in Abaqus.

    Raises
    ------
    InputError
        There is no such analysis, no such element, or none of reduced integration.
    """
    if analysis not in ELEMENTS:
        raise InputError(f"there is no analysis '{analysis}'; choose one of: {', '.join(ELEMENTS)}")
    if mesh.kind not in ELEMENTS[analysis]:
        kinds = ", ".join(ELEMENTS[analysis])
        raise InputError(f"Abaqus has no {mesh.kind} for the analysis '{analysis}'; it has: {kinds}")
    if reduced and "heat" in analysis:
        raise InputError(f"the analysis '{analysis}' has no elements of reduced integration: leave out reduced")
    return ELEMENTS[analysis][mesh.kind] + ("R" if reduced else "")


def _head(mesh: FEMesh, element: str) -> Iterator[str]:
    yield "*HEADING\nimgquad-mesh\n*NODE, NSET=NALL\n"
    ids = np.arange(1, mesh.n_points + 1)
    yield from rows("%d" + f", {REAL}" * mesh.points.shape[1] + "\n", ids, mesh.points)
    yield f"*ELEMENT, TYPE={element}, ELSET=EALL\n"
    yield from rows("%d" + ", %d" * mesh.cells.shape[1] + "\n", np.arange(1, mesh.n_cells + 1), mesh.cells + 1)


def _sets(mesh: FEMesh, sets: Mapping[str, Ints], labels: Labels) -> Iterator[str]:
    for name, ids in sets.items():
        yield f"*ELSET, ELSET={labels.elements[name]}\n"
        yield from wrapped(ids + 1, 16)
    for name, ids in mesh.node_sets.items():
        yield f"*NSET, NSET={labels.nodes[name]}\n"
        yield from wrapped(ids + 1, 16)
    numbers = np.array(SIDES[mesh.kind[:-1]])
    for name, sides in mesh.side_sets.items():
        yield f"*SURFACE, NAME={labels.surfaces[f'S_{name}']}, TYPE=ELEMENT\n"
        yield from rows("%d, S%d\n", sides[:, 0] + 1, numbers[sides[:, 1]])


class Section(NamedTuple):
    """Elements of one material in the file, and its values."""

    cells: Ints
    values: Values


def _sections_of(mesh: FEMesh, values: Properties) -> dict[str, Section]:
    """Sections by name of their set: each region with values of its own, and of each material what is left.

    Raises
    ------
    InputError
        Values of a region that is not there.
    """
    sections: dict[str, Section] = {}
    regions = mesh.region_cells() if any("_region_" in name for name in values) else {}
    own_regions: dict[int, dict[str, Ints]] = {}
    for region, ids in regions.items():
        if region in values:
            own_regions.setdefault(int(mesh.cell_material[ids[0]]), {})[region] = ids
    claimed = Names([*mesh.material_cells(), *regions])
    for name, cells in mesh.material_cells().items():
        _assert_regions(name, values, regions)
        own = own_regions.get(int(mesh.cell_material[cells[0]]), {})
        for region, ids in own.items():
            sections[region] = Section(ids, {**values_of(values, name), **values[region]})
        rest = np.setdiff1d(cells, np.concatenate(list(own.values()))) if own else cells
        if len(rest):
            sections[claimed.claim(f"{name}_rest") if own else name] = Section(rest, values_of(values, name))
    return sections


def _assert_regions(material: str, values: Properties, regions: Mapping[str, Ints]) -> None:
    for name in values:
        if name.startswith(f"{material}_region_") and name[len(material) + 8 :].isdigit() and name not in regions:
            raise InputError(
                f"material values: there is no region '{name}'; --regions writes the element sets of all regions"
            )


def _sections(mesh: FEMesh, sections: Mapping[str, Section], labels: Labels, thickness: float) -> Iterator[str]:
    for name, section in sections.items():
        label = labels.elements[name]
        yield f"*MATERIAL, NAME={label}\n"
        yield from _material(section.values)
        axes = section.values.get("orientation")
        if axes:
            yield f"*ORIENTATION, NAME=O_{label}, SYSTEM=RECTANGULAR\n{', '.join(map(real, axes))}\n"
        yield f"*SOLID SECTION, ELSET={label}, MATERIAL={label}{f', ORIENTATION=O_{label}' if axes else ''}\n"
        if mesh.dimension == 2:
            yield f"{real(thickness)}\n"


def _material(values: Values) -> Iterator[str]:
    if "young" in values:
        yield f"*ELASTIC\n{real(values['young'])}, {real(values.get('poisson', 0.0))}\n"
    for key, keyword in (
        ("conductivity", "CONDUCTIVITY"),
        ("density", "DENSITY"),
        ("specific_heat", "SPECIFIC HEAT"),
        ("expansion", "EXPANSION"),
    ):
        if key in values:
            yield f"*{keyword}\n{real(values[key])}\n"
    if "depvar" in values:
        yield f"*DEPVAR\n{values['depvar']}\n"
    if "user_material" in values:
        yield f"*USER MATERIAL, CONSTANTS={len(values['user_material'])}\n"
        yield from _reals(values["user_material"])
    yield from (f"{row}\n" for row in values.get("abaqus", ()))
    if not set(values) - {"orientation"}:
        yield "** no values were given: put *ELASTIC or *CONDUCTIVITY here\n"


def _reals(values: Sequence[float]) -> Iterator[str]:
    """Eight to a line, as Abaqus and CalculiX read them."""
    for start in range(0, len(values), 8):
        yield ", ".join(map(real, values[start : start + 8])) + "\n"
