"""Errors that a user can act on."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from ground_motions.errors import InputError

__all__ = ["Diverged", "InputError", "unknown_name"]


class Diverged(RuntimeError):
    """A simulation that left the range of numbers or of the law, with the time and the cause."""


def unknown_name(kind: str, given: str, accepted: Iterable[str]) -> InputError:
    """Build the error for a name that is not in a registry.

    Parameters
    ----------
    kind : str
        What the name should be, such as ``"law"``.
    given : str
        What was given.
    accepted : iterable of str
        The valid names.

    Returns
    -------
    InputError
        Naming the nearest valid name and all accepted ones.
    """
    names = sorted(accepted)
    close = difflib.get_close_matches(given, names, n=1)
    hint = f" did you mean {close[0]!r}?" if close else ""
    return InputError(f"unknown {kind} {given!r};{hint} accepted: {', '.join(names)}")
