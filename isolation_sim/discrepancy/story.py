"""The steps of a diagnosis in words and tables."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..effects.effect import in_sentence
from ..identification.noise import correlation_time
from .diagnosis import MEANINGS, Cause, Errors, Step, Trace, Verdict, worst_first
from .outcome import Outcome
from .selection import SIGNIFICANT


def steps(
    outcome: Outcome, causes: Sequence[Cause], verdict: Verdict, errors: Sequence[Errors]
) -> tuple[Step, ...]:
    """Tell how the outcome was reached.

    Parameters
    ----------
    outcome : Outcome
        The outcome.
    causes : sequence of Cause
        Those found.
    verdict : str
        The verdict.
    errors : sequence of Errors
        Before and after.

    Returns
    -------
    tuple of Step
    """
    told = [_data(outcome), _noise(outcome), _law(outcome, errors[0]), _evidence(outcome)]
    told += _rounds(outcome)
    told.append(_verdict(outcome, causes, verdict, errors))
    return tuple(told)


def _data(outcome: Outcome) -> Step:
    data, runs = outcome.data, outcome.campaign.runs
    held = int(np.sum(~data.fitted[data.starts[:-1]]))
    duration = float(np.sum(data.lengths * data.dt))
    text = (
        f"{len(runs)} runs, {duration:.0f} s in all, deformations up to "
        f"{1e3 * np.max(np.abs(data.x)):.3g} mm, currents {data.current.min():.3g} to "
        f"{data.current.max():.3g} A. {held} runs are held out to judge the outcome. "
    )
    text += " ".join(f"{note}." for note in outcome.notes) or "Nothing looks wrong in the data."
    return Step("The data", text)


def _noise(outcome: Outcome) -> Step:
    data = outcome.data
    own = float(np.median(data.force_noise / data.force_size))
    moved = float(np.median(data.displacement_noise)) * 1e3
    return Step(
        "The noise",
        f"By the data's own high frequencies, noise is {100 * own:.2g} % of the force in the "
        f"median run and {moved:.2g} mm in the displacement. Together they leave an error of "
        f"{100 * outcome.floor:.2f} % even of a perfect model: the noise floor.",
    )


def _law(outcome: Outcome, before: Errors) -> Step:
    base = outcome.base
    law = base.model.unknowns.law
    cost = base.cost / len(base.residual)
    search = outcome.search
    noise = search.noise_cost / len(search.noise)
    memory = correlation_time(base.residual, np.array([0, len(base.residual)]))
    how = "as given" if outcome.given is not None else "fitted to the data"
    text = (
        f"{law.title}, {how}: error {100 * before.fit:.2f} % on the fitted runs"
        + (f", {100 * before.held_out:.2f} % on those held out" if before.held_out > 0 else "")
        + f". Fitted as well as it can be, its squared residual is {cost / noise:.3g} times that "
        f"of noise, and a residual resembles its neighbours over {memory:.0f} samples."
    )
    if outcome.disturbance is not None:
        text += (
            f" A line at {outcome.disturbance.frequency:.2f} Hz that all runs share was taken out "
            "of the force first."
        )
    return Step("The law", text, figure="before")


def _evidence(outcome: Outcome) -> Step:
    rows = tuple(
        (one.text, f"{100 * max(one.share, 0):.0f} %") for one in outcome.evidence[:6]
    )
    return Step(
        "What the residual depends on",
        "A general function of each set of variables, fitted to every other half second, predicts "
        "this part of the misfit in between.",
        ("function of", "misfit predicted"),
        rows,
        figure="residual",
    )


def _rounds(outcome: Outcome) -> list[Step]:
    search, told = outcome.search, []
    noise = search.noise_cost
    n = len(search.noise)
    for k, tried in enumerate(search.rounds, start=1):
        if not tried:
            continue
        rows = []
        for one in tried[:6]:
            effect = one.model.stages[-1].effect
            rows.append((effect.title, effect.form, f"{(one.cost - noise) / n:+.4f}"))
        told.append(
            Step(
                f"Effects tried, round {k}",
                f"{len(search.effects)} forms of effects were looked at and the promising ones "
                "fitted together with the law. What each leaves of the squared residual above "
                "the noise, over that of the noise:",
                ("effect", "form", "left"),
                tuple(rows),
            )
        )
    return told


def _verdict(
    outcome: Outcome, causes: Sequence[Cause], verdict: Verdict, errors: Sequence[Errors]
) -> Step:
    text = MEANINGS[verdict]
    if causes:
        before, after = errors
        text += (
            f" The error falls from {100 * before.fit:.2f} to {100 * after.fit:.2f} % on the "
            "fitted runs"
        )
        if after.held_out > 0:
            text += (
                f" and from {100 * before.held_out:.2f} to {100 * after.held_out:.2f} % on those "
                "held out"
            )
        text += f"; noise alone leaves {100 * outcome.floor:.2f} %."
    else:
        text += (
            " No effect lowered the squared residual by more than "
            f"{SIGNIFICANT:.0f} times the noise's share of it."
        )
    return Step("The verdict", text, figure="after" if causes else "")


def evidence(outcome: Outcome, place: int, share: float, cost_without: float) -> str:
    """Say in a sentence what speaks for a cause.

    Parameters
    ----------
    outcome : Outcome
        The outcome.
    place : int
        Of the effect in the final model.
    share : float
        Of the misfit that it removes.
    cost_without : float
        Cost without it, on the samples on which it is judged.

    Returns
    -------
    str
    """
    final = outcome.final
    count = int(np.sum(outcome.chosen))
    effect = final.model.stages[place].effect
    where = "held out" if not outcome.data.fitted.all() else "fitted"
    ratio = np.sqrt(cost_without / max(final.cost_of(outcome.chosen), 1e-300))
    numbers = ", ".join(
        f"{quantity.meaning} {value:.3g} {quantity.unit}".rstrip(" 1")
        for quantity, value in zip(
            effect.parameters, final.parameters(place).values(), strict=True
        )
    )
    # a law that leans on what is taken away may fail without it
    larger = (
        f"is {ratio:.3g} times as large" if np.isfinite(ratio) else "cannot be told: the law fails"
    )
    return (
        f"Without {in_sentence(effect.title)} the residual on the {count} samples {where} "
        f"{larger}; it removes {100 * share:.0f} % of the misfit with {numbers}."
    )


def traces(outcome: Outcome) -> tuple[Trace, ...]:
    """Runs as measured and simulated, to draw.

    Parameters
    ----------
    outcome : Outcome
        The outcome.

    Returns
    -------
    tuple of Trace
        Those with the largest errors before first.
    """
    data, before, after = outcome.data, outcome.before, outcome.after
    found = []
    for name, dt, run in zip(data.names, data.dt, data.runs, strict=True):
        found.append(
            Trace(
                name=name,
                held_out=not bool(data.fitted[run.start]),
                time=np.arange(run.stop - run.start) * dt,
                across=1e3 * data.x[run],
                across_label="deformation, mm",
                label="force, N",
                measured=data.force[run],
                before=before[run],
                after=after[run],
            )
        )
    return worst_first(found)
