from .quality import QualityReport, bad_places, forced_quads, quality_report, require_quality, scaled_jacobian

__all__ = [
    "QualityReport",
    "bad_places",
    "forced_quads",
    "quality_report",
    "require_quality",
    "scaled_jacobian",
]
