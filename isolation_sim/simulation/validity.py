"""Warnings about the validity of results, with the names of a few runs or the number of many."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import ControllerWarning, PlausibilityWarning, TestedRangeWarning
from ..written_names import as_written
from .plausibility import DISPLACED
from .tested_range import TestComparison

BETWEEN = " | "
"""Separates the warnings of one run in a text."""

_AT_END = (
    "at the end, so that RMS values and energies depend on the length of the motion; add quiet "
    "time, padded(after=) or quiet_after_s"
)
_NUMBER = re.compile(r"-?\d[\d.]*(?:e[+-]?\d+)?")
_MOTION = re.compile(r"(?<=^ground motion ).+(?= (?:peaks at|has a step of) )")


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


def validity_of(run: Any) -> Validity:
    """Quantities and warnings on the validity of a ``Run``."""
    peaks, (moving, displacement) = run.test_comparison, run.end
    return Validity(
        run.clamped,
        peaks.deformation_ratio,
        peaks.current_ratio,
        run.unresolved,
        moving,
        displacement,
        BETWEEN.join(run.implausible),
        BETWEEN.join(_cautions({run.controller: run})),
        sum(run.contacts.values()),
    )


# a few runs (``Run``) of one plant, by the name to print


def warnings_of(runs: Mapping[str, Any]) -> Iterator[tuple[str, type[Warning]]]:
    """Warnings about the validity of several runs, each line with its category."""
    for lines, kind in (
        (next(iter(runs.values())).implausible, PlausibilityWarning),
        (_beyond_tests(runs), TestedRangeWarning),
        (_ends(runs), PlausibilityWarning),
        (_contacts(runs), PlausibilityWarning),
        (_cautions(runs), ControllerWarning),
    ):
        yield from ((line, kind) for line in lines)


def validity_lines(runs: Mapping[str, Any]) -> list[str]:
    """The same lines, and those of commands that were clamped."""
    return [line for line, _ in warnings_of(runs)] + [
        f"{as_written(name)}: {run.clamped} commands were clamped to the supply's limits"
        for name, run in runs.items()
        if run.clamped
    ]


def _beyond_tests(runs: Mapping[str, Any]) -> Iterator[str]:
    """Deformations of devices and currents of coils beyond the tests."""
    peaks: dict[str, TestComparison] = {name: run.test_comparison for name, run in runs.items()}
    first, isolated = next(iter(peaks.values())), next(iter(runs.values())).isolated
    alike: dict[float, list[tuple[str, int]]] = {}  # devices, by their tested deformation
    for name, (e, *_) in zip(isolated.device_names, isolated.groups, strict=True):
        if any(each.deformation[e] > each.tested_deformation[e] for each in peaks.values()):
            alike.setdefault(float(first.tested_deformation[e]), []).append((name, e))
    for tested, devices in alike.items():
        names, elements = zip(*devices, strict=True)
        others = f" (and {len(names) - 1} like it)" if len(names) > 1 else ""
        largest = {run: max(each.deformation[list(elements)]) for run, each in peaks.items()}
        beyond = [
            f"{as_written(run)} {1e3 * peak:.0f} mm"
            for run, peak in largest.items()
            if peak > tested
        ]
        yield (
            f"{names[0]}{others} deforms further than its law was tested, "
            f"{1e3 * tested:.0f} mm at this scale: {', '.join(beyond)}"
        )
    for c in range(isolated.n_channels):
        beyond = [
            f"{as_written(run)} {each.current[c]:.3g} A"
            for run, each in peaks.items()
            # a controller with this limit may exceed it by a rounding error
            if each.current[c] > each.tested_current[c] * (1 + 1e-9)
        ]
        if beyond:
            yield (
                f"coil {c} carries more current than its devices were tested with, "
                f"{first.tested_current[c]:.3g} A: {', '.join(beyond)}"
            )


def _ends(runs: Mapping[str, Any]) -> Iterator[str]:
    """Buildings that still move at the end, or are displaced."""
    moving = [as_written(name) for name, run in runs.items() if run.end[0]]
    if moving:
        yield f"the building still moves {_AT_END}: {', '.join(moving)}"
    aside = [
        f"{as_written(name)} {100 * run.end[1]:.0f} %"
        for name, run in runs.items()
        if run.end[1] > DISPLACED
    ]
    if aside:
        yield (
            "the base does not return: it ends displaced, in relation to its peak: "
            f"{', '.join(aside)}"
        )


def _contacts(runs: Mapping[str, Any]) -> Iterator[str]:
    """Contacts with moat walls and end stops."""
    listed = []
    for name, run in runs.items():
        counts = [f"{element} {count}" for element, count in run.contacts.items() if count]
        if counts:
            listed.append(f"{as_written(name)} {', '.join(counts)}")
    if listed:
        yield (
            "moat walls or end stops are touched, so that peaks depend on their stiffness; number "
            f"of contacts: {'; '.join(listed)}"
        )


def _cautions(runs: Mapping[str, Any]) -> list[str]:
    """Warnings of the controllers about their use."""
    return [f"{as_written(name)}: {each}" for name, run in runs.items() for each in run.cautions]


# many runs, from arrays of the quantities in ``Validity``, by their names


def warnings_of_many(runs: Mapping[str, Any]) -> Iterator[tuple[str, type[Warning]]]:
    """Warnings about the validity of many runs, each line with its category."""
    for line in _many_beyond_tests(runs):
        yield line, TestedRangeWarning
    if _is_complete(runs):
        yield from ((line, PlausibilityWarning) for line in _many_implausible(runs))
        yield from ((line, ControllerWarning) for line in _counted(runs["cautions"]))


def validity_lines_of_many(runs: Mapping[str, Any]) -> list[str]:
    """The same lines, and those of missed tolerances and of clamped commands."""
    lines = [line for line, _ in warnings_of_many(runs)]
    unresolved = np.asarray(runs["unresolved"] if _is_complete(runs) else 0) > 0
    if unresolved.any():
        lines.append(f"{_share(unresolved)} missed the tolerance in some integration steps")
    clamped = np.asarray(runs["clamped"]) > 0
    if clamped.any():
        lines.append(f"{_share(clamped)} have commands that were clamped to the supply's limits")
    return lines


def _is_complete(runs: Mapping[str, Any]) -> bool:
    """Whether quantities are not those of a table of an earlier release, which lacks some."""
    return {*Validity._fields[3:]} - {"contacts"} <= set(runs)


def _many_beyond_tests(runs: Mapping[str, Any]) -> Iterator[str]:
    """Deformations and currents beyond the tests."""
    sentences = {
        "deformation_over_tested": "deform an isolator or element further than its law was tested",
        "current_over_tested": "need more current than the devices were tested with",
    }
    for name, sentence in sentences.items() if set(sentences) <= set(runs) else ():
        ratios = np.asarray(runs[name], float)
        over = ratios > 1 + 1e-9
        if over.any():
            yield f"{_share(over)} {sentence}, up to {np.nanmax(ratios):.3g} times"


def _many_implausible(runs: Mapping[str, Any]) -> list[str]:
    """Implausible structures and motions, contacts, and ends of runs."""
    moving = np.asarray(runs["moving_at_end"], bool)
    aside = np.nan_to_num(np.asarray(runs["displacement_at_end"], float))
    lines = _counted(runs["implausible"])
    # a table of an earlier release has no such column
    contacts = np.asarray(runs.get("contacts", 0)) > 0
    if contacts.any():
        lines.append(
            f"{_share(contacts)} touch a moat wall or an end stop, so that their peaks depend on "
            "its stiffness"
        )
    if moving.any():
        lines.append(f"{_share(moving)} still move {_AT_END}")
    if (aside > DISPLACED).any():
        lines.append(
            f"{_share(aside > DISPLACED)} end with a displaced base, which does not return, by up "
            f"to {100 * aside.max():.0f} % of its peak"
        )
    return lines


def _share(which: NDArray) -> str:
    return f"{np.count_nonzero(which)} of {len(which)} runs"


def _counted(texts: Sequence[str]) -> list[str]:
    """Count warnings that differ only in numbers and motions, each with its first text."""
    first: dict[str, str] = {}
    counts: dict[str, set[int]] = {}
    different: dict[str, set[str]] = {}
    for k, text in enumerate(texts):
        for line in filter(None, str(text).split(BETWEEN)):
            kind = _NUMBER.sub("#", _MOTION.sub("#", line))
            first.setdefault(kind, line)
            counts.setdefault(kind, set()).add(k)
            different.setdefault(kind, set()).add(line)
    return [
        f"{len(counts[kind])} of {len(texts)} runs"
        f"{', such as' * (len(different[kind]) > 1)}: {line}"
        for kind, line in first.items()
    ]
