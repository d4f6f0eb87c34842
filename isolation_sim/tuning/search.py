"""The search: CMA-ES over the settings in their normalised ranges; known scores are repeated."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..search_range import SearchRange

FIRST_STEP = 0.25
"""Standard deviation of the first generation, as a share of each range."""
_MARGIN = 0.05
"""How far from the bounds the first generation's mean stays, as a share of each range."""
_FEWEST = 8
"""Candidates of a generation at least: few settings are searched in few generations then."""

Settings = dict[str, float]


class Trial(NamedTuple):
    """A candidate and its score under each motion; no settings: as the controller is."""

    settings: Settings
    scores: list[float]

    @property
    def mean(self) -> float:
        """Mean score."""
        return float(np.mean(self.scores))


def search(
    ranges: Mapping[str, SearchRange],
    start: Mapping[str, Any],
    evaluate: Callable[[Sequence[Settings]], NDArray],
    evaluations: int,
    seed: int,
    known: Sequence[Trial],
    save: Callable[[list[Trial]], None],
) -> list[Trial]:
    """Minimise the mean score, the controller as it is first.

    Covariance matrix adaptation, restarted anywhere with twice the population when it has
    converged. Its state is not stored: its proposals follow from the seed and from the scores that
    it received, so that repeating the known ones leads to the same state, to the last bit.

    References
    ----------
    Hansen 2016, The CMA evolution strategy: a tutorial; Auger and Hansen 2005 (restarts with
    increasing population).
    """
    from cmaes import CMA

    n = len(ranges)
    trials: list[Trial] = []
    restarts = np.random.default_rng(seed)
    size = max(_FEWEST, 4 + math.floor(3 * math.log(n)))
    mean = np.array([ranges[name].place(start[name]) for name in ranges])
    mean = np.clip(mean, _MARGIN, 1 - _MARGIN)

    def generation(candidates: list[Settings]) -> list[Trial]:
        """Look candidates up or evaluate them."""
        old = list(known[len(trials) : len(trials) + len(candidates)])
        if [trial.settings for trial in old] != candidates[: len(old)]:
            raise InputError(
                "the saved trials are not those of this search; expected: the version of cmaes "
                "that began it, or another folder"
            )
        new = candidates[len(old) :]
        if new:
            old += map(Trial, new, evaluate(new).tolist())
        trials.extend(old)
        if new:
            save(trials)
        return old

    def new_search() -> Any:
        return CMA(mean, FIRST_STEP, seed=seed, population_size=size)

    generation([{}])
    optimiser = new_search()
    while len(trials) + size <= evaluations:
        places = [optimiser.ask() for _ in range(size)]
        inside = np.clip(places, 0.0, 1.0)
        candidates = [
            {name: ranges[name].value(x) for name, x in zip(ranges, place, strict=True)}
            for place in inside.tolist()
        ]
        # what is outside counts as the nearest bound, and as worse the further out it is
        excess = np.sum(np.square(places - inside), axis=1)
        outcomes = zip(places, generation(candidates), excess.tolist(), strict=True)
        optimiser.tell([(place, trial.mean + out) for place, trial, out in outcomes])
        if optimiser.should_stop():
            size, mean = 2 * size, restarts.random(n)
            optimiser = new_search()
    return trials
