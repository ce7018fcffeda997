"""Every parameter of filters.xml refuses nonsense in the filters, the way PyVista's own filters do."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from typing import Any, Literal, get_args

import pytest

from imgquad_core import MeshOptions
from imgquad_core.boundary import ExtractionOptions, SmoothingOptions
from imgquad_core.cleanup import OptimizationOptions
from imgquad_core.declared import declarations
from imgquad_core.mesher import MeshingOptions
from imgquad_core.picture import SegmentationOptions
from imgquad_mesh import filters
from imgquad_mesh.spec import Parameter
from imgquad_mesh.spec import filters as described
from support.images import point_image

IMAGE = point_image()
LINES = IMAGE.imgquad.boundaries()
SMOOTH = LINES.imgquad.smooth()

#: our filter of each filter in filters.xml that makes or changes an image, boundaries or a mesh
CALLS: dict[str, Callable[..., Any]] = {
    "compute_label_by_color_clustering_per_pixel": lambda **k: filters.segment(IMAGE, **k),
    "apply_label_noise_removal_per_pixel": lambda **k: filters.remove_noise(IMAGE, **k),
    "apply_material_merge_per_pixel": lambda **k: filters.merge_materials(IMAGE, **k),
    "set_material_names_of_image": lambda **k: filters.rename_materials(IMAGE, **k),
    "set_material_colors_of_image": lambda **k: filters.recolor_materials(IMAGE, **k),
    "delete_material_from_image": lambda **k: filters.drop_materials(IMAGE, k["drop"]),
    "generate_polyline_from_material_boundaries": lambda **k: filters.boundaries(IMAGE, **k),
    "apply_coord_material_boundary_smoothing": lambda **k: filters.smooth(LINES, **k),
    "generate_quad_mesh_from_material_boundaries": lambda **k: filters.quads(SMOOTH, **k),
    "generate_quad_mesh_from_image": lambda **k: filters.mesh(IMAGE, **k),
}
#: PyVista has its own ways: extract_subset, spacing, and the image is in memory already
ELSEWHERE = {
    "crop",
    "pixel_size",
    "origin",
    "max_pixels",
    "frame",
    "channel",
    "level",
    "scalars",
    "info_bar",
    "grain_angle",
}

NONSENSE: dict[str, list[Any]] = {
    "Real": ["x", float("nan"), float("inf"), -1, 1j, [1, 2], {}],
    "Int": ["x", float("nan"), 2.5, 0, -1, [1, 2]],
    "Boolean": ["yes", 1, None],
    "Enum": ["nonsense", 7, None],
}
NONSENSE_TEXTS: dict[str, list[Any]] = {
    "colors": ["blue", 0, 1000, 2.5, [(1, 2)], [(1, 2, 300)], None],
    "boundary_size": ["x", -1, 0, float("nan"), [1]],
    "material_sizes": ["x", 3, {1: "x"}, {1: -1}, {1: 0}, {1.5: 2}, {77: 1}, {"gold": 1}, {1: float("inf")}],
    "min_pixels": ["x", -1, 2.5, float("nan"), None],
    "min_length": ["x", -1, float("nan"), None],
    "drop": [3, [1.5], ["gold"], [77], None],
    "merge": ["x", 3, {1: "a"}, {(0, 1): 2}, {(0, 1): ""}, {(0,): "a"}, {(0, 77): "a"}, {("gold", 0): "a"}],
    "rename": ["x", 3, {1: 2}, {1: ""}, {77: "a"}, {"gold": "a"}, {1.5: "a"}, {0: "a", 1: "a"}],
    "recolor": ["x", 3, {1: "no colour"}, {1: 1e9}, {77: "red"}, {"gold": "red"}, {1.5: "red"}],
    "keep": [3, [1.5], ["gold"], [77], None],
    "marks": [3, [[1, 2]], [[[1]]]],
    "threads": ["x", float("nan"), 2.5, -1, [1, 2]],
    "no_data": ["x", float("nan"), float("inf"), [1], {}],
    "fill_void": ["x", -1, 2.5, float("nan"), None],
    "frame_size": ["x", -1, 0, float("nan"), [1]],
    "sizes_between": ["x", 3, {1: 2}, {(0, 1): -1}, {(0, 1): "x"}, {(0, 77): 1}, {("gold", 0): 1}],
    "step": ["x", 0, -1, (1, 2, 3), (1, 0), float("nan"), None],
    "join": ["x", -1, float("nan"), [1]],
    "tolerance": ["x", -1, float("nan"), float("inf"), None, [1]],
}


def cases() -> Iterator[Any]:
    for name, call in CALLS.items():
        for parameter in described()[name].parameters:
            if parameter.field not in ELSEWHERE:
                yield pytest.param(call, parameter, id=f"{name.split('_from_')[-1]}-{parameter.field}")


@pytest.mark.parametrize(("call", "parameter"), list(cases()))
def test_nonsense_is_refused_by_name(call: Callable[..., Any], parameter: Parameter) -> None:
    name = parameter.field
    table = NONSENSE_TEXTS.get(name) or NONSENSE[parameter.kind]
    if call is CALLS["generate_quad_mesh_from_material_boundaries"]:
        table = [bad for bad in table if bad is not None]
    if name == "drop" and call is CALLS["delete_material_from_image"]:
        table = [bad for bad in table if bad != 3] + [77]
    for bad in table:
        with pytest.raises((TypeError, ValueError)) as caught:
            call(**{name: bad})
        said = str(caught.value)
        assert name in said or "material" in said or name.replace("_", " ") in said, f"{bad!r}: {said}"
    if parameter.low is not None and parameter.high is not None:
        for bad in (parameter.low - 0.001, parameter.high + 0.001):
            with pytest.raises(ValueError, match=f"{name} values must all be"):
                call(**{name: bad})


def test_every_parameter_of_filters_xml_is_a_parameter_here() -> None:
    functions = (
        filters.segment,
        filters.remove_noise,
        filters.merge_materials,
        filters.rename_materials,
        filters.recolor_materials,
        None,
        filters.boundaries,
        filters.smooth,
        filters.quads,
        filters.mesh,
    )
    for name, function in zip(CALLS, functions, strict=True):
        if function is not None:
            fields = {p.field for p in described()[name].parameters} - ELSEWHERE
            assert fields <= set(inspect.signature(function).parameters), name


#: filters of PyVista, and the options whose declarations they follow
FOLLOWED: dict[Callable[..., Any], type] = {
    filters.segment: SegmentationOptions,
    filters.remove_noise: MeshOptions,
    filters.boundaries: ExtractionOptions,
    filters.smooth: SmoothingOptions,
    filters.quads: MeshingOptions,
    filters.mesh: MeshOptions,
    filters.optimize: OptimizationOptions,
}


def drift(function: Callable[..., Any], options: type) -> list[str]:
    """What signature and docstring of a filter say differently than the options that it makes."""
    found = []
    for name, parameter in inspect.signature(function).parameters.items():
        declared = declarations(options).get(name)
        if declared is None:
            continue
        none = parameter.default is None  # the filter has a default of its own, or says None for an empty mapping
        if not none and parameter.default != declared.default:
            found.append(f"{name} is {parameter.default!r}, not {declared.default!r}")
        told = re.search(rf"^ *(?:\w+, )?{name}(?:, \w+)? : .*?(?:default: (.*))?$", function.__doc__ or "", re.M)
        if told is None:
            found.append(f"{name} is not in the docstring")
        elif told[1] and told[1].strip('"') != str(declared.default):
            found.append(f"{name} is {told[1]} in the docstring, not {declared.default!r}")
        choices = get_args(eval(parameter.annotation, function.__globals__)) if declared.choices else ()
        if choices != declared.choices:
            found.append(f"{name} takes {choices}, not {declared.choices}")
    return found


@pytest.mark.parametrize(("function", "options"), FOLLOWED.items(), ids=lambda each: each.__name__)
def test_signatures_say_what_the_options_declare(function: Callable[..., Any], options: type) -> None:
    assert drift(function, options) == []


def test_a_drift_is_found() -> None:
    def filter_of_one(
        size: float = 5.0, effort: Literal["fast", "best"] = "normal", growth: float = 1.3, max_shift: float = 1.0
    ) -> None:
        """Do something.

        Parameters
        ----------
        size : float, default: 4.0
        effort : "fast" | "best", default: "normal"
        growth : float, default: 1.4
        """

    assert drift(filter_of_one, MeshOptions) == [
        "size is 5.0, not 4.0",
        "effort takes ('fast', 'best'), not ('fast', 'normal', 'best')",
        "growth is 1.4 in the docstring, not 1.3",
        "max_shift is not in the docstring",
    ]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: IMAGE.imgquad.mesh(size=None), "size must be a number. Got <class 'NoneType'> instead."),
        (lambda: IMAGE.imgquad.mesh(policy="x"), "policy 'x' is not valid. policy must be one of:"),
        (lambda: IMAGE.imgquad.mesh(unit="metre"), "unit 'metre' is not valid. unit must be one of:"),
        (lambda: IMAGE.imgquad.mesh(progress_bar=1), "progress_bar must be an instance of <class 'bool'>."),
        (lambda: IMAGE.imgquad.mesh(size=0), "size values must all be greater than 0.0."),
        (lambda: IMAGE.imgquad.mesh(size=0.01), "size is 0.01; give a length of at least 0.05 px"),
        (lambda: IMAGE.imgquad.mesh(threads=-1), "threads is -1; give a whole number of at least 0"),
        (lambda: SMOOTH.imgquad.quads().imgquad.optimize(effort="x"), "effort 'x' is not valid."),
        (lambda: SMOOTH.imgquad.quads().imgquad.plot("area"), "scalars 'area' is not valid."),
        (lambda: IMAGE.imgquad.mesh("label", 3), "takes from 1 to 2 positional arguments but 3 were given"),
    ],
)
def test_messages(call: Callable[[], Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError)) as caught:
        call()
    assert message in str(caught.value)
