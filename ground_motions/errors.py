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
    hint : str
        Text of `did_you_mean`.

    Attributes
    ----------
    place, given, expected : str
        The parts; the last two are empty for a message given as a whole.
    """

    def __init__(self, place: str, given: str = "", expected: str = "", hint: str = "") -> None:
        self.place, self.given, self.expected = map(_one_line, (place, given, expected))
        super().__init__(
            f"{self.place}: given {self.given};{hint} expected: {self.expected}"
            if self.expected
            else self.place
        )


_LISTED = 8  # errors in a message


def several(what: str, errors: Sequence[Exception], hint: str = "") -> Exception:
    """Return one error that lists the first of several; a single one without a hint itself."""
    if len(errors) == 1 and not hint:
        return errors[0]
    more = f"; and {len(errors) - _LISTED} more" if len(errors) > _LISTED else ""
    texts = "; ".join(_together(errors[:_LISTED]))
    return InputError(f"{what}: {texts}{more}{hint}")


def _together(errors: Iterable[Exception]) -> list[str]:
    """Texts of errors; those that differ in the place alone are one."""
    places: dict[str, list[str]] = {}
    for error in errors:
        text, place = str(error), getattr(error, "place", "")
        about = text.removeprefix(place) if place and text != place else ""
        places.setdefault(about or text, []).append(place if about else "")
    return [f"{', '.join(names)}{about}" for about, names in places.items()]


_PACKAGES = ("ground_motions", "isolation_sim", "controllers", "studies")


def warn(text: str, kind: type[Warning]) -> None:
    """Warn at the line of the user's code that called into these packages."""
    frame, level = sys._getframe(1), 2
    while frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] in _PACKAGES:
        frame, level = frame.f_back, level + 1
    warnings.warn(text, kind, stacklevel=level)


def _one_line(text: object) -> str:
    return " ".join(str(text).splitlines())


def near_name(name: str, accepted: Iterable[str], *, surely: bool = False) -> str:
    """Return the accepted name that a misspelt one means, "" if none is near.

    It has the same words in another order or case, or a similar spelling. Where further names
    are allowed, only one that is ``surely`` misspelt may be refused.
    """
    by_spelling = {one.casefold(): one for one in accepted}
    spelling = name.casefold()
    words = sorted(spelling.split("_"))
    near = [one for one in by_spelling if sorted(one.split("_")) == words]
    cutoff = 0.75 if surely else 0.6
    near = near or difflib.get_close_matches(spelling, by_spelling, n=1, cutoff=cutoff)
    return by_spelling[near[0]] if near else ""


def did_you_mean(name: str, accepted: Iterable[str]) -> str:
    """Ask for the accepted name near to a misspelt one, behind a blank; "" if none is near."""
    near = near_name(name, accepted)
    return f" did you mean {near!r}?" if near else ""


def wrong_choice(place: str, name: str, accepted: Iterable[str]) -> InputError:
    """Build the error for a value that is none of the accepted names."""
    names = list(accepted)
    return InputError(place, repr(name), ", ".join(names), did_you_mean(name, names))


def unknown_name(kind: str, name: str, accepted: Iterable[str]) -> InputError:
    """Build the error for a name that is not in a registry."""
    names = sorted(accepted)
    hint = did_you_mean(name, names)
    return InputError(f"unknown {kind} {name!r};{hint} expected: {', '.join(names)}")


def check_name(kind: str, name: str, accepted: Collection[str]) -> None:
    """Refuse a name that is not among the accepted ones."""
    if name not in accepted:
        raise unknown_name(kind, name, accepted)
