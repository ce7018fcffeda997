"""The accessor `.imgquad` of PyVista's datasets, registered by the entry point group `pyvista.accessors`.

Importing this module registers it and loads nothing else: the core comes with the first call. The methods are the
functions of `imgquad_mesh.filters`, with their signatures and docstrings.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import Signature, signature
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar

import pyvista as pv

from . import filters

if not hasattr(pv, "register_dataset_accessor"):
    raise ImportError(f"imgquad-mesh needs PyVista 0.49 or newer, this is {pv.__version__}: pip install -U pyvista")
D = TypeVar("D")
R = TypeVar("R")
P = ParamSpec("P")


class _Accessor(Generic[D]):
    """Holds the dataset that the filters work on."""

    def __init__(self, dataset: D) -> None:
        self._dataset = dataset


def _method(function: Callable[Concatenate[D, P], R]) -> Callable[Concatenate[_Accessor[D], P], R]:
    """Make a filter a method: the accessor's dataset is its first argument."""

    @wraps(function)
    def method(self: _Accessor[D], /, *args: P.args, **kwargs: P.kwargs) -> R:
        return function(self._dataset, *args, **kwargs)

    own, *others = signature(function).parameters.values()
    method.__signature__ = Signature([own.replace(name="self"), *others])  # type: ignore[attr-defined]
    return method


@pv.register_dataset_accessor("imgquad", pv.ImageData)
class ImageAccessor(_Accessor[pv.ImageData]):
    """From a flat image to its materials, their boundaries and an all-quad mesh."""

    segment = _method(filters.segment)
    remove_noise = _method(filters.remove_noise)
    merge_materials = _method(filters.merge_materials)
    rename_materials = _method(filters.rename_materials)
    recolor_materials = _method(filters.recolor_materials)
    drop_materials = _method(filters.drop_materials)
    boundaries = _method(filters.boundaries)
    mesh = _method(filters.mesh)


class _GridAccessor(_Accessor[Any]):
    """Optimise, measure and draw a mesh of quads."""

    optimize = _method(filters.optimize)
    quality = _method(filters.quality)
    report = _method(filters.report)
    quadratic = _method(filters.quadratic)
    plot = _method(filters.plot)


@pv.register_dataset_accessor("imgquad", pv.PolyData)
class PolyDataAccessor(_GridAccessor):
    """From the boundaries of materials to a mesh; measures of a surface of quads."""

    smooth = _method(filters.smooth)
    quads = _method(filters.quads)


@pv.register_dataset_accessor("imgquad", pv.UnstructuredGrid)
class GridAccessor(_GridAccessor):
    """Optimise, measure and draw a mesh of quads."""

    boundaries = _method(filters.boundaries_of_mesh)
