"""The tiers of building records: an equation or a learned term in the law of the isolators.

Terms are selected on the isolation layer as a device test (``building.isolation_force``). The law
with the terms then stands in the building, whose response all numbers are fitted to.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ...archive import law_of
from ...errors import Diverged
from ...identification.characteristic_scales import characteristic_scale
from ...identification.cross_validation import folds_of
from ...identification.measured_runs import MeasuredRuns
from ...laws.current_dependence import CurrentDependence
from ...laws.law import Law
from ..adapters.building import BuildingRecords, extended_device, intervals, traces_of
from ..building.causes.candidate import Candidate, Parameter, Values
from ..building.comparison import BuildingComparison, CauseValues, FittedBuilding, with_causes
from ..building.errors import excess_error, mean_error, relative_noise, squared_blocks
from ..building.goodness_of_fit import is_quiet, noise_chance, p_value
from ..building.isolation_force import effect_values, layer_model
from ..building.model import BuildingModel, total_force_scale
from ..building.record import BuildingRecord
from ..decisions import (
    BEYOND_TESTS,
    FALSE_ALARM,
    LEAST_BUILDING_SHARE,
    NEARLY_RIGHT,
    NOT_WORSE,
    TO_BLAME,
)
from ..diagnosis import BuildingDiagnosis, Diagnosis, Errors
from ..inference import gain_interval
from ..verdict import Verdict
from .equation import Selection, select
from .ladder import D, Tiers
from .law_file import Chosen, Network, first_place, law_text, number_range, shown
from .learned import learn
from .result import EquationTerm, Rung
from .terms import along

EQUATION, LEARNED = "equation", "learned_term"
_TERMS_TRIED = 100
"""Terms of the library, about: the level of the test for a term is divided by it."""
_TRIAL_STEPS = 4
"""Steps of a fit without one term."""
_MOST_SHARE = 2.0
"""Factor on the learned term, at most, with which it stands in the building."""


@dataclass(frozen=True, eq=False)
class _Rung:
    """A model of the building, with the terms in its isolators' law."""

    outcome: FittedBuilding
    chosen: tuple[Chosen, ...] = ()
    stability: tuple[float, ...] = ()
    text: str = ""

    @property
    def causes(self) -> CauseValues:
        """Causes in it, without terms."""
        values = self.outcome.cause_values
        return tuple(one for one in values if one[0].name not in (EQUATION, LEARNED))


class BuildingTiers(Tiers[_Rung]):
    """Models of all rungs, for building records."""

    superseded = ("law",)
    QUANTITY = "measured signal"
    WORSE_THAN = "{} not offered: it does not remove enough of the held-out misfit of the {}."
    NO_EQUATION = "No term of an equation is needed by the building's response."

    def __init__(self, problem: BuildingRecords, best: FittedBuilding, pool: ThreadPoolExecutor):
        self.problem, self.pool, self.progress = problem, pool, problem.progress
        space = problem.space
        # the right law would leave little, and is looked for with weights that expect it
        expected = NEARLY_RIGHT * excess_error(space.comparison, space.before)
        self._weigh(space.comparison.expecting(expected), best.cause_values)
        self.base = self.comparison.model.device.law

    def _weigh(self, comparison: BuildingComparison, causes: CauseValues) -> None:
        """Set the weights of the data."""
        self.comparison = comparison
        self.law, self.causes = (_Rung(comparison.evaluate(values)) for values in ((), causes))

    def equation(self) -> _Rung | None:
        """The second tier, beside the causes or in their place; None if no term is needed."""
        if is_quiet(self.comparison, self.causes.outcome):
            return None  # noise alone asks for no term, as for no cause
        starts = [self.causes.causes]
        if starts[0]:
            starts.append(())
        selections = [(causes, *self._selected(causes)) for causes in starts]
        # each set of terms is another law to compile: the likelier one first
        selections.sort(key=lambda one: one[1].criterion(one[2]))
        rungs = (self._equation(causes, terms) for causes, terms, _ in selections if terms.chosen)
        rung = next((rung for rung in rungs if rung is not None), None)
        if rung is None:
            return None
        # as after every cause, the noise is estimated again
        values = rung.outcome.cause_values
        self._weigh(self.comparison.with_noise_beside(values), self.causes.causes)
        return replace(rung, outcome=self.comparison.fit((), values))

    def _selected(self, causes: CauseValues) -> tuple[Selection, int]:
        """Terms beside some causes, along the isolators' motion, and the number of residuals."""
        layer = layer_model(self.comparison, causes)
        fitted = layer.data.fitted
        folds = [mask[fitted] for _, mask in folds_of(layer.data)]
        values = effect_values(self.comparison.model, causes)
        return select(layer, values, folds, self.pool), int(fitted.sum())

    def _equation(self, causes: CauseValues, selection: Selection) -> _Rung | None:
        """The equation beside some causes, with the terms that the building's response needs."""
        terms = self._terms(selection.chosen, self._text(selection.chosen, None))
        numbers = np.concatenate([
            [*c, *(n.value for n in one.term.numbers)]
            for one, c in zip(selection.chosen, selection.coefficients, strict=True)
        ])  # fmt: skip
        fit = self.comparison.fit
        without = fit((), causes) if causes else self.law.outcome
        outcome = fit((), (*causes, (terms.candidate(), tuple(numbers.tolist()))))
        # what helps along the measured motion may not in the building
        while len(terms.active) > 1:
            fitted = np.array(outcome.cause_values[-1][1])
            trials = []
            for one in terms.active:
                fewer, remaining = terms.without(one, fitted)
                start = (fewer.candidate(), tuple(remaining.tolist()))
                trials.append((fewer, fit((), (*outcome.cause_values[:-1], start), _TRIAL_STEPS)))
            fewer, trial = min(trials, key=lambda one: one[1].cost)
            if self._needs(trial, outcome):
                break
            terms, outcome = fewer, fit((), trial.cause_values)
        if not self._needs(without, outcome):
            return None
        chosen, text = terms.chosen, terms.text
        if len(chosen) < len(selection.chosen):
            # the law without the terms that were left out
            text = self._text(chosen, None)
            own = self._terms(chosen, text)
            values = outcome.cause_values[-1][1]
            last = (own.candidate(), values)
            outcome = self.comparison.evaluate((*outcome.cause_values[:-1], last), outcome.optimum)
        stability = tuple(selection.stability[k] for k in terms.active)
        return _Rung(outcome, chosen, stability, text)

    def _needs(self, without: FittedBuilding, outcome: FittedBuilding) -> bool:
        """Whether the fitted data need the terms by which two models differ."""
        n = outcome.n_independent
        return (
            np.isfinite(outcome.cost)
            and outcome.criterion(n) < without.criterion(n)
            and p_value(self.comparison, without, outcome) * _TERMS_TRIED < FALSE_ALARM
            and without.cost - outcome.cost > LEAST_BUILDING_SHARE * self.law.outcome.cost
        )

    def _terms(self, chosen: tuple[Chosen, ...], text: str) -> _Terms:
        model = self.comparison.model
        return _Terms(self.base, chosen, text, (total_force_scale(model), model.device.length))

    def _text(self, chosen: Sequence[Chosen], network: Network | None) -> str:
        what = "an equation" if network is None else "a learned term"
        title = f"{self.base.title}, with {what} found in {self.problem.data_name}."
        return law_text(self.base, chosen, network, title)

    def learned(self, below: _Rung) -> tuple[_Rung, float]:
        """The third tier, beside a rung below, whose values stay, and its share (``Learned``)."""
        causes = below.causes
        layer = layer_model(self.comparison, causes)
        data = layer.data
        force = layer.forces(effect_values(self.comparison.model, causes), False)[0]
        fixed: dict[str, list[float]] = {}
        if below.chosen:
            values = np.array(below.outcome.cause_values[-1][1])
            terms = self._terms(below.chosen, below.text)
            fixed = terms.rows(values)
            force = force + data.record_changes(terms.along(values, data))
        folds = [mask for _, mask in folds_of(data)]
        term = learn(layer, force, np.stack([force] * len(folds)), folds, self.problem.seed)
        text = self._text(below.chosen, term.network)
        largest = float(np.max(np.abs(data.current))) or 1.0
        powers = range(len(term.network.weights))
        law = law_of(text)

        def apply(model: BuildingModel, values: Values) -> BuildingModel:
            shares = {f"share_{k}": [0.0] * k + [values[0] * largest**-k] for k in powers}
            return _with_law(model, law, fixed | shares)

        share = Parameter("share", "1", 0.0, _MOST_SHARE)
        candidate = Candidate(LEARNED, "", (share,), ((1.0,),), apply, "a learned term")
        outcome = self.comparison.fit(causes, ((candidate, (1.0,)),))
        return _Rung(outcome, below.chosen, below.stability, text), term.share

    def errors(self, name: str, rung: _Rung, below: Sequence[Rung] = ()) -> Rung:
        """Errors of a rung, and where it loses against the law or the rungs below it."""
        fit, held_out = (mean_error(self.comparison, rung.outcome, held) for held in (False, True))
        result = Rung(name, fit, held_out, float("nan"))
        if name in ("law", "causes"):
            return result
        floor = relative_noise(self.comparison, True)
        left = max(held_out**2 - floor**2, 0.0)
        # as causes, terms must remove a good part of what simpler models leave
        most = 1 - TO_BLAME
        return replace(
            result,
            worse=self._losses(rung),
            beyond=tuple(
                f"{record.name}, {BEYOND_TESTS:g} times its ground motion"
                for record in self.comparison.records if self._gives_energy(rung, record)
            ),
            worse_than=tuple(
                one.name for one in below
                if not left <= most * max(one.held_out**2 - floor**2, 0.0)
            ),
        )  # fmt: skip

    def _losses(self, rung: _Rung) -> tuple[str, ...]:
        """Held-out times in which a rung loses."""
        comparison, result = self.comparison, []
        every = zip(
            comparison.held_out, rung.outcome.held_out, self.law.outcome.held_out, strict=True
        )
        for segment, after, before in every:
            worse = segment.halves(after) > NOT_WORSE * segment.halves(before)
            for half, loses in zip(("first", "second"), worse, strict=True):
                if loses:
                    result.append(f"the {half} half of {segment.record.name} (held out)")
        return tuple(result)

    def _gives_energy(self, rung: _Rung, record: BuildingRecord) -> bool:
        """Whether the isolators run away, or give energy back, under a stronger ground motion."""
        model = with_causes(self.comparison.model, rung.outcome.cause_values)
        try:
            run = model.run(record, [motion.scaled(BEYOND_TESTS) for motion in record.ground])
        except Diverged:
            return True
        names = [model.nominal.elements[e].name for e in model.isolators]
        work = sum(
            float(run.output(f"{name}_force_N") @ run.output(f"{name}_velocity_m_s"))
            for name in names
        )
        return not (np.isfinite(run.values).all() and work > 0)

    def terms(self, rung: _Rung) -> tuple[EquationTerm, ...]:
        """Terms of an equation with their 95 % intervals, of all isolators together."""
        fitted = intervals(self.comparison, rung.outcome)[-1]
        result = []
        for k, (one, stable) in enumerate(
            zip(rung.chosen, rung.stability, strict=True), start=first_place(self.base)
        ):
            names = [f"c_{k}_{p}" for p in one.powers]
            names += [f"{n.symbol}_{k}" for n in one.term.numbers]
            numbers = {name: fitted[name] for name in names}
            result.append(EquationTerm(shown(one, k), stable, numbers))
        return tuple(result)

    def replaced_causes(self, rung: _Rung) -> tuple[str, ...]:
        """Causes of the catalogue in whose place an equation stands."""
        return () if rung.causes else tuple(cause.name for cause, _ in self.causes.causes)

    def noise_floor(self, diagnosis: Diagnosis) -> float:
        """Error that noise alone leaves on the validation data."""
        return relative_noise(self.comparison, True)

    def verdict(
        self, diagnosis: Diagnosis, rung: _Rung, named: float, least: float, before: float
    ) -> Verdict:
        """Explained means down to the noise, or nearly all of the misfit, as for causes."""
        if not rung.text:
            return diagnosis.verdict
        outcome, space = rung.outcome, self.problem.space
        chance = noise_chance(self.comparison, outcome)
        explained = space.explains(space.comparison.evaluate(outcome.cause_values), chance)
        return "explained" if explained else "partly_explained"

    def extend(self, diagnosis: D, rung: _Rung, errors: Rung) -> D:
        """A diagnosis whose building and device have the rung's law."""
        model = with_causes(self.comparison.model, rung.outcome.cause_values)
        both = self.law.outcome, rung.outcome
        extended = replace(
            cast(BuildingDiagnosis, diagnosis),
            error_after=Errors(errors.fit, errors.held_out),
            extended=extended_device(model),
            building=model.assembled,
            gain=gain_interval(squared_blocks(self.comparison, both), self.problem.seed),
            traces=traces_of(self.comparison, both),
        )
        return cast(D, extended)


@dataclass(frozen=True, eq=False)
class _Terms:
    """Terms of a law, of which some are silent, and the places of their numbers."""

    base: Law
    every: tuple[Chosen, ...]
    text: str
    scales: tuple[float, float]  # Force and length of the building over those of the law
    silent: tuple[int, ...] = ()

    @property
    def active(self) -> tuple[int, ...]:
        """Places of the terms that act."""
        return tuple(k for k in range(len(self.every)) if k not in self.silent)

    @property
    def chosen(self) -> tuple[Chosen, ...]:
        """Terms that act."""
        return tuple(self.every[k] for k in self.active)

    @cached_property
    def law(self) -> Law:
        """The law with all terms."""
        return law_of(self.text)

    def _parts(self, values: NDArray) -> list[NDArray]:
        """Numbers of each term that acts: coefficients by power, then those inside."""
        sizes = [len(one.powers) + len(one.term.numbers) for one in self.chosen]
        return np.split(values, np.cumsum(sizes)[:-1])

    def without(self, place: int, values: NDArray) -> tuple[_Terms, NDArray]:
        """The same with one more silent term, and the numbers of the others."""
        parts = zip(self.active, self._parts(values), strict=True)
        remaining = [own for k, own in parts if k != place]
        return replace(self, silent=(*self.silent, place)), np.concatenate(remaining)

    def rows(self, values: NDArray) -> dict[str, list[float]]:
        """Parameters of the law beside those of the base, by ascending powers of the current."""
        own = dict(zip(self.active, self._parts(values), strict=True))
        result: dict[str, list[float]] = {}
        for k, one in enumerate(self.every):
            name, n = first_place(self.base) + k, len(one.powers)
            numbers = own.get(k, np.zeros(n))
            row = np.zeros(max(one.powers) + 1)
            row[list(one.powers)] = numbers[:n]
            result[f"c_{name}"] = row.tolist()
            inside = numbers[n:] if k in own else [q.value for q in one.term.numbers]
            for q, value in zip(one.term.numbers, inside, strict=True):
                result[f"{q.symbol}_{name}"] = [float(value)]
            if one.term.current:
                result[f"i_{name}"] = [0.0, 1.0]
        return result

    def along(self, values: NDArray, data: MeasuredRuns) -> NDArray:
        """Force of the terms along measured motion, (n_samples,), N."""
        total = np.zeros(len(data.x))
        for one, numbers in zip(self.chosen, self._parts(values), strict=True):
            n = len(one.powers)
            inside = zip(one.term.numbers, numbers[n:].tolist(), strict=True)
            term = replace(one.term, numbers=tuple(replace(q, value=v) for q, v in inside))
            size = sum(c * data.current**p for c, p in zip(numbers[:n], one.powers, strict=True))
            total = total + size * along(term, data)
        return total

    def candidate(self) -> Candidate:
        """The terms as something that a building's model may lack; reported for all isolators."""
        parameters = [
            one for k in self.active
            for one in _parameters(self.every[k], first_place(self.base) + k, *self.scales)
        ]  # fmt: skip

        def apply(model: BuildingModel, values: Values) -> BuildingModel:
            return _with_law(model, self.law, self.rows(np.array(values)))

        return Candidate(EQUATION, "", tuple(parameters), (), apply, "an equation")


def _parameters(one: Chosen, place: int, force: float, length: float) -> Iterator[Parameter]:
    """Numbers of a term at some place of the equation, as they are fitted and reported."""
    for p in one.powers:
        factor = _factor(one.term.unit, force, length)
        yield Parameter(f"c_{place}_{p}", one.unit(p), factor=factor)
    for n in one.term.numbers:
        factor, name = _factor(n.unit, force, length), f"{n.symbol}_{place}"
        if n.symbol == "b":
            yield Parameter(name, n.unit, factor=factor)
        else:
            least, most = number_range(n)
            yield Parameter(name, n.unit, least, most, logarithmic=True, factor=factor)


def _factor(unit: str, force: float, length: float) -> float:
    """A number of the building over that of a device of another size."""
    above, *below = unit.split("/")
    sizes = [characteristic_scale(part, force, length, 1.0) for part in (above, *below)]
    return sizes[0] / float(np.prod(sizes[1:]))


def _with_law(model: BuildingModel, law: Law, rows: Mapping[str, list[float]]) -> BuildingModel:
    """A building whose isolators have a law with further parameters."""
    elements = list(model.nominal.elements)
    for e in model.isolators:
        device = elements[e].device
        base = dict(zip(device.current.names, device.current.coefficients[0].tolist(), strict=True))
        current = CurrentDependence.polynomial({**base, **rows}, law.parameter_names)
        own = replace(device, law=law, current=current, name="")
        elements[e] = replace(elements[e], device=own)
    return replace(model, nominal=replace(model.nominal, elements=tuple(elements)))
