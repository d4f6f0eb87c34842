"""Text and tables of a diagnosis, for the terminal and for files."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..discrepancy.consequence import SUBJECTS
from ..discrepancy.diagnosis import BuildingDiagnosis, Cause, Diagnosis, Errors
from ..written_names import as_written, capital
from .tables import TextTable
from .units import unit_of

if TYPE_CHECKING:
    from ..discrepancy.consequence import Consequence, Performance
    from ..discrepancy.planned_tests import PlannedTest, TestPlan
    from ..discrepancy.tiers.result import Ladder


_PLACES = {"storey", "floor"}
"""Numbers of a cause that only repeat its place."""
_NOTES = 5
"""Sentences about the data, at most."""


def shown(diagnosis: Diagnosis) -> Iterator[Any]:
    """Tables and sentences of a diagnosis, for a terminal."""
    yield f"{diagnosis.model} against {diagnosis.data}\n"
    yield from data_notes(diagnosis)
    yield from better_law(diagnosis)
    yield f"{diagnosis.verdict.replace('_', ' ').upper()}. {diagnosis.meaning}"
    yield from remarks(diagnosis)
    choice = diagnosis.details.get("law_choice", {})
    if choice and not choice["wrong_family"]:
        yield choice["text"]
    yield errors_table(diagnosis)
    of_causes = diagnosis.ladder is None or diagnosis.ladder.offered == "causes"
    if isinstance(diagnosis, BuildingDiagnosis) and diagnosis.verdict != "adequate" and of_causes:
        yield from channels_table(diagnosis)
    yield from causes_tables(diagnosis)
    for cause in diagnosis.causes:
        yield f"{cause.placed}: {cause_text(cause)}"
        if cause.confusable_with:
            yield f"  hard to distinguish from {', '.join(cause.confusable_with)}"
    if diagnosis.ladder is not None:
        yield ladder_table(diagnosis.ladder, diagnosis.noise)
        yield from equation_table(diagnosis.ladder)
        yield from ladder_text(diagnosis.ladder)
    if diagnosis.depends_on:
        yield f"Without causes, the residual depends on {', '.join(diagnosis.depends_on)}."
    if diagnosis.unexplained_share > 0.005:
        yield f"Unexplained: {100 * diagnosis.unexplained_share:.0f} % of the misfit."
    if diagnosis.next_test:
        yield f"Next test. {diagnosis.next_test}"
    if diagnosis.consequence is not None:
        if diagnosis.consequence.performance:
            yield consequence_table(diagnosis.consequence)
            yield consequence_note(diagnosis.consequence)
        yield from consequence_text(diagnosis.consequence)


def remarks(diagnosis: Diagnosis) -> list[str]:
    """Where a building's model is wrong, or that its data are."""
    remark = str(diagnosis.details.get("remark", ""))
    return [remark] if remark else []


def is_unchanged(diagnosis: Diagnosis) -> bool:
    """Whether the model after the diagnosis is the one before it."""
    return not diagnosis.causes and (
        diagnosis.ladder is None or diagnosis.ladder.offered in ("law", "causes")
    )


def data_notes(diagnosis: Diagnosis) -> list[str]:
    """What looks wrong in the data, not more than a few sentences."""
    notes = [
        f"Data: {each}{'' if each.endswith('?') else '.'}" for each in diagnosis.data_notes[:_NOTES]
    ]
    further = len(diagnosis.data_notes) - len(notes)
    return notes + ([f"Data: {further} more in the step Data."] if further else [])


def better_law(diagnosis: Diagnosis) -> list[str]:
    """Another law that is far better, told first: causes on the wrong law only imitate it."""
    choice = diagnosis.details.get("law_choice", {})
    if choice.get("wrong_family"):
        return [choice["text"]]
    return [diagnosis.ladder.better_law] if diagnosis.ladder and diagnosis.ladder.better_law else []


def consequence_text(consequence: Consequence) -> list[str]:
    """A consequence in sentences."""
    where = f"{capital(consequence.scenario)}. {consequence.finding}"
    return [text for text in (where, *consequence.warnings, consequence.scaling) if text]


def errors_table(diagnosis: Diagnosis) -> TextTable:
    """Errors before and after, noise floors and decrease of the held-out error, %."""
    errors = diagnosis.error_before, diagnosis.error_after, diagnosis.noise
    columns = 2 + bool(np.isfinite(diagnosis.noise_floor))
    what = "data" if isinstance(diagnosis, BuildingDiagnosis) else "runs"
    rows = [
        (name, *(f"{100 * getattr(error, part):.2f}" for error in errors[:columns]))
        for name, part in ((f"fitted {what}", "fit"), (f"held-out {what}", "held_out"))
        if np.isfinite(getattr(errors[0], part))
    ]
    if diagnosis.gain:
        low, high = (100 * g for g in diagnosis.gain)
        rows.append(("decrease, 95 %", "", f"{low:.0f} to {high:.0f}", *[""] * (columns - 2)))
    headings = ("", "before, %", "after, %", "noise, %")[: columns + 1]
    return TextTable("Residual over measured signal (RMS)", headings, rows)


def channels_table(diagnosis: BuildingDiagnosis) -> Iterator[TextTable]:
    """Errors of each channel, from the verdict's step."""
    for step in diagnosis.steps[-1:]:
        if step.rows:
            headings = ("channel", "before, %", "after, %")
            yield TextTable("Error of each channel on data not fitted", headings, step.rows)


RUNGS = {
    "law": "law", "causes": "with causes", "equation": "with an equation",
    "learned": "with a learned term",
}  # fmt: skip


def ladder_table(ladder: Ladder, noise: Errors) -> TextTable:
    """Errors of every tier, the best attained error and the noise floors, %."""

    def percent(value: float) -> str:
        return f"{100 * value:.2f}" if np.isfinite(value) else ""

    rows: list[tuple[str, ...]] = [
        (RUNGS[one.name] + " (offered)" * (one.name == ladder.offered), percent(one.fit),
         percent(one.held_out), percent(one.left_out))
        for one in ladder.rungs
    ]  # fmt: skip
    columns = [[getattr(one, name) for one in ladder.rungs] for name in
               ("fit", "held_out", "left_out")]  # fmt: skip
    rows.append(("best attained", *(percent(min(column)) for column in columns)))
    rows.append(("noise floor", percent(noise.fit), percent(noise.held_out), ""))
    headings: tuple[str, ...] = ("", "fitted, %", "held out, %", "conditions left out, %")
    if not np.isfinite(columns[-1]).any():
        headings, rows = headings[:-1], [row[:-1] for row in rows]
    return TextTable(f"Residual over {ladder.quantity} (RMS) of each tier", headings, rows)


def equation_table(ladder: Ladder) -> Iterator[TextTable]:
    """The equation, and the numbers of each term with 95 % intervals; none without terms."""
    formula = " + ".join(["law", *(term.product for term in ladder.terms)])
    rows = [
        ("" if k else term.text, name, str(number), number.unit)
        for term in ladder.terms
        for k, (name, number) in enumerate(term.numbers.items())
    ]
    if rows:
        title = f"Equation: F = {formula}"
        yield TextTable(title, ("term", "number", "value (95 %)", "unit"), rows, keys=2)


def ladder_text(ladder: Ladder) -> list[str]:
    """How stable the equation is, and the unexplained misfit, as sentences."""
    lines = []
    if ladder.terms:
        lines.append(
            "Share of the fits, each without one condition, that chose the term: "
            + ", ".join(f"{100 * term.stability:.0f} %" for term in ladder.terms)
            + "."
        )
    if np.isfinite(ladder.explainable):
        lines.append(
            "Misfit of the law that causes and equation do not explain: a flexible model of the "
            f"measured variables explains a further {100 * ladder.explainable:.0f} %; no measured "
            f"variable explains {100 * ladder.inexplicable:.0f} %."
        )
    return [*lines, *ladder.notes]


def causes_tables(diagnosis: Diagnosis) -> Iterator[TextTable]:
    """Causes by their share of the misfit, and their numbers; none without causes."""
    causes = diagnosis.causes
    columns = {
        "cause": [cause.label for cause in causes],
        "place": [cause.place for cause in causes],
        "form": [cause.form for cause in causes],
        "share of the misfit, %": [f"{100 * cause.share:.0f}" for cause in causes],
        "p": [_chance(cause.p_value) for cause in causes],
        "named again, %": [", ".join(_stability(cause).values()) for cause in causes],
    }
    columns = {heading: cells for heading, cells in columns.items() if any(cells)}
    if causes:
        again = (
            " Named again: share of the fits without the runs of one condition, and of the fits to "
            "resampled runs, that name it."
        ) * ("named again, %" in columns)
        yield TextTable(
            "Causes", list(columns), list(zip(*columns.values(), strict=True)),
            caption=f"p: probability of such an improvement without the cause.{again}",
        )  # fmt: skip
    several = len({cause.label for cause in causes}) < len(causes)
    rows, last = [], ""
    for cause in causes:
        for name, one in cause.parameters.items():
            if cause.place and name in _PLACES:
                continue
            label = cause.placed if several else cause.label
            note = "at its bound" * one.at_bound
            rows.append((label if label != last else "", name, str(one), one.unit, note))
            last = label
    n = 5 if any(row[4] for row in rows) else 4
    if rows:
        headings = ("cause", "parameter", "value (95 %)", "unit", "note")
        yield TextTable(
            "Numbers of the causes", headings[:n], [row[:n] for row in rows], keys=2
        )  # fmt: skip


_STABILITY = {
    "conditions_left_out": "the fits without the runs of one condition",
    "runs_resampled": "the resamplings of the runs",
}


def _stability(cause: Cause) -> dict[str, str]:
    """Shares of repeated fits with the same cause, %, by the kind of fits."""
    return {
        words: f"{100 * cause.stability[name]:.0f}"
        for name, words in _STABILITY.items()
        if np.isfinite(cause.stability.get(name, np.nan))
    }


def cause_text(cause: Cause) -> str:
    """Evidence for a cause, and the share of repeated fits with the same cause."""
    again = " and ".join(f"{share} % of {words}" for words, share in _stability(cause).items())
    return f"{cause.reason} Named again in {again}." if again else cause.reason


def _chance(p: float) -> str:
    return f"{p:.2g}" if p > 1e-9 else "< 1e-9"


def markdown(diagnosis: Diagnosis) -> str:
    """The diagnosis as a text in Markdown."""
    parts = [
        f"# {diagnosis.model} against {diagnosis.data}",
        *better_law(diagnosis),
        f"**{diagnosis.verdict.replace('_', ' ').capitalize()}.** {diagnosis.meaning}",
        *remarks(diagnosis),
    ]
    parts += [_grid(table.headings, table.rows) for table in causes_tables(diagnosis)]
    parts += [f"- **{cause.placed}**: {cause_text(cause)}" for cause in diagnosis.causes]
    if diagnosis.ladder is not None:
        ladder = ladder_table(diagnosis.ladder, diagnosis.noise)
        parts += ["## Tiers", _grid(ladder.headings, ladder.rows)]
        for table in equation_table(diagnosis.ladder):
            parts += [table.title, _grid(table.headings, table.rows)]
        parts += ladder_text(diagnosis.ladder)
    for number, step in enumerate(diagnosis.steps, start=1):
        parts.append(f"## {number}. {step.title}\n\n{step.text}")
        if step.rows:
            parts.append(_grid(step.headings, step.rows))
    if diagnosis.next_test:
        parts.append(f"## Next test\n\n{diagnosis.next_test}")
    if diagnosis.consequence is not None:
        parts.append("## Consequence for control")
        if diagnosis.consequence.performance:
            table = consequence_table(diagnosis.consequence)
            parts += [_grid(table.headings, table.rows),
                      consequence_note(diagnosis.consequence)]  # fmt: skip
        parts += consequence_text(diagnosis.consequence)
    return "\n\n".join(parts) + "\n"


def _grid(headings: Any, rows: Any) -> str:
    lines = ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)


_CONSEQUENCE_HEADINGS = (
    "controller",
    "base displ., mm: old", "new", "error, %",
    "floor acc., m/s²: old", "new", "error, %",
    "J: old", "new", "new design",
    "rank: old", "new", "new design",
)  # fmt: skip


def consequence_note(consequence: Consequence) -> str:
    """Meaning of the table's columns."""
    old, new = SUBJECTS[consequence.subject]
    return (
        f"Old: building and controllers use the {old}. New: the building uses the {new}, the "
        f"controllers the old one. New design: both use the {new}. J: sum of the two peaks, each "
        "over its value with the coils off." + " Rank: by J." * (len(consequence.performance) > 1)
    )


def consequence_table(consequence: Consequence) -> TextTable:
    """Controllers with the old and with the new law or model."""
    rows = []
    for name, cases in consequence.performance.items():
        predicted, actual, redesigned = (
            cases[case] for case in ("predicted", "actual", "redesigned")
        )
        row = [as_written(name)]
        for key in ("peak_base_displacement_m", "peak_floor_acceleration_m_s2"):
            row += [_number(predicted, key), _number(actual, key), _error(predicted, actual, key)]
        row += [_number(one, "J") for one in (predicted, actual, redesigned)]
        row += [str(one.rank) if one else "-" for one in (predicted, actual, redesigned)]
        rows.append(row)
    title, n = f"Consequence of the {consequence.subject}'s error for control", len(rows[0])
    if len(rows) == 1:
        n -= 3  # one controller has no rank
    return TextTable(title, _CONSEQUENCE_HEADINGS[:n], [row[:n] for row in rows])


def _number(one: Performance | None, key: str) -> str:
    return "-" if one is None else f"{getattr(one, key) * unit_of(key)[1]:.3g}"


def _error(predicted: Performance | None, actual: Performance | None, key: str) -> str:
    if predicted is None or actual is None:
        return "-"
    return f"{100 * (getattr(predicted, key) / getattr(actual, key) - 1):+z.0f}"


_TEST_HEADINGS = (
    "test",
    "amplitude, mm",
    "frequency, Hz",
    "cycles",
    "current, A",
    "rate, Hz",
    "why",
)


def plan_table(plan: TestPlan, most: int | None = None) -> TextTable:
    """Tests of a plan, or the first of them."""
    rows = []
    for k, (test, row) in enumerate(zip(plan.matrix, plan.to_records(), strict=True), 1):
        numbers = (f"{row[key]:g}" for key in ("amplitude_mm", "frequency_Hz", "cycles"))
        rows.append(
            (str(k), *numbers, _current_text(test), f"{row['sample_rate_Hz']:g}", _why_text(test))
        )
    return TextTable(f"Next tests for {plan.name}: sinusoids", _TEST_HEADINGS, rows[:most])


def _current_text(test: PlannedTest) -> str:
    levels = " / ".join(f"{one:.3g}" for one in test.currents)
    return f"{levels} every {test.step:g} s" if test.step else levels


def _why_text(test: PlannedTest) -> str:
    if not test.rest:
        return test.why
    return f"{test.why}; in two equal parts with {test.rest:g} s of rest between"
