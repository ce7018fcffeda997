"""Abaqus and CalculiX input files: elements, sets, surfaces, sections, and a deck that runs if asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from imgquad_core.arrays import Ints
from imgquad_core.errors import InputError
from imgquad_core.fe.femesh import FEMesh
from imgquad_core.fe.properties import Properties, read_properties, values_of
from imgquad_core.writers.common import real, rows, safe_names, wrapped, write_text

from .cohesive import interface_text
from .decks import DECKS, deck_text
from .equations import driver_names, equation_text

#: element type by analysis and kind; a reduced one has an R behind it
ELEMENTS: Mapping[str, Mapping[str, str]] = {
    "plane stress": {"quad4": "CPS4", "quad8": "CPS8"},
    "plane strain": {"quad4": "CPE4", "quad8": "CPE8"},
    "axisymmetric": {"quad4": "CAX4", "quad8": "CAX8"},
    "heat": {"quad4": "DC2D4", "quad8": "DC2D8", "hex8": "DC3D8"},
    "axisymmetric heat": {"quad4": "DCAX4", "quad8": "DCAX8"},
    "solid": {"hex8": "C3D8"},
}
NAME_LIMIT = 80  # of CalculiX and of Abaqus
REAL = "%.12g"  # at most 19 signs; CalculiX reads 20
#: side of an element in Abaqus: sides 0-3 of a hex stand on those of its quad, 4 is its bottom, 5 its top
SIDES: Mapping[str, tuple[int, ...]] = {"quad": (1, 2, 3, 4), "hex": (3, 4, 5, 6, 1, 2)}


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
        Quads of 4 or 8 nodes, or hexes.
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
    if deck is not None and deck not in DECKS:
        raise InputError(f"there is no deck '{deck}'; choose one of: {', '.join(DECKS)}")
    sets = {**mesh.material_cells(), **(mesh.region_cells() if regions else {})}
    labels = Labels(
        safe_names([*sets, *mesh.cohesive_cells()], NAME_LIMIT, reserved=("EALL",), upper=True),
        safe_names(mesh.node_sets, NAME_LIMIT, reserved=("NALL", *driver_names(mesh).values()), upper=True),
        safe_names([f"S_{name}" for name in mesh.side_sets], NAME_LIMIT, upper=True),
    )
    parts = [*_head(mesh, element), *_sets(mesh, sets, labels), *_sections(mesh, labels, values, thickness)]
    if len(mesh.cohesive):
        chosen_form = interfaces or ("springs" if deck else "elements")
        parts += interface_text(mesh, labels.elements, values, thickness, chosen_form)
    if mesh.periodic:
        parts += equation_text(mesh, heat="heat" in chosen or deck == "thermal")
    if deck is not None:
        parts += deck_text(mesh, deck, values, labels.elements, labels.nodes)
    write_text(path, parts)


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


def _sections(mesh: FEMesh, labels: Labels, values: Properties, thickness: float) -> Iterator[str]:
    for name in mesh.material_names().values():
        label = labels.elements[name]
        yield f"*MATERIAL, NAME={label}\n"
        yield from _material(values_of(values, name))
        yield f"*SOLID SECTION, ELSET={label}, MATERIAL={label}\n"
        if mesh.dimension == 2:
            yield f"{real(thickness)}\n"


def _material(values: Mapping[str, float]) -> Iterator[str]:
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
    if not values:
        yield "** no values were given: put *ELASTIC or *CONDUCTIVITY here\n"
