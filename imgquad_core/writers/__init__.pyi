from .common import no_cohesive, safe_names
from .registry import WITHOUT_COHESIVE, WRITERS, Writer, check_options, options_of, write_mesh, writer_for

__all__ = [
    "WITHOUT_COHESIVE",
    "WRITERS",
    "Writer",
    "check_options",
    "no_cohesive",
    "options_of",
    "safe_names",
    "write_mesh",
    "writer_for",
]
