"""Writing what a run gives: each file whole or not at all."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Iterable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import imgquad_core as core
from imgquad_core.errors import InputError
from imgquad_core.whole_files import assert_apart, real_target, replacing
from imgquad_core.writers.neighbours import check_neighbours, files_of
from imgquad_mesh import datasets, outputs  # `outputs`: VTK and matplotlib are loaded with what needs them

#: formats that PyVista writes
GRID_EXTENSIONS = (".vtu", ".vtk", ".vtkhdf")


def check_target(path: Path, extensions: tuple[str, ...]) -> None:
    """Raise `InputError` now if `path` could not be written later."""
    if path.suffix.lower() not in extensions:
        raise InputError(f"{path}: cannot write '{path.suffix}' files here; the formats are {', '.join(extensions)}")
    try:
        folder = real_target(path).parent
        if not folder.is_dir():
            raise InputError(f"cannot write {path}: there is no folder {folder}; make it, or give another one")
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}; give another place") from error
    check_neighbours(path)


def check_files(inputs: Iterable[Path | None], outputs: Iterable[Path | None]) -> None:
    """Raise `InputError` where an output, or a file that is written along with it, is an input or another output."""
    written = [file for path in outputs if path is not None for file in files_of(path)]
    assert_apart([path for path in inputs if path is not None], written)


def mesh_extensions() -> tuple[str, ...]:
    """Return the formats that a mesh can be written in."""
    return (*GRID_EXTENSIONS, *sorted(core.writers.WRITERS))


def write_run(
    run: core.Run, path: Path, elements: core.fe.ElementOptions | None = None, **options: Any
) -> core.fe.FEMesh | None:
    """Write the mesh of a run as `write_mesh_file` does; VTK's formats also hold pixel size, place and CRS."""

    def add_place(grid: Any) -> None:
        datasets.put_calibration(grid, run.calibration, (run.options.pixel_sides, run.options.corner))

    if run.calibration.size is None and (run.options.pixel_sides, run.options.corner) == ((1.0, 1.0), (0.0, 0.0)):
        return write_mesh_file(run.mesh, path, elements, **options)  # pixels are all that is known
    return write_mesh_file(run.mesh, path, elements, add_place, **options)


def write_mesh_file(
    mesh: core.QuadMesh,
    path: Path,
    elements: core.fe.ElementOptions | None = None,
    complete: Callable[[Any], None] | None = None,
    **options: Any,
) -> core.fe.FEMesh | None:
    """Write `mesh`, as the `elements` asked for, in the format that the extension of `path` names.

    `complete` adds to the grid that VTK writes, which is one of VTK's own for ``.vtu``.

    Returns
    -------
    FEMesh or None
        The elements where others than the quads of the mesh were asked for.
    """
    made = core.fe.make_elements(mesh, elements) if elements and not elements.plain else None
    if options.pop("plain", False):
        _write_plain(made or core.fe.fe_mesh(mesh), path)
    elif path.suffix.lower() in GRID_EXTENSIONS:
        is_vtu = path.suffix.lower() == ".vtu"
        grid = datasets.to_fe_grid(made) if made else (datasets.quad_grid if is_vtu else datasets.to_grid)(mesh)
        if complete:
            complete(grid)
        saved = datasets.for_vtu(grid) if is_vtu else grid
        replace_file(path, lambda temporary: outputs.save_dataset(saved, temporary))
    else:
        core.writers.write_mesh(made or mesh, path, **options)
    return made


def _write_plain(mesh: core.fe.FEMesh, path: Path) -> None:
    """Write ``.vtu`` or ``.vtk`` (text, 4.2) for other readers than VTK's; numbers of materials in a comment."""
    grid = datasets.plain_grid(mesh)
    names = core.writers.safe_names([*mesh.material_cells(), *mesh.cohesive_cells()], 255).values()
    legend = ", ".join(f"{number} {name}" for number, name in enumerate(names, 1))
    save = outputs.save_legacy if path.suffix.lower() == ".vtk" else outputs.save_with_comment
    replace_file(path, lambda temporary: save(grid, temporary, legend))


def write_labels(image: core.LabelImage, path: Path) -> None:
    """Write the materials as meshed: int32 array in picture orientation (.npy), or a palette picture (.png)."""
    replace_file(path, lambda temporary: _save_labels(image, temporary))


def write_boundaries(run: core.Run, path: Path) -> None:
    """Write the smoothed boundaries as polylines with the materials on their left and right."""
    graph = run.boundary
    materials = np.append(graph.region_label, np.int32(-1))[graph.chain_regions]  # region -1 takes the last one
    points = graph.points * run.square + run.options.corner
    lines = datasets.chain_lines(points, graph.chain_offsets, graph.chain_points, materials, graph.point_kind)
    replace_file(path, lambda temporary: outputs.save_dataset(lines, temporary))


def write_picture(mesh: core.QuadMesh, path: Path) -> None:
    """Draw the mesh coloured by material."""
    replace_file(path, lambda temporary: outputs.draw_materials(mesh, temporary))


def write_json(values: dict[str, Any], path: Path) -> None:
    """Write `values` as JSON."""
    text = json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    data = text.encode("utf-8", "backslashreplace")  # names that are no UTF-8 become \\udcff, as JSON has them
    replace_file(path, lambda temporary: temporary.write_bytes(data))


def replace_file(path: Path, write: Callable[[Path], Any]) -> None:
    """Let `write` make a new file beside `path` and move it there when it is whole.

    Raises
    ------
    InputError
        It cannot be written or the disk is full: what was at `path` is untouched.
    """
    with replacing(path) as temporary:
        write(temporary)


def _save_labels(image: core.LabelImage, path: Path) -> None:
    if path.suffix.lower() == ".npy":
        whole = BytesIO()  # np.save into a file overlooks that a disk is full
        np.save(whole, image.labels)
        path.write_bytes(whole.getbuffer())
        return
    numbers = image.materials.labels
    if image.labels.min() < 0 or numbers.max(initial=0) > 254:
        raise InputError(f"{path}: a palette picture holds the materials 0 to 254, without void; write a .npy instead")
    palette = np.zeros((256, 3), np.uint8)
    palette[numbers] = np.round(outputs.material_colors(image.materials) * 255)
    picture = Image.fromarray(image.labels.astype(np.uint8), mode="P")
    picture.putpalette(palette.ravel().tolist())
    picture.save(path)
