"""Sphinx: guides, the reference of the filters, and the gallery of examples."""

from __future__ import annotations

import os
import sys
from importlib.metadata import version as version_of
from pathlib import Path

os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")

import pyvista as pv

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from filter_reference import write_reference  # noqa: E402

project = "imgquad-mesh"
copyright = "the imgquad-mesh developers"
version = release = version_of("imgquad-mesh")

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_gallery.gen_gallery",
]
source_suffix = {".rst": "restructuredtext", ".md": "markdown"}
exclude_patterns = ["_build"]
html_theme = "pydata_sphinx_theme"
html_title = "imgquad-mesh"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False
autodoc_typehints = "none"
myst_heading_anchors = 3

pv.OFF_SCREEN = True
pv.BUILDING_GALLERY = True
pv.global_theme.window_size = [900, 600]
sphinx_gallery_conf = {
    "examples_dirs": str(HERE.parent / "examples"),
    "gallery_dirs": "gallery",
    "filename_pattern": r"/plot_",
    "ignore_pattern": r"(^|/)(?!plot_)[^/]*\.py$",
    "image_scrapers": ("pyvista",),
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "show_memory": False,
    "abort_on_example_error": True,
}

write_reference(HERE / "reference")
