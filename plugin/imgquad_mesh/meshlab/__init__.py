"""Filter scripts in MeshLab's form that mix our filters with MeshLab's, which run in a process of their own.

Our filters: filters.xml describes them, `own_filters` does them. MeshLab's own: `pymeshlab_filters` lists them,
`process` runs them.
"""

from __future__ import annotations

import lazy_loader

# what the stub beside this file names is imported when it is asked for: kernels bring Numba with them
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
