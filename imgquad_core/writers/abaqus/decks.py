"""Ready models for Abaqus and CalculiX: supports, load and output behind the mesh and its materials."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from imgquad_core.arrays import Ints
from imgquad_core.errors import InputError
from imgquad_core.fe.femesh import KINDS, FEMesh
from imgquad_core.fe.properties import Properties, values_of
from imgquad_core.grouping import linked
from imgquad_core.writers.common import real

from .equations import STRAIN, periodic_deck

#: what each deck needs of every material
DECKS: Mapping[str, tuple[str, ...]] = {"tension": ("young", "poisson"), "thermal": ("conductivity",)}


def deck_text(
    mesh: FEMesh, deck: str, values: Properties, elements: Mapping[str, str], nodes: Mapping[str, str]
) -> Iterator[str]:
    """Text of a deck.

    Parameters
    ----------
    mesh : FEMesh
        With the borders `left` and `right`.
    deck : str
        One of `DECKS`.
    values : Properties
        Values of every material.
    elements, nodes : mapping
        Names of element and node sets in the file.

    Raises
    ------
    InputError
        A material has no values or a border is not there.
    """
    for name in mesh.material_names().values():
        given = values_of(values, name)
        missing = [key for key in DECKS[deck] if key not in given]
        if missing and not {"user_material", "abaqus"} & set(given):
            raise InputError(
                f"the deck '{deck}' needs {' and '.join(missing)} of material '{name}'; "
                f'give them in a TOML file of properties below ["{name}"] or ["*"]'
            )
    if mesh.periodic:
        return periodic_deck(mesh, deck, nodes)
    for border in ("left", "right"):
        if border not in mesh.node_sets:
            raise InputError(f"the deck '{deck}' needs the {border} border, but no element lies on it")
    return _tension(mesh, nodes) if deck == "tension" else _thermal(mesh, nodes)


def _tension(mesh: FEMesh, nodes: Mapping[str, str]) -> Iterator[str]:
    x = mesh.points[:, 0]
    yield f"*BOUNDARY\n{nodes['left']}, 1, 1\n"
    for node, directions in _supports(mesh):
        yield from (f"{node + 1}, {d}, {d}\n" for d in directions)
    yield "*STEP\n*STATIC\n*BOUNDARY\n"
    yield f"{nodes['right']}, 1, 1, {real(STRAIN * float(x.max() - x.min()))}\n"
    yield f"*NODE PRINT, NSET={nodes['right']}, TOTALS=ONLY\nRF\n"
    yield "*NODE FILE\nU, RF\n*EL FILE\nS, E\n*END STEP\n"


def _thermal(mesh: FEMesh, nodes: Mapping[str, str]) -> Iterator[str]:
    yield "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nNALL, 0.\n"
    yield f"*BOUNDARY\n{nodes['left']}, 11, 11, 0.\n{nodes['right']}, 11, 11, 1.\n"
    held = np.concatenate([mesh.node_sets["left"], mesh.node_sets["right"]])
    for part in _parts(mesh):
        if not np.isin(part, held).any():
            yield f"{part[0] + 1}, 11, 11, 0.\n"
    yield "*STEP\n*HEAT TRANSFER, STEADY STATE\n1., 1.\n"
    yield f"*NODE PRINT, NSET={nodes['right']}, TOTALS=ONLY\nRFL\n"
    yield "*NODE FILE\nNT, RFL\n*EL FILE\nHFL\n*END STEP\n"


def _supports(mesh: FEMesh) -> Iterator[tuple[int, tuple[int, ...]]]:
    """Supports, (node, directions), that stop every connected part from moving as a whole and load none of them."""
    is_held = np.zeros(mesh.n_points, bool)
    is_held[mesh.node_sets["left"]] = is_held[mesh.node_sets["right"]] = True
    for part in _parts(mesh):
        held = part[is_held[part]]
        if len(held):
            first = held[np.lexsort(mesh.points[held].T)[0]]
            yield int(first), (2, 3) if mesh.dimension == 3 else (2,)
            if mesh.dimension == 3:
                yield from _stop_turning(mesh, held, int(first))
        else:
            yield from _hold_island(mesh, part)


def _stop_turning(mesh: FEMesh, held: Ints, first: int) -> Iterator[tuple[int, tuple[int, ...]]]:
    """In space a part held along x can still turn about x: hold z where y differs most."""
    far = held[np.argmax(np.abs(mesh.points[held, 1] - mesh.points[first, 1]))]
    if mesh.points[far, 1] != mesh.points[first, 1]:
        yield int(far), (3,)


def _hold_island(mesh: FEMesh, part: Ints) -> Iterator[tuple[int, tuple[int, ...]]]:
    """Three (six) directions for a part that hangs on no border: a point, a point beside it, a point above."""
    if mesh.dimension == 3:
        raise InputError(
            f"{len(part)} nodes of the extruded mesh hang on neither left nor right: drop such parts before extruding"
        )
    first = part[np.lexsort(mesh.points[part].T)[0]]
    beside = part[np.argmax(np.abs(mesh.points[part, 0] - mesh.points[first, 0]))]
    yield int(first), (1, 2)
    yield int(beside), (2,)


def _parts(mesh: FEMesh) -> list[Ints]:
    """Nodes of each part that elements, cohesive ones too, hold together; ascending."""
    links = [mesh.cells[:, [0, other]] for other in range(1, KINDS[mesh.kind].n_nodes)]
    links += [mesh.cohesive[:, [0, other]] for other in range(1, mesh.cohesive.shape[1])]
    pairs = np.concatenate(links)
    part_of, n_parts = linked(pairs[:, 0], pairs[:, 1], mesh.n_points)
    order = np.argsort(part_of, kind="stable")
    return np.split(order, np.cumsum(np.bincount(part_of, minlength=n_parts))[:-1])
