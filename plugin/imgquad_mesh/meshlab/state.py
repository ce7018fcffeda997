"""What a script works on: the picture, the boundaries, and layers of meshes wherever they are."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from imgquad_core.errors import InputError
from imgquad_core.measures.quality import quad_areas
from imgquad_core.model import BoundaryGraph, LabelImage, QuadMesh
from imgquad_core.pipeline import Run
from imgquad_core.reading import ReadOptions
from imgquad_mesh.datasets.pictures import read_any

from .layer import Layer
from .meshsets import quad_layer, quad_mesh


class Meshes(Protocol):
    """Layers in order, one of them current: in Python, in a MeshSet, or in the process that has one."""

    def add(self, layer: Layer) -> int:
        """Add a layer, make it the current one, return its id."""

    def set_current(self, mesh: int) -> None:
        """Make another layer the current one."""

    def layer(self, mesh: int | None = None) -> Layer:
        """Return the current layer, or the one with this id."""

    def put(self, layer: Layer) -> int:
        """Put a layer in the place of the current one, return its id."""

    def give(self, do: str, values: NDArray[Any]) -> None:
        """Set points (``move``), a value a face (``set_scalar``) or a colour a face (``set_color``), in place."""

    @property
    def layers(self) -> tuple[list[int], int | None]:
        """Ids of all layers and of the current one."""


class LayerList:
    """The layers of a script that has met no filter of MeshLab yet."""

    def __init__(self) -> None:
        self._layers: list[Layer] = []
        self._current = 0

    def add(self, layer: Layer) -> int:
        """Add a layer, make it the current one, return its id."""
        self._layers.append(layer)
        self._current = len(self._layers) - 1
        return self._current

    def set_current(self, mesh: int) -> None:
        """Make another layer the current one."""
        self._current = mesh

    def layer(self, mesh: int | None = None) -> Layer:
        """Return the current layer, or the one with this id."""
        return self._layers[self._current if mesh is None else mesh]

    def put(self, layer: Layer) -> int:
        """Put a layer in the place of the current one, return its id."""
        self._layers[self._current] = layer
        return self._current

    def give(self, do: str, values: NDArray[Any]) -> None:
        """Set points (``move``), a value a face (``set_scalar``) or a colour a face (``set_color``), in place."""
        part = {"move": "points", "set_scalar": "face_scalar", "set_color": "face_color"}[do]
        changed: dict[str, Any] = {part: values}
        self._layers[self._current] = replace(self._layers[self._current], **changed)

    @property
    def layers(self) -> tuple[list[int], int | None]:
        """Ids of all layers and of the current one."""
        return list(range(len(self._layers))), self._current if self._layers else None


@dataclass
class State:
    """What a script works on.

    Parameters
    ----------
    meshes : Meshes
        The layers.
    image : path, array or LabelImage, optional
        The picture as given.
    folder : Path
        Where the files of the script are.
    """

    meshes: Meshes
    image: Any = None
    folder: Path = field(default_factory=Path)
    labels: LabelImage | None = None
    pixel_boundary: BoundaryGraph | None = None
    boundary: BoundaryGraph | None = None
    run: Run | None = None  # that made a mesh, and knows pixel size and place
    made: dict[int, QuadMesh] = field(default_factory=dict)  # meshes of ours by the id of their layer

    def need_image(self, options: ReadOptions | None = None) -> Any:
        """Return the picture: what its file holds, or what was given."""
        if self.image is None:
            raise InputError("there is no picture; give one as input")
        return read_any(self.image, options) if isinstance(self.image, (str, Path)) else self.image

    def put_labels(self, labels: LabelImage) -> None:
        """Make another labelled picture the current one; boundaries of the former are dropped."""
        self.labels, self.pixel_boundary, self.boundary = labels, None, None

    def put_mesh(self, mesh: QuadMesh) -> None:
        """Add a mesh as the current layer."""
        self.made[self.meshes.add(quad_layer(mesh))] = mesh

    def mesh(self) -> QuadMesh:
        """Return the current layer as a mesh of quads.

        A mesh made here keeps its regions and chains as long as MeshLab's filters leave its quads as they are.
        """
        _, current = self.meshes.layers
        if current is None:
            raise InputError("there is no mesh yet; make one, or give one as input")
        layer = self.meshes.layer()
        made = self.made.get(current)
        if made is not None and np.array_equal(made.quads.ravel(), layer.face_points) and layer.n_faces == made.n_quads:
            return _moved(made, layer)
        return quad_mesh(layer, self.labels.materials if self.labels else None)


def _moved(mesh: QuadMesh, layer: Layer) -> QuadMesh:
    """Return a mesh with the points of its layer, where MeshLab may have moved them."""
    if np.array_equal(mesh.points, layer.points[:, :2]) and not layer.points[:, 2].any():
        return mesh
    if np.ptp(layer.points[:, 2]) > 0.0 or quad_areas(layer.points, mesh.quads).sum() < 0.0:  # tilted or mirrored
        return quad_mesh(layer, mesh.materials)
    return replace(mesh, points=layer.points[:, :2])
