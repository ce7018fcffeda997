from .areas import enclosed_areas
from .extraction import ExtractionOptions, extract_boundaries
from .periodic import DIRECTIONS, match_opposite_sides, rematch
from .smoothing import SmoothingOptions, smooth_boundaries

__all__ = [
    "DIRECTIONS",
    "ExtractionOptions",
    "SmoothingOptions",
    "enclosed_areas",
    "extract_boundaries",
    "match_opposite_sides",
    "rematch",
    "smooth_boundaries",
]
