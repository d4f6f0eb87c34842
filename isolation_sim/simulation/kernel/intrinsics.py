"""LLVM instructions of the kernel where Numba's own code is slower.

- Linear loops over vectors (``make_...``). The compiler cannot see that their arrays do not
  overlap, and leaves them scalar. A batch works on all lanes of a number at once; a single run on
  the eight rows, or eight modes, of a lane. All arrays are flat float64; indices count rows of
  ``lanes`` numbers. With loops in their place a single run takes 1.6 times and a batch 6 times as
  long.
- ``read`` and ``write`` of one number, without a check of the index. With subscripts and a
  conditional expression a kernel takes 1.5 times as long to compile, and runs as fast.
- ``fused``: the compiler's choice which product of two to round depends on whether lanes share a
  factor, and a run's bits must not.
- ``call`` of a compiled controller, and ``element`` of a compiled law, through its address: the
  kernel depends on neither, so that each is compiled and cached once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

from llvmlite import ir
from numba import cfunc, types
from numba.core import cgutils
from numba.extending import intrinsic

from ...compilation.options import OPTIONS

DOUBLE = ir.DoubleType()
INTEGER = ir.IntType(64)
EIGHT = 8


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
    data = arguments[0]
    if isinstance(signature.args[0], types.Array):
        data = context.make_array(signature.args[0])(context, builder, data).data
    return builder.gep(data, [builder.add(arguments[1], arguments[2])])


class _Emitter:
    """Vector loads, stores and products in one function's LLVM text."""

    def __init__(self, context: Any, builder: Any, lanes: int, table_lanes: int):
        self.context, self.builder = context, builder
        self.lanes, self.table_lanes = lanes, table_lanes
        self.width = EIGHT if lanes == 1 else lanes
        self.vector = ir.VectorType(DOUBLE, self.width)

    def data(self, kind: Any, value: Any) -> Any:
        """Address of an array's numbers."""
        return self.context.make_array(kind)(self.context, self.builder, value).data

    def place(self, data: Any, row: Any) -> Any:
        """Address of a row."""
        offset = self.builder.mul(row, INTEGER(self.lanes))
        return self.builder.gep(data, [offset])

    def load(self, data: Any, row: Any) -> Any:
        """Vector that begins at a row."""
        pointer = self.builder.bitcast(self.place(data, row), self.vector.as_pointer())
        return self.builder.load(pointer, align=8)

    def value(self, data: Any, row: Any) -> Any:
        """A factor: of every lane in a batch; one number, repeated, in a single run."""
        return self.load(data, row) if self.lanes > 1 else self.repeated(data, row)

    def coefficient(self, data: Any, row: Any) -> Any:
        """One coefficient of every lane, or one shared by all; eight of them in a single run."""
        shared = self.table_lanes < self.lanes
        return self.repeated(data, row) if shared else self.load(data, row)

    def repeated(self, data: Any, row: Any) -> Any:
        """One number in every place of a vector."""
        number = self.builder.load(self.builder.gep(data, [row]), align=8)
        start = self.builder.insert_element(
            ir.Constant(self.vector, ir.Undefined), number, ir.IntType(32)(0)
        )
        zeros = ir.Constant(ir.VectorType(ir.IntType(32), self.width), [0] * self.width)
        return self.builder.shuffle_vector(start, ir.Constant(self.vector, ir.Undefined), zeros)

    def store(self, data: Any, row: Any, value: Any) -> None:
        """Write a vector at a row."""
        pointer = self.builder.bitcast(self.place(data, row), self.vector.as_pointer())
        self.builder.store(value, pointer, align=8)

    @property
    def rows(self) -> range:
        """Numbers of the vectors that eight rows take."""
        return range(1 if self.lanes == 1 else EIGHT)

    def products(
        self, table: Any, terms: Sequence[tuple], n: Any, starts: Sequence[list[Any]]
    ) -> list[list[Any]]:
        """Eight rows of start + sum_k table[at + 8 k + r] x[x_at + k x_stride], for each term."""
        # A term is (at, x, x_at, x_stride); all go through one loop, so that no sum waits for
        # another.
        builder = self.builder
        sums = [[cgutils.alloca_once_value(builder, v) for v in start] for start in starts]
        with cgutils.for_range(builder, n, intp=INTEGER) as loop:
            for (at, x, x_at, x_stride), places in zip(terms, sums, strict=True):
                factor = self.value(x, builder.add(x_at, builder.mul(loop.index, x_stride)))
                first = builder.add(at, builder.mul(loop.index, INTEGER(EIGHT)))
                for r, place in zip(self.rows, places, strict=True):
                    coefficient = self.coefficient(table, self.row(first, r))
                    builder.store(self.fused(coefficient, factor, builder.load(place)), place)
        return [[builder.load(place) for place in places] for places in sums]

    def fused(self, a: Any, b: Any, c: Any) -> Any:
        """Product of the first two and the third, added."""
        return multiply_add(self.builder, a, b, c)

    def row(self, start: Any, offset: int) -> Any:
        """Row number start + offset."""
        return self.builder.add(start, INTEGER(offset))


def make_respond_to_others(
    lanes: int, table_lanes: int, stride: int, to: int, free: int, force: int
) -> Callable:
    """Make ``respond_to_others(e, n_elements, w, table, force_rows)`` for so many lanes."""
    # It sets eight rows of element e, from slot ``to``, to those of its free response, from slot
    # ``free``, and the response to the other elements' forces at the nodes, from slot ``force``.

    @intrinsic
    def respond_to_others(typing, e, n_elements, w, table, force_rows):
        i = types.int64
        signature = types.void(i, i, w, table, i)

        def generate(context, builder, signature, arguments):
            e, n_elements, _, _, force_rows = arguments
            emit = _Emitter(context, builder, lanes, table_lanes)
            w, table = (emit.data(signature.args[k], arguments[k]) for k in (2, 3))
            base = builder.mul(e, INTEGER(stride))
            sums = [
                cgutils.alloca_once_value(builder, emit.load(w, emit.row(emit.row(base, free), r)))
                for r in emit.rows
            ]
            others = builder.sub(n_elements, INTEGER(1))
            with cgutils.for_range(builder, others, intp=INTEGER) as loop:
                place = builder.add(emit.row(e, 1), loop.index)
                other = builder.urem(place, n_elements)
                pair = builder.add(builder.mul(e, n_elements), other)
                at = builder.add(force_rows, builder.mul(pair, INTEGER(3 * EIGHT)))
                x_at = builder.add(builder.mul(other, INTEGER(stride)), INTEGER(force))
                zero = [ir.Constant(emit.vector, [0.0] * emit.width) for _ in emit.rows]
                pushed = emit.products(table, [(at, w, x_at, INTEGER(1))], INTEGER(3), [zero])
                for total, value in zip(sums, pushed[0], strict=True):
                    builder.store(builder.fadd(builder.load(total), value), total)
            for r, total in zip(emit.rows, sums, strict=True):
                emit.store(w, emit.row(emit.row(base, to), r), builder.load(total))
            return context.get_dummy_value()

        return signature, generate

    return respond_to_others


def points_at_once(lanes: int) -> int:
    """Points in time that ``rows_at`` takes: as many sums as there are registers for."""
    return EIGHT if lanes == 1 else 1


def make_rows_at(lanes: int, table_lanes: int, n_rows: int = EIGHT) -> Callable:
    """Make ``rows_at(w, to, table, at, z, points, row, n_modes, n_pad, f, f_row, n_f, u, n_u)``."""
    # It sets w[to + 8 p + r], for some points p and n_rows of eight rows r, to the sum of the
    # table's numbers [at + 8 k + r] times, one after the other, n_modes real and imaginary parts of
    # z at points[p], n_f forces f at row p, and n_u ground accelerations u at points[p]. A number
    # of the table, once loaded, serves all points.
    n_points = points_at_once(lanes)

    @intrinsic
    def rows_at(typing, w, to, table, at, z, points, row, n_modes, n_pad, f, f_row, n_f, u, n_u):
        i = types.int64
        signature = types.void(w, i, table, i, z, points, i, i, i, f, i, i, u, i)

        def generate(context, builder, signature, arguments):
            _, to, _, at, _, _, row, n_modes, n_pad, _, f_row, n_f, _, n_u = arguments
            emit = _Emitter(context, builder, lanes, table_lanes)
            w, table, z, points, f, u = (
                emit.data(signature.args[k], arguments[k]) for k in (0, 2, 4, 5, 9, 12)
            )
            numbers = [builder.load(builder.gep(points, [INTEGER(p)])) for p in range(n_points)]
            real = [builder.mul(number, row) for number in numbers]
            terms = (
                (z, real, n_modes),
                (z, [builder.add(start, n_pad) for start in real], n_modes),
                (f, [builder.mul(INTEGER(p), f_row) for p in range(n_points)], n_f),
                (u, [builder.mul(number, n_u) for number in numbers], n_u),
            )
            rows = [r for r in emit.rows if r < n_rows]
            zero = ir.Constant(emit.vector, [0.0] * emit.width)
            sums = {
                (p, r): cgutils.alloca_once_value(builder, zero)
                for p in range(n_points)
                for r in rows
            }
            for x, starts, n in terms:
                with cgutils.for_range(builder, n, intp=INTEGER) as loop:
                    first = builder.add(at, builder.mul(loop.index, INTEGER(EIGHT)))
                    factors = [emit.value(x, builder.add(s, loop.index)) for s in starts]
                    for r in rows:
                        coefficient = emit.coefficient(table, emit.row(first, r))
                        for p, factor in enumerate(factors):
                            total = sums[p, r]
                            value = emit.fused(coefficient, factor, builder.load(total))
                            builder.store(value, total)
                at = builder.add(at, builder.mul(n, INTEGER(EIGHT)))
            for (p, r), total in sums.items():
                emit.store(w, emit.row(to, EIGHT * p + r), builder.load(total))
            return context.get_dummy_value()

        return signature, generate

    return rows_at


def make_free_rows(lanes: int, table_lanes: int) -> Callable:
    """Make ``free_rows(w, to, table, at, ground_at, z, z_at, n_modes, n_pad, u, n_points, n)``."""
    # It sets w[to + r], for eight rows r, to the response to the modes at z_at (real parts first,
    # imaginary ones n_pad behind) and to the n ground inputs u, with sums that do not wait for each
    # other.

    @intrinsic
    def free_rows(typing, w, to, table, at, ground_at, z, z_at, n_modes, n_pad, u, n_points, n):
        i = types.int64
        signature = types.void(w, i, table, i, i, z, i, i, i, u, i, i)

        def generate(context, builder, signature, arguments):
            _, to, _, at, ground_at, _, z_at, n_modes, n_pad, _, n_points, n = arguments
            emit = _Emitter(context, builder, lanes, table_lanes)
            w, table, z, u = (emit.data(signature.args[k], arguments[k]) for k in (0, 2, 5, 9))
            zero = [ir.Constant(emit.vector, [0.0] * emit.width) for _ in emit.rows]
            one = INTEGER(1)
            imaginary = builder.add(at, builder.mul(n_modes, INTEGER(EIGHT)))
            parts = [(at, z, z_at, one), (imaginary, z, builder.add(z_at, n_pad), one)]
            a, b = emit.products(table, parts, n_modes, [zero, zero])
            sums = [
                cgutils.alloca_once_value(builder, builder.fadd(x, y))
                for x, y in zip(a, b, strict=True)
            ]
            with cgutils.for_range(builder, n, intp=INTEGER) as loop:
                row = builder.mul(builder.mul(loop.index, n_points), INTEGER(EIGHT))
                term = (builder.add(ground_at, row), u, loop.index, n)
                (pushed,) = emit.products(table, [term], n_points, [zero])
                for total, value in zip(sums, pushed, strict=True):
                    builder.store(builder.fadd(builder.load(total), value), total)
            for r, total in zip(emit.rows, sums, strict=True):
                emit.store(w, emit.row(to, r), builder.load(total))
            return context.get_dummy_value()

        return signature, generate

    return free_rows


def make_move_modes(
    lanes: int, table_lanes: int, stride: int, first: int, n_elements: int, n_ground: int
) -> Callable:
    """Make ``move_modes`` for so many lanes, elements and ground directions, or any number (0)."""
    # ``move_modes(n_pad, table, decay, ground, force, z, start, to, u, u_at, w, mask, n_e, n_g)``
    # writes modes [start] of z, decayed and pushed by n_g ground inputs (two grid points from u_at
    # on) and by the nodal forces of n_e elements in w, from slot ``first``, to [to] of z, in the
    # lanes of the mask. Real parts come first, then imaginary ones, n_pad each. Inputs of known
    # number are read once, and stay in registers.

    @intrinsic
    def move_modes(
        typing, n_pad, table, decay, ground, force, z, start, to, u, u_at, w, mask, n_e, n_g
    ):
        i = types.int64
        signature = types.void(i, table, i, i, i, z, i, i, u, i, w, mask, i, i)

        def generate(context, builder, signature, arguments):
            n_pad, _, decay, ground, force, _, start, to, _, u_at, _, mask, n_e, n_g = arguments
            emit = _Emitter(context, builder, lanes, table_lanes)
            kinds = signature.args
            table, z, u, w = (emit.data(kinds[k], arguments[k]) for k in (1, 5, 8, 10))

            def of_ground(g, k, n):
                """Value and column of a ground input at the first or second point."""
                number = builder.add(builder.mul(g, INTEGER(2)), INTEGER(k))
                column = builder.mul(n_pad, builder.mul(number, INTEGER(2)))
                row = builder.add(u_at, builder.add(builder.mul(INTEGER(k), n), g))
                return emit.value(u, row), builder.add(ground, column)

            def of_element(e, k):
                """Value and column of an element's force at a node."""
                number = builder.add(builder.mul(e, INTEGER(3)), INTEGER(k))
                column = builder.mul(n_pad, builder.mul(number, INTEGER(2)))
                slot = builder.add(builder.mul(e, INTEGER(stride)), INTEGER(first + k))
                return emit.value(w, slot), builder.add(force, column)

            inputs = [
                of_ground(INTEGER(g), k, INTEGER(n_ground)) for g in range(n_ground) for k in (0, 1)
            ]
            inputs += [of_element(INTEGER(e), k) for e in range(n_elements) for k in range(3)]
            step = EIGHT if lanes == 1 else 1
            blocks = builder.udiv(n_pad, INTEGER(step))
            with cgutils.for_range(builder, blocks, intp=INTEGER) as loop:
                m = builder.mul(loop.index, INTEGER(step))
                imaginary = builder.add(m, n_pad)
                er = emit.coefficient(table, builder.add(decay, m))
                ei = emit.coefficient(table, builder.add(decay, imaginary))
                zr = emit.load(z, builder.add(start, m))
                zi = emit.load(z, builder.add(start, imaginary))
                new_r = emit.fused(er, zr, builder.fneg(builder.fmul(ei, zi)))
                new_i = emit.fused(er, zi, builder.fmul(ei, zr))

                def pushed(new, value, column, m=m, imaginary=imaginary):
                    """Modes pushed by an input."""
                    return [
                        emit.fused(emit.coefficient(table, builder.add(column, part)), value, one)
                        for part, one in zip((m, imaginary), new, strict=True)
                    ]

                new = [new_r, new_i]
                for value, column in inputs:
                    new = pushed(new, value, column)
                if not n_elements:
                    places = [cgutils.alloca_once_value(builder, one) for one in new]
                    groups = ((n_g, 2, lambda g, k: of_ground(g, k, n_g)), (n_e, 3, of_element))
                    for count, parts, of in groups:
                        with cgutils.for_range(builder, count, intp=INTEGER) as inner:
                            sums = [builder.load(place) for place in places]
                            for k in range(parts):
                                sums = pushed(sums, *of(inner.index, k))
                            for one, place in zip(sums, places, strict=True):
                                builder.store(one, place)
                    new = [builder.load(place) for place in places]
                new_r, new_i = new
                if lanes > 1:
                    on = _lane_mask(context, builder, kinds[11], mask, lanes)
                    new_r = builder.select(on, new_r, emit.load(z, builder.add(to, m)))
                    new_i = builder.select(on, new_i, emit.load(z, builder.add(to, imaginary)))
                emit.store(z, builder.add(to, m), new_r)
                emit.store(z, builder.add(to, imaginary), new_i)
            return context.get_dummy_value()

        return signature, generate

    return move_modes


def _lane_mask(context: Any, builder: Any, kind: Any, mask: Any, lanes: int) -> Any:
    whole = ir.VectorType(INTEGER, lanes)
    data = context.make_array(kind)(context, builder, mask).data
    numbers = builder.load(builder.bitcast(data, whole.as_pointer()), align=8)
    return builder.icmp_signed("!=", numbers, ir.Constant(whole, [0] * lanes))


ELEMENT = types.void(
    types.int64, types.CPointer(types.float64), types.int64, types.float64, types.float64,
    types.CPointer(types.float64), types.int64, types.CPointer(types.int64),
)  # fmt: skip
"""Signature of a law's ``element``; see ``element_code.py``."""


def make_element(stride: int, lanes: int) -> Callable:
    """Make ``element(functions, operation, e, w, a, b, numbers, at, mask)``."""
    # It calls an operation of element e at the address in functions[e], with its numbers in w from
    # e stride lanes on; of the address 0, of a further direction of the element before, nothing.

    @intrinsic
    def element(typing, functions, operation, e, w, a, b, numbers, at, mask):
        i, d = types.int64, types.float64
        signature = types.void(functions, i, i, w, d, d, numbers, i, mask)

        def generate(context, builder, signature, arguments):
            kinds = signature.args
            functions, w, numbers, mask = (
                context.make_array(kinds[k])(context, builder, arguments[k]).data
                for k in (0, 3, 6, 8)
            )
            _, operation, e, _, a, b, _, at, _ = arguments
            address = builder.load(builder.gep(functions, [e]))
            base = builder.mul(e, INTEGER(stride * lanes))
            own = [operation, w, base, a, b, numbers, at, mask]
            pointer = ir.FunctionType(ir.VoidType(), [value.type for value in own]).as_pointer()
            with builder.if_then(builder.icmp_signed("!=", address, INTEGER(0)), likely=True):
                builder.call(builder.inttoptr(address, pointer), own)
            return context.get_dummy_value()

        return signature, generate

    return element


def address_of_element(function: Callable) -> int:
    """Address of a law's compiled ``element``."""
    return int(_compiled(function).address)


@cache
def _compiled(function: Callable) -> Any:
    return cfunc(ELEMENT, cache=True, **OPTIONS)(function)


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
