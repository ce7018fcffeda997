from .registry import WITHOUT_COHESIVE, WRITERS, Writer, options_of, write_mesh, writer_for

__all__ = ["WITHOUT_COHESIVE", "WRITERS", "Writer", "options_of", "write_mesh", "writer_for"]
