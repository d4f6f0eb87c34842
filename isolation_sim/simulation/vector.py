"""The kernel's two linear inner loops, as LLVM vector instructions.

The compiler cannot see that the arrays of these loops do not overlap, and leaves them scalar. A
batch works on all lanes of a number at once; a single run on the eight rows, or eight modes, of a
lane. All arrays are flat float64; indices count rows of ``lanes`` numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

DOUBLE = ir.DoubleType()
INTEGER = ir.IntType(64)
EIGHT = 8


class _Emitter:
    """Vector loads, stores and products in one function's LLVM text."""

    def __init__(self, context: Any, builder: Any, lanes: int):
        self.context, self.builder, self.lanes = context, builder, lanes
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
        if self.lanes > 1:
            return self.load(data, row)
        number = self.builder.load(self.place(data, row))
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
        """Eight rows of start + sum_k table[at + 8 k + r] x[x_at + k x_stride], for each term.

        A term is (at, x, x_at, x_stride); all go through one loop, so that no sum waits for
        another.
        """
        builder = self.builder
        sums = [[cgutils.alloca_once_value(builder, v) for v in start] for start in starts]
        with cgutils.for_range(builder, n, intp=INTEGER) as loop:
            for (at, x, x_at, x_stride), places in zip(terms, sums, strict=True):
                factor = self.value(x, builder.add(x_at, builder.mul(loop.index, x_stride)))
                first = builder.add(at, builder.mul(loop.index, INTEGER(EIGHT)))
                for r, place in zip(self.rows, places, strict=True):
                    product = self.times(self.load(table, self.row(first, r)), factor)
                    builder.store(self.plus(builder.load(place), product), place)
        return [[builder.load(place) for place in places] for places in sums]

    def times(self, a: Any, b: Any) -> Any:
        """Product."""
        return self.builder.fmul(a, b, flags=("contract",))

    def plus(self, a: Any, b: Any) -> Any:
        """Sum."""
        return self.builder.fadd(a, b, flags=("contract",))

    def minus(self, a: Any, b: Any) -> Any:
        """Difference."""
        return self.builder.fsub(a, b, flags=("contract",))

    def row(self, start: Any, offset: int) -> Any:
        """Row number start + offset."""
        return self.builder.add(start, INTEGER(offset))


def make_add_rows(lanes: int) -> Callable:
    """Make ``add_rows(w, to, table, at, x, x_at, x_stride, n)`` for so many lanes.

    It does w[to + r] += sum_k table[at + 8 k + r] x[x_at + k x_stride], for eight rows r.
    """

    @intrinsic
    def add_rows(typing, w, to, table, at, x, x_at, x_stride, n):
        signature = types.void(w, types.int64, table, types.int64, x, *[types.int64] * 3)

        def generate(context, builder, signature, arguments):
            _, to, _, at, _, x_at, x_stride, n = arguments
            emit = _Emitter(context, builder, lanes)
            w, table, x = (emit.data(signature.args[k], arguments[k]) for k in (0, 2, 4))
            start = [emit.load(w, emit.row(to, r)) for r in emit.rows]
            (total,) = emit.products(table, [(at, x, x_at, x_stride)], n, [start])
            for r, value in zip(emit.rows, total, strict=True):
                emit.store(w, emit.row(to, r), value)
            return context.get_dummy_value()

        return signature, generate

    return add_rows


def points_at_once(lanes: int) -> int:
    """Points in time that ``add_rows_at`` takes: as many sums as there are registers for."""
    return EIGHT if lanes == 1 else 1


def make_add_rows_at(lanes: int) -> Callable:
    """Make ``add_rows_at(w, to, table, at, x, points, x_row, x_at, n)`` for so many lanes.

    It does w[to + 8 p + r] += sum_k table[at + 8 k + r] x[points[p] x_row + x_at + k], for some
    points p and eight rows r. A number of the table, once loaded, serves all points.
    """
    n_points = points_at_once(lanes)

    @intrinsic
    def add_rows_at(typing, w, to, table, at, x, points, x_row, x_at, n):
        i = types.int64
        signature = types.void(w, i, table, i, x, points, i, i, i)

        def generate(context, builder, signature, arguments):
            _, to, _, at, _, _, x_row, x_at, n = arguments
            emit = _Emitter(context, builder, lanes)
            w, table, x, points = (emit.data(signature.args[k], arguments[k]) for k in (0, 2, 4, 5))
            numbers = [builder.load(builder.gep(points, [INTEGER(p)])) for p in range(n_points)]
            starts = [builder.add(builder.mul(number, x_row), x_at) for number in numbers]
            places = [
                (p, r, emit.row(to, EIGHT * p + r)) for p in range(n_points) for r in emit.rows
            ]
            sums = [
                cgutils.alloca_once_value(builder, emit.load(w, place)) for *_, place in places
            ]
            with cgutils.for_range(builder, n, intp=INTEGER) as loop:
                first = builder.add(at, builder.mul(loop.index, INTEGER(EIGHT)))
                factors = [emit.value(x, builder.add(s, loop.index)) for s in starts]
                row = {r: emit.load(table, emit.row(first, r)) for r in emit.rows}
                for (p, r, _), total in zip(places, sums, strict=True):
                    product = emit.times(row[r], factors[p])
                    builder.store(emit.plus(builder.load(total), product), total)
            for (*_, place), total in zip(places, sums, strict=True):
                emit.store(w, place, builder.load(total))
            return context.get_dummy_value()

        return signature, generate

    return add_rows_at


def make_free_rows(lanes: int, n_ground: int) -> Callable:
    """Make ``free_rows(w, to, table, at, ground_at, z, z_at, n_modes, n_pad, u, n_points)``.

    It sets w[to + r], for eight rows r, to the response to the modes at z_at (real parts first,
    imaginary ones n_pad behind) and to the ground inputs u; like ``add_rows`` several times, but
    with sums that do not wait for each other.
    """

    @intrinsic
    def free_rows(typing, w, to, table, at, ground_at, z, z_at, n_modes, n_pad, u, n_points):
        i = types.int64
        signature = types.void(w, i, table, i, i, z, i, i, i, u, i)

        def generate(context, builder, signature, arguments):
            _, to, _, at, ground_at, _, z_at, n_modes, n_pad, _, n_points = arguments
            emit = _Emitter(context, builder, lanes)
            w, table, z, u = (emit.data(signature.args[k], arguments[k]) for k in (0, 2, 5, 9))
            zero = [ir.Constant(emit.vector, [0.0] * emit.width) for _ in emit.rows]
            one = INTEGER(1)
            imaginary = builder.add(at, builder.mul(n_modes, INTEGER(EIGHT)))
            parts = [(at, z, z_at, one), (imaginary, z, builder.add(z_at, n_pad), one)]
            a, b = emit.products(table, parts, n_modes, [zero, zero])
            total = [emit.plus(x, y) for x, y in zip(a, b, strict=True)]
            for g in range(n_ground):
                term = (ground_at, u, INTEGER(g), INTEGER(n_ground))
                (pushed,) = emit.products(table, [term], n_points, [zero])
                total = [emit.plus(a, b) for a, b in zip(total, pushed, strict=True)]
                ground_at = builder.add(ground_at, builder.mul(n_points, INTEGER(EIGHT)))
            for r, value in zip(emit.rows, total, strict=True):
                emit.store(w, emit.row(to, r), value)
            return context.get_dummy_value()

        return signature, generate

    return free_rows


def make_move_modes(lanes: int, n_ground: int, force_slots: Sequence[int]) -> Callable:
    """Make ``move_modes`` for so many lanes, ground directions and elements.

    ``move_modes(n_pad, table, decay, ground, force, z, start, to, u, u_at, w, mask)`` writes modes
    [start] of z, decayed and pushed by the ground inputs (two grid points from u_at on) and by the
    nodal forces in ``force_slots`` of w, to [to] of z, in the lanes of the mask. Real parts come
    first, then imaginary ones, n_pad each.
    """

    @intrinsic
    def move_modes(typing, n_pad, table, decay, ground, force, z, start, to, u, u_at, w, mask):
        i = types.int64
        signature = types.void(i, table, i, i, i, z, i, i, u, i, w, mask)

        def generate(context, builder, signature, arguments):
            n_pad, _, decay, ground, force, _, start, to, _, u_at, _, mask = arguments
            emit = _Emitter(context, builder, lanes)
            kinds = signature.args
            table, z, u, w = (emit.data(kinds[k], arguments[k]) for k in (1, 5, 8, 10))
            inputs = []
            for g in range(n_ground):
                for k in range(2):
                    column = builder.mul(n_pad, INTEGER(2 * (2 * g + k)))
                    value = emit.value(u, emit.row(u_at, k * n_ground + g))
                    inputs.append((value, builder.add(ground, column)))
            for k, slot in enumerate(force_slots):
                column = builder.mul(n_pad, INTEGER(2 * k))
                inputs.append((emit.value(w, INTEGER(slot)), builder.add(force, column)))
            step = EIGHT if lanes == 1 else 1
            blocks = builder.udiv(n_pad, INTEGER(step))
            with cgutils.for_range(builder, blocks, intp=INTEGER) as loop:
                m = builder.mul(loop.index, INTEGER(step))
                imaginary = builder.add(m, n_pad)
                er = emit.load(table, builder.add(decay, m))
                ei = emit.load(table, builder.add(decay, imaginary))
                zr = emit.load(z, builder.add(start, m))
                zi = emit.load(z, builder.add(start, imaginary))
                new_r = emit.minus(emit.times(er, zr), emit.times(ei, zi))
                new_i = emit.plus(emit.times(er, zi), emit.times(ei, zr))
                for value, column in inputs:
                    push = emit.load(table, builder.add(column, m))
                    new_r = emit.plus(new_r, emit.times(push, value))
                    push = emit.load(table, builder.add(column, imaginary))
                    new_i = emit.plus(new_i, emit.times(push, value))
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
