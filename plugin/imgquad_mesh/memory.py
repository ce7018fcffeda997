"""A limit of memory for a child process: what needs more fails there, before the machine swaps or ends others."""

from __future__ import annotations

from contextlib import suppress


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
