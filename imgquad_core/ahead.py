"""At the first start, compile a half of the kernels in a second process while the first one works on the picture.

Numba compiles in one thread of a process, but processes share what they have compiled on disk. What the second one
compiles are the kernels that the first one needs last.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from functools import cache
from pathlib import Path

from .jit import share_on_disk

WORK = "imgquad_core.mesher.warm_up"  # the module that the second process runs
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
        command = [str(interpreter), "-P", "-m", WORK]  # -P: not the package of a clone that is the current folder
        return subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=none, stderr=none)
    except OSError:
        return None


def end_with_the_first() -> None:
    """In the second process: end as soon as the first one has, which holds the other end of standard input."""

    def watch() -> None:
        while os.read(0, 4096):  # not sys.stdin: whoever holds its lock at the end aborts the interpreter
            pass
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def wait() -> None:
    """Wait until the other process is done; whatever it has not compiled is compiled here."""
    process = start()
    if process is not None:
        try:
            process.wait(LONGEST)
        except subprocess.TimeoutExpired:
            process.kill()
