"""Pictures larger than one machine: stacks of slices and tiles, on Dask or without."""

from __future__ import annotations

import lazy_loader

# what the stub beside this file names is imported when it is asked for: the command's help needs none of it
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
