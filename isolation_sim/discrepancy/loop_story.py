"""The diagnosis of a loop table in words, tables and loops to draw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..identification.least_squares import Optimum
from ..laws.law import Law
from .diagnosis import MEANINGS, Step, Trace, Verdict
from .loop_model import ACCURACY, CYCLES, SAMPLES, LoopModel
from .loop_table import LoopTable


@dataclass(frozen=True, eq=False)
class FittedLoops:
    """A model that fits a loop table best.

    Attributes
    ----------
    model : LoopModel
        The model.
    optimum : Optimum
        Its fit.
    left_out : float
        RMS of the relative errors on rows left out of the fit.
    others : tuple of (n_unknowns,) array
        Other numbers of the law that were nearly as good without effects.
    """

    model: LoopModel
    optimum: Optimum
    left_out: float
    others: tuple[NDArray, ...] = ()

    @property
    def causes(self) -> tuple[str, ...]:
        """Causes that the model has."""
        return tuple(stage.effect.cause for stage in self.model.stages)


Round = tuple[FittedLoops, list[FittedLoops]]
"""A model and what was tried around it, the best first."""


def depends_on(table: LoopTable, before: NDArray) -> tuple[str, ...]:
    """Find the conditions that the errors go with.

    Parameters
    ----------
    table : LoopTable
        Measured loops.
    before : (2 n_rows,) array
        Modelled over measured stiffness, then damping.

    Returns
    -------
    tuple of str
        Those with a rank correlation above 0.5 with the one or the other.
    """
    from scipy.stats import spearmanr

    found = []
    n = len(table.amplitude)
    for name, values in (
        ("amplitude", table.amplitude),
        ("frequency", table.frequency),
        ("current", table.current),
    ):
        if np.ptp(values) > 0:
            ratios = [r for r in (before[:n], before[n:]) if np.ptp(r) > 0]
            if any(abs(spearmanr(values, r)[0]) > 0.5 for r in ratios):
                found.append(name)
    return tuple(found)


def steps(
    table: LoopTable, law: Law, base: FittedLoops, given: NDArray | None, before: NDArray,
    after: NDArray, rounds: Sequence[Round], verdict: Verdict,
) -> tuple[Step, ...]:  # fmt: skip
    """Tell how the outcome was reached.

    Parameters
    ----------
    table : LoopTable
        Measured loops.
    law : Law
        The law that was judged.
    base : FittedLoops
        It, fitted.
    given : (n_unknowns,) array or None
        Its numbers, if it was not to be fitted.
    before, after : (2 n_rows,) array
        Modelled over measured stiffness, then damping.
    rounds : sequence of Round
        What was tried, round by round.
    verdict : str
        The verdict.

    Returns
    -------
    tuple of Step
    """
    n = len(table.amplitude)
    how = "as given" if given is not None else "fitted"
    refit = "" if given is None else (
        " Fitted to the table it errs by "
        f"{100 * rms(base.model.loops(base.optimum.x)[0] - 1):.1f} %."
    )
    told = [
        Step(
            "The data",
            f"{n} loops, amplitudes {1e3 * table.amplitude.min():g} to "
            f"{1e3 * table.amplitude.max():g} mm, {table.frequency.min():g} to "
            f"{table.frequency.max():g} Hz, {table.current.min():g} to {table.current.max():g} "
            f"A. A table does not tell its noise; {100 * ACCURACY:.0f} % counts as agreement.",
        ),
        Step(
            "The law",
            f"{law.title}, {how}: stiffness wrong by {100 * rms(before[:n] - 1):.1f} %, "
            f"damping by {100 * rms(before[n:] - 1):.1f} % (RMS).{refit} On rows left out of "
            f"its fit it errs by {100 * base.left_out:.1f} %.",
        ),
    ]
    for k, (_, tried) in enumerate(rounds, start=1):
        told.append(
            Step(
                f"Effects tried, round {k}",
                "The effects that fit best, judged on rows left out:",
                ("effect", "form", "error on rows left out"),
                tuple(
                    (f.model.stages[-1].effect.title, f.model.stages[-1].effect.form,
                     f"{100 * f.left_out:.1f} %")
                    for f in tried
                ),
            )
        )  # fmt: skip
    told.append(
        Step(
            "The verdict",
            f"{MEANINGS[verdict]} After: stiffness wrong by {100 * rms(after[:n] - 1):.1f} %, "
            f"damping by {100 * rms(after[n:] - 1):.1f} % (RMS).",
        )
    )
    return tuple(told)


def traces(
    table: LoopTable, base: FittedLoops, start: NDArray, best: FittedLoops
) -> tuple[Trace, ...]:
    """Draw simulated loops; of the measured ones the table keeps only ellipses.

    Parameters
    ----------
    table : LoopTable
        Measured loops.
    base, best : FittedLoops
        The law, and the law with the effects found.
    start : (n_unknowns,) array
        The law's numbers before.

    Returns
    -------
    tuple of Trace
    """
    data = base.model.data
    before = base.model.forces(start, False)[0]
    after = best.model.forces(best.optimum.x, False)[0]
    found = []
    for k in range(len(table.amplitude)):
        end = (k + 1) * CYCLES * SAMPLES
        at = slice(end - SAMPLES, end)
        phase = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
        # the ellipse of the same stiffness and energy
        measured = table.stiffness[k] * table.amplitude[k] * (
            np.sin(phase) + 2 * table.damping[k] * np.cos(phase)
        )
        found.append(
            Trace(
                name=(
                    f"{1e3 * table.amplitude[k]:g} mm, {table.frequency[k]:g} Hz, "
                    f"{table.current[k]:g} A"
                ),
                held_out=bool(table.held_out[k]),
                time=np.arange(SAMPLES) * data.dt[k],
                across=1e3 * data.x[at],
                across_label="deformation, mm",
                label="force, N",
                measured=measured,
                before=before[at],
                after=after[at],
            )
        )
    return tuple(found)


def rms(values: NDArray) -> float:
    """Root mean square.

    Parameters
    ----------
    values : array
        Values.

    Returns
    -------
    float
        Infinite where a value is no number.
    """
    size = float(np.sqrt(np.mean(values**2)))
    return size if np.isfinite(size) else np.inf


def largest(ratios: NDArray) -> dict[str, float]:
    """Largest relative errors.

    Parameters
    ----------
    ratios : (2 n_rows,) array
        Modelled over measured stiffness, then damping.

    Returns
    -------
    dict of str to float
        Of stiffness and damping.
    """
    n = len(ratios) // 2
    return {
        "stiffness": float(np.max(np.abs(ratios[:n] - 1))),
        "damping": float(np.max(np.abs(ratios[n:] - 1))),
    }
