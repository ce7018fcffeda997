"""The process in which pymeshlab runs: one MeshSet, told what to do by lines of JSON, answering in the same way.

A filter of MeshLab that hangs or crashes takes only this process with it. Arrays travel in files, named in the lines.
"""

from __future__ import annotations

import itertools
import json
import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.whole_files import scratch_folder
from imgquad_mesh.memory import limit_memory

from .layer import (
    Faces,
    Layer,
    face_of_triangle,
    faces_of,
    has_triangles,
    known_faces,
    layer_of,
    load_layer,
    save_layer,
    write_ply,
)

Array = NDArray[Any]


#: filters that never make other polygons of the same triangles; other ``apply_coord_`` ones do (cubic stylization)
_KEEP_FACES = (
    *(f"apply_coord_{how}" for how in ("hc", "laplacian", "taubin", "two_step", "unsharp")),
    *(f"compute_{what}_by" for what in ("color", "coord", "scalar", "selection")),
    "get_",
)
_FACES: dict[int, Faces] = {}  # of layers, by id, as they were last known
MEMORY = "IMGQUAD_MESHLAB_BYTES"  #: environment variable with the bytes that the process may use


def main() -> None:
    """Answer requests until the input ends."""
    limit_memory(int(os.environ.get(MEMORY, "0")))
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what pymeshlab prints must not get between the answers
    import pymeshlab  # an extra, and prints while it loads

    meshes = pymeshlab.MeshSet(False)
    for line in sys.stdin:
        request = json.loads(line)
        try:
            answer = {"values": _REQUESTS[request.pop("do")](pymeshlab, meshes, **request)}
        except Exception as error:
            answer = {"error": f"{type(error).__name__}: {error}"}
        answers.write(json.dumps(answer, default=plain) + "\n")
        answers.flush()


def plain(value: Any) -> Any:
    """Return what JSON can hold of a value that a filter of MeshLab returned."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if hasattr(value, "dim_x"):  # pymeshlab.BoundingBox
        return {"min": value.min().tolist(), "max": value.max().tolist()}
    return str(value)


def typed(pymeshlab: Any, kind: str, value: Any) -> Any:
    """Return a script's value as pymeshlab wants it."""
    if kind == "RichAbsPerc":
        return pymeshlab.PureValue(value)
    if kind == "RichColor":
        return pymeshlab.Color(*value)
    if kind in ("RichPosition", "RichDirection", "RichPoint3f"):
        return np.array(value, float)
    if kind == "RichMatrix44f":
        return np.array(value, float).reshape(4, 4)
    return value


def add_layer(meshes: Any, layer: Layer, folder: Path) -> int:
    """Load a layer into a MeshSet, exactly; it becomes the current one.

    Returns
    -------
    int
        Its id.
    """
    path = folder / "layer.ply"
    write_ply(layer, path)
    meshes.load_new_mesh(str(path))
    mesh = meshes.current_mesh()
    mesh.set_label(layer.label)
    if layer.material is not None:  # before the mesh is in the set, attributes of faces are broken
        face = face_of_triangle(layer, np.asarray(mesh.face_matrix(), np.int64))
        mesh.add_face_custom_scalar_attribute(layer.material[face].astype(float), "material")
    return int(meshes.current_mesh_id())


def _add(pymeshlab: Any, meshes: Any, file: str) -> int:
    layer = load_layer(Path(file))
    mesh = add_layer(meshes, layer, Path(file).parent)
    known = known_faces(meshes.current_mesh(), layer)
    if known is not None:
        _FACES[mesh] = known
    return mesh


def _faces(mesh: Any) -> Faces:
    """Return the faces of a mesh; as they were where no filter since then makes others of the same triangles.

    pymeshlab gives faces one by one, which takes longer than most filters do.
    """
    number = int(mesh.id())
    if number not in _FACES or not has_triangles(mesh, _FACES[number]):
        _FACES[number] = faces_of(mesh)
    return _FACES[number]


def _open(pymeshlab: Any, meshes: Any, file: str) -> int:
    meshes.load_new_mesh(file)
    return int(meshes.current_mesh_id())


def _apply(
    pymeshlab: Any, meshes: Any, function: str, parameters: list[list[Any]], script: str | None = None
) -> dict[str, Any]:
    """Apply a filter.

    pymeshlab clamps a bounded number to the limits that it has on the current mesh, where MeshLab's own scripts take it
    as it is; then `script`, with this filter alone, is run in MeshLab's way.
    """
    if not function.startswith(_KEEP_FACES):
        _FACES.clear()
    for name, kind, value in parameters:
        if kind == "RichMesh" and not meshes.mesh_id_exists(value):
            raise ValueError(f"parameter {name}: there is no mesh {value}; the set has {_ids(meshes)}")
    arguments = {name: typed(pymeshlab, kind, value) for name, kind, value in parameters}
    clamped = [name for name, kind, _ in parameters if kind == "RichDynamicFloat"]
    if clamped:
        used = meshes.filter_parameter_values(function, **arguments)
        clamped = [name for name in clamped if np.float32(used[name]) != np.float32(arguments[name])]
    if not clamped:
        return {"values": dict(meshes.apply_filter(function, **arguments) or {})}
    if script is None:
        name = clamped[0]
        raise ValueError(
            f"parameter {name} is {arguments[name]:g}, which MeshLab would clamp to {used[name]:g} on this mesh; "
            "give a value within its limits, or name filter and parameters as MeshLab's own scripts do"
        )
    _apply_as_script(meshes, script)
    return {"values": {}, "by_script": True}


def _apply_as_script(meshes: Any, script: str) -> None:
    with scratch_folder() as folder:
        path = folder / "one.mlx"
        path.write_text(script, encoding="utf-8")
        meshes.load_filter_script(str(path))
    meshes.apply_filter_script()
    meshes.clear_filter_script()


def _ids(meshes: Any) -> str:
    return ", ".join(str(mesh.id()) for mesh in meshes) or "none"


def _layers(pymeshlab: Any, meshes: Any) -> dict[str, Any]:
    return {"ids": [int(mesh.id()) for mesh in meshes], "current": _current(meshes)}


def _current(meshes: Any) -> int | None:
    return int(meshes.current_mesh_id()) if meshes.mesh_number() else None


def _save(pymeshlab: Any, meshes: Any, file: str, mesh: int | None = None) -> None:
    saved = meshes.current_mesh() if mesh is None else meshes.mesh(mesh)
    save_layer(layer_of(saved, _faces(saved)), Path(file))


def _export(pymeshlab: Any, meshes: Any, file: str) -> None:
    meshes.save_current_mesh(file)


def delete_layer(meshes: Any, mesh: int) -> None:
    """Delete a layer that is not the current one."""
    current = meshes.current_mesh_id()
    meshes.set_current_mesh(mesh)
    meshes.delete_current_mesh()
    meshes.set_current_mesh(current)


def _delete(pymeshlab: Any, meshes: Any, mesh: int) -> None:
    delete_layer(meshes, mesh)


def _set_current(pymeshlab: Any, meshes: Any, mesh: int) -> None:
    meshes.set_current_mesh(mesh)


def give(meshes: Any, do: str, values: Array) -> None:
    """Change the current mesh in place, so that selections and all else stay.

    Parameters
    ----------
    meshes : pymeshlab.MeshSet
        What has the mesh.
    do : str
        ``move``: put the points elsewhere, shape (n_points, 3). ``set_scalar``: a value a face, shape (n_faces,).
        ``set_color``: a colour a face (RGBA), shape (n_faces, 4).
    values : ndarray
        In the order of the mesh's points, or of its polygons.
    """
    if do == "move":
        names = {axis: _free_name("moved") for axis in "xyz"}
        for name, column in zip(names.values(), values.T, strict=True):
            meshes.current_mesh().add_vertex_custom_scalar_attribute(np.ascontiguousarray(column), name)
        meshes.compute_coord_by_function(**names, onselected=False)
    elif do == "set_scalar":
        meshes.compute_scalar_by_function_per_face(q=_attribute(meshes, values), onselected=False)
    else:
        channels = {c: _attribute(meshes, column) for c, column in zip("rgba", values.T, strict=True)}
        meshes.compute_color_by_function_per_face(**channels, onselected=False)


def _give(pymeshlab: Any, meshes: Any, what: str, file: str) -> None:
    give(meshes, what, np.load(file))


def _attribute(meshes: Any, values: Array) -> str:
    """Put a value a face into a new attribute of the current mesh and return its name."""
    mesh = meshes.current_mesh()
    name = _free_name("given")
    face = face_of_triangle(layer_of(mesh), np.asarray(mesh.face_matrix(), np.int64))
    mesh.add_face_custom_scalar_attribute(values.astype(float)[face], name)
    return name


def _free_name(stem: str) -> str:
    """Return a name of an attribute that was not used yet: pymeshlab can neither remove nor overwrite one."""
    return f"{stem}{next(_NUMBERS)}"


_NUMBERS = itertools.count()
_REQUESTS: Mapping[str, Callable[..., Any]] = {
    "add": _add,
    "open": _open,
    "apply": _apply,
    "layers": _layers,
    "save": _save,
    "export": _export,
    "delete": _delete,
    "set_current": _set_current,
    "give": _give,
}


if __name__ == "__main__":
    main()
