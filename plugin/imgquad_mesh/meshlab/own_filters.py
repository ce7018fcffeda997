"""What each of our filters does to the picture and the meshes of a script: one function a filter."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from imgquad_core import MeshOptions, pipeline
from imgquad_core.boundary import ExtractionOptions, SmoothingOptions
from imgquad_core.cleanup import OptimizationOptions, optimize
from imgquad_core.declared import check, option, same_as
from imgquad_core.errors import InputError
from imgquad_core.fe import ElementOptions, fe_mesh
from imgquad_core.fe.properties import read_properties
from imgquad_core.measures import (
    aspect,
    corner_angles,
    material_areas,
    quad_areas,
    quality_report,
    scaled_jacobian,
)
from imgquad_core.mesher import MeshingOptions, triangulator_used
from imgquad_core.model import BoundaryGraph, LabelImage, QuadMesh
from imgquad_core.picture import (
    Box,
    DenoiseOptions,
    EditOptions,
    SegmentationOptions,
    crop_image,
    drop_materials,
    edit_materials,
    list_removed,
    remove_noise,
    sizes_by_number,
    sizes_by_numbers,
)
from imgquad_mesh.outputs.files import check_target, mesh_extensions, write_labels, write_mesh_file, write_run

from .crosscheck import boundary_lengths, material_perimeters
from .layer import polyline
from .meshsets import face_materials, quad_layer
from .state import State


@dataclass(frozen=True)
class CropOptions:
    """The part of a picture that stays: left, upper, right, lower bound in pixels, from the upper left corner."""

    crop: Box | None = same_as(MeshOptions, "crop")


@dataclass(frozen=True)
class DropOptions:
    """Names or numbers of the materials that are left out."""

    drop: tuple[str, ...] = same_as(MeshOptions, "drop")


@dataclass(frozen=True)
class MergeOptions:
    """Names or numbers of materials that become one, and its name."""

    merge: Mapping[tuple[str, ...], str] = same_as(MeshOptions, "merge")


@dataclass(frozen=True)
class RenameOptions:
    """New names of materials, by their names or numbers."""

    rename: Mapping[str, str] = same_as(MeshOptions, "rename")


@dataclass(frozen=True)
class RecolorOptions:
    """New colours of materials, by their names or numbers."""

    recolor: Mapping[str, tuple[int, int, int]] = same_as(MeshOptions, "recolor")


@dataclass(frozen=True)
class QualityOptions:
    """Which measure each quad gets as its value."""

    metric: str = option(
        "scaled Jacobian",
        "scaled Jacobian: least sine of the corner angles, 1 for a rectangle, 0 or less for an invalid quad. Angles in "
        "degrees. aspect: longest by shortest edge. area: in the unit of the mesh, squared",
        choices=("scaled Jacobian", "least angle", "largest angle", "aspect", "area"),
    )


@dataclass(frozen=True)
class NoOptions:
    """A filter without parameters."""


@dataclass(frozen=True)
class MeshFileOptions:
    """Where the mesh is written (the extension names the format), and of which elements: see `ElementOptions`."""

    file_name: str = option(
        "mesh.vtu",
        "a file in the script's folder or below. Its extension names the format: .vtu .vtk for ParaView and PyVista, "
        ".inp for Abaqus and CalculiX, .msh for Gmsh, .bdf for Nastran, .e for Exodus, .obj .off .ply .stl for mesh "
        "apps, .svg .dxf for drawings, and more",
    )
    order: int = same_as(ElementOptions, "order")
    nodes: int = same_as(ElementOptions, "nodes")
    cohesive: str | tuple[tuple[str, str], ...] | None = same_as(ElementOptions, "cohesive")
    extrude: float | None = same_as(ElementOptions, "extrude")
    layers: int = same_as(ElementOptions, "layers")
    periodic: str = same_as(
        MeshOptions, "periodic", help="directions in which opposite nodes are tied, of a mesh that is periodic in them"
    )
    analysis: str = option(
        "", "plane stress, plane strain, axisymmetric or heat, in files of Abaqus, Nastran and Ansys; empty: the first"
    )
    deck: str = option("", "tension or thermal: a model that CalculiX runs as it is, in .inp files; empty: the mesh")
    properties: str = option("", "values of the materials, a TOML file in the script's folder or below; empty: none")

    def __post_init__(self) -> None:
        check(self)
        self.elements()  # checks the values

    def elements(self) -> ElementOptions:
        """Return the elements that are asked for."""
        periodic = None if self.periodic == "none" else self.periodic
        return ElementOptions(self.order, self.nodes, self.cohesive, self.extrude, self.layers, periodic)

    def of_writer(self, folder: Path) -> dict[str, Any]:
        """Return the options of the writer that are asked for."""
        given: dict[str, Any] = {"analysis": self.analysis, "deck": self.deck}
        if self.properties:
            given["properties"] = read_properties(script_path(self.properties, folder))
        return {name: value for name, value in given.items() if value}


@dataclass(frozen=True)
class LabelFileOptions:
    """Where the labelled picture is written."""

    file_name: str = option(
        "labels.npy",
        "a file in the script's folder or below: .npy (int32 array, row 0 on top) or .png (palette picture)",
    )


def _segment(state: State, options: SegmentationOptions) -> dict[str, Any]:
    found = pipeline.segment_source(pipeline.read_source(state.need_image()), options)
    state.put_labels(found.image)
    return {"note": found.note, **_label_counts(found.image)}


def _labels(state: State) -> LabelImage:
    """Return the labelled picture; the picture is segmented with the defaults where no filter has done it."""
    if state.labels is None:
        _segment(state, SegmentationOptions())
    assert state.labels is not None
    return state.labels


def _pixel_boundary(state: State) -> BoundaryGraph:
    """Return the pixel boundary, extracted with the defaults where no filter has done it."""
    if state.pixel_boundary is None:
        _extract(state, ExtractionOptions())
    assert state.pixel_boundary is not None
    return state.pixel_boundary


def _label_counts(image: LabelImage) -> dict[str, Any]:
    pixels = {image.materials.name_of(number): count for number, count in image.pixels.items()}
    return {"materials_number": len(pixels), "pixels": pixels}


def _remove_noise(state: State, options: DenoiseOptions) -> dict[str, Any]:
    before = _labels(state)
    after = remove_noise(before, options)
    state.put_labels(after)
    removed = list_removed(before, after, options.policy)
    return {"removed_clusters": sum(r.clusters for r in removed), "removed_pixels": sum(r.pixels for r in removed)}


def _crop(state: State, options: CropOptions) -> dict[str, Any]:
    image = _labels(state)
    state.put_labels(crop_image(image, options.crop) if options.crop else image)
    return {"rows": _labels(state).shape[0], "columns": _labels(state).shape[1]}


def _drop(state: State, options: DropOptions) -> dict[str, Any]:
    state.put_labels(drop_materials(_labels(state), options.drop))
    return _label_counts(_labels(state))


def _edit(state: State, options: MergeOptions | RenameOptions | RecolorOptions) -> dict[str, Any]:
    state.put_labels(edit_materials(_labels(state), EditOptions(**vars(options))))
    return _label_counts(_labels(state))


def _extract(state: State, options: ExtractionOptions) -> dict[str, Any]:
    state.pixel_boundary, state.boundary = pipeline.extract(_labels(state), options), None
    return _put_boundary(state, state.pixel_boundary, "pixel boundary")


def _smooth(state: State, options: SmoothingOptions) -> dict[str, Any]:
    between = sizes_by_numbers(_labels(state).materials, options.sizes_between or {})
    numbered = replace(_numbered(options, state), sizes_between=between or None)
    state.boundary = pipeline.smooth(_pixel_boundary(state), numbered)
    return _put_boundary(state, state.boundary, "smoothed boundary")


Sized = TypeVar("Sized", SmoothingOptions, MeshingOptions)


def _numbered(options: Sized, state: State) -> Sized:
    """Return the options with materials by number, which scripts may call by name."""
    sizes = sizes_by_number(_labels(state).materials, options.material_sizes or {})
    return replace(options, material_sizes=sizes or None)


def _put_boundary(state: State, graph: BoundaryGraph, label: str) -> dict[str, Any]:
    state.meshes.add(polyline(graph.points, graph.segments, label=label))
    return {
        "chains_number": graph.n_chains,
        "regions_number": len(graph.region_label),
        "points_number": len(graph.points),
    }


def _mesh_boundary(state: State, options: MeshingOptions) -> dict[str, Any]:
    if state.boundary is None:
        smoothing = SmoothingOptions(size=options.size, growth=options.growth, material_sizes=options.material_sizes)
        _smooth(state, smoothing)
    assert state.boundary is not None
    _, mesh = pipeline.fill_boundaries(state.boundary, _numbered(options, state), _labels(state).materials)
    state.put_mesh(mesh)
    return _size_of(mesh) | {"triangulator": triangulator_used(options.triangulator)}


def _mesh_image(state: State, options: MeshOptions) -> dict[str, Any]:
    done = pipeline.run(state.labels if state.labels is not None else state.need_image(options.reading()), options)
    state.labels, state.pixel_boundary, state.boundary = done.labels, done.pixel_boundary, done.boundary
    state.run = done
    state.put_mesh(done.mesh)
    return _size_of(done.mesh) | {"triangulator": triangulator_used(options.triangulator)}


def _optimize(state: State, options: OptimizationOptions) -> dict[str, Any]:
    before = state.mesh()
    after = optimize(before, options)
    state.made[state.meshes.put(quad_layer(after, state.meshes.layer().label))] = after
    return {f"{name}_{when}": value for when, mesh in (("before", before), ("after", after))
            for name, value in _shape_of(mesh).items()}  # fmt: skip


def _shape_of(mesh: QuadMesh) -> dict[str, Any]:
    report = quality_report(mesh)
    return {"quads_number": report.n_quads, "min_scaled_jacobian": report.min_sj, "irregular_nodes": report.irregular}


def _size_of(mesh: QuadMesh) -> dict[str, Any]:
    return {"quads_number": mesh.n_quads, "points_number": mesh.n_points}


_METRICS: Mapping[str, Callable[[NDArray[np.float64], NDArray[np.int64]], NDArray[np.float64]]] = {
    "scaled Jacobian": scaled_jacobian,
    "least angle": lambda points, quads: corner_angles(points, quads).min(axis=1),
    "largest angle": lambda points, quads: corner_angles(points, quads).max(axis=1),
    "aspect": aspect,
    "area": quad_areas,
}


def _quality_per_face(state: State, options: QualityOptions) -> dict[str, Any]:
    mesh = state.mesh()
    values = _METRICS[options.metric](mesh.points, mesh.quads)
    state.meshes.give("set_scalar", values)
    return {"min": float(values.min()), "max": float(values.max()), "avg": float(values.mean())}


def _boundaries_of_mesh(state: State, options: NoOptions) -> dict[str, Any]:
    mesh = state.mesh()
    used, ends = np.unique(mesh.constraints, return_inverse=True)
    layer = polyline(mesh.points[used], ends.reshape(-1, 2), label="boundaries of the quad mesh")
    _, current = state.meshes.layers
    state.meshes.add(layer)
    if current is not None:
        state.meshes.set_current(current)
    return {"chains_number": len(mesh.chain_offsets) - 1, "edges_number": len(mesh.constraints)}


def _color_per_face(state: State, options: NoOptions) -> dict[str, Any]:
    layer = state.meshes.layer()
    materials = state.labels.materials if state.labels else None
    if materials is None:
        materials = state.mesh().materials
    numbers = face_materials(layer, materials)
    at = np.searchsorted(materials.labels, numbers).clip(max=len(materials.labels) - 1)
    colors = np.concatenate([materials.colors[at], np.full((len(at), 1), 255, np.uint8)], axis=1)
    state.meshes.give("set_color", colors)
    return {"materials_number": len(np.unique(numbers))}


def _measure_quality(state: State, options: NoOptions) -> dict[str, Any]:
    return asdict(quality_report(state.mesh()))


def _measure_materials(state: State, options: NoOptions) -> dict[str, Any]:
    mesh = state.mesh()
    areas, perimeters = material_areas(mesh), material_perimeters(mesh)
    border, interface = boundary_lengths(mesh)
    materials = {
        mesh.materials.name_of(n): {
            "number": n,
            "quads_number": int(np.count_nonzero(mesh.quad_material == n)),
            "regions_number": int(np.count_nonzero(mesh.region_label == n)),
            "area": area,
            "perimeter": perimeters[n],
        }
        for n, area in areas.items()
    }
    return {"materials": materials, "border_length": border, "interface_length": interface}


def _list_sets(state: State, options: NoOptions) -> dict[str, Any]:
    mesh = fe_mesh(state.mesh())
    return {
        "elements": {name: len(ids) for name, ids in mesh.material_cells().items()},
        "nodes": {name: len(ids) for name, ids in mesh.node_sets.items()},
        "sides": {name: len(ids) for name, ids in mesh.side_sets.items()},
    }


def _save_mesh(state: State, options: MeshFileOptions) -> dict[str, Any]:
    path = script_path(options.file_name, state.folder)
    mesh, elements, of_writer = state.mesh(), options.elements(), options.of_writer(state.folder)
    if state.run is not None and mesh is state.run.mesh:
        write_run(state.run, path, elements, **of_writer)
    else:
        write_mesh_file(mesh, path, elements, **of_writer)
    return {"file": str(path)}


def _save_labels(state: State, options: LabelFileOptions) -> dict[str, Any]:
    path = script_path(options.file_name, state.folder)
    write_labels(_labels(state), path)
    return {"file": str(path)}


def script_path(name: str, folder: Path) -> Path:
    """Return the path of a file that a script names: inside the script's folder, or `InputError`."""
    path = (folder / name).resolve()
    if not name or not path.is_relative_to(folder.resolve()):
        raise InputError(f"the file {name!r} is outside {folder.resolve()}, the script's folder; name one inside it")
    return path


def check_output(function: str, name: str, folder: Path) -> None:
    """Raise `InputError` now if a filter could not write the file that a script names."""
    labels = function == "export_label_image_to_file"
    check_target(script_path(name, folder), (".npy", ".png") if labels else mesh_extensions())


class Step(NamedTuple):
    """Options of a filter and what it does; the dictionary is what the filter returns."""

    options: type[Any]
    run: Callable[[State, Any], dict[str, Any]]


#: by Python name, as in ``filters.xml``
STEPS: Mapping[str, Step] = {
    "compute_label_by_color_clustering_per_pixel": Step(SegmentationOptions, _segment),
    "apply_label_noise_removal_per_pixel": Step(DenoiseOptions, _remove_noise),
    "apply_label_crop_per_pixel": Step(CropOptions, _crop),
    "apply_material_merge_per_pixel": Step(MergeOptions, _edit),
    "set_material_names_of_image": Step(RenameOptions, _edit),
    "set_material_colors_of_image": Step(RecolorOptions, _edit),
    "delete_material_from_image": Step(DropOptions, _drop),
    "generate_polyline_from_material_boundaries": Step(ExtractionOptions, _extract),
    "apply_coord_material_boundary_smoothing": Step(SmoothingOptions, _smooth),
    "generate_quad_mesh_from_material_boundaries": Step(MeshingOptions, _mesh_boundary),
    "generate_quad_mesh_from_image": Step(MeshOptions, _mesh_image),
    "meshing_quad_cleanup": Step(OptimizationOptions, _optimize),
    "compute_scalar_by_quad_quality_per_face": Step(QualityOptions, _quality_per_face),
    "generate_polyline_from_quad_mesh": Step(NoOptions, _boundaries_of_mesh),
    "compute_color_by_material_per_face": Step(NoOptions, _color_per_face),
    "get_quad_quality_measures": Step(NoOptions, _measure_quality),
    "get_material_statistics": Step(NoOptions, _measure_materials),
    "get_quad_mesh_sets": Step(NoOptions, _list_sets),
    "export_quad_mesh_to_file": Step(MeshFileOptions, _save_mesh),
    "export_label_image_to_file": Step(LabelFileOptions, _save_labels),
}
