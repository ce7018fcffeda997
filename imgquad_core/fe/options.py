"""Which elements a mesh is made of."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from imgquad_core.declared import check, option
from imgquad_core.errors import InputError

#: what `interfaces` may be asked to make of the elements; other words are of writers
BETWEEN = ("sides", "none")


def interface_options(asked: str | None) -> dict[str, Any]:
    """Return the options of `ElementOptions` that "sides" (open) or "none" (not marked) stands for."""
    return {"open_interfaces": asked == "sides", "mark_interfaces": asked != "none"}


@dataclass(frozen=True)
class ElementOptions:
    """Which elements a mesh is made of.

    Parameters
    ----------
    order : int
        1 (four nodes) or 2.
    nodes : int
        Nodes of a second-order quad: 8 or 9.
    cohesive : ``all`` or pairs of names, optional
        Between which materials interfaces are split.
    extrude : float, optional
        Thickness of hexes, in the unit of the mesh.
    layers : int
        Hexes over the thickness.
    periodic : str, optional
        ``x``, ``y`` or ``xy``: tie the nodes of opposite sides, of a mesh made with the same option.
    open_interfaces : bool
        Leave the split interfaces open: no cohesive elements between their two sides.
    split_quads : bool
        Cut each quad into two triangles.
    mark_interfaces : bool
        Name the sides between two materials, too; without them all named sides are boundary.
    """

    order: int = option(
        1,
        "1: quads of four nodes; 2: nodes in the middles of sides, on the curves of the boundaries",
        choices=(1, 2),
        topic="elements",
    )
    nodes: int = option(8, "nodes of a quad of order 2", choices=(8, 9), topic="elements")
    cohesive: str | Iterable[tuple[str, str]] | None = option(
        None,
        "pairs of materials between which interfaces are split for cohesive elements; all: between all materials; "
        "a material twice: between all its elements",
        topic="elements",
    )
    extrude: float | None = option(
        None, "thickness of hexes, in the unit of the mesh", kind=float, what="a length", above=0.0, topic="elements"
    )
    layers: int = option(1, "number of hexes over the thickness", least=1, topic="elements")
    periodic: str | None = None
    open_interfaces: bool = False
    split_quads: bool = option(False, "cut each quad into two triangles", topic="elements")
    mark_interfaces: bool = True

    def __post_init__(self) -> None:
        check(self)
        if self.cohesive is not None and not isinstance(self.cohesive, str):
            object.__setattr__(self, "cohesive", tuple(map(tuple, self.cohesive)))
        if self.nodes == 9 and self.order == 1:
            raise InputError("nodes 9 is of quads of order 2; ask for order 2, too")
        if self.layers != 1 and self.extrude is None:
            raise InputError(f"layers {self.layers} is of extruded meshes; say how thick, with extrude")
        if self.order == 2 and self.extrude is not None:
            raise InputError("order 2 and extrusion exclude each other: hexes have 8 nodes")
        if self.split_quads and (self.order == 2 or self.extrude is not None):
            raise InputError("splitting quads and order 2 or extrusion exclude each other: triangles have 3 nodes")
        if self.open_interfaces and self.cohesive is None:
            raise InputError("interfaces: sides is of split interfaces only; say which, with cohesive")

    @property
    def plain(self) -> bool:
        """Whether these are just the quads of the mesh, with all sets."""
        changed = (self.cohesive, self.extrude, self.periodic) != (None, None, None)
        return self.order == 1 and self.mark_interfaces and not self.split_quads and not changed
