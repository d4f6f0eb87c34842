"""Which law fits a campaign: all registered laws compared on short data."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..laws import Device
from ..laws.registry import LAWS
from .campaign import Campaign
from .cross_validation import fitted_without, folds_of
from .law_fit import (
    SCREENING_STEPS,
    distinct,
    parameterise,
    refine_law,
    screen_starts,
    search_roughly,
)
from .law_model import LawModel, coarse_step_error
from .least_squares import Optimum
from .measured_runs import MeasuredRuns
from .parameterisation import Parameterisation

AUTO = "auto"
"""Word in place of a law's name that compares all laws."""
NEAR = 1.05
"""Factor on the least error up to which a law with fewer parameters is preferred."""
WRONG_FAMILY = 2.0
"""Factor on the least error above which a law is of the wrong family."""
_SAMPLES, _A_CYCLE = 4000, 60
_STARTS, _STEPS = 8, 40
"""Starts and steps of a law's first fit."""
_RESOLVED = 2
"""Best ends of its searches that are fitted with resolved integration steps."""
_RESOLVES, _COARSEST = 0.05, 5e-3
"""Error of integration over a law's own error, and over the force at most: a law that misses the
data by far is not followed more exactly."""
_UNIT = 0.01
"""Error of one sample over the force that counts as one standard deviation. About the noise of most
tests, so that the springs that hold what the data leave open do not hold the rest."""
_FINALISTS = 6
"""Best laws, which are fitted further."""
_RANKED = 0.01
"""Share of the cost; ten steps that gain less together change no rank, and end a fit of one."""
_FOLD_STEPS = 8
"""Steps of a fit without one condition, from the values of the fit to all."""
_LISTED = 5
"""Laws of the right family that a sentence names."""


@dataclass(frozen=True)
class LawRank:
    """How well a law fits."""

    # law, title: Registry name, and name to print
    law: str
    title: str
    n_numbers: int  # Numbers that were fitted
    # error, left_out: RMS residual over RMS force, of the fitted runs and of what was not fitted:
    # runs held out, and each condition of the others in turn. Of a law of another family none is
    # left out, and it is at least the error. Infinite for a law without finite forces.
    error: float
    left_out: float
    # (n_numbers,): Unknowns of the fit, as ``parameterise`` has them; empty without finite forces
    values: NDArray = field(default_factory=lambda: np.zeros(0), compare=False, repr=False)
    prescribed: bool = False  # Whether the values were given and not fitted


@dataclass(frozen=True)
class LawChoice:
    """Registered laws compared on a campaign."""

    ranks: tuple[LawRank, ...]  # The law to use first, then by the error on what was left out
    beside_causes: bool = False  # Whether the law to use needs a cause less than the best alone

    @property
    def best(self) -> LawRank:
        """The law to use."""
        return self.ranks[0]

    @property
    def least(self) -> float:
        """Least error of a law on what was left out of its fit."""
        return min(one.left_out for one in self.ranks)

    @property
    def near(self) -> tuple[LawRank, ...]:
        """Laws of the right family: with at most twice the least error."""
        return tuple(one for one in self.ranks if one.left_out <= WRONG_FAMILY * self.least)

    @property
    def text(self) -> str:
        """The choice in words."""
        best, near = self.best, [one.law for one in self.near if one is not self.best]
        how = (
            " fits best beside the causes: alone, and fitted to short data, it misses what was "
            "left out of the fit" if self.beside_causes
            else " as given fits best: it misses short data" if best.prescribed
            else " fits best: fitted to short data, it misses what was left out of the fit"
        )  # fmt: skip
        text = f"Of {len(self.ranks)} laws {best.law}{how} by {100 * best.left_out:.3g} %."
        if near:
            more = len(near) - _LISTED
            listed = ", ".join(near[:_LISTED]) + f" and {more} more" * (more > 0)
            text += f" Within twice that error: {listed}."
        lost = [one.law for one in self.ranks if not np.isfinite(one.left_out)]
        text += " The others are of another family." * (1 + len(near) + len(lost) < len(self.ranks))
        if lost:
            text += f" No fit of {', '.join(lost)} has finite forces and derivatives."
        return text

    def with_best(self, best: LawRank) -> LawChoice:
        """Choose another law, since it needs a cause less or leaves far less beside them."""
        others = (one for one in self.ranks if one is not best)
        return LawChoice((best, *others), beside_causes=True)

    def rank(self, law: str) -> LawRank | None:
        """The rank of a law; None if it was not compared."""
        return next((one for one in self.ranks if one.law == law), None)

    def better_than(self, law: str) -> tuple[LawRank, LawRank] | None:
        """The best of the laws other than one, and that one; None if it is no better."""
        own = self.rank(law)
        others = (one for one in self.ranks if one is not own)
        best = min(others, key=lambda one: one.left_out, default=None)
        if own is None or best is None or not best.left_out < own.left_out < np.inf:
            return None
        return best, own


def choose_law(
    campaign: Campaign,
    data: MeasuredRuns,
    degree: int | None,
    pool: ThreadPoolExecutor,
    *,
    seed: int = 0,
    advance: Callable[[], None] = lambda: None,
    laws: Iterable[str] = LAWS,
    prescribed: Device | None = None,
) -> LawChoice:
    """Fit every law to short data, the best few further, and rank them."""
    # The held-out runs validate the fit; each condition of the fitted runs is left out in turn as
    # well. A law with fewer numbers is preferred where the errors are nearly the same. ``advance``
    # is called after each law. A ``prescribed`` device stands for its law if its error on the same
    # data is smaller.
    # Raises InputError if no law gives finite forces.
    cycles = max(_SAMPLES / _A_CYCLE / len(data.dt), 1.5)
    short = data.cycles(cycles, _A_CYCLE)
    # all samples count alike: the errors that rank the laws are pooled over runs
    unit = _UNIT * float(np.std(data.force))
    short = replace(short, sigma=np.full(len(data.dt), unit))

    def fit(name: str) -> tuple[LawModel, Optimum | None]:
        p = parameterise(campaign, LAWS[name], short, degree)
        result = _fit(LawModel(short, p), seed)
        advance()
        return result

    fits = sorted(pool.map(fit, laws), key=_cost)
    if not np.isfinite(_cost(fits[0])):
        raise InputError(f"{campaign.name}: no law gives finite forces under the measured motion")
    first = _evaluate(*fits[0])

    def evaluate(fitted: tuple[LawModel, Optimum | None]) -> LawRank:
        result = _evaluate(*fitted, WRONG_FAMILY * first.left_out)
        advance()
        return result

    ranks = [first, *pool.map(evaluate, fits[1:])]
    likely = sorted(zip(ranks, fits, strict=True), key=lambda one: one[0].left_out)
    for one, (model, end) in likely[:_FINALISTS]:
        # these fits are rough: one of the same family may become the best
        if end is not None and one.error <= WRONG_FAMILY * min(rank.left_out for rank in ranks):
            model, further = refine_law(model, end.x, _RANKED)
            if model.error(further.x) < (1 - _RANKED) * one.error:
                # numbers that follow the fitted data more closely may predict others worse
                again = _evaluate(model, further)
                ranks[ranks.index(one)] = min(one, again, key=lambda rank: rank.left_out)
        advance()
    if prescribed is not None:
        own = _rank_prescribed(campaign, short, degree, prescribed)
        better = [one for one in ranks if one.law == own.law and one.left_out < own.left_out]
        ranks = [*(one for one in ranks if one.law != own.law), *(better or [own])]
    ranks.sort(key=lambda one: one.left_out)
    least = ranks[0].left_out
    best = min((r for r in ranks if r.left_out <= NEAR * least), key=lambda one: one.n_numbers)
    return LawChoice((best, *(one for one in ranks if one is not best)))


def _cost(fitted: tuple[LawModel, Optimum | None]) -> float:
    """Cost of a fit; infinite without finite forces."""
    end = fitted[1]
    return np.inf if end is None else end.cost


def _fit(model: LawModel, seed: int) -> tuple[LawModel, Optimum | None]:
    """Fit a law from a few starts; the model is held near the best of them."""
    fitted, p = model.data.without_held_out(), model.parameterisation

    def search(p: Parameterisation, start: NDArray) -> Optimum:
        return search_roughly(LawModel(fitted, p), start, SCREENING_STEPS, 1e-3)

    begin = screen_starts(p, search, _STARTS, seed)
    model = replace(model, expected=begin[0])
    near = replace(model, data=fitted)

    def resolved(end: Optimum) -> tuple[LawModel, Optimum]:
        missed = _UNIT * float(np.sqrt(2 * end.cost / np.sum(fitted.fitted)))
        here = replace(model, step_error=coarse_step_error(missed, _RESOLVES, _COARSEST))
        # one step that gains little is no end
        return here.resolve_steps(end.x, 1).minimise_resolved(end.x, _STEPS, 1e-4, _RANKED)

    ends = (search_roughly(near, start, _STEPS, 1e-3) for start in begin[:_RESOLVED])
    best = min(map(resolved, distinct(ends)), key=_cost, default=None)
    return best if best is not None and np.isfinite(_cost(best)) else (model, None)


def _rank_prescribed(
    campaign: Campaign, short: MeasuredRuns, degree: int | None, prescribed: Device
) -> LawRank:
    """The rank of a law with given values: no sample took part in a fit of them."""
    p = parameterise(campaign, prescribed.law, short, degree, prescribed=prescribed)
    values = p.of(prescribed)
    model = LawModel(short, p).resolve_steps(values).settle_starts(values)
    data = model.data
    residual = data.bounded(model.forces(values, False)[0]) - data.force
    error = data.relative(residual, data.fitted)
    left_out = data.relative(residual, np.ones(len(residual), bool))
    return LawRank(
        prescribed.law.name, prescribed.law.title, len(p.scale), error, left_out, values, True
    )


def _evaluate(model: LawModel, end: Optimum | None, most: float = np.inf) -> LawRank:
    """The rank of a fitted law, cross-validated over conditions if its error is small enough."""
    law, n_numbers = model.parameterisation.law, len(model.parameterisation.scale)
    if end is None:
        return LawRank(law.name, law.title, n_numbers, np.inf, np.inf)
    error = model.error(end.x)
    near = error <= most
    left_out = _left_out(model, end.x, cross_validated=near)
    return LawRank(
        law.name, law.title, n_numbers, error, left_out if near else max(left_out, error), end.x
    )


def _left_out(model: LawModel, values: NDArray, cross_validated: bool) -> float:
    """Relative error of all samples, those of each condition by a fit without it."""
    model = model.resolve_steps(values, 1)
    data = model.data

    def residual(x: NDArray) -> NDArray:
        return data.bounded(model.resolve_steps(x, 1).forces(x, False)[0]) - data.force

    total = residual(values)
    n_currents = len(model.parameterisation.currents)
    masks = [mask for _, mask in folds_of(data, n_currents)] if cross_validated else []
    ends = fitted_without(model, [values] * len(masks), masks, _FOLD_STEPS)
    for mask, own in zip(masks, map(residual, ends), strict=True):
        total[mask] = own[mask]
    return data.relative(total, np.ones(len(total), bool))
