"""Files for mesh apps: OBJ, OFF, PLY and STL of the faces, with the materials' colours where there is a place."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from imgquad_core.arrays import Bytes, Floats, Ints
from imgquad_core.fe.femesh import FEMesh
from imgquad_core.whole_files import replacing

from .common import refuse_3d, refuse_cohesive, rows, safe_names, write_text
from .ply import ply_bytes


def write_obj(mesh: FEMesh, path: str | Path) -> None:
    """Write a Wavefront file (``.obj``): quads, a group for each material, the colours in a ``.mtl`` beside it."""
    points, faces = _corners(mesh, "OBJ")
    with replacing(path) as temporary:
        library = temporary.with_suffix(".mtl")
        for file, parts in ((library, _mtl(mesh)), (temporary, _obj(mesh, points, faces, library.name))):
            with file.open("w", encoding="utf-8", newline="\n") as stream:
                stream.writelines(parts)


def write_off(mesh: FEMesh, path: str | Path) -> None:
    """Write an Object File Format file (``.off``): quads with colours, or triangles without.

    meshio, which reads it for PyVista, takes triangles without colours and nothing else.
    """
    points, faces = _corners(mesh, "OFF")
    plain = faces.shape[1] == 3
    body = rows("3 %d %d %d\n", faces) if plain else rows("4 %d %d %d %d %d %d %d\n", faces, _colors(mesh))
    head = f"OFF\n{len(points)} {len(faces)} 0\n"
    write_text(path, [head, *rows("%.16g %.16g %.16g\n", points), *body])


def write_ply(mesh: FEMesh, path: str | Path) -> None:
    """Write a Stanford file (``.ply``, binary little endian): quads with colours and the material number."""
    points, faces = _corners(mesh, "PLY")
    offsets = np.arange(len(faces) + 1) * faces.shape[1]
    of_faces = {**dict(zip(("red", "green", "blue"), _colors(mesh).T, strict=True)), "material": mesh.cell_material}
    whole = ply_bytes("imgquad-mesh", dict(zip("xyz", points.T, strict=True)), (offsets, faces.ravel()), of_faces)
    with replacing(path) as temporary:
        temporary.write_bytes(whole)


def write_stl(mesh: FEMesh, path: str | Path) -> None:
    """Write a binary STL file (``.stl``): two triangles a quad; the attribute word is the material number."""
    points, faces = _corners(mesh, "STL")
    corners = faces if faces.shape[1] == 3 else faces[:, [0, 1, 2, 0, 2, 3]]
    triangles = points[corners].reshape(-1, 3, 3)
    facet = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facet["normal"], facet["corners"] = (0, 0, 1), triangles
    facet["attribute"] = np.repeat(mesh.cell_material, len(triangles) // len(faces))
    with replacing(path) as temporary:
        temporary.write_bytes(b"imgquad-mesh".ljust(80) + np.uint32(len(triangles)).tobytes() + facet.tobytes())


def _corners(mesh: FEMesh, form: str) -> tuple[Floats, Ints]:
    """Points and faces without the nodes between corners."""
    refuse_3d(mesh, form)
    refuse_cohesive(mesh, form)
    n_corners = min(mesh.cells.shape[1], 4)
    used, faces = np.unique(mesh.cells[:, :n_corners], return_inverse=True)
    return np.column_stack([mesh.points[used], np.zeros(len(used))]), faces.reshape(-1, n_corners)


def _colors(mesh: FEMesh) -> Bytes:
    """Colour of each quad; grey where a material has none."""
    at = np.searchsorted(mesh.materials.labels, mesh.cell_material)
    known = np.isin(mesh.cell_material, mesh.materials.labels)
    colors = np.full((mesh.n_cells, 3), 128, np.uint8)
    colors[known] = mesh.materials.colors[at[known]]
    return colors


def _mtl(mesh: FEMesh) -> Iterator[str]:
    # rounded up: readers that cut off the fraction of 255 times a value get the same colour
    colors, sets = np.ceil(_colors(mesh) / 255.0 * 1e6) / 1e6, mesh.material_cells()
    names = safe_names(sets, 255)
    for name, ids in sets.items():
        if len(ids):
            yield "newmtl {}\nKd {:.6f} {:.6f} {:.6f}\n".format(names[name], *colors[ids[0]])


def _obj(mesh: FEMesh, points: Floats, faces: Ints, library: str) -> Iterator[str]:
    yield f"# imgquad-mesh\nmtllib {library}\n"
    yield from rows("v %.16g %.16g %.16g\n", points)
    sets = mesh.material_cells()
    names = safe_names(sets, 255)
    for name, ids in sets.items():
        yield f"g {names[name]}\nusemtl {names[name]}\n"
        yield from rows("f" + " %d" * faces.shape[1] + "\n", faces[ids] + 1)
