"""Nastran bulk data: large-field grids, elements with a property per material, sets in case control."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from imgquad_core.arrays import Ints
from imgquad_core.errors import InputError
from imgquad_core.fe.femesh import FEMesh
from imgquad_core.fe.properties import Properties, read_properties, values_of

from .common import points_3d, refuse_cohesive, rows, safe_names, write_text

NAME_LIMIT = 60  # names stand in comments; a line has 80 columns
ELEMENTS: Mapping[str, Mapping[str, str]] = {
    "plane stress": {"tri3": "CTRIA3", "quad4": "CQUAD4", "quad8": "CQUAD8"},
    "plane strain": {"tri3": "CPLSTN3", "quad4": "CPLSTN4", "quad8": "CPLSTN8"},
    "solid": {"hex8": "CHEXA"},
}


def write_nastran(
    mesh: FEMesh,
    path: str | Path,
    *,
    analysis: str | None = None,
    thickness: float = 1.0,
    properties: str | Path | Mapping[str, Any] | None = None,
) -> None:
    """Write a Nastran file (``.bdf``): a mesh with properties, materials and sets, without loads.

    Parameters
    ----------
    mesh : FEMesh
        Quads of 4 or 8 nodes, or hexes, without cohesive elements.
    path : path
        File to write; replaced only when all of it was written.
    analysis : str, optional
        ``plane stress`` (CQUAD4 with PSHELL, the default in the plane), ``plane strain`` (CPLSTN4 with PPLANE) or
        ``solid`` (CHEXA with PSOLID, the default of hexes).
    thickness : float
        Out of the plane.
    properties : path or mapping, optional
        Material values: see `imgquad_core.fe.properties`. Without them MAT1 holds E = 1 and nu = 0, marked in a
        comment.

    Raises
    ------
    InputError
        Nastran has no such element, or a name is too long.
    """
    refuse_cohesive(mesh, "Nastran")
    chosen = analysis or ("solid" if mesh.dimension == 3 else "plane stress")
    if chosen not in ELEMENTS or mesh.kind not in ELEMENTS[chosen]:
        known = "; ".join(f"{a}: {', '.join(kinds)}" for a, kinds in ELEMENTS.items())
        raise InputError(f"Nastran: no {mesh.kind} for the analysis '{chosen}'; there are {known}")
    if not thickness > 0:
        raise InputError(f"thickness = {thickness!r} must be positive")
    values = read_properties(properties) if properties is not None else {}
    write_text(path, _text(mesh, ELEMENTS[chosen][mesh.kind], thickness, values))


def _text(mesh: FEMesh, element: str, thickness: float, values: Properties) -> Iterator[str]:
    sets = [("nodes", mesh.node_sets), ("elements", mesh.material_cells()), ("elements", mesh.element_sets)]
    labels = safe_names(dict.fromkeys(name for _, named in sets for name in named), NAME_LIMIT)
    yield "$ imgquad-mesh\nSOL 101\nCEND\n"
    for number, (what, name, ids) in enumerate(((what, *item) for what, named in sets for item in named.items()), 1):
        yield f"$ SET {number}: {what} {labels[name]}\n"
        yield from _case_set(number, ids + 1)
    yield "BEGIN BULK\n"
    points = points_3d(mesh)
    ids = np.arange(1, mesh.n_points + 1)
    yield from rows("GRID*   %16d                %16s%16s\n*       %16s\n", ids, _fields(points))
    for pid, (material, name) in enumerate(mesh.material_names().items(), 1):
        yield f"$ property and material {pid}: {labels[name]}\n"
        yield from _property(element, pid, thickness, values_of(values, name))
        cells = np.flatnonzero(mesh.cell_material == material)
        yield from rows(_card(element, pid, mesh.cells.shape[1]), cells + 1, mesh.cells[cells] + 1)
    yield "ENDDATA\n"


def _card(element: str, pid: int, n_nodes: int) -> str:
    """Small-field template of an element: 8 columns a field, 6 nodes on the first line.

    The second line starts with ``+``: meshio takes one that starts with blanks for the end of the file's element.
    """
    first = f"{element:8s}%8d{pid:8d}" + "%8d" * min(n_nodes, 6)
    return first + ("\n+       " + "%8d" * (n_nodes - 6) if n_nodes > 6 else "") + "\n"


def _fields(points: np.ndarray[Any, np.dtype[np.float64]]) -> np.ndarray[Any, np.dtype[np.str_]]:
    """Coordinates as text of at most 16 signs with a decimal point, as Nastran wants reals."""
    return np.array([[_real(v) for v in row] for row in points.tolist()])


def _real(value: float) -> str:
    for digits in range(15, 5, -1):
        text = f"{value:.{digits}g}"
        if "." not in text:
            text = text.replace("e", ".e") if "e" in text else text + "."
        if len(text) <= 16:
            return text
    raise InputError(f"the coordinate {value!r} does not fit into 16 signs; scale the mesh")


def _property(element: str, pid: int, thickness: float, values: Mapping[str, float]) -> Iterator[str]:
    if element.startswith(("CQUAD", "CTRIA")):
        yield f"PSHELL* {pid:16d}{pid:16d}{_real(thickness):>16s}\n*\n"
    elif element.startswith("CPLSTN"):
        yield f"PPLANE* {pid:16d}{pid:16d}{_real(thickness):>16s}\n*\n"
    else:
        yield f"PSOLID  {pid:8d}{pid:8d}\n"
    if "young" not in values:
        yield "$ no values were given: MAT1 below is a stub\n"
    young, poisson = values.get("young", 1.0), values.get("poisson", 0.0)
    density = f"{_real(values['density']):>16s}" if "density" in values else " " * 16
    expansion = f"{_real(values['expansion']):>16s}" if "expansion" in values else ""
    yield (
        f"MAT1*   {pid:16d}{_real(young):>16s}{'':16s}{_real(poisson):>16s}\n*       {density}{expansion}".rstrip()
        + "\n"
    )
    if "conductivity" in values:
        yield f"MAT4*   {pid:16d}{_real(values['conductivity']):>16s}\n*\n"


def _case_set(number: int, ids: Ints) -> Iterator[str]:
    """``SET n = 1,2,...`` with runs as ``a THRU b``, in lines of at most 72 columns."""
    line = f"SET {number} = "
    starts = np.flatnonzero(np.diff(ids, prepend=-2) != 1)
    ends = np.append(starts[1:], len(ids)) - 1
    runs = [(int(ids[a]), int(ids[b])) for a, b in zip(starts, ends, strict=True)]
    for i, (low, high) in enumerate(runs):
        item = str(low) if low == high else f"{low} THRU {high}" if high > low + 1 else f"{low},{high}"
        item += "," if i + 1 < len(runs) else "\n"
        if len(line) + len(item) > 72:
            yield line + "\n"
            line = "  "
        line += item
    yield line
