"""Mesh many random label pictures and check every mesh: exits with 1 if one is invalid.

    python benchmarks/sweep_random.py --count 3000 --effort normal --seed 0

Prints each failure with the picture that causes it, each new worst scaled Jacobian, and the seconds of each stage.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.boundary.smoothing import smooth_boundaries
from imgquad_core.measures.quality import scaled_jacobian
from imgquad_core.mesher.efforts import EFFORTS
from imgquad_core.mesher.meshing import mesh_boundaries
from imgquad_core.model import QuadMesh
from imgquad_core.options import MeshOptions
from support.invariants import assert_valid_mesh
from support.labels import KINDS, Labels, label_image, labels_of_kind

SIZES = (1.0, 2.5, 6.0)
STAGES = ("boundaries", "mesh", "check")
LARGEST_SIDE, MOST_COLORS = 30, 8


class Case(NamedTuple):
    """One picture and the edge length."""

    kind: str
    n_rows: int
    n_cols: int
    n_colors: int
    seed: int
    size: float

    def labels(self) -> Labels:
        """Return the picture."""
        return labels_of_kind(*self[:5])


def case_of(seed: int) -> Case:
    rng = np.random.default_rng(seed)
    n_rows, n_cols = rng.integers(1, LARGEST_SIDE + 1, 2)
    kind, size = KINDS[rng.integers(len(KINDS))], SIZES[rng.integers(len(SIZES))]
    return Case(kind, int(n_rows), int(n_cols), int(rng.integers(1, MOST_COLORS + 1)), seed, size)


def mesh_case(case: Case, effort: str, seconds: dict[str, float]) -> QuadMesh:
    """Mesh one picture and check it; `seconds` adds up."""
    image = label_image(case.labels())
    start = time.perf_counter()
    options = MeshOptions(size=case.size, effort=effort)
    graph = smooth_boundaries(extract_boundaries(image), options.smoothing(image.materials))
    bounded = time.perf_counter()
    mesh = mesh_boundaries(graph, options.meshing(image.materials), image.materials)
    meshed = time.perf_counter()
    assert_valid_mesh(mesh, image)
    checked = time.perf_counter()
    for stage, spent in zip(STAGES, (bounded - start, meshed - bounded, checked - meshed), strict=True):
        seconds[stage] += spent
    return mesh


def sweep(count: int, seed: int, effort: str) -> int:
    """Return how many pictures give no valid mesh."""
    failed, quads, worst = 0, 0, 1.0
    seconds = dict.fromkeys(STAGES, 0.0)
    for case in map(case_of, range(seed, seed + count)):
        try:
            mesh = mesh_case(case, effort, seconds)
        except Exception as error:  # whatever it is, the sweep goes on
            failed += 1
            print(f"FAILED {case}: {type(error).__name__}: {str(error)[:300]}", flush=True)
            continue
        quads += mesh.n_quads
        quality = float(scaled_jacobian(mesh.points, mesh.quads).min())
        if quality < worst:
            worst = quality
            print(f"worst scaled Jacobian {quality:.4f}: {case}", flush=True)
    print(f"{failed} of {count} pictures failed; {quads} quads; seconds:", {k: round(v, 1) for k, v in seconds.items()})
    return failed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=3000, help="number of pictures")
    parser.add_argument("--seed", type=int, default=0, help="number of the first picture")
    parser.add_argument("--effort", choices=list(EFFORTS), default="normal")
    given = parser.parse_args()
    return 1 if sweep(given.count, given.seed, given.effort) else 0


if __name__ == "__main__":
    sys.exit(main())
