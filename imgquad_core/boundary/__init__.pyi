from .areas import enclosed_areas
from .extraction import extract_boundaries
from .options import ExtractionOptions, SmoothingOptions
from .periodic import DIRECTIONS, match_opposite_sides, rematch
from .smoothing import smooth_boundaries
from .true_shape import TrueShape, true_shape

__all__ = [
    "DIRECTIONS",
    "ExtractionOptions",
    "SmoothingOptions",
    "TrueShape",
    "enclosed_areas",
    "extract_boundaries",
    "match_opposite_sides",
    "rematch",
    "smooth_boundaries",
    "true_shape",
]
