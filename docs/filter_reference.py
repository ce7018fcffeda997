"""The page of all filters, made of filters.xml when the docs are built."""

from __future__ import annotations

from pathlib import Path

from imgquad_mesh.meshlab.templates import markdown

HEAD = """# Reference of the filters

Every filter has one name in scripts of MeshLab's kind, one in `pymeshlab.MeshSet`, and most have a method of PyVista's
datasets. All of them are described in one file, `filters.xml`, which this page is made of.

| in scripts | method in PyVista |
|---|---|
{methods}

"""
METHODS = {
    "Image: Label by Color": "ImageData.imgquad.segment",
    "Image: Remove Label Noise": "ImageData.imgquad.remove_noise",
    "Image: Crop": "ImageData.extract_subset (PyVista's own)",
    "Image: Merge Materials": "ImageData.imgquad.merge_materials",
    "Image: Rename Materials": "ImageData.imgquad.rename_materials",
    "Image: Recolor Materials": "ImageData.imgquad.recolor_materials",
    "Image: Drop Materials": "ImageData.imgquad.drop_materials",
    "Image: Extract Material Boundaries": "ImageData.imgquad.boundaries",
    "Boundary: Smooth": "PolyData.imgquad.smooth",
    "Quad Mesh: From Material Boundaries": "PolyData.imgquad.quads",
    "Image to Quad Mesh": "ImageData.imgquad.mesh",
    "Quad Mesh: Clean Up": "UnstructuredGrid.imgquad.optimize",
    "Per Face Quality according to Quad Shape": "UnstructuredGrid.imgquad.quality",
    "Quad Mesh: Extract Boundaries": "UnstructuredGrid.imgquad.boundaries",
    "Colorize by Material": "UnstructuredGrid.imgquad.plot",
    "Compute Quad Quality Measures": "UnstructuredGrid.imgquad.report",
    "Compute Material Statistics": "UnstructuredGrid.imgquad.report",
    "Export Quad Mesh": "UnstructuredGrid.save",
}


def reference() -> str:
    """Return the page."""
    rows = "\n".join(f"| {name} | `{method}` |" for name, method in METHODS.items())
    return HEAD.format(methods=rows) + markdown()


def write_reference(folder: Path) -> None:
    """Write the page into a folder of the docs; a page that is up to date is left alone."""
    folder.mkdir(exist_ok=True)
    page, text = folder / "filters.md", reference()
    if not page.exists() or page.read_text(encoding="utf-8") != text:
        page.write_text(text, encoding="utf-8")
