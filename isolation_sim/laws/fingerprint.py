"""A digest of the computation of a law or an effect, without running or tracing it.

Equal digests mean equal arithmetic, so that text written out from a law once can be found again in
a later process without CasADi.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from types import CodeType, FunctionType, ModuleType
from typing import Any

from .law import Law


class _Unknown(Exception):
    """A function depends on an object that cannot be described in a digest."""


def fingerprint(computation: Any) -> str | None:
    """Return the digest of a law, or of a list of functions and numbers; None if there is none."""
    digest = hashlib.sha256()
    try:
        for part in _parts(computation, set()):
            digest.update(part)
    except _Unknown:
        return None
    return digest.hexdigest()


def _functions(law: Law) -> list[Any]:
    """Those of the law; two laws may differ in their states at rest alone."""
    rest = [] if law.rest is None else [law.rest]
    return [law.force, law.rates, law.stored_energy, *rest]


def _parts(value: Any, seen: set[int]) -> Iterator[bytes]:
    """Bytes that determine a value: numbers, text, code and containers of these."""
    if isinstance(value, FunctionType):
        if id(value) in seen:
            return
        seen.add(id(value))
        yield from _code(value.__code__)
        yield from _parts(value.__defaults__, seen)
        for cell in value.__closure__ or ():
            yield from _parts(cell.cell_contents, seen)
        for name in _names(value.__code__):
            if name in value.__globals__:
                yield name.encode()
                yield from _parts(value.__globals__[name], seen)
    elif isinstance(value, Law):
        named = [value.parameter_names, value.state_names, value.directions]
        yield from _parts([*named, *_functions(value)], seen)
    elif isinstance(value, list | tuple):
        yield f"{type(value).__name__} {len(value)} ".encode()
        for item in value:
            yield from _parts(item, seen)
    elif isinstance(value, ModuleType):
        yield value.__name__.encode()
    elif isinstance(value, type) and issubclass(value, tuple):
        yield f"{value.__qualname__} {getattr(value, '_fields', ())} ".encode()
    elif value is None or isinstance(value, bool | int | float | str):
        yield f"{type(value).__name__} {value!r} ".encode()
    else:
        raise _Unknown


def _code(code: CodeType) -> Iterator[bytes]:
    yield code.co_code
    yield repr((code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)).encode()
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _code(constant)
        else:
            yield repr(constant).encode()


def _names(code: CodeType) -> Iterator[str]:
    """Global names that a function and those inside it use."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)
