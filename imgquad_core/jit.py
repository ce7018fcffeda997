"""The one way to compile a kernel. Numba is imported here only."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

import numba

F = TypeVar("F")
_KERNELS: list[Any] = []


def kernel(function: F) -> F:
    """Compile `function` without the interpreter, release the GIL while it runs, keep the machine code on disk."""
    flags: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
    compiled: Any = numba.njit(**flags)(function)
    _KERNELS.append(compiled)
    return compiled  # type: ignore[no-any-return]


def share_on_disk() -> float:
    """Return which share of the kernels imported so far an earlier run has left on disk, from 0 to 1.

    Where it is near 0 a run takes a minute or two longer, for compiling.
    """
    folders = {getattr(getattr(k, "_cache", None), "cache_path", None) for k in _KERNELS}
    kept = {file.name.rsplit("-", 1)[0] for folder in folders if folder for file in Path(folder).glob("*.nbi")}
    names = {f"{k.__module__.rsplit('.', 1)[-1]}.{k.__qualname__}" for k in _KERNELS}
    return len(names & kept) / len(names) if folders != {None} and names else 1.0
