"""Filter scripts of ours, of MeshLab's filters, and of both mixed; the command that runs them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from imgquad_core.errors import ScriptError
from imgquad_core.options import MeshOptions
from imgquad_core.pipeline import mesh_image
from imgquad_mesh.meshlab.checking import MeshLabStep, checked_steps
from imgquad_mesh.meshlab.layer import Layer, write_ply
from imgquad_mesh.meshlab.mlx import Script, read_script, script_text
from imgquad_mesh.meshlab.names import meshlab_function
from imgquad_mesh.meshlab.pymeshlab_filters import meshlab_filters, meshlab_parameters
from imgquad_mesh.meshlab.script import run_script
from imgquad_mesh.meshlab.templates import filter_script, named_filters, run_as_script
from imgquad_mesh.spec import filters, python_name
from support import ROOT
from support.bad_scripts import MESH, filter_xml
from support.scripts import LABELS, needs_meshlab, script_file

IMAGES = ROOT.parent / "shared" / "images"


def run_peer(*arguments: object) -> None:
    command = [sys.executable, str(ROOT / "tests/support/meshlab_peer.py"), *map(str, arguments)]
    subprocess.run(command, check=True, timeout=120, capture_output=True)


# ---------------------------------------------------------------------------------------------- scripts of ours only


def test_stages_one_by_one_give_the_mesh_of_the_whole_way(tmp_path: Path) -> None:
    stages = [
        "Image: Label by Color",
        "Image: Remove Label Noise",
        "Image: Extract Material Boundaries",
        "Boundary: Smooth",
        "Quad Mesh: From Material Boundaries",
    ]
    values = {
        "apply_label_noise_removal_per_pixel": {"min_pixels": 4, "min_length": 5.0},
        "apply_coord_material_boundary_smoothing": {"size": 3.0},
        "generate_quad_mesh_from_material_boundaries": {"size": 3.0},
    }
    (tmp_path / "s.mlx").write_text(filter_script(named_filters(stages), values))
    result = run_script(tmp_path / "s.mlx", image=LABELS)
    whole = mesh_image(LABELS, MeshOptions(size=3.0, min_pixels=4, min_length=5.0))
    assert result.mesh is not None
    assert np.array_equal(result.mesh.points, whole.points)
    assert np.array_equal(result.mesh.quads, whole.quads)
    assert np.array_equal(result.mesh.quad_material, whole.quad_material)
    assert [s.program for s in result.steps] == ["imgquad-mesh"] * 5
    assert result.values("apply_label_noise_removal_per_pixel") == {"removed_clusters": 1, "removed_pixels": 2}


def test_stages_that_a_script_leaves_out_run_with_their_defaults(tmp_path: Path) -> None:
    path = script_file(
        tmp_path, filter_xml("Quad Mesh: From Material Boundaries", 'name="size" type="RichFloat" value="5"')
    )
    result = run_script(path, image=LABELS)
    whole = mesh_image(LABELS, MeshOptions(size=5.0))
    assert result.mesh is not None
    assert np.array_equal(result.mesh.points, whole.points)


@pytest.mark.parametrize(
    "options",
    [
        MeshOptions(size=3.0),
        MeshOptions(size=2.5 + 1e-13, growth=1.1 + 0.2, min_pixels=3, min_length=3.3, effort="fast", pixel_size=0.1),
        MeshOptions(material_sizes={"3": 1.7, "0": 3.5}, boundary_size=2.1, drop=("5",), crop=(1, 1, 28, 20)),
        MeshOptions(
            merge={("0", "3"): "a, b"}, rename={5: 'the "c"'}, recolor={"a, b": (1, 2, 255)}, drop=('the "c"',)
        ),
    ],
)
def test_run_saved_as_script_gives_the_same_mesh_to_the_bit(options: MeshOptions, tmp_path: Path) -> None:
    (tmp_path / "run.mlx").write_text(run_as_script(options))
    result = run_script(tmp_path / "run.mlx", image=LABELS)
    direct = mesh_image(LABELS, options)
    assert result.mesh is not None
    for name in ("points", "quads", "quad_region", "region_label", "chain_points"):
        assert getattr(result.mesh, name).tobytes() == getattr(direct, name).tobytes()


def test_materials_are_cropped_dropped_and_sized_by_name(tmp_path: Path) -> None:
    path = script_file(
        tmp_path,
        filter_xml("Image: Crop", 'name="crop" type="RichString" value="0,4,24,24"'),
        filter_xml("Image: Drop Materials", 'name="drop" type="RichString" value="material 3"'),
        filter_xml("Boundary: Smooth", 'name="materialSizes" type="RichString" value="material 0=2"'),
        filter_xml("Quad Mesh: From Material Boundaries", 'name="materialSizes" type="RichString" value="0=2"'),
        filter_xml("Quad Mesh: Extract Boundaries"),
        filter_xml("Compute Material Statistics"),
        filter_xml("Compute Quad Mesh Sets"),
    )
    result = run_script(path, image=LABELS)
    statistics = result.values("get_material_statistics")["materials"]
    assert list(statistics) == ["material 0"]
    assert statistics["material 0"]["area"] == pytest.approx(24 * 20 - 144, rel=1e-3)
    assert statistics["material 0"]["quads_number"] > 60
    assert result.values("get_quad_mesh_sets")["nodes"]
    assert len(result.layers) == 4  # two of boundaries, the mesh, its boundaries
    assert result.mesh is not None
    assert len(result.layers[3].edges) == len(result.mesh.constraints)
    assert result.current is result.layers[2]


def test_materials_are_merged_renamed_and_recoloured(tmp_path: Path) -> None:
    path = script_file(
        tmp_path,
        filter_xml("Image: Merge Materials", 'name="merge" type="RichString" value=\'&quot;0,3=ground&quot;\''),
        filter_xml("Image: Rename Materials", 'name="rename" type="RichString" value="5=disc"'),
        filter_xml("Image: Recolor Materials", 'name="recolor" type="RichString" value="disc=#ff8000"'),
        filter_xml("Quad Mesh: From Material Boundaries"),
    )
    result = run_script(path, image=LABELS)
    assert result.values("apply_material_merge_per_pixel")["materials_number"] == 2
    assert result.mesh is not None
    assert result.mesh.materials.names == ("ground", "disc")
    assert result.mesh.materials.colors[1].tolist() == [255, 128, 0]
    at_once = MeshOptions(merge={(0, 3): "ground"}, rename={5: "disc"}, recolor={"disc": (255, 128, 0)})
    assert np.array_equal(result.mesh.points, mesh_image(LABELS, at_once).points)


def test_files_are_written_beside_the_script(tmp_path: Path) -> None:
    path = script_file(
        tmp_path,
        filter_xml("generate_quad_mesh_from_image"),
        filter_xml("Export Quad Mesh", 'name="fileName" type="RichSaveFile" value="m.inp" ext="*.inp"'),
        filter_xml("Image: Export Labels", 'name="fileName" type="RichString" value="l.npy"'),
    )
    run_script(path, image=LABELS, output=tmp_path / "m.vtu")
    assert {p.name for p in tmp_path.iterdir()} == {"script.mlx", "m.inp", "l.npy", "m.vtu"}
    assert np.array_equal(np.load(tmp_path / "l.npy"), LABELS)


def test_scripts_of_ours_run_without_pymeshlab(tmp_path: Path) -> None:
    path = script_file(tmp_path, filter_xml("generate_quad_mesh_from_image"), filter_xml("get_quad_quality_measures"))
    np.save(tmp_path / "labels.npy", LABELS)
    code = (
        "import sys; sys.modules['pymeshlab'] = None\n"
        "from imgquad_mesh.meshlab.script import run_script\n"
        f"result = run_script({str(path)!r}, image={str(tmp_path / 'labels.npy')!r})\n"
        "assert result.values('get_quad_quality_measures')['min_sj'] > 0\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=600)


# --------------------------------------------------------------------------------------------------- MeshLab's filters


@pytest.fixture(scope="module")
def scripts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A script of each of pymeshlab's filters with its defaults, written by pymeshlab."""
    if not hasattr(os, "fork"):
        pytest.skip("the scripts are written in forked processes")
    folder = tmp_path_factory.mktemp("scripts")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "plugin")])}
    environment |= {"OMP_NUM_THREADS": "1"}  # threads of OpenMP in forked processes wait for each other at times
    command = [sys.executable, str(ROOT / "tests/support/meshlab_scripts.py"), str(folder)]
    subprocess.run(command, check=True, timeout=400, capture_output=True, env=environment)
    return folder


@needs_meshlab
def test_script_of_each_filter_resolves_to_the_right_python_name(scripts: Path, tmp_path: Path) -> None:
    wrong = {}
    parameters = 0
    meshlab_parameters(frozenset(meshlab_filters()))
    read = [(name, read_script(scripts / f"{name}.mlx")) for name in meshlab_filters()]
    steps = checked_steps(Script(tuple(s.filters[0] for _, s in read)), scripts)
    for (name, script), step in zip(read, steps, strict=True):
        assert isinstance(step, MeshLabStep)
        known = meshlab_parameters(frozenset(meshlab_filters()))[name]
        given = {python_name(p.name) for p in script.filters[0].parameters}
        parameters += len(given)
        if step.function != name or given != set(known):
            wrong[name] = (step.function, given ^ set(known))
    assert wrong == {}
    assert len(read) >= 281
    assert parameters >= 950


#: filters that need no special input, as each comes after the ones before it on one MeshSet
SAMPLE = [
    "create_sphere",
    "create_cube",
    "create_torus",
    "create_grid",
    "create_icosahedron",
    "create_dodecahedron_sym",
    "create_annulus",
    "create_cone",
    "meshing_invert_face_orientation",
    "meshing_re_orient_faces_coherently",
    "meshing_merge_close_vertices",
    "meshing_remove_duplicate_vertices",
    "meshing_remove_duplicate_faces",
    "meshing_remove_unreferenced_vertices",
    "meshing_remove_null_faces",
    "meshing_repair_non_manifold_edges",
    "meshing_surface_subdivision_loop",
    "meshing_decimation_quadric_edge_collapse",
    "meshing_isotropic_explicit_remeshing",
    "apply_coord_laplacian_smoothing",
    "apply_coord_taubin_smoothing",
    "apply_coord_hc_laplacian_smoothing",
    "compute_normal_per_face",
    "compute_normal_per_vertex",
    "compute_scalar_by_aspect_ratio_per_face",
    "compute_color_from_scalar_per_face",
    "compute_selection_from_mesh_border",
    "compute_selection_by_condition_per_face",
    "apply_selection_inverse",
    "set_selection_none",
    "compute_matrix_from_rotation",
    "compute_matrix_from_translation",
    "compute_matrix_from_scaling_or_normalization",
    "apply_matrix_freeze",
    "get_geometric_measures",
    "get_topological_measures",
    "get_scalar_statistics_per_face",
    "generate_convex_hull",
    "generate_copy_of_current_mesh",
    "generate_by_merging_visible_meshes",
    "compute_color_by_function_per_face",
]


@needs_meshlab
def test_forty_filters_run_with_their_defaults(scripts: Path, tmp_path: Path) -> None:
    assert len(SAMPLE) >= 40
    together = Script(tuple(read_script(scripts / f"{name}.mlx").filters[0] for name in SAMPLE))
    (tmp_path / "sample.mlx").write_text(script_text(together), encoding="utf-8")
    result = run_script(tmp_path / "sample.mlx", deadline=60.0)
    assert [s.function for s in result.steps] == SAMPLE
    assert result.values("get_geometric_measures")["surface_area"] > 0
    assert result.values("get_topological_measures")["is_mesh_two_manifold"] in (True, False)
    assert result.current is not None
    assert result.current.n_faces > 100


@needs_meshlab
def test_value_that_pymeshlab_would_clamp_is_taken_as_meshlabs_scripts_take_it(tmp_path: Path) -> None:
    def moved(filter_name: str, name: str, x: float) -> float:
        value = f'name="{name}" type="RichDynamicFloat" value="{x}" min="-1e6" max="1e6"'
        freeze = (
            'name="Freeze" type="RichBool" value="true"'
            if name == "axisX"
            else 'name="freeze" type="RichBool" value="true"'
        )
        result = run_script(script_file(tmp_path, MESH, filter_xml(filter_name, value, freeze)), image=LABELS)
        assert result.current is not None
        return float(result.current.points[:, 0].min())

    assert moved("Transform: Translate, Center, set Origin", "axisX", 12345.5) == pytest.approx(12345.5)
    assert moved("compute_matrix_from_translation", "axisx", 7.5) == pytest.approx(7.5)
    with pytest.raises(ScriptError, match=r"12345\.5.*clamp"):
        moved("compute_matrix_from_translation", "axisx", 12345.5)
    with pytest.raises(ScriptError, match="does not know the parameter axisx by this name"):
        moved("Transform: Translate, Center, set Origin", "axisx", 12345.5)


# ------------------------------------------------------------------------------------------------------- mixed scripts


def mixed_script(folder: Path, pure: Path, head: str, tail: str) -> Path:
    text = pure.read_text(encoding="utf-8")
    start, end = text.index("<FilterScript>") + len("<FilterScript>"), text.index("</FilterScript>")
    path = folder / "mixed.mlx"
    path.write_text(text[:start] + "\n" + head + text[start:end] + tail + text[end:], encoding="utf-8")
    return path


def check_mixed(image: Any, options: list[str], folder: Path) -> None:
    """Ours, MeshLab's and ours again: MeshLab's part gives the points of MeshLab's own way to run scripts."""
    first = run_script(script_file(folder, filter_xml("Image to Quad Mesh", *options)), image=image)
    assert isinstance(first.current, Layer)
    write_ply(first.current, folder / "first.ply")
    run_peer("write", folder / "pure.mlx", folder / "first.ply")
    run_peer("apply", folder / "pure.mlx", folder / "first.ply", folder / "points.npy")

    head = filter_xml("Image to Quad Mesh", *options) + filter_xml("Compute Quad Quality Measures")
    tail = (
        filter_xml("Colorize by Material")
        + filter_xml("Compute Material Statistics")
        + filter_xml("Export Quad Mesh", 'name="fileName" type="RichSaveFile" value="both.vtu" ext="*.vtu"')
    )
    result = run_script(mixed_script(folder, folder / "pure.mlx", head, tail), image=image, output=folder / "both.obj")

    assert len(result.steps) >= 12
    assert {s.program for s in result.steps} == {"imgquad-mesh", "MeshLab"}
    assert result.current is not None
    assert np.array_equal(result.current.points, np.load(folder / "points.npy"))
    assert first.mesh is not None
    assert result.current.n_faces == 2 * first.mesh.n_quads
    assert (result.current.face_sizes == 4).all()
    measures = result.values("get_topological_measures_from_quad_mesh")
    assert (measures["polys_number"], measures["triangles_number"]) == (first.mesh.n_quads, 0)
    areas = result.values("get_material_statistics")["materials"]
    assert len(areas) == len(np.unique(first.mesh.quad_material))
    lines = (folder / "both.obj").read_text().splitlines()
    assert sum(line.startswith("f ") and len(line.split()) == 5 for line in lines) == result.current.n_faces
    assert any(line.startswith("usemtl") for line in lines)
    assert (folder / "both.obj.mtl").is_file()
    assert (folder / "both.vtu").is_file()


@needs_meshlab
def test_mixed_script_on_a_small_picture(tmp_path: Path) -> None:
    check_mixed(LABELS, ['name="size" type="RichFloat" value="3"'], tmp_path)


@needs_meshlab
@pytest.mark.parametrize("name", ["steel_duplex_ebsd_phase", "composite_weave_labels_z75", "im2mesh_7phases"])
def test_mixed_script_on_real_pictures(name: str, tmp_path: Path) -> None:
    path = IMAGES / f"{name}.png"
    if not path.is_file():
        pytest.skip(f"{path} is not here")
    check_mixed(
        path,
        [
            'name="size" type="RichFloat" value="5"',
            'name="effort" type="RichEnum" value="0" '
            'enum_cardinality="3" enum_val0="fast" enum_val1="normal" enum_val2="best"',
        ],
        tmp_path,
    )


# ------------------------------------------------------------------------------------------------------- the command


def command(*arguments: object) -> int:
    from imgquad_mesh.__main__ import main

    return main([str(a) for a in arguments])


def test_command_runs_a_script(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    np.save(tmp_path / "labels.npy", LABELS)
    path = script_file(tmp_path, MESH, filter_xml("get_quad_quality_measures"))
    arguments = ("script", path, "--input", tmp_path / "labels.npy", "--output", tmp_path / "m.off")
    assert command(*arguments, "--report", tmp_path / "r.json") == 0
    assert "min_sj" in capsys.readouterr().out
    assert (tmp_path / "m.off").read_text().startswith("OFF")
    assert '"get_quad_quality_measures"' in (tmp_path / "r.json").read_text()


def test_command_ends_with_code_two_on_a_bad_script(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command("script", script_file(tmp_path, filter_xml("Image to Quad Mesh", 'name="size"'))) == 2
    assert "script.mlx:3" in capsys.readouterr().err


def test_command_lists_filters_and_prints_scripts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command("filters") == 0
    listed = capsys.readouterr().out
    assert command("filters", "--markdown") == 0
    page = capsys.readouterr().out
    for spec in filters().values():
        assert spec.name in listed
        assert spec.function in listed
        assert spec.function in page
        for p in spec.parameters:
            assert f"`{p.name}`" in page
    assert command("filters", "--mlx", *[spec.name for spec in filters().values()]) == 0
    (tmp_path / "all.mlx").write_text(capsys.readouterr().out, encoding="utf-8")
    steps = checked_steps(read_script(tmp_path / "all.mlx"), tmp_path)
    assert [step.function for step in steps] == list(filters())
    assert command("filters", "--mlx", "Image to Quat Mesh") == 2
    assert "did you mean 'Image to Quad Mesh'" in capsys.readouterr().err


# ------------------------------------------------------------------------------------------------------- the docs


@needs_meshlab
def test_script_in_the_readme_runs(tmp_path: Path) -> None:
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    (tmp_path / "smooth.mlx").write_text(page.split("```xml\n")[1].split("```")[0], encoding="utf-8")
    result = run_script(tmp_path / "smooth.mlx", image=LABELS, output=tmp_path / "mesh.obj")
    assert [s.program for s in result.steps] == ["imgquad-mesh", "MeshLab", "MeshLab", "imgquad-mesh"]
    assert result.mesh is not None


@needs_meshlab
def test_script_in_the_docs_runs(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "meshlab.md").read_text(encoding="utf-8")
    (tmp_path / "rock.mlx").write_text(page.split("```xml\n")[1].split("```")[0], encoding="utf-8")
    result = run_script(tmp_path / "rock.mlx", image=LABELS, output=tmp_path / "rock.obj")
    assert result.values("get_quad_quality_measures")["inverted"] == 0
    assert (tmp_path / "rock.inp").is_file()
    for name in ("Subdivision Surfaces: Midpoint", "Conditional Face Selection", "Laplacian Smooth"):
        assert name in page
        assert meshlab_function(name, meshlab_filters())
