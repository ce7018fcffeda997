"""The report of a picture in tiles: what its tiles have measured, added up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from imgquad_core.ledger import LARGE_REGION
from imgquad_core.tiles import Job
from imgquad_core.tiles.files import load_arrays
from imgquad_core.tiles.tasks import BINS, final_mesh
from imgquad_mesh import outputs

VERY_LARGE = 10_000  #: pixels of regions whose areas are told by themselves


def report_of(job: Job, rows: Sequence[Mapping[str, Any]], path: Path) -> dict[str, Any]:
    """Return the report as values that JSON holds."""
    rules, grid = job.rules(), job.grid
    return {
        "input": job.source.name,
        "output": str(path),
        "columns": grid.shape[1],
        "rows": grid.shape[0],
        "grid": {"tile": grid.tile, "keep_whole": grid.keep, "rows": grid.down, "columns": grid.across},
        "notes": [rules.legend.note],
        "warnings": list(rules.legend.warnings),
        "noise": {"min_pixels": rules.noise.min_pixels, "min_length": rules.noise.min_length},
        "materials": _materials(job, rows),
        "quality": _quality(rows),
        "regions": _regions(job),
        "tiles": [{name: row[name] for name in ("tile", "quads", "nodes", "min_sj")} for row in rows],
        "versions": outputs.versions(),
    }


def _materials(job: Job, rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Account for every material."""
    names = ("pixels", "clean_pixels", "areas", "quads_of")
    before, after, areas, quads = (np.sum([row[name] for row in rows], axis=0) for name in names)
    materials = job.rules().legend.materials
    side = job.options.pixel_sides[0]
    return [
        {
            "material": int(number),
            "name": name,
            "pixels": int(before[k]),
            "clean_pixels": int(after[k]),
            "mesh_area": float(areas[k]) * side * side,
            "error": float(areas[k] / after[k] - 1.0) if after[k] else 0.0,
            "quads": int(quads[k]),
        }
        for k, (number, name) in enumerate(zip(materials.labels, materials.names, strict=True))
    ]


def _quality(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    quads = sum(row["quads"] for row in rows)
    bins = np.cumsum(np.sum([row["bins"] for row in rows], axis=0))
    inner = sum(row["inner_nodes"] for row in rows)
    return {
        "n_quads": quads,
        "min_sj": min(row["min_sj"] for row in rows),
        "sj_1_percent": int(np.searchsorted(bins, 0.01 * quads)) / BINS,
        "mean_sj": sum(row["sum_sj"] for row in rows) / max(quads, 1),
        "irregular": sum(row["irregular"] for row in rows) / max(inner, 1),
    }


def _regions(job: Job) -> dict[str, Any]:
    """Compare areas of regions with their pixels, as shares."""
    known = load_arrays(job.path("regions"))
    areas = np.zeros(len(known["pixels"]))
    for t in range(job.grid.n_tiles):
        found = final_mesh(job, t)
        np.add.at(areas, found["regions"], found["areas"])
    error = np.abs(areas / known["pixels"] - 1.0)
    large, very = known["pixels"] >= LARGE_REGION, known["pixels"] >= VERY_LARGE
    return {
        "regions": len(error),
        "cut": int(np.count_nonzero(known["is_cut"])),
        "worst_error": float(error[large].max(initial=0.0)),
        "worst_error_of_very_large": float(error[very].max(initial=0.0)),
    }
