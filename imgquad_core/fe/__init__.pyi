from .elements import ElementOptions, make_elements
from .femesh import FEMesh
from .sets import fe_mesh

__all__ = [
    "ElementOptions",
    "FEMesh",
    "fe_mesh",
    "make_elements",
]
