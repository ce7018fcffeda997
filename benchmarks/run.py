"""Run the benchmarks and put their tables into docs/benchmarks.md.

    python benchmarks/run.py                      quality, wedges, speed, growth, cold: about 10 minutes
    python benchmarks/run.py speed cold           some parts; the others' tables stay as they are
    python benchmarks/run.py all                  all: pictures 15, noise 10, triangulators 2, waits 4 minutes more
    python benchmarks/run.py --out docs/benchmarks.md

Each part prints its section and, with --out, replaces what stands between its two marks in that page. The machine
should have nothing else to do.
"""

from __future__ import annotations

import argparse
import os
import platform
import tempfile
from collections.abc import Callable
from datetime import date
from importlib.metadata import version
from pathlib import Path
from time import perf_counter

import cold_start
import growth
import noise
import quality
import real_pictures
import speed
import triangulators
import waits
import wedges
from figure_tables import put_into, replaced
from imgquad_mesh.outputs.report import versions

PARTS: dict[str, Callable[[Path], str]] = {
    "quality": quality.section,
    "wedges": wedges.section,
    "speed": speed.section,
    "triangulators": triangulators.section,
    "waits": waits.section,
    "growth": growth.section,
    "cold": cold_start.section,
    "pictures": real_pictures.section,
    "noise": noise.section,
}
STANDARD = ("quality", "wedges", "speed", "growth", "cold")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = [*PARTS, "all"]
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(names))
    parser.add_argument("--out", type=Path, metavar="PAGE", help="page that holds the marks")
    given = parser.parse_args()
    if unknown := set(given.parts) - set(names):
        parser.error(f"there is no part {', '.join(sorted(unknown))}: give some of {', '.join(names)}")
    if given.out:
        page = given.out.read_text(encoding="utf-8")
        for part in PARTS:
            replaced(page, part, "")  # a mark that is missing is told now, not after minutes
    for part in PARTS if "all" in given.parts else given.parts or STANDARD:
        print(f"## {part}\n", flush=True)
        start = perf_counter()
        with tempfile.TemporaryDirectory(prefix="imgquad-benchmark-") as folder:
            text = PARTS[part](Path(folder))
        text = f"{text}\n{circumstances(part, perf_counter() - start)}\n"
        print(text, flush=True)
        if given.out:
            put_into(given.out, part, text)


def circumstances(part: str, seconds: float) -> str:
    """Say on what, when and by which command the figures came to be."""
    packages = {name: v for name, v in versions().items() if name != "platform"} | {"gmsh": version("gmsh")}
    return (
        f"*{date.today():%d %B %Y}, {processor()}, {os.cpu_count()} cores, {platform.system()}; "
        f"{', '.join(f'{name} {v}' for name, v in packages.items())}. "
        f"`python benchmarks/run.py {part} --out docs/benchmarks.md`: {seconds / 60:.1f} min.*"
    )


def processor() -> str:
    """Return the name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)}
    return names.get("model name") or platform.machine()


if __name__ == "__main__":
    main()
