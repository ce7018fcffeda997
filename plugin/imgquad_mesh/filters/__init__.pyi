from .grids import boundaries_of_mesh, optimize, plot, quadratic, quality, report
from .images import boundaries, mesh
from .lines import quads, smooth
from .materials import (
    drop_materials,
    merge_materials,
    recolor_materials,
    remove_noise,
    rename_materials,
    segment,
)

__all__ = [
    "boundaries",
    "boundaries_of_mesh",
    "drop_materials",
    "merge_materials",
    "mesh",
    "optimize",
    "plot",
    "quadratic",
    "quads",
    "quality",
    "recolor_materials",
    "remove_noise",
    "rename_materials",
    "report",
    "segment",
    "smooth",
]
