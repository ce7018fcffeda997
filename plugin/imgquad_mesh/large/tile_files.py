"""The files that show a mesh in tiles as one: pieces and what collects them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from imgquad_core.errors import InputError
from imgquad_core.model import Materials
from imgquad_core.tiles import Job
from imgquad_core.tiles.numbering import first_numbers
from imgquad_core.tiles.tasks import final_mesh, node_numbers
from imgquad_core.whole_files import replacing
from imgquad_mesh import datasets, outputs
from imgquad_mesh.datasets.field_texts import table_of

QUAD = 9  #: VTK's number of that cell


def write_piece(job: Job, t: int, counts: Sequence[tuple[int, int]], form: str) -> tuple[str, int, int]:
    """Write the piece of a tile, where the format has pieces; return its file and its numbers of nodes and quads."""
    found = final_mesh(job, t)
    size = len(found["points"]), len(found["quads"])
    name = "-".join(["tile", *map(str, job.grid.place(t))]) + ".vtu"
    path = Path(job.folder).parent / "mesh" / name
    if form == "pvtu" and size[1] and not path.exists():
        path.parent.mkdir(exist_ok=True)
        _save_piece(job, t, found, counts, path)
    return f"mesh/{name}", *size


def _save_piece(job: Job, t: int, found: dict[str, Any], counts: Sequence[tuple[int, int]], path: Path) -> None:
    import pyvista as pv  # not above: the other format does without it

    grid = pv.UnstructuredGrid({pv.CellType.QUAD: found["quads"]}, _placed(job, found["points"]))
    for name, values in _cell_arrays(t, found).items():
        grid.cell_data[name] = values
    grid.point_data["node"] = node_numbers(job, t, first_numbers(counts))
    datasets.put_materials(grid, job.rules().legend.materials)
    grid.set_active_scalars("material", preference="cell")
    outputs.replace_file(path, lambda temporary: outputs.save_dataset(grid, temporary))


def _placed(job: Job, points: Any) -> Any:
    """Return points in the unit of the options, with z = 0."""
    flat = points * job.options.pixel_sides + job.options.corner
    return np.column_stack([flat, np.zeros(len(flat))])


def _cell_arrays(t: int, found: dict[str, Any]) -> dict[str, Any]:
    return {
        "region": found["region"].astype(np.int64),
        "material": found["label"].astype(np.int32),
        "tile": np.full(len(found["quads"]), t, np.int32),
    }


def write_collected(job: Job, pieces: Sequence[tuple[str, int, int]], path: Path) -> None:
    """Write what shows all pieces as one."""
    if path.suffix == ".pvtu":
        text = _collection(job, [name for name, _, quads in pieces if quads])
        outputs.replace_file(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
        return
    try:
        import h5py  # noqa: F401, an extra
    except ImportError as error:
        raise InputError(".vtkhdf needs h5py: pip install h5py (or imgquad-mesh[hdf5]), or give pvtu") from error
    with replacing(path) as temporary:
        _save_hdf(job, [(t, nodes, quads) for t, (_, nodes, quads) in enumerate(pieces) if quads], temporary)


def _collection(job: Job, names: Sequence[str]) -> str:
    """Return a ParaView file of pieces."""
    pieces = [f"    <Piece Source={quoteattr(name)}/>" for name in names]
    arrays = [("Int64", "region"), ("Int32", "material"), ("Int32", "tile")]
    cells = [f'      <PDataArray type="{kind}" Name="{name}"/>' for kind, name in arrays]
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="PUnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt32">',
        '  <PUnstructuredGrid GhostLevel="0">',
        '    <PPoints><PDataArray type="Float64" Name="Points" NumberOfComponents="3"/></PPoints>',
        '    <PPointData><PDataArray type="Int64" Name="node"/></PPointData>',
        '    <PCellData Scalars="material">',
        *cells,
        "    </PCellData>",
        *pieces,
        "  </PUnstructuredGrid>",
        "</VTKFile>",
        "",
    ]
    return "\n".join(lines)


def _save_hdf(job: Job, tiles: Sequence[tuple[int, int, int]], path: Path) -> None:
    """Write a VTKHDF file with a partition a tile, one tile in memory at a time."""
    import h5py  # an extra

    nodes, quads = (np.array([row[k] for row in tiles], np.int64) for k in (1, 2))
    with h5py.File(path, "w", libver="latest", track_order=False) as file:
        root = file.create_group("VTKHDF", track_order=False)
        root.attrs["Version"] = (2, 0)
        root.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", len("UnstructuredGrid")))
        root["NumberOfPoints"], root["NumberOfCells"], root["NumberOfConnectivityIds"] = nodes, quads, 4 * quads
        total = int(quads.sum())
        points = _made(root, "Points", (int(nodes.sum()), 3), "f8")
        connectivity = _made(root, "Connectivity", (4 * total,), "i8")
        offsets = _made(root, "Offsets", (total + len(tiles),), "i8")
        _made(root, "Types", (total,), "u1")[:] = np.full(total, QUAD, np.uint8)
        cells = root.create_group("CellData")
        columns = {
            name: _made(cells, name, (total,), kind)
            for name, kind in (("region", "i8"), ("material", "i4"), ("tile", "i4"))
        }
        _put_fields(root, job.rules().legend.materials)
        n = q = 0
        for k, (t, n_nodes, n_quads) in enumerate(tiles):
            found = final_mesh(job, t)
            points[n : n + n_nodes] = _placed(job, found["points"])
            connectivity[4 * q : 4 * (q + n_quads)] = found["quads"].ravel()
            offsets[q + k : q + k + n_quads + 1] = 4 * np.arange(n_quads + 1)
            for name, values in _cell_arrays(t, found).items():
                columns[name][q : q + n_quads] = values
            n, q = n + n_nodes, q + n_quads


def _made(group: Any, name: str, shape: tuple[int, ...], kind: str) -> Any:
    """Make a dataset without a time in it, so that the same mesh gives the same bytes."""
    return group.create_dataset(name, shape, kind, track_times=False)


def _put_fields(root: Any, materials: Materials) -> None:
    fields = root.create_group("FieldData")
    fields["material_numbers"] = materials.labels
    fields["material_names"] = table_of(list(materials.names))  # VTK 9.7 crashes at texts in partitioned files
    fields["material_colors"] = materials.colors
