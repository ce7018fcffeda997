"""Exodus II files: named element blocks, node sets and side sets, as NetCDF 3 by SciPy."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from imgquad_core.arrays import Ints
from imgquad_core.fe.femesh import FEMesh
from imgquad_core.whole_files import replacing

from .common import LOOKED_UP, Nodes, refuse_six_nodes, safe_names

NAME_LIMIT = 255
ELEMENTS = {"tri3": "TRI3", "quad4": "QUAD4", "quad8": "QUAD8", "quad9": "QUAD9", "hex8": "HEX8"}


def write_exodus(mesh: FEMesh, path: str | Path) -> None:
    """Write an Exodus II file (``.e``): a block per material and per cohesive pair, node sets, side sets.

    Parameters
    ----------
    mesh : FEMesh
        Quads of 4, 8 or 9 nodes, or hexes; cohesive elements of 4 or 8 nodes.
    path : path
        File to write; replaced only when all of it was written.

    Notes
    -----
    Elements stand block by block; `elem_num_map` has their numbers in `mesh`, from 1.

    Raises
    ------
    InputError
        Six-node cohesive elements, or a name of more than 255 signs.
    """
    refuse_six_nodes(mesh, "Exodus")
    with replacing(path) as temporary, scipy.io.netcdf_file(str(temporary), "w", version=2) as file:
        folder = temporary.parent.parent
        _heading(file, mesh, folder)
        position = _blocks(file, mesh, folder)
        _node_sets(file, mesh)
        _side_sets(file, mesh, position)


def _heading(file: Any, mesh: FEMesh, folder: Path) -> None:
    file.api_version = file.version = np.float32(5.22)
    file.floating_point_word_size, file.file_size, file.maximum_name_length = 8, 1, NAME_LIMIT
    file.title = b"imgquad-mesh"
    dimension = mesh.points.shape[1]
    file.createDimension("time_step", None)
    for name, size in (("len_string", 33), ("len_line", 81), ("four", 4), ("len_name", NAME_LIMIT + 1)):
        file.createDimension(name, size)
    file.createDimension("num_dim", dimension)
    file.createDimension("num_nodes", mesh.n_points)
    file.createDimension("num_elem", mesh.n_cells + len(mesh.cohesive))
    file.createVariable("time_whole", "d", ("time_step",))
    for axis in range(dimension):
        starts = range(0, mesh.n_points, LOOKED_UP)
        values = _kept("d", (mesh.points[start : start + LOOKED_UP, axis] for start in starts), folder)
        _put(file, f"coord{'xyz'[axis]}", "d", ("num_nodes",), values)
    _put_names(file, "coor_names", "num_dim", list("xyz"[:dimension]))


def _blocks(file: Any, mesh: FEMesh, folder: Path) -> Ints:
    """Write the blocks; return the place in the file of each element of `mesh`, from 1."""
    cells = {name: (ids, Nodes(mesh.cells, ids)) for name, ids in mesh.material_cells().items()}
    for name, ids in mesh.cohesive_cells().items():
        cells[name] = (mesh.n_cells + ids, Nodes(mesh.cohesive, ids))
    file.createDimension("num_el_blk", len(cells))
    _put_list(file, "eb", "num_el_blk", list(cells))
    for b, (ids, nodes) in enumerate(cells.values(), 1):
        file.createDimension(f"num_el_in_blk{b}", len(ids))
        file.createDimension(f"num_nod_per_el{b}", nodes.of.shape[1])
        values = _kept("i", (part + 1 for part in nodes.parts()), folder)
        connect = _put(file, f"connect{b}", "i", (f"num_el_in_blk{b}", f"num_nod_per_el{b}"), values)
        is_cohesive = len(ids) and ids[0] >= mesh.n_cells
        connect.elem_type = (
            ("HEX8" if mesh.dimension == 3 else "QUAD4") if is_cohesive else ELEMENTS[mesh.kind]
        ).encode()
    order = np.concatenate([ids for ids, _ in cells.values()])
    _put(file, "elem_num_map", "i", ("num_elem",), order + 1)
    position = np.empty(len(order), np.int64)
    position[order] = np.arange(1, len(order) + 1)
    return position


def _node_sets(file: Any, mesh: FEMesh) -> None:
    if not mesh.node_sets:
        return
    file.createDimension("num_node_sets", len(mesh.node_sets))
    _put_list(file, "ns", "num_node_sets", list(mesh.node_sets))
    for s, ids in enumerate(mesh.node_sets.values(), 1):
        file.createDimension(f"num_nod_ns{s}", len(ids))
        _put(file, f"node_ns{s}", "i", (f"num_nod_ns{s}",), ids + 1)


def _side_sets(file: Any, mesh: FEMesh, position: Ints) -> None:
    if not mesh.side_sets:
        return
    file.createDimension("num_side_sets", len(mesh.side_sets))
    _put_list(file, "ss", "num_side_sets", list(mesh.side_sets))
    for s, sides in enumerate(mesh.side_sets.values(), 1):
        file.createDimension(f"num_side_ss{s}", len(sides))
        _put(file, f"elem_ss{s}", "i", (f"num_side_ss{s}",), position[sides[:, 0]])
        _put(file, f"side_ss{s}", "i", (f"num_side_ss{s}",), sides[:, 1] + 1)


def _put_list(file: Any, prefix: str, dimension: str, names: list[str]) -> None:
    """Status, number and name of each block or set."""
    _put(file, f"{prefix}_status", "i", (dimension,), np.ones(len(names)))
    ids = _put(file, f"{prefix}_prop1", "i", (dimension,), np.arange(1, len(names) + 1))
    ids.name = b"ID"
    _put_names(file, f"{prefix}_names", dimension, list(safe_names(names, NAME_LIMIT).values()))


def _put_names(file: Any, name: str, dimension: str, texts: list[str]) -> None:
    table = np.array([text.encode().ljust(NAME_LIMIT + 1, b"\0") for text in texts], f"S{NAME_LIMIT + 1}")
    _put(file, name, "c", (dimension, "len_name"), table.view("S1").reshape(len(texts), -1))


def _kept(kind: str, parts: Iterable[NDArray[Any]], folder: Path) -> NDArray[Any]:
    """Keep the values of a variable in a file without a name until SciPy writes all variables at the end."""
    dtype = np.dtype(kind).newbyteorder(">")
    with tempfile.TemporaryFile(dir=folder) as stream:
        for part in parts:
            stream.write(part.astype(dtype).tobytes())
        stream.flush()
        return np.memmap(stream, dtype, "r")


def _put(file: Any, name: str, kind: str, dimensions: tuple[str, ...], values: NDArray[Any]) -> Any:
    """Add a variable; all come into the file in the order in which they are added.

    SciPy writes them by falling shape, so all claim the same one (it is used for nothing else). meshio pairs the n-th
    set in the file with the n-th name.
    """
    data = np.ascontiguousarray(values, np.dtype(kind).newbyteorder(">"))
    variable = scipy.io.netcdf_variable(data, kind, data.itemsize, (1,), dimensions)
    file.variables[name] = variable
    return variable
