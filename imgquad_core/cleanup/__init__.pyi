from .faces import FaceQuads
from .optimization import optimize
from .options import OptimizationOptions

__all__ = [
    "FaceQuads",
    "OptimizationOptions",
    "optimize",
]
