"""One session a page: a folder for what was uploaded, and a worker process, which is killed to cancel its work."""

from __future__ import annotations

import asyncio
import json
import shutil
import sys
import tempfile
from collections.abc import AsyncIterator
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from time import monotonic
from typing import Any

#: the modules that workers are forked with; `warm` has run a mesh, so that they start with loaded kernels
PRELOAD = ["imgquad_mesh.studio.warm"]


@dataclass(frozen=True)
class Limits:
    """What a page may use."""

    bytes: int = 64_000_000  #: of an upload
    pixels: int = 16_000_000  #: of a picture
    memory: int = 2_000_000_000  #: data of a worker, bytes
    sessions: int = 4  #: at once
    young: float = 60.0  #: seconds without a request before a session may give way to a new one
    idle: float = 600.0  #: seconds after which a worker ends
    kept: float = 3600.0  #: seconds after which a session is forgotten
    slow: float = 10.0  #: seconds that the next part of an upload may take


class Busy(Exception):
    """A request cannot be served now; the text says why and what to do."""


class Worker:
    """A process that answers tasks; killed, it leaves nothing behind."""

    def __init__(self, folder: Path, limits: Limits) -> None:
        context = _context()
        self._pipe, theirs = context.Pipe()
        arguments = (theirs, str(folder), limits.pixels, limits.memory)
        self._process = context.Process(target=_work, args=arguments, daemon=True)
        self._process.start()
        theirs.close()

    @property
    def alive(self) -> bool:
        """Whether it can answer."""
        return bool(self._process.is_alive())

    def ask(self, task: dict[str, Any]) -> None:
        """Give it a task."""
        self._pipe.send(task)

    async def answer(self) -> bytes:
        """Return its next line or its data; EOFError where it has died."""
        return await asyncio.to_thread(_received, self._pipe)

    def kill(self) -> None:
        """End it, whatever it does."""
        self._process.kill()


def _work(*arguments: Any) -> None:
    """Be a worker."""
    from .worker import work  # not above: only the worker's process needs NumPy

    work(*arguments)


def _received(pipe: Connection) -> bytes:
    try:
        return pipe.recv_bytes()
    except OSError as error:  # reset, where it was killed while it wrote
        raise EOFError from error


def _context() -> Any:
    """Return how processes are started: forked from one that has all loaded, where the system can."""
    if sys.platform == "win32":
        return get_context("spawn")
    context = get_context("forkserver")
    context.set_forkserver_preload(PRELOAD)
    return context


def start_fork_server() -> None:
    """Let the process start that workers are forked from, and load the kernels: now, not at the first picture."""
    if sys.platform != "win32":
        from multiprocessing.forkserver import ensure_running  # there is none on Windows

        _context()
        ensure_running()


class Session:
    """What one page has: a folder, the names of what it uploaded, a worker."""

    def __init__(self, root: Path, limits: Limits) -> None:
        self.folder = Path(tempfile.mkdtemp(dir=root))
        self.picture: tuple[str, str] | None = None  #: file in the folder, name to show
        self.marks: str | None = None  #: file in the folder
        self.used = monotonic()
        self.lock = asyncio.Lock()
        self.waiting = False
        self._limits = limits
        self._worker: Worker | None = None
        self._uploads = 0

    def new_file(self, suffix: str) -> Path:
        """Return where to put an upload: a name that no other has had, so that what is remembered is of this one."""
        self._uploads += 1
        return self.folder / f"upload{self._uploads}{suffix}"

    def took(self, path: Path, name: str) -> None:
        """Take a picture in the place of the former one, which is deleted with its marks."""
        self._delete(self.picture[0] if self.picture else None, self.marks)
        self.picture, self.marks = (path.name, name), None

    def took_marks(self, path: Path) -> None:
        """Take marks in the place of the former ones."""
        self._delete(self.marks)
        self.marks = path.name

    def _delete(self, *names: str | None) -> None:
        for name in names:
            if name:
                (self.folder / name).unlink(missing_ok=True)

    async def lines(self, task: dict[str, Any]) -> AsyncIterator[bytes]:
        """Return the answer to a task: lines of JSON, the last one with the number of bytes behind it.

        A caller that goes away in between kills the worker: that is how work is cancelled.
        """
        done = False
        try:
            yield b'{"stage": "start"}\n'
            worker = await self._ready()
            worker.ask(self._with_files(task))
            while not done:
                line = await worker.answer()
                told = json.loads(line)
                done = "stage" not in told
                yield line + b"\n"
                if told.get("bytes"):
                    yield await worker.answer()
        except EOFError:
            done = False
            yield b'{"error": "the worker ended, perhaps for want of memory: crop the picture or try again"}\n'
        finally:
            self.used = monotonic()
            if not done:
                self.rest()

    def _with_files(self, task: dict[str, Any]) -> dict[str, Any]:
        file, name = self.picture or ("", "")
        return task | {"file": file, "name": name, "marks": self.marks}

    async def _ready(self) -> Worker:
        if self._worker is None or not self._worker.alive:
            self._worker = await asyncio.to_thread(Worker, self.folder, self._limits)
        return self._worker

    def rest(self) -> None:
        """End the worker; the next task starts another, which finds all in the recipe and the folder."""
        if self._worker is not None:
            self._worker.kill()
            self._worker = None

    def end(self) -> None:
        """End the worker and delete the folder."""
        self.rest()
        shutil.rmtree(self.folder, ignore_errors=True)


class Sessions:
    """The sessions of all pages, by their ids; none outlives the studio."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self._root = Path(tempfile.mkdtemp(prefix="imgquad-studio-"))
        self._of: dict[str, Session] = {}

    def of(self, tab: str) -> Session:
        """Return the session of a page, a new one where it has none.

        Raises
        ------
        Busy
            There are too many, and none has been idle for long.
        """
        if tab not in self._of:
            self._make_room()
            self._of[tab] = Session(self._root, self.limits)
        self._of[tab].used = monotonic()
        return self._of[tab]

    def _make_room(self) -> None:
        if len(self._of) < self.limits.sessions:
            return
        longest = min(self._of, key=lambda tab: self._of[tab].used)
        if self._of[longest].lock.locked() or monotonic() - self._of[longest].used < self.limits.young:
            raise Busy(f"{len(self._of)} pages are open, which is all there may be: close one, or wait a minute")
        self.forget(longest)

    def forget(self, tab: str) -> None:
        """End the session of a page that was closed."""
        session = self._of.pop(tab, None)
        if session is not None:
            session.end()

    async def reap(self) -> None:
        """Now and then end what is idle."""
        while True:
            await asyncio.sleep(min(30.0, self.limits.idle))
            for tab, session in list(self._of.items()):
                idle = monotonic() - session.used
                if session.lock.locked():
                    continue
                if idle > self.limits.kept:
                    self.forget(tab)
                elif idle > self.limits.idle:
                    session.rest()

    def end(self) -> None:
        """End all sessions and delete their folders."""
        for tab in list(self._of):
            self.forget(tab)
        shutil.rmtree(self._root, ignore_errors=True)
