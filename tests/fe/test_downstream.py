"""Other people's programs solve two layers from our files, as `benchmarks/downstream.py` runs them all.

Here run CalculiX and what this Python can import, or the Python that IMGQUAD_SOLVERS names (`.ci/run` makes one with
MFEM, NGSolve and FElupe). The others are skipped, visibly.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from downstream import EXACT, RUNS, TOOLS, Run, told, write

PYTHONS = (sys.executable, os.environ.get("IMGQUAD_SOLVERS", sys.executable))
MODULES = {"scikit-fem": "skfem", "KratosMultiphysics": "KratosMultiphysics", "openseespy": "openseespy.opensees"}


@cache
def python_with(package: str) -> str | None:
    """Return the first Python that imports a package."""
    for python in PYTHONS:
        if not subprocess.run(
            [python, "-c", f"import {MODULES.get(package, package)}"], capture_output=True
        ).returncode:
            return python
    return None


def command(run: Run) -> list[str]:
    script = str(TOOLS / run.script)
    if run.pip:
        python = python_with(run.pip[0])
        if python is None:
            pytest.skip(f"no Python here imports {run.pip[0]}: pip install {run.pip[0]}, or set IMGQUAD_SOLVERS")
        return [python, script, run.file]
    if run.program == "CalculiX" and shutil.which("ccx"):
        return ["bash", script, run.file]
    pytest.skip(f"{run.program} is run by benchmarks/downstream.py only")


@pytest.mark.parametrize("run", RUNS, ids=lambda run: f"{run.program}-{run.file}")
def test_layers_are_solved_from_our_file(run: Run, tmp_path: Path) -> None:
    line = command(run)
    write(tmp_path, run)
    said = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True)
    found = told(said.stdout)
    if run.refused:  # what the docs say that a program does not take; never a wrong number
        assert said.returncode
        assert not found.keys() & EXACT.keys()
        return
    assert said.returncode == 0, said.stderr
    ((name, value),) = [(name, float(found[name])) for name in EXACT.keys() & found.keys()]
    assert abs(value / EXACT[name] - 1) < 1e-6
    assert (found["materials"], found["borders"]) == (run.materials, run.borders)


def test_a_plain_grid_counts_materials_from_one(tmp_path: Path) -> None:
    """MFEM's attributes are: a coefficient of attribute 0 would be left out without a word."""
    python = python_with("mfem")
    if python is None:
        pytest.skip("no Python here imports mfem")
    write(tmp_path, Run("MFEM", "", "a.vtu", ("--plain",)))
    show = "import mfem.ser as m; print(*sorted(m.Mesh('a.vtu', 1, 1).GetAttributeArray()))"
    said = subprocess.run([python, "-c", show], cwd=tmp_path, capture_output=True, text=True, check=True)
    numbers = np.array(said.stdout.splitlines()[-1].split(), int)
    assert set(numbers) == {1, 2}
