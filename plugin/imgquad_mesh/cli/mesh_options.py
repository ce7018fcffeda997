"""The options of meshing, as the command takes them."""

from __future__ import annotations

import argparse

from imgquad_core import MeshOptions

from .declared_options import add_declared, asked


def add_mesh_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that make a `MeshOptions`; its defaults count for those that are not given."""
    add_declared(parser, MeshOptions)


def mesh_options(args: argparse.Namespace) -> MeshOptions:
    """Return the options that `args` asks for."""
    return MeshOptions(**asked(args, MeshOptions))
