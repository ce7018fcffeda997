from .areas import enclosed_areas
from .extraction import extract_boundaries, label_regions
from .oblong_pixels import TrueShape, true_shape
from .options import ExtractionOptions, SmoothingOptions
from .periodic import DIRECTIONS, match_opposite_sides, rematch
from .smoothing import Smoothed, smooth_boundaries, smooth_chains
from .stairs import as_step, find_step
from .zooms import Step

__all__ = [
    "DIRECTIONS",
    "ExtractionOptions",
    "Smoothed",
    "SmoothingOptions",
    "Step",
    "TrueShape",
    "as_step",
    "enclosed_areas",
    "extract_boundaries",
    "find_step",
    "label_regions",
    "match_opposite_sides",
    "rematch",
    "smooth_boundaries",
    "smooth_chains",
    "true_shape",
]
