from .quality import (
    MIN_QUALITY,
    QualityReport,
    aspect,
    bad_places,
    corner_angles,
    forced_quads,
    material_areas,
    quad_areas,
    quality_report,
    require_quality,
    scaled_jacobian,
)
from .sampling import area_means

__all__ = [
    "MIN_QUALITY",
    "QualityReport",
    "area_means",
    "aspect",
    "bad_places",
    "corner_angles",
    "forced_quads",
    "material_areas",
    "quad_areas",
    "quality_report",
    "require_quality",
    "scaled_jacobian",
]
