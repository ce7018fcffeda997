"""What an effort means, in numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple

from imgquad_core.cleanup.options import PORTIONS, CleanUp, Portions


class Effort(NamedTuple):
    """How far a mesh is optimised."""

    wide: CleanUp  #: clean-up of faces on stride 4 or 6
    narrow: CleanUp  #: clean-up of faces on stride 2
    again_below: float  #: a face on stride 4 with a worse element is meshed on stride 2 as well
    slides: int  #: rounds in which boundary nodes slide along their chains
    in_nine: bool = False  #: whether very wide faces are meshed on stride 6 and their quads split in nine

    @property
    def edge_multiple(self) -> Literal[4, 12]:
        """Number of edges of which long boundaries should have a multiple, so that both sides can be split evenly."""
        return 12 if self.in_nine else 4


EFFORTS: Mapping[str, Effort] = {
    "fast": Effort(CleanUp((16, 40), 0.2, 0.6), CleanUp((16,), 0.2, 0.6), 0.4, 0),
    "normal": Effort(CleanUp((40, 160), 0.7, 0.6, 160), CleanUp((16, 40, 80), 0.7, 0.6), 0.55, 2),
    "best": Effort(
        CleanUp((16, 40, 80, 160, 160), 0.8, 0.6, 160), CleanUp((16, 40, 80, 160), 1.0, 0.6, 160), 0.55, 4, True
    ),
}


class Tuning(NamedTuple):
    """Numbers of the mesher that studies settled: handed down, so that a test or the next study can ask for others."""

    worst: float = 0.56  #: scaled Jacobian below which the boundary's edges at a quad are halved, if that helps
    wishes: int = 16  #: rounds of halving for the sake of poor quads, at most
    rounds: int = 16  #: rounds of halving for the sake of folded ones, at most
    very_wide: float = 6.0  #: width of a face that is meshed on stride 6, in its coarse segments
    portions: Portions = PORTIONS  #: parts that threads share


TUNING = Tuning()
