"""The search for effects around a law: which are tried, which is taken, which are dropped again."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...effects import Effect
from ..decisions import (
    ADEQUATE,
    CLEARLY_BETTER,
    COMPLETES,
    FEWER_STEPS,
    LEAST_PART,
    LEAST_SHARE,
    MANY_STEPS,
    MOST_EFFECTS,
    MOST_MINOR,
    NEARLY_ALL,
    NEW_SPECIMENS,
    RIVALS_TRIED,
    SIGNIFICANT,
    TERMS_TRIED,
    TRIED,
    WELL_EXPLAINED,
    WORTH_REFITTING,
)
from ..search import SearchResult
from .acting_order import either_order
from .carried_history import has_unknown_starts, keeps_history, needs_new_specimens
from .generic_terms import OUTSIDE, with_each_power
from .model import FittedModel, fit_model
from .screen import Direction, fit_direction, fit_directions, noise_gain, refine, refit, screen


@dataclass(eq=False)
class EffectSearch:
    """The search space of device tests; see ``search.SearchSpace``."""

    base: FittedModel  # The law alone
    effects: Sequence[Effect]  # The catalogue
    terms: Sequence[Effect]  # Generic terms outside the catalogue, each with one coefficient
    noise: NDArray  # (n_fitted, n_examples): Residuals of noise alone, of the fitted samples
    pool: ThreadPoolExecutor  # Threads that share out the fits
    advance: Callable[[], None]  # Called after each fit
    # Whether the search stops at a model: another law alone is far better
    stops_at: Callable[[FittedModel], bool] = lambda current: False
    most_causes: int = MOST_EFFECTS  # Number of effects at which the search stops
    _known: dict[tuple[Effect, ...], tuple[FittedModel, list[FittedModel]]] = field(
        default_factory=dict, init=False
    )

    @cached_property
    def noise_cost(self) -> float:
        """Mean cost of noise alone."""
        return float(np.mean(np.sum(self.noise**2, axis=0)))

    @cached_property
    def _is_series(self) -> bool:
        """Whether effects that go on from run to run are tried."""
        return any(keeps_history(effect) for effect in self.effects)

    @cached_property
    def misfit(self) -> float:
        """Cost of the law alone above that of noise."""
        return max(self.base.cost - self.noise_cost, 0.0)

    @cached_property
    def least_share(self) -> float:
        """Share of the law's misfit that an effect must remove."""
        data = self.base.model.data
        force = float(np.sum((data.force * data.weight)[data.fitted] ** 2))
        # beside a large effect a smaller one may be a large force as well
        return min(LEAST_SHARE, MOST_MINOR**2 * force / max(self.misfit, 1e-300))

    def is_explained(self, current: FittedModel) -> bool:
        """Whether no effect is tried; whether nothing is left is seen by trying."""
        # causes that leave so little do not imitate another law
        left = current.cost - self.noise_cost
        return bool(current.effects) and left > NEARLY_ALL * self.misfit and self.stops_at(current)

    def candidates(self, current: FittedModel) -> list[FittedModel]:
        """Fit the most promising effects, and a generic term if it is clearly better."""
        tried = self._fit_effects(current)
        term = self._generic_term(current, min(tried, key=self.penalised_cost, default=current))
        if term is not None:
            tried = sorted([*tried, term], key=lambda f: f.cost)
        self._known[current.effects] = current, tried
        return tried

    def choose(self, current: FittedModel, tried: Sequence[FittedModel]) -> FittedModel | None:
        """Select the generic term, or the effect with the least penalised cost, if it helps."""
        terms = [one for one in tried if one.causes[-1] == OUTSIDE]
        best = min(terms or tried, key=self.penalised_cost, default=None)
        return best if best is not None and self._helps(current, best) else None

    def second_best(
        self, current: FittedModel, tried: Sequence[FittedModel]
    ) -> Iterator[FittedModel]:
        """Models with one more cause that is more than noise, though too small to be chosen."""
        causes: set[str] = set()
        for one in self.more_than_noise(current, tried):
            if one.causes[-1] not in causes:
                causes.add(one.causes[-1])
                yield one
            if len(causes) == RIVALS_TRIED:
                return

    def more_than_noise(
        self, current: FittedModel, tried: Sequence[FittedModel], significant: float = SIGNIFICANT
    ) -> Iterator[FittedModel]:
        """Models whose last cause, of the catalogue, gains more than noise would."""
        for one in tried:
            gain = current.cost - one.cost
            least = max(significant * self.noise_gain(current, one), LEAST_PART * current.cost)
            if one.causes[-1] != OUTSIDE and gain > least:
                yield one

    def revise(self, taken: FittedModel) -> FittedModel:
        """Replace effects by others that are better now, until none is."""
        model, place = taken, 0
        while place < len(model.effects):
            others = [*self.rivals(model, place)[1], *self.exchanges(model, place)]
            better = [one for one in others if self._replaces(one, model, place)]
            if better:
                model, place = min(better, key=self.penalised_cost), 0
            else:
                place += 1
        return self._with_own_steps(model)

    def _replaces(self, other: FittedModel, model: FittedModel, place: int) -> bool:
        """Whether a model with another last effect is better than one with the effect at a place.

        A simpler form of the same cause need only be as good: the other's values degenerate.
        """
        simpler = other.causes[-1] == model.causes[place] and len(other.values) < len(model.values)
        # far from the noise, forms that are all wrong would take each other's place for long
        left = max(model.cost - self.noise_cost, 0.0)
        least = 0.0 if simpler else max(SIGNIFICANT, LEAST_PART * left)
        return self.penalised_cost(other) < self.penalised_cost(model) - least

    def _with_own_steps(self, fitted: FittedModel) -> FittedModel:
        """Take far fewer integration steps, where effects have made the law so much milder."""
        model, every = fitted.model, self.base.model.data
        if every.total_steps < MANY_STEPS * len(every.x):
            return fitted
        own = model.resolve_steps(fitted.values)
        if FEWER_STEPS * own.data.total_steps <= model.data.total_steps:
            return fit_model(own, fitted.values)
        if model.data is not every and own.data.total_steps > FEWER_STEPS * model.data.total_steps:
            return fit_model(replace(model, data=every), fitted.values)
        return fitted

    def finish(self, best: FittedModel) -> FittedModel:
        """Drop effects that only imitate a generic term, or are no longer needed."""
        model = self._without_imitations(best)
        while model.effects:
            lacking = [self.without(model, place) for place in range(len(model.effects))]
            needless = [one for one in lacking if not self._helps(one, model)]
            if not needless:
                break
            # of two that stand for one another the better one stays
            model = min(needless, key=self.penalised_cost)
        return model

    def continues(self, result: SearchResult[FittedModel]) -> bool:
        """Whether the effects left at the end fit far better than when more were tried beside them.

        An effect that was dropped again may have led to better values of the others.
        """
        best = result.best
        before = [one.base.cost for one in result.rounds if one.base.effects == best.effects]
        if not (best.effects and before):
            return False
        return min(before) - best.cost > self.least_share * self.misfit

    def _without_imitations(self, best: FittedModel) -> FittedModel:
        """Put a generic term in an effect's place, where it is clearly better there."""
        model = best
        for place in reversed(range(len(best.effects))):
            if OUTSIDE in model.causes or model.cost < ADEQUATE * self.noise_cost:
                break
            without = self.without(model, place)
            directions = screen(without, self.terms, self.noise, self.pool)
            term = self._fitted_term(without, model, directions)
            model = term or model
        return model

    def rivals(self, model: FittedModel, place: int) -> tuple[FittedModel, list[FittedModel]]:
        """Fit the model without one effect, and with other effects in its place, best first."""
        effects = _other_effects(model, place)
        if effects not in self._known:
            without = self.without(model, place)
            self._known[effects] = without, self._fit_effects(without, RIVALS_TRIED)
        return self._known[effects]

    def exchanges(self, model: FittedModel, place: int) -> list[FittedModel]:
        """Fit other forms of an effect, and close rivals, from the values of the law beside it."""
        # A law that was fitted without the effect may lie too far from the truth to tell these.
        mine = model.effects[place]
        forms = [
            e for e in either_order(self.effects, _other_effects(model, place))
            if e is not mine
            and (e.cause == mine.cause or (e in self._near(mine) and e.cause not in model.causes))
        ]  # fmt: skip
        bare = FittedModel.at(model.model.without(place), model.values_without(place))
        if not (forms and np.isfinite(bare.cost) and np.isfinite(bare.jacobian).all()):
            return []
        left = bare.across(bare.residual)

        def fit(one: Direction) -> FittedModel | None:
            one = refine(bare, one, self.noise)
            likely = float(left @ left) - one.gain < model.cost
            return fit_direction(bare, one) if likely else None

        directions = screen(bare, forms, self.noise, self.pool)
        fitted = [one for one in self.pool.map(fit, directions) if one is not None]
        self._keep_better(fitted)
        return fitted

    def _near(self, mine: Effect) -> set[Effect]:
        """Effects that explained nearly as much as another one wherever both were tried."""
        near: set[Effect] = set()
        for without, tried in self._known.values():
            gains = {one.effects[-1]: without.cost - one.cost for one in tried}
            least = WORTH_REFITTING * gains.get(mine, np.inf)
            near |= {effect for effect, gain in gains.items() if gain > least}
        return near

    def _keep_better(self, fitted: Sequence[FittedModel]) -> None:
        """Replace rivals by the same ones fitted better."""
        for one in fitted:
            without, tried = self._known.get(one.effects[:-1], (one, []))
            at = next((k for k, r in enumerate(tried) if r.effects == one.effects), None)
            if at is not None and one.cost < tried[at].cost:
                tried = sorted([*tried[:at], one, *tried[at + 1 :]], key=lambda f: f.cost)
                self._known[one.effects[:-1]] = without, tried

    def noise_gain(self, without: FittedModel, extended: FittedModel) -> float:
        """Mean decrease of the cost by noise along a change of the model, at least 1."""
        return max(noise_gain(extended.residual - without.residual, self.noise), 1.0)

    def _fit_effects(self, current: FittedModel, most: int = TRIED) -> list[FittedModel]:
        every = either_order(self.effects, current.effects)
        left = [e for e in every if e.cause not in current.causes]
        result = screen(current, left, self.noise, self.pool)
        least = LEAST_PART * current.cost
        chosen = [
            d for d in result if d.gain > max(SIGNIFICANT * max(d.noise_gain, 1.0), least) / 4
        ][:most]
        refined = self.pool.map(lambda d: refine(current, d, self.noise), chosen)
        likely = sorted(refined, key=lambda d: -d.gain)
        return fit_directions(current, likely, self.pool, self.advance)

    def _generic_term(self, current: FittedModel, best: FittedModel) -> FittedModel | None:
        """Fit the best generic term, if it is clearly better than the best effect."""
        if OUTSIDE in current.causes:
            return None
        # an effect that another one bends may look like a term: only of the first one all is asked
        if current.effects and best.cost - self.noise_cost < WELL_EXPLAINED * self.misfit:
            return None
        screened = screen(current, self.terms, self.noise, self.pool)
        return self._fitted_term(current, best, screened)

    def _fitted_term(
        self, current: FittedModel, best: FittedModel, screened: Sequence[Direction]
    ) -> FittedModel | None:
        """Fit generic terms; the best one, if it is clearly better than the best effect."""
        enough = best.cost + WELL_EXPLAINED * self.misfit
        likely = [one for one in screened if current.cost - one.gain < enough][:TERMS_TRIED]
        terms = fit_directions(current, likely, self.pool, self.advance)
        term = min(terms, key=self.penalised_cost, default=None)
        if term is None:
            return None
        term = min(term, self._with_each_power(current, term), key=self.penalised_cost)
        floor = min(self.noise_cost, term.cost)
        if not term.cost - floor < CLEARLY_BETTER * (best.cost - floor):
            return None
        chance = SIGNIFICANT * self.noise_gain(best, term)
        return term if self.penalised_cost(best) - self.penalised_cost(term) > chance else None

    def _with_each_power(self, current: FittedModel, term: FittedModel) -> FittedModel:
        """Fit a term with a polynomial of the current as its coefficient."""
        by_current = any("current" in each.needs for each in self.terms)
        by_power = with_each_power(term.effects[-1]) if by_current else None
        if by_power is None:
            return term
        family, power = by_power
        start = np.zeros(len(family.parameters))
        start[power] = term.values[-1]
        return fit_direction(current, Direction(family, 0.0, 1.0, start))

    def penalised_cost(self, one: FittedModel) -> float:
        """Cost of a model and of its parameters on all runs."""
        return float(self.penalised(one, np.array(one.cost), np.array(1.0)))

    def penalised(self, one: FittedModel, costs: NDArray, size: NDArray) -> NDArray:
        """Costs of a model and of its parameters (Schwarz's criterion), on sets of runs."""
        # ``size`` as in ``helps``. States that are fitted to each run follow any run a little:
        # like a generic term they have to be clearly better.
        factor = 1.0
        if any(has_unknown_starts(effect) for effect in one.effects):
            factor = 1 / CLEARLY_BETTER
        # a damage of the same specimen would go on, while an amplitude or heat begins anew
        elif self._is_series and any(needs_new_specimens(effect) for effect in one.effects):
            factor = NEW_SPECIMENS
        if factor > 1:
            costs = costs + (factor - 1) * np.maximum(costs - size * self.noise_cost, 0.0)
        return costs + one.penalty

    def completes(
        self, without: FittedModel, extended: FittedModel, share: float = COMPLETES
    ) -> bool:
        """Whether a model leaves less than a share of what one with a cause less leaves."""
        before, after = np.array(without.cost), np.array(extended.cost)
        # where little is left, chance makes that far less
        if not before - after > SIGNIFICANT * self.noise_gain(without, extended):
            return False
        return bool(self.leaves_less(before, after, np.array(1.0), share))

    def leaves_less(
        self, cost_without: NDArray, cost: NDArray, size: NDArray, share: float = COMPLETES
    ) -> NDArray:
        """The same by the costs on sets of runs, above the noise; ``size`` as in ``helps``."""
        noise = size * self.noise_cost
        with np.errstate(invalid="ignore"):  # both diverge
            return cost - noise < share * (cost_without - noise)

    def _helps(self, without: FittedModel, extended: FittedModel) -> bool:
        cost_without, cost = (np.array(one.cost) for one in (without, extended))
        one, misfit = np.array(1.0), np.array(self.misfit)
        return bool(self.helps(without, extended, cost_without, cost, one, misfit))

    def helps(
        self, without: FittedModel, extended: FittedModel, cost_without: NDArray, cost: NDArray,
        size: NDArray, misfit: NDArray, named: bool = False,
    ) -> NDArray:  # fmt: skip
        """Whether the last effect of a model is more than noise, by the costs on sets of runs."""
        # ``size`` holds the samples of each set over those of all runs. An effect that is ``named``
        # may be a small share of the misfit, if it is most of what the others leave.
        with np.errstate(invalid="ignore"):  # both diverge: no gain
            gain = cost_without - cost
        part = LEAST_PART * cost_without
        noise = size * self.noise_cost
        # what leaves nothing but noise, and did not before, is no correction of another's shape
        completes = (cost < ADEQUATE * noise) & (gain > noise)
        if named:
            completes |= self.leaves_less(cost_without, cost, size)
        least = np.where(completes, part, np.maximum(part, self.least_share * misfit))
        return (gain > SIGNIFICANT * self.noise_gain(without, extended)) & (gain > least)

    def without(self, model: FittedModel, place: int) -> FittedModel:
        """Fit a model without one of its effects."""
        # without the effect the law may need all steps again
        fewer = replace(model.model.without(place), data=self.base.model.data)
        result = self._with_own_steps(fit_model(fewer, model.values_without(place)))
        known = self._known.get(result.effects)
        if known is None:
            # a law that depends on the effect may fail without it
            return result if np.isfinite(result.cost) else refit(result)
        # the same effects, fitted before the one left out was found, may have ended elsewhere
        if not result.cost < known[0].cost:
            return known[0]
        self._known[result.effects] = result, known[1]
        return result


def _other_effects(model: FittedModel, place: int) -> tuple[Effect, ...]:
    return model.effects[:place] + model.effects[place + 1 :]
