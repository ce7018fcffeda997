"""Formats that kept libraries write right: MED and UNV by Gmsh, XDMF by meshio. These are extras."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from time import time
from typing import Any

import numpy as np

from imgquad_core.errors import InputError
from imgquad_core.fe.femesh import FEMesh
from imgquad_core.whole_files import replacing, take_room

from .common import points_3d, refuse_cohesive, refuse_six_nodes
from .gmsh import gmsh_text
from .hdf5_times import erase_times
from .neighbours import is_of_xdmf

OVERHEAD = 200_000  #: bytes of an HDF5 file besides the arrays, at most
MOST_TIMES = 6  #: a universal file is this much longer than its .msh, at most
MED_NAME_LIMIT = 80  #: Gmsh cuts longer ones off
UNV_NAME_LIMIT = 80  #: what the format has
MESHIO_KINDS = {"tri3": "triangle", "quad4": "quad", "quad8": "quad8", "quad9": "quad9", "hex8": "hexahedron"}


def write_med(mesh: FEMesh, path: str | Path) -> None:
    """Write a MED file (``.med``) for Code_Aster and Salome with groups of elements, sides and corners; by Gmsh.

    Raises
    ------
    InputError
        The Python package gmsh is not installed, six-node cohesive elements, or a name of more than 80 signs.
    """
    _by_gmsh(mesh, path, MED_NAME_LIMIT)


def write_unv(mesh: FEMesh, path: str | Path) -> None:
    """Write an I-DEAS universal file (``.unv``) for Salome, Code_Aster and others, with named groups; by Gmsh.

    Nodes are dataset 2411, elements 2412, groups of elements, sides and corners 2477.

    Raises
    ------
    InputError
        The Python package gmsh is not installed, quads of nine nodes, six-node cohesive elements, or a name of more
        than 80 signs.
    """
    if mesh.kind == "quad9":
        raise InputError("UNV has no quads of nine nodes: take eight (--nodes 8), or write .med or .msh")
    _by_gmsh(mesh, path, UNV_NAME_LIMIT)


def _by_gmsh(mesh: FEMesh, path: str | Path, name_limit: int) -> None:
    extension = Path(path).suffix.lower()
    gmsh = _needed("gmsh", extension)
    refuse_six_nodes(mesh, f"Gmsh, which writes {extension},")
    with replacing(path) as temporary:
        source = temporary.with_suffix(".msh")
        with source.open("w", encoding="utf-8", newline="\n") as stream:
            stream.writelines(gmsh_text(mesh, name_limit=name_limit))
        take_room(temporary.parent, MOST_TIMES * source.stat().st_size + OVERHEAD)
        start = time()
        gmsh.initialize(interruptible=False)
        try:
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.open(str(source))
            gmsh.write(str(temporary))
        finally:
            gmsh.finalize()
        source.unlink()
        if temporary.suffix == ".med":
            erase_times(temporary, start, time())


def write_xdmf(mesh: FEMesh, path: str | Path) -> None:
    """Write an XDMF file (``.xdmf`` and ``.h5`` beside it) for FEniCSx and ParaView; by meshio.

    Elements carry their `material`; a second file ``NAME_sides.xdmf`` has the sides with the number `side_set`, in the
    order of `FEMesh.side_sets` from 1 (an interface that was not split once).

    Raises
    ------
    InputError
        The Python packages meshio and h5py are not installed, the mesh has cohesive elements, or ``NAME.h5`` is there
        and was not written by this function.
    """
    meshio = _needed("meshio", ".xdmf")
    _needed("h5py", ".xdmf")
    refuse_cohesive(mesh, "XDMF")
    points = points_3d(mesh) if mesh.dimension == 3 else mesh.points
    sides, numbers = _tagged_sides(mesh)
    arrays = (points, points, mesh.cells, mesh.cell_material, sides, numbers)
    with replacing(path, is_of_xdmf) as temporary:
        take_room(temporary.parent, sum(array.nbytes for array in arrays) + OVERHEAD)
        cells = [(MESHIO_KINDS[mesh.kind], mesh.cells)]
        meshio.write(temporary, meshio.Mesh(points, cells, cell_data={"material": [mesh.cell_material]}), "xdmf")
        kind = {(2, 2): "line", (2, 3): "line3", (3, 4): "quad"}[mesh.dimension, sides.shape[1]]
        tagged = meshio.Mesh(points, [(kind, sides)], cell_data={"side_set": [numbers]})
        meshio.write(temporary.with_name(f"{temporary.stem}_sides{temporary.suffix}"), tagged, "xdmf")


def _tagged_sides(mesh: FEMesh) -> tuple[Any, Any]:
    """All sides of all sets, each once, with the number of the first set that has it."""
    nodes = np.concatenate([mesh.side_nodes(sides) for sides in mesh.side_sets.values()])
    numbers = np.repeat(np.arange(1, len(mesh.side_sets) + 1), [len(sides) for sides in mesh.side_sets.values()])
    _, first = np.unique(np.sort(nodes, axis=1), axis=0, return_index=True)
    kept = np.sort(first)
    return nodes[kept], numbers[kept].astype(np.int32)


def _needed(package: str, extension: str) -> Any:
    try:
        return import_module(package)
    except ImportError as error:
        raise InputError(f"{extension} is written by the Python package {package}: pip install {package}") from error
