"""How the kernels are compiled changes no result: without machine code, with a memory."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError
from numba.core.types.functions import BaseFunction

from isolation_sim.compilation import options as compilation
from isolation_sim.compilation.call_by_address import address_of, make_call
from isolation_sim.compilation.options import KernelCompiler, LinkedCompiler


def polynomial(x, n):
    total = 0.0
    for k in range(n):
        total = total * x + np.sqrt(k + x)
    return total


def compiled(inner):
    """A function that calls another one, and the other one's only library of code."""

    def total(values, n):
        result = 0.0
        for value in values:
            result += inner(value, n)
        return result

    outer = njit(total)
    values = np.linspace(0.1, 1.1, 50)
    result = outer(values, 7)
    (overload,) = inner.overloads.values()
    return result, overload.library


def test_the_installed_numba_has_what_is_replaced():
    assert compilation._KNOWN
    assert compilation._REMEMBERS


def test_a_linked_function_gives_the_same_bits_without_machine_code():
    options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    usual, machine_code = compiled(njit(**options)(polynomial))
    result, library = compiled(njit(pipeline_class=LinkedCompiler, **options)(polynomial))
    assert result == usual
    assert isinstance(library, compilation._Library)
    name = next(f.name for f in machine_code.get_defined_functions() if "polynomial" in f.name)
    assert machine_code.get_pointer_to_function(name) != 0
    name = next(f.name for f in library.get_defined_functions() if "polynomial" in f.name)
    assert library.get_pointer_to_function(name) == 0


def test_a_function_is_called_through_its_address():
    signature = "float64(float64, int64)"
    call = make_call(signature)
    function = njit(no_cpython_wrapper=True, no_cfunc_wrapper=True)(polynomial)
    through = njit(lambda address, x, n: call(address, (x, n)))
    address = address_of(function, signature)
    assert through(address, 0.3, 7) == polynomial(0.3, 7)


def test_an_unknown_numba_compiles_as_usual(monkeypatch):
    monkeypatch.setattr(compilation, "_KNOWN", False)
    monkeypatch.setattr(compilation, "_REMEMBERS", False)
    options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    result, library = compiled(njit(pipeline_class=LinkedCompiler, **options)(polynomial))
    assert result == compiled(njit(**options)(polynomial))[0]
    assert not isinstance(library, compilation._Library)


def test_an_operation_is_looked_up_once_for_its_types(monkeypatch):
    def mixed(x, n):
        return 0.5 * x + 1.5 * (x + 2) * (x + 3) * n - (n + 2) * (n + 3) * 4, x > n, n > 2

    usual = njit(mixed)
    results = [usual(x, n) for x, n in ((0.3, 7), (np.float32(0.3), 7), (-2, 1.5))]
    asked, look_up = [], compilation._look_up
    monkeypatch.setattr(compilation, "_SIGNATURES", {})
    monkeypatch.setattr(
        compilation, "_look_up",
        lambda function, context, args, kws: (
            asked.append((function.key[0], args)) or look_up(function, context, args, kws)
        ),
    )  # fmt: skip
    kernel = njit(pipeline_class=KernelCompiler)(mixed)
    assert [kernel(x, n) for x, n in ((0.3, 7), (np.float32(0.3), 7), (-2, 1.5))] == results
    assert kernel.nopython_signatures == usual.nopython_signatures
    assert len(asked) == len(set(asked)) > 10


def test_the_compiler_of_others_is_left_as_it_was():
    usual = BaseFunction.get_call_type
    assert njit(pipeline_class=KernelCompiler)(lambda x: x + 1)(2) == 3
    with pytest.raises(TypingError):
        njit(pipeline_class=KernelCompiler)(lambda x: x + "text")(2)
    assert BaseFunction.get_call_type is usual
