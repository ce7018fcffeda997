from .quality import (
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
