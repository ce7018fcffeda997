"""`imgquad-mesh filters`: lists our filters, prints their reference or a script of them."""

from __future__ import annotations

import argparse
from typing import Any

from imgquad_mesh import meshlab


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    text = "List the filters for scripts; MeshLab's own can be mixed in."
    parser = subparsers.add_parser("filters", help="list the filters for scripts", description=text)
    group = parser.add_mutually_exclusive_group()
    group.add_argument("--markdown", action="store_true", help="print the reference as Markdown")
    group.add_argument("--mlx", nargs="+", metavar="NAME", help="print a script of these filters with their defaults")
    parser.set_defaults(execute=execute)


def execute(args: argparse.Namespace) -> int:
    """Print what `args` asks for; return the exit code."""
    templates = meshlab.templates
    if args.mlx:
        print(templates.filter_script(templates.named_filters(args.mlx)), end="")
    elif args.markdown:
        print(templates.markdown(), end="")
    else:
        print(templates.list_text())
    return 0
