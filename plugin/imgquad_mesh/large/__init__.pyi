from .stack import StackResult, mesh_stack
from .tiles import TiledMesh, mesh_tiles

__all__ = ["StackResult", "TiledMesh", "mesh_stack", "mesh_tiles"]
