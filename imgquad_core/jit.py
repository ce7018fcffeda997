"""The one way to compile a kernel. Numba is imported here only."""

from __future__ import annotations

from typing import Any, TypeVar

import numba

F = TypeVar("F")


def kernel(function: F) -> F:
    """Compile `function` without the interpreter, release the GIL while it runs, keep the machine code on disk."""
    compiled: Any = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    return compiled  # type: ignore[no-any-return]
