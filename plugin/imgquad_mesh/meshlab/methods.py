"""Our filters as methods of ``pymeshlab.MeshSet``, beside MeshLab's own. Opt-in: all who use pymeshlab get them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

from numpy.typing import NDArray

from imgquad_core.errors import InputError
from imgquad_mesh.spec import Filter, filters
from imgquad_mesh.texts import options_from

from . import worker
from .layer import Layer, layer_of
from .meshsets import add_to, new_meshset
from .own_filters import STEPS
from .state import State


class MeshSetLayers:
    """The layers of a MeshSet in this process."""

    def __init__(self, meshset: Any) -> None:
        self._meshset = meshset

    def add(self, layer: Layer) -> int:
        """Add a layer, make it the current one, return its id."""
        return add_to(self._meshset, layer)

    def set_current(self, mesh: int) -> None:
        """Make another layer the current one."""
        self._meshset.set_current_mesh(mesh)

    def layer(self, mesh: int | None = None) -> Layer:
        """Return the current layer, or the one with this id."""
        return layer_of(self._meshset.current_mesh() if mesh is None else self._meshset.mesh(mesh))

    def put(self, layer: Layer) -> int:
        """Put a layer in the place of the current one, return its id."""
        former = int(self._meshset.current_mesh_id())
        mesh = self.add(layer)
        worker.delete_layer(self._meshset, former)
        return mesh

    def give(self, do: str, values: NDArray[Any]) -> None:
        """Change the current mesh in place; see `imgquad_mesh.meshlab.worker.give`."""
        worker.give(self._meshset, do, values)

    @property
    def layers(self) -> tuple[list[int], int | None]:
        """Ids of all layers and of the current one."""
        ids = [int(mesh.id()) for mesh in self._meshset]
        return ids, int(self._meshset.current_mesh_id()) if ids else None


#: what our filters keep of each MeshSet between calls: the labelled picture, the boundaries
_STATES: WeakKeyDictionary[Any, State] = WeakKeyDictionary()


def install_meshlab_filters() -> tuple[str, ...]:
    """Make our filters methods of ``pymeshlab.MeshSet``.

    Returns
    -------
    tuple of str
        Their names.

    Raises
    ------
    MissingMeshLab
        When pymeshlab cannot be imported.

    Notes
    -----
    Parameters are MeshLab-like (``maxshift=1``) or ours (``max_shift=1``). Filters that work on a picture also take
    ``image``: a path, an array or a LabelImage, kept for the calls that follow. ``ms.apply_filter`` and MeshLab's own
    way of running scripts do not know them.

    Examples
    --------
    >>> import imgquad_mesh, pymeshlab  # doctest: +SKIP
    >>> imgquad_mesh.install_meshlab_filters()  # doctest: +SKIP
    >>> ms = pymeshlab.MeshSet()  # doctest: +SKIP
    >>> ms.generate_quad_mesh_from_image(image="rock.png", size=4)  # doctest: +SKIP
    """
    meshset_class = type(new_meshset())
    for spec in filters().values():
        setattr(meshset_class, spec.function, _method(spec))
    return tuple(filters())


def _method(spec: Filter) -> Callable[..., dict[str, Any]]:
    def method(self: Any, image: Any = None, **parameters: Any) -> dict[str, Any]:
        if image is not None and not spec.takes_image:
            raise InputError(f"{spec.function} works on the current mesh; it takes no image")
        state = _STATES.setdefault(self, State(MeshSetLayers(self), folder=Path()))
        if image is not None:
            state.image, state.labels, state.pixel_boundary, state.boundary = image, None, None, None
        step = STEPS[spec.function]
        return step.run(state, options_from(step.options, spec, _by_field(spec, parameters)))

    method.__name__ = spec.function
    method.__doc__ = method_help(spec)
    return method


def _by_field(spec: Filter, parameters: dict[str, Any]) -> dict[str, Any]:
    values = {}
    for name, value in parameters.items():
        parameter = spec.parameter(name)
        if parameter is None:
            known = ", ".join(p.python_name for p in spec.parameters) or "none"
            raise InputError(f"{spec.function} has no parameter {name!r}; it has: {known}")
        values[parameter.field] = parameter.checked(value)
    return values


def method_help(spec: Filter) -> str:
    """Return what ``help(ms.FILTER)`` prints."""
    lines = [spec.help, ""]
    for p in spec.parameters:
        choices = f", one of {', '.join(p.choices)}" if p.choices else ""
        lines.append(f"{p.python_name} (default {p.default!r}{choices}): {p.help}")
    return "\n".join(lines).rstrip()
