"""Work shared by threads: kernels release the interpreter, and what they give does not hang on how many there are."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from .arrays import Ints

Part = TypeVar("Part")
Result = TypeVar("Result")
LEAST = 20_000  # points of a part; below it a thread costs more than it does


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


def in_threads(
    parts: list[Part], work: Callable[[Part], Result], threads: int, told: Callable[[Part], None] | None = None
) -> list[Result]:
    """Call `work` for each part; the results come in the order of the parts, whatever the threads.

    In that order, too, and in the thread of the caller, `told` is called with each part that is done.
    """
    if threads == 1 or len(parts) == 1:
        return _collected(parts, map(work, parts), told)
    with ThreadPoolExecutor(threads) as pool:
        return _collected(parts, pool.map(work, parts), told)


def _collected(parts: list[Part], results: Iterator[Result], told: Callable[[Part], None] | None) -> list[Result]:
    found = []
    for part, result in zip(parts, results, strict=True):
        found.append(result)
        if told is not None:
            told(part)
    return found


def even_parts(points: Ints, threads: int, least: int = LEAST) -> list[slice]:
    """Cut a sequence whose items have these numbers of points into parts of about as many, one a thread at most."""
    total = points.cumsum()
    count = min(max(int(total[-1]) // least, 1), threads) if len(total) else 1
    cuts = total.searchsorted([total[-1] * k / count for k in range(1, count)]).tolist() if count > 1 else []
    return [slice(a, b) for a, b in pairwise([0, *cuts, len(points)])]
