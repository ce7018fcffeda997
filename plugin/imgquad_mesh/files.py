"""Writing what a run gives: each file whole or not at all."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.errors import InputError

if TYPE_CHECKING:
    from imgquad_core.model import LabelImage, QuadMesh
    from imgquad_core.pipeline import Run

#: formats that PyVista writes
GRID_EXTENSIONS = (".vtu", ".vtk")


def check_target(path: Path, extensions: tuple[str, ...]) -> None:
    """Raise `InputError` now if `path` could not be written later."""
    if path.suffix.lower() not in extensions:
        raise InputError(f"{path}: cannot write '{path.suffix}' files here; the formats are {', '.join(extensions)}")
    if path.is_dir():
        raise InputError(f"{path} is a folder: give the name of a file")
    if not path.parent.is_dir():
        raise InputError(f"cannot write {path}: there is no folder {path.parent}; make it, or give another one")
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}; give another folder") from error


def mesh_extensions() -> tuple[str, ...]:
    """Return the formats that a mesh can be written in."""
    from imgquad_core.writers import WRITERS

    return (*GRID_EXTENSIONS, *sorted(WRITERS))


def write_mesh_file(mesh: QuadMesh, path: Path, **options: Any) -> None:
    """Write `mesh` in the format that the extension of `path` names."""
    if path.suffix.lower() in GRID_EXTENSIONS:
        from imgquad_mesh.convert import to_grid

        grid = to_grid(mesh)
        replace_file(path, lambda temporary: save_dataset(grid, temporary))
    else:
        from imgquad_core.writers import write_mesh

        write_mesh(mesh, path, **options)


def write_labels(image: LabelImage, path: Path) -> None:
    """Write the materials as meshed: int32 array in picture orientation (.npy), or a palette picture (.png)."""
    replace_file(path, lambda temporary: _save_labels(image, temporary))


def write_boundaries(run: Run, path: Path) -> None:
    """Write the smoothed boundaries as polylines with the materials on their left and right."""
    from imgquad_mesh.convert import chain_lines

    graph = run.boundary
    materials = np.append(graph.region_label, np.int32(-1))[graph.chain_regions]  # region -1 takes the last one
    points = graph.points * run.options.pixel_size
    lines = chain_lines(points, graph.chain_offsets, graph.chain_points, materials, graph.point_kind)
    replace_file(path, lambda temporary: save_dataset(lines, temporary))


def write_picture(mesh: QuadMesh, path: Path) -> None:
    """Draw the mesh coloured by material."""
    from imgquad_mesh.picture import draw_materials

    replace_file(path, lambda temporary: draw_materials(mesh, temporary))


def write_json(values: dict[str, Any], path: Path) -> None:
    """Write `values` as JSON."""
    text = json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    replace_file(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def replace_file(path: Path, write: Callable[[Path], Any]) -> None:
    """Let `write` make a new file beside `path` and move it there when it is whole.

    Raises
    ------
    InputError
        It cannot be written or the disk is full: what was at `path` is untouched.
    """
    try:
        with tempfile.TemporaryDirectory(prefix=".imgquad-", dir=path.parent) as folder:
            temporary = Path(folder) / path.name
            write(temporary)
            os.replace(temporary, path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"cannot write {path}: {reason}; what was there is unchanged, free some space") from error


def save_dataset(dataset: Any, path: Path) -> None:
    """Save a PyVista dataset: Python writes what VTK formats, as VTK's XML writers abort the process on a full disk."""
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

    writers = {".vtu": vtkXMLUnstructuredGridWriter, ".vtp": vtkXMLPolyDataWriter}
    if path.suffix.lower() not in writers:
        dataset.save(path)
        return
    writer = writers[path.suffix.lower()]()
    writer.SetInputData(dataset)
    writer.WriteToOutputStringOn()
    if not writer.Write():
        raise OSError(f"VTK cannot format {path.suffix}")
    path.write_text(writer.GetOutputString(), encoding="utf-8", newline="\n")


def read_vti(path: Path, max_pixels: int) -> NDArray[Any]:
    """Return the picture in a file of VTK's image data, the top row first."""
    import pyvista as pv

    from imgquad_mesh.convert import image_array

    if not path.is_file():
        raise InputError(f"cannot open the picture {path}: there is no such file")
    try:
        reader = pv.XMLImageDataReader(str(path))
        with pv.vtk_verbosity("off"):
            image = reader.read()
        if image.n_points > max_pixels:
            raise InputError(
                f"{path} has {image.n_points} pixels, more than {max_pixels}: crop it, or raise max_pixels"
            )
        return image_array(image)
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"{path} cannot be read as VTK image data ({error}): save it anew") from error


def _save_labels(image: LabelImage, path: Path) -> None:
    if path.suffix.lower() == ".npy":
        np.save(path, image.labels)
        return
    from PIL import Image

    from imgquad_mesh.picture import material_colors

    numbers = image.materials.labels
    if image.labels.min() < 0 or numbers.max(initial=0) > 254:
        raise InputError(f"{path}: a palette picture holds the materials 0 to 254, without void; write a .npy instead")
    palette = np.zeros((256, 3), np.uint8)
    palette[numbers] = np.round(material_colors(image.materials) * 255)
    picture = Image.fromarray(image.labels.astype(np.uint8), mode="P")
    picture.putpalette(palette.ravel().tolist())
    picture.save(path)
