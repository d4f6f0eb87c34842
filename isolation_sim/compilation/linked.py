"""Compilation of functions that only compiled code calls.

Numba optimises every function, and makes machine code of it, before it links the function into its
callers, where it is optimised once more. These functions are only linked, which saves a quarter of
the compilation. Where Numba's classes have other methods, functions are compiled as usual.
"""

from __future__ import annotations

from typing import Any

from numba.core import codegen
from numba.core.compiler import Compiler, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.typed_passes import AnnotateTypes

_REPLACED = (
    "_optimize_final_module", "_finalize_final_module", "_ensure_finalized", "codegen",
    "get_pointer_to_function",
)  # fmt: skip
_KNOWN = all(hasattr(codegen.JITCodeLibrary, name) for name in _REPLACED)


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


class LinkedCompiler(Compiler):
    """Compiler of functions without entry from Python or C, ``njit(pipeline_class=...)``."""

    def define_pipelines(self) -> list[Any]:
        """Numba's passes, with another library of the code."""
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        if _KNOWN:
            manager.add_pass_after(_LinkOnly, AnnotateTypes)
            manager.finalize()
        return [manager]
