"""What was clicked, as values, and as a command, Python and a filter script that do the same. Imports no NumPy."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from imgquad_core.declared import declarations
from imgquad_core.errors import InputError
from imgquad_core.fe import ElementOptions
from imgquad_core.options import MeshOptions
from imgquad_mesh import meshlab
from imgquad_mesh.spec import Value, filters
from imgquad_mesh.texts import TEXTS, read_text, values_of, words_of

#: names of the files beside the picture that the commands of a recipe read
MARKS, PROPERTIES = "marks.png", "properties.toml"
#: options that a page does not set: what the server holds to, or places of files
_NOT_OF_PAGES = ("max_pixels", "threads", "marks")
_VTK = (".vti", ".vtk", ".vtkhdf", ".mha", ".mhd")


@dataclass(frozen=True)
class Output:
    """The file of the mesh: extension, elements, options of the writer, and values of the materials as TOML."""

    extension: str = ".vtu"
    elements: ElementOptions = field(default_factory=ElementOptions)
    writer: Mapping[str, str] = field(default_factory=dict)
    properties: str = ""


@dataclass(frozen=True)
class Recipe:
    """A picture (by its name), how it is meshed, and what is written. Marks are at `MARKS`."""

    picture: str
    options: MeshOptions
    output: Output

    @property
    def file(self) -> str:
        """Name of the file of the mesh."""
        return f"{Path(self.picture).stem}{self.output.extension}"

    @property
    def texts(self) -> dict[str, str]:
        """The recipe as a command, as Python and as a script."""
        return {"command": command(self), "python": python(self), "script": script(self)}


def safe_name(name: str) -> str:
    """Return the last part of a name that a browser sent, of harmless signs only; "picture" where none is left."""
    last = re.split(r"[/\\]", name)[-1]
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", last).lstrip(".-")[-60:].lstrip(".-") or "picture"


def recipe_of(values: Any) -> Recipe:
    """Make a recipe of what a page sent.

    Raises
    ------
    InputError
        A value is none.
    """
    if not isinstance(values, Mapping):
        raise InputError("the recipe is no JSON object: load the page anew")
    options = _mesh_options(_mapping(values, "options"))
    if values.get("marks"):
        options = replace(options, marks=MARKS, learn=values.get("learn") is True)
    return Recipe(safe_name(str(values.get("picture", ""))), options, _output(_mapping(values, "output"), options))


def _mapping(values: Mapping[str, Any], name: str) -> dict[str, Any]:
    found = values.get(name, {})
    if not isinstance(found, Mapping):
        raise InputError(f"{name} is {found!r}; give an object")
    return dict(found)


def _mesh_options(values: dict[str, Any]) -> MeshOptions:
    known = declarations(MeshOptions)
    for name in values:
        if name not in known or name in _NOT_OF_PAGES:
            raise InputError(f"{name!r} is no option of the studio")
    try:
        return MeshOptions(**{name: _natural(name, value) for name, value in values.items()})
    except (AttributeError, TypeError, ValueError, KeyError) as error:  # of another type than the page sends
        raise error if isinstance(error, InputError) else InputError(f"an option cannot be used: {error}") from error


def _natural(name: str, value: Any) -> Any:
    """Return an option as `MeshOptions` takes it: texts as on the command, pairs as mappings, as JSON has no tuples."""
    if name in ("merge", "sizes_between"):
        return {tuple(key): each for key, each in value}
    if name == "recolor":
        return {key: tuple(int(color[k : k + 2], 16) for k in (1, 3, 5)) for key, color in value.items()}
    if isinstance(value, str) and name in TEXTS and not TEXTS[name].item:
        return read_text(name, value)
    return value


def _output(values: dict[str, Any], options: MeshOptions) -> Output:
    extension, properties = str(values.get("extension", ".vtu")), str(values.get("properties", ""))
    periodic = None if options.periodic == "none" else options.periodic
    given = _mapping(values, "elements")
    unknown = given.keys() - declarations(ElementOptions).keys() | {"split_quads"} & given.keys()
    if unknown or not re.fullmatch(r"\.[a-z]{1,8}", extension):
        raise InputError(f"{[*unknown, extension][0]!r} is no option of files")
    elements = ElementOptions(**{k: _natural(k, v) for k, v in given.items()}, periodic=periodic)
    writer = {name: str(values[name]) for name in ("analysis", "deck") if values.get(name)}
    return Output(extension, elements, writer, properties)


def _changed(options: Any) -> Iterator[tuple[str, Any]]:
    """Return the options that are not the defaults, in their order."""
    default = type(options)()
    for each in fields(options):
        value = getattr(options, each.name)
        if value != getattr(default, each.name):
            yield each.name, value


def command(recipe: Recipe) -> str:
    """Return the line that does the same in a terminal (quoted for POSIX shells)."""
    words = ["imgquad-mesh", "run", recipe.picture, recipe.file]
    for options in (recipe.options, recipe.output.elements):
        for name, value in _changed(options):
            if name in declarations(type(options)):
                words += words_of(name, value)
    for name, value in recipe.output.writer.items():
        words += [f"--{name}", value]
    return shlex.join(words + (["--properties", PROPERTIES] if recipe.output.properties else []))


def python(recipe: Recipe) -> str:
    """Return the lines that do the same in Python."""
    output, is_vtk = recipe.output, recipe.picture.lower().endswith(_VTK)
    elements = _call("ElementOptions", output.elements)
    writer = [f"{name}={value!r}" for name, value in output.writer.items()]
    writer += [f"properties=read_properties({PROPERTIES!r})"] if output.properties else []
    lines = ["from pathlib import Path", "", "from imgquad_core import MeshOptions, run"]
    lines += ["from imgquad_core.fe import ElementOptions"] if elements != "ElementOptions()" else []
    lines += ["from imgquad_core.fe.properties import read_properties"] if output.properties else []
    lines += ["from imgquad_mesh.datasets.pictures import read_any"] if is_vtk else []
    lines += ["from imgquad_mesh.outputs.files import write_run", ""]
    lines += [f"options = {_call('MeshOptions', recipe.options)}"]
    picture = f"read_any({recipe.picture!r}, options.reading())" if is_vtk else repr(recipe.picture)
    written = [f"Path({recipe.file!r})"] + ([elements] if elements != "ElementOptions()" else []) + writer
    return "\n".join([*lines, f"done = run({picture}, options)", f"write_run(done, {', '.join(written)})", ""])


def _call(name: str, options: Any) -> str:
    given = [f"{key}={value!r}" for key, value in _changed(options)]
    short = f"{name}({', '.join(given)})"
    return short if len(short) < 90 else f"{name}(\n" + "".join(f"    {each},\n" for each in given) + ")"


def script(recipe: Recipe) -> str:
    """Return the filter script that does the same: `imgquad-mesh script FILE.mlx --input PICTURE`."""
    mesh, export = filters()["generate_quad_mesh_from_image"], filters()["export_quad_mesh_to_file"]
    output = recipe.output
    given: dict[str, Any] = {e.name: getattr(output.elements, e.name) for e in fields(output.elements)}
    given |= {"file_name": recipe.file, "properties": PROPERTIES if output.properties else "", **output.writer}
    given["periodic"] = output.elements.periodic or "none"
    written: dict[str, Value] = {
        p.field: TEXTS[p.field].write(given[p.field]) if p.field in TEXTS and p.kind == "String" else given[p.field]
        for p in export.parameters
        if p.field in given
    }
    return meshlab.templates.filter_script(
        [mesh, export], {mesh.function: values_of(recipe.options, mesh), export.function: written}
    )
