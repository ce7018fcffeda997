"""Files for solvers and mesh apps: one writer a format, chosen by the extension."""

from __future__ import annotations

import lazy_loader

# what the stub beside this file names is imported when it is asked for: a third of a second with what the writers need
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
