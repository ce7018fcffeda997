"""The one way to compile a kernel. Numba is imported here, and in `lowering`, only.

A kernel holds a copy of all that it calls. What it costs at the first start is kept low by two ways to compile:

- ``kernel``: called from Python (and by other kernels);
- ``verb``: a step with a name, called by kernels only: part of them, without machine code of its own.

Kernels assign numbers, never slices or rows (``a[i] = b[j]``): Numba compiles its messages on shapes for these.

Machine code is kept where Numba keeps it (``NUMBA_CACHE_DIR``, beside the sources, or in the user's cache), else in a
folder for temporary files, else not at all. A file that is damaged counts as missing: the kernel is compiled again.
"""

from __future__ import annotations

import logging
import os
import pickle
import stat
import tempfile
import zlib
from functools import cache, cached_property, update_wrapper
from itertools import count
from pathlib import Path
from threading import RLock
from typing import Any, NoReturn, TypeVar

import numba
from numba.core.caching import FunctionCache, IndexDataCacheFile, NullCache

#: versions of Numba whose inside `lowering` knows; with others kernels are the same, and take longer to compile
KNOWN = ("0.68",)
if numba.__version__.rpartition(".")[0] in KNOWN:
    from .lowering import KernelCompiler, KernelFiles, VerbCompiler, ready_to_load, skip_extensions
else:
    from numba.core.caching import CompileResultCacheImpl as KernelFiles  # type: ignore[no-redef,unused-ignore]
    from numba.core.compiler import Compiler as KernelCompiler  # type: ignore[no-redef,unused-ignore]
    from numba.core.compiler import Compiler as VerbCompiler  # type: ignore[no-redef,unused-ignore]

    def ready_to_load(context: Any) -> None:
        """Make `context` ready for machine code that is loaded, as Numba does it."""
        context.refresh()

    def skip_extensions(dispatcher: Any) -> None:
        """Do without what other packages add to Numba, where that can be done."""


F = TypeVar("F")
_KERNELS: list[Any] = []
_LOG = logging.getLogger("imgquad_core")
_MAKING = RLock()
_CURE = "set NUMBA_CACHE_DIR to a folder that can be written, once"


def kernel(function: F) -> F:
    """Compile `function` without the interpreter, release the GIL while it runs, keep the machine code on disk."""
    return _compiled(function)


def verb(function: F) -> F:
    """Compile `function` as a part of the kernels that call it; from Python it raises TypeError."""
    return _compiled(function, is_verb=True)


def _compiled(function: F, is_verb: bool = False) -> F:
    if numba.config.DISABLE_JIT:
        return function
    compiled: Any = _Late(function, is_verb)
    if not is_verb:
        _KERNELS.append(compiled)
    return compiled  # type: ignore[no-any-return]


class _Late:
    """A function that becomes one of Numba's when it is called, or a caller is compiled: at most starts few do."""

    def __init__(self, function: Any, is_verb: bool) -> None:
        update_wrapper(self, function)
        self.py_func = function
        self._is_verb = is_verb
        self._made: Any = None

    def __call__(self, *args: Any) -> Any:
        return (self._made or self.dispatcher)(*args)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.dispatcher, name)

    def __reduce__(self) -> Any:
        name = self.py_func.__qualname__
        return self.dispatcher.__reduce__() if "<locals>" in name else name  # as a function is: by its name

    @property
    def dispatcher(self) -> Any:
        """What Numba makes of the function."""
        with _MAKING:
            self._made = self._made or self._given_to_numba()
        return self._made

    def _given_to_numba(self) -> Any:
        flags = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True, "no_cpython_wrapper": self._is_verb}
        compiler = VerbCompiler if self._is_verb else KernelCompiler
        dispatcher: Any = numba.njit(pipeline_class=compiler, **flags)(self.py_func)
        _ignore_literals(dispatcher)
        if self._is_verb:
            _keep_from_python(dispatcher)
        else:
            dispatcher._cache = self.cache
        skip_extensions(dispatcher)
        return dispatcher

    @cached_property
    def cache(self) -> Any:
        """Where machine code is kept."""
        return _cache_of(self.py_func)


@numba.extending.typeof_impl.register(_Late)  # type: ignore[untyped-decorator,unused-ignore]
def _type_of_late(late: _Late, _: Any) -> Any:
    return numba.typeof(late.dispatcher)


def _ignore_literals(compiled: Any) -> None:
    """Compile one version for all integers: Numba makes one for each number that is written in a call."""
    template = compiled.get_call_template
    compiled.get_call_template = lambda args, kws: template(tuple(map(numba.types.unliteral, args)), kws)


def _keep_from_python(compiled: Any) -> None:
    """Refuse calls from Python, which without a wrapper would end the process."""

    def refuse(*_: Any, **__: Any) -> NoReturn:
        raise TypeError(f"{compiled.__name__} is a verb: kernels call it, Python can't; make it a kernel")

    def add_overload(result: Any) -> None:
        compiled.overloads[tuple(result.signature.args)] = result  # not entered where Python calls look

    compiled._compile_for_args = refuse
    compiled.add_overload = add_overload


def _cache_of(function: Any) -> Any:
    """Return the cache of a function's machine code; one that keeps nothing where no folder can be written."""
    try:
        return _KernelCache(function)
    except RuntimeError:  # Numba's "no locator available"
        folder, asked = _temporary_folder(), numba.config.CACHE_DIR
        if folder is None:
            return NullCache()
        numba.config.CACHE_DIR = folder
        try:
            return _KernelCache(function)
        finally:
            numba.config.CACHE_DIR = asked


@cache
def _temporary_folder() -> str | None:
    """Return a folder of this user alone among the temporary files, told of when it is new; None if there is none."""
    try:
        folder = Path(tempfile.gettempdir()) / f"imgquad-mesh-kernels-{getattr(os, 'getuid', int)()}"
        is_new = not folder.exists()
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()  # code is loaded from there: nobody else may write into it
        is_ours = stat.S_ISDIR(found.st_mode) and (not hasattr(os, "getuid") or found.st_uid == os.getuid())
        if is_ours and not found.st_mode & 0o022 and os.access(folder, os.W_OK):
            if is_new:
                _LOG.warning("compiled kernels are kept in %s, as neither packages nor home can be written", folder)
            return str(folder)
    except OSError:
        pass
    _tell_that_none_is_kept("no folder for them can be written")
    return None


@cache
def _tell_that_none_is_kept(reason: str) -> None:
    _LOG.warning("compiled kernels are not kept, each start takes up to a minute longer: %s; %s", reason, _CURE)


class _KernelCache(FunctionCache):  # type: ignore[misc]
    """Machine code on disk, whose absence or damage never stops a run."""

    _impl_class = KernelFiles

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _CheckedFiles(self._cache_path, self._impl.filename_base, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was kept, or None."""
        try:
            ready_to_load(target_context)
            return self._load_overload(sig, target_context)
        except Exception:  # whatever code raises that another state of the package has left
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code where that can be done."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _tell_that_none_is_kept(f"{self._cache_path}: {error.strerror or error}")


class _CheckedFiles(IndexDataCacheFile):  # type: ignore[misc]
    """Numba's files, each of machine code with a checksum and its key; it is whole before the index names it."""

    def save(self, key: Any, data: Any) -> None:
        """Keep `data`."""
        overloads = self._load_index()
        names = (self._data_name(number) for number in count(1))
        name = overloads.get(key) or next(name for name in names if name not in overloads.values())
        self._save_data(name, (self._source_stamp, key, data))
        if key not in overloads:
            self._save_index({**overloads, key: name})

    def load(self, key: Any) -> Any:
        """Return what was kept under `key`, or None."""
        stamp, kept_key, data = super().load(key) or (None, None, None)
        return data if (stamp, kept_key) == (self._source_stamp, key) else None

    def _load_index(self) -> dict[Any, str]:
        try:
            overloads = super()._load_index()
        except Exception:  # a cut or garbled file raises nearly anything
            return {}
        return overloads if isinstance(overloads, dict) else {}

    def _save_data(self, name: str, data: Any) -> None:
        packed = self._dump(data)
        with self._open_for_write(self._data_path(name)) as file:
            file.write(zlib.crc32(packed).to_bytes(4, "little"))
            file.write(packed)

    def _load_data(self, name: str) -> Any:
        with open(self._data_path(name), "rb") as file:
            checksum, packed = int.from_bytes(file.read(4), "little"), file.read()
        if zlib.crc32(packed) != checksum:
            raise OSError(f"{name} is damaged")
        return pickle.loads(packed)


def share_on_disk() -> float:
    """Return which share of the kernels imported so far an earlier run has left on disk, from 0 to 1.

    Where it is near 0 a run takes up to a minute longer, for compiling.
    """
    folders = folders_on_disk()
    if not folders:
        return 1.0
    kept = {f.name.rsplit("-", 1)[0]: f.stat().st_mtime for folder in folders for f in folder.glob("*.nbi")}
    written = {k.py_func.__code__.co_filename: 0.0 for k in _KERNELS}
    written = {file: Path(file).stat().st_mtime for file in written}
    fresh = [kept.get(_name_on_disk(k), 0.0) >= written[k.py_func.__code__.co_filename] for k in _KERNELS]
    return sum(fresh) / len(fresh)


def folders_on_disk() -> list[Path]:
    """Return where the machine code of the kernels imported so far is kept; nowhere if no folder can be written."""
    of_each_file = {k.py_func.__code__.co_filename: k for k in _KERNELS}
    paths = {k.cache.cache_path for k in of_each_file.values()}
    return sorted(Path(path) for path in paths if path)


def _name_on_disk(compiled: Any) -> str:
    return f"{compiled.__module__.rsplit('.', 1)[-1]}.{compiled.__qualname__}"
