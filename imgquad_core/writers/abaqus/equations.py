"""Equations that tie opposite sides of a periodic cell in an Abaqus input file, and what drives the cell."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from imgquad_core.errors import InputError
from imgquad_core.fe.femesh import FEMesh
from imgquad_core.writers.common import real

STRAIN = 1e-3  #: mean strain of the tension deck
TEMPERATURE = 11  #: its degree of freedom


def driver_names(mesh: FEMesh) -> dict[str, str]:
    """Name of the node set of each driver: a node of its own that holds how far opposite sides are apart."""
    return {direction: f"PERIODIC_{direction.upper()}" for direction in mesh.periodic}


def equation_text(mesh: FEMesh, heat: bool) -> Iterator[str]:
    """Text of the drivers and of the equations ``slave - master - drivers = 0``.

    Parameters
    ----------
    mesh : FEMesh
        With `periodic` pairs.
    heat : bool
        Tie temperatures instead of displacements.

    Notes
    -----
    No dependent node of one equation is a node of another: the top right corner is tied to the bottom left one.
    """
    drivers = {direction: mesh.n_points + 1 + i for i, direction in enumerate(mesh.periodic)}
    far = mesh.points.max(axis=0)
    for direction, number in drivers.items():
        yield f"*NODE, NSET={driver_names(mesh)[direction]}\n{number}, " + ", ".join(map(real, far)) + "\n"
    for slave, (master, directions) in sorted(_ties(mesh).items()):
        terms = [slave + 1, master + 1, *(drivers[d] for d in directions)]
        for dof in (TEMPERATURE,) if heat else range(1, mesh.dimension + 1):
            factors = ["1.", *["-1."] * (len(terms) - 1)]
            items = [f"{node}, {dof}, {factor}" for node, factor in zip(terms, factors, strict=True)]
            yield f"*EQUATION\n{len(terms)}\n" + ", ".join(items) + "\n"


def _ties(mesh: FEMesh) -> dict[int, tuple[int, str]]:
    """Master of each slave, and the directions between them; masters are no slaves."""
    masters = {
        d: dict(zip(pairs[:, 1].tolist(), pairs[:, 0].tolist(), strict=True)) for d, pairs in mesh.periodic.items()
    }
    ties: dict[int, tuple[int, str]] = {}
    for direction, of in masters.items():
        for slave in of:
            node, path = slave, ""
            for step in (direction, *(d for d in masters if d != direction)):
                if node in masters[step]:
                    node, path = masters[step][node], path + step
            ties.setdefault(slave, (node, path))
    return ties


def periodic_deck(mesh: FEMesh, deck: str, nodes: Mapping[str, str]) -> Iterator[str]:
    """Text of a step that drives a periodic cell: a mean strain, or a mean gradient of temperature, along x.

    Notes
    -----
    What is printed is the force (heat) over the right side: CalculiX has none at a driver, which has no element.

    Raises
    ------
    InputError
        The cell is not periodic along x.
    """
    if "x" not in mesh.periodic:
        raise InputError(f"the deck '{deck}' drives a periodic cell along x: make it periodic along x or xy")
    names = driver_names(mesh)
    width = float(np.ptp(mesh.points[:, 0]))
    first = int(mesh.periodic["x"][0, 0]) + 1
    if deck == "thermal":
        yield f"*INITIAL CONDITIONS, TYPE=TEMPERATURE\nNALL, 0.\n*BOUNDARY\n{first}, 11, 11, 0.\n"
        yield from (f"{name}, 11, 11, {1.0 if d == 'x' else 0.0}\n" for d, name in names.items())
        yield "*STEP\n*HEAT TRANSFER, STEADY STATE\n1., 1.\n"
        yield f"*NODE PRINT, NSET={nodes['right']}, TOTALS=ONLY\nRFL\n*NODE FILE\nNT, RFL\n*EL FILE\nHFL\n*END STEP\n"
        return
    yield f"*BOUNDARY\n{first}, 1, {mesh.dimension}\n"
    yield f"{names['x']}, 2, {mesh.dimension}\n"
    if "y" in names:
        yield f"{names['y']}, 1, 1\n" + (f"{names['y']}, 3, 3\n" if mesh.dimension == 3 else "")
    yield f"*STEP\n*STATIC\n*BOUNDARY\n{names['x']}, 1, 1, {real(STRAIN * width)}\n"
    yield f"*NODE PRINT, NSET={nodes['right']}, TOTALS=ONLY\nRF\n*NODE FILE\nU, RF\n*EL FILE\nS, E\n*END STEP\n"
