"""What does a user wait for? Prints the section "waits" of docs/benchmarks.md.

python benchmarks/waits.py
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from figure_tables import Limit, limit_table, table
from processes import mesh_picture, python
from rocks import draw_rock, uniform

ROUNDS = 5
#: all cores, and packages that are compiled: other benchmarks, and who tests, ask for neither
AS_USERS = {"OMP_NUM_THREADS": "", "PYTHONDONTWRITEBYTECODE": ""}
SIDE, SIZE = 1024, 2  #: of B1
DISKS, DISKS_SIDE = 1200, 2048  #: in a matrix that surrounds all of them: one face
SMALL = 117
#: what is put behind the script of a run: a selection and a smoothing
MESHLAB = """ <filter name="Conditional Face Selection">
  <Param name="condSelect" type="RichString" value="fq == 1"/>
 </filter>
 <filter name="Laplacian Smooth">
  <Param name="stepSmoothNum" type="RichInt" value="1"/>
  <Param name="Boundary" type="RichBool" value="false"/>
  <Param name="Selected" type="RichBool" value="true"/>
 </filter>
</FilterScript>
"""


class Spent(NamedTuple):
    """Medians of a command: seconds, seconds of CPU, and seconds of the meshing stage where it reports them."""

    seconds: float
    cpu: float
    mesh: float = 0.0


def section(folder: Path) -> str:
    """Time whole commands, one thread beside all, and MeshLab's filters in a script; return the tables."""
    pictures = {
        f"small, {SMALL} x {SMALL}": (draw_rock(folder / "small.png", SMALL), 4),
        "B1": (draw_rock(folder / "b1.png", SIDE), SIZE),
        f"matrix with {DISKS} disks, {DISKS_SIDE} x {DISKS_SIDE}": (_disks(folder / "disks.png"), 4),
    }
    found = {name: [_run(*asked, threads) for threads in (1, 0)] for name, asked in pictures.items()}
    rows = [[name, *(f"{value:.2f}" for spent in both for value in spent)] for name, both in found.items()]
    figures = ("s", "CPU s", "s of meshing")
    titles = ["picture", *(f"{what}, {who}" for who in ("one thread", "all") for what in figures)]
    small = next(iter(found.values()))[1]
    beyond = _script(folder, pictures["B1"][0])
    checks = [
        Limit("seconds", 0.7, True).row("small", small.seconds, "{:.2f}"),
        Limit("seconds of CPU", 0.7, True).row("small", small.cpu, "{:.2f}"),
        *(
            Limit("times faster with all cores, meshing", 1.7, False).row(name, one.mesh / both.mesh, "{:.2f}")
            for name, (one, both) in list(found.items())[1:]
        ),
        Limit("seconds of two MeshLab filters in a script", 1.2, True).row("B1", beyond, "{:.2f}"),
    ]
    note = f"Medians of {ROUNDS}, from the start of the command to its end, `.vtu` and report on disk.\n"
    return "\n".join([note, table(titles, rows), limit_table(checks)])


def _run(picture: Path, size: float, threads: int) -> Spent:
    spent = []
    for _ in range(ROUNDS):
        start, before = perf_counter(), os.times()
        report = mesh_picture(picture, picture.with_suffix(".vtu"), "--size", size, "--threads", threads, **AS_USERS)
        spent.append(_since(start, before, report["seconds"]["mesh"]))
    return Spent(*map(median, zip(*spent, strict=True)))


def _since(start: float, before: Any, mesh: float = 0.0) -> Spent:
    after = os.times()
    cpu = sum(getattr(after, kind) - getattr(before, kind) for kind in ("children_user", "children_system"))
    return Spent(perf_counter() - start, cpu, mesh)


def _script(folder: Path, picture: Path) -> float:
    """Return how many seconds a script takes longer for two filters of MeshLab."""
    plain, mixed = folder / "plain.mlx", folder / "mixed.mlx"
    mesh_picture(picture, folder / "b1.vtu", "--size", SIZE, "--save-script", plain)
    mixed.write_text(plain.read_text(encoding="utf-8").replace("</FilterScript>\n", MESHLAB), encoding="utf-8")
    seconds: dict[Path, list[float]] = {plain: [], mixed: []}
    for _ in range(ROUNDS):
        for script, times in seconds.items():
            start = perf_counter()
            command = ("-m", "imgquad_mesh", "script", script, "--input", picture, "--output", folder / "out.vtu")
            python(*command, "--quiet")
            times.append(perf_counter() - start)
    return median(seconds[mixed]) - median(seconds[plain])


def _disks(path: Path) -> Path:
    """Draw disks on a jittered lattice, which do not touch."""
    n = int(np.ceil(np.sqrt(DISKS)))
    step = DISKS_SIDE / n
    labels = np.zeros((DISKS_SIDE, DISKS_SIDE), np.uint8)
    places, sizes = uniform(1, 2 * DISKS).reshape(-1, 2), uniform(2, DISKS)
    y, x = np.mgrid[:DISKS_SIDE, :DISKS_SIDE] + 0.5
    for k, ((a, b), c) in enumerate(zip(places, sizes, strict=True)):
        cx, cy = (k % n + 0.5 + 0.2 * (a - 0.5)) * step, (k // n + 0.5 + 0.2 * (b - 0.5)) * step
        part = np.s_[max(0, int(cy - step)) : int(cy + step), max(0, int(cx - step)) : int(cx + step)]
        labels[part][np.hypot(x[part] - cx, y[part] - cy) < (0.2 + 0.15 * c) * step] = 1
    Image.fromarray(labels).save(path)
    return path


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        print(section(Path(temporary)))
