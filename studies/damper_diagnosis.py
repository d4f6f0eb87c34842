"""Which law describes a measured MR damper, and which effects it lacks.

Eighteen sinusoidal tests (``mr_damper`` of the shared data): six conditions of amplitude and
frequency at three currents. The conventional Bouc-Wen law is fitted, all laws are compared, and the
best one is diagnosed. Parameters follow the current linearly. This is done twice: without the runs
of one condition, and without those of one current; what was left out validates.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.discrepancy.diagnosis import Diagnosis, Trace, relative_error
from isolation_sim.identification.fit import fit
from isolation_sim.identification.fitted import Fit

from .damper import DATA, read_shortened, without
from .study import Outcome, Step, data_folder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLE = "Which law describes a measured MR damper, and what it lacks"
LAW = "bouc_wen"
LEFT_OUT = {"10mm_1Hz": "10 mm, 1 Hz", "0.5 A": "0.5 A"}
"""A condition and a current, each left out once."""
DEGREE = 1
"""Of the parameters' polynomials of the current: with one current left out there are two."""
CYCLES, SAMPLES = 4, 50
"""Cycles of each test and samples a cycle, at most: the loops repeat themselves."""
STARTS = 20
"""Starts of the fit of the Bouc-Wen law."""
SHORT_CYCLES, SHORT_SAMPLES, SHORT_STARTS = 2, 40, 6


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    cycles, samples = (SHORT_CYCLES, SHORT_SAMPLES) if short else (CYCLES, SAMPLES)
    campaign = read_shortened(data_folder(DATA), cycles, samples)
    labels = list(LEFT_OUT)[:1] if short else list(LEFT_OUT)
    result = {}
    for label in labels:
        step(f"diagnosing without {LEFT_OUT[label]}", 0.0)
        shown = without(campaign, label)
        starts = SHORT_STARTS if short else STARTS
        alone = fit(shown, LAW, current_degree=DEGREE, starts=starts)
        diagnosis = diagnose(shown, "auto", current_degree=DEGREE, tiers="causes")
        diagnosis.save(folder / f"diagnosis_without_{label.replace(' ', '')}")
        result[label] = HeldOutResult(alone, diagnosis)
        step(f"diagnosing without {LEFT_OUT[label]}", 1 / len(labels))
    table = [row for label, fits in result.items() for row in _rows(label, fits)]
    return Outcome(table, _finding(result), {"loops": _figure(result)})


@dataclass(frozen=True)
class HeldOutResult:
    """Fit and diagnosis without some of the runs."""

    alone: Fit  # The Bouc-Wen law
    diagnosis: Diagnosis  # Of the law that fits best

    def force(self, trace: Trace) -> NDArray:
        """Force of the Bouc-Wen law in a run, (n,), N."""
        return next(e.force for e in self.alone.errors if e.run.name == trace.name)


def _rows(label: str, fits: HeldOutResult) -> list[dict[str, Any]]:
    return [
        {
            "left out": LEFT_OUT[label], "run": trace.name,
            "used": "left out" if trace.held_out else "fitted",
            "Bouc-Wen, RMS error %": 100 * relative_error(trace, fits.force(trace)),
            "best law, %": 100 * relative_error(trace, trace.before),
            "extended, %": 100 * relative_error(trace, trace.after),
        }
        for trace in sorted(fits.diagnosis.traces, key=lambda trace: not trace.held_out)
    ]  # fmt: skip


def _finding(result: dict[str, HeldOutResult]) -> str:
    sentences = []
    for label, fits in result.items():
        one, alone = fits.diagnosis, fits.alone
        named = "; ".join(
            cause.label
            + (f" ({cause.form})" if cause.form else "")
            + f" with {100 * cause.share:.0f} % of the squared misfit"
            + (f", hardly to be distinguished from {', '.join(cause.confusable_with)}"
               if cause.confusable_with else "")
            for cause in one.causes
        )  # fmt: skip
        before, after = one.error_before, one.error_after
        choice = one.details["law_choice"]["text"]
        sentences.append(
            f"Without {LEFT_OUT[label]}, the fitted Bouc-Wen law misses the force by "
            f"{100 * alone.error:.1f} %, and by {100 * alone.held_out_error:.1f} % in the runs "
            f"left out (noise alone {100 * one.noise_floor:.2g} %). {choice} "
            f"Fitted to all of these data, it misses the force by {100 * before.fit:.1f} %, and by "
            f"{100 * before.held_out:.1f} % in the runs left out. "
        )
        sentences[-1] += (
            f"{one.verdict.replace('_', ' ').capitalize()} by {named}: extended it misses them by "
            f"{100 * after.fit:.1f} and {100 * after.held_out:.1f} %."
            if named
            else "No effect of the catalogue removes enough of that to be named."
        )
    return "\n".join(sentences)


def _figure(result: dict[str, HeldOutResult]) -> Figure:
    from isolation_sim.reports.style import DOUBLE_COLUMN, legend, new_figure, style

    drawn = [(one, trace) for one in result.values() for trace in _left_out(one.diagnosis)]
    rows = len(result)
    across = -(-len(drawn) // rows)
    with style():
        figure = new_figure(DOUBLE_COLUMN, 0.5 + 2.1 * rows)
        panels = figure.subplots(rows, across, squeeze=False)
        for axes, (fits, trace) in zip(panels.ravel(), drawn, strict=True):
            for name, values, look in (
                ("measured", trace.measured, {"color": "#9a9a9a", "linewidth": 1.6}),
                ("Bouc-Wen", fits.force(trace), {"color": "#D55E00", "linestyle": "--"}),
                ("best law, extended", trace.after, {"color": "#000000", "linewidth": 0.8}),
            ):
                axes.plot(trace.across, 1e-3 * values, label=name, **look)
            words = re.sub(r"([\d.]+)([A-Za-z]+)", r"\1 \2", trace.name).replace("_", ", ")
            axes.set(title=words, xlabel="displacement, mm")
        for row in panels:
            row[0].set_ylabel("force, kN")
        legend(figure, panels[0, 0], "outside upper center")
    return figure


def _left_out(diagnosis: Diagnosis, most: int = 3) -> Sequence[Trace]:
    """Runs left out: slow, middle and fast."""
    runs = sorted(
        (trace for trace in diagnosis.traces if trace.held_out),
        key=lambda trace: float(np.ptp(trace.measured)),
    )
    chosen = np.unique(np.linspace(0, len(runs) - 1, most).round().astype(int))
    return [runs[k] for k in chosen]
