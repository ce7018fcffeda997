"""Solver files through PyVista: ``grid.save("a.inp", analysis="plane strain")``.

The functions are named by the entry point group `pyvista.writers`. There is no reader of ``.inp``: PyVista's own is for
AVS files, and a second one would break it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import imgquad_core as core
from imgquad_core.fe.options import BETWEEN, interface_options

from .datasets.grids import from_grid


def save_grid(dataset: Any, path: str | Path, **options: Any) -> None:
    """Write a plane grid of quads in the format of the extension of `path`.

    Parameters
    ----------
    dataset : pyvista.UnstructuredGrid or pyvista.PolyData
        Quads in a plane of constant z, with the cell array `material` (one material without it) and perhaps the field
        arrays `material_numbers` and `material_names` as `ImageData.imgquad.mesh` gives them.
    path : path
        File to write; replaced only when all of it was written.
    **options
        Of the writer in `imgquad_core.writers`; and before it ``order=2`` (and ``nodes=9``), ``cohesive="all"`` or
        pairs of names (``interfaces="sides"`` for no elements between), ``extrude=thickness`` and ``layers=n``,
        ``split_quads=True`` for triangles; ``interfaces="none"`` leaves out the sides that two materials share.

    Raises
    ------
    InputError
        Cells that are no quads, a grid that is not flat, an unknown option, or what the writer refuses.

    Examples
    --------
    >>> grid.save("part.inp", analysis="plane strain", order=2)  # doctest: +SKIP
    """
    known = ("order", "nodes", "cohesive", "extrude", "layers", "periodic", "split_quads")
    chosen = {name: options.pop(name) for name in known if name in options}
    between = options.pop("interfaces") if options.get("interfaces") in BETWEEN else None
    elements = core.fe.ElementOptions(**chosen, **interface_options(between))
    core.writers.write_mesh(core.fe.make_elements(from_grid(dataset), elements), path, **options)
