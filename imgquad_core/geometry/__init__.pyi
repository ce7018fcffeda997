from .halfedge import twins_of

__all__ = [
    "twins_of",
]
