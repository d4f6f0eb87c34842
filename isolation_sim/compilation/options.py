"""How the kernel's functions are compiled.

With ``NUMBA_DISABLE_JIT=1`` nothing is compiled: the same functions run as Python, in which a
debugger can stop.
"""

from __future__ import annotations

import math as python_math
from types import SimpleNamespace
from typing import Any

import numpy as np
from numba import njit
from numba.core import codegen
from numba.core.compiler import Compiler, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.typed_passes import AnnotateTypes
from numba.core.types.functions import BaseFunction

from .generated import COMPILED

# Numba optimises every function, and makes machine code of it, before it links the function into
# its callers, where it is optimised once more. Functions that only compiled code calls are only
# linked, which saves a quarter of the compilation. Where Numba's classes have other methods,
# functions are compiled as usual.
_REPLACED = (
    "_optimize_final_module", "_finalize_final_module", "_ensure_finalized", "codegen",
    "get_pointer_to_function",
)  # fmt: skip
_KNOWN = all(hasattr(codegen.JITCodeLibrary, name) for name in _REPLACED)


# Numba looks up what an operation means wherever it stands, among all that have its sign, which
# takes a few milliseconds. The answer for the same types serves again, which saves a quarter of
# the compilation. Functions other than its own operations are still looked up.
_Function: Any = BaseFunction
_look_up: Any = getattr(BaseFunction, "get_call_type", None)
_REMEMBERS = _look_up is not None and hasattr(BaseFunction, "get_impl_key")
_SIGNATURES: dict[Any, Any] = {}


def _look_up_once(function: Any, context: Any, args: Any, kws: Any) -> Any:
    """Signature of a function for types of arguments, in place of Numba's own method."""
    place = context, function, tuple(args)
    if place in _SIGNATURES and not kws:
        return _SIGNATURES[place]
    signature = _look_up(function, context, args, kws)
    if signature and not kws and function.get_impl_key(signature) is function.key[0]:
        _SIGNATURES[place] = signature
    return signature


class KernelCompiler(Compiler):
    """Numba's compiler with a memory of operations, ``njit(pipeline_class=...)``."""

    def compile_extra(self, func: Any) -> Any:
        """Compile a function, and those that it calls first; Numba compiles one at a time."""
        if not _REMEMBERS:
            return super().compile_extra(func)
        outside = _Function.get_call_type
        _Function.get_call_type = _look_up_once
        try:
            return super().compile_extra(func)
        finally:
            _Function.get_call_type = outside


class _Library(codegen.JITCodeLibrary):
    """Code that becomes machine code only in its callers."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> Any:
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Nothing: the environment belongs to machine code."""


@register_pass(mutates_CFG=False, analysis_only=False)
class _LinkOnly(LoweringPass):
    _name = "link_only"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        state.library = _Library(state.targetctx.codegen(), state.func_id.func_qualname)
        return True


class LinkedCompiler(KernelCompiler):
    """Compiler of functions without entry from Python or C, ``njit(pipeline_class=...)``."""

    def define_pipelines(self) -> list[Any]:
        """Numba's passes, with another library of the code."""
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        if _KNOWN:
            manager.add_pass_after(_LinkOnly, AnnotateTypes)
            manager.finalize()
        return [manager]


# not a set, whose order differs between processes
OPTIONS: dict[str, Any] = {
    "fastmath": {"contract": True, "nsz": True}, "error_model": "numpy", "_nrt": False,
    "pipeline_class": KernelCompiler,
}  # fmt: skip
# no product is fused with a sum: the same bits wherever it stands
EXACT: dict[str, Any] = {**OPTIONS, "fastmath": False}
# nothing but the kernel calls these: they need no entry from Python
_INNER: dict[str, Any] = {
    **OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True,
    "pipeline_class": LinkedCompiler,
}  # fmt: skip
_EXACT = {**_INNER, "fastmath": False}
inner = njit(**_INNER)
inline = njit(forceinline=True, **_INNER)
exact = njit(**_EXACT)
exact_inline = njit(forceinline=True, **_EXACT)
# Python's own functions raise errors where Numba's and NumPy's return infinity
math: Any = python_math if COMPILED else SimpleNamespace(**vars(np), erf=python_math.erf)
