"""Files that VTK formats; loaded with the first of them."""

from __future__ import annotations

from pathlib import Path
from time import time
from typing import Any

from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

from imgquad_core.whole_files import take_room
from imgquad_core.writers.hdf5_times import erase_times
from imgquad_mesh import datasets

LEGACY_TITLE = 250  #: signs; VTK takes 256 with the end of the line

#: zlib's level: a third of the time of VTK's 5, 2 % longer; meshio reads neither LZ4 nor bytes that are not in base64
FAST = 1
HDF_CHUNK = 25_000  #: values, in which VTK's HDF5 writer makes files longer


def save_dataset(dataset: Any, path: Path) -> None:
    """Save a PyVista dataset: Python writes what VTK formats, as VTK's XML writers abort the process on a full disk.

    VTK's HDF5 writer does not tell that a disk is full, so room is made sure of before.
    """
    writers = {".vtu": vtkXMLUnstructuredGridWriter, ".vtp": vtkXMLPolyDataWriter}
    if path.suffix.lower() == ".vtkhdf":
        arrays = len(dataset.array_names) + 6  # with points, cells
        take_room(path.parent, 1024 * dataset.GetActualMemorySize() + 8 * HDF_CHUNK * arrays)
    if path.suffix.lower() not in writers:
        start = time()
        with datasets.silent_vtk():
            dataset.save(path)
        if path.suffix.lower() == ".vtkhdf":
            erase_times(path, start, time())
        return
    writer = writers[path.suffix.lower()]()
    writer.SetInputData(dataset)
    writer.SetCompressionLevel(FAST)
    writer.WriteToOutputStringOn()
    if not writer.Write():
        raise OSError(f"VTK cannot format {path.suffix}")
    path.write_text(writer.GetOutputString(), encoding="utf-8", newline="\n")


def save_legacy(grid: Any, path: Path, title: str) -> None:
    """Save a grid as text that other readers of ``.vtk`` than VTK's know (version 4.2)."""
    from vtkmodules.vtkIOLegacy import vtkUnstructuredGridWriter  # not above: few files are of this kind

    writer = vtkUnstructuredGridWriter()
    writer.SetFileVersion(42)  # 5.1 is read by VTK only
    writer.SetHeader(title[:LEGACY_TITLE])
    writer.SetInputData(grid)
    writer.WriteToOutputStringOn()
    if not writer.Write():
        raise OSError("VTK cannot format .vtk")
    path.write_text(writer.GetOutputString(), encoding="utf-8", newline="\n")


def save_with_comment(grid: Any, path: Path, comment: str) -> None:
    """Save a grid as XML with a comment at its top."""
    save_dataset(grid, path)
    head, body = path.read_text(encoding="utf-8").split("\n", 1)
    path.write_text(f"{head}\n<!-- material: {comment} -->\n{body}", encoding="utf-8", newline="\n")
