from .slices import slices_of
from .stack import StackResult, mesh_stack
from .tiles import TiledMesh, mesh_tiles

__all__ = ["StackResult", "TiledMesh", "mesh_stack", "mesh_tiles", "slices_of"]
