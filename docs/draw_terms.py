"""Draw the small pictures of docs/develop/terms.md and docs/how_it_works.md: python docs/draw_terms.py [FOLDER].

All of it is made by the stages themselves from one small picture: grains around a vein, with a pore.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from imgquad_core import MeshOptions, Run, run
from imgquad_core.boundary.curves import curves_of
from imgquad_core.boundary.feature_size import local_feature_size
from imgquad_core.cleanup.batches import Portions
from imgquad_core.cleanup.faces import FaceQuads
from imgquad_core.cleanup.strips import pieces_at, strips_of
from imgquad_core.measures.quality import inner_nodes, scaled_jacobian
from imgquad_core.mesher.composing import compose
from imgquad_core.mesher.crossfield import CrossField, cross_field
from imgquad_core.mesher.cutting import CutMesh, FaceConflict, cut_at_constraints
from imgquad_core.mesher.frontal import frontal_points
from imgquad_core.mesher.outline import Outline, coarse_segments, outline
from imgquad_core.mesher.splitting import split_composed
from imgquad_core.mesher.triangulation import triangulate
from imgquad_core.model import BoundaryGraph, PointKind

ROWS, COLS, SIZE = 44, 60, 2.5
COLORS = np.array([[222, 203, 164], [178, 116, 88], [120, 140, 150], [245, 245, 240]]) / 255
RED, BLUE = "#d62728", "#1f77b4"


def picture() -> Any:
    """Return grains 0 to 2, cut by a vein 3, with some wrong pixels."""
    y, x = np.mgrid[:ROWS, :COLS] + 0.5
    seeds = np.array([[8, 9], [30, 6], [52, 12], [12, 34], [34, 30], [50, 38]])
    labels = np.argmin((x[..., None] - seeds[:, 0]) ** 2 + (y[..., None] - seeds[:, 1]) ** 2, axis=-1) % 3
    labels[np.abs(y - 21 - 4 * np.sin(x / 9)) < 1.6] = 3
    for row, column in ((5, 20), (6, 20), (33, 44), (38, 6), (12, 50)):
        labels[row, column] = (labels[row, column] + 1) % 3
    return labels.astype(np.int32)


def main(folder: Path) -> None:
    """Draw all pictures into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    made = run(picture(), MeshOptions(size=SIZE, min_pixels=6, min_length=4))
    for name, draw in TERMS.items():
        save(folder / f"{name}.png", lambda panel, draw=draw: draw(panel, made))


def save(path: Path, draw: Callable[[Any], None]) -> None:
    """Draw one picture."""
    figure = Figure(figsize=(2.6, 2.6 * ROWS / COLS), dpi=110)
    FigureCanvasAgg(figure)
    panel = figure.add_axes((0, 0, 1, 1))
    panel.set(xlim=(0, COLS), ylim=(0, ROWS), aspect="equal", xticks=[], yticks=[])
    draw(panel)
    figure.savefig(path, facecolor="white")


def zoom(panel: Any, x: float, y: float, width: float) -> None:
    """Show a part only."""
    height = width * ROWS / COLS
    panel.set(xlim=(x - width / 2, x + width / 2), ylim=(y - height / 2, y + height / 2))


def pixels(panel: Any, labels: Any, alpha: float = 1.0) -> None:
    """Draw the materials of pixels."""
    panel.imshow(COLORS[labels], extent=(0, COLS, 0, ROWS), interpolation="nearest", alpha=alpha)


def chains(panel: Any, graph: BoundaryGraph, color: str = "black", width: float = 1.0, only: Any = None) -> None:
    """Draw chains, all or some."""
    which = range(graph.n_chains) if only is None else np.flatnonzero(only)
    panel.add_collection(LineCollection([graph.points[graph.chain(c)] for c in which], colors=color, linewidths=width))


def dots(panel: Any, points: Any, color: str = RED, size: float = 4.0) -> None:
    """Draw points."""
    panel.plot(*np.asarray(points).reshape(-1, 2).T, "o", ms=size, mfc=color, mec="black", mew=0.4)


def quads(panel: Any, points: Any, polygons: Any, colors: Any = "white") -> PolyCollection:
    """Draw polygons."""
    made = PolyCollection(list(points[polygons]), facecolors=colors, edgecolors="black", linewidths=0.4)
    panel.add_collection(made)
    return made


def triangles(made: Run, stride: int) -> tuple[CutMesh, Outline, CrossField]:
    """Triangulate all faces at a stride with points in layers, as the mesher does."""
    graph = made.boundary
    flat = outline(graph, np.ones(len(graph.region_label), bool), stride)
    cut = _cut(flat, flat.points, 2.5 * (stride * SIZE) ** 2)
    field = cross_field(cut, np.full(len(cut.points), stride * SIZE), 0.3)
    return _cut(flat, np.vstack([flat.points, frontal_points(cut, field)])), flat, field


def _cut(flat: Outline, points: Any, max_area: float | None = None) -> CutMesh:
    cut = cut_at_constraints(triangulate(points, flat.segments, max_area), flat.constraints)
    if isinstance(cut, FaceConflict):
        raise SystemExit("the outlines of this picture contradict each other: draw another one")
    return cut


def composed(made: Run) -> FaceQuads:
    """Return the quads of all faces before any clean-up."""
    cut, flat, _ = triangles(made, 2)
    return split_composed(cut, compose(cut), len(flat.ids))


def longest(graph: BoundaryGraph) -> Any:
    """Flag the longest chain between two regions."""
    edges = np.where((graph.chain_regions >= 0).all(axis=1), np.diff(graph.chain_offsets), 0)
    return np.arange(graph.n_chains) == edges.argmax()


def draw_picture(panel: Any, made: Run) -> None:
    pixels(panel, made.picture.labels)


def draw_cluster(panel: Any, made: Run) -> None:
    pixels(panel, made.picture.labels, 0.35)
    gone = made.picture.labels != made.labels.labels
    shown = np.ma.masked_where(~gone, np.ones(gone.shape))
    panel.imshow(shown, extent=(0, COLS, 0, ROWS), interpolation="nearest", cmap="Reds", vmin=0, vmax=1.3)


def draw_length(panel: Any, made: Run) -> None:
    pixels(panel, made.labels.labels, 0.35)
    vein = [np.flatnonzero(made.labels.labels[:, j] == 3) for j in range(COLS)]
    way = [(j + 0.5, ROWS - rows.mean() - 0.5) for j, rows in enumerate(vein) if len(rows)]
    panel.plot(*np.array(way).T, color=RED, lw=2)


def draw_region(panel: Any, made: Run) -> None:
    pixels(panel, made.labels.labels, 0.35)
    region = np.unique(made.mesh.quad_region)[1]
    quads(panel, made.mesh.points, made.mesh.quads[made.mesh.quad_region == region], RED)
    chains(panel, made.boundary)


def draw_chain(panel: Any, made: Run) -> None:
    pixels(panel, made.labels.labels, 0.35)
    chains(panel, made.boundary)
    chains(panel, made.boundary, RED, 2.5, longest(made.boundary))


def draw_junction(panel: Any, made: Run) -> None:
    chains(panel, made.boundary)
    dots(panel, made.boundary.points[made.boundary.point_kind == PointKind.JUNCTION])


def draw_frame(panel: Any, made: Run) -> None:
    chains(panel, made.boundary, "0.6")
    on_frame = (made.boundary.chain_regions < 0).any(axis=1)
    chains(panel, made.boundary, RED, 5, on_frame)


def draw_rim(panel: Any, made: Run) -> None:
    region = np.unique(made.mesh.quad_region)[1]
    quads(panel, made.mesh.points, made.mesh.quads[made.mesh.quad_region == region])
    chains(panel, made.boundary, RED, 2.5, (made.boundary.chain_regions == region).any(axis=1))


def draw_sector(panel: Any, made: Run) -> None:
    mesh = made.mesh
    inner = np.flatnonzero((mesh.point_kind == PointKind.JUNCTION) & (mesh.points % [COLS, ROWS] > 3).all(axis=1))
    v = int(inner[0])
    here = mesh.quads[(mesh.quads == v).any(axis=1)]
    region = mesh.quad_region[(mesh.quads == v).any(axis=1)]
    quads(panel, mesh.points, mesh.quads)
    quads(panel, mesh.points, here, COLORS[region % 3 + (region % 3 > 1)])
    chains(panel, made.boundary, "black", 2)
    dots(panel, mesh.points[v])
    zoom(panel, *mesh.points[v], 16)


def draw_dense(panel: Any, made: Run) -> None:
    pixels(panel, made.labels.labels, 0.35)
    chains(panel, made.pixel_boundary, "0.3")
    dots(panel, made.pixel_boundary.points, BLUE, 3)
    chains(panel, made.boundary, RED, 1.5)
    zoom(panel, 30, 20, 16)


def draw_feature_size(panel: Any, made: Run) -> None:
    curves, _ = curves_of(made.pixel_boundary)
    size = local_feature_size(curves.raw, curves, 10.0, 4.0)
    shown = np.minimum(size, 10.0)
    panel.scatter(*curves.raw.T, c=shown, s=5, cmap="viridis")


def draw_coarse(panel: Any, made: Run) -> None:
    graph = made.boundary
    segments = coarse_segments(graph, np.ones(graph.n_chains, bool), 2)
    ends = graph.points[np.stack([segments.tail, segments.head], axis=1)]
    dots(panel, graph.points, "white", 2.5)
    panel.add_collection(LineCollection(list(ends), colors=RED, linewidths=1.6))
    dots(panel, ends, RED, 3.5)
    zoom(panel, 30, 22, 34)


def draw_stride(panel: Any, made: Run) -> None:
    graph = made.boundary
    chains(panel, graph, "0.6")
    for stride, color, width in ((2, BLUE, 2.6), (4, RED, 1.2)):
        fits = np.diff(graph.chain_offsets) % stride == 1
        segments = coarse_segments(graph, fits, stride)
        ends = graph.points[np.stack([segments.tail, segments.head], axis=1)]
        panel.add_collection(LineCollection(list(ends), colors=color, linewidths=width))
    zoom(panel, 30, 22, 40)


def draw_cross_field(panel: Any, made: Run) -> None:
    graph = made.boundary
    flat = outline(graph, np.ones(len(graph.region_label), bool), 2)
    cut = _cut(flat, flat.points, 2.5 * (2 * SIZE) ** 2)
    field = cross_field(cut, np.full(len(cut.points), 2 * SIZE), 0.3)
    angle = np.arctan2(field.cross[:, 1], field.cross[:, 0]) / 4
    for turn in (0, np.pi / 2):
        arm = 1.1 * np.stack([np.cos(angle + turn), np.sin(angle + turn)], axis=1)
        lines = list(np.stack([cut.points - arm, cut.points + arm], axis=1))
        panel.add_collection(LineCollection(lines, colors=BLUE, linewidths=0.8))
    chains(panel, graph)


def draw_triangles(panel: Any, made: Run) -> None:
    cut, _, _ = triangles(made, 2)
    quads(panel, cut.points, cut.triangles)
    chains(panel, made.boundary, RED, 1.3)


def draw_composed(panel: Any, made: Run) -> None:
    mesh = composed(made)
    quads(panel, mesh.points, mesh.quads)
    chains(panel, made.boundary, RED, 1.3)


def draw_irregular(panel: Any, made: Run) -> None:
    mesh = made.mesh
    quads(panel, mesh.points, mesh.quads)
    dots(panel, mesh.points[inner_nodes(mesh) & (mesh.valence != 4)])


def around(made: Run) -> tuple[int, Any]:
    """Return an irregular node inside, and the quads at it."""
    mesh = made.mesh
    odd = np.flatnonzero(inner_nodes(mesh) & (mesh.valence != 4))
    v = int(odd[np.hypot(*(mesh.points[odd] - [50, 9]).T).argmin()])
    return v, (mesh.quads == v).any(axis=1)


def draw_ring(panel: Any, made: Run) -> None:
    mesh, (v, ring) = made.mesh, around(made)
    quads(panel, mesh.points, mesh.quads)
    quads(panel, mesh.points, mesh.quads[ring], "#f4b6b6")
    chains(panel, made.boundary, "black", 2)
    dots(panel, mesh.points[v])
    zoom(panel, *mesh.points[v], 24)


def draw_cavity(panel: Any, made: Run) -> None:
    mesh, (v, ring) = made.mesh, around(made)
    same = mesh.quad_region == mesh.quad_region[ring][0]
    cavity = np.isin(mesh.quads, mesh.quads[ring]).any(axis=1) & same
    quads(panel, mesh.points, mesh.quads)
    quads(panel, mesh.points, mesh.quads[cavity], "#f4b6b6")
    chains(panel, made.boundary, "black", 2)
    dots(panel, mesh.points[v])
    zoom(panel, *mesh.points[v], 24)


def draw_seam(panel: Any, made: Run) -> None:
    mesh = made.mesh
    strip = strips_of(mesh.points, mesh.quads, Portions(strip=7))
    seam = pieces_at(strip, mesh.quads, mesh.n_points)[1]
    quads(panel, mesh.points, mesh.quads, COLORS[strip % 2])
    dots(panel, mesh.points[seam], RED, 2.5)


def draw_quality(panel: Any, made: Run) -> None:
    mesh = made.mesh
    drawn = quads(panel, mesh.points, mesh.quads, None)
    drawn.set_array(scaled_jacobian(mesh.points, mesh.quads))
    drawn.set_clim(0.4, 1.0)


def draw_mesh(panel: Any, made: Run) -> None:
    quads(panel, made.mesh.points, made.mesh.quads, COLORS[made.mesh.quad_material])


def draw_labels(panel: Any, made: Run) -> None:
    pixels(panel, made.labels.labels)


def draw_pixel_boundary(panel: Any, made: Run) -> None:
    pixels(panel, made.labels.labels, 0.35)
    chains(panel, made.pixel_boundary)


def draw_smooth(panel: Any, made: Run) -> None:
    pixels(panel, made.labels.labels, 0.35)
    chains(panel, made.boundary)
    dots(panel, made.boundary.points, BLUE, 2)


TERMS = {
    "picture": draw_picture,
    "cluster": draw_cluster,
    "characteristic_length": draw_length,
    "labels": draw_labels,
    "pixel_boundary": draw_pixel_boundary,
    "region": draw_region,
    "chain": draw_chain,
    "junction": draw_junction,
    "frame": draw_frame,
    "rim": draw_rim,
    "sector": draw_sector,
    "dense_points": draw_dense,
    "feature_size": draw_feature_size,
    "smooth": draw_smooth,
    "coarse_segment": draw_coarse,
    "stride": draw_stride,
    "cross_field": draw_cross_field,
    "triangles": draw_triangles,
    "composed": draw_composed,
    "irregular": draw_irregular,
    "ring": draw_ring,
    "cavity": draw_cavity,
    "seam": draw_seam,
    "quality": draw_quality,
    "mesh": draw_mesh,
}

if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "images" / "terms")
