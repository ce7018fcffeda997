"""Between PyVista's datasets and the values of the core."""

from __future__ import annotations

import lazy_loader

# what the stub beside this file names is imported when it is asked for: PyVista finds the accessor in no time
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
