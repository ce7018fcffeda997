from .stack import StackResult, mesh_stack

__all__ = ["StackResult", "mesh_stack"]
