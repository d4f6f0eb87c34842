"""Warnings about many runs, counted by kind."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..errors import ControllerWarning, PlausibilityWarning, TestedRangeWarning
from .plausibility import DISPLACED
from .tested_range import OVER_TESTED, beyond_tests


class Validity(NamedTuple):
    """Quantities and warnings on the validity of one run, in ``Batch`` and in a sweep's table."""

    clamped: int = 0  # Commands that were clamped
    # deformation_over_tested, current_over_tested: Peaks over those of the tests of the laws; 0
    # without tests
    deformation_over_tested: float = math.nan
    current_over_tested: float = math.nan
    unresolved: int = 0  # Steps that missed the tolerance
    # moving_at_end, displacement_at_end: Whether the building still moves at the end, and the
    # displacement at which the base stays, over its peak
    moving_at_end: bool = False
    displacement_at_end: float = math.nan
    # implausible, cautions: Warnings about the inputs and of the controller
    implausible: str = ""
    cautions: str = ""
    contacts: int = 0  # With moat walls and end stops


OF_RUNS = Validity._fields[3:]
"""Those beside clamped commands and the tested range."""

BETWEEN = " | "
"""Separates the warnings of one run in a text."""

_NUMBER = re.compile(r"-?\d[\d.]*(?:e[+-]?\d+)?")


def _plausibility(runs: Mapping[str, Any]) -> list[str]:
    """Warnings about structures, motions and ends of runs, from quantities by run."""
    moving = np.asarray(runs["moving_at_end"], bool)
    aside = np.nan_to_num(np.asarray(runs["displacement_at_end"], float))
    lines = _listed(runs["implausible"])
    # a table of an earlier release has no such column
    contacts = np.asarray(runs.get("contacts", 0)) > 0
    if contacts.any():
        lines.append(
            f"{_of(contacts)} touch a moat wall or an end stop, so that their peaks depend on its "
            "stiffness"
        )
    if moving.any():
        lines.append(
            f"{_of(moving)} still move at the end, so that RMS values and energies depend on the "
            "length of the motion; add quiet time, padded(after=) or quiet_after_s"
        )
    if (aside > DISPLACED).any():
        lines.append(
            f"{_of(aside > DISPLACED)} end with a displaced base, which does not return, by up to "
            f"{100 * aside.max():.0f} % of its peak"
        )
    return lines


def warnings_of_many(runs: Mapping[str, Any]) -> Iterator[tuple[str, type[Warning]]]:
    """Warnings about many runs, from quantities by run, each line with its category."""
    # a table of an earlier release lacks some quantities
    if set(OVER_TESTED) <= set(runs):
        for line in beyond_tests(*(runs[name] for name in OVER_TESTED)):
            yield line, TestedRangeWarning
    if _of_runs_known(runs):
        yield from ((line, PlausibilityWarning) for line in _plausibility(runs))
        yield from ((line, ControllerWarning) for line in _listed(runs["cautions"]))


def of_many(runs: Mapping[str, Any]) -> list[str]:
    """The same lines, and those of missed tolerances and of clamped commands."""
    lines = [line for line, _ in warnings_of_many(runs)]
    unresolved = np.asarray(runs["unresolved"] if _of_runs_known(runs) else 0) > 0
    if unresolved.any():
        lines.append(f"{_of(unresolved)} missed the tolerance in some integration steps")
    clamped = np.asarray(runs["clamped"]) > 0
    if clamped.any():
        lines.append(f"{_of(clamped)} have commands that were clamped to the supply's limits")
    return lines


def _of_runs_known(runs: Mapping[str, Any]) -> bool:
    return {*OF_RUNS} - {"contacts"} <= set(runs)


def _of(which: Sequence[Any] | np.ndarray) -> str:
    return f"{np.count_nonzero(which)} of {len(which)} runs"


def _listed(texts: Sequence[str]) -> list[str]:
    """Count warnings that differ only in numbers, each with its first text."""
    first: dict[str, str] = {}
    counts: dict[str, set[int]] = {}
    different: dict[str, set[str]] = {}
    for k, text in enumerate(texts):
        for line in filter(None, str(text).split(BETWEEN)):
            kind = _NUMBER.sub("#", line)
            first.setdefault(kind, line)
            counts.setdefault(kind, set()).add(k)
            different.setdefault(kind, set()).add(line)
    return [
        f"{len(counts[kind])} of {len(texts)} runs"
        f"{', such as' * (len(different[kind]) > 1)}: {line}"
        for kind, line in first.items()
    ]
