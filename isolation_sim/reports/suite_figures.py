"""Figure of a suite of records: its spectra and the target."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .style import legend, new_figure, style

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


def spectra(suite: Suite) -> Figure:
    """Spectra of the scaled records, their mean, the target and the rule's least mean."""
    result = suite.index["spectra"]
    periods = np.array(result["plotted"]["period_s"])
    rows = np.array(list(result["plotted"]["psa_m_s2"].values()))
    target = np.array(result["plotted"]["target_m_s2"], dtype=float)
    low, high = (share * suite.index["isolated_period_s"] for share in _range(suite))
    with style():
        figure = new_figure(5.2, 3.4)
        axes = figure.add_subplot()
        axes.axvspan(low, high, color="0.94", zorder=0)
        for k, row in enumerate(rows):
            axes.plot(periods, row, color="0.65", linewidth=0.6, label=None if k else "records")
        axes.plot(periods, rows.mean(axis=0), color="black", label="mean", linewidth=1.6)
        if not np.isnan(target).all():
            axes.plot(periods, target, color="#D55E00", linestyle=(0, (4, 1.2)), linewidth=1.6,
                      label="target")  # fmt: skip
        if result["target"] is not None:
            inside = np.array(result["range"]["period_s"]) > 0.0
            at = np.array(result["range"]["period_s"])[inside]
            requested = np.array(result["range"]["target_m_s2"], dtype=float)[inside]
            axes.plot(at, np.array(result["range"]["floor"])[inside] * requested, color="#0072B2",
                      linestyle=(0, (1, 1)), label="least mean by the rule")  # fmt: skip
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("period (s)")
        axes.set_ylabel("pseudo-acceleration (m/s²)")
        legend(figure, axes, "outside upper center")
    return figure


def _range(suite: Suite) -> tuple[float, float]:
    return suite.rule.low, suite.rule.high
