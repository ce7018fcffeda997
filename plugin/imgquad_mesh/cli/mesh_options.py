"""The options of meshing, as the command takes them."""

from __future__ import annotations

import argparse
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from imgquad_mesh.texts import box, colors, real_or_auto, size_of, whole, whole_or_auto

if TYPE_CHECKING:
    from imgquad_core.options import MeshOptions

_COLORS = (
    "how colours become materials: each its own (exact), quantised to N, the nearest of '#rrggbb,#rrggbb,...', or "
    "auto: exact up to 32 colours, else a number that the report states (default: auto)"
)
_TRIANGULATOR = (
    "who makes the triangles that quads come from: Triangle (not for commercial use), CDT, or auto: Triangle where it "
    "is installed, else CDT (default: auto)"
)
_MIN_PIXELS = "remove clusters of fewer than N pixels ... (default: auto, which is 0 for label pictures; 0: none)"


def add_mesh_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that make a `MeshOptions`; its defaults count for those that are not given."""
    add = parser.add_argument_group("picture").add_argument
    add("--colors", type=colors, metavar="auto|exact|N|PALETTE", help=_COLORS)
    add("--crop", type=box, metavar="X0,Y0,X1,Y1", help="mesh this part only; pixels from the upper left corner")
    add("--drop", action="append", metavar="MATERIAL", help="leave a material (name or number) out; repeatable")
    add("--drop-transparent", action="store_true", default=None, help="leave pixels of alpha 0 out")
    add("--frame", type=whole, metavar="K", help="which picture of a stack (pages of a TIFF), counted from 0")
    add("--max-pixels", type=int, metavar="N", help="refuse larger pictures (default: 100 million)")

    add = parser.add_argument_group("noise").add_argument
    add("--min-pixels", type=whole_or_auto, metavar="auto|N", help=_MIN_PIXELS)
    add("--min-length", type=real_or_auto, metavar="auto|L", help="... that are also shorter than L pixels")

    add = parser.add_argument_group("boundaries").add_argument
    add("--policy", metavar="NAME", help="pair joined at an ambiguous corner of four pixels (default: minority)")
    add("--edge-ratio", type=float, metavar="R", help="largest ratio of neighbouring edges (default: 1.2)")
    add("--max-shift", type=float, metavar="D", help="how far smoothing moves them at most, px (default: 1)")

    add = parser.add_argument_group("mesh").add_argument
    add("--size", type=float, metavar="S", help="length of the final edges, px (default: 4)")
    add("--size-of", type=size_of, action="append", metavar="MATERIAL=S", help="the same in one material; repeatable")
    add("--boundary-size", type=float, metavar="S", help="the same on boundaries (default: as --size)")
    add("--growth", type=float, metavar="G", help="largest ratio of neighbouring sizes (default: 1.3)")
    add("--pixel-size", type=float, metavar="L", help="length of a pixel in the unit of the mesh (default: 1)")
    add("--effort", choices=("fast", "normal", "best"), help="how far the mesh is optimised (default: normal)")
    add("--periodic", choices=("none", "x", "y", "xy"), help="match the nodes of opposite sides, for a periodic cell")
    add("--triangulator", choices=("auto", "triangle", "cdt"), help=_TRIANGULATOR)
    add("--threads", type=int, metavar="N", help="threads of the meshing stage (default: 1)")


def mesh_options(args: argparse.Namespace) -> MeshOptions:
    """Return the options that `args` asks for."""
    from imgquad_core.options import MeshOptions

    given: dict[str, Any] = {f.name: getattr(args, f.name, None) for f in fields(MeshOptions)}
    given["material_sizes"] = dict(args.size_of) if args.size_of else None
    given["drop"] = tuple(args.drop) if args.drop else None
    return MeshOptions(**{name: value for name, value in given.items() if value is not None})
