"""Which triangulators there are, and which one is used."""

from __future__ import annotations

from functools import cache
from importlib import import_module

from imgquad_core.errors import InputError

_PACKAGES = {"triangle": "triangle", "cdt": "pythoncdt"}  # of each triangulator, the default one first
TRIANGULATORS = ("auto", *_PACKAGES)


def triangulator_used(asked: str = "auto") -> str:
    """Return which triangulator stands behind what was asked for.

    Parameters
    ----------
    asked : {"auto", "triangle", "cdt"}
        `auto` is Triangle where it is installed, else CDT.

    Returns
    -------
    {"triangle", "cdt"}

    Raises
    ------
    InputError
        If there is no such triangulator, or it is not installed.
    """
    if asked not in TRIANGULATORS:
        raise InputError(f"triangulator is {asked!r}; give one of {', '.join(TRIANGULATORS)}")
    wanted = list(_PACKAGES) if asked == "auto" else [asked]
    found = next((name for name in wanted if _is_installed(_PACKAGES[name])), None)
    if found is None:
        packages = " or ".join(_PACKAGES[name] for name in reversed(wanted))
        raise InputError(f"triangulator is {asked!r}, but its Python package is missing: pip install {packages}")
    return found


@cache
def _is_installed(package: str) -> bool:
    try:
        import_module(package)
    except ImportError:
        return False
    return True
