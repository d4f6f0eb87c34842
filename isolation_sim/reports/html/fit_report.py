"""The report of a fit: measured and modelled loops, errors, parameters with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...effects.serialisation import device_code
from ..references import of_device
from .charts import Look, layout, numbers
from .page import (
    Bullets,
    Cell,
    Chart,
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
from .run_report import code_facts, versions
from .text import capital

if TYPE_CHECKING:
    from ...identification.fitted import Fit, LawEvaluation, RunError

_MOST_CHARTS = 24
# a few cycles are enough to see, and the file stays small
_MOST_POINTS = 1200
_LOOKS = {
    "measured": Look("#9a9a9a", "", "", ""),
    # solid lines: consecutive loops coincide and would fill the gaps of dashes
    "modelled": Look("#0072B2", "", "", ""),
}


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
            Prose((f"The last {_MOST_POINTS} samples of each run at most, each run on its own "
                   f"axes. The title gives the error.{some}",)),
            LineChoice(_LOOKS, "Lines of all charts"),
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
        Section("Loops", [LineChoice(_LOOKS, "Lines of all charts"),
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
    peak = max(float(np.abs(e.run.force).max()) for e in errors)
    unit, scale = ("kN", 1e-3) if peak >= 2e3 else ("N", 1.0)
    blocks: list[Prose | Gallery] = []
    for motion, title in (("displacement", "Deformation (mm)"), ("velocity", "Velocity (mm/s)")):
        # each on its own axes, since small loops may have the largest relative errors
        axes = layout(title, f"Force ({unit})", hovermode="closest")
        blocks += [
            Prose((f"Force over {title.split()[0].lower()}.",)),
            Gallery(tuple(_loop(e, motion, scale, axes) for e in errors)),
        ]
    return tuple(blocks)


def _loop(error: RunError, motion: str, scale: float, axes: dict[str, Any]) -> Chart:
    run = error.run
    # the measured line is wider, so that it shows on both sides of the modelled line
    widths = {"measured": 3.5, "modelled": 1.5}
    drawn = slice(-min(len(run.time), _MOST_POINTS), None)
    abscissa = numbers(1e3 * getattr(run, motion)[drawn])
    traces = [
        {**_LOOKS[name].line(width=widths[name]), "mode": "lines", "name": name, "meta": name,
         "x": abscissa, "y": numbers(scale * force[drawn])}
        for name, force in (("measured", run.force), ("modelled", error.force))
    ]  # fmt: skip
    held = ", held out" if run.hold_out else ""
    over = ", over velocity" if motion == "velocity" else ""
    title = f"{run.name}{over}: {100 * error.relative:.1f} %{held}"
    summary = f"RMS error of the model: {100 * error.relative:.2g} % of the measured force."
    return Chart(title, {"data": traces, "layout": axes}, summary, height=280)


def _percent(share: float) -> Cell:
    return Cell(f"{100 * share:.2f}")
