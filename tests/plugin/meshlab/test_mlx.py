"""Filter scripts are read strictly and written as MeshLab writes them."""

from __future__ import annotations

from pathlib import Path

import pytest

from imgquad_core.errors import ScriptError
from imgquad_mesh.meshlab.mlx import Script, ScriptFilter, ScriptParameter, read_script, script_text
from imgquad_mesh.meshlab.names import meshlab_function, nearest
from imgquad_mesh.spec import python_name

EVERY_TYPE = ScriptFilter(
    'A <filter> & "more"',
    (
        ScriptParameter("aBool", "RichBool", True),
        ScriptParameter("anInt", "RichInt", -7),
        ScriptParameter("aFloat", "RichFloat", 0.1 + 0.2),
        ScriptParameter("aString", "RichString", 'a "b" < c & d\'é'),
        ScriptParameter("aLength", "RichAbsPerc", 1e-17, low=0.0, high=3.25),
        ScriptParameter("aBounded", "RichDynamicFloat", 360.0, low=-360.0, high=360.0),
        ScriptParameter("anEnum", "RichEnum", 2, choices=("x axis", "y", "z & w")),
        ScriptParameter("aColor", "RichColor", (0, 255, 3, 4)),
        ScriptParameter("aPosition", "RichPosition", (1.5, -2.0, 1e300)),
        ScriptParameter("aDirection", "RichDirection", (0.0, 0.0, 1.0)),
        ScriptParameter("aPoint", "RichPoint3f", (0.0, 0.0, 1.0)),
        ScriptParameter("aMatrix", "RichMatrix44f", tuple(float(i) / 3 for i in range(16))),
        ScriptParameter("aMesh", "RichMesh", 3),
        ScriptParameter("anOpened", "RichOpenFile", "a.ply"),
        ScriptParameter("aSaved", "RichSaveFile", "b.ply"),
        ScriptParameter("aCamera", "RichShotf", None),
    ),
)


def without_lines(script: Script) -> list[tuple[str, list[tuple[object, ...]]]]:
    return [
        (f.name, [(p.name, p.kind, p.value, p.choices, p.low, p.high) for p in f.parameters]) for f in script.filters
    ]


def test_every_type_is_written_and_read_back_to_the_bit(tmp_path: Path) -> None:
    script = Script((EVERY_TYPE, ScriptFilter("Bare")))
    (tmp_path / "s.mlx").write_text(script_text(script), encoding="utf-8")
    assert without_lines(read_script(tmp_path / "s.mlx")) == without_lines(script)


def test_script_has_meshlabs_form() -> None:
    lines = script_text(Script((EVERY_TYPE, ScriptFilter("Bare")))).splitlines()
    assert lines[:2] == ["<!DOCTYPE FilterScript>", "<FilterScript>"]
    assert lines[2].startswith(" <filter name=")
    assert lines[3].startswith("  <Param ")
    assert lines[-2:] == [' <filter name="Bare"/>', "</FilterScript>"]


def test_attributes_stand_in_any_order_and_unknown_ones_are_ignored(tmp_path: Path) -> None:
    text = """<?xml version="1.0"?>
<!DOCTYPE FilterScript>
<FilterScript><!-- a comment -->
 <filter name="Transform: Rotate">
  <Param enum_val3="custom" value="2" enum_val1="Y" tooltip="&lt;b>which&lt;/b>" name="rotAxis" enum_val2="Z"
         isxmlparam="0" type="RichEnum" enum_cardinality="4" enum_val0="X" description="axis"/>
  <Param max="360" value="30" name="angle" min="-360" type="RichDynamicFloat"/>
 </filter>
</FilterScript>"""
    (tmp_path / "s.mlx").write_text(text)
    (each,) = read_script(tmp_path / "s.mlx").filters
    assert (each.name, each.line) == ("Transform: Rotate", 4)
    axis, angle = each.parameters
    assert (axis.value, axis.choices, axis.line) == (2, ("X", "Y", "Z", "custom"), 5)
    assert (angle.value, angle.low, angle.high, angle.line) == (30.0, -360.0, 360.0, 7)


def test_open_file_needs_its_extensions(tmp_path: Path) -> None:
    text = (
        '<FilterScript><filter name="F"><Param name="f" type="RichOpenFile" value="a.ply" {}/></filter></FilterScript>'
    )
    (tmp_path / "good.mlx").write_text(text.format('exts_cardinality="1" ext_val0="*.ply"'))
    assert read_script(tmp_path / "good.mlx").filters[0].parameters[0].value == "a.ply"
    (tmp_path / "bad.mlx").write_text(text.format(""))
    with pytest.raises(ScriptError, match="exts_cardinality"):
        read_script(tmp_path / "bad.mlx")


def test_missing_script_is_named(tmp_path: Path) -> None:
    with pytest.raises(ScriptError, match=r"nothing\.mlx.*cannot be read"):
        read_script(tmp_path / "nothing.mlx")


@pytest.mark.parametrize(
    ("display", "python"),
    [
        ("Subdivision Surfaces: Loop", "subdivision_surfaces_loop"),
        (
            "Transfer: Vertex Attributes to Texture (1 or 2 meshes)",
            "transfer_vertex_attributes_to_texture_1_or_2_meshes",
        ),
        ("Re-Orient all faces coherently", "re_orient_all_faces_coherently"),
        ("stepSmoothNum", "stepsmoothnum"),
        ("lambda", "lambda_"),
        ("Parameterization + texturing", "parameterization__texturing"),
    ],
)
def test_python_names_follow_meshlabs_rule(display: str, python: str) -> None:
    assert python_name(display) == python


def test_names_that_keys_txt_has_wrong_are_set_right() -> None:
    known = ["compute_scalar_ambient_occlusion", "compute_scalar_ambient_occlusion_gpu", "generate_alpha_wrap"]
    assert meshlab_function("Ambient Occlusion", known) == "compute_scalar_ambient_occlusion_gpu"
    assert meshlab_function("Compute Ambient occlusion", known) == "compute_scalar_ambient_occlusion"
    assert meshlab_function("Alpha Wrap", known) == "generate_alpha_wrap"
    assert meshlab_function("generate_alpha_wrap", known) == "generate_alpha_wrap"
    assert meshlab_function("Alpha Wrap", []) is None


def test_nearest_name_is_suggested_and_a_far_one_is_not() -> None:
    assert (
        nearest("Image to Quat Mesh", ["Image to Quad Mesh", "Image: Crop"]) == "; did you mean 'Image to Quad Mesh'?"
    )
    assert nearest("zzz", ["Image to Quad Mesh"]) == ""
