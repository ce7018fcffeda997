"""MeshLab's filters in a child process, each with a deadline: a hang or a crash is an error, not the end."""

from __future__ import annotations

import json
import os
import queue
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.declared import Declaration
from imgquad_core.errors import ImgquadError

from .layer import Layer, load_layer, save_layer
from .pymeshlab_filters import meshlab_filters
from .worker import MEMORY

#: filters that leave points and faces as they are: nothing to save before the next one
_HARMLESS = ("get_", "compute_selection", "compute_color", "compute_scalar", "compute_normal", "set_mesh")
_STARTING = 120.0  #: seconds for the process to start and take the first layer, at least
_MOVING = 20.0  #: seconds for taking a mesh out or putting one in where no filter has just run, at least
_LONGEST = 1e8  #: seconds, three years: what a deadline of infinity means
_SHARE = 0.5  #: of the machine's memory that the process may use where no limit is asked for
_LEAST_MEMORY = 2.0  #: GB, below which pymeshlab itself cannot be relied on
MEMORY_LIMIT = Declaration(8.0, "memory of MeshLab", float, least=_LEAST_MEMORY, unit="GB")
DEADLINE = Declaration(120.0, "time of a filter of MeshLab", float, above=0.0, unit="s")
_OUT_OF_MEMORY = re.compile(r"bad_alloc|MemoryError|[Cc]annot allocate|out of memory|bad allocation")


def memory_limit(asked: float | None) -> float:
    """Return how many GB MeshLab's process may use.

    Raises
    ------
    InputError
        What was asked for is less than pymeshlab itself needs.
    """
    if asked is not None:
        MEMORY_LIMIT.check("memory", asked)
        return float(asked)
    try:
        machine = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 1e9
    except (AttributeError, ValueError, OSError):  # Windows
        return 8.0
    return max(_SHARE * machine, _LEAST_MEMORY)


class MeshLabError(ImgquadError):
    """A filter of MeshLab failed, crashed or did not end in time."""


class MeshLabProcess:
    """A MeshSet in a process of its own.

    Parameters
    ----------
    folder : Path
        A temporary folder for the files in which arrays travel.
    deadline : float
        Seconds that one filter may take, with saving what it has made; infinity for no limit.
    memory : float, optional
        GB that the process may use; half of the machine's where not given. Not limited on Windows.

    Notes
    -----
    Use it in a ``with`` statement: the process ends with it. After each filter that may have changed the mesh, the
    current layer is put into a file, so that `last_good` is there when the next filter takes the process down.
    """

    def __init__(self, folder: Path, deadline: float, memory: float | None = None) -> None:
        meshlab_filters()  # a pymeshlab that is missing or half loaded is named before anything runs
        self.folder = folder
        self.deadline = min(deadline, _LONGEST)
        self.memory = memory_limit(memory)
        self._until: float | None = None  # when the filter that runs, and what is saved of it, must be done
        self._errors = (folder / "stderr.txt").open("wb")
        root = str(Path(__file__).resolve().parents[1])
        paths = [root, *filter(None, [os.environ.get("PYTHONPATH")])]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "imgquad_mesh.meshlab.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths), MEMORY: str(int(self.memory * 1e9))},
            text=True,
            encoding="utf-8",
        )
        self._answers: queue.Queue[str] = queue.Queue()
        threading.Thread(target=_pass_lines, args=(self._process.stdout, self._answers), daemon=True).start()
        self._count = 0
        self._started = False
        self._saved: Path | None = None
        self._read: tuple[Path, Layer] | None = None  # the layer that was asked for last, and its file
        self._files: dict[int, Path] = {}  # of layers, by id, that are still what their file has

    def __enter__(self) -> MeshLabProcess:
        return self

    def __exit__(self, *exception: object) -> None:
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout, self._errors):
            if pipe is not None:
                with suppress(BrokenPipeError):  # what a dead process has not read
                    pipe.close()

    def ask(self, do: str, **request: Any) -> Any:
        """Send one request and return its answer.

        Raises
        ------
        MeshLabError
            When it fails, when the process ends, or when `deadline` passes.
        """
        line = json.dumps({"do": do, **request}) + "\n"
        _ignore_broken_pipes()
        try:
            assert self._process.stdin is not None
            self._process.stdin.write(line)
            self._process.stdin.flush()
            answer = self._answers.get(timeout=self._patience(do))
        except queue.Empty:
            self._process.kill()
            raise MeshLabError(
                f"did not end within {self.deadline:g} s and was stopped; raise the deadline, or leave the filter out "
                "(some of MeshLab's never end on quads: put 'Turn into a Pure-Triangular mesh' before them)"
            ) from None
        except BrokenPipeError:
            answer = ""
        if not answer and _OUT_OF_MEMORY.search(self._messages()):
            raise MeshLabError(self._too_large())
        if not answer:
            raise MeshLabError(f"ended the MeshLab process ({self._exit_reason()}); leave the filter out")
        content = json.loads(answer)
        if "error" in content and _OUT_OF_MEMORY.search(content["error"]):
            raise MeshLabError(self._too_large())
        if "error" in content:
            raise MeshLabError(" ".join(content["error"].split()))
        return content["values"]

    def _patience(self, do: str) -> float:
        if not self._started:
            self._started = True
            return max(self.deadline, _STARTING)
        if self._until is not None:
            return max(self._until - monotonic(), 0.0)
        return max(self.deadline, _MOVING)

    def _too_large(self) -> str:
        return f"needed more than {self.memory:.3g} GB and was stopped; allow more memory, or leave the filter out"

    def _exit_reason(self) -> str:
        code = self._process.wait()
        last = self._messages().strip().splitlines()[-1:]
        return ": ".join([f"signal {-code}" if code < 0 else f"exit code {code}", *(text[:200] for text in last)])

    def add(self, layer: Layer) -> int:
        """Put a layer into the MeshSet; it becomes the current one. Return its id."""
        path = self._file("npz")
        save_layer(layer, path)
        self._saved = path
        mesh = int(self.ask("add", file=str(path)))
        self._files[mesh] = path
        return mesh

    def put(self, layer: Layer) -> int:
        """Put a layer in the place of the current one. Return its id."""
        former = self.layers[1]
        mesh = self.add(layer)
        self.ask("delete", mesh=former)
        if former is not None:
            self._forget(former)
        return mesh

    def open(self, path: Path) -> int:
        """Load a mesh file with MeshLab; it becomes the current one. Return its id."""
        mesh = int(self.ask("open", file=str(path)))
        self._keep()
        return mesh

    def apply(
        self, function: str, parameters: Sequence[tuple[str, str, Any]] = (), script: str | None = None
    ) -> dict[str, Any]:
        """Apply a filter of MeshLab and return its dictionary.

        Parameters
        ----------
        function : str
            pymeshlab's name of the filter.
        parameters : sequence of (str, str, value)
            Python name, type in scripts and value of each.
        script : str, optional
            A script of this filter alone, with MeshLab's names: run where pymeshlab would clamp a value.
        """
        printed = self._messages()
        self._until = monotonic() + self.deadline
        try:
            return self._applied(function, parameters, script, printed)
        finally:
            self._until = None

    def _applied(
        self, function: str, parameters: Sequence[tuple[str, str, Any]], script: str | None, printed: str
    ) -> dict[str, Any]:
        self._forget(*self._files)
        answer = self.ask("apply", function=function, parameters=list(parameters), script=script)
        ignored = re.search(r"parameter (\S+) not required", self._messages()[len(printed) :])
        if answer.get("by_script") and ignored:
            raise MeshLabError(
                f"MeshLab does not know the parameter {ignored[1]} by this name; write it as MeshLab does"
            )
        if not function.startswith(_HARMLESS):
            self._keep()
        return dict(answer["values"])

    def _messages(self) -> str:
        return (self.folder / "stderr.txt").read_text(encoding="utf-8", errors="replace")

    def layer(self, mesh: int | None = None) -> Layer:
        """Return the current layer, or the one with this id."""
        found = self.layers[1] if mesh is None else mesh
        assert found is not None, "no layer is left"
        path = self._file_of(found)
        if self._read is None or self._read[0] != path:
            self._read = path, load_layer(path)
        return self._read[1]

    def _file_of(self, mesh: int) -> Path:
        if mesh not in self._files:
            path = self._file("npz")
            self.ask("save", file=str(path), mesh=mesh)
            self._files[mesh] = path
        return self._files[mesh]

    def _forget(self, *meshes: int) -> None:
        """Remove the files of layers that have changed, but for the last good one."""
        for path in [self._files.pop(mesh) for mesh in meshes if mesh in self._files]:
            if path != self._saved:
                path.unlink(missing_ok=True)

    @property
    def layers(self) -> tuple[list[int], int | None]:
        """Ids of all layers and of the current one."""
        answer = self.ask("layers")
        return answer["ids"], answer["current"]

    def set_current(self, mesh: int) -> None:
        """Make another layer the current one."""
        self.ask("set_current", mesh=mesh)
        self._keep()

    def export(self, path: Path) -> None:
        """Save the current layer with MeshLab, in the format that the extension names."""
        self.ask("export", file=str(path))

    def give(self, do: str, values: NDArray[Any]) -> None:
        """Set points (``move``), a value a face (``set_scalar``) or a colour a face (``set_color``), in place."""
        path = self._file("npy")
        np.save(path, values)
        self.ask("give", what=do, file=str(path))
        path.unlink()
        _, current = self.layers
        self._forget(*[] if current is None else [current])

    def last_good(self) -> Layer | None:
        """Return the current layer as it was before the filter that failed, or None."""
        return load_layer(self._saved) if self._saved else None

    def _keep(self) -> None:
        _, current = self.layers
        if current is None:
            return
        former, self._saved = self._saved, self._file_of(current)
        if former and former != self._saved and former not in self._files.values():
            former.unlink(missing_ok=True)

    def _file(self, ending: str) -> Path:
        self._count += 1
        return self.folder / f"{self._count}.{ending}"


def _pass_lines(pipe: IO[str] | None, answers: queue.Queue[str]) -> None:
    for line in pipe or ():
        answers.put(line)
    answers.put("")  # the process has ended


def _ignore_broken_pipes() -> None:
    """Have a write to a dead process raise, as Python does: gmsh.initialize lets its signal end this process."""
    if hasattr(signal, "SIGPIPE") and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)
