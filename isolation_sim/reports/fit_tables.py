"""Tables of a fit and of an evaluation: parameters, and errors of the runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .tables import TextTable

if TYPE_CHECKING:
    from ..identification.fitted import Fit, LawEvaluation


def errors_table(evaluation: LawEvaluation) -> TextTable:
    """Errors of a law on all runs."""
    rows = [
        (e.run.name + ", held out" * e.run.hold_out, f"{100 * e.relative:.2f}")
        for e in evaluation.errors
    ]
    rows.append(("all runs, pooled", f"{100 * evaluation.error:.2f}"))
    title = f"{evaluation.device.law.title}: force residual over measured force (RMS)"
    return TextTable(title, ("run", "error, %"), rows, totals=1)


def parameters_table(fit: Fit) -> TextTable:
    """Fitted numbers with their intervals."""
    rows = [
        (e.name, "" if e.current is None else f"{e.current:.3g}", f"{e.value:.5g}", e.interval,
         e.unit, "" if e.determined or e.at_bound else "not determined")
        for e in fit.estimates
    ]  # fmt: skip
    title = f"{fit.device.law.title}, fitted to {fit.campaign.name}"
    headings = ("parameter", "current, A", "value", "95 % interval", "unit", "note")
    return TextTable(title, headings, rows, keys=2)


def runs_table(fit: Fit) -> TextTable:
    """Errors of the fitted and of the held-out runs."""
    used = {False: "fitted", True: "held out"}
    rows = [(e.run.name, used[e.run.hold_out], f"{100 * e.relative:.2f}") for e in fit.errors]
    pooled = {"fitted": fit.error, "held out": fit.held_out_error}
    totals = [
        ("all, pooled", name, f"{100 * error:.2f}")
        for name, error in pooled.items()
        if not np.isnan(error)
    ]
    headings = ("run", "used as", "error, %")
    title = "Force residual over measured force (RMS)"
    return TextTable(title, headings, [*rows, *totals], totals=len(totals))
