"""Numba's compiler, quicker for this package: what it does in vain for kernels is left out.

- A verb is called by kernels only, which hold a copy of it. It gets no machine code of its own, and is not optimised
  before it is part of a kernel.
- What a kernel calls is its own, so that only the arguments that it looks at are handed over: a NamedTuple of arrays
  is some hundred numbers otherwise (a clean-up takes a quarter less time).
- References to arrays are counted only where arrays are made: elsewhere the caller holds all of them.
- Machine code from disk is loaded without what compiling would need (0.34 -> 0.11 s for the 56 kernels of a run).
- Which of its 50 kinds of sums an ``a + b`` is, is looked up once for each pair of types.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from llvmlite import binding
from numba.core.caching import CompileResultCacheImpl
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, CompileResult, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.runtime import _nrt_python
from numba.core.targetconfig import ConfigStack
from numba.core.typed_passes import NativeLowering
from numba.core.types.functions import BaseFunction

_UNCOUNTED: dict[Any, Any] = {}  # Numba's own functions, compiled without counts
_RESOLVED: dict[Any, tuple[BaseFunction, Any]] = {}
_resolve = BaseFunction.get_call_type


def ready_to_load(context: Any) -> None:
    """Get ready for machine code that is loaded: all that Numba can compile, 0.1 s, is not needed for it."""
    _name_runtime()


@cache
def _name_runtime() -> None:
    """Tell the linker where the functions are that machine code calls."""
    for name, address in _nrt_python.c_helpers.items():
        binding.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)


def skip_extensions(dispatcher: Any) -> None:
    """Do without what other packages add to Numba, for which all packages are looked through."""
    dispatcher._compilation_chain_init_hook = lambda: None


class KernelFiles(CompileResultCacheImpl):  # type: ignore[misc]
    """What is kept of a kernel, and how it is loaded: to be called; what its callers need if any are compiled, then."""

    def reduce(self, result: Any) -> Any:
        """Return what is kept; environments are for objects of Python, which most verbs have none of."""
        *others, environments = super().reduce(result)
        return (*others, tuple(e for e in environments if e.consts))

    def rebuild(self, target_context: Any, kept: Any) -> Any:
        """Return the kernel."""
        (name, _, codes), described, environment, signature, _, lifted, text, begun, environments = kept
        for begin in begun:
            begin()
        library = _Loaded(target_context.codegen(), name, *codes)
        entry = target_context.get_executable(library, described, environment)
        for each in environments:
            library.codegen.set_env(each.env_name, each)
        return CompileResult(
            target_context=target_context,
            typing_context=target_context.typing_context,
            library=library,
            environment=environment,
            entry_point=entry,
            fndesc=described,
            type_annotation=text,
            signature=signature,
            objectmode=False,
            lifted=lifted,
            typing_error=None,
            call_helper=None,
            metadata=None,
            reload_init=begun,
            referenced_envs=environments,
        )


class _Loaded(JITCodeLibrary):  # type: ignore[misc]
    """Machine code from disk, and its source as LLVM has it, which is parsed when a caller is compiled."""

    def __init__(self, codegen: Any, name: str, code: bytes, source: bytes) -> None:
        super().__init__(codegen, name)
        self._source = source
        self._linkable: Any = None
        self.enable_object_caching()
        self._set_compiled_object(code)
        self._finalize_final_module()

    def get_pointer_to_function(self, name: str) -> int:
        """Return the address of one of its functions."""
        return int(self._codegen._engine.get_function_address(name))

    def _get_module_for_linking(self) -> Any:
        if self._linkable is None:
            self._linkable = binding.parse_bitcode(self._source)
            self._codegen._engine._load_defined_symbols(self._linkable)
        return self._linkable


class _Whole(JITCodeLibrary):  # type: ignore[misc]
    """Code of a kernel. Its copies of what it calls are its own: they take only the arguments that they look at."""

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if function.linkage == binding.Linkage.linkonce_odr and not function.name.startswith("NRT_"):
                function.linkage = "internal"
        super()._optimize_final_module()


class _Part(JITCodeLibrary):  # type: ignore[misc]
    """Code that becomes part of kernels: optimised with them, never run by itself."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class _KernelLowering(NativeLowering):  # type: ignore[misc]
    """Machine code of a kernel."""

    _name = "kernel_lowering"

    def run_pass(self, state: Any) -> bool:
        """Compile what `state` has."""
        if not _makes_arrays(state):
            state.targetctx = state.targetctx.subtarget(enable_nrt=False, cached_internal_func=_UNCOUNTED)
        if state.library is None:
            state.library = _Whole(state.targetctx.codegen(), state.func_id.func_qualname)
            state.library.enable_object_caching()
        return bool(super().run_pass(state))


@register_pass(mutates_CFG=True, analysis_only=False)
class _VerbLowering(_KernelLowering):
    """Code of a verb, for the kernels that call it."""

    _name = "verb_lowering"

    def run_pass(self, state: Any) -> bool:
        """Compile what `state` has."""
        state.library = _Part(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        entry = object()  # stands for the function that Python would call: callers look the code up by it
        state["cr"] = state["cr"]._replace(cfunc=entry)
        state.targetctx.insert_user_function(entry, state["cr"].fndesc, [state.library])
        return True


def _makes_arrays(state: Any) -> bool:
    """Whether a call, an operator or a slice of a function gives an array (or a tuple of them), or its result is one.

    Numba holds what a function was given for it; nothing else in it needs a count of references then.
    """
    given = [signature.return_type for signature in state.calltypes.values() if signature is not None]
    models = state.targetctx.data_model_manager
    return any(models[kind].contains_nrt_meminfo() for kind in {state.return_type, *given})


class KernelCompiler(CompilerBase):  # type: ignore[misc]
    """Numba's compiler with another last step."""

    _lowering = _KernelLowering

    def define_pipelines(self) -> list[Any]:
        """Return the passes."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.passes = [(self._lowering if p is NativeLowering else p, text) for p, text in passes.passes]
        return [passes]

    def compile_extra(self, func: Any) -> Any:
        """Compile `func`."""
        with _resolving_once():
            return super().compile_extra(func)


class VerbCompiler(KernelCompiler):
    """The same for verbs."""

    _lowering = _VerbLowering


@contextmanager
def _resolving_once() -> Iterator[None]:
    """Remember which overload of an operator or a function of NumPy is meant, while kernels are compiled."""
    before, BaseFunction.get_call_type = BaseFunction.get_call_type, _resolve_once
    try:
        yield
    finally:
        BaseFunction.get_call_type = before


def _resolve_once(function: BaseFunction, context: Any, args: Any, kws: Any) -> Any:
    flags = ConfigStack.top_or_none()
    key = id(function), args, flags.error_model if flags else ""
    if kws or flags is None:
        return _resolve(function, context, args, kws)
    if key not in _RESOLVED:
        _RESOLVED[key] = function, _resolve(function, context, args, kws)
    return _RESOLVED[key][1]
