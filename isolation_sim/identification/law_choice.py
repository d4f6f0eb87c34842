"""Which law fits a campaign: all registered laws compared on short data."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..laws.law import Law
from ..laws.registry import LAWS
from .campaign import Campaign
from .law_fit import LawModel, parameterise
from .least_squares import Optimum
from .left_out import conditions
from .measured_runs import MeasuredRuns, measured_runs
from .multistart import distinct, screen_starts
from .parameterisation import Parameterisation

AUTO = "auto"
"""Word in place of a law's name that compares all laws."""
HELD_OUT = 4
"""One run in this many is held out to compare the laws, if the campaign marks none."""
NEAR = 1.05
"""Factor on the least error up to which a law with fewer parameters is preferred."""
WRONG_FAMILY = 2.0
"""Factor on the least error above which a law is of the wrong family."""
_SAMPLES, _A_CYCLE = 4000, 60
_FINALISTS = 8
_COMPARED = 4
"""Best laws of which conditions are left out in turn."""
_FOLD_STEPS = 20
"""Steps of a fit without one condition, from the values of the fit to all."""
_RESOLVED = 3
"""Best ends of a law's searches that are fitted with resolved integration steps."""


@dataclass(frozen=True)
class LawRank:
    """How well a law fits."""

    # law, title: Registry name, and name to print
    law: str
    title: str
    n_numbers: int  # Numbers that were fitted
    # error, left_out: RMS residual over RMS force, of the fitted runs and of what was not fitted:
    # runs held out and, for the best laws, each condition of the others in turn; infinite for a
    # law without finite forces
    error: float
    left_out: float
    # (n_numbers,): Unknowns of the fit, as ``parameterise`` has them; empty without finite forces
    values: NDArray = field(default_factory=lambda: np.zeros(0), compare=False, repr=False)


@dataclass(frozen=True)
class LawChoice:
    """Registered laws compared on a campaign."""

    ranks: tuple[LawRank, ...]  # The law to use first, then by the error on the runs held out

    @property
    def best(self) -> LawRank:
        """The law to use."""
        return self.ranks[0]

    @property
    def near(self) -> tuple[LawRank, ...]:
        """Laws of the right family: with at most twice the least error."""
        least = min(one.left_out for one in self.ranks)
        return tuple(one for one in self.ranks if one.left_out <= WRONG_FAMILY * least)

    @property
    def text(self) -> str:
        """The choice in words."""
        best, near = self.best, [one.law for one in self.near if one is not self.best]
        text = (
            f"Of {len(self.ranks)} laws {best.law} fits best: fitted to short data, it misses what "
            f"was left out of the fit by {100 * best.left_out:.3g} %."
        )
        if near:
            text += f" Within twice that error: {', '.join(near)}."
        return text + " The others are of another family."

    def rank(self, law: str) -> LawRank | None:
        """The rank of a law; None if it was not compared."""
        return next((one for one in self.ranks if one.law == law), None)


def choose_law(
    campaign: Campaign,
    degree: int | None,
    pool: ThreadPoolExecutor,
    *,
    seed: int = 0,
    advance: Callable[[], None] = lambda: None,
    laws: Iterable[str] = LAWS,
) -> LawChoice:
    """Fit every law to short data, the best few again from more starts, and rank them."""
    # The fitted runs are fitted and those held out judge; of the best laws, each condition of the
    # fitted runs is left out in turn as well. A law with fewer numbers is preferred where the
    # errors are nearly the same. ``advance`` is called after each law.
    # Raises InputError if no law gives finite forces.
    data = measured_runs(campaign.runs, HELD_OUT)
    cycles = max(_SAMPLES / _A_CYCLE / len(data.dt), 1.5)
    short = data.cycles(cycles, _A_CYCLE)
    # all samples count alike: the errors that rank the laws are pooled over runs
    short = replace(short, sigma=np.full(len(data.dt), float(np.std(data.force))))

    def rank(name: str, starts: int, most: int) -> LawRank:
        result = _rank(campaign, LAWS[name], short, degree, pool, starts, most, seed)
        advance()
        return result

    ranks = sorted((rank(name, 8, 40) for name in laws), key=lambda one: one.left_out)
    again = [rank(one.law, 24, 200) for one in ranks[:_FINALISTS]]
    final = [min(pair, key=lambda o: o.error) for pair in zip(ranks, again, strict=False)]
    final.sort(key=lambda one: one.left_out)
    if not np.isfinite(final[0].left_out):
        raise InputError(f"{campaign.name}: no law gives finite forces under the measured motion")
    for place, one in enumerate(final[:_COMPARED]):
        model = LawModel(short, parameterise(campaign, LAWS[one.law], short, degree))
        final[place] = replace(one, left_out=_left_out(model, one.values, pool))
    ranks = sorted([*final, *ranks[_FINALISTS:]], key=lambda one: one.left_out)
    least = ranks[0].left_out
    first = min((r for r in ranks if r.left_out <= NEAR * least), key=lambda one: one.n_numbers)
    return LawChoice((first, *(one for one in ranks if one is not first)))


def _rank(
    campaign: Campaign, law: Law, data: MeasuredRuns, degree: int | None,
    pool: ThreadPoolExecutor, starts: int, most: int, seed: int,
) -> LawRank:  # fmt: skip
    """Fit a law to short data from a few starts."""
    fitted = data.without_held_out()
    p = parameterise(campaign, law, data, degree)

    def search(p: Parameterisation, start: np.ndarray, steps: int = 25) -> Optimum:
        for n_steps in (2, 8, 64):
            result = LawModel(fitted, p, n_steps).minimise(start, steps, 1e-3)
            if np.isfinite(result.cost):
                break
        return result

    def resolved(end: Optimum) -> LawRank:
        model = LawModel(data, p).resolve_steps(end.x, 1)
        end = replace(model, data=fitted).minimise(end.x, most, 1e-4)
        return LawRank(law.name, law.title, len(p.scale), *_errors(model, end), end.x)

    begin = screen_starts(p, search, pool, starts, seed)
    ends = pool.map(lambda start: search(p, start, most), begin[: max(2, starts // 3)])
    none = LawRank(law.name, law.title, len(p.scale), np.inf, np.inf)
    tried = pool.map(resolved, distinct(ends)[:_RESOLVED])
    return min(tried, key=lambda one: one.error, default=none)


def _left_out(model: LawModel, values: NDArray, pool: ThreadPoolExecutor) -> float:
    """Relative error of all samples, each by a fit without its condition."""
    data, model = model.data, model.resolve_steps(values, 1)
    masks = [mask for _, mask in conditions(data)]

    def residual(x: NDArray) -> NDArray:
        return data.bounded(model.forces(x, False)[0]) - data.force

    def without(mask: NDArray) -> NDArray:
        fewer = replace(model, data=replace(data, fitted=data.fitted & ~mask))
        return residual(fewer.minimise(values, _FOLD_STEPS, 1e-4).x)

    total = residual(values)
    for mask, own in zip(masks, pool.map(without, masks), strict=True):
        total[mask] = own[mask]
    return data.relative(total, np.ones(len(total), bool))


def _errors(model: LawModel, end: Optimum) -> tuple[float, float]:
    """Relative errors of the fitted and of the held-out samples; the same if none is held out."""
    data = model.data
    residual = data.bounded(model.forces(end.x, False)[0]) - data.force
    judged = data.fitted if data.fitted.all() else ~data.fitted
    return data.relative(residual, data.fitted), data.relative(residual, judged)
