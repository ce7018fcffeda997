"""Our ``.vtu`` files through PyVista: ``pv.read("rock.vtu").field_data["material_names"]`` are texts.

Named by the entry point group `pyvista.readers.override`. Other files are read as PyVista's own reader reads them.
"""

from __future__ import annotations

import pyvista as pv

from .datasets.field_texts import restore_texts


class GridReader(pv.XMLUnstructuredGridReader):
    """PyVista's reader of ``.vtu``; text arrays that were written as bytes for others are texts again."""

    def read(self, *, validate: bool | None = None) -> pv.UnstructuredGrid:
        """Read the file, see `pyvista.BaseReader.read`."""
        grid = super().read(validate=validate)
        restore_texts(grid)
        return grid
