"""What the docs are made of; that they build without a warning is checked by .ci/run."""

from __future__ import annotations

import runpy

import pyvista as pv

from imgquad_core import MeshOptions
from imgquad_core.declared import declarations
from imgquad_mesh.cli.declared_options import flag_of
from imgquad_mesh.spec import filters
from support import ROOT

DOCS = ROOT / "docs"
PAGE = runpy.run_path(str(DOCS / "filter_reference.py"))


def test_reference_has_every_filter_and_parameter() -> None:
    page = PAGE["reference"]()
    for spec in filters().values():
        assert f"## {spec.name}" in page
        assert spec.function in page
        for parameter in spec.parameters:
            assert f"`{parameter.name}`" in page


def test_methods_of_the_reference_exist() -> None:
    names = {spec.name for spec in filters().values()}
    assert set(PAGE["METHODS"]) <= names
    for method in PAGE["METHODS"].values():
        kind, *path = method.split(" ")[0].split(".")
        value = getattr(pv, kind)()
        for name in path:
            value = getattr(value, name)
        assert callable(value), method


def test_pages_name_every_filter() -> None:
    from imgquad_mesh import filters as ours

    api, guide = ((DOCS / name).read_text(encoding="utf-8") for name in ("api.rst", "pyvista.md"))
    for name in ours.__all__:
        assert f".. autofunction:: {name}\n" in api
        if name != "boundaries_of_mesh":
            assert f"`{name}`" in guide


def test_page_of_options_is_up_to_date() -> None:
    page = runpy.run_path(str(DOCS / "option_page.py"))
    assert page["text"]() == (DOCS / "options.md").read_text(encoding="utf-8"), "run python docs/option_page.py"
    for name in declarations(MeshOptions):
        assert flag_of(name) in page["text"]()
