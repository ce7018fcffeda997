"""Pictures in tiles: what each tile does by itself, and what passes between them in files. Knows nothing of Dask.

A face belongs to one tile, and every point that two tiles need has one writer: the others copy its bytes. So each tile
is meshed alone, and all of them fit.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
