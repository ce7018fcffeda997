"""How good and how fast is meshing by each triangulator? Prints the section "triangulators" of docs/benchmarks.md.

    python benchmarks/triangulators.py

Both fill the same boundaries, in turn, in one process with warm kernels: `imgquad_core.mesher.mesh_boundaries` alone.
Then all real pictures are meshed by both, and judged by a program that has no code of this project.
It needs both: `pip install ".[dev]"`.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import process_time
from typing import Any

from figure_tables import NONE, Limit, limit_table, table
from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.boundary.smoothing import smooth_boundaries
from imgquad_core.measures.quality import quality_report
from imgquad_core.mesher import mesh_boundaries
from imgquad_core.model import BoundaryGraph, QuadMesh
from imgquad_core.options import MeshOptions
from imgquad_core.picture.segmentation import segment_picture
from imgquad_core.reading.formats import read_picture
from pyvista_pictures import PICTURES
from quality import B1, B2, SIDE, SIZE
from real_pictures import FOLDER, Judged, judged
from rocks import SOURCE, draw_rock

ROUNDS = 3
TRIANGULATORS = ("triangle", "cdt")
SLOWER = Limit("CPU s of cdt over those of triangle", 1.15, at_most=True)
TITLES = ("picture", "triangulator", "CPU s", "quads", "min SJ", "1 % SJ", "mean SJ", "in [45,135]", "irregular")
#: real pictures that are timed: large grains, thin layers, specks
TIMED = ("rock_sandstone_labels_2a", "geology_hamersley_west", "rock_thinsection5_labels")
JUDGED_SIZE = 5.0
JUDGED_TITLES = ("real picture", *(f"{by}: {what}" for by in TRIANGULATORS for what in ("quads", "min SJ", "mean SJ")))
INVALID = Limit("pictures whose mesh is not valid", 0, at_most=True)


def section(folder: Path) -> str:
    """Mesh B1, B2 and real pictures by both; return the tables."""
    return "\n".join([SOURCE, "", times(folder), judgements(folder)])


def times(folder: Path) -> str:
    """Fill the boundaries of some pictures by both, three rounds; return the tables of the best times."""
    pictures = {rock.name: draw_rock(folder / f"{rock.name}.png", SIDE, **rock.drawing) for rock in (B1, B2)}
    pictures |= {name: path for name in TIMED if (path := FOLDER / f"{name}.png").exists()}
    rows, checks = [], []
    for name, path in pictures.items():
        found = in_turn(boundaries_of(path))
        rows += [[name, by, f"{seconds:.2f}", *figures(mesh)] for by, (seconds, mesh) in found.items()]
        checks.append(SLOWER.row(name, found["cdt"][0] / found["triangle"][0], "{:.2f}"))
    return "\n".join([table(TITLES, rows, words=2), limit_table(checks)])


def judgements(folder: Path) -> str:
    """Mesh all real pictures by both and have them judged; return the table, and how many are not valid."""
    if not FOLDER.is_dir():
        return f"**No real pictures: there is no folder {FOLDER.name}. Nothing is judged here.**\n"
    rows, invalid = [], dict.fromkeys(TRIANGULATORS, 0)
    for path in sorted(p for p in FOLDER.iterdir() if p.suffix.lower() in PICTURES):
        rows.append([path.stem])
        for by in TRIANGULATORS:
            found = judged(path, Judged(path.stem, JUDGED_SIZE, 0.0, by), folder)
            invalid[by] += not found.get("valid")
            rows[-1] += judgement(found)
    checks = [INVALID.row(f"all {len(rows)}, {by}", number, "{:.0f}") for by, number in invalid.items()]
    return "\n".join([f"Judged at size {JUDGED_SIZE:g}:\n", table(JUDGED_TITLES, rows), limit_table(checks)])


def judgement(found: dict[str, Any]) -> list[str]:
    """Return the figures of a judged mesh as they are printed."""
    if "failed" in found:
        return [found["failed"], NONE, NONE]
    mark = "" if found["valid"] else " **invalid**"
    return [f"{found['quads']:,}{mark}", f"{found['min_sj']:.3f}", f"{found['mean_sj']:.4f}"]


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
