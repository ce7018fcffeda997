"""The bridge to pymeshlab: what goes in comes out, exactly. Each test runs pymeshlab in a process of its own."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv

from imgquad_core.errors import InputError
from imgquad_core.model import Materials
from imgquad_core.options import MeshOptions
from imgquad_core.pipeline import mesh_image
from imgquad_mesh.meshlab.layer import Layer, face_of_triangle, load_layer, polyline, save_layer, surface, write_ply
from imgquad_mesh.meshlab.meshsets import face_materials, quad_layer, quad_mesh
from imgquad_mesh.meshlab.process import MeshLabError, MeshLabProcess
from imgquad_mesh.meshlab.pymeshlab_filters import MissingMeshLab, meshlab_filters
from imgquad_mesh.outputs.files import write_mesh_file
from imgquad_mesh.spec import filters
from support import ROOT

try:
    meshlab_filters()
    _MISSING = ""
except MissingMeshLab as error:
    _MISSING = str(error)

pytestmark = pytest.mark.skipif(bool(_MISSING), reason=_MISSING or "-")

PRELUDE = """
import sys, warnings
sys.path[:0] = [{root!r}, {plugin!r}]
import numpy as np
import pymeshlab
import imgquad_mesh
from imgquad_core.options import MeshOptions
from imgquad_core.pipeline import mesh_image
LABELS = np.zeros((24, 30), np.int32)
LABELS[6:18, 8:20] = 3
LABELS[1:5, 1:6] = 5
"""


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:
    """Let the kernels be compiled here, so that each process finds them in the cache."""
    mesh_image(np.eye(12, dtype=np.int32))


def in_process(code: str, folder: Path) -> str:
    prelude = PRELUDE.format(root=str(ROOT), plugin=str(ROOT / "plugin"))
    (folder / "code.py").write_text(prelude + code)
    done = subprocess.run(
        [sys.executable, "code.py"], cwd=folder, capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def test_mesh_goes_through_a_meshset_to_the_bit(tmp_path: Path) -> None:
    in_process(
        """
mesh = mesh_image(LABELS, MeshOptions(size=2.7, pixel_size=1 / 3))
ms = imgquad_mesh.to_meshset(mesh)
back = imgquad_mesh.from_meshset(ms, mesh.materials)
assert back.points.tobytes() == mesh.points.tobytes()
assert np.array_equal(np.sort(back.quads), np.sort(mesh.quads)) and (back.quads[:, 0] == mesh.quads[:, 0]).all()
assert back.quads.tobytes() == mesh.quads.tobytes()
assert back.quad_material.tobytes() == mesh.quad_material.tobytes()
assert len(back.region_label) == len(mesh.region_label) and len(back.constraints) == len(mesh.constraints)
assert back.materials.names == mesh.materials.names
current = ms.current_mesh()
assert current.face_number() == 2 * mesh.n_quads
assert (current.face_scalar_array() == np.repeat(mesh.quad_material, 2)).all()
ms.compute_selection_by_condition_per_face(condselect="material == 3")
area = ms.get_area_and_perimeter_of_selection()["selected_surface_area"]
assert abs(area / (144 / 9) - 1) < 1e-3
""",
        tmp_path,
    )


@pytest.mark.parametrize("carrier", ["colour", "value"])
def test_materials_survive_filters_that_lose_the_attribute(carrier: str, tmp_path: Path) -> None:
    spoil = {
        "colour": "ms.compute_scalar_by_aspect_ratio_per_face(metric='Area'); ms.compute_color_by_function_per_face("
        "r='fr', g='fg', b='fb')",
        "value": "ms.compute_color_by_function_per_face(r='fi')",
    }[carrier]
    code = f"""
mesh = mesh_image(LABELS, MeshOptions(size=3))
ms = imgquad_mesh.to_meshset(mesh)
{spoil if carrier == "value" else ""}
ms.generate_copy_of_current_mesh()
back = imgquad_mesh.from_meshset(ms, mesh.materials)
assert (back.quad_material == mesh.quad_material).all()
"""
    in_process(code, tmp_path)


def test_from_meshset_refuses_what_is_no_plane_mesh_of_quads(tmp_path: Path) -> None:
    out = in_process(
        """
def refused(ms):
    try:
        imgquad_mesh.from_meshset(ms)
    except ValueError as error:
        print(error)
ms = pymeshlab.MeshSet()
refused(ms)
ms.create_sphere()
refused(ms)
refused(imgquad_mesh.to_meshset(mesh_image(LABELS)) and pymeshlab.MeshSet())
ms = imgquad_mesh.to_meshset(mesh_image(LABELS))
ms.compute_matrix_from_rotation(rotaxis="X axis", angle=30, freeze=True)
refused(ms)
ms = imgquad_mesh.to_meshset(mesh_image(LABELS))
ms.meshing_poly_to_tri()
refused(ms)
""",
        tmp_path,
    )
    assert [word in line for word, line in zip(("empty", "no quads", "empty", "not plane", "no quads"),
                                               out.splitlines(), strict=True)] == [True] * 5  # fmt: skip


def test_our_filters_become_methods(tmp_path: Path) -> None:
    in_process(
        """
before = set(dir(pymeshlab.MeshSet))
names = imgquad_mesh.install_meshlab_filters()
assert set(dir(pymeshlab.MeshSet)) - before == set(names)
ms = pymeshlab.MeshSet()
made = ms.generate_quad_mesh_from_image(image=LABELS, size=3, maxshift=0.5)
direct = mesh_image(LABELS, MeshOptions(size=3, max_shift=0.5))
assert made["quads_number"] == direct.n_quads
assert ms.current_mesh().vertex_matrix()[:, :2].tobytes() == direct.points.tobytes()
quality = ms.get_quad_quality_measures()
assert quality["inverted"] == 0
ms.compute_selection_from_mesh_border()
ms.apply_selection_inverse(invfaces=True, invverts=True)
ms.apply_coord_laplacian_smoothing(stepsmoothnum=1, selected=True)
assert ms.get_quad_quality_measures()["mean_sj"] != quality["mean_sj"]
assert ms.compute_scalar_by_quad_quality_per_face(metric="aspect")["min"] >= 1
assert ms.current_mesh().selected_face_number() > 0, "filters of ours keep the selection"
assert set(ms.get_material_statistics()["materials"]) == {"material 0", "material 3", "material 5"}
cleaned = ms.meshing_quad_cleanup(effort="fast")
assert cleaned["min_scaled_jacobian_after"] > 0 and ms.mesh_number() == 1
two = pymeshlab.MeshSet()
for call, word in (
    (lambda: two.generate_quad_mesh_from_image(), "no picture"),
    (lambda: two.get_quad_quality_measures(), "no mesh"),
    (lambda: two.get_quad_quality_measures(image=LABELS), "takes no image"),
    (lambda: two.generate_quad_mesh_from_image(image=LABELS, sise=3), "sise"),
    (lambda: two.generate_quad_mesh_from_image(image=LABELS, effort="huge"), "effort"),
    (lambda: two.generate_quad_mesh_from_image(image=LABELS, size="4"), "size"),
    (lambda: two.generate_quad_mesh_from_image(image="nothing.png"), "nothing.png"),
):
    try:
        call()
    except ValueError as error:
        assert word in str(error), (word, error)
    else:
        raise AssertionError(word)
assert "maxshift (default 1.0)" in pymeshlab.MeshSet.generate_quad_mesh_from_image.__doc__
""",
        tmp_path,
    )


def test_script_runs_on_a_given_meshset(tmp_path: Path) -> None:
    in_process(
        """
mesh = mesh_image(LABELS, MeshOptions(size=3))
ms = imgquad_mesh.to_meshset(mesh, label="ours")
ms.create_cube()
ms.set_current_mesh(0)
open("s.mlx", "w").write('''<FilterScript>
 <filter name="Box/Cube"/>
 <filter name="Compute Geometric Measures"/>
</FilterScript>''')
result = imgquad_mesh.run_script("s.mlx", ms)
assert ms.mesh_number() == 3 and ms.current_mesh().vertex_number() == 8
assert result.values("get_geometric_measures")["surface_area"] == 6
ms.set_current_mesh(0)
back = imgquad_mesh.from_meshset(ms, mesh.materials)
assert ms.current_mesh().label() == "ours"
assert back.points.tobytes() == mesh.points.tobytes() and back.quads.tobytes() == mesh.quads.tobytes()
""",
        tmp_path,
    )


# ---------------------------------------------------------------------------------------------------------- layers


def random_layer(seed: int) -> Layer:
    """Triangles, quads and pentagons side by side, with everything that a layer can have."""
    rng = np.random.default_rng(seed)
    faces, points = [], []
    for i in range(40):
        n = int(rng.integers(3, 6))
        turn = rng.uniform(0, 6) + np.arange(n) * 2 * np.pi / n
        faces.append(np.arange(n) + sum(map(len, faces)))
        points.append(np.stack([3 * i + np.cos(turn), np.sin(turn), rng.normal(size=n)], axis=1))
    return Layer(
        np.concatenate(points),
        np.concatenate([[0], np.cumsum([len(f) for f in faces])]),
        np.concatenate(faces),
        np.empty((0, 2), np.int64),
        face_color=rng.integers(0, 256, (40, 4)).astype(np.uint8),
        point_color=rng.integers(0, 256, (sum(map(len, faces)), 4)).astype(np.uint8),
        face_scalar=rng.normal(size=40),
        point_scalar=rng.normal(size=sum(map(len, faces))),
        material=rng.integers(0, 5, 40).astype(np.int32),
        label=f"layer {seed}",
    )


def assert_same(a: Layer, b: Layer) -> None:
    for name in ("points", "face_offsets", "face_color", "face_scalar", "point_color", "point_scalar", "material"):
        assert np.array_equal(getattr(a, name), getattr(b, name)), name
    for f in range(a.n_faces):
        ours, theirs = (x.face_points[x.face_offsets[f] : x.face_offsets[f + 1]] for x in (a, b))
        at = int(np.flatnonzero(theirs == ours[0])[0])
        assert np.array_equal(np.roll(theirs, -at), ours)


@pytest.mark.parametrize("seed", range(3))
def test_any_polygons_go_through_meshlab_with_all_they_have(seed: int, tmp_path: Path) -> None:
    layer = random_layer(seed)
    with MeshLabProcess(tmp_path, 30.0) as process:
        process.add(layer)
        assert_same(layer, process.layer())
        process.give("move", layer.points[::-1] / 3.0)
        process.give("set_scalar", np.arange(40) / 7.0)
        process.give("set_color", layer.face_color[::-1] if layer.face_color is not None else np.empty(0))
        back = process.layer()
    assert np.array_equal(back.points, layer.points[::-1] / 3.0)
    assert np.array_equal(back.face_scalar, np.arange(40) / 7.0)  # type: ignore[arg-type]
    assert np.array_equal(back.face_color, layer.face_color[::-1])  # type: ignore[arg-type, index]
    assert np.array_equal(back.material, layer.material)  # type: ignore[arg-type]


def test_polylines_go_through_meshlab(tmp_path: Path) -> None:
    line = polyline(np.array([[0.1, 0.2], [1 / 3, 0], [5, 5]]), np.array([[0, 1], [1, 2], [2, 0]]))
    with MeshLabProcess(tmp_path, 30.0) as process:
        process.add(line)
        back = process.layer()
    assert np.array_equal(back.points, line.points)
    assert np.array_equal(back.edges, line.edges)
    assert back.n_faces == 0


def test_layer_is_saved_and_loaded(tmp_path: Path) -> None:
    layer = random_layer(7)
    save_layer(layer, tmp_path / "a.npz")
    back = load_layer(tmp_path / "a.npz")
    assert_same(layer, back)
    assert back.label == layer.label


def test_ply_keeps_quads_for_others(tmp_path: Path) -> None:
    mesh = mesh_image(np.eye(12, dtype=np.int32) * 4, MeshOptions(size=3))
    write_ply(quad_layer(mesh), tmp_path / "m.ply")
    read = pv.read(tmp_path / "m.ply")
    assert np.array_equal(read.faces.reshape(-1, 5)[:, 1:], mesh.quads)
    assert np.allclose(read.points[:, :2], mesh.points, rtol=1e-6)  # VTK reads single precision
    colors = dict(zip(mesh.materials.labels.tolist(), mesh.materials.colors.tolist(), strict=True))
    assert read.cell_data["RGBA"][:, :3].tolist() == [colors[m] for m in mesh.quad_material.tolist()]


@pytest.mark.parametrize("extension", [".obj", ".off", ".ply"])
def test_files_of_ours_load_in_meshlab_with_quads_and_colours(extension: str, tmp_path: Path) -> None:
    mesh = mesh_image(np.eye(12, dtype=np.int32) * 4, MeshOptions(size=3))
    write_mesh_file(mesh, tmp_path / f"m{extension}")
    with MeshLabProcess(tmp_path, 30.0) as process:
        process.open(tmp_path / f"m{extension}")
        layer = process.layer()
    assert layer.n_faces == mesh.n_quads
    assert (layer.face_sizes == 4).all()
    assert layer.face_color is not None
    ours = np.concatenate([layer.points[f][:, :2] for f in layer.face_points.reshape(-1, 4)])
    assert np.isclose(np.abs(ours).sum(), np.abs(mesh.points[mesh.quads]).sum(), rtol=1e-12)
    found, counts = np.unique(layer.face_color[:, :3], axis=0, return_counts=True)
    colors = mesh.materials.colors[np.searchsorted(mesh.materials.labels, mesh.quad_material)]
    expected, expected_counts = np.unique(colors, axis=0, return_counts=True)
    assert found.tolist() == expected.tolist()
    assert counts.tolist() == expected_counts.tolist()


def test_triangles_find_their_faces() -> None:
    layer = surface(np.zeros((6, 2)), np.array([[0, 1, 2, 3], [3, 2, 4, 5]]))
    triangles = np.array([[0, 2, 3], [3, 2, 4], [0, 1, 2], [3, 4, 5]])
    assert face_of_triangle(layer, triangles).tolist() == [0, 1, 0, 1]


def test_materials_are_told_by_colour_then_by_value_then_by_distinct_colours() -> None:
    colors = np.array([[9, 9, 9, 255], [1, 2, 3, 255], [9, 9, 9, 255]], np.uint8)
    square = np.array([[0, 1, 2, 3]] * 3)
    named = Materials(np.array([4, 7]), ("a", "b"), np.array([[1, 2, 3], [9, 9, 9]]))
    layer = surface(np.zeros((4, 2)), square, face_color=colors, face_scalar=np.array([1.0, 2.0, 2.0]))
    assert face_materials(layer, named).tolist() == [7, 4, 7]
    assert face_materials(layer).tolist() == [1, 2, 2]
    assert face_materials(surface(np.zeros((4, 2)), square, face_color=colors)).tolist() == [1, 0, 1]
    assert face_materials(surface(np.zeros((4, 2)), square)).tolist() == [0, 0, 0]


def test_layer_without_faces_is_no_mesh() -> None:
    with pytest.raises(InputError, match="no faces"):
        quad_mesh(polyline(np.zeros((2, 2)), np.array([[0, 1]])))


def test_process_that_died_is_told_again(tmp_path: Path) -> None:
    with MeshLabProcess(tmp_path, 30.0) as process:
        process.add(random_layer(1))
        with pytest.raises(MeshLabError, match="ended the MeshLab process"):
            process.apply("get_depth_complexity")
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # as gmsh.initialize does
        with pytest.raises(MeshLabError, match="ended the MeshLab process"):
            process.apply("get_geometric_measures")
        last = process.last_good()
    assert last is not None
    assert last.n_faces == 40


def test_no_filter_of_ours_has_a_name_of_meshlabs() -> None:
    assert not set(filters()) & set(meshlab_filters())
