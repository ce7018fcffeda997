from .elements import make_elements
from .femesh import FEMesh
from .options import ElementOptions
from .properties import read_properties
from .sets import fe_mesh, without_interfaces
from .triangles import split_quads

__all__ = [
    "ElementOptions",
    "FEMesh",
    "fe_mesh",
    "make_elements",
    "read_properties",
    "split_quads",
    "without_interfaces",
]
