"""A number of a paper beside the recomputed one; every verdict follows from the row's own numbers.

A row is one of the classes below. None of them takes a verdict, except `Reading`, which tells what
only the paper's text can show and quotes it. A row's remark says how its number was computed
(`how`), tells further computed numbers (`note`), or is a reading of the paper's text (`read`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import ClassVar, NamedTuple

from isolation_sim.reports.tables import TextTable


class Verdict(StrEnum):
    """What can be said of a printed number."""

    REPRODUCED = "reproduced"
    WITHIN = "reproduced within"
    NOT_REPRODUCED = "not reproduced"
    MISPRINT = "misprint"
    CORRUPT = "corrupt data"
    SOUND = "sound data"
    WRONG = "wrong as printed"
    AMBIGUOUS = "ambiguous"
    NOT_PRINTED = "follows, not printed"
    NOT_CHECKABLE = "not checkable"


class Basis(StrEnum):
    """Where a row's verdict, or a remark, comes from."""

    METHOD = "method"
    COMPUTED = "computed"
    READING = "reading"


class Remark(NamedTuple):
    """A remark on a row; made by `how`, `note` or `read`."""

    text: str
    basis: Basis
    values: tuple[object, ...] = ()

    def __str__(self) -> str:
        return f"reading: {self.text}" if self.basis is Basis.READING else self.text


def how(method: str) -> Remark:
    """Say how the computed number was obtained."""
    return Remark(method, Basis.METHOD)


def note(template: str, *values: object) -> Remark:
    """Tell further computed numbers, which fill the template's braces."""
    if not values:
        raise ValueError(f"a computed remark needs computed values: {template!r}")
    return Remark(template.format(*values), Basis.COMPUTED, values)


def read(text: str) -> Remark:
    """Tell what the paper's text says, or what it lacks."""
    return Remark(text, Basis.READING)


NO_REMARK = Remark("", Basis.METHOD)

_LEVELS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 11.0)


def agree(published: str, computed: float, within: float = 0.0) -> bool:
    """Whether a number agrees with a printed one."""
    mantissa, _, exponent = published.lower().partition("e")
    decimals = len(mantissa.partition(".")[2]) - int(exponent or 0)
    off = abs(computed - float(published))
    return off <= max(0.5 * 10.0**-decimals * (1 + 1e-9), within / 100 * abs(float(published)))


@dataclass(frozen=True)
class Check(ABC):
    """A row of a paper's table."""

    what: str  # The number or statement
    where: str  # Table, equation or section
    computed: float | None  # By the library, in ``unit``; None for readings only
    unit: str = ""  # Of both
    remark: Remark = NO_REMARK  # One line on it
    published: str = field(default="", kw_only=True)  # As printed; empty where it is not

    basis: ClassVar[Basis] = Basis.COMPUTED

    def __post_init__(self) -> None:
        if self.computed is not None:
            object.__setattr__(self, "computed", float(self.computed))

    @property
    @abstractmethod
    def verdict(self) -> Verdict:
        """What follows from the row's numbers."""

    @property
    def difference(self) -> float | None:
        """Computed over published number less one, in percent; None where one is missing or 0."""
        if not self.published or self.computed is None or float(self.published) == 0:
            return None
        return 100 * (self.computed / float(self.published) - 1)

    @property
    def judgement(self) -> str:
        """The verdict as it is printed, with its tolerance, or marked as a reading."""
        if self.basis is Basis.READING:
            return f"{self.verdict.value} (reading)"
        if self.verdict is not Verdict.WITHIN or self.difference is None:
            return self.verdict.value
        level = next(level for level in _LEVELS if abs(self.difference) <= level)
        return f"{self.verdict.value} {level:g} %"

    def record(self) -> dict[str, str | float]:
        """Return the row as it is written to CSV, blank where there is no number."""
        return {
            "what": self.what,
            "where": self.where,
            "published": self.published,
            "computed": "" if self.computed is None else self.computed,
            "unit": self.unit,
            "difference_percent": "" if self.difference is None else self.difference,
            "verdict": self.judgement,
            "basis": self.basis.value,
            "remark": self.remark.text,
            "remark_basis": self.remark.basis.value if self.remark.text else "",
        }


@dataclass(frozen=True)
class PrintedNumber(Check):
    """A printed number beside the computed one."""

    # Largest difference that still counts as reproduced, beyond the rounding, percent
    within: float = 0.1
    # Number meant in place of the printed one. The printed one is a misprint if it disagrees and
    # this one agrees within ``meant_within``.
    meant: str = ""
    meant_within: float = 0.1  # Largest difference from the number meant, percent
    # Row that judges the table's entry from which the printed number comes. If that entry is
    # corrupt, so is the printed number, whatever it agrees with.
    source: Outlier | None = None

    @property
    def verdict(self) -> Verdict:
        """Corrupt by its source; else by the difference, and by the number meant."""
        assert self.computed is not None
        if self.source is not None and self.source.verdict is Verdict.CORRUPT:
            return Verdict.CORRUPT
        if agree(self.published, self.computed):
            return Verdict.REPRODUCED
        if agree(self.published, self.computed, self.within):
            return Verdict.WITHIN
        if self.meant and agree(self.meant, self.computed, self.meant_within):
            return Verdict.MISPRINT
        return Verdict.NOT_REPRODUCED


@dataclass(frozen=True)
class Claim(Check):
    """A statement of the text, which holds if a computed number is between two bounds."""

    # above, below: Bounds, neither of them included
    above: float = -float("inf")
    below: float = float("inf")

    @property
    def verdict(self) -> Verdict:
        """Reproduced if the number is between the bounds, else wrong."""
        assert self.computed is not None
        return Verdict.REPRODUCED if self.above < self.computed < self.below else Verdict.WRONG


@dataclass(frozen=True)
class Consequence(Check):
    """A number that the paper's equations and tables determine and that it does not print."""

    @property
    def verdict(self) -> Verdict:
        """Not printed."""
        return Verdict.NOT_PRINTED


@dataclass(frozen=True)
class Outlier(Check):
    """A measure of how far a table's entry is from its neighbours."""

    # lowest, highest: Range of the measure in sound data
    lowest: float = -float("inf")
    highest: float = float("inf")

    @property
    def verdict(self) -> Verdict:
        """Corrupt if the measure is outside its range."""
        assert self.computed is not None
        return Verdict.SOUND if self.lowest <= self.computed <= self.highest else Verdict.CORRUPT


@dataclass(frozen=True)
class Equation(Check):
    """Difference between an equation as printed and as it follows from the paper's others."""

    # Largest difference that floating-point arithmetic explains, in ``unit``
    rounding: float = 1e-6

    @property
    def verdict(self) -> Verdict:
        """Misprint if they differ."""
        assert self.computed is not None
        same = abs(self.computed) <= self.rounding
        return Verdict.REPRODUCED if same else Verdict.MISPRINT


@dataclass(frozen=True)
class Alternative(Check):
    """A number under one of several readings of the paper."""

    others: Sequence[float] = ()  # The number under the other readings, in ``unit``

    @property
    def verdict(self) -> Verdict:
        """Ambiguous if another reading gives another number (by 0.1 %)."""
        assert self.computed is not None
        largest = max((abs(other - self.computed) for other in self.others), default=0.0)
        same = largest <= 1e-3 * abs(self.computed)
        return Verdict.NOT_PRINTED if same else Verdict.AMBIGUOUS


@dataclass(frozen=True)
class Reading(Check):
    """What only the paper's text shows: the one row whose verdict is given, marked as a reading."""

    # What the text shows; never that a number was reproduced
    reading: Verdict = Verdict.NOT_CHECKABLE
    quote: str = ""  # The text

    basis: ClassVar[Basis] = Basis.READING

    @property
    def verdict(self) -> Verdict:
        """As read."""
        return self.reading


def compare(
    what: str,
    where: str,
    published: str,
    computed: float,
    unit: str = "",
    remark: Remark = NO_REMARK,
    within: float = 0.1,
    *,
    meant: str = "",
    meant_within: float = 0.1,
    source: Outlier | None = None,
) -> PrintedNumber:
    """Compare a printed number with the computed one; arguments as of `PrintedNumber`."""
    return PrintedNumber(
        what, where, computed, unit, remark, within, meant, meant_within, source,
        published=published,
    )  # fmt: skip


def alternatives(
    where: str, values: dict[str, float], unit: str = "", remark: Remark = NO_REMARK
) -> list[Alternative]:
    """Tell a number under every reading of the paper, a row each."""
    return [
        Alternative(
            what, where, value, unit, remark,
            tuple(other for key, other in values.items() if key != what),
        )
        for what, value in values.items()
    ]  # fmt: skip


def reading(
    what: str, where: str, evaluated: Verdict, text: str, quote: str, published: str = ""
) -> Reading:
    """Tell what only the paper's text shows, with the words that show it."""
    return Reading(
        what, where, None, "", read(text), evaluated, quote, published=published
    )  # fmt: skip


COLUMNS = ("what", "where", "published", "computed", "unit", "diff %", "verdict", "remark")
"""Headings of the table of checks."""


def layout(title: str, checks: Sequence[Check]) -> TextTable:
    """Lay out a paper's checks."""
    return TextTable(title, COLUMNS, [*map(texts, checks)], keys=2, caption=tally(checks))


def texts(check: Check) -> tuple[str, ...]:
    """Print a check."""
    read_only = check.basis is Basis.READING
    return (
        check.what,
        check.where,
        check.published,
        "" if check.computed is None else f"{check.computed:.5g}",
        check.unit,
        "" if check.difference is None else f"{check.difference:+.2f}",
        check.judgement,
        check.remark.text if read_only else str(check.remark),
    )


def tally(checks: Iterable[Check]) -> str:
    """Count verdicts."""
    counts = Counter(check.verdict for check in checks)
    return "; ".join(f"{verdict.value} {counts[verdict]}" for verdict in Verdict if counts[verdict])
