"""What pymeshlab's filters take: asked from pymeshlab itself, in a process of its own."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from imgquad_core.errors import InputError
from imgquad_mesh.spec import find_filter

from .names import pymeshlab_folder

#: a filter that pymeshlab has only when it could load all its plugins
_LOADED_WHOLE = "meshing_tri_to_quad_by_smart_triangle_pairing"
_NAMED = re.compile(r"<filter\b[^>]*\bname=[\"']([^\"']*)")
_PACKAGES = "apt-get install -y --no-install-recommends libgl1 libopengl0"
_ASK = """
import json
import pymeshlab
names = pymeshlab.filter_list()
print("FILTERS " + json.dumps(names), flush=True)
for name in names:
    pymeshlab.print_filter_parameter_list(name)
"""
#: type in a script -> types that pymeshlab prints for such a parameter
PRINTED_TYPES: Mapping[str, tuple[str, ...]] = {
    "RichBool": ("bool",),
    "RichInt": ("int",),
    "RichFloat": ("float",),
    "RichString": ("str",),
    "RichAbsPerc": ("PercentageValue",),
    "RichDynamicFloat": ("float (bounded)",),
    "RichEnum": ("str",),
    "RichColor": ("Color",),
    "RichPosition": ("numpy.ndarray[numpy.float64[3]]",),
    "RichDirection": ("numpy.ndarray[numpy.float64[3]]",),
    "RichPoint3f": ("numpy.ndarray[numpy.float64[3]]",),
    "RichMatrix44f": ("numpy.ndarray[numpy.float64[4, 4]]",),
    "RichMesh": ("int",),
    "RichOpenFile": ("str",),
    "RichSaveFile": ("str",),
    "RichShotf": ("Shotf [still unsupported]",),
}


class MissingMeshLab(InputError):
    """pymeshlab is not installed, or a system library that it needs is not."""


@cache
def answer() -> str:
    """Return what pymeshlab prints of its filters and their parameters."""
    if pymeshlab_folder() is None:
        raise MissingMeshLab("pymeshlab is not installed; pip install 'imgquad-mesh[meshlab]'")
    process = _asking()
    try:
        printed, errors = process.communicate(timeout=120)
    except subprocess.TimeoutExpired:
        process.kill()
        raise
    if process.returncode:
        reason = (errors.strip().splitlines() or [f"exit code {process.returncode}"])[-1]
        raise MissingMeshLab(f"pymeshlab cannot be imported ({reason}); {_PACKAGES}")
    return printed


@cache
def _asking() -> subprocess.Popen[str]:
    pipe = subprocess.PIPE
    return subprocess.Popen([sys.executable, "-c", _ASK], stdout=pipe, stderr=pipe, text=True, errors="replace")


def ask_early(script: Path) -> None:
    """Begin to ask if a script seems to need it, while what runs scripts is imported. Whatever is wrong is told later.

    Parameters
    ----------
    script : Path
        A file that may be none.
    """
    try:
        names = _NAMED.findall(script.read_text(encoding="utf-8", errors="replace"))
        if pymeshlab_folder() is not None and any(find_filter(name) is None for name in names):
            _asking()
    except OSError:
        pass


@cache
def meshlab_filters() -> tuple[str, ...]:
    """Return pymeshlab's names of its filters.

    Raises
    ------
    MissingMeshLab
        When pymeshlab is missing, cannot be imported, or could load only a part of its plugins.
    """
    found = re.search(r"^FILTERS (.*)$", answer(), re.MULTILINE)
    names: tuple[str, ...] = tuple(json.loads(found[1])) if found else ()
    if _LOADED_WHOLE not in names:
        raise MissingMeshLab(
            f"pymeshlab is loaded only in part ({len(names)} filters): system libraries are missing; {_PACKAGES}"
        )
    return names


@cache
def meshlab_parameters(functions: frozenset[str]) -> dict[str, dict[str, str]]:
    """Return the parameters of some filters: for each filter, Python name -> type as pymeshlab prints it."""
    parameters: dict[str, dict[str, str]] = {name: {} for name in functions}
    current: dict[str, str] = {}
    for line in answer().splitlines():
        header = re.fullmatch(r"(\w+) filter - list of parameter names:", line)
        if header:
            current = parameters.get(header[1], {})
        entry = re.match(r"\t(\w+) : (.+?) = ", line)
        if entry:
            current[entry[1]] = entry[2]
    return parameters
