"""The report steps of a diagnosis, the same for every kind of data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .diagnosis import Cause, Errors, Step
from .problem import Evaluation, Problem
from .residuals import Dependence
from .search import H, SearchResult
from .verdict import NOTHING_PREDICTS, Verdict, meaning

DEPENDENCE = "Dependence of the residual"
"""Title of the step of the residual analysis."""
_SHOWN = 6


def report_steps(
    problem: Problem[H], result: SearchResult[H], dependences: Sequence[Dependence],
    evaluation: Evaluation, causes: Sequence[Cause], verdict: Verdict,
) -> tuple[Step, ...]:  # fmt: skip
    """Describe how a diagnosis was reached."""
    choice = problem.choice_text()
    steps = [
        Step("Data", *problem.data_text()),
        Step("Noise floor", *problem.noise_text()),
        *([] if choice is None else [Step("Which law", *choice)]),
        Step("Nominal model", *problem.model_text(evaluation), figure="before"),
        _dependence_step(dependences),
    ]
    for number, tried in enumerate(result.rounds, start=1):
        if tried.tried:
            shown = problem.trials_text(replace(tried, tried=tried.tried[:_SHOWN]))
            steps.append(Step(f"Candidates, round {number}", *shown))
    return (*steps, _verdict_step(problem, result, evaluation, causes, verdict))


def _dependence_step(dependences: Sequence[Dependence]) -> Step:
    tested = any(np.isfinite(one.p_value) for one in dependences)
    rows = tuple(
        (one.text, f"{100 * max(one.share, 0):.0f} %") + ((f"{one.p_value:.1e}",) * tested)
        for one in dependences[:_SHOWN]
    )
    if not dependences:
        return Step(DEPENDENCE, "The residual is no larger than noise: it depends on nothing.")
    return Step(
        DEPENDENCE,
        "Share of the misfit that a general function of each set of variables predicts.",
        ("function of", "misfit predicted") + ("p",) * tested,
        rows,
        figure="residual",
    )


def _verdict_step(
    problem: Problem[H], result: SearchResult[H], evaluation: Evaluation, causes: Sequence[Cause],
    verdict: Verdict,
) -> Step:  # fmt: skip
    before, noise = evaluation.before.held_out, evaluation.noise.held_out
    named = all(cause.is_named for cause in causes)
    unpredicted = NOTHING_PREDICTS in evaluation.details
    left = evaluation.unexplained
    sentences = [meaning(verdict, before, noise, left, named, unpredicted=unpredicted)]
    if causes:
        change = _change(evaluation.before, evaluation.after)
        fitted = evaluation.noise.fit
        alone = f"; noise alone leaves {100 * fitted:.2f}"
        if evaluation.after.held_out > 0:
            alone += f" and {100 * noise:.2f}"
        sentences.append(change + (f"{alone} %." if np.isfinite(fitted) else "."))
    text, headings, rows = problem.outcome_text(result, evaluation, causes)
    return Step(
        "Verdict", " ".join([*sentences, text]).strip(), headings, rows,
        figure="after" if causes else "",
    )  # fmt: skip


def _change(before: Errors, after: Errors) -> str:
    text = f"The error falls from {100 * before.fit:.2f} to {100 * after.fit:.2f} % on fitted data"
    if after.held_out > 0:
        text += (
            f" and from {100 * before.held_out:.2f} to {100 * after.held_out:.2f} % on data "
            "held out"
        )
    return text
