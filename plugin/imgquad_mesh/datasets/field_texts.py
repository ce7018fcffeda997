"""Texts in the field arrays of a dataset: as VTK has them, and as tables of bytes in a ``.vtu``.

meshio ends the process at a text array in a ``.vtu``: texts go there as bytes, and are texts again when PyVista reads.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from html import escape  # xml.sax.saxutils loads urllib, http and ssl
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkStringArray

if TYPE_CHECKING:  # files are written without PyVista, which takes longer to load than a small picture to mesh
    import pyvista as pv

#: what a name of a component cannot hold: VTK writes it into the file without escapes
UNSAFE = re.compile(r'[<>&"\s\x00-\x1f]+')


def put_texts(dataset: pv.DataObject, name: str, texts: Iterable[str]) -> None:
    """Store texts in a field array, in place. PyVista refuses other letters than ASCII there; VTK takes them."""
    array = vtkStringArray()
    array.SetName(name)
    for text in texts:
        array.InsertNextValue(text.encode("utf-8", "replace").decode())
    dataset.GetFieldData().AddArray(array)


def put_numbers(dataset: Any, name: str, values: Any, part: str = "Field") -> None:
    """Store numbers in an array of a dataset of VTK or PyVista, in place; `part`: of Field, Cell or Point data."""
    array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)  # type: ignore[no-untyped-call]
    array.SetName(name)
    getattr(dataset, f"Get{part}Data")().AddArray(array)


def texts_of(array: NDArray[Any]) -> tuple[str, ...]:
    """Return the texts of a field array, be it of texts or a table of their bytes (read without our reader)."""
    values = np.asarray(array)
    return tuple(map(str, values if values.dtype != np.uint8 else _texts(values) or ()))


def for_vtu(dataset: Any) -> Any:
    """Return a shallow copy with bytes for text arrays of field data: a text a column, UTF-8, filled up with 0.

    Each column is named by its text, too, so that ParaView shows it and an editor finds it in the file. Names of other
    arrays are escaped, as VTK does not: a set of a material "a<b" would spoil the file.
    """
    copy = dataset.NewInstance()
    copy.ShallowCopy(dataset)
    for arrays in (copy.GetPointData(), copy.GetCellData()):
        for array in [array for array in _arrays(arrays) if array.GetName() != quoted(array.GetName())]:
            renamed = array.NewInstance()
            renamed.ShallowCopy(array)
            renamed.SetName(quoted(array.GetName()))
            arrays.RemoveArray(array.GetName())
            arrays.AddArray(renamed)
    for array in _arrays(copy.GetFieldData()):
        texts = [array.GetValue(row) for row in range(array.GetNumberOfValues())] if _holds_texts(array) else []
        if texts:
            put_numbers(copy, array.GetName(), table_of(texts))
            table = copy.GetFieldData().GetAbstractArray(array.GetName())
            for column, text in enumerate(texts):
                table.SetComponentName(column, _label(text))
    return copy


def _arrays(fields: Any) -> list[Any]:
    return [fields.GetAbstractArray(index) for index in range(fields.GetNumberOfArrays())]


def _holds_texts(array: Any) -> bool:
    return bool(array.IsA("vtkStringArray"))


def restore_texts(dataset: pv.DataObject) -> None:
    """Turn tables of bytes back into text arrays, in place: only where the columns are named by what they hold."""
    for array in _arrays(dataset.GetFieldData()):
        if array.GetDataTypeAsString() == "unsigned char" and array.HasAComponentName():
            texts = _texts(vtk_to_numpy(array))  # type: ignore[no-untyped-call]
            names = [array.GetComponentName(column) for column in range(array.GetNumberOfComponents())]
            if texts is not None and names == [_label(text) for text in texts]:
                put_texts(dataset, array.GetName(), texts)


def table_of(texts: list[str]) -> NDArray[np.uint8]:
    """Return texts as bytes: a text a column, UTF-8, filled up with 0."""
    columns = [text.encode() for text in texts]
    width = max(1, *map(len, columns))
    return np.frombuffer(b"".join(column.ljust(width, b"\0") for column in columns), np.uint8).reshape(-1, width).T


def _texts(table: NDArray[np.uint8]) -> list[str] | None:
    try:
        return [bytes(column).rstrip(b"\0").decode() for column in table.reshape(len(table), -1).T]
    except UnicodeDecodeError:
        return None


def quoted(name: str) -> str:
    """Return a name as it stands in an attribute of XML."""
    return escape(name, quote=False).replace('"', "&quot;")


def _label(text: str) -> str:
    return UNSAFE.sub(" ", text) or " "  # no name at all would tell nothing
