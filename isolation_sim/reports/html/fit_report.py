"""The report of a fit: measured and modelled loops, errors, parameters with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...effects.serialisation import device_code
from ..loops_fitted import LOOKS, SAMPLES, loops
from ..references import of_device
from .page import (
    Bullets,
    Cell,
    Facts,
    Gallery,
    LineChoice,
    Listing,
    Page,
    Prose,
    Row,
    Section,
    Table,
)
from .panels import drawn
from .run_report import code_facts, versions
from .text import capital

if TYPE_CHECKING:
    from ...identification.fitted import Fit, LawEvaluation, RunError

_MOST_CHARTS = 24


def fit_report(fit: Fit) -> Page:
    """Report of a fit."""
    law, errors = fit.device.law, fit.errors
    shown = _shown(errors)
    some = f" {len(shown)} of {len(errors)} runs are drawn." if len(shown) < len(errors) else ""
    sections = [
        Section("Verdict", [
            Prose(_verdict(fit), "verdict"),
            *([Prose(tuple(f"{capital(note)}." for note in fit.notes), "warning")]
              if fit.notes else []),
        ]),
        Section("Loops", [
            Prose((f"The last {SAMPLES} samples of each run at most, each run on its own "
                   f"axes. The title gives the error.{some}",)),
            LineChoice(LOOKS, "Lines of all charts"),
            *_loops(shown),
        ]),
        Section("Errors", [errors_table(fit)]),
        Section("Parameters", [parameters_table(fit)]),
        Section("Inputs and versions", [
            Facts({
                "Law": f"{law.title} ({law.name}); {law.source}",
                "Campaign": f"{fit.campaign.name}; {fit.campaign.source or 'no source given'}",
                "Runs": f"{sum(not e.run.hold_out for e in errors)} fitted, "
                        f"{sum(e.run.hold_out for e in errors)} held out",
                "Search": "converged" if fit.converged else "did not converge",
                "Versions": versions(),
            }),
            Listing("The fitted law, as a scenario's [isolator] section", fit.scenario_section()),
        ]),
        Section("References", [Bullets(tuple(
            citation.line for citation in of_device(fit.device)
        ))]),
    ]  # fmt: skip
    return Page(f"Fit report: {law.title}", f"Fitted to {fit.campaign.name}", sections)


def evaluation_report(evaluation: LawEvaluation) -> Page:
    """Report of a law's errors on measured runs."""
    device, campaign = evaluation.device, evaluation.campaign
    law = device.law
    first = (
        f"{law.title} has an RMS force error of {100 * evaluation.error:.2g} %",
        f"The noise of the measured force is {100 * evaluation.noise:.2g} %.",
    )
    notes = tuple(f"{capital(note)}." for note in evaluation.notes)
    sections = [
        Section("Verdict", [Prose((f"{first[0]}.", first[1]), "verdict"),
                            *([Prose(notes, "warning")] if notes else [])]),
        Section("Loops", [LineChoice(LOOKS, "Lines of all charts"),
                          *_loops(_shown(evaluation.errors))]),
        Section("Errors", [Table(
            caption="Force residual over measured force, both RMS",
            headings=("Run", "Error, %"),
            rows=tuple(Row(e.run.name, (_percent(e.relative),)) for e in evaluation.errors),
        )]),
        Section("Inputs and versions", [Facts({
            "Law": f"{law.title} ({law.name}); {device.source or law.source}",
            "Campaign": f"{campaign.name}; {campaign.source or 'no source given'}",
            **code_facts(device_code(device)),
            "Versions": versions(),
        })]),
    ]  # fmt: skip
    return Page(f"Errors of {law.title}", f"On {campaign.name}", sections)


def _shown(errors: Sequence[RunError]) -> Sequence[RunError]:
    """Runs to draw, evenly chosen from many."""
    return errors[:: -(-len(errors) // _MOST_CHARTS)]


def errors_table(fit: Fit) -> Table:
    """Errors by run, held-out runs marked, with the pooled errors below."""
    rows = [
        Row(e.run.name, (Cell("held out" if e.run.hold_out else "fitted"), _percent(e.relative)))
        for e in fit.errors
    ]
    rows.append(Row("all fitted runs, pooled", (Cell("fitted"), _percent(fit.error))))
    if any(e.run.hold_out for e in fit.errors):
        rows.append(
            Row("all held-out runs, pooled", (Cell("held out"), _percent(fit.held_out_error)))
        )
    return Table(
        caption="Force residual over measured force, both RMS",
        headings=("Run", "Used as", "Error, %"),
        rows=tuple(rows),
        filters=("Used as",) if any(e.run.hold_out for e in fit.errors) else (),
    )


def parameters_table(fit: Fit) -> Table:
    """Fitted numbers with their intervals; undetermined numbers are marked."""
    rows = tuple(
        Row(e.name, (
            Cell("any" if e.current is None else f"{e.current:.3g}"),
            Cell(f"{e.value:.5g}"), Cell(f"{e.low:.5g} to {e.high:.5g}"), Cell(e.unit or "-"),
            Cell("yes" if e.determined else "no"),
        ))
        for e in fit.estimates
    )  # fmt: skip
    return Table(
        caption="Parameters with 95 % intervals",
        headings=("Parameter", "Current, A", "Value", "95 % interval", "Unit", "Determined"),
        rows=rows,
        note="Determined: whether the data determine the value.",
    )


def _verdict(fit: Fit) -> tuple[str, str]:
    name = fit.device.law.title
    held = fit.held_out_error
    tested = (
        "no run was held out"
        if np.isnan(held)
        else f"the error on held-out runs is {100 * held:.2g} %"
    )
    first = f"{name} has an RMS force error of {100 * fit.error:.2g} %; {tested}."
    determined, count = sum(e.determined for e in fit.estimates), len(fit.estimates)
    which = f"{determined} of the" if determined < count else "all"
    second = f"The data determine {which} {count} fitted numbers."
    return first, second if fit.converged else f"{second} The search did not converge."


def _loops(errors: Sequence[RunError]) -> tuple[Prose | Gallery, ...]:
    """Loops of force over deformation, then over velocity."""
    blocks: list[Prose | Gallery] = []
    for motion, word in (("displacement", "deformation"), ("velocity", "velocity")):
        charts = [
            drawn(
                panel,
                f"RMS error of the model: {100 * error.relative:.2g} % of the measured force.",
                height=280,
            )
            for panel, error in zip(loops(errors, motion), errors, strict=True)
        ]
        blocks += [Prose((f"Force over {word}.",)), Gallery(tuple(charts))]
    return tuple(blocks)


def _percent(share: float) -> Cell:
    return Cell(f"{100 * share:.2f}")
