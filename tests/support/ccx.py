"""Runs CalculiX on a deck and reads its tables of numbers."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed: no command ccx")


def solve(deck: Path, also: str = "") -> dict[str, NDArray[np.float64]]:
    """Solve `deck`, with the lines `also` in its step; return the last table of each title in the .dat file.

    Titles are cut before `(` or ` for set`: `stresses`, `temperatures`, `total force` ...
    """
    if also:
        deck.write_text(deck.read_text().replace("*END STEP", also + "\n*END STEP"))
    job = deck.with_suffix("")
    run = subprocess.run(
        ["ccx", "-i", job.name], cwd=deck.parent, capture_output=True, text=True, timeout=300,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    text = run.stdout + run.stderr
    assert run.returncode == 0, text[-3000:]
    assert "*ERROR" not in text, text[-3000:]
    return tables(job.with_suffix(".dat").read_text())


def tables(text: str) -> dict[str, NDArray[np.float64]]:
    """Tables of a .dat file: the title line, then rows of numbers."""
    found: dict[str, list[list[float]]] = {}
    title = ""
    for line in text.splitlines():
        if not line.strip():
            continue
        if re.match(r"\s*[a-z]", line):
            title = re.split(r"\(| for set", line)[0].strip()
            found[title] = []
        else:
            found[title].append([float(v) for v in line.split()[:]])
    return {name: np.array(table) for name, table in found.items() if table}
