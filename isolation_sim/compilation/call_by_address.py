"""Calls of compiled functions through their addresses: the caller does not depend on them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import types
from numba.core import cgutils, sigutils
from numba.extending import intrinsic


def make_call(signature: str) -> Callable:
    """Make ``call(address, (arguments))`` of functions of a signature."""
    declared, result = sigutils.normalize_signature(signature)

    @intrinsic
    def call(typing, address, arguments):
        kinds = result(types.int64, types.Tuple(declared))

        def generate(context, builder, kinds, values):
            convention = context.call_conv
            pointer = convention.get_function_type(result, declared).as_pointer()
            function = builder.inttoptr(values[0], pointer)
            given = cgutils.unpack_tuple(builder, values[1])
            status, value = convention.call_function(builder, function, result, declared, given)
            with cgutils.if_unlikely(builder, status.is_error):
                convention.return_status_propagate(builder, status)
            return value if result != types.none else context.get_dummy_value()

        return kinds, generate

    return call


def address_of(function: Any, signature: str) -> int:
    """Address of a function of ``njit``, compiled for a signature."""
    function.compile(signature)
    declared, _ = sigutils.normalize_signature(signature)
    compiled = function.overloads[declared]
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))
