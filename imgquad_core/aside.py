"""At the first start, compile a half of the kernels in a second process while the first one works on the picture.

Numba compiles in one thread of a process, but processes share what they have compiled on disk. What the second one
compiles are the kernels that the first one needs last.
"""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np

from .jit import share_on_disk

FIRST_START = 0.5  # share of the kernels on disk below which it is one
LONGEST = 600.0  # seconds to wait for the other process


@cache
def start() -> subprocess.Popen[bytes] | None:
    """Start the other process if this is the first start (once per process); None where there is nothing to gain."""
    interpreter = Path(sys.executable or "")
    embedded = "python" not in interpreter.name.lower() or getattr(sys, "frozen", False)  # would start the application
    if embedded or (os.cpu_count() or 1) == 1 or share_on_disk() >= FIRST_START:
        return None
    folders = [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, folders))}
    try:
        none = subprocess.DEVNULL
        command = [str(interpreter), "-P", "-m", __name__]  # -P: not the package of a clone that is the current folder
        return subprocess.Popen(command, env=environment, stdin=none, stdout=none, stderr=none)
    except OSError:
        return None


def wait() -> None:
    """Wait until the other process is done; whatever it has not compiled is compiled here."""
    process = start()
    if process is not None:
        try:
            process.wait(LONGEST)
        except subprocess.TimeoutExpired:
            process.kill()


def compile_last_stages() -> None:
    """Compile the optimisation of quads, by using it on one."""
    from .relaxation import BAD, GOOD, fit_rim, laplace, lower_to_worst, newton, rings_of, sector_angles, untangle
    from .repair import repair
    from .sliding import slide
    from .splitting import FaceQuads, split_quads
    from .topology import CleanUp, clean_up

    points, ids = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), np.arange(4)
    mesh = FaceQuads(points, ids[None, :].copy(), np.zeros(1, np.int64), ids, np.ones(4, np.int64))
    split_quads(mesh, np.full(4, -1), np.full((4, 1), -1))
    clean_up(mesh, CleanUp((1,), 0.0, 0.0))
    repair(mesh, 2.0)
    rings, none = rings_of(mesh.quads, 4), np.zeros(4, bool)
    newton(points, rings, none, 1, GOOD)
    kind, offsets, chain = np.zeros(4, np.uint8), np.array([0, 4]), ids.copy()
    for values in (kind, offsets, chain):
        values.flags.writeable = False  # as in a mesh
    slide(points, rings, kind, offsets, chain, np.zeros(4))
    fit_rim(points, rings, none, points, 1)
    laplace(points, rings, none, 1)
    untangle(points, rings, none, 1, BAD)
    sector_angles(points, mesh.quads, none)
    lower_to_worst(points, mesh.quads, mesh.face, np.ones(1))


if __name__ == "__main__":
    compile_last_stages()
