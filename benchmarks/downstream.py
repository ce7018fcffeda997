"""Solve two layers in other people's programs, from our files; print the table of docs/fe/tools.md.

``python benchmarks/downstream.py [NAME ...]``: programs that pip installs get a virtual environment each in
``/tmp/imgquad-downstream`` (kept for the next run), those of Debian must be there (``apt-get install`` them first);
what is missing is told and left out. Heat between 0 and 1 through layers of conductivity 1 and 10: exact 40/33. Elastic
layers of moduli 1 and 10, nu = 0, pulled by 0.06: exact force 0.0727273.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

WORK = Path("/tmp/imgquad-downstream")
TOOLS = Path(__file__).with_name("downstream_tools")
EXACT = {"heat": 40 / 33, "force": 0.06 * 40 / (30 / 1 + 30 / 10)}
FLAT22 = ("--msh-version", "2.2")
NONE = ("--interfaces", "none")
NINE = ("--order", "2", "--nodes", "9")
VALUES = "".join(
    f'["material {m}"]\nyoung = {v}\npoisson = 0.0\nconductivity = {v}\n' for m, v in enumerate((1.0, 10.0))
)


@dataclass(frozen=True)
class Run:
    """One row: a program, how it is installed, its own script, the file that it reads and our options for it."""

    program: str
    script: str
    file: str
    options: tuple[str, ...] = ()
    pip: tuple[str, ...] = ()  #: packages; their first one tells the version
    debian: str = ""  #: package that tells the version


MESHIO = ("meshio", "h5py", "netCDF4")
RUNS = (
    Run("MFEM", "mfem_heat.py", "a.msh", NONE, ("mfem",)),
    Run("MFEM", "mfem_heat.py", "b.msh", (*NONE, *FLAT22), ("mfem",)),
    Run("MFEM", "mfem_heat.py", "c.msh", (*NONE, *NINE), ("mfem",)),
    Run("MFEM", "mfem_heat.py", "d.vtu", ("--plain",), ("mfem",)),
    Run("MFEM", "mfem_heat.py", "e.vtk", ("--plain",), ("mfem",)),
    Run("NGSolve", "ngsolve_heat.py", "a.msh", (*NONE, *FLAT22), ("ngsolve",)),
    Run("SfePy", "sfepy_heat.py", "a.vtu", ("--plain",), ("sfepy",)),
    Run("SfePy", "sfepy_heat.py", "b.vtk", ("--plain",), ("sfepy",)),
    Run("FElupe", "felupe_force.py", "a.inp", (), ("felupe", *MESHIO)),
    Run("FElupe", "felupe_force.py", "b.vtu", ("--plain",), ("felupe", *MESHIO)),
    Run("scikit-fem", "skfem_heat.py", "a.msh", (), ("scikit-fem", *MESHIO)),
    Run("scikit-fem", "skfem_heat.py", "b.msh", NINE, ("scikit-fem", *MESHIO)),
    Run("OpenSees", "opensees_force.py", "a.npz", (), ("openseespy", "numpy")),
    Run("GetFEM", "getfem_heat.py", "a.msh", (), debian="python3-getfem"),
    Run("GetFEM", "getfem_heat.py", "b.msh", FLAT22, debian="python3-getfem"),
    Run("FEniCSx", "dolfinx_heat.py", "a.xdmf", (), debian="python3-dolfinx"),
    Run("FEniCSx", "dolfinx_heat.py", "b.xdmf", NINE, debian="python3-dolfinx"),
    Run("deal.II", "dealii_heat.cc", "a.msh", NONE, debian="libdeal.ii-dev"),
    Run("deal.II", "dealii_heat.cc", "b.msh", (*NONE, *FLAT22), debian="libdeal.ii-dev"),
    Run("FreeFEM", "freefem_heat.edp", "heat.msh", ("--split-quads", *FLAT22), debian="freefem++"),
    Run("OpenFOAM", "openfoam_heat.sh", "a.msh", ("--extrude", "10", *NONE), debian="openfoam"),
    Run("OpenFOAM", "openfoam_heat.sh", "b.msh", ("--extrude", "10", *NONE, *FLAT22), debian="openfoam"),
    Run(
        "CalculiX", "calculix.sh", "a.inp", ("--deck", "thermal", "--properties", "values.toml"), debian="calculix-ccx"
    ),
    Run(
        "CalculiX", "calculix.sh", "b.inp", ("--deck", "tension", "--properties", "values.toml"), debian="calculix-ccx"
    ),
)


def main() -> None:
    """Print a row a run."""
    asked = set(sys.argv[1:])
    WORK.mkdir(exist_ok=True)
    heads = ("program", "version", "file", "options", "materials", "borders", "result", "error")
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for run in RUNS:
        if not asked or run.program in asked:
            print(f"| {' | '.join(row(run))} |", flush=True)


def row(run: Run) -> list[str]:
    """Write the file, let the program solve, tell what it said."""
    folder = WORK / f"{run.program}-{Path(run.file).stem}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    shown = [f"`.{run.file.rpartition('.')[2]}`", f"`{' '.join(run.options)}`" if run.options else ""]
    installed = version(run)
    if not installed:
        return [run.program, "not installed", *shown, "", "", "not run", ""]
    write(folder, run)
    said = subprocess.run(command(run), cwd=folder, capture_output=True, text=True, env=environment(run))
    values = dict(line.split(maxsplit=1) for line in said.stdout.splitlines() if len(line.split()) > 1)
    for name, exact in EXACT.items():
        if name in values:
            found = float(values[name])
            where = [values.get("materials", "?"), values.get("borders", "?")]
            return [run.program, installed, *shown, *where, f"{name} {found:.7f}", f"{abs(found / exact - 1):.1e}"]
    last = (said.stderr or said.stdout).strip().splitlines()[-1:] or ["nothing"]
    return [run.program, installed, *shown, "", "", f"fails: {last[0][:100]}", ""]


def write(folder: Path, run: Run) -> None:
    """Mesh the two layers with our command, into the folder."""
    labels = np.zeros((40, 60), np.int32)
    labels[:, 30:] = 1
    np.save(folder / "layers.npy", labels)
    (folder / "values.toml").write_text(VALUES)
    ours = [sys.executable, "-m", "imgquad_mesh", "run", "layers.npy", run.file, "--size", "6", "--quiet", *run.options]
    subprocess.run(ours, cwd=folder, check=True)


def version(run: Run) -> str:
    """Version of the program, installed if pip has it; empty if it is missing."""
    if run.debian:
        query = ["dpkg-query", "-W", "-f", "${Version}", run.debian]
        found = subprocess.run(query, capture_output=True, text=True)
        return found.stdout.partition("-")[0].partition("+")[0] if found.returncode == 0 else ""
    python = WORK / "venvs" / run.pip[0] / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", python.parent.parent], check=True)
    told = f"from importlib.metadata import version; print(version('{run.pip[0]}'))"
    found = subprocess.run([python, "-c", told], capture_output=True, text=True)
    if found.returncode:
        subprocess.run(["nice", python, "-m", "pip", "install", "-q", *run.pip], capture_output=True)
        found = subprocess.run([python, "-c", told], capture_output=True, text=True)
    return found.stdout.strip()


def environment(run: Run) -> dict[str, str]:
    """Where programs find their own libraries."""
    libraries = WORK / "venvs" / run.pip[0] / "lib" if run.pip else Path()
    return os.environ | {"OMP_NUM_THREADS": "1", "FF_LOADPATH": "/usr/lib/freefem++", "LD_LIBRARY_PATH": str(libraries)}


def command(run: Run) -> list[str]:
    """What starts the program."""
    script = TOOLS / run.script
    if run.pip:
        return [str(WORK / "venvs" / run.pip[0] / "bin" / "python"), str(script), run.file]
    if script.suffix == ".cc":
        return [str(compiled(script)), run.file]
    start = {".py": ["/usr/bin/python3"], ".sh": ["bash"], ".edp": ["FreeFem++", "-nw", "-v", "0"]}[script.suffix]
    return [*start, str(script), run.file]


def compiled(script: Path) -> Path:
    """Compile a program against Debian's deal.II, once (minutes)."""
    program = WORK / script.stem
    if not program.exists() or program.stat().st_mtime < script.stat().st_mtime:
        folders = ("/usr/include/deal.II", "/usr/lib/x86_64-linux-gnu/openmpi/include", "/usr/include/trilinos")
        flags = ["-O0", "-DNDEBUG", "-std=c++17", *(f"-I{folder}" for folder in (*folders, "/usr/include/petsc"))]
        libraries = ["-Wl,--copy-dt-needed-entries", "-ldeal.ii", "-ltbb"]
        subprocess.run(["nice", "g++", *flags, str(script), "-o", str(program), *libraries], check=True)
    return program


if __name__ == "__main__":
    main()
