"""The report of a fit: measured and modelled loops, errors, parameters with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...effects.serialisation import device_code
from ...identification.fitted import Fit
from ...written_names import capital
from ..fit_tables import errors_table, parameters_table, runs_table
from ..loops_fitted import LOOKS, loops
from ..references import of_device
from .page import Block, Bullets, Facts, Gallery, LineChoice, Listing, Page, Prose, Section, Table
from .panels import panel_chart
from .run_report import code_facts, versions

if TYPE_CHECKING:
    from ...identification.fitted import LawEvaluation, RunError

_MOST_CHARTS = 24


def fit_report(fit: Fit) -> Page:
    """Report of a fit."""
    law, errors = fit.device.law, fit.errors
    held_out = any(e.run.hold_out for e in errors)
    sections = [
        *_results(fit, _verdict(fit), Table.of(runs_table(fit), filters=("Used as",) * held_out)),
        Section("Parameters", [Table.of(parameters_table(fit), "Parameters with 95 % intervals")]),
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
    verdict = (
        f"{law.title} has an RMS force error of {100 * evaluation.error:.2g} %.",
        f"The noise of the measured force is {100 * evaluation.noise:.2g} %.",
    )
    sections = [
        *_results(evaluation, verdict, Table.of(errors_table(evaluation))),
        Section("Inputs and versions", [Facts({
            "Law": f"{law.title} ({law.name}); {device.source or law.source}",
            "Campaign": f"{campaign.name}; {campaign.source or 'no source given'}",
            **code_facts(device_code(device)),
            "Versions": versions(),
        })]),
    ]  # fmt: skip
    return Page(f"Errors of {law.title}", f"On {campaign.name}", sections)


def _results(evaluation: LawEvaluation, verdict: tuple[str, ...], table: Table) -> list[Section]:
    """Verdict, loops and errors of a fit or an evaluation."""
    errors = evaluation.errors
    # evenly chosen from many
    shown = errors[:: -(-len(errors) // _MOST_CHARTS)]
    some = f" {len(shown)} of {len(errors)} runs are drawn." if len(shown) < len(errors) else ""
    first: list[Block] = [Prose(verdict, "verdict")]
    if evaluation.notes:
        first.append(Prose(tuple(f"{capital(note)}." for note in evaluation.notes), "warning"))
    return [
        Section("Verdict", first),
        Section("Loops", [
            Prose(("The last strong cycles of each run, each run on its own axes. The title gives "
                   f"the error.{some}",)),
            LineChoice(LOOKS, "Lines of all charts"),
            *_loops(shown),
        ]),
        Section("Errors", [table]),
    ]  # fmt: skip


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
            panel_chart(
                panel,
                f"RMS error of the model: {100 * error.relative:.2g} % of the measured force.",
                height=280,
            )
            for panel, error in zip(loops(errors, motion), errors, strict=True)
        ]
        blocks += [Prose((f"Force over {word}.",)), Gallery(tuple(charts))]
    return tuple(blocks)
