"""What do the first run on a machine and every later start cost? Prints the section "cold" of docs/benchmarks.md.

python benchmarks/cold_start.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import perf_counter

from processes import mesh_picture
from rocks import draw_rock
from tables import LIMIT_TITLES, Limit, table

SIDE = 128
CACHED_RUNS = 3
EXTRA_SECONDS, CACHED_SECONDS = 25.0, 2.5


def section(folder: Path) -> str:
    """Mesh a small picture with an empty and with a filled cache of kernels; return the table."""
    picture = draw_rock(folder / "rock.png", SIDE, veins=4)
    cache = folder / "kernels"
    cold = seconds(picture, cache)
    cached = min(seconds(picture, cache) for _ in range(CACHED_RUNS))
    size = sum(file.stat().st_size for file in cache.rglob("*.nb?")) / 1e6
    where = f"{SIDE} x {SIDE} pixels, size 4"
    note = (
        "Seconds from the start of `imgquad-mesh run` to its end, mesh and report on disk: with an empty "
        f"`NUMBA_CACHE_DIR` ({cold:.1f} s), and the best of {CACHED_RUNS} with the {size:.1f} MB of kernels that the "
        "first run has left there.\n"
    )
    checks = [
        Limit("extra seconds of the first run", EXTRA_SECONDS, True).row(where, cold - cached, "{:.1f}"),
        Limit("seconds of a later run", CACHED_SECONDS, True).row(where, cached, "{:.2f}"),
    ]
    return "\n".join([note, table(LIMIT_TITLES, checks)])


def seconds(picture: Path, cache: Path) -> float:
    """Return how long the command takes, start of Python included."""
    start = perf_counter()
    mesh_picture(picture, picture.with_suffix(".vtu"), "--size", 4, NUMBA_CACHE_DIR=str(cache))
    return perf_counter() - start


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        print(section(Path(temporary)))
