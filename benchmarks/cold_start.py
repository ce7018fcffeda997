"""What do the first run on a machine and every later start cost? Prints the section "cold" of docs/benchmarks.md.

python benchmarks/cold_start.py
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

from figure_tables import Limit, limit_table
from processes import mesh_picture
from rocks import draw_rock

SIDE = 128
CACHED_RUNS = 3
EXTRA_SECONDS, CACHED_SECONDS = 25.0, 2.5


def section(folder: Path) -> str:
    """Mesh a small picture with an empty and with a filled cache of kernels; return the table."""
    picture = draw_rock(folder / "rock.png", SIDE, veins=4)
    cache = folder / "kernels"
    cold = spent(picture, cache)
    cached = min(spent(picture, cache) for _ in range(CACHED_RUNS))
    extra = cold.seconds - cached.seconds
    size = sum(file.stat().st_size for file in cache.rglob("*.nb?")) / 1e6
    where = f"{SIDE} x {SIDE} pixels, size 4"
    note = (
        "Seconds from the start of `imgquad-mesh run` to its end, mesh and report on disk: with an empty "
        f"`NUMBA_CACHE_DIR` ({cold.seconds:.1f} s, {cold.cpu:.1f} s of CPU), and the best of {CACHED_RUNS} with the "
        f"{size:.1f} MB of kernels that the first run has left ({cached.seconds:.2f} s, {cached.cpu:.2f} s of CPU).\n"
    )
    checks = [
        Limit("extra seconds of the first run", EXTRA_SECONDS, True).row(where, extra, "{:.1f}"),
        Limit("seconds of a later run", CACHED_SECONDS, True).row(where, cached.seconds, "{:.2f}"),
    ]
    return "\n".join([note, limit_table(checks)])


class Spent(NamedTuple):
    """What a command took, start of Python included."""

    seconds: float
    cpu: float


def spent(picture: Path, cache: Path) -> Spent:
    """Mesh the picture with the kernels in `cache`."""
    start, before = perf_counter(), os.times()
    mesh_picture(picture, picture.with_suffix(".vtu"), "--size", 4, NUMBA_CACHE_DIR=str(cache))
    after = os.times()
    cpu = sum(getattr(after, kind) - getattr(before, kind) for kind in ("children_user", "children_system"))
    return Spent(perf_counter() - start, cpu)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        print(section(Path(temporary)))
