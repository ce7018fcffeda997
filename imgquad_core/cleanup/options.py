"""How far quads are cleaned up; the numbers of each effort of meshing are in `imgquad_core.mesher.efforts`."""

from __future__ import annotations

import os
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


def threads_of(asked: int) -> int:
    """Return the number of threads that was asked for; 0 asks for all cores that the process may use.

    OMP_NUM_THREADS limits that, as it does for others: batch systems and Dask set it, whose workers share a machine.
    """
    if asked:
        return asked
    limit = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0]
    cores = _cores()
    return min(cores, int(limit)) if limit.isdecimal() and int(limit) else cores


def _cores() -> int:
    if hasattr(os, "process_cpu_count"):  # Python 3.13
        return os.process_cpu_count() or 1
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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
