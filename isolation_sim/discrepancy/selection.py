"""Which effects a model lacks: one after another, as long as the data ask for another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..effects import Effect
from .candidates import Fitted, afresh, directions, fitted, noise_gain, shaped, try_all
from .terms import OUTSIDE
from .zero import EACH_RUN

MOST_EFFECTS = 4
SIGNIFICANT = 28.0
"""Decrease of the cost over that by noise from which an effect counts as found: the square of a
5.3 sigma deviation, so that a hundred shapes of effects together rarely reach it by chance."""
LEAST_PART = 3e-3
"""Of the cost: a smaller decrease is within what smoothing and integration leave."""
LEAST_SHARE = 0.03
"""Of the law's misfit: a smaller decrease rather mends another effect's form."""
TRIED = 14
"""Forms that are fitted after all have been looked at."""
AGAIN = 4
"""Forms that are fitted in the place of an effect found before."""
CLEARLY_BETTER = 0.5
"""A term outside the catalogue has to leave less than this part of the misfit that the best effect
of the catalogue leaves; the catalogue's forms are only nearly right."""
LEFT = 0.15
"""Of the law's misfit: where the best effect leaves less, no term outside of it is sought."""


@dataclass(eq=False)
class Search:
    """The search for effects.

    Attributes
    ----------
    effects : sequence of Effect
        The catalogue.
    terms : sequence of Effect
        Terms outside the catalogue, each with one coefficient.
    noise : (n_fitted, n_examples) array
        Residuals that noise alone leaves, of the fitted samples.
    pool : concurrent.futures.ThreadPoolExecutor
        Who computes.
    advance : callable
        Called after each fit.
    rounds : list of list of Fitted
        What was tried, round by round, the best first.
    found : Fitted or None
        The outcome of the last ``run``.
    misfit : float
        Cost of the law alone above that of noise, at that run.
    """

    effects: Sequence[Effect]
    terms: Sequence[Effect]
    noise: NDArray
    pool: ThreadPoolExecutor
    advance: Callable[[], None]
    rounds: list[list[Fitted]] = field(default_factory=list)
    found: Fitted | None = None
    misfit: float = 0.0
    _known: dict[tuple[Effect, ...], tuple[Fitted, list[Fitted]]] = field(default_factory=dict)

    def run(self, base: Fitted) -> Fitted:
        """Add effects as long as they help, then see whether each is still needed.

        Parameters
        ----------
        base : Fitted
            The fitted law.

        Returns
        -------
        Fitted
            With the effects found; the law itself if there are none.
        """
        best = base
        self.misfit = max(base.cost - self.noise_cost, 0.0)
        while len(best.model.stages) < MOST_EFFECTS:
            better = self.extended(best)
            if better is None:
                break
            best = self.exchanged(better)
        self.found = self.reduced(best)
        return self.found

    def candidates(self, base: Fitted, most: int = TRIED) -> list[Fitted]:
        """Fit the most promising effects together with a model, the best first."""
        left = [e for e in self.effects if e.cause not in base.causes]
        found = directions(base, left, self.noise, self.pool)
        threshold = max(SIGNIFICANT / 4, LEAST_PART * base.cost / 4)
        chosen = [d for d in found if d.gain / max(d.noise_gain, 1.0) > threshold][:most]
        chosen = list(self.pool.map(lambda d: shaped(base, d, self.noise), chosen))
        return try_all(base, chosen, self.pool, self.advance)

    def extended(self, base: Fitted) -> Fitted | None:
        """Add the effect that helps most; None if none helps enough."""
        tried = self.candidates(base)
        self.rounds.append(tried)
        self._known[base.effects] = base, tried
        # a form with more parameters has to earn them
        best = min(tried, key=self.penalised, default=base)
        term = self.outside(base, best)
        if term is not None:
            tried.append(term)
            tried.sort(key=lambda f: f.cost)
            best = term
        return best if best is not base and self.helps(base, best) else None

    def penalised(self, one: Fitted) -> float:
        """Cost of a model and of its parameters."""
        count = len(one.values)
        if one.model.stages[-1].effect is EACH_RUN:
            count += len(one.model.data.dt) - 1
        return one.cost + count * float(np.log(len(one.residual)))

    def outside(self, base: Fitted, best: Fitted) -> Fitted | None:
        """Add the best term outside the catalogue, if it is clearly better than the best effect."""
        if OUTSIDE in base.causes:
            return None
        noise_cost = self.noise_cost
        left = best.cost - noise_cost
        if left < LEFT * self.misfit:
            return None
        found = directions(base, self.terms, self.noise, self.pool)[:1]
        if not found or base.cost - found[0].gain - noise_cost > CLEARLY_BETTER * left:
            return None
        term = try_all(base, found, self.pool, self.advance)[0]
        return term if term.cost - noise_cost < CLEARLY_BETTER * left else None

    @cached_property
    def noise_cost(self) -> float:
        """Cost that noise alone leaves."""
        return float(np.mean(np.sum(self.noise**2, axis=0)))

    def helps(self, without: Fitted, given: Fitted) -> bool:
        """Whether the last effect of a model is more than noise."""
        gain = without.cost - given.cost
        from_noise = noise_gain(given.residual - without.residual, self.noise)
        least = max(LEAST_PART * without.cost, LEAST_SHARE * self.misfit)
        return gain > SIGNIFICANT * max(from_noise, 1.0) and gain > least

    def exchanged(self, model: Fitted) -> Fitted:
        """Replace effects found early by others where that is better now."""
        for place in range(len(model.effects) - 1):
            tried = self.rivals(model, place)[1]
            if tried and tried[0].cost < model.cost - SIGNIFICANT:
                model = tried[0]
        return model

    def dropped(self, model: Fitted, place: int) -> Fitted:
        """Fit a model again without one of its effects."""
        known = self._known.get(_without(model, place))
        if known is not None:
            return known[0]
        gone = model.model.slices()[place]
        values = np.delete(model.values, np.arange(gone.start, gone.stop))
        found = fitted(model.model.without(place), values)
        # a law that leans on what is taken away may fail without it
        return found if np.isfinite(found.cost) else afresh(found)

    def rivals(self, model: Fitted, place: int) -> tuple[Fitted, list[Fitted]]:
        """Put other causes in the place of one.

        Parameters
        ----------
        model : Fitted
            The model.
        place : int
            Of the effect to replace.

        Returns
        -------
        without : Fitted
            The model without it.
        rivals : list of Fitted
            With others as the last effect, the best first.
        """
        effects = _without(model, place)
        if effects not in self._known:
            without = self.dropped(model, place)
            self._known[effects] = without, self.candidates(without, AGAIN)
        return self._known[effects]

    def reduced(self, model: Fitted) -> Fitted:
        """Leave out effects that are no longer needed."""
        place = 0
        while place < len(model.effects):
            without = self.dropped(model, place)
            if self.helps(without, model):
                place += 1
            else:
                model = without
        return model


def _without(model: Fitted, place: int) -> tuple[Effect, ...]:
    return model.effects[:place] + model.effects[place + 1 :]
