"""filters.xml is the one truth: valid in MeshLab's vocabulary, and nothing else says anything different."""

from __future__ import annotations

import argparse
import inspect
import re
import subprocess
import sys
import zipfile
from dataclasses import MISSING, dataclass, field, fields, make_dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from imgquad_core.declared import declarations
from imgquad_core.errors import InputError
from imgquad_mesh.meshlab.own_filters import STEPS
from imgquad_mesh.spec import Filter, filters, filters_file, find_filter, python_name, read_filters
from imgquad_mesh.texts import TEXTS, help_in_scripts, options_from, values_of
from support import ROOT

XML = (ROOT / "filters.xml").read_text(encoding="utf-8")

#: first words of the names of pymeshlab's 281 filters
VERBS = (
    "apply",
    "compute",
    "create",
    "delete",
    "export",
    "generate",
    "get",
    "load",
    "meshing",
    "save",
    "set",
    "transfer",
)


def is_valid(text: str) -> bool:
    etree = pytest.importorskip("lxml.etree")
    schema = etree.XMLSchema(etree.parse(str(ROOT / "tests/plugin/filters.xsd")))
    return bool(schema.validate(etree.fromstring(text.encode())))


def test_filters_file_is_valid_in_meshlabs_vocabulary() -> None:
    assert is_valid(XML)


@pytest.mark.parametrize(
    ("was", "is_now"),
    [
        ('mfiVersion="2.0"', 'mfiVersion="2.1"'),
        (' filterArity="Fixed"', ""),
        ('filterArity="Fixed"', 'filterArity="Many"'),
        (' parIsPersistent="false"', ""),
        ("<PARAM parName", "<PARAM unit='px' parName"),
        ("<FILTER filterName", "<FILTER imgquad='1' filterName"),
        ('parType="Boolean"', 'parType="Bool"'),
        ("CHECKBOX_GUI", "TICK_GUI"),
        (' guiMax="10"', ""),
        ('filterClass="RasterLayer"', 'filterClass="Raster"'),
        ('filterPre="MM_NONE"', 'filterPre="nothing"'),
        ('filterFunction="delete_material_from_image"', 'filterFunction="generate_quad_mesh_from_image"'),
        ('filterName="Image: Crop"', 'filterName="Boundary: Smooth"'),
    ],
)
def test_schema_refuses_what_meshlabs_vocabulary_does_not_know(was: str, is_now: str) -> None:
    assert was in XML
    assert not is_valid(XML.replace(was, is_now))


def test_names_are_in_meshlabs_grammar() -> None:
    for spec in filters().values():
        assert spec.function.split("_")[0] in VERBS
        assert spec.function == python_name(spec.function)
        assert re.fullmatch(r"[A-Z][a-z]+( [A-Za-z]+)*(: [A-Z][a-z]+( [A-Za-z]+)*)?", spec.name)
        assert len({p.python_name for p in spec.parameters}) == len(spec.parameters)
        for p in spec.parameters:
            assert re.fullmatch(r"[a-z][A-Za-z]*", p.name)
            assert find_filter(p.name) is None


def test_help_says_something() -> None:
    for spec in filters().values():
        assert len(spec.help) > 60 or spec.function.startswith("export")
        assert spec.help.endswith(".")
        for p in spec.parameters:
            assert len(p.help) > 20, (spec.name, p.name)
            assert p.help.endswith("."), (spec.name, p.name)


def differences(spec: Filter, options: Any) -> list[str]:
    """What filters.xml and the options of a stage say differently, told from both sides."""
    ours = {f.name: f for f in fields(options) if not f.metadata.get("internal")}
    there = {p.field: p for p in spec.parameters}
    found = [f"{name} is in the options only" for name in ours.keys() - there.keys()]
    found += [f"{name} is in filters.xml only" for name in there.keys() - ours.keys()]
    for name in sorted(ours.keys() & there.keys()):
        f = ours[name]
        default = f.default if f.default is not MISSING else f.default_factory()  # type: ignore[misc]
        as_text = there[name].kind == "String" and name in TEXTS
        value = TEXTS[name].write(default) if as_text else default
        if type(value) is not type(there[name].default) or value != there[name].default:
            found.append(f"{name} is {value!r} in the options, {there[name].default!r} in filters.xml")
    return found


def test_every_filter_has_a_step_and_every_step_a_filter() -> None:
    assert list(STEPS) == list(filters())


@pytest.mark.parametrize("function", STEPS)
def test_parameters_and_defaults_are_those_of_the_options(function: str) -> None:
    assert differences(filters()[function], STEPS[function].options) == []


def said_differently(spec: Filter, options: Any) -> list[str]:
    """What filters.xml and a declaration say differently of kind, limits, choices and help."""
    found = []
    for p in spec.parameters:
        declared = declarations(options)[p.field]
        in_range = declared.least is not None and declared.most is not None
        kind = {bool: "Boolean", int: "Int", float: "Real"}.get(declared.kind, "String")
        if p.field in TEXTS and p.kind == "String":
            kind = "String"
        elif declared.choices and isinstance(declared.choices[0], str):
            kind = "Enum"
        should = {
            "kind": kind,
            "choices": declared.choices if kind == "Enum" else (),
            "low": declared.least if in_range and p.kind != "String" else None,
            "high": declared.most if in_range and p.kind != "String" else None,
            "help": help_in_scripts(p.field, declared),
        }
        found += [f"{p.name}: {key} should be {value!r}" for key, value in should.items() if getattr(p, key) != value]
    return found


@pytest.mark.parametrize("function", STEPS)
def test_kinds_limits_and_help_are_those_declared(function: str) -> None:
    assert said_differently(filters()[function], STEPS[function].options) == []


@pytest.mark.parametrize(
    ("was", "is_now", "found"),
    [
        ('guiMin="1.01" guiMax="10"', 'guiMin="1.01" guiMax="9"', "growth: high should be 10.0"),
        ("{fast: 0 | normal: 1 | best: 2}", "{fast: 0 | normal: 1}", "effort: choices should be"),
        ("Length of the final edges, in pixels.", "Length of edges in px, at the end.", "size: help should be"),
        ('"threads" parType="Int"', '"threads" parType="Real"', "threads: kind should be 'Int'"),
    ],
)
def test_a_limit_changed_in_filters_xml_only_is_found(tmp_path: Path, was: str, is_now: str, found: str) -> None:
    assert was in XML
    (tmp_path / "filters.xml").write_text(XML.replace(was, is_now), encoding="utf-8")
    changed = read_filters(tmp_path / "filters.xml")["generate_quad_mesh_from_image"]
    differences = said_differently(changed, STEPS["generate_quad_mesh_from_image"].options)
    assert any(each.startswith(found) for each in differences), differences


def test_a_default_changed_in_filters_xml_only_is_found(tmp_path: Path) -> None:
    for was, is_now, name in [
        ('"maxShift" parType="Real" parDefault="1"', '"maxShift" parType="Real" parDefault="1.5"', "max_shift"),
        (
            'parName="boundarySize" parType="String" parDefault="\'auto\'"',
            'parName="boundarySize" parType="String" parDefault="\'2\'"',
            "boundary_size",
        ),
        (
            '"dropTransparent" parType="Boolean" parDefault="false"',
            '"dropTransparent" parType="Boolean" parDefault="true"',
            "drop_transparent",
        ),
    ]:
        assert was in XML
        (tmp_path / "filters.xml").write_text(XML.replace(was, is_now), encoding="utf-8")
        changed = read_filters(tmp_path / "filters.xml")
        found = differences(changed["generate_quad_mesh_from_image"], STEPS["generate_quad_mesh_from_image"].options)
        assert len(found) == 1
        assert found[0].startswith(name)


def test_a_default_changed_in_the_options_only_is_found() -> None:
    spec, options = filters()["generate_quad_mesh_from_image"], STEPS["generate_quad_mesh_from_image"].options
    for name, value in (("growth", 1.4), ("effort", "best"), ("boundary_size", 2.0), ("threads", 2)):
        changed = make_dataclass("Changed", [(name, Any, field(default=value))], bases=(options,), frozen=True)
        found = differences(spec, changed)
        assert len(found) == 1
        assert found[0].startswith(name)


def test_an_option_on_one_side_only_is_found() -> None:
    @dataclass(frozen=True)
    class Less:
        min_pixels: int = 0
        policy: str = "minority"

    spec = filters()["apply_label_noise_removal_per_pixel"]
    assert differences(spec, Less) == ["min_length is in filters.xml only"]
    options = STEPS["apply_label_noise_removal_per_pixel"].options
    more = make_dataclass("More", [("colour", str, field(default="red"))], bases=(options,), frozen=True)
    assert differences(spec, more) == ["colour is in the options only"]


@pytest.mark.parametrize("function", STEPS)
def test_limits_and_choices_are_those_of_the_options(function: str) -> None:
    spec, options = filters()[function], STEPS[function].options
    for p in spec.parameters:
        for value in (*p.choices, p.low, p.high):
            if value is not None and (value != "triangle" or find_spec("triangle")):
                options_from(options, spec, {p.field: value})
        for beyond in [p.low - 1e-6, p.high + 1e-6] if p.low is not None and p.high is not None else []:
            with pytest.raises(InputError):
                options(**{p.field: beyond})
            with pytest.raises(InputError, match=p.name):
                p.checked(beyond)
        if p.choices and function != "compute_scalar_by_quad_quality_per_face":
            with pytest.raises(InputError):
                options(**{p.field: "bogus"})


def test_texts_are_read_and_written_back() -> None:
    spec, options = filters()["generate_quad_mesh_from_image"], STEPS["generate_quad_mesh_from_image"].options
    values = {
        "colors": "#ff0000,#00ff0a",
        "min_pixels": "12",
        "min_length": "7.25",
        "boundary_size": "1.3",
        "material_sizes": 'quartz=2.5,"a, b=1"',
        "merge": '"quartz,feldspar=hard","""a, b"",1=soft"',
        "rename": '7=mica,"8=a, b"',
        "recolor": "mica=#ff8000",
        "drop": 'pore,"a, b"',
        "crop": "1,2,30,40",
    }
    made = options_from(options, spec, values)
    assert made.colors == ((255, 0, 0), (0, 255, 10))
    assert (made.min_pixels, made.min_length, made.boundary_size) == (12, 7.25, 1.3)
    assert made.merge == {("quartz", "feldspar"): "hard", ("a, b", "1"): "soft"}
    assert made.rename == {"7": "mica", "8": "a, b"}
    assert made.recolor == {"mica": (255, 128, 0)}
    assert made.material_sizes == {"quartz": 2.5, "a, b": 1.0}
    assert (made.drop, made.crop) == (("pore", "a, b"), (1, 2, 30, 40))
    again = options_from(options, spec, values_of(made, spec))
    assert again == made


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("colors", "many"),
        ("min_pixels", "-3"),
        ("min_pixels", "x"),
        ("boundary_size", "wide"),
        ("boundary_size", "-1"),
        ("material_sizes", "quartz"),
        ("material_sizes", "quartz=x"),
        ("crop", "1,2,3"),
        ("size", 0.0),
        ("size", -1.0),
    ],
)
def test_texts_and_values_that_mean_nothing_are_refused(name: str, value: Any) -> None:
    spec, options = filters()["generate_quad_mesh_from_image"], STEPS["generate_quad_mesh_from_image"].options
    with pytest.raises(InputError):
        options_from(options, spec, {name: value})


def run_parser() -> argparse.ArgumentParser:
    from imgquad_mesh.__main__ import build_parser

    chosen = next(a for a in build_parser()._actions if isinstance(a, argparse._SubParsersAction))
    return chosen.choices["run"]


def test_command_has_an_option_for_each_parameter_and_tells_its_default() -> None:
    options = {a.dest: a for a in run_parser()._actions}
    for p in filters()["generate_quad_mesh_from_image"].parameters:
        action = options[p.field]
        assert action.default is None, "the default is that of MeshOptions, in one place"
        if p.choices and action.choices:
            assert tuple(action.choices) == p.choices
        told = re.search(r"\(default: ([0-9.]+|[a-z]+)\b", action.help or "")
        if told and told[1] not in ("as", "100"):
            assert told[1] in (str(p.default), f"{p.default:g}" if isinstance(p.default, float) else "")


def test_command_has_no_mesh_option_that_filters_xml_does_not_know() -> None:
    known = {p.field for p in filters()["generate_quad_mesh_from_image"].parameters}
    groups = {g.title: g for g in run_parser()._action_groups}
    for title in ("picture", "noise", "boundaries", "mesh"):
        assert {a.dest for a in groups[title]._group_actions} <= known


def test_accessor_has_the_same_parameters_and_defaults() -> None:
    from imgquad_mesh.accessor import ImageAccessor

    spec = filters()["generate_quad_mesh_from_image"]
    signature = inspect.signature(ImageAccessor.mesh).parameters
    shared = [name for name in signature if spec.parameter(name)]
    assert set(signature) - set(shared) <= {"self", "scalars", "progress_bar", "unit", "sample", "max_pixels"}
    assert len(shared) >= 12
    for name in shared:
        p = spec.parameter(name)
        assert p is not None
        default = signature[name].default
        as_text = p.kind == "String" and name in TEXTS
        assert (TEXTS[name].write(default) if as_text else default) == p.default, name


def test_wheel_has_filters_xml(tmp_path: Path) -> None:
    pytest.importorskip("hatchling")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True, timeout=120)
    with zipfile.ZipFile(next(tmp_path.glob("*.whl"))) as wheel:
        assert wheel.read("imgquad_mesh/filters.xml") == (ROOT / "filters.xml").read_bytes()
        page = ROOT / "plugin/imgquad_mesh/studio/www"
        for file in page.iterdir():
            assert wheel.read(f"imgquad_mesh/studio/www/{file.name}") == file.read_bytes()


def test_filters_are_found_in_a_checkout() -> None:
    assert filters_file().samefile(ROOT / "filters.xml")
