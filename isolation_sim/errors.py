"""Errors that a user can act on."""

from __future__ import annotations

from ground_motions.errors import InputError as InputError
from ground_motions.errors import unknown_name as unknown_name
from ground_motions.errors import warn as warn


class Diverged(RuntimeError):
    """A simulation that left the range of numbers or of the law, with the time and the cause."""


class TestedRangeWarning(UserWarning):
    """A response leaves the deformations or currents at which the devices were tested."""

    __test__ = False


class PlausibilityWarning(UserWarning):
    """Masses, stiffnesses or scales whose periods no building has, such as in the wrong unit."""


class AccuracyWarning(UserWarning):
    """A run ended without reaching its tolerance everywhere, with the accuracy that it reached."""
