"""The plugin: PyVista filters, MeshLab-style filter scripts and the command of imgquad-mesh."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .crosscheck import crosscheck
    from .meshlab import from_meshset, to_meshset
    from .methods import install_meshlab_filters
    from .script import run_script

__all__ = ["crosscheck", "from_meshset", "install_meshlab_filters", "run_script", "to_meshset"]

_HOMES = {
    "crosscheck": "crosscheck",
    "from_meshset": "meshlab",
    "install_meshlab_filters": "methods",
    "run_script": "script",
    "to_meshset": "meshlab",
}


def __getattr__(name: str) -> Any:
    """Import what is asked for when it is: the core brings Numba with it, which takes about a second."""
    if name not in _HOMES:
        raise AttributeError(f"module 'imgquad_mesh' has no attribute '{name}'")
    return getattr(import_module(f".{_HOMES[name]}", __name__), name)
