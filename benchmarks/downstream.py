"""Solve two layers in other people's programs, from our files; make the tables of docs/fe/tools.md.

``python benchmarks/downstream.py [NAME ...]``: programs that pip installs get a virtual environment each in
``/tmp/imgquad-downstream`` (kept for the next run), those of Debian must be there (``apt-get install`` them first);
what is missing is told and left out. Heat between 0 and 1 through layers of conductivity 1 and 10: exact 40/33. Elastic
layers of moduli 1 and 10, nu = 0, pulled by 0.06: exact force 0.0727273.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

PAGE = Path(__file__).parents[1] / "docs" / "fe" / "tools.md"
HEADS = (
    ("program", "version", "file", "options", "materials", "borders", "result", "error"),
    ("program", "8 nodes", "9 nodes"),
)
BEGIN, END = "<!-- made by benchmarks/downstream.py -->", "<!-- end -->"
WORK = Path("/tmp/imgquad-downstream")
#: built by hand from its source: it is in neither Debian nor PyPI
ELMERGRID, ELMERGRID_VERSION = WORK / "elmergrid" / "ElmerGrid", "source of 2024-10-23"
TOOLS = Path(__file__).with_name("downstream_tools")
EXACT = {"heat": 40 / 33, "force": 0.06 * 40 / (30 / 1 + 30 / 10)}
FLAT22 = ("--msh-version", "2.2")
NONE = ("--interfaces", "none")
EIGHT = ("--order", "2")
NINE = (*EIGHT, "--nodes", "9")
VALUES = "".join(
    f'["material {m}"]\nyoung = {v}\npoisson = 0.0\nconductivity = {v}\n' for m, v in enumerate((1.0, 10.0))
)
UMAT = "".join(f'["material {m}"]\nuser_material = [{v}, 0.0]\n' for m, v in enumerate((1.0, 10.0)))


@dataclass(frozen=True)
class Run:
    """One row: a program, how it is installed, its own script, the file that it reads and our options for it."""

    program: str
    script: str
    file: str
    options: tuple[str, ...] = ()
    pip: tuple[str, ...] = ()  #: packages; their first one tells the version
    debian: str = ""  #: package that tells the version
    materials: str = "by name"  #: how the script finds them: by our names, by the numbers in the file, or by place
    borders: str = "by name"
    refused: bool = False  #: the program takes no such element, and says so


MESHIO = ("meshio", "h5py", "netCDF4")
KRATOS = ("KratosMultiphysics", "KratosMedApplication", "KratosStructuralMechanicsApplication", "mpich")
BY_NUMBER = {"materials": "by number", "borders": "by number"}
PLAIN = {"materials": "by number", "borders": "by hand"}


def pip(program: str, script: str, *packages: str, **common: str) -> Callable[..., Run]:
    """Return what makes rows of a program that pip installs: `row(file, *options, **more)`."""
    return lambda file, *options, **more: Run(program, script, file, options, packages, **common | more)


def debian(program: str, script: str, package: str, **common: str) -> Callable[..., Run]:
    """Return what makes rows of a program of Debian."""
    return lambda file, *options, **more: Run(program, script, file, options, (), package, **common | more)


mfem = pip("MFEM", "mfem_heat.py", "mfem")
ngsolve = pip("NGSolve", "ngsolve_heat.py", "ngsolve")
sfepy = debian("SfePy", "sfepy_heat.py", "python3-sfepy", **PLAIN)
felupe = pip("FElupe", "felupe_force.py", "felupe", *MESHIO)
skfem = pip("scikit-fem", "skfem_heat.py", "scikit-fem", *MESHIO)
kratos = pip("Kratos", "kratos_force.py", *KRATOS)
opensees = pip("OpenSees", "opensees_force.py", "openseespy", "numpy")
getfem = debian("GetFEM", "getfem_heat.py", "python3-getfem", **BY_NUMBER)
dolfinx = debian("FEniCSx", "dolfinx_heat.py", "python3-dolfinx", **BY_NUMBER)
dealii = debian("deal.II", "dealii_heat.cc", "libdeal.ii-dev", **BY_NUMBER)
freefem = debian("FreeFEM", "freefem_heat.edp", "freefem++", **BY_NUMBER)
openfoam = debian("OpenFOAM", "openfoam_heat.sh", "openfoam")
calculix = debian("CalculiX", "calculix.sh", "calculix-ccx")
umat = debian("CalculiX", "calculix_umat.sh", "calculix-ccx")
elmergrid = debian("ElmerGrid", "elmergrid_heat.py", "")
VALUED = ("--properties", "values.toml")
RUNS = (
    mfem("a.msh", *NONE),
    mfem("b.msh", *NONE, *FLAT22),
    mfem("c.msh", *NONE, *EIGHT, refused=True),
    mfem("d.msh", *NONE, *NINE),
    mfem("e.vtu", "--plain", **PLAIN),
    mfem("f.vtk", "--plain", **PLAIN),
    ngsolve("a.msh", *NONE, *FLAT22),
    ngsolve("b.msh", *NONE, *FLAT22, *EIGHT, refused=True),
    ngsolve("c.msh", *NONE, *FLAT22, *NINE, refused=True),
    sfepy("a.vtu", "--plain"),
    sfepy("b.vtk", "--plain"),
    sfepy("c.vtu", "--plain", *EIGHT, refused=True),
    sfepy("d.vtu", "--plain", *NINE, refused=True),
    felupe("a.inp"),
    felupe("b.vtu", borders="by hand"),
    felupe("c.vtu", "--plain", materials="by number"),
    felupe("d.vtk", "--plain", materials="by number"),
    felupe("e.vtu", *EIGHT),
    felupe("f.vtu", *NINE),
    skfem("a.msh"),
    skfem("b.msh", *EIGHT, refused=True),
    skfem("c.msh", *NINE, borders="by hand"),
    kratos("a.med"),
    kratos("b.med", *EIGHT),
    kratos("c.med", *NINE),
    opensees("a.npz"),
    opensees("b.npz", *EIGHT),
    opensees("c.npz", *NINE),
    getfem("a.msh"),
    getfem("b.msh", *FLAT22),
    getfem("c.msh", *EIGHT),
    getfem("d.msh", *NINE),
    dolfinx("a.xdmf"),
    dolfinx("b.xdmf", *EIGHT, refused=True),
    dolfinx("c.xdmf", *NINE),
    dealii("a.msh", *NONE),
    dealii("b.msh", *NONE, *FLAT22),
    dealii("c.msh", *NONE, *EIGHT, refused=True),
    dealii("d.msh", *NONE, *NINE, refused=True),
    freefem("heat.msh", "--split-quads", *FLAT22),
    openfoam("a.msh", "--extrude", "10", *NONE),
    openfoam("b.msh", "--extrude", "10", *NONE, *FLAT22),
    elmergrid("a.msh"),
    elmergrid("b.msh", *FLAT22),
    elmergrid("c.msh", *EIGHT),
    elmergrid("d.msh", *NINE),
    calculix("a.inp", "--deck", "thermal", *VALUED),
    calculix("b.inp", "--deck", "tension", *VALUED),
    umat("e.inp", "--deck", "tension", "--properties", "umat.toml"),
    calculix("c.inp", "--deck", "thermal", *VALUED, *EIGHT),
    calculix("d.inp", "--deck", "tension", *VALUED, *EIGHT),
)


def main() -> None:
    """Run the programs asked for (all without names), print their rows and put them into docs/fe/tools.md."""
    WORK.mkdir(exist_ok=True)
    asked = sys.argv[1:] or list(dict.fromkeys(run.program for run in RUNS))
    for program in asked:
        mine = [run for run in RUNS if run.program == program]
        cells = [row(run) for run in mine]
        rows = [f"| {' | '.join(line)} |" for line in cells]
        print(*rows, sep="\n", flush=True)
        put(rows, [f"| {program} | {took(mine, cells, EIGHT)} | {took(mine, cells, NINE)} |"])


def took(runs: list[Run], cells: list[list[str]], order: tuple[str, ...]) -> str:
    """Return what became of a file of second order."""
    for run, (*_, result, error) in zip(runs, cells, strict=True):
        if ("--order" in run.options, "9" in run.options) == (True, order == NINE):
            return f"yes, {error}" if error else result
    return "no file"


def put(*tables: list[str]) -> None:
    """Put rows into the tables of the page: a program's rows replace those that it had there."""
    before, mark, rest = PAGE.read_text(encoding="utf-8").partition(f"{BEGIN}\n")
    block, end, after = rest.partition(END)
    old = block.partition("Order 2:")[::2]
    order = list(dict.fromkeys(run.program for run in RUNS))
    parts = []
    for head, rows, shown in zip(HEADS, tables, old, strict=True):
        names = {line.split(" | ")[0] for line in rows}
        kept = [line for line in shown.splitlines() if line.startswith("|") and line.split(" | ")[0] not in names]
        known = [line for line in kept if line.split(" | ")[0].strip("| ") in order]
        told = sorted(known + rows, key=lambda line: order.index(line.split(" | ")[0].strip("| ")))
        parts.append("\n".join([f"| {' | '.join(head)} |\n|{'---|' * len(head)}", *told]))
    PAGE.write_text(f"{before}{mark}\n{parts[0]}\n\nOrder 2:\n\n{parts[1]}\n\n{end}{after}", encoding="utf-8")


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
    values = told(said.stdout)
    for name, exact in EXACT.items():
        if name in values:
            found = float(values[name])
            where = [values.get("materials", "?"), values.get("borders", "?")]
            error = abs(found / exact - 1)
            wrong = "" if error < 1e-6 else "WRONG: "
            return [
                run.program,
                installed,
                *shown,
                *where,
                f"{wrong}{name} {found:.7f}",
                f"{error:.1e}",
            ]
    if "empty" in values:
        return [run.program, installed, *shown, "", "", f"**empty** {values['empty']}", ""]
    return [run.program, installed, *shown, "", "", f"{'refused' if run.refused else 'FAILS'}: {reason(said)}", ""]


def reason(said: subprocess.CompletedProcess[str]) -> str:
    """Return the line that tells most of why a program did not solve."""
    lines = [line for line in (said.stdout + said.stderr).splitlines() if line.strip()]
    telling = [line for line in lines if re.search(r"error|abort|unknown|not |only", line, re.IGNORECASE)]
    return (telling or lines or [f"exit code {said.returncode}"])[-1].strip().replace("|", "/")[-100:]


def told(output: str) -> dict[str, str]:
    """Return what a script printed, by its first words."""
    return dict(line.split(maxsplit=1) for line in output.splitlines() if len(line.split()) > 1)


def write(folder: Path, run: Run) -> None:
    """Mesh the two layers with our command, into the folder."""
    from imgquad_mesh.__main__ import main as command_line

    labels = np.zeros((40, 60), np.int32)
    labels[:, 30:] = 1
    np.save(folder / "layers.npy", labels)
    (folder / "values.toml").write_text(VALUES)
    (folder / "umat.toml").write_text(UMAT)
    options = [str(folder / word) if word.endswith(".toml") else word for word in run.options]
    ours = ["run", str(folder / "layers.npy"), str(folder / run.file), "--size", "6", "--quiet", *options]
    if command_line(ours):
        raise SystemExit(f"imgquad-mesh {' '.join(ours)} failed")


def version(run: Run) -> str:
    """Version of the program, installed if pip has it; empty if it is missing."""
    if run.program == "ElmerGrid":
        return ELMERGRID_VERSION if ELMERGRID.exists() else ""
    if run.debian:
        query = ["dpkg-query", "-W", "-f", "${Version}", run.debian]
        found = subprocess.run(query, capture_output=True, text=True)
        return found.stdout.rpartition(":")[2].partition("-")[0].partition("+")[0] if found.returncode == 0 else ""
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
    if run.program == "ElmerGrid":
        return [sys.executable, str(script), run.file, str(ELMERGRID)]
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
