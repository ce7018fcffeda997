"""How good and how fast is meshing by each triangulator? Prints the section "triangulators" of docs/benchmarks.md.

    python benchmarks/triangulators.py

Both fill the same boundaries, in turn, in one process with warm kernels: `imgquad_core.mesher.mesh_boundaries` alone.
It needs both: `pip install ".[dev]"`.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import process_time
from typing import Any

from figure_tables import Limit, limit_table, table
from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.boundary.smoothing import smooth_boundaries
from imgquad_core.measures.quality import quality_report
from imgquad_core.mesher import mesh_boundaries
from imgquad_core.model import BoundaryGraph, QuadMesh
from imgquad_core.options import MeshOptions
from imgquad_core.picture.segmentation import segment_picture
from imgquad_core.reading.formats import read_picture
from quality import B1, B2, SIDE, SIZE
from rocks import SOURCE, draw_rock

ROUNDS = 3
TRIANGULATORS = ("triangle", "cdt")
SLOWER = Limit("CPU s of cdt over those of triangle", 1.15, at_most=True)
TITLES = ("rock", "triangulator", "CPU s", "quads", "min SJ", "1 % SJ", "mean SJ", "in [45,135]", "irregular")


def section(folder: Path) -> str:
    """Mesh B1 and B2 by both, three rounds; return the tables of the best times."""
    rows, checks = [], []
    for rock in (B1, B2):
        boundaries = boundaries_of(draw_rock(folder / "rock.png", SIDE, **rock.drawing))
        found = in_turn(boundaries)
        rows += [[rock.name, by, f"{seconds:.2f}", *figures(mesh)] for by, (seconds, mesh) in found.items()]
        checks.append(SLOWER.row(rock.name, found["cdt"][0] / found["triangle"][0], "{:.2f}"))
    return "\n".join([SOURCE, "", table(TITLES, rows, words=2), limit_table(checks)])


def boundaries_of(picture: Path) -> BoundaryGraph:
    """Return the smoothed boundaries of a picture."""
    image = segment_picture(read_picture(picture)).image
    return smooth_boundaries(extract_boundaries(image), MeshOptions(size=SIZE).smoothing(image.materials))


def in_turn(boundaries: BoundaryGraph) -> dict[str, tuple[float, QuadMesh]]:
    """Return the least CPU seconds by triangulator, and the mesh."""
    found: dict[str, Any] = {}
    for _ in range(ROUNDS + 1):  # the first one warms up
        before, found = found, {by: timed(boundaries, by) for by in TRIANGULATORS}
        found = {by: min(found[by], before.get(by, found[by]), key=lambda one: one[0]) for by in TRIANGULATORS}
    return found


def timed(boundaries: BoundaryGraph, by: str) -> tuple[float, QuadMesh]:
    """Mesh once; return CPU seconds and mesh."""
    options = MeshOptions(size=SIZE, triangulator=by).meshing(None)
    start = process_time()
    mesh = mesh_boundaries(boundaries, options)
    return process_time() - start, mesh


def figures(mesh: QuadMesh) -> list[str]:
    """Return the figures of quality as they are printed."""
    report = quality_report(mesh)
    return [
        f"{report.n_quads:,}",
        f"{report.min_sj:.3f}",
        f"{report.sj_1_percent:.3f}",
        f"{report.mean_sj:.4f}",
        f"{report.good_angles:.3%}",
        f"{report.irregular:.2%}",
    ]


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as made:
        print(section(Path(made)))
