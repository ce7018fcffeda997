"""`imgquad-mesh stack`: the slices of a stack, each to its mesh, by one rule."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from imgquad_core.whole_files import assert_apart
from imgquad_mesh import large
from imgquad_mesh.progress import counting_if
from imgquad_mesh.texts import number

from .mesh_options import add_mesh_options, mesh_options
from .workers import add_workers, work_options

SOME_FAILED = 3


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    text = "Mesh all slices of a stack: one palette and one noise rule for all. Started again, it goes on."
    parser = subparsers.add_parser("stack", help="mesh the slices of a stack", description=text)
    parser.add_argument(
        "source", nargs="+", metavar="SOURCE", help="a pattern in quotes ('slices/*.png'), files, or one file of many"
    )
    parser.add_argument("output", type=Path, metavar="OUTPUT", help="collection of the meshes, .pvd")
    add_mesh_options(parser)
    group = parser.add_argument_group("stack")
    group.add_argument(
        "--spacing", type=number, default=1.0, metavar="D", help="distance of slices, unit of the mesh (1)"
    )
    add_workers(parser, group)
    parser.set_defaults(execute=execute)


def execute(args: argparse.Namespace) -> int:
    """Mesh the stack that `args` names; return the exit code."""
    options = mesh_options(args)
    found = large.slices_of(args.source, options.reading()).of
    assert_apart([each.path for each in found if each.path], [args.output])
    with counting_if(not args.quiet, {"mesh": len(found)}) as told:
        how = work_options(args)
        made = large.mesh_stack(args.source, args.output, options, spacing=args.spacing, told=told, **how)
    if not args.quiet:
        _print(made)
    for name, reason in made.failed:
        print(f"imgquad-mesh: {name} was not meshed: {reason}", file=sys.stderr)
    return SOME_FAILED if made.failed else 0


def _print(made: large.StackResult) -> None:
    report, quality = made.report, made.report["quality"]
    print(report["legend"])
    for text in report["warnings"]:
        print(f"warning: {text}", file=sys.stderr)
    print(f"{len(made) - len(made.failed)} of {len(made)} slices meshed, {quality['n_quads']} quads")
    print(f"scaled Jacobian: min {quality['min_sj']:.3f} (in {quality['worst_slice']}), mean {quality['mean_sj']:.3f}")
    print(f"wrote {made.path}, report in {made.path.with_suffix('') / 'report.json'}")
