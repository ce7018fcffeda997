"""What the command writes: files as wholes, the report, the drawing of a mesh."""

from __future__ import annotations

import lazy_loader

# what the stub beside this file names is imported when it is asked for: matplotlib with the first drawing
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
