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
    for slave, (master, steps) in sorted(_ties(mesh).items()):
        terms = {slave + 1: 1, master + 1: -1} | {drivers[d]: -n for d, n in steps.items() if n}
        for dof in (TEMPERATURE,) if heat else range(1, mesh.dimension + 1):
            items = [f"{node}, {dof}, {factor}." for node, factor in terms.items()]
            yield f"*EQUATION\n{len(terms)}\n" + ", ".join(items) + "\n"


def _ties(mesh: FEMesh) -> dict[int, tuple[int, dict[str, int]]]:
    """Master of each slave, and how often each direction leads from it to the slave; masters are no slaves.

    Of nodes that are tied to one another, the leftmost and lowest is the master. At corners where interfaces were
    split it may be at the upper left: then the lower right corner is one step right and one back down from there.
    """
    beside: dict[int, list[tuple[int, str, int]]] = {}
    for direction, pairs in mesh.periodic.items():
        for master, slave in pairs.tolist():
            beside.setdefault(master, []).append((slave, direction, 1))
            beside.setdefault(slave, []).append((master, direction, -1))
    steps: dict[int, tuple[int, dict[str, int]]] = {}
    for master in sorted(beside, key=lambda node: (*mesh.points[node].tolist(), node)):
        if master in steps:
            continue
        steps[master] = master, dict.fromkeys(mesh.periodic, 0)
        waiting = [master]
        while waiting:
            node = waiting.pop()
            for other, direction, step in beside[node]:
                if other not in steps:
                    way = steps[node][1]
                    steps[other] = master, way | {direction: way[direction] + step}
                    waiting.append(other)
    return {node: tie for node, tie in steps.items() if node != tie[0]}


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
