"""Types of calls that Numba has found before.

Numba finds the type of every sum and product of a kernel anew, among a dozen candidates, and
compares its options one by one each time. Here the type of a call of numbers and arrays is looked
up by those of its arguments, and options are compared by those that are set. Where Numba's classes
have other methods, nothing is changed.
"""

from __future__ import annotations

import inspect
from typing import Any

from numba.core import types
from numba.core.targetconfig import ConfigStack, TargetConfig
from numba.core.types.functions import BaseFunction

_KINDS = types.Number, types.Boolean, types.Array
_find_call_type = BaseFunction.get_call_type
_compare = TargetConfig.__eq__
_known: dict[Any, Any] = {}


def _call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
    """Signature of a call, by the types of its arguments and the options of the compilation."""
    if kws or not all(map(_is_number_or_array, args)):
        return _find_call_type(self, context, args, kws)
    key = self, context, tuple(args), ConfigStack.top_or_none()
    if key not in _known:
        _known[key] = _find_call_type(self, context, args, kws)
    return _known[key]


def _is_number_or_array(kind: Any) -> bool:
    indices = isinstance(kind, types.UniTuple) and isinstance(kind.dtype, types.Number)
    return indices or isinstance(kind, _KINDS)


def _equal(self: Any, other: Any) -> Any:
    """Whether two sets of options are equal; most have the same values set."""
    if type(self) is not type(other):
        return _compare(self, other)
    mine, theirs = self._values, other._values
    if mine == theirs:
        return True
    return all(getattr(self, name) == getattr(other, name) for name in {*mine, *theirs})


def _hash(self: Any) -> int:
    """Of the options' names alone, as Numba's."""
    return hash(tuple(type(self).options))


if list(inspect.signature(_find_call_type).parameters) == ["self", "context", "args", "kws"] and (
    TargetConfig.__slots__ == ["_values"]
):
    BaseFunction.get_call_type = _call_type
    TargetConfig.__eq__ = _equal
    TargetConfig.__hash__ = _hash
