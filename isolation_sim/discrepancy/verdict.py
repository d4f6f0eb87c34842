"""The verdicts of a diagnosis, and what each means."""

from __future__ import annotations

from typing import Literal

from .decisions import FITTED_ALONE, MOSTLY_NOISE, NEARLY_ALL

Verdict = Literal["adequate", "explained", "partly_explained", "unexplained"]

MEANINGS: dict[Verdict, str] = {
    "adequate": "The simulation reproduces the data within their noise: no effect is missing.",
    "explained": "The error of the simulation is explained, up to noise or a small remainder.",
    "partly_explained": "Part of the misfit is explained; a remainder is not.",
    "unexplained": "The simulation gets something wrong that none of the known causes explains.",
}
"""Each verdict in a sentence."""
NEARLY = "Nearly all of the misfit is explained. The small remainder is more than noise."
"""The verdict "partly explained" where the causes leave little."""
NEARLY_ALIKE = (
    "Nearly all of the misfit is explained, but in part by what only acts like a cause of the "
    "catalogue, or is none."
)
"""The same where not each of the causes is named without doubt."""
FITTED_ONLY = (
    "The simulation reproduces the fitted data within their noise: no effect is missing there. "
    "It misses the data held out by more: the fitted data do not determine it there, or something "
    "acts in those held out alone."
)
"""The verdict "adequate" where the data held out are missed by far more than noise."""
NOISY = (
    "The simulation reproduces the data within their noise, which is {:.0f} % of the signal: they "
    "can hardly show a missing effect."
)
"""The verdict "adequate" of data that are mostly noise."""
NOT_MEASURED = (
    "The simulation misses more than the noise of the instruments, and no model of the measured "
    "variables misses less. The remainder is slow noise, such as a drift, or depends on something "
    "that was not measured."
)
"""The verdict "unexplained" where a flexible model of the measured variables gains nothing."""


UNPREDICTED = (
    "The simulation misses more than the noise of the instruments. No function of the measured "
    "variables predicts the remainder, and no effect holds on data held out: it may be slow noise, "
    "such as a drift, or depend on something that was not measured."
)
"""The verdict "unexplained" where the residual analysis predicts nothing."""
NOTHING_PREDICTS = "nothing_predicts"
"""Detail of a diagnosis whose residual analysis predicts nothing."""


def meaning(
    verdict: Verdict, held_out: float, noise: float, left: float, named: bool,
    not_measured: float = float("nan"), unpredicted: bool = False,
) -> str:  # fmt: skip
    """A verdict in a sentence."""
    # By the held-out error before any cause, that of noise alone, the share of the misfit that the
    # causes leave, whether each is named without doubt, and the share that no measured variable
    # explains, if the tiers have shown it, or whether the residual analysis predicts nothing.
    if verdict == "unexplained" and not_measured > 1 - NEARLY_ALL:
        return NOT_MEASURED
    if verdict == "unexplained" and unpredicted:
        return UNPREDICTED
    if verdict == "partly_explained" and left < NEARLY_ALL:
        return NEARLY if named else NEARLY_ALIKE
    if verdict == "adequate" and held_out**2 > FITTED_ALONE * noise**2:
        return FITTED_ONLY
    if verdict == "adequate" and noise > MOSTLY_NOISE:
        return NOISY.format(100 * noise)
    return MEANINGS[verdict]
