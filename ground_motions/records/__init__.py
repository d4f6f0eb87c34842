"""Records that ship with the package."""

from __future__ import annotations

from collections.abc import Callable

from ground_motions.argument_types import checked
from ground_motions.checks import choice
from ground_motions.record import Record
from ground_motions.records.el_centro import el_centro_1940

RECORDS: dict[str, Callable[[], Record]] = {
    "el_centro_1940_ns": el_centro_1940,
}
"""Loader of each record by name; add a line to add a record."""


def available_records() -> tuple[str, ...]:
    """Return the names of the records that ship with the package.

    Returns
    -------
    tuple of str
        Names, for `load_record`.
    """
    return tuple(RECORDS)


@checked
def load_record(name: str) -> Record:
    """Return a record that ships with the package.

    Parameters
    ----------
    name : str
        One of `available_records`.

    Returns
    -------
    Record
        The motion, m/s2.

    Raises
    ------
    InputError
        If there is no such record; the message names the nearest.
    """
    return RECORDS[choice("record name", name, RECORDS)]()


__all__ = ["RECORDS", "available_records", "el_centro_1940", "load_record"]
