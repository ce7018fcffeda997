"""`imgquad-mesh warm`: compiles what the first run would compile, as for the image of a container."""

from __future__ import annotations

import argparse
from time import perf_counter
from typing import Any

import imgquad_core as core
from imgquad_mesh import cli, outputs

SMALL = (120, 80)  #: columns and rows of the pictures


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    text = "Compile the kernels, as the first run would, into NUMBA_CACHE_DIR or beside the package: once a machine."
    parser = subparsers.add_parser("warm", help="compile all kernels now", description=text)
    parser.set_defaults(execute=execute)


def execute(args: argparse.Namespace) -> int:
    """Mesh small pictures of several kinds with all efforts; return the exit code."""
    start = perf_counter()
    cli.console.announce_compiling()
    for picture in outputs.small_pictures(*SMALL):
        for effort in ("normal", "fast", "best"):
            core.run(picture, core.MeshOptions(size=3.0, min_pixels=4, min_length=2.0, effort=effort))
    share, seconds = core.pipeline.share_compiled(), perf_counter() - start
    print(f"{share:.0%} of the kernels are compiled, after {seconds:.0f} s; the others come with what needs them")
    return 0
