"""Arguments of exported names: a wrong name or a wrong type gives one clear line."""

from __future__ import annotations

import ast
import functools
import inspect
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import import_module
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from ground_motions.errors import InputError, did_you_mean
from ground_motions.python_source import parse

T = TypeVar("T", bound=Callable[..., Any])
_HINTS = {
    "Control": "controller(name), or an instance of a subclass of controllers.Controller",
    "Device": "a Device, such as law(name)",
    "IsolatedStructure": "an IsolatedStructure, such as structure.on(device)",
    "Record": "a Record, such as ground_motions.read(path), load_record(name) or "
    "Record(acceleration, dt)",
}
"""Expected objects by the name of their class, where the name alone is not clear."""

_NOT_NEEDED = {"Control": ("compiled", "current", "preview_time")}
"""Members that a protocol's users look for and can do without."""

_LISTS = (Sequence, Iterable, list, tuple)
_WORDS = {
    float: "a number",
    int: "a whole number",
    bool: "True or False",
    str: "text",
    NoneType: "None",
    Mapping: "a mapping",
    dict: "a mapping",
    Callable: "a function",
}


def checked(thing: T) -> T:
    """Decorate a function or a class: refuse unknown arguments, and those of a wrong type."""
    if isinstance(thing, type):
        thing.__init__ = _with_check(thing.__init__, thing.__module__)  # type: ignore[misc]
        return thing
    return _with_check(thing, thing.__module__)


def refuse_wrong_type(place: str, value: Any, kind: Any) -> None:
    """Raise `InputError` where a value is not of the annotated kind."""
    wrong = _misfit(place, value, kind)
    if wrong is not None:
        place, value, kind = wrong
        raise InputError(place, shown(value), _description(kind))


def shown(value: Any) -> str:
    """Return a value as an error names it: itself where it is short, its type otherwise."""
    if value is None or isinstance(value, bool | int | float | str):
        return f"{value!r}"
    if isinstance(value, type):
        return f"the class {value.__name__}"
    if isinstance(value, os.PathLike):
        return f"the path {os.fspath(value)!r}"
    if isinstance(value, list) and len(repr(value)) < 40:
        return repr(value)
    return "an array" if _is_array(type(value)) else _with_article(type(value).__name__)


def _with_check(function: Any, module: str) -> Any:
    parameters = inspect.signature(function).parameters.values()
    positional = [
        each.name
        for each in parameters
        if each.kind in (each.POSITIONAL_ONLY, each.POSITIONAL_OR_KEYWORD)
    ]
    any_name = any(each.kind is each.VAR_KEYWORD for each in parameters)
    named = [each.name for each in parameters if each.name != "self"]

    @functools.cache
    def kinds() -> dict[str, Any]:
        names = _Names(module)
        annotations = function.__annotations__.items()
        return {name: names.kind(text) for name, text in annotations if name != "return"}

    # Arguments and shapes of which all objects are known to be right, and the others
    accepted: set[tuple[str, Any]] = set()
    various: set[tuple[str, Any]] = set()

    @functools.wraps(function)
    def with_check(*args: Any, **kwargs: Any) -> Any:
        for name, value in (*zip(positional, args, strict=False), *kwargs.items()):
            case = name, _shape(value)
            if case in accepted:
                continue
            if name not in named and not any_name and name in kwargs:
                what = function.__qualname__.removesuffix(".__init__")
                raise TypeError(
                    f"{what} has no argument {name!r};{did_you_mean(name, named)} expected: "
                    f"{', '.join(named)}"
                )
            kind = kinds().get(name, Any)
            refuse_wrong_type(name, value, kind)
            if case not in various:
                (accepted if _is_decided(case[1], kind) else various).add(case)
        return function(*args, **kwargs)

    return with_check


def _shape(value: Any) -> Any:
    """What mostly decides whether a value is of a kind: its type and the types in a row."""
    type_ = type(value)
    if type_ is tuple or type_ is list:
        return type_, len(value), frozenset(map(type, value))
    if type_.__name__ == "ndarray":
        return type_, value.dtype, value.ndim, bool(value.size)
    return type_


def _is_decided(shape: Any, kind: Any) -> bool:
    """Whether all objects of a shape are of a kind if one of them is."""
    if _depends_on_value(kind):
        return False
    if not isinstance(shape, tuple):
        return _has_no_parts(shape)
    if shape[0] is tuple or shape[0] is list:
        # places of different kinds may hold the same types in another order
        alike = get_origin(kind) is not tuple or ... in get_args(kind) or len(shape[2]) < 2
        return alike and all(map(_has_no_parts, shape[2]))
    return bool(shape[1].kind != "O")


def _has_no_parts(type_: type) -> bool:
    """Whether objects of a type have no parts, or elements, that may be of another kind."""
    if issubclass(type_, type):
        return False
    has_parts = hasattr(type_, "__iter__") or hasattr(type_, "__array__")
    return not has_parts or issubclass(type_, str | Mapping)


def _depends_on_value(kind: Any) -> bool:
    """Whether a kind names values, or members that objects of one type may have or lack."""
    return (
        get_origin(kind) is Literal
        or getattr(kind, "_is_protocol", False)
        or any(map(_depends_on_value, get_args(kind)))
    )


class _Names(dict[str, Any]):
    """The names of a module, those that it imports for type checkers alone included."""

    def __init__(self, module: str) -> None:
        self.module = sys.modules[module]
        super().__init__(vars(self.module))

    def __missing__(self, name: str) -> Any:
        home, attribute = _imports(self.module)[name]
        self[name] = getattr(import_module(home, self.module.__package__), attribute)
        return self[name]

    def kind(self, annotation: Any) -> Any:
        """An annotation's value; `Any` where the sources that it needs are not at hand."""
        if not isinstance(annotation, str):
            return annotation
        try:
            return eval(annotation, {}, self)
        except (NameError, OSError):
            return Any


@functools.cache
def _imports(module: Any) -> dict[str, tuple[str, str]]:
    """Modules and names that a module's source imports, by the names that they have there."""
    homes: dict[str, tuple[str, str]] = {}
    for node in ast.walk(parse(inspect.getsource(module))):
        if isinstance(node, ast.ImportFrom):
            home = "." * node.level + (node.module or "")
            for each in node.names:
                homes.setdefault(each.asname or each.name, (home, each.name))
    return homes


def _misfit(place: str, value: Any, kind: Any) -> tuple[str, Any, Any] | None:
    """The place within a value that is of another kind, what is there, and the kind."""
    if type(value) is kind and not _is_array(kind):
        return None
    origin = get_origin(kind) or kind
    wrong = place, value, kind
    if _is_array(origin):
        return None if _is_numeric(value) else wrong
    if origin in (Union, UnionType):
        misfits = [_misfit(place, value, each) for each in _alternatives(kind)]
        if None in misfits:
            return None
        deepest = max(misfits, key=lambda each: len(each[0]) if each else 0)
        return deepest if deepest and deepest[0] != place else wrong
    if origin is Annotated:
        # the annotation describes the kind as a whole, and not the parts of a value
        inside = _misfit(place, value, get_args(kind)[0])
        return wrong if inside and inside[0] == place else inside
    if origin in _LISTS:
        return wrong if not _is_list(value) else _misfit_inside(place, value, kind)
    return None if _is_a(value, kind, origin) else wrong


def _alternatives(union: Any) -> list[Any]:
    """The members of a union; what NumPy takes for an array is one of them."""
    members = get_args(union)
    if not any(getattr(each, "__module__", "").startswith("numpy.") for each in members):
        return [*members]
    from numpy import ndarray
    from numpy.typing import ArrayLike

    return [ndarray, *(each for each in members if each not in get_args(ArrayLike))]


def _is_array(origin: Any) -> bool:
    return getattr(origin, "__name__", "") == "ndarray"


def _misfit_inside(place: str, values: Any, kind: Any) -> tuple[str, Any, Any] | None:
    """The first element of a list that is of another kind, or an array of such elements."""
    inner = [each for each in get_args(kind) if each is not ...]
    if inner and type(values).__name__ == "ndarray" and values.size:
        return _misfit(place, values[0], inner[0]) and (place, values, kind)
    if not isinstance(values, list | tuple) or not inner:
        return None
    if get_origin(kind) is tuple and ... not in get_args(kind):
        if len(inner) != len(values):
            return place, values, kind
    else:
        inner = inner[:1] * len(values)
    misfits = (_misfit(f"{place}[{k}]", *each) for k, each in enumerate(zip(values, inner)))  # noqa: B905
    return next((each for each in misfits if each is not None), None)


def _is_a(value: Any, kind: Any, origin: Any) -> bool:
    """Whether a value is of a kind without parts."""
    if origin is Literal:
        return isinstance(value, tuple({type(each) for each in get_args(kind)}))
    if origin is Any or not isinstance(origin, type):
        return True
    if isinstance(value, type):
        return issubclass(origin, type)
    if origin is float:
        single = getattr(value, "ndim", 0) == 0
        return hasattr(value, "__float__") and single and not _is_bool(value)
    if origin is int:
        return hasattr(value, "__index__") and not _is_bool(value)
    if origin is bool:
        return _is_bool(value)
    if getattr(origin, "_is_protocol", False):
        return all(hasattr(value, name) for name in _members(origin))
    return isinstance(value, Mapping if origin is dict else origin)


def _is_bool(value: Any) -> bool:
    """Whether a value is Python's or NumPy's True or False."""
    return type(value).__name__ in ("bool", "bool_")


def _members(protocol: type) -> list[str]:
    """The names that a protocol cannot do without."""
    names = [name for name in vars(protocol) if name == "__call__" or not name.startswith("_")]
    return [name for name in names if name not in _NOT_NEEDED.get(protocol.__name__, ())]


def _is_list(value: Any) -> bool:
    """Whether a value is a row of things: neither text nor a mapping."""
    return hasattr(value, "__iter__") and not isinstance(value, str | bytes | Mapping | type)


def _is_numeric(value: Any) -> bool:
    if value is None or isinstance(value, str | bytes | type | Mapping):
        return False
    import numpy as np

    try:
        return np.asarray(value).dtype.kind in "buifc"
    except (TypeError, ValueError):
        return False


def _description(kind: Any) -> str:
    """A kind in words, led by its article."""
    origin = get_origin(kind) or kind
    if origin in (Union, UnionType):
        parts = dict.fromkeys(_description(each) for each in _alternatives(kind))
        of_them = {f"a list, each {each}": "a list of them" for each in parts}
        return " or ".join(of_them.get(each, each) for each in parts)
    if origin is Annotated:
        return str(get_args(kind)[1])
    if origin is Literal:
        return " or ".join(repr(each) for each in get_args(kind))
    if origin in _LISTS:
        inner = [each for each in get_args(kind) if each is not ...]
        return f"a list, each {_description(inner[0])}" if inner else "a list"
    if _is_array(origin):
        return "an array of numbers"
    if origin in _WORDS:
        return _WORDS[origin]
    if isinstance(origin, type) and issubclass(origin, os.PathLike):
        return "a path"
    name = getattr(origin, "__name__", str(origin))
    return _HINTS.get(name, _with_article(name))


def _with_article(name: str) -> str:
    return f"{'an' if name[0] in 'AEIOUaeiou' else 'a'} {name}"
