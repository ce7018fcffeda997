"""How do time and memory grow with the picture? Prints the section "growth" of docs/benchmarks.md.

python benchmarks/growth.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from figure_tables import Limit, limit_table, table
from processes import mesh_picture
from rocks import draw_rock

SIDES = (256, 512, 1024, 2048, 4096)
LARGEST = f"{SIDES[-1]}²"
LARGE = 2  #: the first of the sides where what every run costs no longer counts
SIZE = 4.0
STAGES = ("read", "segment", "denoise", "boundary", "smooth", "mesh", "write")
STEEPEST, BYTES_A_QUAD, MEMORY_MB = 1.1, 1500.0, 8000.0
TITLES = ("picture", "quads", *(f"{stage} s" for stage in STAGES), "all s", "µs/quad", "peak MB", "kB/quad")


def section(folder: Path) -> str:
    """Mesh rocks of growing size; return the tables."""
    least = _report(folder, 16)["peak_memory_mb"]
    reports = [_report(folder, side) for side in SIDES]
    quads = np.array([r["quality"]["n_quads"] for r in reports], float)
    memory = np.array([r["peak_memory_mb"] for r in reports])
    stages = {stage: np.array([r["seconds"][stage] for r in reports]) for stage in STAGES}
    together = sum(stages.values())
    bytes_a_quad = (memory - least) * 1e6 / quads
    rows = []
    for k, (side, n) in enumerate(zip(SIDES, quads, strict=True)):
        times = [*(t[k] for t in stages.values()), together[k]]
        rest = f"{together[k] / n * 1e6:.1f}", f"{memory[k]:.0f}", f"{bytes_a_quad[k] / 1e3:.2f}"
        rows.append([f"{side}²", f"{n:,.0f}", *(f"{t:.2f}" for t in times), *rest])
    checks = [
        Limit("bytes a quad", BYTES_A_QUAD, True).row(LARGEST, bytes_a_quad[-1], "{:.0f}"),
        Limit("peak memory, MB", MEMORY_MB, True).row(LARGEST, memory[-1], "{:.0f}"),
    ]
    for what, seconds in (("all seconds", together), ("meshing seconds", stages["mesh"])):
        for first in (0, LARGE):
            steep, where = exponent(quads[first:], seconds[first:]), f"{SIDES[first]}² to {LARGEST}"
            checks.append(Limit(f"exponent of {what}", STEEPEST, True).row(where, steep, "{:.2f}"))
    note = (
        f"Size {SIZE:g}, one thread. Memory a quad is without the {least:.0f} MB of the same command on a picture of "
        "16 x 16 pixels: Python, its packages and the kernels. The exponent is the slope of log seconds over log quads "
        "by least squares; small pictures hide in it what every run costs, hence the second range.\n"
    )
    return "\n".join([note, table(TITLES, rows), limit_table(checks)])


def exponent(quads: np.ndarray, seconds: np.ndarray) -> float:
    """Return the slope of log `seconds` over log `quads`."""
    return float(np.polyfit(np.log(quads), np.log(seconds), 1)[0])


def _report(folder: Path, side: int) -> dict[str, Any]:
    picture = draw_rock(folder / "rock.png", side)
    return mesh_picture(picture, folder / "rock.vtu", "--size", SIZE)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        print(section(Path(temporary)))
