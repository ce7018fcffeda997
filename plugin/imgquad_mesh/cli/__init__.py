"""The command `imgquad-mesh`: one module a subcommand, each with `add_parser` and `execute`."""

from __future__ import annotations

import lazy_loader

# what the stub beside this file names is imported when it is asked for: signals are heard before
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
