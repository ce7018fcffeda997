"""Memory of a child process: what needs too much fails there, before the machine swaps; what is free is given back."""

from __future__ import annotations

import ctypes
from contextlib import suppress

_MMAP_THRESHOLD, _LARGE = -3, 4 << 20  # of mallopt(3); bytes from which a block is large


def limit_memory(n_bytes: int, of: str = "RLIMIT_AS") -> None:
    """Let this process have so many bytes of ``RLIMIT_AS`` (addresses) or ``RLIMIT_DATA``; 0: what it has already."""
    try:
        import resource  # there is none on Windows
    except ImportError:
        return
    kind = getattr(resource, of)
    _, hard = resource.getrlimit(kind)
    if n_bytes and (hard == resource.RLIM_INFINITY or n_bytes < hard):
        with suppress(ValueError, OSError):  # macOS refuses some
            resource.setrlimit(kind, (n_bytes, hard))


def give_large_blocks_back() -> None:
    """Have glibc return large blocks to the system when they are freed; by itself it keeps those of up to 32 MB."""
    with suppress(OSError, AttributeError):  # other C libraries do it anyway, or have no mallopt
        ctypes.CDLL(None).mallopt(_MMAP_THRESHOLD, _LARGE)
