"""The verdicts of a diagnosis, and what each means."""

from __future__ import annotations

from typing import Literal

from .decisions import FITTED_ALONE

Verdict = Literal["adequate", "explained", "partly_explained", "unexplained"]

MEANINGS: dict[Verdict, str] = {
    "adequate": "The simulation reproduces the data within their noise: no effect is missing.",
    "explained": "The error of the simulation is explained, up to noise or a small remainder.",
    "partly_explained": "Part of the misfit is explained; a remainder is not.",
    "unexplained": "The simulation gets something wrong that none of the known causes explains.",
}
"""Each verdict in a sentence."""
FITTED_ONLY = (
    "The simulation reproduces the fitted data within their noise: no effect is missing there. "
    "It misses the data held out by more: the fitted data do not determine it there, or something "
    "acts in those held out alone."
)
"""The verdict "adequate" where the data held out are missed by far more than noise."""


def meaning(verdict: Verdict, held_out: float, noise: float) -> str:
    """A verdict in a sentence, by the held-out error before any cause and that of noise alone."""
    if verdict == "adequate" and held_out**2 > FITTED_ALONE * noise**2:
        return FITTED_ONLY
    return MEANINGS[verdict]
