"""Lets pymeshlab write a script of each of its filters: ``python tests/support/meshlab_scripts.py FOLDER [NAME ...]``.

A filter is applied with its defaults to a small input, and the MeshSet saves the script, as a user's would. What cannot
be applied is loaded from a script of ours and saved by pymeshlab. Each filter has a forked process of its own.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pymeshlab

from imgquad_mesh.meshlab.mlx import Script, ScriptFilter, ScriptParameter, script_text
from imgquad_mesh.spec import python_name

NOT_APPLICABLE = Path(__file__).with_name("meshlab_filters.txt")

_TEXTURED = (
    "compute_selection_by_texture_seams_per_vertex", "compute_texcoord_transfer_vertex_to_wedge",
    "compute_texcoord_transfer_wedge_to_vertex", "generate_sampling_texel", "compute_texcoord_parametrization_harmonic",
    "compute_texcoord_parametrization_least_squares_conformal_maps",
    "meshing_decimation_quadric_edge_collapse_with_texture", "transfer_attributes_to_texture_per_vertex",
    "transfer_texture_to_color_per_vertex",
)  # fmt: skip
_RASTER = ("apply_cameras", "set_raster_name", "set_camera_per_raster")


def two_meshes(folder: Path) -> Any:
    meshes = pymeshlab.MeshSet(False)
    meshes.create_cube()
    meshes.create_sphere(subdiv=2)
    for mesh in (0, 1):
        meshes.set_current_mesh(mesh)
        meshes.compute_scalar_by_function_per_vertex(q="x")
        meshes.compute_scalar_by_function_per_face(q="fi")
        meshes.compute_color_by_function_per_vertex()
    meshes.compute_selection_by_condition_per_face(condselect="fi<40")
    return meshes


def cube(folder: Path) -> Any:
    meshes = pymeshlab.MeshSet(False)
    meshes.create_cube()
    return meshes


def textured(folder: Path) -> Any:
    from PIL import Image

    Image.fromarray(np.full((32, 32, 3), 90, np.uint8)).save(folder / "t.png")
    (folder / "t.mtl").write_text("newmtl m\nmap_Kd t.png\n")
    n, lines = 8, ["mtllib t.mtl", "usemtl m"]
    lines += [f"v {i} {j} {0.1 * i * j / n}\nvt {i / n} {j / n}" for j in range(n + 1) for i in range(n + 1)]
    for a in (j * (n + 1) + i + 1 for j in range(n) for i in range(n)):
        for corners in ((a, a + 1, a + n + 2), (a, a + n + 2, a + n + 1)):
            lines.append("f " + " ".join(f"{k}/{k}" for k in corners))
    (folder / "t.obj").write_text("\n".join(lines) + "\n")
    meshes = pymeshlab.MeshSet(False)
    meshes.load_new_mesh(str(folder / "t.obj"))
    meshes.compute_scalar_by_function_per_face(q="1")
    meshes.compute_color_by_function_per_vertex()
    return meshes


def with_raster(folder: Path) -> Any:
    meshes = textured(folder)
    meshes.load_new_raster(str(folder / "t.png"))
    return meshes


def input_for(function: str) -> Callable[[Path], Any]:
    if function in _TEXTURED:
        return textured
    if function.startswith(_RASTER):
        return with_raster
    return cube if function == "get_topological_measures_from_quad_mesh" else two_meshes


def write_applied(function: str, folder: Path) -> None:
    meshes = input_for(function)(folder)
    meshes.clear_filter_script()
    meshes.apply_filter(function)
    meshes.save_filter_script(str(folder / f"{function}.mlx"))


def write_loaded(function: str, name: str, parameters: str, folder: Path) -> None:
    values = textured(folder).filter_parameter_values(function)
    entries = [entry.split(" ", 1) for entry in parameters.split(", ") if entry]
    given = tuple(parameter("Rich" + kind, each, values[python_name(each)]) for kind, each in entries)
    path = folder / f"{function}.mlx"
    path.write_text(script_text(Script((ScriptFilter(name, given),))))
    meshes = pymeshlab.MeshSet(False)
    meshes.load_filter_script(str(path))
    meshes.save_filter_script(str(path))


def parameter(kind: str, name: str, value: Any) -> ScriptParameter:
    if kind == "RichEnum":
        return ScriptParameter(name, kind, value, choices=tuple("abcdefgh"[: value + 1]))
    if kind in ("RichDynamicFloat", "RichAbsPerc"):
        return ScriptParameter(name, kind, float(value), low=0.0, high=max(100.0, value))
    if kind == "RichColor":
        return ScriptParameter(name, kind, (50, 50, 50, 255))
    if kind == "RichPosition":
        return ScriptParameter(name, kind, tuple(map(float, value)))
    return ScriptParameter(name, kind, None if kind == "RichShotf" else value)


def in_fork(work: Callable[..., None], *values: Any) -> int:
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    signal.alarm(60)
    try:
        work(*values)
    except Exception as error:
        print(values[0], error, file=sys.stderr)
        os._exit(1)
    os._exit(0)


def main(folder: Path, names: list[str]) -> None:
    lines = [line for line in NOT_APPLICABLE.read_text().splitlines() if not line.startswith("#")]
    loaded = {row[0].strip(): (row[1].strip(), row[2].strip()) for row in (line.split("|") for line in lines)}
    for function in names or pymeshlab.filter_list():
        work = (write_loaded, function, *loaded[function]) if function in loaded else (write_applied, function)
        if in_fork(*work, folder):  # type: ignore[arg-type]
            print(f"{function} was not written", file=sys.stderr)


if __name__ == "__main__":
    os.chdir(sys.argv[1])  # some filters write files where they are
    main(Path(sys.argv[1]).resolve(), sys.argv[2:])
