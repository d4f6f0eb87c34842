"""A diagnosis in a terminal and in files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..discrepancy.diagnosis import MEANINGS, Cause, Diagnosis
from .consequence import HEADINGS, NOTE, TITLE, consequence_rows
from .html.text import capital

if TYPE_CHECKING:
    from rich.table import Table

    from ..discrepancy.consequence import Consequence


def print_diagnosis(diagnosis: Diagnosis) -> None:
    """Print a diagnosis to standard output."""
    from .console import standard_console

    console = standard_console()
    console.print(f"{diagnosis.model} against {diagnosis.data}", soft_wrap=True)
    console.print()
    console.print(f"{diagnosis.verdict.replace('_', ' ').upper()}. {MEANINGS[diagnosis.verdict]}")
    console.print(errors_table(diagnosis))
    if diagnosis.causes:
        console.print(causes_table(diagnosis))
        for cause in diagnosis.causes:
            console.print(f"{cause.label}: {cause.evidence}")
            if cause.confusable_with:
                console.print(f"  hardly to be told from {', '.join(cause.confusable_with)}")
    if diagnosis.ladder is not None:
        table = _table(LADDER, *LADDER_HEADINGS)
        for cells in ladder_rows(diagnosis):
            table.add_row(*cells)
        console.print(table)
        for line in ladder_text(diagnosis):
            console.print(line, markup=False)
    if diagnosis.depends_on:
        console.print(f"The residual depends on {', '.join(diagnosis.depends_on)}.")
    if diagnosis.unexplained_share > 0.005:
        console.print(f"Unexplained: {100 * diagnosis.unexplained_share:.0f} % of the misfit.")
    if diagnosis.next_test:
        console.print(f"Next test. {diagnosis.next_test}")
    if diagnosis.consequence is not None:
        if diagnosis.consequence.performance:
            console.print(consequence_table(diagnosis.consequence))
            console.print(NOTE)
        for line in consequence_text(diagnosis.consequence):
            console.print(line)


def consequence_table(consequence: Consequence) -> Table:
    """Controllers with the law that was judged and with the extended one, for a terminal."""
    table = _table(TITLE, *(heading.replace(" ", "\n") for heading in HEADINGS), dense=True)
    for row in consequence_rows(consequence):
        table.add_row(*row)
    return table


def consequence_text(consequence: Consequence) -> list[str]:
    """What a consequence says in words."""
    where = f"{capital(consequence.scenario)}. {consequence.finding}"
    return [text for text in (where, *consequence.warnings, consequence.scaling) if text]


def errors_table(diagnosis: Diagnosis) -> Table:
    """Errors before and after, for a terminal."""
    table = _table("Residual over what was measured (RMS)", "", "before, %", "after, %")
    for row in error_rows(diagnosis):
        table.add_row(*row)
    return table


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


LADDER = "Residual over force (RMS) of each tier"
LADDER_HEADINGS = ("", "fitted, %", "held out, %", "conditions left out, %")
_RUNGS = {
    "law": "law", "causes": "with causes", "equation": "with an equation",
    "learned": "with a learned term",
}  # fmt: skip


def ladder_rows(diagnosis: Diagnosis) -> list[tuple[str, ...]]:
    """Errors of every tier, %, the best attainable and the noise floor, as text."""
    ladder = diagnosis.ladder
    if ladder is None:
        return []

    def percent(value: float) -> str:
        return f"{100 * value:.2f}" if np.isfinite(value) else ""

    rows: list[tuple[str, ...]] = [
        (_RUNGS[one.name] + " (offered)" * (one.name == ladder.offered), percent(one.fit),
         percent(one.held_out), percent(one.left_out))
        for one in ladder.rungs
    ]  # fmt: skip
    columns = [[getattr(one, name) for one in ladder.rungs] for name in
               ("fit", "held_out", "left_out")]  # fmt: skip
    rows.append(("best attained", *(percent(min(column)) for column in columns)))
    rows.append(("noise floor", percent(diagnosis.noise_floor), "", ""))
    return rows


def ladder_text(diagnosis: Diagnosis) -> list[str]:
    """The equation, and what is left to explain."""
    ladder = diagnosis.ladder
    if ladder is None:
        return []
    lines = []
    if ladder.terms:
        lines.append(f"Equation. F = law {ladder.equation}".replace("\n", " "))
        lines.append(
            "Chosen without each condition in turn: "
            + ", ".join(f"{100 * term.stability:.0f} %" for term in ladder.terms)
            + "."
        )
    if np.isfinite(ladder.explainable):
        lines.append(
            f"Unexplained by causes and equation: {100 * ladder.explainable:.0f} % of the law's "
            "misfit that a flexible model of the measured variables explains, and "
            f"{100 * ladder.inexplicable:.0f} % that nothing measured explains."
        )
    return [*lines, *ladder.notes]


def causes_table(diagnosis: Diagnosis) -> Table:
    """Causes with their numbers, for a terminal."""
    table = _table("Causes", "cause", "form", "share, %", "p", "parameter", "value (95 %)", "unit")
    for cause in diagnosis.causes:
        for row in cause_rows(cause):
            table.add_row(*row)
    return table


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


def _table(title: str, *headings: str, dense: bool = False) -> Table:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(
        title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 0 if dense else 1)
    )
    for number, heading in enumerate(headings):
        numeric = "%" in heading or heading == "p" or (dense and number > 0)
        side: Literal["right", "left"] = "right" if numeric else "left"
        table.add_column(heading, justify=side, no_wrap=number == 0)
    return table


def markdown(diagnosis: Diagnosis) -> str:
    """The diagnosis as a readable text."""
    parts = [
        f"# {diagnosis.model} against {diagnosis.data}",
        f"**{diagnosis.verdict.replace('_', ' ').capitalize()}.** {MEANINGS[diagnosis.verdict]}",
    ]
    if diagnosis.causes:
        headings = ("cause", "form", "share, %", "p", "parameter", "value (95 %)", "unit")
        rows = [row for cause in diagnosis.causes for row in cause_rows(cause)]
        parts.append(_grid(headings, rows))
        parts += [f"- **{cause.label}**: {cause.evidence}" for cause in diagnosis.causes]
    if diagnosis.ladder is not None:
        parts += ["## Tiers", _grid(LADDER_HEADINGS, ladder_rows(diagnosis))]
        parts += ladder_text(diagnosis)
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
