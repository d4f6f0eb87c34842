"""The search for effects of device tests, and what of it holds on all samples.

Effects are sought on thinned samples. Those found are fitted to all samples, and kept if they help
on the fitted and on the held-out runs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..decisions import (
    ADEQUATE_FORM,
    COMPLETES,
    MINOR,
    MOST_MINOR,
    NEARLY_COMPLETES,
    NEEDED,
    PROPOSED,
    SIGNIFICANT,
    TO_BLAME,
    TO_BLAME_FITTED,
    WELL_EXPLAINED,
)
from ..search import SearchResult, search
from .carried_history import has_unknown_starts
from .causes import imitate, share_a_spectrum
from .effect_search import EffectSearch
from .force_errors import ForceErrors
from .intervals import values_at_bounds
from .model import FittedModel
from .stability import stability


class Superfluous(NamedTuple):
    """An effect that corrects next to nothing."""

    place: int  # Among the effects
    size: float  # Share of the force that it corrects
    allowed: float  # Share of the force from which it would count


class ValidatedSearch:
    """A search for effects, validated on all samples."""

    def __init__(
        self, space: EffectSearch, errors: ForceErrors, law: FittedModel,
        prescribed: FittedModel | None, seed: int,
    ):  # fmt: skip
        self.space, self.errors, self.data, self.seed = space, errors, errors.data, seed
        # the law on all samples, fitted and with the values given; with the effects found
        self.law, self.prescribed, self.final = law, prescribed, law
        self.negligible: list[str] = []  # Effects that correct next to nothing, in words
        self.negligible_below = errors.significance
        self.unstable: list[str] = []  # Effects that most fits from other runs do not ask for

    def search(self, base: FittedModel, advance: Callable[[], None]) -> SearchResult[FittedModel]:
        """Search for effects, then fit them to all samples; ``advance`` is called between."""
        result = self._without_unknown_starts(_search(self.space, base))
        advance()
        for best in self._proposals(result):
            self._extend(best)
            if not best.effects or self._holds():
                break
        best = self._of_equals(self._completed(best, result))
        while best.effects and (least := self._superfluous(best)) is not None:
            title = best.effects[least.place].title
            self.negligible.append(f"{title} corrects {100 * least.size:.2g} % of the force")
            self.negligible_below = least.allowed
            best = self.space.without(best, least.place)
            self._extend(best)
        return replace(result, best=best)

    @cached_property
    def before(self) -> NDArray:
        """Force of the evaluated simulation, N."""
        return self.data.bounded((self.prescribed or self.law).force)

    @property
    def after(self) -> NDArray:
        """Force with all selected effects, N."""
        return self.data.bounded(self.final.force)

    def left(self, chosen: NDArray | None = None) -> float:
        """Share of the misfit that the effects leave; by default of the validation samples."""
        return self.errors.share_left(self.before, self.after, chosen)

    def _without_unknown_starts(
        self, result: SearchResult[FittedModel]
    ) -> SearchResult[FittedModel]:
        """Causes in place of one with a state of each run's own, if they explain as much."""
        # Such a state follows whatever differs from run to run. Alone it stands for two causes,
        # which the search adds one after the other and compares with it one by one.
        best = result.best
        if not any(has_unknown_starts(effect) for effect in best.effects):
            return result
        known = replace(
            self.space,
            effects=[effect for effect in self.space.effects if not has_unknown_starts(effect)],
            most_causes=min(self.space.most_causes, len(best.effects) + 1),
        )
        other = _search(known, result.base)
        fewer = self.space.penalised_cost(other.best) < self.space.penalised_cost(best)
        return other if fewer else result

    def _proposals(self, result: SearchResult[FittedModel]) -> Iterator[FittedModel]:
        """Models to test on held-out data, until one holds.

        Effects that follow the fitted runs may lack one that acts in the held-out runs above all.
        Otherwise the last one found is dropped first. A law that follows the fitted runs alone
        lacks something that acts in the others: there the held-out runs choose.
        """
        best = self._needed(result.best)
        if best.effects:
            yield best
        last = result.rounds[-1] if result.rounds else None
        if last is not None and last.taken is None and best is last.base and best.effects:
            if self.left(self.data.fitted) < WELL_EXPLAINED:
                yield from self.space.second_best(best, last.tried)
        before = [one.base for one in reversed(result.rounds) if one.base is not best]
        yield from (one for one in before if one.effects)
        errors, base = self.errors, result.base
        follows = errors.is_noise(self.before, self.data.fitted)
        if follows and not errors.is_noise(self.before, errors.validation_samples):
            tried = result.rounds[0].tried if result.rounds else ()
            yield from self.space.more_than_noise(base, tried, PROPOSED)
        yield base

    def _of_equals(self, best: FittedModel) -> FittedModel:
        """Of models that the fitted runs do not tell apart, one that the held-out runs ask for."""
        # Such as two states of which one goes on from run to run: the runs that would tell may all
        # be held out.
        if not self._misses_held_out(best):
            return best
        before, left = self.final, self.errors.misfit(self.after)
        for place in range(len(best.effects)):
            for other in self.space.rivals(best, place)[1]:
                if other.cost > best.cost + SIGNIFICANT:
                    continue
                self._extend(other)
                if self.errors.misfit(self.after) < COMPLETES * left and self._holds():
                    return self._of_equals(other)
                self.final = before
        return best

    def _misses_held_out(self, best: FittedModel) -> bool:
        """Whether effects leave more than noise on the runs held out."""
        if not best.effects or self.data.fitted.all():
            return False
        return not self.errors.is_noise(self.after, self.errors.validation_samples)

    def _completed(self, best: FittedModel, result: SearchResult[FittedModel]) -> FittedModel:
        """Add a cause that explains most of what is left, on fitted and on held-out runs."""
        # Of the law's whole misfit it may be a small share, as what mends the form of another cause
        # is. That leaves most of the remainder, or follows other runs no better. A cause at a bound
        # has a form that is not quite right.
        errors = self.errors
        if not best.effects:
            return best
        if any(any(values_at_bounds(best, place)) for place in range(len(best.effects))):
            return best
        missed = self._misses_held_out(best)
        # where the others leave noise alone, there is nothing to complete
        if not missed and errors.is_near_noise(self.after, self.data.fitted, ADEQUATE_FORM):
            return best
        more = self._one_more(best, result)
        if more is None or not self.space.completes(best, more):
            return best
        before, left = self.final, errors.misfit(self.after)
        error = errors.relative(self.after)
        self._extend(more)
        # runs held out that are followed to noise can only object: the fitted ones have to be noise
        taken = self._may_complete(more) and (
            errors.misfit(self.after) < COMPLETES * left if missed
            else errors.is_noise(self.after, self.data.fitted)
            and errors.relative(self.after) <= error
        )  # fmt: skip
        # one that imitates another does not replace it
        if taken and imitate(more.effects):
            taken = self._superfluous(more) is None
        if taken and self._holds():
            self.unstable = [one for one in self.unstable if one not in _titles(more)]
            return more
        self.final = before
        return best

    def _may_complete(self, best: FittedModel) -> bool:
        """Whether effects may complete each other: those that imitate each other only to noise."""
        if share_a_spectrum(best.effects):
            return False
        return not imitate(best.effects) or self.errors.is_noise(self.after, self.data.fitted)

    def _one_more(self, best: FittedModel, result: SearchResult[FittedModel]) -> FittedModel | None:
        """The most likely model with one more cause: found by the search, or nearly chosen."""
        if len(result.best.effects) == len(best.effects) + 1:
            return result.best
        last = result.rounds[-1]
        if last.taken is not None or last.base.effects != best.effects:
            return None
        likely = [
            one for one in self.space.second_best(best, last.tried)
            if self.space.completes(best, one, NEARLY_COMPLETES)
        ]  # fmt: skip
        if not likely:
            return None
        # before those beside it are exchanged, a right one may not help on the runs held out
        nearly = next((one for one in likely if self._helps(one)), likely[0])
        return self.space.revise(nearly)

    def _helps(self, more: FittedModel) -> bool:
        """Whether one more cause, as it was found, leaves less on held-out runs, or noise."""
        if not self._misses_held_out(more):
            return True
        force = self.data.bounded(self._on_all_samples(more).force)
        return self.errors.misfit(force) < NEARLY_COMPLETES * self.errors.misfit(self.after)

    def _needed(self, best: FittedModel) -> FittedModel:
        """Drop effects that chance explains beside the others, or most fits from other runs."""
        while best.effects:
            # each is a fit
            several = range(len(best.effects) if len(best.effects) > 1 else 0)
            lacking = [self.space.without(best, place) for place in several]
            gains = [(e.cost - best.cost) / self.space.noise_gain(e, best) for e in lacking]
            if gains and min(gains) < SIGNIFICANT:
                best = lacking[int(np.argmin(gains))]
                continue
            shares = [one.needed for one in stability(self.space, best, self.seed)]
            least = int(np.argmin(shares))
            if shares[least] >= NEEDED:
                break
            self.unstable.append(best.effects[least].title)
            best = self.space.without(best, least)
        return best

    def _extend(self, best: FittedModel) -> None:
        """Take the effects of a searched model, and fit them to all samples."""
        self.final = self.law
        if best.effects:
            self.final = self._on_all_samples(best)
        elif self.prescribed is not None and self.errors.is_worse(self.before, self.after):
            # numbers that predict other tests worse than those given are no improvement
            self.final = self.prescribed

    def _on_all_samples(self, searched: FittedModel) -> FittedModel:
        """A searched model on all samples, with as many integration steps as it needs there."""
        return searched.on(self.law.model.resolve_steps(searched.values))

    def _holds(self) -> bool:
        """Whether the effects help on fitted and on held-out runs, and make none of these worse."""
        # An effect that helps on the fitted runs alone, or only where the law diverges, is no
        # cause.
        if self.left() > 1 - TO_BLAME or self.left(self.data.fitted) > 1 - TO_BLAME_FITTED:
            return False
        return not self.errors.is_worse(self.before, self.after)

    def _force_without(self, searched: FittedModel, place: int) -> NDArray:
        """Force of all samples without one effect, N."""
        searched_without = self.space.without(searched, place)
        without = replace(searched_without, model=self.final.model.without(place))
        return self.data.bounded(without.force)

    def _superfluous(self, best: FittedModel) -> Superfluous | None:
        """Find an effect that corrects next to nothing."""
        squared = self.errors.squared
        without = [self._force_without(best, k) for k in range(len(best.effects))]

        def corrected_on(chosen: NDArray) -> NDArray:
            added = np.array([squared(one, chosen) for one in without]) - squared(
                self.after, chosen
            )
            return np.sqrt(np.maximum(added, 0.0))

        corrected = corrected_on(self.errors.validation_samples)
        explained = np.maximum(squared(self.before) - squared(self.after), 0.0)
        # as a share of the whole force, and on average of each run's own
        small = np.tile(np.sqrt(MINOR * explained), (len(corrected), 1))
        # what completes the law is no correction of another's form
        completing = self._completing(best, without, corrected[:, 0] ** 2)
        if any(completing):
            small[completing] = 0.0
            corrected[completing] = np.maximum(corrected, corrected_on(self.data.fitted))[
                completing
            ]
        allowed = np.maximum(max(self.errors.significance, 1e-9), np.minimum(small, MOST_MINOR))
        beyond = np.max(corrected / allowed, axis=1)
        least = int(np.argmin(beyond))
        if beyond[least] >= 1:
            return None
        return Superfluous(least, float(np.max(corrected[least])), float(np.max(allowed)))

    def _completing(
        self, best: FittedModel, without: Sequence[NDArray], corrected: NDArray
    ) -> list[bool]:
        """Which effects leave noise, or far less on fitted and on held-out runs, and others not."""
        errors, judging = self.errors, self.errors.validation_samples
        if errors.is_noise(self.after, judging):
            # what the others leave is as small, unless the fitted runs alone show it
            fitted = self.data.fitted
            follows = errors.is_noise(self.after, fitted)
            return [
                not errors.is_noise(force, judging)
                or (
                    follows
                    and not errors.is_near_noise(force, fitted, ADEQUATE_FORM)
                    and self.space.completes(self.space.without(best, k), best)
                )
                for k, force in enumerate(without)
            ]
        if not self._may_complete(best):
            return [False] * len(corrected)
        remains = errors.relative(self.after) ** 2 - errors.noise_floor(judging) ** 2
        return [
            remains < COMPLETES * (remains + each)
            and self.space.completes(self.space.without(best, k), best)
            for k, each in enumerate(corrected)
        ]


def _search(space: EffectSearch, base: FittedModel) -> SearchResult[FittedModel]:
    """Search for effects, and once more around those left at the end if they fit far better."""
    result = search(space, base)
    while space.continues(result):
        more = search(space, result.best)
        result = SearchResult(base, more.best, [*result.rounds, *more.rounds])
    return result


def _titles(fitted: FittedModel) -> list[str]:
    return [effect.title for effect in fitted.effects]
