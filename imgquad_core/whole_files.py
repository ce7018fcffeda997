"""Files that appear whole or not at all, and inputs that are never outputs.

A file is written in a hidden folder beside its place and moved there at the end. The folder is locked while its process
lives: those of dead processes are removed by whoever writes there next.
"""

from __future__ import annotations

import atexit
import os
import shutil
import stat
import tempfile
import time
import unicodedata
import uuid
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeAlias

from .errors import InputError

PREFIX = ".imgquad-"
UNLOCKED = 60.0  #: seconds for which a folder may not be locked yet
BYTES_AT_ONCE = 1 << 20

_Key: TypeAlias = "tuple[str | int, ...]"
_OPEN: dict[Path, int] = {}  # scratch folders that are not removed yet, with the process that made them


@contextmanager
def replacing(path: str | Path, is_ours: Callable[[Path], bool] | None = None) -> Iterator[Path]:
    """Give a path in a new folder beside `path`, with the same name; move what was written there when all went well.

    Parameters
    ----------
    path : path
        The file. A link is followed, and the mode of a file that is there is kept.
    is_ours : callable, optional
        Tells whether a file that is in the way of a second one, written along with `path`, may be replaced. By
        default it may if `path` is there, too.

    Raises
    ------
    InputError
        Nothing can be written there, or the disk is full. What was at `path` before is still there.
    """
    try:
        target = real_target(Path(path))
        with scratch_folder(target.parent) as folder:
            yield folder / Path(path).name
            _move_all(folder, Path(path), target, is_ours or (lambda _: target.exists()))
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(
            f"cannot write {path}: {reason}; nothing was changed, free some space or choose another place"
        ) from error


def real_target(path: Path) -> Path:
    """Return the file that writing to `path` replaces, links followed.

    Raises
    ------
    InputError
        It is no file (a folder, a device), links that lead to themselves, or a file that is write-protected.
    """
    target = Path(os.path.realpath(path))
    if target.is_symlink():
        raise InputError(f"{path} is a link that leads to itself: remove it, or give another name")
    if target.is_dir():
        raise InputError(f"{path} is a folder: give the name of a file")
    if not target.exists():
        return target
    mode = target.stat().st_mode
    if not stat.S_ISREG(mode):
        raise InputError(f"{path} is no file but a device or the like: give the name of a file")
    if not mode & 0o222 or not os.access(target, os.W_OK):
        raise InputError(f"{path} is write-protected: give another name, or allow writing")
    return target


def _move_all(folder: Path, path: Path, target: Path, is_ours: Callable[[Path], bool]) -> None:
    """Move all files of the folder beside `target`, it itself last, while no other process does."""
    parts = sorted(part for part in folder.iterdir() if part.name != path.name)
    with _locked(target.parent, wait=True):
        places = [target.parent / part.name for part in parts]
        for place in places:
            if place.exists() and not is_ours(place):
                raise InputError(foreign_file(place, path))
        for part, place in zip([*parts, folder / path.name], [*places, target], strict=True):
            if place.exists():
                part.chmod(stat.S_IMODE(place.stat().st_mode))
            os.replace(part, place)


def foreign_file(place: Path, path: Path) -> str:
    """Say that `place`, which is written along with `path`, is a file of somebody else."""
    return f"{path} is written together with {place.name}, which is there and not of such a file: give another name"


@contextmanager
def scratch_folder(parent: Path | None = None) -> Iterator[Path]:
    """Give a new hidden folder in `parent` (by default among the temporary files) that is removed at the end."""
    parent = Path(tempfile.gettempdir()) if parent is None else parent
    _sweep(parent)
    folder = parent / f"{PREFIX}{uuid.uuid4().hex[:12]}"
    _OPEN[folder] = os.getpid()  # before it is made: an interrupt may come right after
    try:
        folder.mkdir(mode=0o700)
        with _locked(folder):
            yield folder
    finally:
        _remove(folder)


def _remove(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    if not folder.exists():
        _OPEN.pop(folder, None)


@atexit.register
def remove_scratch() -> None:
    """Remove what an interrupt has left of this process, but not what the process has that it was forked from."""
    for folder, process in list(_OPEN.items()):
        if process == os.getpid():
            _remove(folder)


@contextmanager
def _locked(folder: Path, wait: bool = False) -> Iterator[bool]:
    """Hold the lock of a folder; give whether it was had: not where another process holds it, or there are no locks."""
    try:
        import fcntl  # there is none on Windows

        handle = os.open(folder, os.O_RDONLY)
    except (ImportError, OSError):
        yield False
        return
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
            had = True
        except OSError:
            had = False
        yield had
    finally:
        os.close(handle)


def _sweep(parent: Path) -> None:
    """Remove the scratch folders that dead processes have left in `parent`."""
    with suppress(OSError):
        for folder in parent.glob(f"{PREFIX}*"):
            found = folder.lstat()
            old = time.time() - found.st_mtime > UNLOCKED
            if old and stat.S_ISDIR(found.st_mode) and found.st_uid == _user():
                with _locked(folder) as had:
                    if had:
                        shutil.rmtree(folder, ignore_errors=True)


def _user() -> int:
    return os.getuid() if hasattr(os, "getuid") else 0


def take_room(folder: Path, n_bytes: int) -> None:
    """Raise `OSError` if there is no room for `n_bytes` in `folder`, by writing as many.

    For libraries that crash or keep silent where a disk fills up, as those that write HDF5 do.
    """
    with tempfile.TemporaryFile(dir=folder) as stream:
        for start in range(0, n_bytes, BYTES_AT_ONCE):
            stream.write(bytes(min(BYTES_AT_ONCE, n_bytes - start)))


def assert_apart(inputs: Iterable[str | Path], outputs: Iterable[str | Path]) -> None:
    """Raise where a file that is to be written is read, too, or is written twice.

    Files are told by what they are on disk, not by their spelling: links, hard links and names that differ in case
    where the file system does not tell it are one file.

    Raises
    ------
    InputError
        Two of them are one file.
    """
    read = {key: Path(path) for path in inputs for key in _keys(Path(path))}
    written: dict[_Key, Path] = {}
    for path in map(Path, outputs):
        keys = _keys(path)
        for key in keys & read.keys():
            raise InputError(f"{path} would replace {read[key]}, which is read: give the output another name")
        folded = keys | {_folded(path)}
        for key in folded & written.keys():
            raise InputError(f"two outputs are one file, {written[key]} and {path}: give one of them another name")
        written |= dict.fromkeys(folded, path)


def _keys(path: Path) -> set[_Key]:
    """Return what tells a file from others: its place with links resolved, and its number on the disk."""
    real = os.path.realpath(path)
    keys: set[_Key] = {(real,)}
    with suppress(OSError):
        found = os.stat(real)
        keys.add((found.st_dev, found.st_ino))
    with suppress(OSError):
        folder = os.stat(os.path.dirname(real))
        keys.add((folder.st_dev, folder.st_ino, os.path.basename(real)))
    return keys


def _folded(path: Path) -> _Key:
    """Return the place of a file as file systems see it that tell neither case nor forms of accents."""
    return ("folded", unicodedata.normalize("NFC", os.path.realpath(path)).casefold())
