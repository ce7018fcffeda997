"""Mesh many random label pictures and check every mesh: exits with 1 if one is invalid.

    python benchmarks/sweep_random.py --count 3000 --effort normal --seed 0
    python benchmarks/sweep_random.py --count 3000 --simplify          with random steps, joins and tolerances

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

from imgquad_core.measures.quality import scaled_jacobian
from imgquad_core.mesher.efforts import EFFORTS
from imgquad_core.model import QuadMesh
from imgquad_core.options import MeshOptions
from imgquad_core.pipeline import run
from support.invariants import assert_accounted, assert_simplified_mesh, assert_valid_mesh
from support.labels import KINDS, Labels, label_image, labels_of_kind

SIZES = (1.0, 2.5, 6.0)
LARGEST_SIDE, MOST_COLORS = 30, 8


STEPS = ("auto", 1.0, 2.0, 2.6, (3.0, 2.0))
JOINS = (None, 0.0, 3.0, 8.0)
TOLERANCES = (0.0, 1.0, 2.5, 4.0, 7.0, 12.0)
FACTORS = (1, 1, 2, 3)


class Case(NamedTuple):
    """One picture and the edge length; `simplified` draws step, join, tolerance and kept material from its seed."""

    kind: str
    n_rows: int
    n_cols: int
    n_colors: int
    seed: int
    size: float
    simplified: bool = False

    def labels(self) -> Labels:
        """Return the picture, enlarged perhaps where it is simplified."""
        labels = labels_of_kind(*self[:5])
        times = FACTORS[np.random.default_rng(self.seed + 1).integers(len(FACTORS))] if self.simplified else 1
        return np.repeat(np.repeat(labels, times, axis=0), times, axis=1)

    def options(self, effort: str) -> MeshOptions:
        """Return how it is meshed."""
        if not self.simplified:
            return MeshOptions(size=self.size, effort=effort)
        rng = np.random.default_rng(self.seed + 2)
        step, join, tolerance = (each[rng.integers(len(each))] for each in (STEPS, JOINS, TOLERANCES))
        present = np.unique(self.labels())
        keep = (int(present[-1]),) if rng.random() < 0.3 and present[-1] >= 0 else ()
        return MeshOptions(size=self.size, effort=effort, step=step, join=join, tolerance=tolerance, keep=keep)


def case_of(seed: int, simplified: bool = False) -> Case:
    rng = np.random.default_rng(seed)
    n_rows, n_cols = rng.integers(1, LARGEST_SIDE + 1, 2)
    kind, size = KINDS[rng.integers(len(KINDS))], SIZES[rng.integers(len(SIZES))]
    return Case(kind, int(n_rows), int(n_cols), int(rng.integers(1, MOST_COLORS + 1)), seed, size, simplified)


def mesh_case(case: Case, effort: str, seconds: dict[str, float]) -> QuadMesh:
    """Mesh one picture and check it; `seconds` adds up."""
    image = label_image(case.labels())
    done = run(image, case.options(effort))
    start = time.perf_counter()
    assert_accounted(done)
    if done.options.tolerance == 0.0 and done.step == (1.0, 1.0) and done.options.join in (None, 0.0):
        assert_valid_mesh(done.mesh, image)
    else:
        assert_simplified_mesh(done.mesh, done.labels)
    for stage, spent in (done.seconds | {"check": time.perf_counter() - start}).items():
        seconds[stage] = seconds.get(stage, 0.0) + spent
    return done.mesh


def sweep(count: int, seed: int, effort: str, simplified: bool = False) -> int:
    """Return how many pictures give no valid mesh."""
    failed, quads, worst = 0, 0, 1.0
    seconds: dict[str, float] = {}
    for case in (case_of(k, simplified) for k in range(seed, seed + count)):
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
    parser.add_argument("--simplify", action="store_true", help="draw steps, joins and tolerances, too")
    given = parser.parse_args()
    return 1 if sweep(given.count, given.seed, given.effort, given.simplify) else 0


if __name__ == "__main__":
    sys.exit(main())
