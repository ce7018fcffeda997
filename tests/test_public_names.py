"""Every public name can be imported, again and again, whatever was imported before."""

from __future__ import annotations

import pkgutil
import subprocess
import sys
from importlib import import_module
from types import ModuleType

import pytest

ROOTS = ("imgquad_core", "imgquad_mesh")
SKIPPED = ("imgquad_mesh.__main__", "imgquad_mesh.meshlab.worker")

CALLED_TWICE = """
import numpy as np, imgquad_mesh
from imgquad_core import mesh_image
import imgquad_mesh.meshlab.crosscheck
labels = np.zeros((20, 30), np.int32); labels[5:15, 8:20] = 1
for _ in range(2):
    try:
        imgquad_mesh.crosscheck(mesh_image(labels))
    except imgquad_mesh.meshlab.pymeshlab_filters.MissingMeshLab:
        pass
    assert callable(imgquad_mesh.crosscheck)
"""


def packages() -> list[str]:
    found = list(ROOTS)
    for root in ROOTS:
        found += [m.name for m in pkgutil.walk_packages(import_module(root).__path__, f"{root}.") if m.ispkg]
    return found


def modules_of(package: ModuleType) -> list[str]:
    return [m.name for m in pkgutil.iter_modules(package.__path__)]


@pytest.mark.parametrize("name", packages())
def test_no_public_name_is_that_of_a_module_beside_it(name: str) -> None:
    package = import_module(name)
    public = set(getattr(package, "__all__", ()))
    hidden = {n for n in public & set(modules_of(package)) if not isinstance(getattr(package, n), ModuleType)}
    assert not hidden, f"importing the module {name}.{min(hidden, default='')} hides the function"


@pytest.mark.parametrize("name", packages())
def test_public_names_are_the_same_before_and_after_all_modules_are_imported(name: str) -> None:
    package = import_module(name)
    public = [n for n in getattr(package, "__all__", ()) if n not in modules_of(package)]
    before = {n: getattr(package, n) for n in public}
    for module in modules_of(package):
        if f"{name}.{module}" not in SKIPPED:
            import_module(f"{name}.{module}")
    assert {n: getattr(package, n) for n in public} == before
    assert not [n for n in public if isinstance(before[n], ModuleType)]


def test_the_functions_of_the_plugin_can_be_called_twice() -> None:
    done = subprocess.run([sys.executable, "-c", CALLED_TWICE], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
