"""Call a compiled controller from the compiled loop, through its address.

An address, where Numba's own function type would do, because it costs nothing to pass and does
not make the kernel depend on the controller: each is compiled and cached once.
"""

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


@intrinsic
def call(context, function, t, measured, settings, memory, command, sizes):
    """function(t, measured, settings, memory, command, sizes), the last five being addresses."""
    signature = types.void(types.intp, types.float64, *[types.intp] * 5)

    def generate(context, builder, signature, arguments):
        doubles = ir.DoubleType().as_pointer()
        integers = ir.IntType(64).as_pointer()
        kinds = [ir.DoubleType(), doubles, doubles, doubles, doubles, integers]
        pointer = ir.FunctionType(ir.VoidType(), kinds).as_pointer()
        values = [arguments[1]]
        for address, kind in zip(arguments[2:], kinds[1:], strict=True):
            values.append(builder.inttoptr(address, kind))
        builder.call(builder.inttoptr(arguments[0], pointer), values)
        return context.get_dummy_value()

    return signature, generate
