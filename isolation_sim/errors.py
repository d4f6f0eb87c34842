"""Errors that a user can act on."""

from __future__ import annotations

from ground_motions.errors import InputError as InputError
from ground_motions.errors import unknown_name as unknown_name


class Diverged(RuntimeError):
    """A simulation that left the range of numbers or of the law, with the time and the cause."""
