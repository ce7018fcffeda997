"""Files for mesh apps: OBJ, OFF, PLY and STL of the quads, with the materials' colours where there is a place."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from imgquad_core.arrays import Bytes, Floats, Ints
from imgquad_core.fe.femesh import FEMesh

from .common import refuse_3d, refuse_cohesive, replacing, rows, safe_names, write_text


def write_obj(mesh: FEMesh, path: str | Path) -> None:
    """Write a Wavefront file (``.obj``): quads, a group for each material, the colours in a ``.mtl`` beside it."""
    points, quads = _corners(mesh, "OBJ")
    with replacing(path) as temporary:
        library = temporary.with_suffix(".mtl")
        for file, parts in ((library, _mtl(mesh)), (temporary, _obj(mesh, points, quads, library.name))):
            with file.open("w", encoding="utf-8", newline="\n") as stream:
                stream.writelines(parts)


def write_off(mesh: FEMesh, path: str | Path) -> None:
    """Write an Object File Format file (``.off``): quads with colours."""
    points, quads = _corners(mesh, "OFF")
    body = rows("4 %d %d %d %d %d %d %d\n", quads, _colors(mesh))
    head = f"OFF\n{len(points)} {len(quads)} 0\n"
    write_text(path, [head, *rows("%.16g %.16g %.16g\n", points), *body])


def write_ply(mesh: FEMesh, path: str | Path) -> None:
    """Write a Stanford file (``.ply``, binary little endian): quads with colours and the material number."""
    points, quads = _corners(mesh, "PLY")
    face = np.empty(
        len(quads), [("n", "u1"), ("corners", "<i4", 4), ("color", "u1", 3), ("material", "<i4")]
    )  # packed, as the header says
    face["n"], face["corners"], face["color"], face["material"] = 4, quads, _colors(mesh), mesh.cell_material
    header = (
        f"ply\nformat binary_little_endian 1.0\ncomment imgquad-mesh\nelement vertex {len(points)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {len(quads)}\nproperty list uchar int vertex_indices\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty int material\nend_header\n"
    )
    with replacing(path) as temporary:
        temporary.write_bytes(header.encode() + points.astype("<f8").tobytes() + face.tobytes())


def write_stl(mesh: FEMesh, path: str | Path) -> None:
    """Write a binary STL file (``.stl``): two triangles a quad; the attribute word is the material number."""
    points, quads = _corners(mesh, "STL")
    triangles = points[quads[:, [0, 1, 2, 0, 2, 3]]].reshape(-1, 3, 3)
    facet = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facet["normal"], facet["corners"] = (0, 0, 1), triangles
    facet["attribute"] = np.repeat(mesh.cell_material, 2)
    with replacing(path) as temporary:
        temporary.write_bytes(b"imgquad-mesh".ljust(80) + np.uint32(len(triangles)).tobytes() + facet.tobytes())


def _corners(mesh: FEMesh, form: str) -> tuple[Floats, Ints]:
    """Points and quads without the nodes between corners."""
    refuse_3d(mesh, form)
    refuse_cohesive(mesh, form)
    used, quads = np.unique(mesh.cells[:, :4], return_inverse=True)
    return np.column_stack([mesh.points[used], np.zeros(len(used))]), quads.reshape(-1, 4)


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


def _obj(mesh: FEMesh, points: Floats, quads: Ints, library: str) -> Iterator[str]:
    yield f"# imgquad-mesh\nmtllib {library}\n"
    yield from rows("v %.16g %.16g %.16g\n", points)
    sets = mesh.material_cells()
    names = safe_names(sets, 255)
    for name, ids in sets.items():
        yield f"g {names[name]}\nusemtl {names[name]}\n"
        yield from rows("f %d %d %d %d\n", quads[ids] + 1)
