"""How boundaries are filled with quads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from imgquad_core.declared import EFFORT, GROWTH, MATERIAL_SIZES, SIZE, THREADS, check, option
from imgquad_core.threads import threads_of

from .efforts import TUNING, Tuning
from .triangulators import TRIANGULATORS, triangulator_used

if TYPE_CHECKING:
    from imgquad_core.arrays import Floats, Labels

#: steepest slope of the length of a coarse segment by growth; beyond it the worst elements cannot be mended
STEEPEST = ((1.3, 1.6), (0.6, 1.0))


@dataclass(frozen=True)
class MeshingOptions:
    """How boundaries are filled with quads.

    Parameters
    ----------
    size : float
        Length of final edges inside, in pixels.
    growth : float
        Largest ratio of the sizes of neighbouring elements (above 1.6 it counts as 1.6 inside faces).
    material_sizes : mapping of int to float
        Length of final edges per material label.
    effort : {"fast", "normal", "best"}
        How far irregular nodes are hunted.
    threads : int
        Number of threads, 0: one for each core that may be used; the mesh does not depend on it.
    triangulator : {"auto", "triangle", "cdt"}
        Who makes the Delaunay triangles that quads come from; see `triangulator_used`.
    tuning : Tuning
        For tests and studies.
    """

    size: float = SIZE.field()
    growth: float = GROWTH.field()
    material_sizes: Mapping[int, float] | None = MATERIAL_SIZES.field()
    effort: str = EFFORT.field()
    threads: int = THREADS.field()
    triangulator: str = option(
        "auto",
        "who makes the Delaunay triangles that quads come from: Triangle (not for commercial use), CDT, or auto: "
        "Triangle where it is installed, else CDT",
        choices=TRIANGULATORS,
    )
    tuning: Tuning = field(default=TUNING, metadata={"internal": True})  # no user's business: no filter has it

    def __post_init__(self) -> None:
        check(self)
        triangulator_used(self.triangulator)

    @property
    def n_threads(self) -> int:
        """Number of threads to use."""
        return threads_of(self.threads)

    def slope(self, stride: int) -> float:
        """Growth of the length of segments of `stride` final edges per unit of length inside faces."""
        (gentle, steep), (least, most) = STEEPEST
        share = min(max((self.growth - gentle) / (steep - gentle), 0.0), 1.0)
        return min(stride * (self.growth - 1.0), least + share * (most - least))

    def face_sizes(self, labels: Labels) -> Floats:
        """Return the edge length asked for in each face."""
        import numpy as np  # not above: the command's help is made of these options

        sizes = np.full(len(labels), float(self.size))
        for label, size in (self.material_sizes or {}).items():
            sizes[labels == label] = size
        return sizes
