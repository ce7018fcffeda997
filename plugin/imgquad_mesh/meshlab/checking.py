"""The check of a whole script before anything runs: every filter known, every value in its type and limits."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

from imgquad_core.errors import InputError, ScriptError
from imgquad_mesh.spec import Filter, Parameter, filters, find_filter, python_name
from imgquad_mesh.texts import options_from

from .mlx import Script, ScriptFilter, ScriptParameter, ScriptValue, script_text
from .names import all_meshlab_names, meshlab_function, nearest
from .own_filters import STEPS, check_output, script_path
from .pymeshlab_filters import PRINTED_TYPES, MissingMeshLab, meshlab_filters, meshlab_parameters

#: types in scripts that stand for the same kind of value
_NUMBER_OR_TEXT = ("pixel_size",)  # a number, or two of them in a text
_SAME_TYPE = {"RichOpenFile": "RichString", "RichSaveFile": "RichString"}
#: MeshLab's parameters that name files, whatever their type in the script; a texture's name has no folder
_FILE_PARAMETER = re.compile(r"file|path")
_BARE_FILE_PARAMETER = ("textname", "texturename")


@dataclass(frozen=True)
class OwnStep:
    """A filter of ours, ready to run."""

    spec: Filter
    options: Any
    line: int

    @property
    def name(self) -> str:
        """Display name."""
        return self.spec.name

    @property
    def function(self) -> str:
        """Python name."""
        return self.spec.function


@dataclass(frozen=True)
class MeshLabStep:
    """A filter of MeshLab, ready to run.

    Parameters
    ----------
    source : ScriptFilter
        As the script has it.
    function : str
        Python name.
    parameters : tuple of (str, str, value)
        Python name, type in scripts and value of each.
    """

    source: ScriptFilter
    function: str
    parameters: tuple[tuple[str, str, ScriptValue], ...]

    @property
    def name(self) -> str:
        """Name in the script."""
        return self.source.name

    @property
    def line(self) -> int:
        """Line in the script."""
        return self.source.line

    @property
    def script(self) -> str | None:
        """A script of this filter alone; None where it has its Python name, which MeshLab's scripts do not know."""
        return None if self.name == self.function else script_text(Script((self.source,)))


def checked_steps(script: Script, folder: Path) -> list[OwnStep | MeshLabStep]:
    """Check a script and make it ready to run.

    Parameters
    ----------
    script : Script
        As read.
    folder : Path
        Files that the script names must lie in it.

    Returns
    -------
    list of OwnStep or MeshLabStep
        One a filter, in order.

    Raises
    ------
    ScriptError
        At the first thing that is wrong, with its line and the nearest right name. pymeshlab is asked only where a
        filter is not ours.
    """
    functions = {id(f): _function_of(script, f) for f in script.filters}
    asked = (
        meshlab_parameters(frozenset(f for f in functions.values() if f not in filters()))
        if any(f not in filters() for f in functions.values())
        else {}
    )
    steps: list[OwnStep | MeshLabStep] = []
    for each in script.filters:
        function = functions[id(each)]
        if function in filters():
            steps.append(_own_step(script, each, filters()[function], folder))
        else:
            steps.append(_meshlab_step(script, each, function, asked[function], folder))
    return steps


def files_of_steps(steps: Iterable[OwnStep | MeshLabStep], folder: Path) -> tuple[list[Path], list[Path]]:
    """Return the files that steps read and those that they write."""
    of_meshlab = [parameter for step in steps if isinstance(step, MeshLabStep) for parameter in step.parameters]
    read = [Path(str(value)) for _, kind, value in of_meshlab if kind == "RichOpenFile" and value]
    written = [Path(str(value)) for _, kind, value in of_meshlab if kind == "RichSaveFile" and value]
    own = [step.options for step in steps if isinstance(step, OwnStep)]
    read += [Path(marks) for each in own if isinstance(marks := getattr(each, "marks", None), (str, Path))]
    read += [script_path(given, folder) for each in own if (given := getattr(each, "properties", None))]
    names = [getattr(each, "file_name", None) for each in own]
    return read, written + [script_path(name, folder) for name in names if name]


def _fail(script: Script, line: int, message: str) -> NoReturn:
    raise ScriptError(message, str(script.file) if script.file else None, line)


def _function_of(script: Script, each: ScriptFilter) -> str:
    """Return the Python name of a filter."""
    own = find_filter(each.name)
    if own is not None:
        return own.function
    own_names = [name for f in filters().values() for name in (f.name, f.function)]
    try:
        known = meshlab_filters()
    except MissingMeshLab as error:
        hint = nearest(each.name, own_names)
        _fail(script, each.line, f"{each.name!r} is no filter of imgquad-mesh{hint}; for MeshLab's: {error}")
    function = meshlab_function(each.name, known)
    if function is None:
        hint = nearest(each.name, [*own_names, *all_meshlab_names(known)])
        _fail(script, each.line, f"unknown filter {each.name!r}{hint or '; imgquad-mesh filters lists ours'}")
    return function


def _own_step(script: Script, each: ScriptFilter, spec: Filter, folder: Path) -> OwnStep:
    values: dict[str, Any] = {}
    for given in each.parameters:
        parameter = spec.parameter(given.name)
        if parameter is None:
            hint = nearest(given.name, [p.name for p in spec.parameters])
            _fail(script, given.line, f"filter {spec.name!r} has no parameter {given.name!r}{hint}")
        if parameter.field in values:
            _fail(script, given.line, f"parameter {given.name!r} of filter {spec.name!r} is given twice")
        values[parameter.field] = _own_value(script, spec, parameter, given, folder)
    try:
        return OwnStep(spec, options_from(STEPS[spec.function].options, spec, values), each.line)
    except (InputError, TypeError) as error:
        _fail(script, each.line, f"filter {spec.name!r}: {error}")


def _own_value(script: Script, spec: Filter, parameter: Parameter, given: ScriptParameter, folder: Path) -> Any:
    if parameter.field in _NUMBER_OR_TEXT and given.kind in ("RichFloat", "RichInt"):
        given = replace(given, kind="RichString", value=repr(given.value))
    kind = _SAME_TYPE.get(given.kind, given.kind)
    if kind != parameter.script_type:
        _fail(script, given.line, f"parameter {given.name!r} of filter {spec.name!r} is of type {given.kind}; "
                                  f"it must be {parameter.script_type}")  # fmt: skip
    try:
        if parameter.field == "file_name":
            check_output(spec.function, str(given.value), folder)
        return parameter.checked(given.value)
    except InputError as error:
        _fail(script, given.line, f"filter {spec.name!r}: {error}")


def _meshlab_step(
    script: Script, each: ScriptFilter, function: str, known: Mapping[str, str], folder: Path
) -> MeshLabStep:
    values: dict[str, tuple[str, str, ScriptValue]] = {}
    for given in each.parameters:
        name = python_name(given.name)
        if name not in known:
            hint = nearest(given.name, known)
            _fail(script, given.line, f"filter {each.name!r} ({function}) has no parameter {given.name!r}{hint}")
        if name in values:
            _fail(script, given.line, f"parameter {given.name!r} of filter {each.name!r} is given twice")
        if known[name] not in PRINTED_TYPES[given.kind]:
            wanted = " or ".join(kind for kind, printed in PRINTED_TYPES.items() if known[name] in printed)
            _fail(script, given.line, f"parameter {given.name!r} of filter {each.name!r} is of type {given.kind}; "
                                      f"it must be {wanted}")  # fmt: skip
        values[name] = (name, given.kind, _file_checked(script, each, given, folder))
    # pymeshlab cannot set a camera (RichShotf); scripts hold none either
    return MeshLabStep(each, function, tuple(v for v in values.values() if v[1] != "RichShotf"))


def _file_checked(script: Script, each: ScriptFilter, given: ScriptParameter, folder: Path) -> ScriptValue:
    """Return the value, a file's name as an absolute path inside the script's folder."""
    if python_name(given.name) in _BARE_FILE_PARAMETER and re.search(r"[/\\]", str(given.value)):
        _fail(script, given.line, f"filter {each.name!r}: {given.value!r} must be a file's name without a folder")
    is_file = given.kind in ("RichOpenFile", "RichSaveFile") or _FILE_PARAMETER.search(python_name(given.name))
    if not is_file or not isinstance(given.value, str) or not given.value:
        return given.value
    try:
        return str(script_path(given.value, folder))
    except InputError as error:
        _fail(script, given.line, f"filter {each.name!r}: {error}")
