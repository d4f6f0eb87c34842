"""A diagnosis in a terminal and in files."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..discrepancy.diagnosis import MEANINGS, Cause, Diagnosis
from .consequence import HEADINGS, NOTE, TITLE, consequence_rows
from .html.text import capital
from .tables import TextTable

if TYPE_CHECKING:
    from ..discrepancy.consequence import Consequence


def shown(diagnosis: Diagnosis) -> Iterator[Any]:
    """Tables and sentences of a diagnosis, for a terminal."""
    yield f"{diagnosis.model} against {diagnosis.data}\n"
    yield f"{diagnosis.verdict.replace('_', ' ').upper()}. {MEANINGS[diagnosis.verdict]}"
    yield errors_table(diagnosis)
    if diagnosis.causes:
        yield causes_table(diagnosis)
        for cause in diagnosis.causes:
            yield f"{cause.label}: {cause.evidence}"
            if cause.confusable_with:
                yield f"  hardly to be told from {', '.join(cause.confusable_with)}"
    if diagnosis.depends_on:
        yield f"The residual depends on {', '.join(diagnosis.depends_on)}."
    if diagnosis.unexplained_share > 0.005:
        yield f"Unexplained: {100 * diagnosis.unexplained_share:.0f} % of the misfit."
    if diagnosis.next_test:
        yield f"Next test. {diagnosis.next_test}"
    if diagnosis.consequence is not None:
        if diagnosis.consequence.performance:
            yield consequence_table(diagnosis.consequence)
            yield NOTE
        yield from consequence_text(diagnosis.consequence)


def consequence_table(consequence: Consequence) -> TextTable:
    """Controllers with the law that was judged and with the extended one, for a terminal."""
    return TextTable(TITLE, HEADINGS, consequence_rows(consequence))


def consequence_text(consequence: Consequence) -> list[str]:
    """What a consequence says in words."""
    where = f"{capital(consequence.scenario)}. {consequence.finding}"
    return [text for text in (where, *consequence.warnings, consequence.scaling) if text]


def errors_table(diagnosis: Diagnosis) -> TextTable:
    """Errors before and after, for a terminal."""
    headings = ("", "before, %", "after, %")
    return TextTable("Residual over what was measured (RMS)", headings, error_rows(diagnosis))


def error_rows(diagnosis: Diagnosis) -> list[tuple[str, str, str]]:
    """Errors before and after, %, the noise floor and the held-out error's decrease, as text."""
    rows = [
        (name, f"{100 * before:.2f}", f"{100 * after:.2f}")
        for name, before, after in (
            ("fitted runs", diagnosis.error_before.fit, diagnosis.error_after.fit),
            ("held-out runs", diagnosis.error_before.held_out, diagnosis.error_after.held_out),
        )
        if np.isfinite(before)
    ]
    if np.isfinite(diagnosis.noise_floor):
        rows.append(("noise floor", "", f"{100 * diagnosis.noise_floor:.2f}"))
    if diagnosis.gain:
        low, high = (100 * g for g in diagnosis.gain)
        rows.append(("decrease, 95 %", "", f"{low:.0f} to {high:.0f}"))
    return rows


def causes_table(diagnosis: Diagnosis) -> TextTable:
    """Causes with their numbers, for a terminal."""
    rows = [row for cause in diagnosis.causes for row in cause_rows(cause)]
    # the parameters beside the causes, since both name a row
    headings, *ordered = ([*row[:1], *row[4:], *row[1:4]] for row in (list(CAUSES), *rows))
    for row in ordered:
        row[2] = row[2].replace(", at", "\nat")
    return TextTable("Causes", headings, ordered, keys=2)


CAUSES = ("cause", "form", "share, %", "p", "parameter", "value (95 %)", "unit")
"""Headings of the table of causes."""


def cause_rows(cause: Cause) -> list[list[str]]:
    """A cause's name, form, share, p and parameters with their intervals, as text."""
    first = [cause.label, cause.form, f"{100 * cause.share:.0f}", _chance(cause.p_value)]
    rows: list[list[str]] = []
    for name, one in cause.parameters.items():
        value = f"{one.value:.4g} ({one.low:.3g} to {one.high:.3g})"
        value += ", at its bound" if one.at_bound else ""
        rows.append([*(first if not rows else [""] * 4), name, value, one.unit])
    return rows or [[*first, "", "", ""]]


def _chance(p: float) -> str:
    return f"{p:.2g}" if p > 1e-9 else "< 1e-9"


def markdown(diagnosis: Diagnosis) -> str:
    """The diagnosis as a readable text."""
    parts = [
        f"# {diagnosis.model} against {diagnosis.data}",
        f"**{diagnosis.verdict.replace('_', ' ').capitalize()}.** {MEANINGS[diagnosis.verdict]}",
    ]
    if diagnosis.causes:
        rows = [row for cause in diagnosis.causes for row in cause_rows(cause)]
        parts.append(_grid(CAUSES, rows))
        parts += [f"- **{cause.label}**: {cause.evidence}" for cause in diagnosis.causes]
    for number, step in enumerate(diagnosis.steps, start=1):
        parts.append(f"## {number}. {step.title}\n\n{step.text}")
        if step.rows:
            parts.append(_grid(step.headings, step.rows))
    if diagnosis.next_test:
        parts.append(f"## Next test\n\n{diagnosis.next_test}")
    if diagnosis.consequence is not None:
        parts.append("## What it changes for control")
        if diagnosis.consequence.performance:
            parts += [_grid(HEADINGS, consequence_rows(diagnosis.consequence)), NOTE]
        parts += consequence_text(diagnosis.consequence)
    return "\n\n".join(parts) + "\n"


def _grid(headings: Any, rows: Any) -> str:
    lines = ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)
