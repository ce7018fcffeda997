from .grids import boundaries_of_mesh, optimize, plot, quadratic, quality, report
from .images import boundaries, drop_materials, mesh, remove_noise, segment
from .lines import quads, smooth

__all__ = [
    "boundaries",
    "boundaries_of_mesh",
    "drop_materials",
    "mesh",
    "optimize",
    "plot",
    "quadratic",
    "quads",
    "quality",
    "remove_noise",
    "report",
    "segment",
    "smooth",
]
