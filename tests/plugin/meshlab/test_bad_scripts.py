"""Bad scripts are refused whole before anything runs; filters that hang, crash or take all memory are survived."""

from __future__ import annotations

import importlib.util
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from imgquad_core.errors import InputError, ScriptError
from imgquad_core.pipeline import mesh_image
from imgquad_mesh.meshlab import pymeshlab_filters
from imgquad_mesh.meshlab.layer import write_ply
from imgquad_mesh.meshlab.meshsets import quad_layer
from imgquad_mesh.meshlab.process import MeshLabError, MeshLabProcess
from imgquad_mesh.meshlab.script import run_script
from support.bad_scripts import BAD_ELEMENTS, BAD_FILES, BAD_MESHLAB, FAILING, MESH, filter_xml
from support.scripts import LABELS, needs_meshlab, script_file


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:
    """Let the kernels be compiled before times are taken."""
    mesh_image(LABELS)


def assert_refused(path: Path, message: str, seconds: float) -> None:
    """A ScriptError of this message, in time, and nothing written."""
    before, start = {p: p.read_bytes() for p in path.parent.iterdir()}, time.monotonic()
    with pytest.raises(ScriptError, match=message) as raised:
        run_script(path, image=LABELS, output=path.parent / "out.obj", deadline=2.0)
    assert time.monotonic() - start < seconds
    assert raised.value.file == str(path)
    assert {p: p.read_bytes() for p in path.parent.iterdir()} == before


def test_corpus_has_forty_cases() -> None:
    assert len(BAD_FILES) + len(BAD_ELEMENTS) + len(BAD_MESHLAB) + len(FAILING) >= 40


@pytest.mark.parametrize("case", BAD_FILES)
def test_file_that_is_no_script_is_refused(case: str, tmp_path: Path) -> None:
    data, message = BAD_FILES[case]
    (tmp_path / "bad.mlx").write_bytes(data)
    message = {"entities": "declares|entities"}.get(message, message)
    assert_refused(tmp_path / "bad.mlx", message, 5.0)


@pytest.mark.parametrize("case", BAD_ELEMENTS)
def test_bad_script_is_refused(case: str, tmp_path: Path) -> None:
    elements, message = BAD_ELEMENTS[case]
    assert_refused(script_file(tmp_path, elements), message, 30.0)


@needs_meshlab
@pytest.mark.parametrize("case", BAD_MESHLAB)
def test_bad_script_for_meshlab_is_refused(case: str, tmp_path: Path) -> None:
    elements, message = BAD_MESHLAB[case]
    assert_refused(script_file(tmp_path, elements), message, 10.0)


@needs_meshlab
@pytest.mark.parametrize("case", FAILING)
def test_last_good_mesh_survives_a_filter_that_fails(case: str, tmp_path: Path) -> None:
    elements, message = FAILING[case]
    smoothed = filter_xml("Laplacian Smooth", 'name="stepSmoothNum" type="RichInt" value="1"')
    path = script_file(tmp_path, MESH, smoothed, elements)
    start = time.monotonic()
    with pytest.raises(ScriptError, match=message) as raised:
        run_script(path, image=LABELS, output=tmp_path / "out.obj", deadline=2.0)
    assert time.monotonic() - start < 30.0
    assert raised.value.line == 5
    assert {p.name for p in tmp_path.iterdir()} == {"script.mlx", "out.last_good.ply"}
    expected = run_script(script_file(tmp_path, MESH, smoothed), image=LABELS).current
    assert expected is not None
    write_ply(expected, tmp_path / "expected.ply")
    assert (tmp_path / "out.last_good.ply").read_bytes() == (tmp_path / "expected.ply").read_bytes()


@needs_meshlab
@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
def test_a_filter_that_takes_all_memory_is_stopped_at_its_limit(tmp_path: Path) -> None:
    finest = '<Param type="RichInt" name="Iterations" value="12"/>'
    finest += '<Param type="RichAbsPerc" name="Threshold" value="0.0001" min="0" max="100"/>'
    triangles = '<filter name="Turn into a Pure-Triangular mesh"/>'
    halves = f'<filter name="Subdivision Surfaces: Midpoint">{finest}</filter>'  # faces fourfold, twelve times
    path = script_file(tmp_path, MESH, triangles, halves)
    with pytest.raises(ScriptError, match=r"Midpoint': needed more than 2 GB .* the mesh before it is in"):
        run_script(path, image=LABELS, output=tmp_path / "out.obj", memory=2.0)
    assert (tmp_path / "out.last_good.ply").stat().st_size > 0


@needs_meshlab
def test_a_filter_is_stopped_when_its_deadline_is_over(tmp_path: Path) -> None:
    mesh = mesh_image(LABELS)
    with MeshLabProcess(tmp_path, deadline=1.5) as process:
        process.add(quad_layer(mesh))
        start = time.monotonic()
        with pytest.raises(MeshLabError, match=r"did not end within 1\.5 s"):
            process.apply("meshing_surface_subdivision_doo_sabin")  # it never ends on quads
        assert 1.5 <= time.monotonic() - start < 6.0


def test_wrong_deadline_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="deadline is 0"):
        run_script(script_file(tmp_path, MESH), image=LABELS, deadline=0.0)


def test_missing_picture_is_named(tmp_path: Path) -> None:
    with pytest.raises(ScriptError, match=r"script\.mlx:3.*no picture"):
        run_script(script_file(tmp_path, MESH))


# ---------------------------------------------------------------------------------------------- pymeshlab is not whole


@pytest.fixture
def asked_anew() -> Any:
    names = ("_asking", "answer", "meshlab_filters", "meshlab_parameters")
    asked = [getattr(pymeshlab_filters, name) for name in names]
    for function in asked:
        function.cache_clear()
    yield
    for function in asked:
        function.cache_clear()


HALF = "def filter_list(): return ['create_cube'] * 235\ndef print_filter_parameter_list(*_): pass"


@pytest.mark.usefixtures("asked_anew")
@pytest.mark.parametrize(
    ("script", "asks"),
    [(MESH, 0), (MESH + filter_xml("Laplacian Smooth"), 1), ("no script <filter name=", 0)],
)
def test_pymeshlab_is_asked_early_where_a_script_needs_it(script: str, asks: int, tmp_path: Path) -> None:
    path = tmp_path / "script.mlx"
    path.write_text(script, encoding="utf-8")
    pymeshlab_filters.ask_early(path)
    pymeshlab_filters.ask_early(tmp_path / "none.mlx")
    assert pymeshlab_filters._asking.cache_info().currsize == asks


@pytest.mark.usefixtures("asked_anew")
@pytest.mark.parametrize(
    ("module", "message"),
    [
        (HALF, r"235 filters.*libgl1 libopengl0"),
        ("raise ImportError('libGL.so.1: cannot open shared object file')", r"libGL\.so\.1.*libgl1 libopengl0"),
    ],
)
def test_half_loaded_pymeshlab_names_the_packages(
    module: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "elsewhere" / "pymeshlab"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(module)
    monkeypatch.setenv("PYTHONPATH", str(package.parent))
    monkeypatch.setattr(pymeshlab_filters, "pymeshlab_folder", lambda: package)
    with pytest.raises(ScriptError, match=message):
        run_script(script_file(tmp_path, MESH, filter_xml("Laplacian Smooth")), image=LABELS)


@pytest.mark.usefixtures("asked_anew")
def test_missing_pymeshlab_is_named_with_the_nearest_filter_of_ours(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ScriptError, match=r"pip install 'imgquad-mesh\[meshlab\]'"):
        run_script(script_file(tmp_path, filter_xml("Laplacian Smooth")), image=LABELS)
    with pytest.raises(ScriptError, match="did you mean 'Image to Quad Mesh'"):
        run_script(script_file(tmp_path, filter_xml("Image to Quat Mesh")), image=LABELS)
