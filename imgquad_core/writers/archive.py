"""The whole mesh as a NumPy archive."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np

from imgquad_core.fe.femesh import FEMesh
from imgquad_core.whole_files import replacing


def write_npz(mesh: FEMesh, path: str | Path) -> None:
    """Write a NumPy archive (``.npz``) for ``numpy.load``.

    Its arrays are the fields of `FEMesh`; sets are ``node_sets/left``, ``side_sets/left``, ``element_sets/quartz``.
    """
    arrays = {
        "points": mesh.points,
        "kind": np.array(mesh.kind),
        "cells": mesh.cells,
        "cell_material": mesh.cell_material,
        "cell_region": mesh.cell_region,
        "cohesive": mesh.cohesive,
        "cohesive_pair": mesh.cohesive_pair,
        "chain_offsets": mesh.chain_offsets,
        "chain_points": mesh.chain_points,
        "material_labels": mesh.materials.labels,
        "material_names": np.array(mesh.materials.names, np.str_),
        "material_colors": mesh.materials.colors,
    }
    for group, sets in (
        ("node_sets", mesh.node_sets),
        ("side_sets", mesh.side_sets),
        ("element_sets", {**mesh.material_cells(), **mesh.element_sets}),
        ("periodic", mesh.periodic),
    ):
        arrays |= {f"{group}/{name.replace('/', '_')}": ids for name, ids in sets.items()}
    whole = BytesIO()  # NumPy's archive is noisy where a disk fills up
    np.savez_compressed(whole, **arrays)
    with replacing(path) as temporary:
        temporary.write_bytes(whole.getvalue())  # no copy, and no view of bytes that an error keeps
