"""`imgquad-mesh tiles`: a picture larger than memory, to one mesh in tiles."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from imgquad_mesh import large, outputs
from imgquad_mesh.progress import counting_if

from .element_options import add_writer_options, given_options
from .mesh_options import add_mesh_options, mesh_options
from .workers import add_workers, work_options


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    text = "Mesh a large picture tile by tile to one conforming mesh. Started again in the same folder, it goes on."
    parser = subparsers.add_parser("tiles", help="mesh a picture larger than memory", description=text)
    parser.add_argument("image", type=Path, metavar="IMAGE", help=".npy, .zarr, tiled TIFF or pyramid; others if small")
    parser.add_argument("output", type=Path, metavar="FOLDER", help="folder for all files")
    add_mesh_options(parser)
    group = parser.add_argument_group("tiles")
    group.add_argument("--tile", type=int, default=4096, metavar="N", help="side of a tile in pixels (4096)")
    group.add_argument(
        "--keep-whole", type=int, default=256, metavar="N", help="regions in a box of this side are never cut (256)"
    )
    group.add_argument("--format", choices=("pvtu", "vtkhdf"), default="pvtu", help="how the whole is written (pvtu)")
    add_workers(parser, group)
    group = parser.add_argument_group("one file for a solver")
    group.add_argument(
        "--deck", dest="deck_file", type=Path, metavar="FILE", help="the whole with all sets: .inp .msh .e ..."
    )
    add_writer_options(group, "--load")
    parser.set_defaults(execute=execute)


def execute(args: argparse.Namespace) -> int:
    """Mesh the picture that `args` names; return the exit code."""
    outputs.check_files([args.image], [args.deck_file])
    deck_options = given_options(args, args.deck_file.suffix.lower() if args.deck_file else "", "--load")
    kinds = ("labels", "outlines", "mesh", "band", "piece")
    with counting_if(not args.quiet, dict.fromkeys(kinds)) as told:
        made = large.mesh_tiles(
            args.image,
            args.output,
            mesh_options(args),
            tile=args.tile,
            keep_whole=args.keep_whole,
            form=args.format,
            deck=args.deck_file,
            deck_options=deck_options,
            told=told,
            **work_options(args),
        )
    if not args.quiet:
        _print(made)
    return 0


def _print(made: large.TiledMesh) -> None:
    report = made.report
    grid, quality, regions = report["grid"], report["quality"], report["regions"]
    for text in report["notes"]:
        print(text)
    for text in report["warnings"]:
        print(f"warning: {text}", file=sys.stderr)
    print(
        f"{grid['rows']} x {grid['columns']} tiles of {grid['tile']} px, {quality['n_quads']} quads, "
        f"{regions['regions']} regions, {regions['cut']} of them cut at seams"
    )
    print(
        f"scaled Jacobian: min {quality['min_sj']:.3f}, 1 % {quality['sj_1_percent']:.3f}, "
        f"mean {quality['mean_sj']:.3f}; irregular inner nodes {quality['irregular']:.2%}"
    )
    print(f"wrote {made.path}, report in {made.path.parent / 'report.json'}")
    if "deck" in report:
        print(f"wrote {report['deck']}")
