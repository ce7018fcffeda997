from .areas import enclosed_areas
from .extraction import extract_boundaries
from .oblong_pixels import TrueShape, true_shape
from .options import ExtractionOptions, SmoothingOptions
from .periodic import DIRECTIONS, match_opposite_sides, rematch
from .smoothing import smooth_boundaries
from .stairs import Step, as_step, find_step

__all__ = [
    "DIRECTIONS",
    "ExtractionOptions",
    "SmoothingOptions",
    "Step",
    "TrueShape",
    "as_step",
    "enclosed_areas",
    "extract_boundaries",
    "find_step",
    "match_opposite_sides",
    "rematch",
    "smooth_boundaries",
    "true_shape",
]
