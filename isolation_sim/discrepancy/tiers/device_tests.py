"""The tiers of device tests: laws with an equation or a learned term, fitted to a campaign."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...archive import law_of
from ...effects import extend
from ...identification.cross_validation import fitted_without, folds_of, of_parts
from ...identification.measured.noise import correlation_time
from ...identification.measured_runs import MeasuredRuns
from ...laws import Device
from ..decisions import (
    ADEQUATE,
    BEYOND_TESTS,
    EQUATION_GAIN,
    EQUATION_SIGNIFICANT,
    LOST,
    NEARLY_ALL,
    NEGLIGIBLE_LOSS,
    REMAINS,
    TIER_SAMPLES,
)
from ..device.carried_history import of_device_in_order
from ..device.generic_terms import OUTSIDE
from ..device.model import FittedModel, Model, fit_model
from ..diagnosis import Diagnosis, Errors
from ..inference import at_bound, gain_interval, half_widths
from ..interval import Interval
from ..verdict import Verdict
from .equation import select
from .ladder import D, Tiers
from .law_file import Chosen, Network, TermParameterisation, first_place, law_text, shown
from .learned import learn
from .result import EquationTerm, Rung

if TYPE_CHECKING:
    from ...identification.law_choice import LawRank
    from ..adapters.device_tests import DeviceTests

_FOLD_STEPS = 10
"""Steps of a fit without one condition, from the values of the fit to all."""
_LAST_STEPS = 30


@dataclass(frozen=True, eq=False)
class _Rung:
    """A rung on all samples and on those that select, and its fits without each condition."""

    final: FittedModel
    part: FittedModel
    ends: tuple[NDArray, ...]  # Values of the fits without each condition
    without: NDArray  # Their forces
    left_out: NDArray
    chosen: tuple[Chosen, ...] = ()
    stability: tuple[float, ...] = ()
    text: str = ""
    loses: bool = False  # Whether an equation predicts some condition worse than the law


class DeviceTiers(Tiers[_Rung]):
    """Models of all rungs, for device tests."""

    def __init__(self, problem: DeviceTests):
        self.problem, self.progress = problem, problem.progress  # After its search
        self.negligible = problem.significance
        self.progress("leaving conditions out")
        full = problem.data
        self.data = full.thinned(TIER_SAMPLES).without_held_out()
        base = problem.law.model.parameterisation
        self.masks = [mask for _, mask in folds_of(self.data, len(base.currents))]
        self.law, self.causes = (
            _Rung(final, part, *self._without(part, [part.values] * len(self.masks)))
            for final in (problem.law, problem.final)
            for part in (self._part(final),)
        )

    def _rung(
        self, part: FittedModel, chosen: Sequence[Chosen], stability: Sequence[float], text: str,
        starts: Sequence[NDArray] | None = None,
    ) -> _Rung:  # fmt: skip
        """A rung from its model on the samples that select, not yet fitted to all."""
        whole = replace(part.model, data=self.problem.data).resolve_steps(part.values)
        nothing = np.zeros((0, len(part.values)))
        final = FittedModel(whole, part.values, part.cost, nothing[:, 0], nothing)
        return _Rung(
            final, part, *self._without(part, starts or [part.values] * len(self.masks)),
            tuple(chosen), tuple(stability[: len(chosen)]), text,
        )  # fmt: skip

    def _part(self, final: FittedModel) -> FittedModel:
        """A model on the samples that select, fitted a little further."""
        here = replace(final.model, data=self.data)
        return self._fitted(here, final.values, 1e-4, _FOLD_STEPS)

    def _without(
        self, part: FittedModel, starts: Sequence[NDArray]
    ) -> tuple[tuple[NDArray, ...], NDArray, NDArray]:
        """Fits without each condition: values, forces, (n_folds, n_samples), and residual."""

        def force(values: NDArray) -> NDArray:
            # without a condition a law may become stiffer, and its motion asks for more steps then
            model = part.model.resolve_steps(values)
            return self.data.bounded(model.forces(values, False)[0])

        pool = self.problem.pool
        ends = fitted_without(part.model, starts, self.masks, _FOLD_STEPS, pool.map)
        without = np.stack(list(pool.map(force, ends)))
        return tuple(ends), without, self._left_out(without)

    def _left_out(self, without: NDArray) -> NDArray:
        """Residual of every condition, predicted by the model fitted without it, N."""
        residual = np.zeros(len(self.data.x))
        for mask, force in zip(self.masks, without, strict=True):
            residual[mask] = (force - self.data.force)[mask]
        return residual

    def equation(self) -> _Rung | None:
        """The second tier, beside the causes or in their place; None if no term helps."""
        if len(self.masks) < 2:  # one condition left out does not tell a gain from chance
            return None
        beside = self._catalogue(self.causes)
        starts = [(beside, "")]
        if beside.part.effects:
            starts.append((self.law, ""))
        # the regression may miss the term that the search for causes found through the simulation
        found = [one.form for one in self.causes.part.effects if one.cause == OUTSIDE]
        starts += [(beside, form) for form in found[:1]]
        equations = [rung for start in starts if (rung := self._equation(*start)) is not None]
        return min(equations, key=lambda one: (one.loses, _power(one)), default=None)

    def _equation(self, below: _Rung, first: str) -> _Rung | None:
        """The equation beside a rung, with the terms that it needs; ``first``: as of ``select``.

        It loses nowhere, if there is such a one; else it is the one with the most terms.
        """
        start = below.part
        selection = select(start.model, start.values, self.masks, self.problem.pool, first)
        terms = list(zip(selection.chosen, selection.stability, strict=True))
        numbers = [
            np.concatenate([c, [n.value for n in one.term.numbers]])
            for one, c in zip(selection.chosen, selection.coefficients, strict=True)
        ]
        own, at = selection.values, start.model.n_law
        best, losing, least = None, None, np.inf
        while terms:
            chosen, stability = zip(*terms, strict=True)
            model, text = self._extended(start.model, chosen, None)
            values = np.insert(own, at, np.concatenate(numbers))
            rung = self._rung(self._fitted(model, values, 1e-5), chosen, stability, text)
            good = self._is_good(rung)
            if not good:
                beside = self._beside(below, rung)
                if self._is_good(beside):
                    rung, good = beside, True
            # fewer terms are kept where they predict nearly as well, or where chance fits the more
            if good and (
                best is None
                or _power(rung) <= (1 + EQUATION_GAIN) * least
                or _is_chance(best.part, rung.part)
            ):
                best, least = rung, min(least, _power(rung))
            elif best is not None:
                break
            losing = losing or rung
            ends = at + np.cumsum([0, *(len(one) for one in numbers)])
            places = [np.arange(a, b) for a, b in pairwise(ends)]
            weakest = int(np.argmin([
                rung.part.significance(place[: len(one.powers)])
                for place, one in zip(places, chosen, strict=True)
            ]))  # fmt: skip
            fitted = rung.part.values
            own = np.delete(fitted, np.concatenate(places))
            numbers = [fitted[place] for place in places]
            del terms[weakest], numbers[weakest]
        if best is None and losing is not None:
            best = replace(losing, loses=True)
        if best is None or _is_chance(best.part, start):
            return None
        if best.part.model.held is None:
            best = self._without_superfluous_effects(best)
        if best.part.model.held is None and not (best.loses or start.effects):
            # values that follow the terms have to predict what was left out better
            beside = self._beside(below, best)
            nearly = _power(beside) <= (1 + EQUATION_GAIN) * _power(best)
            best = beside if nearly and self._is_good(beside) else best
        return replace(best, final=self._fitted(best.final.model, best.part.values, 1e-6))

    def _is_good(self, rung: _Rung) -> bool:
        """Whether a rung is worse than the law nowhere."""
        return not (self.losses(rung, self.law) or self._beyond(rung, self.law))

    def _beside(self, below: _Rung, rung: _Rung) -> _Rung:
        """The terms of a rung beside a rung below it, all of whose values stay."""
        # where the law's values follow the terms, what one condition needs may move the others
        at = self.problem.law.model.n_law
        n = len(rung.part.values) - len(below.part.values)
        terms = rung.part.values[at : at + n]
        held = np.ones(len(rung.part.values), bool)
        held[at : at + n] = False
        model = replace(rung.part.model, held=held)
        part = self._fitted(model, np.insert(below.part.values, at, terms), 1e-5)
        terms = part.values[at : at + n]
        starts = [np.insert(end, at, terms) for end in below.ends]
        return self._rung(part, rung.chosen, rung.stability, rung.text, starts)

    def _without_superfluous_effects(self, rung: _Rung) -> _Rung:
        """The rung without effects that gain no more than chance beside its terms."""
        part = rung.part
        for place in reversed(range(len(part.model.effects))):
            values = np.delete(part.values, part.model.slices()[place])
            fewer = self._fitted(part.model.without(place), values, 1e-5)
            if _is_chance(part, fewer):
                part = fewer
        if part is rung.part:
            return rung
        rest = self._rung(part, rung.chosen, rung.stability, rung.text)
        return replace(rest, loses=rung.loses)

    def _fitted(
        self, model: Model, values: NDArray, tolerance: float, most: int = _LAST_STEPS
    ) -> FittedModel:  # fmt: skip
        """A model fitted with as many steps as it needs; a term's state may be fast."""
        here = model.resolve_steps(values, 1)
        return FittedModel.of(*here.minimise_resolved(values, most, tolerance))

    def learned(self, below: _Rung) -> tuple[_Rung, float]:
        """The third tier, beside a rung below, whose values stay, and its share (``Learned``)."""
        below = self._catalogue(below)
        start, without = below.part, below.without
        term = learn(start.model, start.force, without, self.masks, self.problem.seed)
        model, text = self._extended(start.model, below.chosen, term.network)
        part = fit_model(model.resolve_steps(start.values, 1), start.values, 0)
        whole = replace(model, data=self.problem.data).resolve_steps(start.values)
        return _Rung(
            fit_model(whole, start.values, 0), part, below.ends, without, term.left_out,
            below.chosen, below.stability, text,
        ), term.share  # fmt: skip

    def _catalogue(self, rung: _Rung) -> _Rung:
        """A rung without generic terms, for which an equation is the place."""
        if OUTSIDE not in rung.part.causes:
            return rung
        model, values = rung.part.model, rung.part.values
        for place, cause in reversed(list(enumerate(model.causes))):
            if cause == OUTSIDE:
                gone = model.slices()[place]
                values = np.delete(values, np.arange(gone.start, gone.stop))
                model = model.without(place)
        part = fit_model(model, values, _LAST_STEPS, 1e-5)
        return self._rung(part, rung.chosen, rung.stability, rung.text)

    def _extended(
        self, model: Model, chosen: Sequence[Chosen], network: Network | None
    ) -> tuple[Model, str]:
        """The model with a law that has terms and a learned term."""
        base = self.problem.law.model.parameterisation
        what = "an equation" if network is None else "a learned term"
        title = f"{base.law.title}, with {what} found in {self.problem.campaign.name}."
        text = law_text(base.law, chosen, network, title)
        powers: dict[str, tuple[int, ...]] = {}
        for k, one in enumerate(chosen, start=first_place(base.law)):
            powers[f"c_{k}"] = one.powers
            powers |= {f"{n.symbol}_{k}": (0,) for n in one.term.numbers}
        # a law reads the current through a parameter that is its first power
        held = {
            f"i_{k}": [0.0, 1.0]
            for k, one in enumerate(chosen, start=first_place(base.law))
            if one.term.current
        }
        if network is not None:
            largest = float(np.max(np.abs(self.data.current))) or 1.0
            held |= {f"share_{k}": [0.0] * k + [largest**-k] for k in range(len(network.weights))}
        own = TermParameterisation(law_of(text), base, powers, held)
        expected = model.expected
        if expected is not None:
            expected = np.concatenate([expected, np.zeros(len(own.scale) - len(expected))])
        return replace(model, parameterisation=own, expected=expected, inside=None), text

    def losses(self, rung: _Rung, against: _Rung) -> tuple[str, ...]:
        """Conditions left out of a fit, and conditions held out, on which a rung loses."""
        data = self.problem.data
        every = np.logical_or.reduce(self.masks)
        # a law may diverge without some condition: its own error then tells nothing
        missed = min(self.data.relative(one.left_out, every) for one in (rung, against))
        least = max(self.problem.significance, NEGLIGIBLE_LOSS * missed)
        after, before = (data.bounded(one.final.force) - data.force for one in (rung, against))
        held = replace(data, fitted=~data.fitted)
        return (
            *_lost(rung.left_out, against.left_out, self.data, least),
            *(f"{name} (held out)" for name in _lost(after, before, held, least)),
        )

    def _beyond(self, rung: _Rung, against: _Rung) -> tuple[str, ...]:
        """Tests beyond whose range a rung, unlike another, runs away or gives energy back."""
        bad = self._bad_beyond(rung)
        if bad:
            bad -= self._bad_beyond(against)
        return tuple(
            f"{name}, {BEYOND_TESTS:g} times its motion" for name in self.data.names if name in bad
        )

    def _bad_beyond(self, rung: _Rung) -> set[str]:
        """Names of the tests beyond whose range a rung runs away or gives energy back."""
        factor, data = BEYOND_TESTS, self.data
        larger = replace(data, x=factor * data.x, v=factor * data.v, a=factor * data.a)
        # an instrument's delay turns the loops of fast motion, but gives no energy
        model, values = rung.part.model.without_instruments(rung.part.values)
        # a stop grows beyond any measure there, and gives back no more than it took
        model, values = model.without_springs(values)
        model = replace(model, data=larger)
        force = model.resolve_steps(values).forces(values, False)[0]
        bounded = data.bounded(force)
        return {
            name for name, run in zip(data.names, data.runs, strict=True)
            if not np.array_equal(force[run], bounded[run]) or force[run] @ larger.v[run] < 0
        }  # fmt: skip

    def errors(self, name: str, rung: _Rung, below: Sequence[Rung] = ()) -> Rung:
        """Errors of a rung, and where it loses against the law or the rungs below it."""
        data = self.problem.data
        residual = data.bounded(rung.final.force) - data.force
        result = Rung(
            name,
            data.relative(residual, data.fitted),
            data.relative(residual, ~data.fitted),
            self.data.relative(rung.left_out, np.logical_or.reduce(self.masks)),
        )
        if not below:
            return result
        return replace(
            result,
            worse=self.losses(rung, self.law),
            beyond=self._beyond(rung, self.law),
            worse_than=tuple(
                one.name for one in below if _loses(result, one, self.problem.significance)
            ),
        )

    def terms(self, rung: _Rung) -> tuple[EquationTerm, ...]:
        """Terms of an equation with their 95 % intervals."""
        final = rung.final
        memory = correlation_time(final.residual, np.array([0, len(final.residual)]))
        n, n_values = final.jacobian.shape
        variance = memory * float(final.residual @ final.residual) / max(n - n_values, 1)
        half = half_widths(final.jacobian, variance)
        lower, upper = final.model.bounds()
        first = first_place(self.problem.law.model.parameterisation.law)
        at = self.problem.law.model.n_law
        result = []
        for k, (one, stable) in enumerate(
            zip(rung.chosen, rung.stability, strict=False), start=first
        ):
            numbers = {}
            units = [(f"c_{k}_{p}", one.unit(p)) for p in one.powers]
            units += [(f"{n.symbol}_{k}", n.unit) for n in one.term.numbers]
            for name, unit in units:
                value = float(final.values[at])
                numbers[name] = Interval(
                    value,
                    float(max(value - half[at], lower[at])),
                    float(min(value + half[at], upper[at])),
                    unit,
                    at_bound(value, float(lower[at]), float(upper[at])),
                )
                at += 1
            result.append(EquationTerm(shown(one, k), stable, numbers))
        return tuple(result)

    def device(self, rung: _Rung, like: Device) -> Device:
        """The rung's law as a device."""
        final = rung.final.without_offsets
        inner = replace(
            like,
            law=final.model.parameterisation.law,
            current=final.model.parameterisation.dependence(final.values[: final.model.n_law]),
            name="",
        )
        applied = of_device_in_order(final.effects, final.model.parameters_of(final.values))
        return extend(inner, applied) if final.effects else inner

    def replaced_causes(self, rung: _Rung) -> tuple[str, ...]:
        """Causes of the catalogue in whose place an equation stands."""
        left = rung.final.causes
        return tuple(cause for cause in self.causes.final.causes if cause not in left)

    def has_generic_terms(self) -> bool:
        """Whether causes include a term that no law file can hold."""
        return OUTSIDE in self.causes.final.causes

    def is_simpler(self, one: _Rung, other: _Rung) -> bool:
        """Whether a rung has fewer numbers than another one."""
        return len(one.final.values) < len(other.final.values)

    def better_law(self) -> tuple[LawRank, LawRank] | None:
        """The best of the other laws compared, and the law itself; None if none is better."""
        choice = self.problem.choice
        name = self.problem.law.model.parameterisation.law.name
        return choice.better_than(name) if choice is not None else None

    def noise_floor(self, diagnosis: Diagnosis) -> float:
        """Error that noise alone leaves on the validation data."""
        return diagnosis.noise.held_out

    def verdict(
        self, diagnosis: Diagnosis, rung: _Rung, named: float, least: float, before: float
    ) -> Verdict:
        """Explained means down to the best attainable model, and no more than little beyond it."""
        if diagnosis.verdict in ("adequate", "explained"):
            return diagnosis.verdict
        floor, data = self.noise_floor(diagnosis), self.problem.data
        fitted = data.relative(data.bounded(rung.final.force) - data.force, data.fitted)
        remains, misfit = named**2 - floor**2, before**2 - floor**2
        little = remains < NEARLY_ALL * misfit and (
            max(remains, fitted**2 - diagnosis.noise_floor**2) < REMAINS**2
        )
        if little and named**2 < ADEQUATE * least**2:
            return "explained"
        # a tier that removes next to nothing explains no part
        return "partly_explained" if remains < (1 - NEARLY_ALL) * misfit else diagnosis.verdict

    def extend(self, diagnosis: D, rung: _Rung, errors: Rung) -> D:
        """A diagnosis whose extended device has the rung's law."""
        assert diagnosis.nominal is not None
        data = self.problem.data
        force = data.bounded(rung.final.force)
        after = {name: force[run] for name, run in zip(data.names, data.runs, strict=True)}
        errors_after = Errors(errors.fit, errors.held_out)
        return replace(
            diagnosis,
            noise_floor=min(diagnosis.noise_floor, errors.fit),
            held_out_noise_floor=min(diagnosis.held_out_noise_floor, errors.held_out),
            error_after=errors_after,
            extended=self.device(rung, diagnosis.nominal),
            gain=gain_interval(
                self.problem.errors.squared_blocks(self.problem.before, force), self.problem.seed
            ),
            traces=tuple(replace(one, after=after[one.name]) for one in diagnosis.traces),
        )


def _is_chance(more: FittedModel, fewer: FittedModel) -> bool:
    """Whether a model with more terms fits better by no more than chance would."""
    residual = more.residual
    memory = correlation_time(residual, np.array([0, len(residual)]))
    noise = memory * float(residual @ residual) / len(residual)
    return fewer.cost - more.cost < EQUATION_SIGNIFICANT * noise


def _power(rung: _Rung) -> float:
    """Squared residual of the conditions left out, N^2."""
    return float(rung.left_out @ rung.left_out)


def _lost(after: NDArray, before: NDArray, data: MeasuredRuns, least: float) -> Iterator[str]:
    """Conditions of the fitted samples on which a residual (N) is larger than the one before."""
    if not data.fitted.any():
        return
    folds = folds_of(data)
    gains = [float(before[mask] @ before[mask] - after[mask] @ after[mask]) for _, mask in folds]
    # parts of one motion are no conditions of their own: what the other parts gain counts as well
    accepted = LOST * sum(max(gain, 0.0) for gain in gains) if of_parts(data) else 0.0
    for (name, mask), gain in zip(folds, gains, strict=True):
        if data.relative(after, mask) > data.relative(before, mask) + least and -gain > accepted:
            yield name


def _loses(one: Rung, other: Rung, least: float) -> bool:
    """Whether a rung predicts all that was left out, or all that was held out, worse."""
    pairs = ((one.left_out, other.left_out), (one.held_out, other.held_out))
    return any(mine > its + least for mine, its in pairs)
