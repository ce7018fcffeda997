"""The accessor `.imgquad` of PyVista's datasets, registered by the entry point group `pyvista.accessors`.

Importing this module registers it and loads nothing else: the core comes with the first call.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import pyvista as pv

if not hasattr(pv, "register_dataset_accessor"):
    raise ImportError(f"imgquad-mesh needs PyVista 0.48 or newer, this is {pv.__version__}: pip install -U pyvista")


@pv.register_dataset_accessor("imgquad", pv.ImageData)
class ImageAccessor:
    """All-quad meshes of images."""

    def __init__(self, image: pv.ImageData) -> None:
        self._image = image

    def mesh(
        self,
        scalars: str | None = None,
        *,
        size: float = 4.0,
        boundary_size: float | None = None,
        material_sizes: Mapping[str | int, float] | None = None,
        growth: float = 1.3,
        colors: Literal["auto", "exact"] | int | Sequence[Any] = "auto",
        min_pixels: int | Literal["auto"] = "auto",
        min_length: float | Literal["auto"] = "auto",
        policy: str = "minority",
        edge_ratio: float = 1.2,
        max_shift: float = 1.0,
        drop: Sequence[str | int] = (),
        drop_transparent: bool = False,
        periodic: str = "none",
        effort: str = "normal",
        threads: int = 1,
        progress_bar: bool = False,
    ) -> pv.UnstructuredGrid:
        """Mesh the materials of a flat image with quadrilaterals.

        Parameters
        ----------
        scalars : str, optional
            Name of scalars to process: material numbers, greys, or RGB(A), of points or cells. Defaults to currently
            active scalars.
        size : float, default: 4.0
            Length of the final edges, in pixels.
        boundary_size : float, optional
            The same on boundaries.
        material_sizes : mapping, optional
            The same in single materials, by name or number.
        growth : float, default: 1.3
            Largest ratio of the sizes of neighbouring elements.
        colors : "auto" | "exact" | int | sequence, default: "auto"
            How colours become materials.
        min_pixels, min_length : "auto" | float, default: "auto"
            Clusters of fewer pixels that are also shorter are removed.
        policy : str, default: "minority"
            Which pair is joined at an ambiguous corner of four pixels.
        edge_ratio : float, default: 1.2
            Largest ratio of the lengths of neighbouring edges on a boundary.
        max_shift : float, default: 1.0
            How far smoothing moves a boundary at most, in pixels.
        drop : sequence, optional
            Materials that are left out, by name or number.
        drop_transparent : bool, default: False
            Leave pixels of alpha 0 out, too.
        periodic : "none" | "x" | "y" | "xy", default: "none"
            Opposite sides get nodes at the same places, for a periodic cell.
        effort : "fast" | "normal" | "best", default: "normal"
            How far the mesh is optimised.
        threads : int, default: 1
            Threads of the meshing stage.
        progress_bar : bool, default: False
            Display a progress bar.

        Returns
        -------
        pyvista.UnstructuredGrid
            VTK_QUAD cells with the cell arrays ``material`` (int32, active) and ``region``, and the field arrays
            ``material_numbers``, ``material_names`` and ``material_colors``. It covers the bounds that
            :meth:`pyvista.ImageDataFilters.points_to_cells` gives the image (those of a cell image itself).

        Examples
        --------
        >>> import numpy as np
        >>> import pyvista as pv
        >>> image = pv.ImageData(dimensions=(60, 40, 1))
        >>> image["label"] = (np.hypot(*(image.points[:, :2] - (30, 20)).T) < 12).astype(int)
        >>> mesh = image.imgquad.mesh("label", size=3)
        >>> mesh.bounds[:4]
        (-0.5, 59.5, -0.5, 39.5)
        """
        from imgquad_core.pipeline import MeshOptions, run
        from imgquad_mesh.cli.console import progress_bar_if
        from imgquad_mesh.convert import image_array, image_placement, to_grid

        options = MeshOptions(
            size=size,
            boundary_size=boundary_size,
            material_sizes=dict(material_sizes or {}),
            growth=growth,
            colors=colors,
            min_pixels=min_pixels,
            min_length=min_length,
            policy=policy,
            edge_ratio=edge_ratio,
            max_shift=max_shift,
            drop=tuple(drop),
            drop_transparent=drop_transparent,
            periodic=periodic,
            effort=effort,
            threads=threads,
        )
        with progress_bar_if(progress_bar) as progress:
            made = run(image_array(self._image, scalars), options, progress)
        return to_grid(made.mesh, image_placement(self._image, scalars))
