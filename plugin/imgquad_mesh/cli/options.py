"""The options of meshing, as the command takes them."""

from __future__ import annotations

import argparse
import re
from dataclasses import fields
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from imgquad_core.pipeline import MeshOptions

_COLORS = (
    "how colours become materials: each its own (exact), quantised to N, the nearest of '#rrggbb,#rrggbb,...', or "
    "auto: exact up to 32 colours, else a number that the report states (default: auto)"
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
    add("--threads", type=int, metavar="N", help="threads of the meshing stage (default: 1)")


def mesh_options(args: argparse.Namespace) -> MeshOptions:
    """Return the options that `args` asks for."""
    from imgquad_core.pipeline import MeshOptions

    given: dict[str, Any] = {f.name: getattr(args, f.name, None) for f in fields(MeshOptions)}
    given["material_sizes"] = dict(args.size_of) if args.size_of else None
    given["drop"] = tuple(args.drop) if args.drop else None
    return MeshOptions(**{name: value for name, value in given.items() if value is not None})


def colors(text: str) -> str | int | list[tuple[int, int, int]]:
    """Return what --colors asks for."""
    if text in ("auto", "exact"):
        return text
    if text.isdigit():
        return int(text)
    parts = [part.strip() for part in text.split(",")]
    if not all(re.fullmatch("#[0-9a-fA-F]{6}", part) for part in parts):
        raise argparse.ArgumentTypeError(f"'{text}' is none of: auto, exact, a number, '#rrggbb,#rrggbb,...'")
    return [(int(p[1:3], 16), int(p[3:5], 16), int(p[5:7], 16)) for p in parts]


def box(text: str) -> tuple[int, int, int, int]:
    """Return what --crop asks for."""
    if not re.fullmatch(r"-?\d+(,-?\d+){3}", text):
        raise argparse.ArgumentTypeError(f"'{text}' is not X0,Y0,X1,Y1 in whole pixels")
    left, upper, right, lower = map(int, text.split(","))
    return left, upper, right, lower


def size_of(text: str) -> tuple[str, float]:
    """Return what --size-of asks for."""
    material, _, size = text.rpartition("=")
    if not material:
        raise argparse.ArgumentTypeError(f"'{text}' is not MATERIAL=S, as in quartz=2")
    return material, number(size)


def whole_or_auto(text: str) -> int | str:
    """Return 'auto' or a whole number."""
    return text if text == "auto" else whole(text)


def real_or_auto(text: str) -> float | str:
    """Return 'auto' or a number."""
    return text if text == "auto" else number(text)


def whole(text: str) -> int:
    """Return a whole number, 0 or more."""
    if not text.isdigit():
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number")
    return int(text)


def number(text: str) -> float:
    """Return a number."""
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number") from None
