"""The same mesh gives the same bytes, in every format."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from imgquad_core.writers import WRITERS
from imgquad_core.writers.hdf5_times import _lookup3
from imgquad_mesh.outputs.files import GRID_EXTENSIONS

WRITE = """
import sys, time
import numpy as np
from pathlib import Path
from imgquad_core import MeshOptions, run
from imgquad_mesh.outputs import files
labels = np.zeros((20, 30), np.int32); labels[5:15, 8:20] = 1
made = run(labels, MeshOptions(size=3))
folder = Path(sys.argv[1])
for extension in sys.argv[2:]:
    if extension == "labels.png": files.write_labels(made.labels, folder / extension)
    elif extension == "labels.npy": files.write_labels(made.labels, folder / extension)
    elif extension.startswith("picture"): files.write_picture(made.mesh, folder / extension)
    elif extension.endswith(".vtp"): files.write_boundaries(made, folder / extension)
    else: files.write_mesh_file(made.mesh, folder / f"mesh{extension}")
"""
OTHERS = ("labels.png", "labels.npy", "picture.png", "picture.svg", "picture.pdf", "boundaries.vtp")


def test_every_format_is_the_same_in_two_processes(tmp_path: Path) -> None:
    for package in ("gmsh", "meshio", "h5py"):
        pytest.importorskip(package)
    for name in ("a", "b"):  # loading takes more than a second: times in files would differ
        (tmp_path / name).mkdir()
        command = [sys.executable, "-c", WRITE, str(tmp_path / name), *GRID_EXTENSIONS, *WRITERS, *OTHERS]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    a, b = ({f.name: f.read_bytes() for f in sorted((tmp_path / name).iterdir())} for name in ("a", "b"))
    assert len(a) >= len(GRID_EXTENSIONS) + len(WRITERS) + len(OTHERS)
    assert [name for name in a if a[name] != b[name]] == []
    _assert_readable(tmp_path / "a")


def _assert_readable(folder: Path) -> None:
    import h5py
    import pyvista as pv

    grids = [pv.read(folder / f"mesh{extension}") for extension in (".vtu", ".vtkhdf")]
    assert np.array_equal(grids[0].points, grids[1].points)
    with h5py.File(folder / "mesh.med", "r") as file:
        assert "ENS_MAA" in file
        for name in ("ENS_MAA", "FAS"):  # checksums of all headers are tested as they are read
            file[name].visititems(lambda name, item: item.attrs.items() and None)


def test_the_checksum_is_that_of_its_author() -> None:
    assert _lookup3(b"Four score and seven years ago") == 0x17770551  # driver5() of lookup3.c
    assert _lookup3(b"") == 0xDEADBEEF
