"""The options of elements and solver files, as the command takes them."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import imgquad_core as core
from imgquad_core.errors import InputError
from imgquad_core.fe import ElementOptions
from imgquad_core.fe.options import BETWEEN, interface_options
from imgquad_mesh.texts import number

from .declared_options import add_declared, asked

#: options of the command that a writer takes under the same name
WRITER_OPTIONS = ("analysis", "reduced", "thickness", "properties", "deck", "regions", "interfaces", "version", "plain")
#: options of the formats that PyVista writes
PLAIN = {".vtu": ("plain",), ".vtk": ("plain",)}


def add_element_options(parser: argparse.ArgumentParser) -> None:
    """Add what makes an `ElementOptions` and the options of the writers."""
    add_declared(parser, ElementOptions)
    group = parser.add_argument_group("solver files")
    add_writer_options(group, "--deck")
    group.add_argument(
        "--interfaces",
        choices=("elements", "springs", *BETWEEN),
        help="between split sides: cohesive elements, springs (.inp), or nothing, just the sides as sets; none: leave "
        "out the sides that two materials share, for programs that take all named sides for the boundary",
    )
    group.add_argument("--msh-version", dest="version_", metavar="V", help="4.1 (default) or 2.2: .msh")
    group.add_argument(
        "--plain", action="store_true", default=None, help="numbers only, materials from 1: .vtu .vtk (SfePy, MFEM)"
    )


def add_writer_options(group: Any, model: str) -> None:
    """Add what solvers' files of any mesh are written with; `model` is the option that asks for one that runs."""
    add = group.add_argument
    add(
        "--analysis",
        metavar="NAME",
        help="'plane stress' (default), 'plane strain', axisymmetric, heat: .inp .bdf .cdb",
    )
    add("--reduced", action="store_true", default=None, help="reduced integration (CPS4R ...): .inp")
    add("--thickness", type=number, metavar="T", help="out of the plane (default: 1): .inp .bdf .cdb")
    add("--properties", type=Path, metavar="TOML", help="values of the materials: .inp .bdf .cdb")
    add(model, dest="deck", metavar="tension|thermal", help="a model that CalculiX runs as it is: .inp")
    add("--regions", action="store_true", default=None, help="an element set for each connected region, too: .inp")


def element_options(args: argparse.Namespace) -> ElementOptions:
    """Return the elements that `args` asks for."""
    periodic = None if args.periodic in (None, "none") else args.periodic
    return ElementOptions(
        **asked(args, ElementOptions),
        periodic=periodic,
        **interface_options(args.interfaces),
    )


def writer_options(args: argparse.Namespace) -> dict[str, Any]:
    """Return the options of the writer that were given, checked against the format of ``args.output``.

    Raises
    ------
    InputError
        The format has no such option, or the file of properties cannot be used: said before any work is done.
    """
    writers, extension = core.writers, args.output.suffix.lower()
    given = given_options(args, extension)
    if args.cohesive and args.interfaces != "sides" and extension in writers.WITHOUT_COHESIVE:
        raise InputError(writers.no_cohesive(writers.WITHOUT_COHESIVE[extension]))
    return given


def given_options(args: argparse.Namespace, extension: str, model: str = "--deck") -> dict[str, Any]:
    """Return the options of a format's writer that were given; `model` is the one that asks for one that runs.

    Raises
    ------
    InputError
        It has no such option, or the file of properties cannot be used.
    """
    writers = core.writers
    asked = {name: getattr(args, "version_" if name == "version" else name, None) for name in WRITER_OPTIONS}
    given: dict[str, Any] = {name: value for name, value in asked.items() if value is not None}
    if given.get("interfaces") in BETWEEN:  # not the writer's, see `element_options`
        del given["interfaces"]
    known = writers.options_of(writers.WRITERS[extension]) if extension in writers.WRITERS else PLAIN.get(extension, ())
    for name in given:
        if name not in known:
            option = {"version": "--msh-version", "deck": model}.get(name, f"--{name}")
            option += f" {given[name]}" if name == "interfaces" else ""
            what = f"{extension} files have no {option}" if extension else f"{option} is of a file for a solver"
            raise InputError(f"{what}: leave it out, or write {'another format' if extension else 'one, with --deck'}")
    if "properties" in given:
        given["properties"] = core.fe.read_properties(given["properties"])
    return given
