"""Table of tests to make next."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .tables import TextTable

if TYPE_CHECKING:
    from ..discrepancy.planned_tests import PlannedTest, TestPlan

_HEADINGS = ("test", "amplitude, mm", "frequency, Hz", "cycles", "current, A", "rate, Hz", "why")


def plan_table(plan: TestPlan) -> TextTable:
    """Tests of a plan."""
    rows = []
    for k, (test, row) in enumerate(zip(plan.tests, plan.to_records(), strict=True), 1):
        numbers = (f"{row[key]:g}" for key in ("amplitude_mm", "frequency_Hz", "cycles"))
        rows.append((str(k), *numbers, _current(test), f"{row['sample_rate_Hz']:g}", _why(test)))
    return TextTable(f"Next tests for {plan.name}: sinusoids", _HEADINGS, rows)


def _current(test: PlannedTest) -> str:
    levels = " / ".join(f"{one:.3g}" for one in test.currents)
    return f"{levels} every {test.step:g} s" if test.step else levels


def _why(test: PlannedTest) -> str:
    if not test.rest:
        return test.why
    return f"{test.why}; in two equal parts with {test.rest:g} s of rest between"
