"""The error for input that cannot be used, in every package."""

from __future__ import annotations

import difflib
import sys
import warnings
from collections.abc import Collection, Iterable, Sequence


class InputError(ValueError):
    """Unusable input, in one line: the place, the value, the expected values.

    Parameters
    ----------
    place : str
        File, line, column or argument at fault; without ``expected`` the whole message.
    given : str
        The value there.
    expected : str
        The expected values.

    Attributes
    ----------
    place, given, expected : str
        The parts; the last two are empty for a message given as a whole.
    """

    def __init__(self, place: str, given: str = "", expected: str = "") -> None:
        self.place, self.given, self.expected = map(_one_line, (place, given, expected))
        super().__init__(
            f"{self.place}: given {self.given}; expected: {self.expected}"
            if self.expected
            else self.place
        )


_LISTED = 8  # errors in a message


def several(what: str, errors: Sequence[Exception], hint: str = "") -> Exception:
    """Return one error that lists the first of several; a single one without a hint itself."""
    if len(errors) == 1 and not hint:
        return errors[0]
    more = f"; and {len(errors) - _LISTED} more" if len(errors) > _LISTED else ""
    return InputError(f"{what}: {'; '.join(map(str, errors[:_LISTED]))}{more}{hint}")


_PACKAGES = ("ground_motions", "isolation_sim", "controllers", "studies")


def warn(text: str, kind: type[Warning]) -> None:
    """Warn at the line of the user's code that called into these packages."""
    frame, level = sys._getframe(1), 2
    while frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] in _PACKAGES:
        frame, level = frame.f_back, level + 1
    warnings.warn(text, kind, stacklevel=level)


def _one_line(text: object) -> str:
    return " ".join(str(text).splitlines())


def nearest(name: str, valid: Iterable[str]) -> str:
    """Return the accepted names as text, led by the one nearest to a misspelt name."""
    names = list(valid)
    close = difflib.get_close_matches(name.lower(), [n.lower() for n in names], n=1, cutoff=0.5)
    if not close:
        return ", ".join(names)
    best = next(n for n in names if n.lower() == close[0])
    return ", ".join([f"{best} (did you mean it?)", *(n for n in names if n != best)])


def unknown_name(kind: str, name: str, accepted: Iterable[str]) -> InputError:
    """Build the error for a name that is not in a registry."""
    names = sorted(accepted)
    hint = did_you_mean(name, names)
    return InputError(f"unknown {kind} {name!r};{hint} expected: {', '.join(names)}")


def did_you_mean(name: str, accepted: Iterable[str]) -> str:
    """Ask for the name nearest to a misspelt one, behind a blank; empty if none is near."""
    close = difflib.get_close_matches(name, [*accepted], n=1)
    return f" did you mean {close[0]!r}?" if close else ""


def check_name(kind: str, name: str, accepted: Collection[str]) -> None:
    """Refuse a name that is not among the accepted ones."""
    if name not in accepted:
        raise unknown_name(kind, name, accepted)
