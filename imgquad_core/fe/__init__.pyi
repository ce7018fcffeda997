from .elements import ElementOptions, make_elements
from .femesh import FEMesh
from .sets import fe_mesh, without_interfaces
from .triangles import split_quads

__all__ = [
    "ElementOptions",
    "FEMesh",
    "fe_mesh",
    "make_elements",
    "split_quads",
    "without_interfaces",
]
