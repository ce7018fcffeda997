"""Are quads at the tips of wedges as good as the angle allows? Prints the section "wedges" of docs/benchmarks.md.

python benchmarks/wedges.py [COUNT]     wedges of each angle, 60 unless told

The tip is the part within 8 px (or three edges) of it.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from figure_tables import table
from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.boundary.smoothing import smooth_boundaries
from imgquad_core.measures.quality import scaled_jacobian
from imgquad_core.mesher.meshing import mesh_boundaries
from imgquad_core.options import MeshOptions
from support.labels import label_image, wedge

ANGLES = (15, 20, 30, 40, 45, 50, 60, 70, 80, 90)  # degrees
SIZES = (2.0, 3.0, 4.0)  # in turn
SIDE, RADIUS = 110, 45.0  # of the picture, and of the sector that the wedge is, in pixels
BEST = 0.86  # beside irregular nodes, whose angles of 120 degrees allow .866
COUNT = 60
TITLES = (
    "angle",
    "bound",
    "least",
    "10 %",
    "median",
    "below the bound",
    "by over 3 %",
    "tip off by px, median",
    "largest",
)


def at_tip(angle: float, size: float, rng: np.random.Generator) -> tuple[float, float]:
    """Return the worst scaled Jacobian at the tip of a random wedge, and how far the boundary passes from the tip."""
    turn = rng.uniform(0.0, 360.0)
    middle = np.radians(turn + 0.5 * angle)
    tip = 0.5 * SIDE + rng.uniform(-0.5, 0.5, 2) - 0.5 * RADIUS * np.array([np.cos(middle), np.sin(middle)])
    image, options = label_image(wedge(angle, turn, tip, RADIUS, SIDE)), MeshOptions(size=size)
    graph = smooth_boundaries(extract_boundaries(image), options.smoothing(image.materials))
    mesh = mesh_boundaries(graph, options.meshing(image.materials), image.materials)
    near = np.hypot(*(mesh.points[mesh.quads].mean(axis=1) - tip).T) < max(8.0, 3.0 * size)
    worst = scaled_jacobian(mesh.points, mesh.quads[near]).min()
    return float(worst), float(np.hypot(*(graph.points - tip).T).min())


def section(_: Path, count: int = COUNT) -> str:
    """Mesh `count` wedges of each angle; return the table."""
    rng, rows = np.random.default_rng(5), []
    for angle in ANGLES:
        found = np.array([at_tip(angle, SIZES[i % len(SIZES)], rng) for i in range(count)])
        worst, off = found.T
        bound = min(np.sin(np.radians(angle)), BEST)
        figures = (bound, worst.min(), np.quantile(worst, 0.1), np.median(worst))
        below = [f"{float((worst < share * bound).mean()):.0%}" for share in (0.995, 0.97)]
        rows.append([f"{angle}", *(f"{f:.3f}" for f in figures), *below, f"{np.median(off):.2f}", f"{off.max():.2f}"])
    return f"{count} wedges of each angle, at random places and turns, sizes 2, 3 and 4.\n\n{table(TITLES, rows)}\n"


if __name__ == "__main__":
    print(section(Path(), int(sys.argv[1]) if len(sys.argv) > 1 else COUNT))
