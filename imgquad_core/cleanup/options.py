"""How far quads are cleaned up; numbers of each effort: `mesher.efforts`, of a mesh that is there: `optimization`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from imgquad_core.declared import EFFORT, THREADS, check


class CleanUp(NamedTuple):
    """How far the clean-up goes."""

    sizes: tuple[int, ...]  #: largest cavity (quads) of each pass
    tolerance: float  #: quality that may be paid for one irregular node
    worst: float  #: scaled Jacobian that every new quad must have, unless the old ones were worse
    thorough: int = 40  #: larger cavities begin at nodes with too many quads only: half the time, .05 % more irregular


class Portions(NamedTuple):
    """How large the parts of a mesh are that threads share: handed down, so that a test can ask for small ones."""

    batch: int = 3000  #: quads of a batch, so that it stays in the cache
    largest: int = 9000  #: quads of a face that shares its batch with others
    strip: int = 64  #: quads across a strip of a larger face, about: many times a cavity


PORTIONS = Portions()


@dataclass(frozen=True)
class OptimizationOptions:
    """How far a mesh is optimised.

    Parameters
    ----------
    effort : {"fast", "normal", "best"}
        How far irregular nodes are hunted.
    threads : int
        Number of threads, 0: one for each core that may be used; the mesh does not depend on it.
    """

    effort: str = EFFORT.field()
    threads: int = THREADS.field()

    def __post_init__(self) -> None:
        check(self)
