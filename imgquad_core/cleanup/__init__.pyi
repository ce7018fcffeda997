from .faces import FaceQuads
from .optimization import OptimizationOptions, optimize

__all__ = [
    "FaceQuads",
    "OptimizationOptions",
    "optimize",
]
