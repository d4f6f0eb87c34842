"""Laws fitted to a measured MR fluid damper, evaluated on held-out tests.

Run it with ``python -m studies.damper [FOLDER]``; the folder is the campaign ``mr_damper`` of the
shared data by default. Each law is fitted jointly to all currents, its parameters polynomials of
the current; then again without one condition (amplitude and frequency) at a time, and without one
current at a time. Each fit is evaluated on the runs that were left out. Table, verdict and figure
go to the terminal and to ``results/damper``.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from isolation_sim.identification.campaign import Campaign, TestRun, read_campaign
from isolation_sim.identification.fit import fit
from isolation_sim.identification.fitted import Fit, RunError, pooled

from .study import data_folder

DATA = "mr_damper"
"""Folder of the campaign in the shared data."""
RESULTS = Path("results/damper")

LAWS = ("bouc_wen", "improved_bouc_wen", "lugre")
"""Laws to fit; the last, friction whose bristles are damped, is our choice."""
EVERYTHING = "nothing"
SLOW = 0.2
"""Share of a run's peak speed below which a sample counts as near reversal."""
_CYCLES, _SAMPLES_A_CYCLE = 8, 100


@dataclass(frozen=True)
class Outcome:
    """One law's fits by what they were not shown."""

    law: str  # Name
    fits: dict[str, Fit]  # By what was left out; ``EVERYTHING`` is the fit to all runs

    def left_out(self, label: str) -> float:
        """Relative error of the runs that the fit has not seen."""
        return self.fits[label].held_out_error

    def unseen(self, labels: Sequence[str]) -> list[RunError]:
        """Errors of all runs, each by the fit that has not seen it."""
        return [e for label in labels for e in self.fits[label].errors if e.run.hold_out]


def condition(run: TestRun) -> str:
    """Amplitude and frequency of a run, as its name gives them."""
    return run.name.rpartition("_")[0]


def current(run: TestRun) -> str:
    """Current of a run, as its name gives it."""
    return run.name.rpartition("_")[2].removesuffix("A") + " A"


def shorten(run: TestRun, cycles: int = _CYCLES, samples: int = _SAMPLES_A_CYCLE) -> TestRun:
    """Keep the first cycles of a run, at about so many samples a cycle if it has more."""
    result = re.search(r"_([\d.]+)Hz", run.name)
    assert result is not None
    a_cycle = 1 / (float(result[1]) * run.step)
    every = max(int(a_cycle / samples), 1)
    keep = slice(0, int(cycles * a_cycle), every)
    names = ("time", "displacement", "velocity", "force", "current")
    return replace(run, **{name: getattr(run, name)[keep] for name in names})


def read_shortened(
    folder: Path, cycles: int = _CYCLES, samples: int = _SAMPLES_A_CYCLE
) -> Campaign:
    """Read the campaign and shorten its runs, so that each condition counts about the same."""
    campaign = read_campaign(folder)
    return replace(campaign, runs=tuple(shorten(run, cycles, samples) for run in campaign.runs))


def without(campaign: Campaign, label: str) -> Campaign:
    """Hold the runs of a condition or of a current out."""
    runs = [replace(r, hold_out=label in (condition(r), current(r))) for r in campaign.runs]
    return replace(campaign, runs=tuple(runs))


def conditions(campaign: Campaign) -> list[str]:
    """Conditions of a campaign, the slowest first."""
    speed = {condition(r): float(np.abs(r.velocity).max()) for r in campaign.runs}
    return sorted(speed, key=lambda label: speed[label])


def currents(campaign: Campaign) -> list[str]:
    """Currents of a campaign, the lowest first."""
    return sorted({current(r) for r in campaign.runs}, key=lambda label: float(label.split()[0]))


def fit_laws(
    campaign: Campaign,
    labels: Sequence[str],
    laws: Sequence[str] = LAWS,
    **options: Any,
) -> list[Outcome]:
    """Fit every law to everything and without each label."""
    outcomes = []
    for name in laws:
        fits = {}
        for label in (EVERYTHING, *labels):
            shown = campaign if label == EVERYTHING else without(campaign, label)
            fits[label] = fit(shown, name, **options)
        outcomes.append(Outcome(name, fits))
    return outcomes


def table(outcomes: Sequence[Outcome], labels: Sequence[str]) -> Table:
    """Errors of fitted and of left-out runs, one line per law and what it was not shown."""
    result = Table(title="Force residual over measured force (RMS), %")
    result.add_column("left out")
    for outcome in outcomes:
        result.add_column(f"{outcome.law}\nfitted", justify="right")
        result.add_column("\nleft out", justify="right")
    for label in (EVERYTHING, *labels):
        cells = []
        for outcome in outcomes:
            cells.append(_percent(outcome.fits[label].error))
            cells.append("" if label == EVERYTHING else _percent(outcome.left_out(label)))
        result.add_row(label, *cells)
    return result


def _percent(share: float) -> str:
    return f"{100 * share:.1f}" if np.isfinite(share) else "not finite"


def verdict(
    outcomes: Sequence[Outcome], by_condition: Sequence[str], by_current: Sequence[str]
) -> str:
    """Say which law wins on runs not seen and where it gains, from the numbers alone."""
    unseen = {o.law: pooled(o.unseen(by_condition)) for o in outcomes}
    ranked = sorted(outcomes, key=lambda o: unseen[o.law])
    best, others = ranked[0], ranked[1:]
    text = [
        f"On conditions left out {best.law} has the smallest error, "
        f"{_percent(unseen[best.law])} %"
        + "".join(f"; {o.law} has {_percent(unseen[o.law])} %" for o in others)
        + " (fitted to everything: "
        + ", ".join(f"{o.law} {_percent(o.fits[EVERYTHING].error)} %" for o in ranked)
        + ")."
    ]
    for other in others:
        text.append(_gain(best, other, by_condition))
    if len(by_condition) > 1:
        text.append(_trend(outcomes, by_condition))
    numbers = {o.law: len(o.fits[EVERYTHING].estimates) for o in ranked}
    open_ = {o.law: sum(not e.determined for e in o.fits[EVERYTHING].estimates) for o in ranked}
    text.append(
        "Numbers fitted, of which the data leave open: "
        + ", ".join(f"{law} {numbers[law]}, {open_[law]}" for law in numbers)
        + "."
    )
    if by_current:
        lines = []
        for label in by_current:
            errors = {o.law: o.left_out(label) for o in outcomes}
            finite = {law: e for law, e in errors.items() if np.isfinite(e)}
            if finite:
                least = min(finite, key=lambda law: finite[law])
                lines.append(f"{label}: {least} {_percent(finite[least])} %")
        text.append(
            "On a current left out the least errors are " + ", ".join(lines) + ": with two "
            "currents left the parameters are straight lines, within which the middle current is "
            "interpolated and beyond which the others are guessed."
        )
        beyond = [
            f"{o.law} at {c}" for o in outcomes for c in by_current
            if not np.isfinite(o.left_out(c))
        ]  # fmt: skip
        if beyond:
            text.append(
                f"Not finite: {', '.join(beyond)}; there the lines leave what the law admits."
            )
    return "\n".join(text)


def _trend(outcomes: Sequence[Outcome], labels: Sequence[str]) -> str:
    """Size of the modelled force over the measured one, at the slowest and the fastest condition.

    What all laws get wrong alike, none of them describes.
    """
    said, signs = [], []
    for label in (labels[0], labels[-1]):
        excess = {}
        for outcome in outcomes:
            errors = outcome.unseen([label])
            product = sum(float(e.force @ e.run.force) for e in errors)
            excess[outcome.law] = (
                product / sum(float(e.run.force @ e.run.force) for e in errors) - 1
            )
        said.append(", ".join(f"{law} {100 * e:+.0f} %" for law, e in excess.items()))
        signs.append({e > 0 for e in excess.values()})
    text = (
        f"Not seen, the force is off in size by {said[0]} at {labels[0]}, the slowest, and by "
        f"{said[1]} at {labels[-1]}, the fastest"
    )
    if signs == [{False}, {True}]:
        return text + ": with speed the measured force grows less than in any of these laws."
    return text + "."


def _gain(best: Outcome, other: Outcome, labels: Sequence[str]) -> str:
    """Where the best law gains on another: at which condition, and how near reversal."""
    gains, slow_part = dict.fromkeys(labels, 0.0), 0.0
    for a, b in zip(best.unseen(labels), other.unseen(labels), strict=True):
        gain = (b.force - b.run.force) ** 2 - (a.force - a.run.force) ** 2
        gains[condition(a.run)] += float(gain.sum())
        slow = np.abs(a.run.velocity) < SLOW * np.abs(a.run.velocity).max()
        slow_part += float(gain[slow].sum())
    total = sum(gains.values())
    most = max(gains, key=lambda label: gains[label])
    worse = [label for label in labels if gains[label] < 0]
    text = (
        f"Of the squared residual that {other.law} has more, {100 * gains[most] / total:.0f} % is "
        f"at {most} and {100 * slow_part / total:.0f} % below {SLOW:g} of the peak speed, near "
        "reversal, where the shape of the turn decides"
    )
    return text + (f"; it is the better one at {', '.join(worse)}." if worse else ".")


def figure(outcomes: Sequence[Outcome], labels: Sequence[str]) -> Any:
    """Draw loops of runs at the highest current, measured and by fits that have not seen them."""
    import matplotlib.pyplot as plt

    from isolation_sim.reports.style import DOUBLE_COLUMN, legend, style

    with style():
        fig, axes = plt.subplots(
            2, len(labels), figsize=(DOUBLE_COLUMN, 4.4), squeeze=False, sharey="col"
        )
        for column, label in enumerate(labels):
            for number, outcome in enumerate(outcomes):
                error = [e for e in outcome.fits[label].errors if e.run.hold_out][-1]
                run, size = error.run, len(error.run.time)
                last = slice(size // 2, size)
                paths = (1e3 * run.displacement[last], 1e3 * run.velocity[last])
                for axis, path in zip(axes[:, column], paths, strict=True):
                    if number == 0:
                        axis.plot(path, run.force[last], color="0.75", lw=2.5, label="measured")
                    axis.plot(path, error.force[last], lw=0.9, label=outcome.law)
            axes[0, column].set_title(f"{run.name}, not seen")
            axes[0, column].set_xlabel("displacement, mm")
            axes[1, column].set_xlabel("velocity, mm/s")
        for axis in axes[:, 0]:
            axis.set_ylabel("force, N")
        legend(fig, axes[0, 0], "outside upper center")
    return fig


def main(folder: Path | None = None, results: Path = RESULTS, **options: Any) -> str:
    """Run the study."""
    campaign = read_shortened(folder or data_folder(DATA))
    by_condition, by_current = conditions(campaign), currents(campaign)
    outcomes = fit_laws(campaign, [*by_condition, *by_current], **options)
    errors = table(outcomes, [*by_condition, *by_current])
    said = verdict(outcomes, by_condition, by_current)
    console = Console(width=100)
    console.print(errors)
    console.print(said)
    results.mkdir(parents=True, exist_ok=True)
    with (results / "damper.txt").open("w", encoding="utf-8") as file:
        to_file = Console(file=file, width=100)
        to_file.print(errors)
        to_file.print(said)
    fig = figure(outcomes, [by_condition[0], by_condition[-3], by_condition[-1]])
    fig.savefig(results / "loops_not_seen.png", dpi=200)
    console.print(f"written to {results}")
    return said


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:2]), starts=8)
