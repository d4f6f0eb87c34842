"""Errors and warnings for users."""

from __future__ import annotations

from pathlib import Path
from traceback import walk_tb

from ground_motions.errors import InputError as InputError
from ground_motions.errors import check_name as check_name
from ground_motions.errors import did_you_mean as did_you_mean
from ground_motions.errors import near_name as near_name
from ground_motions.errors import several as several
from ground_motions.errors import unknown_name as unknown_name
from ground_motions.errors import warn as warn
from ground_motions.errors import wrong_choice as wrong_choice


class Diverged(RuntimeError):
    """A simulation left the range of floating-point numbers or of the law; with time and cause."""


class ControllerError(Diverged):
    """A controller raised an error, which ends its run alone; with the time and the place."""


class RefusedCurrent(InputError):
    """A controller's command is no current within the limits, which ends its run alone."""


class TestedRangeWarning(UserWarning):
    """A response exceeds the deformations or currents of the device tests."""

    __test__ = False


class PlausibilityWarning(UserWarning):
    """Implausible structures, isolators, ground motions or ends of runs, as by a wrong unit."""


class ControllerWarning(UserWarning):
    """A controller under conditions for which it was not made."""


class AccuracyWarning(UserWarning):
    """Some steps of a run missed the tolerance; with the accuracy that all steps meet."""


def not_installed(what: str, library: str, extra: str) -> InputError:
    """Error of what needs a library of an extra."""
    return InputError(
        f"{what} needs {library}, which is not installed; expected: "
        f"pip install 'isolation-sim[{extra}]'"
    )


def line_within(module: str, error: Exception) -> str:
    """The last line of a module by which an error came, as `` (file.py:12)``."""
    lines = [
        f" ({Path(frame.f_code.co_filename).name}:{line})"
        for frame, line in walk_tb(error.__traceback__)
        if frame.f_globals.get("__name__") == module
    ]
    return (lines or [""])[-1]
