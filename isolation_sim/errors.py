"""Errors and warnings for users."""

from __future__ import annotations

from ground_motions.errors import InputError as InputError
from ground_motions.errors import unknown_name as unknown_name
from ground_motions.errors import warn as warn


class Diverged(RuntimeError):
    """A simulation left the range of floating-point numbers or of the law; with time and cause."""


class TestedRangeWarning(UserWarning):
    """A response exceeds the deformations or currents of the device tests."""

    __test__ = False


class PlausibilityWarning(UserWarning):
    """Masses, stiffnesses or scales with implausible periods, such as values in a wrong unit."""


class AccuracyWarning(UserWarning):
    """Some steps of a run missed the tolerance; with the accuracy that all steps meet."""
