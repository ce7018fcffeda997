"""Scripts of tests, the picture that they start with, and the mark of tests that want pymeshlab."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from imgquad_mesh.meshlab.pymeshlab_filters import MissingMeshLab, meshlab_filters


def _missing_meshlab() -> str:
    try:
        meshlab_filters()
    except MissingMeshLab as error:
        return str(error)
    return ""


needs_meshlab = pytest.mark.skipif(bool(_missing_meshlab()), reason=_missing_meshlab() or "-")

LABELS = np.zeros((24, 30), np.int32)
LABELS[6:18, 8:20] = 3
LABELS[2, 2:4] = 5


def script_file(folder: Path, *elements: str) -> Path:
    path = folder / "script.mlx"
    lines = ["<!DOCTYPE FilterScript>", "<FilterScript>", *elements, "</FilterScript>"]
    path.write_text("\n".join(lines), encoding="utf-8")
    return path
