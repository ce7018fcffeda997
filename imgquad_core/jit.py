"""The one way to compile a kernel. Numba is imported here only.

A function is compiled together with a copy of all that it calls, so every level of calls compiles what lies below it
once more. What it costs at the first start is kept low by three ways to compile:

- ``kernel``: called from Python (and by other kernels);
- ``verb``: a small step, called by kernels only: nothing that the interpreter needs is made;
- ``inlined``: a large step of one kernel: part of it, not compiled on its own.

Kernels assign numbers, never slices or rows (``a[i] = b[j]``): Numba compiles its messages on shapes for these.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NoReturn, TypeVar

import numba

F = TypeVar("F")
_KERNELS: list[Any] = []


def kernel(function: F) -> F:
    """Compile `function` without the interpreter, release the GIL while it runs, keep the machine code on disk."""
    return _compiled(function)


def verb(function: F) -> F:
    """Compile `function` like a kernel, for calls by kernels only; from Python it raises TypeError."""
    return _compiled(function, no_cpython_wrapper=True)


def inlined(function: F) -> F:
    """Make `function` part of the kernels that call it."""
    return _compiled(function, inline="always")


def _compiled(function: F, **flags: Any) -> F:
    flags |= {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
    compiled: Any = numba.njit(**flags)(function)
    if not hasattr(compiled, "get_call_template"):  # NUMBA_DISABLE_JIT: the function itself
        return compiled  # type: ignore[no-any-return]
    _ignore_literals(compiled)
    if flags.get("no_cpython_wrapper"):
        _keep_from_python(compiled)
    if "inline" not in flags:
        _KERNELS.append(compiled)
    return compiled  # type: ignore[no-any-return]


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


def share_on_disk() -> float:
    """Return which share of the kernels imported so far an earlier run has left on disk, from 0 to 1.

    Where it is near 0 a run takes half a minute longer, for compiling.
    """
    folders = {getattr(getattr(k, "_cache", None), "cache_path", None) for k in _KERNELS}
    if folders == {None} or not _KERNELS:
        return 1.0
    kept = {f.name.rsplit("-", 1)[0]: f.stat().st_mtime for p in folders if p for f in Path(p).glob("*.nbi")}
    written = {k.py_func.__code__.co_filename: 0.0 for k in _KERNELS}
    written = {file: Path(file).stat().st_mtime for file in written}
    fresh = [kept.get(_name_on_disk(k), 0.0) >= written[k.py_func.__code__.co_filename] for k in _KERNELS]
    return sum(fresh) / len(fresh)


def _name_on_disk(compiled: Any) -> str:
    return f"{compiled.__module__.rsplit('.', 1)[-1]}.{compiled.__qualname__}"
