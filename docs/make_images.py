"""Draw the pictures of the README and of docs/, some with Gmsh: python docs/make_images.py [FOLDER]."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from scipy.ndimage import gaussian_filter

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))

from gmsh_routes import gmsh_mesh
from imgquad_core import MeshOptions, QuadMesh, Run, run
from imgquad_core.measures.quality import inner_nodes, quality_report, scaled_jacobian
from imgquad_mesh.outputs.rock_picture import PALETTE, rock_labels

COLORS = np.array(PALETTE) / 255


def main(folder: Path) -> None:
    """Draw all pictures into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    part = rock_labels()[50:176, 60:249]
    made = run(part.astype(np.int32), MeshOptions(size=4.5, min_pixels=12, min_length=6, effort="best"))
    draw_chain(made, part, folder / "rock.png")
    draw_quality({"": made.mesh}, made.labels.shape, folder / "quality.png")
    both = {"imgquad-mesh": made.mesh, "Gmsh": gmsh_mesh(made.mesh, "subdivide-8").mesh}
    draw_quality(both, made.labels.shape, folder / "quality_gmsh.png")
    draw_sizes(folder / "sizes.png")


def draw_chain(made: Run, part: Any, path: Path) -> None:
    """Draw the picture, its smoothed boundaries and its mesh, side by side."""
    figure, panels = _panels(3, made.labels.shape)
    rows, cols = made.labels.shape
    panels[0].imshow(COLORS[part], extent=(0, cols, 0, rows), interpolation="nearest")
    lines = [made.boundary.points[made.boundary.chain(c)] for c in range(made.boundary.n_chains)]
    panels[1].imshow(COLORS[made.labels.labels], extent=(0, cols, 0, rows), interpolation="nearest", alpha=0.35)
    panels[1].add_collection(LineCollection(lines, colors="black", linewidths=1.0))
    _add_quads(panels[2], made.mesh, COLORS[made.mesh.quad_material])
    figure.savefig(path, facecolor="white")


def draw_quality(meshes: Mapping[str, QuadMesh], shape: tuple[int, int], path: Path) -> None:
    """Draw meshes coloured by scaled Jacobian, with their irregular inner nodes, side by side."""
    figure, panels = _panels(len(meshes), shape)
    for panel, (title, mesh) in zip(panels, meshes.items(), strict=True):
        quality = _add_quads(panel, mesh, None)
        quality.set_array(scaled_jacobian(mesh.points, mesh.quads))
        quality.set_clim(0.4, 1.0)
        irregular = inner_nodes(mesh) & (mesh.valence != 4)
        panel.plot(*mesh.points[irregular].T, "o", ms=4, mfc="red", mec="black", mew=0.5)
        if title:
            panel.add_collection(LineCollection(list(mesh.points[mesh.constraints]), colors="black", linewidths=1.2))
            panel.set_title(f"{title}: {_figures(mesh)}", fontsize=8)
    figure.colorbar(quality, ax=panels, label="scaled Jacobian", shrink=0.8)
    figure.savefig(path, facecolor="white")


def coast(n: int = 300) -> Any:
    """Make a rough coast, labels of n x n pixels."""
    rng = np.random.default_rng(2)
    octaves = ((40, 1.0), (12, 0.35), (4, 0.15), (1.5, 0.06))  # width in pixels, share
    heights = sum(gaussian_filter(rng.normal(size=(n, n)), width) * width * share for width, share in octaves)
    return (np.asarray(heights) > 0).astype(np.int32)


def draw_sizes(path: Path) -> None:
    """Draw a coast meshed as it is, and with tolerances, side by side."""
    tolerances = (0.0, 8.0, 16.0)
    figure, panels = _panels(len(tolerances), (300, 300))
    for panel, tolerance in zip(panels, tolerances, strict=True):
        mesh = run(coast(), MeshOptions(size=16.0, tolerance=tolerance)).mesh
        _add_quads(panel, mesh, COLORS[1 + mesh.quad_material])
        panel.set_title(f"size 16, tolerance {tolerance:g}: {mesh.n_quads} quads", fontsize=9)
    figure.savefig(path, facecolor="white")


def _figures(mesh: QuadMesh) -> str:
    found = quality_report(mesh)
    shape = f"scaled Jacobian at least {found.min_sj:.2f}, {found.mean_sj:.3f} on average"
    return f"{found.n_quads} quads, {found.irregular:.1%} of inner nodes irregular\n{shape}"


def _panels(n: int, shape: tuple[int, int]) -> tuple[Figure, list[Any]]:
    rows, cols = shape
    figure = Figure(figsize=(n * 4.2, 4.2 * rows / cols), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    panels = list(figure.subplots(1, n, squeeze=False)[0])
    for panel in panels:
        panel.set(xlim=(0, cols), ylim=(0, rows), aspect="equal", xticks=[], yticks=[])
    return figure, panels


def _add_quads(panel: Any, mesh: QuadMesh, colors: Any) -> PolyCollection:
    quads = PolyCollection(
        list(mesh.points[mesh.quads]), facecolors=colors, edgecolors="black", linewidths=0.35, cmap="viridis"
    )
    panel.add_collection(quads)
    return quads


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "images")
