"""Our figures of a mesh beside those of MeshLab and of PyVista: three programs that nobody here wrote together agree.

MeshLab measures in single precision here and there, so that it agrees to about seven digits. Two of its figures are
never asked for: ``quads_number`` is 0 on every pure quad mesh, and its corner angles fold reflex corners back.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.errors import QualityError
from imgquad_core.geometry.halfedge import components, twins_of
from imgquad_core.grouping import linked
from imgquad_core.measures.quality import corner_angles, material_areas, quad_areas, scaled_jacobian
from imgquad_core.model import VOID, QuadMesh
from imgquad_core.whole_files import scratch_folder
from imgquad_mesh import datasets

from .meshsets import quad_layer
from .process import MeshLabProcess

TOLERANCE = 1e-5  #: largest difference, relative to the figure's own scale


@dataclass(frozen=True)
class Comparison:
    """One figure, ours and another program's.

    Parameters
    ----------
    name : str
        What was measured.
    program : str
        ``MeshLab`` or ``PyVista``.
    ours, theirs : float
        The two figures.
    scale : float
        What the difference is relative to: the figure itself, 90 degrees for angles, 1 for ratios and counts.
    """

    name: str
    program: str
    ours: float
    theirs: float
    scale: float

    @property
    def difference(self) -> float:
        """Difference relative to `scale`; 0 where both are 0."""
        return abs(self.ours - self.theirs) / self.scale if self.ours != self.theirs else 0.0

    @property
    def agrees(self) -> bool:
        """Whether the difference is at most `TOLERANCE`."""
        return self.difference <= TOLERANCE


@dataclass(frozen=True)
class CrossCheck:
    """All comparisons of one mesh."""

    comparisons: tuple[Comparison, ...]

    @property
    def passed(self) -> bool:
        """Whether all figures agree."""
        return all(c.agrees for c in self.comparisons)

    @property
    def table(self) -> str:
        """The comparisons as text, one line each."""
        rows = [("figure", "ours", "other", "by", "difference")]
        rows += [
            (c.name, f"{c.ours:.10g}", f"{c.theirs:.10g}", c.program, f"{c.difference:.1e}") for c in self.comparisons
        ]
        widths = [max(len(row[i]) for row in rows) for i in range(5)]
        lines = ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in rows]
        return "\n".join(lines)

    def require(self, mesh: QuadMesh | None = None) -> None:
        """Raise `QualityError` that names the figures that differ, if any do."""
        apart = [c for c in self.comparisons if not c.agrees]
        if apart:
            told = "; ".join(f"{c.name}: {c.ours:.10g}, {c.program} {c.theirs:.10g}" for c in apart[:5])
            raise QualityError(
                f"{len(apart)} of {len(self.comparisons)} figures differ by more than {TOLERANCE:g}: {told}", mesh
            )


def crosscheck(mesh: QuadMesh, deadline: float = 120.0) -> CrossCheck:
    """Measure a mesh here, with MeshLab and with PyVista.

    Parameters
    ----------
    mesh : QuadMesh
        With at least one quad.
    deadline : float
        Seconds that one measurement of MeshLab may take.

    Returns
    -------
    CrossCheck
        Area, perimeter and interface length in all and per material, border edges, components, manifoldness, corner
        angles, edge ratios, scaled Jacobian.

    Raises
    ------
    MissingMeshLab
        When pymeshlab or a system library of it is missing.
    """
    return CrossCheck((*_with_meshlab(mesh, deadline), *_with_pyvista(mesh)))


def _with_meshlab(mesh: QuadMesh, deadline: float) -> Iterator[Comparison]:
    with scratch_folder() as folder, MeshLabProcess(folder, deadline) as process:
        process.add(quad_layer(mesh))
        yield from _topology(mesh, process.apply("get_topological_measures"))
        yield from _shape(mesh, process.apply("get_topological_measures_from_quad_mesh"))
        areas, perimeters = material_areas(mesh), material_perimeters(mesh)
        selected = {number: _selection(process, f"material == {number}") for number in areas}
        yield from _materials(mesh, areas, perimeters, selected)
        yield from _sums(mesh, process.apply("get_geometric_measures"), selected, _selection(process, "fi >= 0"))


def _selection(process: MeshLabProcess, condition: str) -> dict[str, Any]:
    process.apply("compute_selection_by_condition_per_face", [("condselect", "RichString", condition)])
    return process.apply("get_area_and_perimeter_of_selection")


def _topology(mesh: QuadMesh, theirs: dict[str, Any]) -> Iterator[Comparison]:
    twins = twins_of(mesh.quads, mesh.n_points)
    border = int(np.count_nonzero(twins < 0))
    figures = {
        "points": (mesh.n_points, theirs["vertices_number"]),
        "quads": (mesh.n_quads, theirs["faces_number"] / 2),
        "border edges": (border, theirs["boundary_edges"]),
        # MeshLab counts the diagonal of each quad as an edge
        "edges": ((4 * mesh.n_quads + border) // 2, theirs["edges_number"] - mesh.n_quads),
        "components": (components(twins, 4)[1], theirs["connected_components_number"]),
        "edges with three or more quads": (0, theirs["non_two_manifold_edges"]),
        "points where two parts touch": (touching_points(mesh), theirs["non_two_manifold_vertices"]),
        "points of no quad": (int(np.count_nonzero(mesh.valence == 0)), theirs["unreferenced_vertices"]),
    }
    for name, (ours, other) in figures.items():
        yield Comparison(name, "MeshLab", ours, other, 1.0)


def _shape(mesh: QuadMesh, theirs: dict[str, Any]) -> Iterator[Comparison]:
    deviation = np.abs(90.0 - corner_angles(mesh.points, mesh.quads))
    ratio = edge_ratios(mesh)
    yield Comparison("polygons", "MeshLab", mesh.n_quads, theirs["polys_number"], 1.0)
    yield Comparison("triangles", "MeshLab", 0, theirs["triangles_number"], 1.0)
    angles = {"avg": deviation.mean(), "max": deviation.max(), "stddev": deviation.std()}
    for key, ours in angles.items():
        other = theirs[f"right_angle_discrepancy_{key}"]
        yield Comparison(f"deviation from the right angle, {key}", "MeshLab", float(ours), other, 90.0)
    for key, ours in (("avg", ratio.mean()), ("min", ratio.min())):
        yield Comparison(f"shortest by longest edge, {key}", "MeshLab", float(ours), theirs[f"quad_ratio_{key}"], 1.0)


def _materials(
    mesh: QuadMesh, areas: dict[int, float], perimeters: dict[int, float], theirs: dict[int, dict[str, Any]]
) -> Iterator[Comparison]:
    for number, area in areas.items():
        name = mesh.materials.name_of(number)
        yield Comparison(f"area of {name}", "MeshLab", area, theirs[number]["selected_surface_area"], area)
        length = perimeters[number]
        yield Comparison(f"perimeter of {name}", "MeshLab", length, theirs[number]["perimeter"], length)


def _sums(
    mesh: QuadMesh, geometry: dict[str, Any], selected: dict[int, dict[str, Any]], whole: dict[str, Any]
) -> Iterator[Comparison]:
    area = float(quad_areas(mesh.points, mesh.quads).sum())
    yield Comparison("area", "MeshLab", area, geometry["surface_area"], area)
    length = total_edge_length(mesh)
    yield Comparison("length of all edges", "MeshLab", length, geometry["total_edge_length"], length)
    border, interface = boundary_lengths(mesh)
    yield Comparison("length of the border", "MeshLab", border, whole["perimeter"], border)
    # each interface is on the perimeter of two materials, the border on that of one
    theirs = (sum(s["perimeter"] for s in selected.values()) - whole["perimeter"]) / 2
    yield Comparison("length of interfaces", "MeshLab", interface, theirs, interface + border)


def _with_pyvista(mesh: QuadMesh) -> Iterator[Comparison]:
    measured = datasets.to_grid(mesh).cell_quality(["scaled_jacobian", "min_angle", "max_angle", "area"]).cell_data
    angles = corner_angles(mesh.points, mesh.quads)
    figures = {
        "scaled Jacobian": (scaled_jacobian(mesh.points, mesh.quads), measured["scaled_jacobian"], 1.0),
        "least angle": (angles.min(axis=1), measured["min_angle"], 90.0),
        "largest angle": (angles.max(axis=1), measured["max_angle"], 90.0),
        "area of a quad": (quad_areas(mesh.points, mesh.quads), measured["area"], None),
    }
    for name, (ours, theirs, scale) in figures.items():
        at = int(np.argmax(np.abs(ours - theirs)))
        relative_to = float(ours[at]) if scale is None else scale
        yield Comparison(f"{name}, where it differs most", "PyVista", float(ours[at]), float(theirs[at]), relative_to)
        extreme = np.max if name == "largest angle" else np.min
        yield Comparison(f"{name}, extreme", "PyVista", float(extreme(ours)), float(extreme(theirs)), relative_to)


def edge_ratios(mesh: QuadMesh) -> NDArray[np.float64]:
    """Return shortest by longest edge of each quad, shape (n_quads,)."""
    corners = mesh.points[mesh.quads]
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    return np.asarray(lengths.min(axis=1) / lengths.max(axis=1))


def total_edge_length(mesh: QuadMesh) -> float:
    """Return the length of all edges, each counted once."""
    edges = np.stack([mesh.quads.ravel(), np.roll(mesh.quads, -1, axis=1).ravel()], axis=1)
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    return float(np.linalg.norm(mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]], axis=1).sum())


def chain_lengths(mesh: QuadMesh) -> NDArray[np.float64]:
    """Return the length of each chain, shape (n_chains,)."""
    ends = mesh.points[mesh.constraints]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    counts = np.diff(mesh.chain_offsets) - 1
    chain = np.repeat(np.arange(len(counts)), counts)
    return np.asarray(np.bincount(chain, weights=lengths, minlength=len(counts)), np.float64)


def boundary_lengths(mesh: QuadMesh) -> tuple[float, float]:
    """Return the length of the border (of the picture and of what was left out) and of the interfaces."""
    lengths = chain_lengths(mesh)
    border = (mesh.chain_regions == VOID).any(axis=1)
    return float(lengths[border].sum()), float(lengths[~border].sum())


def material_perimeters(mesh: QuadMesh) -> dict[int, float]:
    """Return the length of the boundary of each material that occurs, by number, ascending."""
    lengths = np.repeat(chain_lengths(mesh), 2)
    sides = mesh.chain_regions.ravel()
    material = mesh.region_label[sides[sides != VOID]]
    return {int(n): float(lengths[sides != VOID][material == n].sum()) for n in np.unique(mesh.quad_material)}


def touching_points(mesh: QuadMesh) -> int:
    """Return the number of points where quads meet that are not joined by edges there: two parts touch in a point."""
    twins = twins_of(mesh.quads, mesh.n_points)
    h = np.flatnonzero(twins >= 0)
    after = twins[h] // 4 * 4 + (twins[h] + 1) % 4  # corner beyond edge h, at the same point
    fan, _ = linked(h, after, 4 * mesh.n_quads)
    fans = np.unique(np.stack([mesh.quads.ravel(), fan], axis=1), axis=0)
    return int(np.count_nonzero(np.bincount(fans[:, 0]) > 1))
