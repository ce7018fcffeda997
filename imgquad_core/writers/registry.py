"""Which writer has which extension."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from inspect import Parameter, signature
from pathlib import Path
from types import MappingProxyType
from typing import Any

from imgquad_core.errors import InputError
from imgquad_core.fe.femesh import FEMesh
from imgquad_core.fe.sets import fe_mesh
from imgquad_core.model import QuadMesh

from .abaqus.write import write_abaqus
from .ansys import write_ansys
from .archive import write_npz
from .converted import write_med, write_unv, write_xdmf
from .drawings import write_dxf, write_svg
from .exodus import write_exodus
from .gmsh import write_gmsh
from .nastran import write_nastran
from .surfaces import write_obj, write_off, write_ply, write_stl

Writer = Callable[..., None]

#: formats that cannot hold cohesive elements, and what they are called in errors
WITHOUT_COHESIVE: Mapping[str, str] = MappingProxyType(
    {".bdf": "Nastran", ".cdb": "An Ansys archive", ".xdmf": "XDMF", ".obj": "OBJ", ".off": "OFF", ".ply": "PLY"}
    | {".stl": "STL"}
)

#: writer of each extension; `.vtu`, `.vtk` and `.vtkhdf` are PyVista's own and live in the plugin
WRITERS: Mapping[str, Writer] = MappingProxyType(
    {
        ".bdf": write_nastran,
        ".cdb": write_ansys,
        ".dxf": write_dxf,
        ".e": write_exodus,
        ".inp": write_abaqus,
        ".med": write_med,
        ".msh": write_gmsh,
        ".npz": write_npz,
        ".obj": write_obj,
        ".off": write_off,
        ".ply": write_ply,
        ".stl": write_stl,
        ".svg": write_svg,
        ".unv": write_unv,
        ".xdmf": write_xdmf,
    }
)


def writer_for(path: str | Path) -> Writer:
    """Return the writer of the extension of `path`.

    Raises
    ------
    InputError
        No writer here has this extension.
    """
    extension = Path(path).suffix.lower()
    if extension not in WRITERS:
        raise InputError(f"no writer for '{extension}' ({path}); there are: {' '.join(sorted(WRITERS))}")
    return WRITERS[extension]


def options_of(writer: Writer) -> tuple[str, ...]:
    """Names of the options that `writer` takes besides the mesh and the path."""
    return tuple(p.name for p in signature(writer).parameters.values() if p.kind is Parameter.KEYWORD_ONLY)


def check_options(path: str | Path, options: Iterable[str]) -> None:
    """Raise `InputError` where the writer of the extension of `path` does not have an option."""
    known = options_of(writer_for(path))
    for name in options:
        if name not in known:
            raise InputError(f"{Path(path).suffix} has no option '{name}'; options: {', '.join(known) or 'none'}")


def write_mesh(mesh: QuadMesh | FEMesh, path: str | Path, **options: Any) -> None:
    """Write `mesh` in the format of the extension of `path`.

    Parameters
    ----------
    mesh : QuadMesh or FEMesh
        What to write; sets are found if it is a `QuadMesh`.
    path : path
        File to write; replaced only when all of it was written.
    **options
        Of the writer: see its docstring.

    Raises
    ------
    InputError
        No such format, no such option, or the format cannot hold the mesh.
    """
    check_options(path, options)
    writer_for(path)(fe_mesh(mesh) if isinstance(mesh, QuadMesh) else mesh, path, **options)
