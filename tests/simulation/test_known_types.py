"""Types of calls that are looked up are those that Numba finds."""

import operator
from itertools import product

import pytest
from numba import types
from numba.core.compiler import DEFAULT_FLAGS
from numba.core.registry import cpu_target
from numba.core.targetconfig import TargetConfig
from numba.core.types.functions import BaseFunction

from isolation_sim.compilation import known_types

KINDS = (
    types.int64, types.uint64, types.float64, types.boolean, types.literal(3), types.float64[::1],
    types.float64[:, ::1],
)  # fmt: skip


def test_numbas_classes_are_as_known():
    assert BaseFunction.get_call_type is known_types._call_type
    assert TargetConfig.__eq__ is known_types._equal


PAIRS = list(product(KINDS, repeat=2))
INDICES = [(types.float64[:, ::1], types.UniTuple(one, 2)) for one in (types.int64, types.uint64)]


@pytest.mark.parametrize(
    ("function", "arguments"),
    [(operator.add, PAIRS), (operator.truediv, PAIRS), (operator.lt, PAIRS),
     (max, product(KINDS[:5], repeat=2)), (operator.getitem, INDICES)],
)  # fmt: skip
def test_signatures_are_numbas(function, arguments):
    context = cpu_target.typing_context
    context.refresh()
    kind = context.resolve_value_type(function)
    for args in arguments:
        expected = known_types._find_call_type(kind, context, args, {})
        for _ in range(2):
            assert kind.get_call_type(context, args, {}) == expected


def test_options_are_equal_if_their_values_are():
    one, other = DEFAULT_FLAGS.copy(), DEFAULT_FLAGS.copy()
    assert one == other and hash(one) == hash(other)
    other.nrt = not one.nrt
    assert one != other
    other.nrt = one.nrt
    # set to its default in one and not set in the other
    other.no_cpython_wrapper = other.no_cpython_wrapper
    assert one == other and one.values() == other.values()
