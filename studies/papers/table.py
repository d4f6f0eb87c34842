"""A published number beside the recomputed one, and the verdict on it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table


class Verdict(StrEnum):
    """What can be said of a printed number."""

    REPRODUCED = "reproduced"
    WITHIN = "reproduced within"
    NOT_REPRODUCED = "not reproduced"
    MISPRINT = "misprint"
    CORRUPT = "corrupt data"
    WRONG = "wrong as printed"
    AMBIGUOUS = "ambiguous"
    NOT_PRINTED = "follows, not printed"
    NOT_CHECKABLE = "not checkable"


_LEVELS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 11.0)


@dataclass(frozen=True)
class Check:
    """One number of a paper.

    Attributes
    ----------
    what : str
        What it is.
    where : str
        Table, equation or section.
    published : str
        As printed; empty where it is not.
    computed : float or None
        By the library, in ``unit``; None where that is impossible.
    unit : str
        Of both.
    verdict : Verdict
        What follows.
    reason : str
        Why, in one line.
    """

    what: str
    where: str
    published: str
    computed: float | None
    unit: str
    verdict: Verdict
    reason: str = ""

    @property
    def difference(self) -> float | None:
        """Computed over published number less one, in percent; None where one is missing or 0."""
        if not self.published or self.computed is None or float(self.published) == 0:
            return None
        return 100 * (self.computed / float(self.published) - 1)

    @property
    def judgement(self) -> str:
        """The verdict as it is printed, with the tolerance where it has one."""
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
            "reason": self.reason,
        }


def compare(
    what: str,
    where: str,
    published: str,
    computed: float,
    unit: str = "",
    reason: str = "",
    within: float = 0.1,
    otherwise: Verdict = Verdict.NOT_REPRODUCED,
) -> Check:
    """Judge a printed number by what is computed.

    Parameters
    ----------
    what, where : str
        What it is, and its table, equation or section.
    published : str
        As printed, whose last digit says how it was rounded.
    computed : float
        In the same unit.
    unit : str
        Of both.
    reason : str
        Why they differ, or what the agreement means.
    within : float, percent
        Largest difference that still counts as reproduced, beyond the rounding.
    otherwise : Verdict
        What a larger difference means.

    Returns
    -------
    Check
    """
    mantissa, _, exponent = published.lower().partition("e")
    decimals = len(mantissa.partition(".")[2]) - int(exponent or 0)
    off = abs(computed - float(published))
    if off <= 0.5 * 10.0**-decimals * (1 + 1e-9):
        verdict = Verdict.REPRODUCED
    elif off <= within / 100 * abs(float(published)):
        verdict = Verdict.WITHIN
    else:
        verdict = otherwise
    return Check(what, where, published, float(computed), unit, verdict, reason)


def follows(what: str, where: str, computed: float, unit: str = "", reason: str = "") -> Check:
    """Tell a number that the paper's equations and tables determine and that it does not print.

    Parameters
    ----------
    what, where : str
        What it is, and what it follows from.
    computed : float
        In ``unit``.
    unit : str
        Its unit.
    reason : str
        What it means.

    Returns
    -------
    Check
    """
    return Check(what, where, "", float(computed), unit, Verdict.NOT_PRINTED, reason)


def claim(
    what: str, where: str, holds: bool, computed: float | None, unit: str = "", reason: str = ""
) -> Check:
    """Judge a statement of the text.

    Parameters
    ----------
    what, where : str
        The statement and its place.
    holds : bool
        Whether what is computed agrees.
    computed : float or None
        The number that decides, in ``unit``.
    unit : str
        Its unit.
    reason : str
        What the number is.

    Returns
    -------
    Check
    """
    verdict = Verdict.REPRODUCED if holds else Verdict.WRONG
    return Check(
        what, where, "", None if computed is None else float(computed), unit, verdict, reason
    )


def remark(what: str, where: str, verdict: Verdict, reason: str, published: str = "") -> Check:
    """Tell what cannot be settled by a number.

    Parameters
    ----------
    what, where : str
        What it is, and its table, equation or section.
    verdict : Verdict
        What is the matter.
    reason : str
        Why.
    published : str
        As printed, where it is a number.

    Returns
    -------
    Check
    """
    return Check(what, where, published, None, "", verdict, reason)


def layout(title: str, checks: Iterable[Check]) -> Table:
    """Lay out a paper's checks for the terminal.

    Parameters
    ----------
    title : str
        The paper.
    checks : iterable of Check
        Its numbers.

    Returns
    -------
    rich.table.Table
        A row a number, and how often each verdict was given below.
    """
    from rich.table import Table

    checks = list(checks)
    table = Table(box=None, pad_edge=False, header_style="bold", title=title, caption=tally(checks))
    for heading, side in COLUMNS.items():
        table.add_column(heading, justify="right" if side == "right" else "left")
    for check in checks:
        table.add_row(*texts(check))
    return table


COLUMNS = {
    "what": "left",
    "where": "left",
    "published": "right",
    "computed": "right",
    "unit": "left",
    "diff %": "right",
    "verdict": "left",
    "why": "left",
}
"""Headings of the table of checks, and the side at which a column lines up."""


def texts(check: Check) -> tuple[str, ...]:
    """Print a check.

    Parameters
    ----------
    check : Check
        A number of a paper.

    Returns
    -------
    tuple of str
        A text a column.
    """
    return (
        check.what,
        check.where,
        check.published,
        "" if check.computed is None else f"{check.computed:.5g}",
        check.unit,
        "" if check.difference is None else f"{check.difference:+.2f}",
        check.judgement,
        check.reason,
    )


def tally(checks: Iterable[Check]) -> str:
    """Count verdicts.

    Parameters
    ----------
    checks : iterable of Check
        Numbers of one paper or of several.

    Returns
    -------
    str
        How often each verdict was given.
    """
    counts = Counter(check.verdict for check in checks)
    return "; ".join(f"{verdict.value} {counts[verdict]}" for verdict in Verdict if counts[verdict])
