"""Our filters as scripts and as a page: what ``imgquad-mesh filters`` prints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from imgquad_core import MeshOptions
from imgquad_core.errors import InputError
from imgquad_mesh.spec import Filter, Parameter, Value, filters, find_filter
from imgquad_mesh.texts import values_of

from .mlx import Script, ScriptFilter, ScriptParameter, script_text
from .names import nearest


def filter_script(specs: Sequence[Filter], values: Mapping[str, Mapping[str, Value]] | None = None) -> str:
    """Return a script of some of our filters.

    Parameters
    ----------
    specs : sequence of Filter
        In the order in which they run.
    values : mapping, optional
        By Python name of a filter, the values that differ from the defaults, by field name.
    """
    given = values or {}
    return script_text(Script(tuple(_script_filter(spec, given.get(spec.function, {})) for spec in specs)))


def _script_filter(spec: Filter, values: Mapping[str, Value]) -> ScriptFilter:
    merged = spec.defaults | dict(values)
    return ScriptFilter(spec.name, tuple(_script_parameter(p, p.checked(merged[p.field])) for p in spec.parameters))


def _script_parameter(parameter: Parameter, value: Value) -> ScriptParameter:
    held = parameter.choices.index(str(value)) if parameter.kind == "Enum" else value
    return ScriptParameter(
        name=parameter.name,
        kind=parameter.script_type,
        value=held,
        choices=parameter.choices,
        low=parameter.low,
        high=parameter.high,
        label=parameter.label,
        tooltip=parameter.help,
    )


def run_as_script(options: MeshOptions) -> str:
    """Return the script that does what ``imgquad-mesh run`` does with these options: the same mesh to the bit."""
    spec = filters()["generate_quad_mesh_from_image"]
    return filter_script([spec], {spec.function: values_of(options, spec)})


def named_filters(names: Sequence[str]) -> list[Filter]:
    """Return our filters of these display or Python names.

    Raises
    ------
    InputError
        One of them is not ours.
    """
    found = [find_filter(name) for name in names]
    for name, spec in zip(names, found, strict=True):
        if spec is None:
            hint = nearest(name, [each for f in filters().values() for each in (f.name, f.function)])
            raise InputError(f"{name!r} is no filter of imgquad-mesh{hint}")
    return [spec for spec in found if spec is not None]


def list_text() -> str:
    """Return the display name, the Python name and the first sentence of each filter."""
    lines = []
    for spec in filters().values():
        lines += [spec.name, f"    {spec.function}({', '.join(p.python_name for p in spec.parameters)})"]
        lines += [f"    {spec.help.split('. ')[0].rstrip('.')}."]
    return "\n".join(lines)


def markdown() -> str:
    """Return a page of all filters, one table each."""
    return "\n".join(line for spec in filters().values() for line in _markdown(spec)).rstrip() + "\n"


def _markdown(spec: Filter) -> Iterator[str]:
    yield from (f"## {spec.name}", "", f"`{spec.function}` · {', '.join(spec.classes)}", "", spec.help, "")
    if spec.parameters:
        yield from ("| parameter | type | default | meaning |", "|---|---|---|---|")
        for p in spec.parameters:
            yield f"| `{p.name}` | {_kind(p)} | {_shown(p.default)} | {p.help.replace('|', chr(92) + '|')} |"
        yield ""


def _kind(parameter: Parameter) -> str:
    if parameter.choices:
        return ", ".join(f"{n} {choice}" for n, choice in enumerate(parameter.choices))
    limits = (
        f" {parameter.low:g} to {parameter.high:g}" if parameter.low is not None and parameter.high is not None else ""
    )
    return {"Boolean": "true or false", "Int": "whole number", "Real": "number", "String": "text"}[
        parameter.kind
    ] + limits


def _shown(value: Value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}" if isinstance(value, float) else str(value) or "(empty)"
