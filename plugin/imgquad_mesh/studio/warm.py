"""Imported once, by the process that workers are forked from: loads (at the first start compiles) the kernels."""

from __future__ import annotations

import numpy as np

from imgquad_core import MeshOptions, mesh_image
from imgquad_mesh.outputs import files, mesh_picture  # noqa: F401  (loaded for the workers; VTK is by those that write)

from . import packing, worker  # noqa: F401


def _work() -> None:
    """Mesh two small pictures, of labels and of greys, as the pages will."""
    labels = np.zeros((60, 80), np.uint8)
    labels[15:45, 20:50] = 1
    greys = np.clip(labels * 120 + 60 + np.random.default_rng(1).normal(0, 8, labels.shape), 0, 255).astype(np.uint8)
    mesh_image(labels)
    mesh_image(greys, MeshOptions(min_pixels=9, min_length=4.0, drop=(0,)))


_work()
