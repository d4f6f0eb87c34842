"""The error for input that cannot be used, in every package."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def _one_line(text: object) -> str:
    return " ".join(str(text).splitlines())


class InputError(ValueError):
    """Input that cannot be used; one line with the place, what was given, what is accepted."""


class GroundMotionError(InputError):
    """Bad input to `ground_motions`, told in one line.

    Parameters
    ----------
    place : str
        Which file, line, column or argument is at fault.
    given : str
        What was found there.
    accepted : str
        What would have been accepted.
    """

    def __init__(self, place: str, given: str, accepted: str) -> None:
        super().__init__(_one_line(place), _one_line(given), _one_line(accepted))

    @property
    def place(self) -> str:
        """Which file, line, column or argument is at fault."""
        return str(self.args[0])

    @property
    def given(self) -> str:
        """What was found there."""
        return str(self.args[1])

    @property
    def accepted(self) -> str:
        """What would have been accepted."""
        return str(self.args[2])

    def __str__(self) -> str:
        return f"{self.place}: given {self.given}; accepted: {self.accepted}"


def nearest(name: str, valid: Iterable[str]) -> str:
    """Return the accepted names as text, led by the one nearest to a misspelt name.

    Parameters
    ----------
    name : str
        The name that was given.
    valid : iterable of str
        The names that are accepted.

    Returns
    -------
    str
        For example ``"soft (did you mean it?), firm, medium"``.
    """
    names = list(valid)
    close = difflib.get_close_matches(name.lower(), [n.lower() for n in names], n=1, cutoff=0.5)
    if not close:
        return ", ".join(names)
    best = next(n for n in names if n.lower() == close[0])
    return ", ".join([f"{best} (did you mean it?)", *(n for n in names if n != best)])


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
