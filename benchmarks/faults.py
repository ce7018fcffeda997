"""A campaign against the promises of docs/promises.md: kills, full disks, damaged caches, odd input. Prints a table.

python benchmarks/faults.py                            every section, as often as stands in SECTIONS
python benchmarks/faults.py kills meshes --seed 7      some of them, with another seed
python benchmarks/faults.py --share 0.02               a slice: 2 % of the trials of each (one at least)

A trial fails by an `AssertionError` or any other exception; the first failures are printed with what repeats them.
"""

from __future__ import annotations

import argparse
import hashlib
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from faults_of_meshes import cells, elements, meshes, threads
from faults_of_runs import Generator, caches, full_disks, kills, late_kills, mounts, options, readers

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "tests")]  # for `support`


class Section(NamedTuple):
    """One kind of trial, and how often the whole campaign tries it."""

    trial: Callable[[Generator, Path], None]
    times: int


SECTIONS = {
    f.__name__.replace("_", "-"): Section(f, times)
    for f, times in (
        (kills, 20),
        (late_kills, 20),
        (full_disks, 50),
        (caches, 60),
        (mounts, 40),
        (meshes, 4000),  # two pictures each: as it is and turned
        (elements, 1500),
        (cells, 40),
        (threads, 10),
        (options, 400),
        (readers, 3000),
    )
}


class Outcome(NamedTuple):
    """What one section gave."""

    tried: int
    failed: list[str]
    seconds: float


def campaign(name: str, seed: int, times: int) -> Outcome:
    """Try `times` trials of a section; each has its own seed, so that one can be repeated alone."""
    failed, start = [], time.perf_counter()
    for k in range(times):
        digest = hashlib.sha256(f"{name} {seed} {k}".encode()).digest()
        rng = np.random.default_rng(list(digest))
        with tempfile.TemporaryDirectory(prefix="imgquad-faults-") as folder:
            try:
                SECTIONS[name].trial(rng, Path(folder))
            except Exception as error:  # whatever it is, it is a fault
                line = traceback.extract_tb(error.__traceback__)[-1]
                place = f"{Path(line.filename).name}:{line.lineno}"
                failed.append(f"{name}, seed {seed}, trial {k}: {place}: {type(error).__name__}: {str(error)[:300]}")
    return Outcome(times, failed, time.perf_counter() - start)


def table(outcomes: dict[str, Outcome]) -> str:
    """Return the table of the docs."""
    lines = ["| section | what | tried | failed |", "|---|---|---:|---:|"]
    for name, found in outcomes.items():
        what = " ".join((SECTIONS[name].trial.__doc__ or "").split()).rstrip(".")
        lines.append(f"| {name} | {what} | {found.tried} | {len(found.failed)} |")
    return "\n".join(lines)


def main() -> int:
    """Run what is asked for; return 1 if a trial failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sections", nargs="*", choices=[*SECTIONS, []], help="default: all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--share", type=float, default=1.0, help="of the trials of each section (default: 1)")
    args = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # started in the background, `kills` would ignore it
    outcomes = {}
    for name in args.sections or SECTIONS:
        outcomes[name] = campaign(name, args.seed, max(1, round(args.share * SECTIONS[name].times)))
        print(f"{name}: {outcomes[name].seconds:.0f} s", *outcomes[name].failed[:5], sep="\n", file=sys.stderr)
    print(table(outcomes))
    return int(any(found.failed for found in outcomes.values()))


if __name__ == "__main__":
    sys.exit(main())
