"""What the page shows as command, Python and script does the same, to the byte."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from imgquad_core import MeshOptions
from imgquad_core.errors import InputError
from imgquad_mesh.__main__ import build_parser, main
from imgquad_mesh.cli.mesh_options import mesh_options
from imgquad_mesh.meshlab.script import run_script
from imgquad_mesh.studio.recipe import recipe_of, safe_name

PLAIN = {"picture": "rock.png", "options": {"size": 6, "min_pixels": 12, "min_length": 6}, "output": {}}
MANY: dict[str, Any] = {
    "picture": "rock.png",
    "options": {
        "size": 7.5,
        "effort": "fast",
        "min_pixels": 12,
        "min_length": 6.5,
        "merge": [[["material 0", "material 1"], "material 0"]],
        "rename": {"material 0": "the, 'ground'", "material 2": "mica"},
        "recolor": {"mica": "#ff8000"},
        "drop": ["material 5"],
        "material_sizes": {"mica": 5},
        "growth": 1.5,
        "crop": "3,5,150,120",
        "pixel_size": "0.5",
        "periodic": "x",
    },
    "output": {
        "extension": ".inp",
        "elements": {"order": 2},
        "deck": "tension",
        "analysis": "plane strain",
        "properties": '["*"]\nyoung = 2.0\npoisson = 0.3\n',
    },
}
VTU = {**MANY, "output": {"extension": ".vtu"}}


@pytest.mark.parametrize("values", [PLAIN, MANY, VTU], ids=["plain", "many", "vtu"])
def test_command_python_and_script_write_the_same_file(
    values: dict[str, Any], rock: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = recipe_of(values)
    places = {name: tmp_path / name for name in ("command", "python", "script")}
    for place in places.values():
        place.mkdir()
        (place / "rock.png").write_bytes(rock.read_bytes())
        (place / "properties.toml").write_text(recipe.output.properties)
    words = shlex.split(recipe.texts["command"])
    monkeypatch.chdir(places["command"])
    assert words[0] == "imgquad-mesh"
    assert main([*words[1:], "--quiet"]) == 0
    (places["script"] / "rock.mlx").write_text(recipe.texts["script"])
    monkeypatch.chdir(places["script"])
    run_script("rock.mlx", image="rock.png")
    subprocess.run([sys.executable, "-c", recipe.texts["python"]], cwd=places["python"], check=True)
    wanted = (places["command"] / recipe.file).read_bytes()
    assert len(wanted) > 1000
    assert (places["script"] / recipe.file).read_bytes() == wanted
    assert (places["python"] / recipe.file).read_bytes() == wanted


def test_command_means_what_was_clicked() -> None:
    recipe = recipe_of(MANY)
    words = shlex.split(recipe.texts["command"])
    assert mesh_options(build_parser().parse_args(words[1:])) == recipe.options
    assert recipe.options.rename == {"material 0": "the, 'ground'", "material 2": "mica"}


def test_marks_are_a_file_beside_the_picture() -> None:
    recipe = recipe_of({"picture": "a.tif", "options": {}, "marks": True, "learn": True})
    assert (recipe.options.marks, recipe.options.learn) == ("marks.png", True)
    assert "--marks marks.png --learn" in recipe.texts["command"]
    assert "marks='marks.png'" in recipe.texts["python"]


@pytest.mark.parametrize(
    "values",
    [
        None,
        [],
        {"options": 3},
        {"options": {"sizes": 3}},
        {"options": {"marks": "/etc/passwd"}},
        {"options": {"max_pixels": 10**12}},
        {"options": {"threads": 500}},
        {"options": {"size": "x"}},
        {"options": {"size": None}},
        {"options": {"merge": 3}},
        {"options": {"merge": [[1, 2, 3]]}},
        {"options": {"merge": [[[["a"]], "b"]]}},
        {"options": {"recolor": {"a": "red"}}},
        {"options": {"recolor": 7}},
        {"options": {"colors": "many"}},
        {"options": {"crop": "1,2,3"}},
        {"output": {"extension": "/../../x"}},
        {"output": {"extension": ".sh; rm"}},
        {"output": {"elements": {"order": 3}}},
        {"output": {"elements": {"plain": True}}},
        {"output": {"elements": []}},
    ],
)
def test_what_is_no_recipe_is_one_input_error(values: Any) -> None:
    with pytest.raises(InputError) as caught:
        recipe_of(values)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "safe"),
    [
        ("rock.png", "rock.png"),
        ("../../etc/pa sswd<b>.png", "pa_sswd_b_.png"),
        ("C:\\x\\y.tif", "y.tif"),
        ("..", "picture"),
        ("", "picture"),
        ("--help", "help"),
        ("ü" * 90 + ".png", "_.png"),
        ("a" * 90 + ".png", "a" * 56 + ".png"),
    ],
)
def test_names_are_harmless(name: str, safe: str) -> None:
    assert safe_name(name) == safe


def test_defaults_are_said_by_nothing() -> None:
    recipe = recipe_of({"picture": "rock.png"})
    assert recipe.options == MeshOptions()
    assert recipe.texts["command"] == "imgquad-mesh run rock.png rock.vtu"
