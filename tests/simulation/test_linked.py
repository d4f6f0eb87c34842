"""Functions that only compiled code calls have no machine code, and change no result."""

from __future__ import annotations

import numpy as np
from numba import njit

from isolation_sim.compilation import options as compilation
from isolation_sim.compilation.options import LinkedCompiler


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


def test_an_unknown_numba_compiles_as_usual(monkeypatch):
    monkeypatch.setattr(compilation, "_KNOWN", False)
    options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    result, library = compiled(njit(pipeline_class=LinkedCompiler, **options)(polynomial))
    assert result == compiled(njit(**options)(polynomial))[0]
    assert not isinstance(library, compilation._Library)
