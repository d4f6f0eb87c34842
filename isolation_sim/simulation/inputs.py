"""Conversion of a run's plant and ground motions."""

from __future__ import annotations

from collections.abc import Sequence

from ground_motions import Record

from ..laws.trace_check import check_traceable
from ..structures import IsolatedStructure


def traceable(isolated: IsolatedStructure) -> IsolatedStructure:
    """Return the structure; raises `InputError` for laws that cannot be traced."""
    for law in isolated.group_laws:
        check_traceable(law)
    return isolated


def one_per_direction(ground: Record | Sequence[Record]) -> tuple[Record, ...]:
    """Return the records of all directions."""
    return (ground,) if isinstance(ground, Record) else tuple(ground)
