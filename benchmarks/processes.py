"""Each measurement in a process of its own: peak memory and crashes belong to one mesher only."""

from __future__ import annotations

import functools
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from PIL.Image import Resampling

from imgquad_mesh.outputs.rock_picture import draw_rock

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
#: of BLAS; the threads that are compared are those of the meshers
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


class FailedError(Exception):
    """A process that ended without an answer; the message is one line for a table."""


def python(*command: object, timeout: float = 900.0, **environment: str) -> str:
    """Run Python with these arguments, and say so on stderr; return what it printed.

    Raises
    ------
    FailedError
        It did not end within `timeout` seconds, or not with 0.
    """
    paths = [str(ROOT), str(ROOT / "plugin"), *filter(None, [os.environ.get("PYTHONPATH")])]
    variables = {**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(paths), **environment}
    arguments = [sys.executable, *map(str, command)]
    print("python", *arguments[1:], file=sys.stderr, flush=True)
    try:
        done = subprocess.run(arguments, capture_output=True, text=True, env=variables, timeout=timeout, check=False)
    except subprocess.TimeoutExpired as error:
        raise FailedError(f"not done after {timeout:.0f} s") from error
    if done.returncode:
        said = (done.stderr.strip().splitlines() or ["nothing on stderr"])[-1]
        raise FailedError(f"exit code {done.returncode}: {said[:160]}")
    return done.stdout


def answer(script: str, *arguments: object, timeout: float = 900.0) -> dict[str, Any]:
    """Run a script of this folder that prints JSON in its last line; return it."""
    found: dict[str, Any] = json.loads(python(HERE / script, *arguments, timeout=timeout).splitlines()[-1])
    return found


@functools.cache
def compile_kernels() -> None:
    """Have every kernel compiled and on disk before the first measurement."""
    labels = draw_rock().crop((0, 0, 160, 160))
    photo = labels.convert("RGB").resize((320, 320), Resampling.BILINEAR)
    with tempfile.TemporaryDirectory() as folder:
        for picture in (labels, photo):
            paths = Path(folder) / "rock.png", Path(folder) / "rock.vtu"
            picture.save(paths[0])
            python("-m", "imgquad_mesh", "run", *paths, "--quiet", "--min-pixels", 16, "--min-length", 8)


def mesh_picture(picture: Path, mesh: Path, *options: object, **environment: str) -> dict[str, Any]:
    """Run ``imgquad-mesh run PICTURE MESH`` as a user does, on compiled kernels; return its report."""
    if "NUMBA_CACHE_DIR" not in environment:
        compile_kernels()
    report = mesh.with_suffix(".json")
    command = ("-m", "imgquad_mesh", "run", picture, mesh, "--report", report, "--quiet")
    python(*command, *options, **environment)
    found: dict[str, Any] = json.loads(report.read_text(encoding="utf-8"))
    return found
