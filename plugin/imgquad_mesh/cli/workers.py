"""Where the work is done: options of the commands for large pictures."""

from __future__ import annotations

import argparse
from typing import Any


def add_workers(parser: argparse.ArgumentParser, group: Any) -> None:
    """Add options that say who does the work, and what becomes of what is there."""
    who = parser.add_mutually_exclusive_group()
    who.add_argument("--workers", type=_at_least_one, default=1, metavar="N", help="processes on this machine (1)")
    who.add_argument(
        "--scheduler", metavar="ADDRESS", help="of Dask, as tcp://host:8786; its workers see the same files"
    )
    group.add_argument("--restart", action="store_true", help="give up what is there of another plan, or of this one")
    group.add_argument("--quiet", action="store_true", help="print nothing but errors")


def work_options(args: argparse.Namespace) -> dict[str, Any]:
    """Return what `args` says of these options, as keywords of `mesh_stack` and `mesh_tiles`."""
    return {name: getattr(args, name) for name in ("workers", "scheduler", "restart")}


def _at_least_one(text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} is no number of workers: give 1 or more")
    return int(text)
