"""At the first start, compile a half of the kernels in a second process while the first one works on the picture.

Numba compiles in one thread of a process, but processes share what they have compiled on disk. What the second one
compiles are the kernels that the first one needs last. Of several first starts side by side one compiles; the others
wait for what it leaves on disk.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable
from functools import cache, wraps
from pathlib import Path
from time import monotonic, sleep
from typing import ParamSpec, TypeVar

from .jit import folders_on_disk, share_on_disk

P = ParamSpec("P")
R = TypeVar("R")
WORK = "imgquad_core.mesher.warm_up"  # the module that the second process runs
FIRST_START = 0.5  # share of the kernels on disk below which it is one
LONGEST = 600.0  # seconds to wait for the other process
PATIENCE = 120.0  # seconds to wait for another first start, about twice what it takes
_HELD: list[int] = []  # the lock of the kernels' folder, while this is the first start that compiles


def compiling(function: Callable[P, R]) -> Callable[P, R]:
    """Have `function` start the other process before it begins, and other first starts wait until it ends at most."""

    @wraps(function)
    def started(*args: P.args, **kwargs: P.kwargs) -> R:
        start()
        try:
            return function(*args, **kwargs)
        finally:
            end_turn()

    return started


@cache
def start() -> subprocess.Popen[bytes] | None:
    """Start the other process if this is the first start (once per process); None where there is nothing to gain."""
    interpreter = Path(sys.executable or "")
    embedded = "python" not in interpreter.name.lower() or getattr(sys, "frozen", False)  # would start the application
    if share_on_disk() >= FIRST_START:
        return None
    for folder in folders_on_disk()[:1]:
        take_turn(folder, PATIENCE)
    if embedded or (os.cpu_count() or 1) == 1 or share_on_disk() >= FIRST_START:
        end_turn()
        return None
    folders = [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, folders))}
    try:
        none = subprocess.DEVNULL
        command = [str(interpreter), "-P", "-m", WORK]  # -P: not the package of a clone that is the current folder
        return subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=none, stderr=none)
    except OSError:
        return None


def take_turn(folder: Path, patience: float) -> None:
    """Wait until no other process compiles into `folder`, at most `patience` seconds; others wait for this one then."""
    try:
        import fcntl

        folder.mkdir(parents=True, exist_ok=True)
        handle = os.open(folder, os.O_RDONLY)  # the system ends the lock of a process that dies
    except (ImportError, OSError):  # Windows
        return
    until = monotonic() + patience
    while True:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            _HELD.append(handle)
            return
        except OSError:
            if monotonic() > until:
                os.close(handle)
                return
            sleep(0.1)


def end_turn() -> None:
    """Let others go on, which wait in `take_turn`."""
    while _HELD:
        os.close(_HELD.pop())


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
    end_turn()
