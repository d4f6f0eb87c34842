"""The search: CMA-ES over the settings, scaled to their ranges; known scores are reused."""

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
"""Least distance of the first generation's mean from the bounds, as a share of each range."""
_FEWEST = 8
"""Least number of candidates per generation; few settings then need few generations."""

Settings = dict[str, float]


class Trial(NamedTuple):
    """A candidate and its score on each motion; without settings it is the initial controller."""

    settings: Settings
    scores: list[float]

    @property
    def mean(self) -> float:
        """Mean score."""
        return float(np.mean(self.scores))


def generation_size(n_settings: int) -> int:
    """Candidates of the first generation."""
    return max(_FEWEST, 4 + math.floor(3 * math.log(n_settings)))


def search(
    ranges: Mapping[str, SearchRange],
    start: Mapping[str, Any],
    evaluate: Callable[[Sequence[Settings]], NDArray],
    evaluations: int,
    seed: int,
    known: Sequence[Trial],
    save: Callable[[list[Trial]], None],
) -> list[Trial]:
    """Minimise the mean score; the first candidate is the initial controller.

    Covariance matrix adaptation. After convergence it restarts at a random place with twice the
    population. Its state is not stored: the candidates depend only on the seed and the earlier
    scores. Repeating the search with the saved scores gives the same state, to the last bit.

    References
    ----------
    Hansen 2016, The CMA evolution strategy: a tutorial; Auger and Hansen 2005 (restarts with
    increasing population).
    """
    from cmaes import CMA

    n = len(ranges)
    trials: list[Trial] = []
    restarts = np.random.default_rng(seed)
    size = generation_size(n)
    mean = np.array([ranges[name].place(start[name]) for name in ranges])
    mean = np.clip(mean, _MARGIN, 1 - _MARGIN)

    def generation(candidates: list[Settings]) -> list[Trial]:
        """Return saved scores of candidates, or evaluate them."""
        old = list(known[len(trials) : len(trials) + len(candidates)])
        if [trial.settings for trial in old] != candidates[: len(old)]:
            raise InputError(
                "the saved trials do not belong to this search; expected: the version of cmaes "
                "at its start, or another folder"
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
        # a point outside is evaluated at the nearest bound, plus a penalty for its distance
        excess = np.sum(np.square(places - inside), axis=1)
        outcomes = zip(places, generation(candidates), excess.tolist(), strict=True)
        optimiser.tell([(place, trial.mean + out) for place, trial, out in outcomes])
        if optimiser.should_stop():
            size, mean = 2 * size, restarts.random(n)
            optimiser = new_search()
    return trials
