"""From any file of an instrument, a program or a map to its pixels, and what the file says of them."""

from __future__ import annotations

import lazy_loader

# what the stub beside this file names is imported when it is asked for: kernels bring Numba with them, about a second
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
