"""`imgquad-mesh demo`: draws a picture of a rock, meshes it, shows what comes out."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import imgquad_core as core
from imgquad_core.errors import InputError
from imgquad_mesh import outputs

from .run import Outputs, mesh_to_files


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    text = "Draw a thin section of rock, mesh it, write mesh, picture and report, print the report."
    parser = subparsers.add_parser("demo", help="draw a rock and mesh it", description=text)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("imgquad-demo"), help="default: imgquad-demo")
    parser.set_defaults(execute=execute)


def execute(args: argparse.Namespace) -> int:
    """Write the demo into `args.folder`; return the exit code."""
    folder: Path = args.folder
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot make the folder {folder}: {error.strerror}; give another one") from error
    picture = folder / "rock.png"
    outputs.replace_file(picture, outputs.draw_rock().save)
    files = Outputs(folder / "rock.vtu", report=folder / "rock.json", picture=folder / "mesh.png")
    options = core.MeshOptions(size=5.0, min_pixels=12, min_length=6)
    code = mesh_to_files(picture, options, files)
    print(f"look at {picture} and {files.picture}; open {files.mesh} in ParaView or with pyvista.read")
    print(f"or do the same on a page in the browser: imgquad-mesh studio {picture}")
    return code
