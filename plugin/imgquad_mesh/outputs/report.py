"""The report of a run: everything that was chosen, removed, measured, as values that JSON holds."""

from __future__ import annotations

import platform
import sys
from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.fe import FEMesh
from imgquad_core.fe.cohesive import closed_ends
from imgquad_core.ledger import material_ledger, region_errors
from imgquad_core.measures.quality import bad_places, forced_quads, quality_report, scaled_jacobian
from imgquad_core.mesher import triangulator_used
from imgquad_core.model import BoundaryGraph, PointKind
from imgquad_core.pipeline import Run
from imgquad_core.remedies import lost_materials, thin_features

PACKAGES = ("imgquad-mesh", "numpy", "scipy", "numba", "scikit-image", "triangle", "pythoncdt", "pyvista", "vtk")
MOST_MATERIALS = 10  #: that lost regions are named
LOW = 0.3  #: scaled Jacobian below which Verdict calls a quad bad; counted in every report


def build_report(
    run: Run, image: Path, output: Path, seconds: Mapping[str, float], min_quality: float | None = None
) -> dict[str, Any]:
    """Return the report of `run` as nested dicts and lists of plain numbers and strings."""
    ledger = material_ledger(run.picture, run.labels, run.boundary, run.mesh, run.options.pixel_sides)
    rows, cols = run.labels.shape
    return {
        "input": str(image),
        "output": str(output),
        "columns": cols,
        "rows": rows,
        "options": _options(run),
        "picture": _calibration(run),
        "notes": list(notes(run)),
        "warnings": list(run.segmentation.warnings),
        "materials": [asdict(row) for row in ledger],
        "absorbed": [asdict(absorption) for absorption in run.absorbed],
        "removed": [asdict(removal) for removal in run.removed],
        "counts": _counts(run),
        "region_errors": asdict(region_errors(run.boundary)),
        "quality": asdict(quality_report(run.mesh)) | _low_quads(run, LOW if min_quality is None else min_quality),
        "seconds": {name: round(value, 4) for name, value in seconds.items()},
        **_memory(rows * cols, run.mesh.n_quads),
        "versions": versions(),
    }


def notes(run: Run) -> Iterator[str]:
    """Say in words what was decided by itself, what was removed, and what the user may want to change."""
    yield run.segmentation.note
    yield from run.notes
    if run.noise.removes:
        limits = f"clusters below {run.noise.min_pixels} pixels and shorter than {run.noise.min_length:g} px"
        removed = sum(removal.clusters for removal in run.removed)
        yield f"noise: {removed} {limits} removed, {sum(removal.pixels for removal in run.removed)} pixels"
    yield from _of_tolerance(run)
    many = thin_features(run.labels, run.mesh, run.options)
    if many:
        yield many


def _of_tolerance(run: Run) -> Iterator[str]:
    """Say what was done about stairs and thin parts, and what that cost."""
    if run.step != (1.0, 1.0) and run.options.step == "auto":
        yield f"data points of {run.step[0]:g} x {run.step[1]:g} pixels (--step 1 keeps the stairs)"
    if not run.absorbed:
        return
    rows = [row for row in run.absorbed if row.absorbed]
    gone, regions = sum(row.absorbed for row in rows), sum(row.regions for row in run.absorbed)
    share = sum(row.lost for row in run.absorbed) / sum(row.pixels for row in run.absorbed)
    joined = run.pixel_boundary.n_chains - run.boundary.n_chains
    yield (
        f"tolerance {run.options.tolerance:g} px: {gone} of {regions} regions absorbed, {share:.2%} of the area moved, "
        f"{joined} boundaries joined, boundaries moved up to {_moved(run):.1f} px"
    )
    for row in sorted(rows, key=lambda row: -row.absorbed)[:MOST_MATERIALS]:
        yield f"material {run.clean.materials.name_of(row.material)}: {row.absorbed} of {row.regions} regions absorbed"
    yield from lost_materials(run)


def _moved(run: Run) -> float:
    """Return the largest distance of a boundary from those of the picture without noise, in pixels."""
    before, after = extract_boundaries(run.clean), run.boundary
    to_pixels = np.array(run.clean.shape[::-1]) / np.array(after.shape[::-1])
    return float(scipy.spatial.cKDTree(before.points).query(after.points * to_pixels)[0].max())


def element_notes(made: FEMesh | None, path: Path, msh_version: str | None = None) -> Iterator[str]:
    """Say in words what became otherwise than the elements asked for, and who misreads them without a word."""
    closed = closed_ends(made) if made is not None and made.periodic and len(made.cohesive) else 0
    text = f"{closed} ends of cohesive interfaces at the border are closed, as the picture does not go on there"
    if closed:
        yield f"{text}: its opposite sides differ"
    if made is not None and made.kind == "quad8" and (path.suffix.lower(), msh_version) == (".msh", "2.2"):
        yield "NGSolve and FiPy take 8-node quads of .msh 2.2 for others, without an error: they read order 1 only"


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that the mesh depends on."""
    return {"python": platform.python_version(), "platform": platform.platform()} | {
        package: found for package in PACKAGES if (found := _version(package))
    }


def _memory(pixels: int, quads: int) -> dict[str, float | None]:
    """Return the largest amount of memory, in MB, and in bytes a pixel and a quad (packages included)."""
    peak = peak_memory_mb()
    per_pixel, per_quad = (None if peak is None else round(1e6 * peak / n, 1) for n in (pixels, quads))
    return {"peak_memory_mb": peak, "peak_bytes_per_pixel": per_pixel, "peak_bytes_per_quad": per_quad}


def peak_memory_mb() -> float | None:
    """Return the largest amount of memory that this process has used, in MB; `None` where that is not known."""
    try:
        import resource  # there is none on Windows
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(peak / (1e6 if sys.platform == "darwin" else 1e3), 1)


def _calibration(run: Run) -> dict[str, Any]:
    """Return what the file says of pixel size and place, and what the mesh has."""
    found, options = run.calibration, run.options
    file = {
        "pixel_size": asdict(found.size) if found.size else None,
        "origin": list(found.origin) if found.origin else None,
        "crs": found.crs,
    }
    return {"file": file, "mesh": {"pixel_size": list(options.pixel_sides), "origin": list(options.corner)}}


def _options(run: Run) -> dict[str, Any]:
    values = {f.name: getattr(run.options, f.name) for f in fields(run.options)}
    used = {
        "min_pixels": run.noise.min_pixels,
        "min_length": run.noise.min_length,
        "triangulator": triangulator_used(run.options.triangulator),
    }
    sizes = _by_text(run.options.material_sizes)
    marks = None if run.options.marks is None else str(run.options.marks)
    between = {",".join(map(str, pair)): size for pair, size in run.options.sizes_between.items()}
    merged = {",".join(map(str, names)): name for names, name in run.options.merge.items()}
    edits = {"merge": merged, "rename": _by_text(run.options.rename), "recolor": _by_text(run.options.recolor)}
    return (
        values
        | used
        | edits
        | {"material_sizes": sizes, "sizes_between": between, "step": list(run.step), "marks": marks}
    )


def _by_text(values: Mapping[Any, Any]) -> dict[str, Any]:
    return {str(material): value for material, value in values.items()}


def _counts(run: Run) -> dict[str, dict[str, int]]:
    """Count regions and junctions in the picture, after noise removal, and as meshed."""
    picture = extract_boundaries(run.picture) if run.removed or run.options.drop else run.pixel_boundary
    graphs = {"picture": picture, "clean": run.pixel_boundary, "meshed": run.boundary}
    return {
        "regions": {name: len(graph.region_label) for name, graph in graphs.items()},
        "junctions": {name: _junctions(graph) for name, graph in graphs.items()},
    }


def _junctions(graph: BoundaryGraph) -> int:
    return int(np.count_nonzero(graph.point_kind == PointKind.JUNCTION))


def _low_quads(run: Run, limit: float) -> dict[str, Any]:
    low = scaled_jacobian(run.mesh.points, run.mesh.quads) < limit
    forced = low & forced_quads(run.mesh, limit) if low.any() else low
    return {
        "limit": limit,
        "below_limit": int(np.count_nonzero(low)),
        "below_limit_forced": int(np.count_nonzero(forced)),
        "worst": [place._asdict() for place in bad_places(run.mesh, limit)],
    }


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
