"""Planar geometry that more than one stage needs: half-edges, one quad, exact crossings, the ambiguous corner."""

from __future__ import annotations

import lazy_loader

# what the stub beside this file names is imported when it is asked for: kernels bring Numba with them, about a second
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
