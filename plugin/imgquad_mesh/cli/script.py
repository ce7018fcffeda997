"""`imgquad-mesh script`: runs a filter script that mixes our filters with MeshLab's."""

from __future__ import annotations

import argparse
import json
import sys
from functools import partial
from pathlib import Path
from typing import Any

import imgquad_core as core
from imgquad_mesh import meshlab, outputs
from imgquad_mesh.texts import number

from .interruption import promptly

#: endings of inputs that are meshes; all others are pictures
MESHES = (
    ".ply",
    ".obj",
    ".off",
    ".stl",
    ".vtu",
    ".vtk",
    ".3mf",
    ".gltf",
    ".glb",
    ".dae",
    ".x3d",
    ".wrl",
    ".dxf",
    ".ctm",
)


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    text = "Run a MeshLab filter script (.mlx) with our filters and MeshLab's, in any order; see imgquad-mesh filters."
    parser = subparsers.add_parser("script", help="run a filter script", description=text)
    parser.add_argument("script", type=Path, metavar="SCRIPT", help="the script, .mlx")
    parser.add_argument("--input", type=Path, metavar="FILE", help=f"a mesh ({' '.join(MESHES)}) or else a picture")
    parser.add_argument("--output", type=Path, metavar="FILE", help="where the current mesh at the end is written")
    parser.add_argument("--folder", type=Path, help="files named in the script lie here (default: the script's folder)")
    parser.add_argument(
        "--deadline", type=number, default=120.0, metavar="S", help="seconds for a filter of MeshLab (120)"
    )
    parser.add_argument("--memory", type=number, metavar="GB", help="of MeshLab at most (half of the machine's)")
    parser.add_argument("--report", type=Path, metavar="FILE", help="what each filter returned: .json")
    parser.add_argument("--quiet", action="store_true", help="print nothing but errors")
    parser.set_defaults(execute=execute)


def execute(args: argparse.Namespace) -> int:
    """Run the script that `args` names; return the exit code."""
    if args.report:
        outputs.check_target(args.report, (".json",))
        outputs.check_files([args.script, args.input], [args.output, args.report])
    meshlab.pymeshlab_filters.ask_early(args.script)
    is_mesh = args.input is not None and args.input.suffix.lower() in MESHES
    run = partial(
        meshlab.script.run_script,
        args.script,
        image=None if is_mesh else args.input,
        mesh=args.input if is_mesh else None,
        output=args.output,
        folder=args.folder,
        deadline=args.deadline,
        memory=args.memory,
        progress=None if args.quiet or not sys.stderr.isatty() else _announce,
    )
    result = promptly(run)
    if args.report:
        outputs.write_json(report_of(result), args.report)
    if not args.quiet:
        _print(result, args.output)
    return 0


def report_of(result: meshlab.script.ScriptResult) -> dict[str, Any]:
    """Return what each filter returned, as JSON can hold it."""
    steps = [
        {"filter": s.name, "function": s.function, "line": s.line, "program": s.program, "seconds": s.seconds,
         "values": json.loads(json.dumps(s.values), parse_constant=str)}
        for s in result.steps
    ]  # fmt: skip
    return {"steps": steps}


def print_crosscheck(mesh: core.QuadMesh, quiet: bool) -> None:
    """Measure a mesh with MeshLab and PyVista, too; QualityError where their figures are others."""
    found = meshlab.crosscheck.crosscheck(mesh)
    if not quiet:
        print(found.table)
    found.require(mesh)


def _announce(name: str, n: int, total: int) -> None:
    print(f"{n + 1}/{total} {name}", file=sys.stderr)


def _print(result: meshlab.script.ScriptResult, output: Path | None) -> None:
    for step in result.steps:
        print(f"{step.seconds:8.2f} s  {step.name}{_short(step.values)}")
    if result.current is not None:
        print(f"current mesh: {len(result.current.points)} points, {result.current.n_faces} faces")
    if output is not None:
        print(f"wrote {output}")


def _short(values: dict[str, Any]) -> str:
    """Return the plain figures among a filter's values, as many as one line holds."""
    shown = [
        f"{key} {value:.6g}" if isinstance(value, float) else f"{key} {value}"
        for key, value in values.items()
        if isinstance(value, (bool, int, float, str))
    ]
    text = ", ".join(shown)
    return f": {text if len(text) <= 160 else text[:157] + '...'}" if text else ""
