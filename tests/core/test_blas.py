"""The mesh does not hang on BLAS, whose sums differ with its number of threads."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import imgquad_core

SOURCES = sorted(Path(imgquad_core.__file__).parent.rglob("*.py"))
#: by NumPy: BLAS or LAPACK; norms along an axis are plain sums, einsum without `optimize` too
OF_BLAS = {"dot", "vdot", "inner", "matmul", "tensordot", "multi_dot", "lstsq", "solve", "inv", "eig", "eigh", "svd"}
#: SciPy's sparse matrices have loops of their own; single matrices of 3, 4 and 9 rows; sums over four numbers, which
#: no thread cuts; whole numbers
ALLOWED = {
    ("areas.py", "matrix @ direction"),
    ("sets.py", "of.tocsr() @ on.tocsr()"),
    ("quantisation.py", "np.linalg.eigh("),
    ("grains.py", "np.linalg.eigh("),
    ("shading.py", "np.linalg.solve("),
    ("grains.py", "turn @ other"),
    ("grains.py", "between @ crystal_symmetries(laue).T"),
    ("grains.py", "between @ symmetries.T"),
    ("info_bar.py", "row.astype(np.int64) @ "),
}

SMOOTHED = """
import hashlib
import numpy as np
from imgquad_core.boundary import extract_boundaries, smooth_boundaries
from imgquad_core.model import LabelImage, Materials
labels = np.random.default_rng(2).integers(0, 16, (125, 125))
image = LabelImage(labels, Materials(np.arange(16), tuple(map(str, range(16))), np.zeros((16, 3))))
graph = smooth_boundaries(extract_boundaries(image))
assert len(graph.region_label) > 10_000
print(hashlib.sha1(graph.points.tobytes()).hexdigest())
"""


def uses_of_blas(file: Path) -> list[str]:
    text = file.read_text(encoding="utf-8")
    found = []
    for node in ast.walk(ast.parse(text)):
        is_product = isinstance(node, (ast.BinOp, ast.AugAssign)) and isinstance(node.op, ast.MatMult)
        called = node.func.attr if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) else ""
        optimised = called == "einsum" and any(k.arg == "optimize" for k in getattr(node, "keywords", []))
        if is_product or called in OF_BLAS or optimised:
            found.append(ast.get_source_segment(text, node) or "")
    return found


def test_nothing_in_the_core_uses_blas() -> None:
    found = [(file.name, use) for file in SOURCES for use in uses_of_blas(file)]
    assert not [(f, use) for f, use in found if not any(f == g and use.startswith(start) for g, start in ALLOWED)]


def test_more_than_ten_thousand_regions_are_smoothed_alike_with_any_number_of_threads() -> None:
    made = set()
    for threads in "124":
        env = os.environ | {f"{name}_NUM_THREADS": threads for name in ("OPENBLAS", "MKL", "OMP")}
        done = subprocess.run([sys.executable, "-c", SMOOTHED], capture_output=True, text=True, env=env, check=False)
        assert done.returncode == 0, done.stderr
        made.add(done.stdout)
    assert len(made) == 1
