"""How fast is the meshing stage, beside Gmsh's? Prints the section "speed" of docs/benchmarks.md.

    python benchmarks/speed.py
    python benchmarks/speed.py PICTURE.png EFFORT THREADS     one measurement of ours, as JSON

Ours is `imgquad_core.mesher.mesh_boundaries` alone on compiled kernels, Gmsh's its `generate` and `refine` alone.
"""

from __future__ import annotations

import json
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

from figure_tables import Limit, limit_table, table
from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.boundary.smoothing import smooth_boundaries
from imgquad_core.measures.quality import quality_report
from imgquad_core.mesher.efforts import EFFORTS
from imgquad_core.mesher.meshing import mesh_boundaries
from imgquad_core.options import MeshOptions
from imgquad_core.picture.segmentation import segment_picture
from imgquad_core.picture.selection import crop_image
from imgquad_core.reading.formats import read_picture
from processes import answer, mesh_picture
from quality import BEST_ROUTE, ROCKS, SIDE, SIZE
from rocks import SOURCE, draw_rock

ROUNDS = 3
THREADS = (1, 2)
#: how many times faster than Gmsh, by rock, effort and threads
LIMITS = {
    ("B1", "normal", 1): 5.0, ("B1", "best", 1): 2.0, ("B2", "normal", 1): 4.0,
    ("B1", "normal", 2): 8.0, ("B1", "best", 2): 3.0, ("B2", "normal", 2): 6.0,
}  # fmt: skip
GMSH = ("Gmsh " + BEST_ROUTE, 1)
TITLES = ("rock", "mesher", "threads", "s", "CPU s", "kquad/s", "times faster", "in CPU s", "in kquad/s",
          "irregular", "mean SJ", "1 % SJ")  # fmt: skip


def section(folder: Path) -> str:
    """Measure every mesher in turn, three rounds; return the tables of the best."""
    rows, checks = [], []
    for rock in ROCKS[:2]:  # B1 and B2, or the demo's
        picture = draw_rock(folder / "rock.png", SIDE, **rock.drawing)
        mesh_picture(picture, folder / "rock.vtu", "--size", SIZE)
        best = best_of_rounds(picture, folder / "rock.vtu")
        gmsh = best[GMSH]
        for (mesher, threads), found in best.items():
            faster = gmsh["seconds"] / found["seconds"]
            rows.append([rock.name, mesher, f"{threads}", *_figures(found, gmsh)])
            if limit := LIMITS.get((rock.name, mesher, threads)):
                where = f"{rock.name} {mesher}, threads: {threads}"
                checks.append(Limit("times faster than " + GMSH[0], limit, False).row(where, faster, "{:.1f}"))
    note = (
        f"{SOURCE}\n\nThe meshing stage alone, compiled kernels, size {SIZE:g}, best of {ROUNDS} rounds in which the "
        "meshers take turns, each run in a process of its own. *Times faster* is in seconds for the same boundaries, "
        "then in CPU seconds, which count all threads, then in quads a second, of which Gmsh makes more.\n"
    )
    return "\n".join([note, table(TITLES, rows), *([limit_table(checks)] if checks else [])])


def best_of_rounds(picture: Path, mesh: Path) -> dict[tuple[str, int], dict[str, Any]]:
    """Return the fastest run of each mesher, by its name and threads."""
    best: dict[tuple[str, int], dict[str, Any]] = {}
    for _ in range(ROUNDS):
        found = {(e, t): answer("speed.py", picture, e, t) for e in EFFORTS for t in THREADS}
        found[GMSH] = answer("gmsh_routes.py", mesh, BEST_ROUTE)
        for mesher, figures in found.items():
            best[mesher] = min(best.get(mesher, figures), figures, key=lambda f: f["seconds"])
    return best


def measure(picture: Path, effort: str, threads: int) -> dict[str, Any]:
    """Mesh the boundaries of a picture, once a corner of it has loaded the kernels."""
    options = MeshOptions(size=SIZE, effort=effort, threads=threads)
    labels = segment_picture(read_picture(picture)).image
    meshing, smoothing = options.meshing(labels.materials), options.smoothing(labels.materials)
    for part in (crop_image(labels, (0, 0, 200, 200)), labels):
        boundary = smooth_boundaries(extract_boundaries(part), smoothing)
        start, cpu = perf_counter(), process_time()
        mesh = mesh_boundaries(boundary, meshing, labels.materials)
        seconds, cpu = perf_counter() - start, process_time() - cpu
    return {"seconds": seconds, "cpu": cpu, "quality": asdict(quality_report(mesh))}


def _figures(found: dict[str, Any], gmsh: dict[str, Any]) -> list[str]:
    speed, theirs = (f["quality"]["n_quads"] / f["seconds"] / 1e3 for f in (found, gmsh))
    quality = found["quality"]
    return [
        f"{found['seconds']:.2f}",
        f"{found['cpu']:.2f}",
        f"{speed:.0f}",
        f"{gmsh['seconds'] / found['seconds']:.1f}",
        f"{gmsh['cpu'] / found['cpu']:.1f}",
        f"{speed / theirs:.1f}",
        f"{quality['irregular']:.2%}",
        f"{quality['mean_sj']:.4f}",
        f"{quality['sj_1_percent']:.3f}",
    ]


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(json.dumps(measure(Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]))))
    else:
        with tempfile.TemporaryDirectory() as temporary:
            print(section(Path(temporary)))
