"""Read and write a number of a flat float64 array, as one instruction of the kernel's text.

What these do can be written with subscripts and a conditional expression; Numba then spends
several times as long on each of the many slots of an element. Nothing checks the index.

Sums of products with a structure's coefficients are fused by hand: the compiler's choice which
product of two to round depends on whether the lanes share them, and a run's bits must not.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


@intrinsic
def read(typing, array, at, offset):
    """array[at + offset]."""
    signature = types.float64(array, types.int64, types.int64)

    def generate(context, builder, signature, arguments):
        return builder.load(_place(context, builder, signature, arguments), align=8)

    return signature, generate


@intrinsic
def write(typing, array, at, offset, value, on):
    """array[at + offset] = value if on else array[at + offset], as a select, not a branch."""
    signature = types.void(array, types.int64, types.int64, types.float64, types.boolean)

    def generate(context, builder, signature, arguments):
        place = _place(context, builder, signature, arguments)
        value, on = arguments[3:]
        on = builder.trunc(on, ir.IntType(1)) if on.type.width > 1 else on
        builder.store(builder.select(on, value, builder.load(place, align=8)), place, align=8)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def fused(typing, a, b, c):
    """A b + c, rounded once where the processor can: always the same, whatever stands around it."""
    signature = types.float64(types.float64, types.float64, types.float64)

    def generate(context, builder, signature, arguments):
        return multiply_add(builder, *arguments)

    return signature, generate


def multiply_add(builder: Any, a: Any, b: Any, c: Any) -> Any:
    """Numbers or vectors a b + c, in one function's LLVM text."""
    width = f"v{a.type.count}" if isinstance(a.type, ir.VectorType) else ""
    function = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(a.type, [a.type] * 3), f"llvm.fmuladd.{width}f64"
    )
    return builder.call(function, [a, b, c])


def _place(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
    return builder.gep(data, [builder.add(arguments[1], arguments[2])])
