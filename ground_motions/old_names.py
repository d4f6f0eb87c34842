"""Old names of arguments, keys and settings, accepted for one release with a warning."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar

from .errors import InputError, warn

F = TypeVar("F", bound=Callable[..., Any])


def renamed_value(what: str, value: Any, **new_names: str) -> Any:
    """The value, with the new name in place of an old one."""
    if isinstance(value, str) and value in new_names:
        note_old_name(f"{what} = {value!r}", f"{new_names[value]!r}")
        return new_names[value]
    return value


def renamed_keys(data: Any, **new_names: str) -> Any:
    """A table with new names in place of old keys."""
    if not isinstance(data, dict):
        return data
    for old in new_names.keys() & data.keys():
        if new_names[old] in data:
            raise InputError(f"{old} is the old name of {new_names[old]}; expected: one of them")
        note_old_name(old, new_names[old])
    return {new_names.get(key, key): value for key, value in data.items()}


def renamed_arguments(**new_names: str) -> Callable[[F], F]:
    """Decorate a function or a class to accept keyword arguments by their old names, too."""

    def decorate(function: F) -> F:
        if isinstance(function, type):
            function.__init__ = decorate(function.__init__)  # type: ignore[misc]
            return function

        @functools.wraps(function)
        def with_old_names(*args: Any, **kwargs: Any) -> Any:
            if new_names.keys() & kwargs.keys():
                kwargs = renamed_keys(kwargs, **new_names)
            return function(*args, **kwargs)

        return with_old_names  # type: ignore[return-value]

    return decorate


def renamed_attribute(old: str, new: str) -> Any:
    """Property that returns an attribute by its old name, too."""

    def value(instance: Any) -> Any:
        note_old_name(old, new)
        return getattr(instance, new)

    return property(value, doc=f"Old name of ``{new}``.")


def note_old_name(old: str, new: str) -> None:
    """Warn of an old name."""
    text = f"{old} is now called {new}; the old name is accepted until version 0.3"
    warn(text, FutureWarning)
