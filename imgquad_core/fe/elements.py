"""From a quad mesh to the elements that were asked for: second order, cohesive interfaces, extrusion."""

from __future__ import annotations

from imgquad_core.model import QuadMesh

from .cohesive import open_interfaces, split_interfaces
from .extrusion import extrude
from .femesh import FEMesh
from .options import ElementOptions
from .periodic_pairs import with_periodic_pairs
from .second_order import second_order
from .sets import fe_mesh, without_interfaces
from .triangles import split_quads


def make_elements(mesh: QuadMesh, options: ElementOptions) -> FEMesh:
    """Return the elements of `mesh` that `options` asks for, with all sets."""
    elements = fe_mesh(mesh)
    if options.order == 2:
        elements = second_order(elements, options.nodes)
    if options.periodic is not None:  # before splitting, which hands the pairs down to the copies
        elements = with_periodic_pairs(elements, options.periodic)
    if options.cohesive is not None:
        elements = split_interfaces(elements, options.cohesive)
    if options.extrude is not None:
        elements = extrude(elements, options.extrude, options.layers)
    if options.split_quads:
        elements = split_quads(elements)
    if options.open_interfaces:
        elements = open_interfaces(elements)
    return elements if options.mark_interfaces else without_interfaces(elements)
