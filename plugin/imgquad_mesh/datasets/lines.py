"""Boundaries of materials as polylines, with all that the next filter needs: nothing is lost on the way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from pyvista.core.errors import MissingDataError

from imgquad_core.errors import InputError
from imgquad_core.model import VOID, BoundaryGraph, Materials

from .fields import MATERIAL_FIELDS, materials_of, put_materials
from .placement import PLAIN, Placement

POINT_ARRAYS = ("point_kind", "pixel_coordinates")
FIELD_ARRAYS = (
    *MATERIAL_FIELDS,
    "region_label", "region_pixels", "picture_shape", "pixel_origin", "pixel_axes",
)  # fmt: skip
SIZES = "mesh_sizes"  #: field array of a smoothed boundary: size and growth
PERIODIC = "periodic"  #: "x", "y" or "xy" where opposite sides match
MATERIAL_SIZES = "mesh_material_sizes"  #: rows of number and size


class Boundaries(NamedTuple):
    """What a PolyData of boundaries stands for."""

    graph: BoundaryGraph
    materials: Materials
    placement: Placement
    sizes: tuple[float, float, Mapping[int, float]] | None = None  # size, growth, material sizes of smoothing
    periodic: str = "none"  # directions in which sides match


def to_lines(boundaries: Boundaries) -> pv.PolyData:
    """Return boundaries as polylines, one cell a chain.

    Cell arrays `boundary_labels` (left, right; active), `boundary_regions` and `chain`; point arrays `point_kind` and
    `pixel_coordinates`; field arrays of the materials, regions, sizes and of where the pixels lie.
    """
    graph, materials, placement, sizes, periodic = boundaries
    left_right = np.append(graph.region_label, np.int32(VOID))[graph.chain_regions]  # region -1 takes the last one
    lines = chain_lines(graph.points, graph.chain_offsets, graph.chain_points, left_right, graph.point_kind, placement)
    lines.cell_data["boundary_regions"] = graph.chain_regions
    lines.point_data["pixel_coordinates"] = graph.points
    put_materials(lines, materials)
    fields: dict[str, Any] = {
        "region_label": graph.region_label,
        "region_pixels": graph.region_pixels,
        "picture_shape": np.array(graph.shape),
        "pixel_origin": placement.origin,
        "pixel_axes": placement.axes,
    }
    if periodic != "none":
        fields[PERIODIC] = periodic
    if sizes:
        fields[SIZES] = np.array(sizes[:2], float)
        if sizes[2]:
            fields[MATERIAL_SIZES] = np.array(list(sizes[2].items()), float)
    for name, values in fields.items():
        lines.field_data[name] = np.atleast_1d(values)
    lines.set_active_scalars("boundary_labels", preference="cell")
    return lines


def from_lines(lines: pv.PolyData) -> Boundaries:
    """Return what `to_lines` was given, to the bit.

    Raises
    ------
    pyvista.core.errors.MissingDataError
        These are no boundaries of an image.
    InputError
        They have been changed since they were made.
    """
    _assert_boundaries(lines)
    fields = lines.field_data
    cells = lines.GetLines()
    graph = BoundaryGraph(
        points=lines.point_data["pixel_coordinates"],
        point_kind=lines.point_data["point_kind"],
        chain_offsets=pv.convert_array(cells.GetOffsetsArray()),
        chain_points=pv.convert_array(cells.GetConnectivityArray()),
        chain_regions=lines.cell_data["boundary_regions"],
        region_label=fields["region_label"],
        region_pixels=fields["region_pixels"],
        shape=(int(fields["picture_shape"][0]), int(fields["picture_shape"][1])),
    )
    placement = Placement(np.array(fields["pixel_origin"]), np.array(fields["pixel_axes"]).reshape(2, 3))
    _assert_unmoved(lines, graph, placement)
    periodic = str(fields[PERIODIC][0]) if PERIODIC in fields else "none"
    return Boundaries(graph, materials_of(lines), placement, _sizes(lines), periodic)


def _sizes(lines: pv.PolyData) -> tuple[float, float, Mapping[int, float]] | None:
    fields = lines.field_data
    if SIZES not in fields:
        return None
    rows = np.reshape(fields[MATERIAL_SIZES], (-1, 2)).tolist() if MATERIAL_SIZES in fields else []
    size, growth = map(float, fields[SIZES])
    return size, growth, {int(number): length for number, length in rows}


def _assert_boundaries(lines: pv.PolyData) -> None:
    missing = [name for name in POINT_ARRAYS if name not in lines.point_data]
    missing += [name for name in ("boundary_regions",) if name not in lines.cell_data]
    missing += [name for name in FIELD_ARRAYS if name not in lines.field_data]
    if missing:
        raise MissingDataError(
            f"this PolyData holds no boundaries of materials, as it has no array '{missing[0]}': make them by "
            "image.imgquad.boundaries()"
        )
    if lines.n_lines != lines.n_cells:
        raise InputError(f"{lines.n_cells - lines.n_lines} cells are no lines: use the boundaries as they were made")


def _assert_unmoved(lines: pv.PolyData, graph: BoundaryGraph, placement: Placement) -> None:
    placed = placement.place(graph.points)
    apart = np.abs(placed - lines.points).max(initial=0.0)
    if apart > 1e-6 * placement.pixel_size + 1e-12 * np.abs(placed).max(initial=0.0):
        raise InputError(
            f"points of the boundaries were moved, by up to {apart:g}: the mesh is made in pixels; move the image "
            "before, or the mesh afterwards"
        )


def chain_lines(
    points: NDArray[np.float64],
    offsets: NDArray[np.int64],
    chain_points: NDArray[np.int64],
    left_right: NDArray[np.int32],
    point_kind: NDArray[np.uint8],
    placement: Placement = PLAIN,
) -> pv.PolyData:
    """Return chains as polylines with the cell arrays `boundary_labels` (left, right; -1 for none) and `chain`."""
    counts = np.diff(offsets)
    lines = np.insert(chain_points, offsets[:-1], counts)
    poly = pv.PolyData(placement.place(points), lines=lines)
    poly.cell_data["chain"] = np.arange(len(counts), dtype=np.int32)
    poly.cell_data["boundary_labels"] = left_right
    poly.point_data["point_kind"] = point_kind
    return poly
