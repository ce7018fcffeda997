"""Algorithms that turn a picture of a structure into an all-quadrilateral, multi-material mesh."""
