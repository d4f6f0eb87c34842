"""Spectra of a suite of records and their target."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .chart import Panel
from .panels import draw
from .style import Look, legend, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..sweeps.suites.result import Suite

COMBINATIONS = {
    "srss": "SRSS of the components",
    "rotd100": "RotD100",
    "geometric_mean": "geometric mean of the components",
    "mean": "mean of the components",
    "larger": "larger component",
}
"""Combination of the components' spectra, in words."""


_LOOKS = {
    "mean": Look("#000000", width=1.6),
    "target": Look("#D55E00", (4, 1.2), width=1.6),
    "least mean by the rule": Look("#0072B2", (1, 1)),
}
_RECORD = Look("#a6a6a6", width=0.6)


def spectra_panel(suite: Suite) -> Panel:
    """Spectra of the scaled records, their mean, the target and the rule's least mean."""
    result = suite.index["spectra"]
    periods = np.array(result["plotted"]["period_s"])
    # a record may have the name of another line
    records = {
        f"record {name}" if name in _LOOKS else name: (periods, np.array(row))
        for name, row in result["plotted"]["psa_m_s2"].items()
    }
    target = np.array(result["plotted"]["target_m_s2"], dtype=float)
    lines = dict(records)
    lines["mean"] = periods, np.mean([row for _, row in records.values()], axis=0)
    if not np.isnan(target).all():
        lines["target"] = periods, target
    if result["target"] is not None:
        inside = np.array(result["range"]["period_s"]) > 0.0
        at = np.array(result["range"]["period_s"])[inside]
        range_target = np.array(result["range"]["target_m_s2"], dtype=float)[inside]
        floor = np.array(result["range"]["floor"])[inside]
        lines["least mean by the rule"] = at, floor * range_target
    isolated = suite.index["isolated_period_s"]
    return Panel(
        f"Spectra of the scaled records: {COMBINATIONS[result['combination']]}",
        "period (s)", "pseudo-acceleration (m/s²)", lines,
        _LOOKS | dict.fromkeys(records, _RECORD), unit="m/s²", log_x=True, log_y=True,
        groups=dict.fromkeys(records, "records"),
        band=(suite.rule.low * isolated, suite.rule.high * isolated),
    )  # fmt: skip


def spectra_key(panel: Panel) -> dict[str, Look]:
    """Look of each name in the legend."""
    return {panel.groups.get(name, name): panel.looks[name] for name in panel.lines}


def spectra(suite: Suite) -> Figure:
    """Draw the spectra of a suite."""
    with style():
        figure = new_figure(5.2, 3.4)
        axes = figure.add_subplot()
        draw(axes, spectra_panel(suite), width=1.0)
        legend(figure, axes, "outside upper center")
    return figure
