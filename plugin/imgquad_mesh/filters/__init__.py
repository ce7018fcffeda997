"""Filters of PyVista's datasets, one a stage: what the accessor ``.imgquad`` has as methods, as plain functions.

Each takes a dataset, leaves it as it is and returns a new one. Chained with their defaults they give the same mesh, to
the bit, as `mesh`::

    image -> segment -> remove_noise -> boundaries -> smooth -> quads -> optimize, quality, plot

The core (and Numba with it) is imported by the first call of a filter.
"""

from __future__ import annotations

import lazy_loader

# what the stub beside this file names is imported when it is asked for: kernels bring Numba with them, about a second
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
