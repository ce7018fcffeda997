"""The bridge to pymeshlab: meshes into a ``MeshSet`` and out of it, exactly (our filters as its methods: `methods`)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.errors import InputError
from imgquad_core.model import Materials, QuadMesh
from imgquad_core.tracing import trace_mesh
from imgquad_core.whole_files import scratch_folder

from .layer import Layer, layer_of, surface
from .pymeshlab_filters import MissingMeshLab
from .worker import add_layer


def quad_layer(mesh: QuadMesh, label: str = "quad mesh") -> Layer:
    """Return a mesh as a layer: colour and value of each face by its material, and `material` itself."""
    at = np.searchsorted(mesh.materials.labels, mesh.quad_material)
    color = np.concatenate([mesh.materials.colors, np.full((len(mesh.materials.labels), 1), 255, np.uint8)], axis=1)
    return surface(
        mesh.points,
        mesh.quads,
        face_color=color[at],
        face_scalar=mesh.quad_material.astype(float),
        material=mesh.quad_material,
        label=label,
    )


def quad_mesh(layer: Layer, materials: Materials | None = None) -> QuadMesh:
    """Return the mesh of a layer of quads.

    Parameters
    ----------
    layer : Layer
        All its faces must have four corners, in one plane z = constant, and turn the same way.
    materials : Materials, optional
        What the materials are called. Without it they are named by number and coloured by the faces' colours.

    Raises
    ------
    InputError
        When there are no faces, others than quads, the mesh is not plane, folded, or has an inverted quad.
    """
    others = int(np.count_nonzero(layer.face_sizes != 4))
    if layer.n_faces == 0 or others:
        found = f"{others} of {layer.n_faces} faces are no quads" if layer.n_faces else "it has no faces"
        raise InputError(f"layer {layer.label!r} is not a mesh of quads: {found}")
    if np.ptp(layer.points[:, 2]) > 0.0:
        low, high = layer.points[:, 2].min(), layer.points[:, 2].max()
        raise InputError(f"layer {layer.label!r} is not plane: z from {low:g} to {high:g}; flatten it first")
    material = face_materials(layer, materials)
    if materials is None:
        materials = _named_by_number(material, layer.face_color)
    used, corners = np.unique(layer.face_points, return_inverse=True)
    return trace_mesh(layer.points[used, :2], corners.reshape(-1, 4), material, materials)


def face_materials(layer: Layer, materials: Materials | None = None) -> NDArray[np.int32]:
    """Return the material of each face of a layer.

    Filters of MeshLab that make new layers lose the attribute `material`; then the colours of `materials` tell it, then
    whole-numbered values of the faces, then different colours; all 0 where there is nothing to go by.
    """
    if layer.material is not None:
        return layer.material
    if (
        materials is not None
        and layer.face_color is not None
        and len(np.unique(materials.colors, axis=0)) == len(materials.labels)
    ):
        same = (layer.face_color[:, None, :3] == materials.colors[None]).all(axis=2)
        if same.any(axis=1).all():
            return np.asarray(materials.labels[np.argmax(same, axis=1)])
    scalar = layer.face_scalar
    if scalar is not None and (scalar == np.rint(scalar)).all() and np.abs(scalar).max(initial=0.0) < 2**31:
        return scalar.astype(np.int32)
    if layer.face_color is not None:
        _, number = np.unique(layer.face_color, axis=0, return_inverse=True)
        return number.ravel().astype(np.int32)
    return np.zeros(layer.n_faces, np.int32)


def _named_by_number(material: NDArray[np.int32], color: NDArray[np.uint8] | None) -> Materials:
    labels, first = np.unique(material, return_index=True)
    colors = color[first, :3] if color is not None else np.repeat(labels[:, None] * 37 % 256, 3, axis=1)
    return Materials(labels, tuple(f"material {n}" for n in labels), colors)


def to_meshset(mesh: QuadMesh, meshset: Any = None, label: str = "quad mesh") -> Any:
    """Put a mesh into a ``pymeshlab.MeshSet``, without loss.

    Parameters
    ----------
    mesh : QuadMesh
        The mesh.
    meshset : pymeshlab.MeshSet, optional
        Gets the mesh as its new current layer; a new one without it.
    label : str
        Name of the layer.

    Returns
    -------
    pymeshlab.MeshSet
        Coordinates in double precision, quads in order, face colours by material, the material's number as face value
        (``fq`` in expressions) and as custom face attribute ``material``.

    Raises
    ------
    MissingMeshLab
        When pymeshlab cannot be imported.
    """
    meshset = new_meshset() if meshset is None else meshset
    add_to(meshset, quad_layer(mesh, label))
    return meshset


def from_meshset(meshset: Any, materials: Materials | None = None) -> QuadMesh:
    """Take the current layer of a ``pymeshlab.MeshSet`` as a mesh.

    Parameters
    ----------
    meshset : pymeshlab.MeshSet
        Its current layer must be a plane mesh of quads.
    materials : Materials, optional
        What the materials are called, see `face_materials`.

    Returns
    -------
    QuadMesh
        Points and quads in MeshLab's order, without points of no quad; regions and chains are found anew.

    Raises
    ------
    InputError
        When there is no layer, or it has other faces than quads or is not plane.
    """
    if meshset.mesh_number() == 0:
        raise InputError("the MeshSet is empty; load or make a mesh first")
    return quad_mesh(layer_of(meshset.current_mesh()), materials)


def new_meshset() -> Any:
    """Return a new ``pymeshlab.MeshSet``; MissingMeshLab where there is no pymeshlab."""
    try:
        import pymeshlab  # an extra
    except ImportError as error:
        raise MissingMeshLab(
            f"pymeshlab cannot be imported ({error}); pip install 'imgquad-mesh[meshlab]' and "
            "apt-get install libgl1 libopengl0"
        ) from error
    return pymeshlab.MeshSet()


def add_to(meshset: Any, layer: Layer) -> int:
    """Put a layer into a MeshSet; it becomes the current one. Return its id."""
    with scratch_folder() as folder:
        return add_layer(meshset, layer, folder)
