"""Reads the mesh that a script starts with and saves the one that it ends with: quads stay quads."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from imgquad_core.errors import InputError
from imgquad_core.whole_files import replacing
from imgquad_mesh import datasets
from imgquad_mesh.outputs.files import check_target, mesh_extensions, replace_file, write_mesh_file

from .layer import Layer, surface, write_ply
from .process import MeshLabError, MeshLabProcess
from .state import State

#: formats that keep polygons when MeshLab writes them; its PLY has triangles only
_MESHLAB_POLYGONS = (".obj", ".off")
#: formats that only MeshLab writes here
_MESHLAB_ONLY = (".3ds", ".3mf", ".ctm", ".dae", ".u3d", ".wrl", ".x3d")


def check_saving(path: Path) -> None:
    """Raise `InputError` now if the mesh at a script's end could not be written to `path`."""
    check_target(path, (*mesh_extensions(), *_MESHLAB_ONLY))


def save_current(state: State, process: MeshLabProcess | None, path: Path) -> None:
    """Write the current layer.

    A PLY keeps all faces, colours and values; a mesh of quads goes to any format of ours; other layers to the formats
    of MeshLab. OBJ and OFF are MeshLab's where it runs: with colours.
    """
    ids, _ = state.meshes.layers
    if not ids:
        raise InputError(f"the script has made no mesh: there is nothing to write to {path}")
    extension = path.suffix.lower()
    layer = state.meshes.layer()
    if extension == ".ply":
        check_target(path, (".ply",))
        replace_file(path, lambda temporary: write_ply(layer, temporary))
    elif process is not None and (extension in _MESHLAB_POLYGONS or not _all_quads(layer)):
        _export(process, path)
    else:
        check_target(path, mesh_extensions())
        write_mesh_file(state.mesh(), path)


def _all_quads(layer: Layer) -> bool:
    return layer.n_faces > 0 and bool((layer.face_sizes == 4).all())


def _export(process: MeshLabProcess, path: Path) -> None:
    """Let MeshLab write into a folder beside `path` and move what it wrote (OBJ comes with a file of materials)."""
    with replacing(path) as temporary:
        try:
            process.export(temporary)
        except MeshLabError as error:
            raise InputError(
                f"cannot write {path}: {error}; formats of MeshLab: .ply .obj .off .stl and more"
            ) from error


def read_grid(path: Path) -> Layer:
    """Read a mesh of quads that PyVista saved; its cell array ``material`` tells the materials."""
    import pyvista as pv  # not above: a script that reads no grid starts without it

    if not path.is_file():
        raise InputError(f"there is no mesh {path}; give the path of a file")
    grid = pv.read(path)
    if not isinstance(grid, pv.UnstructuredGrid):
        raise InputError(f"mesh {path} is a {type(grid).__name__}; give an UnstructuredGrid of quads")
    quads = datasets.quads_of(grid)
    points = np.asarray(grid.points, np.float64)
    if "material" not in grid.cell_data:
        return surface(points, quads, label=path.name)
    material = np.asarray(grid.cell_data["material"], np.int32)
    return surface(points, quads, material=material, face_scalar=material.astype(np.float64), label=path.name)
