"""Climb the ladder of a diagnosis: law, causes, equation, learned term.

Every rung is a law that is fitted through its simulation. Of device tests it predicts conditions
that were left out of its fit. A rung is offered only if it loses on none of them, nor on data held
out. Building records have rungs of their own (``tiers.building``).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...archive import law_of
from ...effects import extend
from ...identification.left_out import conditions, fitted_without, of_parts
from ...identification.measured_runs import MeasuredRuns
from ...identification.noise import correlation_time
from ...laws import Device
from ..decisions import (
    ADEQUATE,
    BEYOND_TESTS,
    DISSIPATIVE_GAIN,
    EQUATION_GAIN,
    EQUATION_PREFERRED,
    EQUATION_SIGNIFICANT,
    IMITATION,
    LOST,
    MUCH_LEFT,
    NEARLY_ALL,
    NEGLIGIBLE_LOSS,
    REMAINS,
    TIER_SAMPLES,
)
from ..device.carried_history import of_device
from ..device.generic_terms import OUTSIDE
from ..device.model import FittedModel, Model, fit_model
from ..diagnosis import Cause, Diagnosis, Errors
from ..inference import at_bound, gain_interval, half_widths
from ..interval import Interval
from ..verdict import Verdict
from .equation import select
from .law_file import Chosen, Network, TermParameterisation, first_place, law_text, shown
from .learned import learn
from .result import EquationTerm, Ladder, Rung, Tier

if TYPE_CHECKING:
    from ...identification.law_choice import LawRank
    from ..adapters.device_tests import DeviceTests

_FOLD_STEPS = 10
"""Steps of a fit without one condition, from the values of the fit to all."""
_LAST_STEPS = 30
_NAMES = {
    "causes": "The causes are", "equation": "The equation is", "learned": "The learned term is"
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Rung:
    """A rung on all samples and on those that select; its forces by fits without each condition."""

    final: FittedModel
    part: FittedModel
    without: NDArray
    left_out: NDArray
    chosen: tuple[Chosen, ...] = ()
    stability: tuple[float, ...] = ()
    text: str = ""
    loses: bool = False  # Whether an equation predicts some condition worse than the law


class _WithTerms(Protocol):
    """A rung that may have an equation's terms."""

    @property
    def chosen(self) -> tuple[Chosen, ...]:
        """The terms."""
        ...


R = TypeVar("R", bound=_WithTerms)
D = TypeVar("D", bound=Diagnosis)


class Tiers(ABC, Generic[R]):
    """The rungs of one kind of data, ``law`` and ``causes`` first."""

    law: R
    causes: R
    progress: Callable[[str], None]
    QUANTITY = "force"
    WORSE_THAN = "{} worse than the {} on what was left out or held out, and not offered."
    NO_EQUATION = "No term of an equation lowers the error on every condition left out."
    # Rungs that are never offered, since the search has compared the next one already
    superseded: tuple[str, ...] = ()
    negligible = 0.0  # Decrease of the error below which a simpler rung is offered

    @abstractmethod
    def equation(self) -> R | None:
        """Find the second tier; None if no term helps."""

    @abstractmethod
    def learned(self, below: R) -> tuple[R, float]:
        """Fit the third tier beside a rung, and return its share (``Learned``)."""

    @abstractmethod
    def errors(self, name: str, rung: R, below: Sequence[Rung] = ()) -> Rung:
        """Errors of a rung, and where it loses against the law or the rungs below it."""

    @abstractmethod
    def terms(self, rung: R) -> tuple[EquationTerm, ...]:
        """Terms of an equation with their intervals."""

    @abstractmethod
    def text(self, rung: R) -> str:
        """File of the extended law; empty without terms."""

    @abstractmethod
    def replaced_causes(self, rung: R) -> tuple[str, ...]:
        """Causes of the catalogue in whose place an equation stands."""

    @abstractmethod
    def noise_floor(self, diagnosis: Diagnosis) -> float:
        """Error that noise alone leaves on the validation data."""

    @abstractmethod
    def verdict(
        self, diagnosis: Diagnosis, rung: R, named: float, least: float, before: float
    ) -> Verdict:
        """Verdict with a rung, by errors: of the best named rung, the least, and the law's."""

    @abstractmethod
    def extend(self, diagnosis: D, rung: R, errors: Rung) -> D:
        """A diagnosis whose extended law is the rung's."""

    def has_generic_terms(self) -> bool:
        """Whether causes include a term that no law file can hold."""
        return False

    def better_law(self) -> tuple[LawRank, LawRank] | None:
        """The best of the other laws compared, and the law itself; None if none is better."""
        return None


class Climb(Tiers[_Rung]):
    """Models of all rungs, for device tests."""

    def __init__(self, problem: DeviceTests):
        self.problem, self.progress = problem, problem.progress  # After its search
        self.negligible = problem.significance
        self.progress("leaving conditions out")
        full = problem.data
        self.data = full.thinned(TIER_SAMPLES).without_held_out()
        self.masks = [mask for _, mask in conditions(self.data)]
        self.law, self.causes = (
            _Rung(final, part, without, self._left_out(without))
            for final in (problem.law, problem.final)
            for part in (self._part(final),)
            for without in (self._without(part),)
        )

    def _rung(
        self, part: FittedModel, chosen: Sequence[Chosen] = (), stability: Sequence[float] = (),
        text: str = "",
    ) -> _Rung:  # fmt: skip
        """A rung from its model on the samples that select, not yet fitted to all."""
        whole = replace(part.model, data=self.problem.data).resolve_steps(part.values)
        nothing = np.zeros((0, len(part.values)))
        final = FittedModel(whole, part.values, part.cost, nothing[:, 0], nothing)
        without = self._without(part)
        return _Rung(
            final, part, without, self._left_out(without), tuple(chosen),
            tuple(stability[: len(chosen)]), text,
        )  # fmt: skip

    def _part(self, final: FittedModel) -> FittedModel:
        """A model on the samples that select, fitted a little further."""
        here = replace(final.model, data=self.data)
        return self._fitted(here, final.values, 1e-4, _FOLD_STEPS)

    def _without(self, part: FittedModel) -> NDArray:
        """Force of a model fitted without each condition, (n_folds, n_samples), N."""

        def force(values: NDArray) -> NDArray:
            return self.data.bounded(part.model.forces(values, False)[0])

        pool = self.problem.pool
        ends = fitted_without(part.model, part.values, self.masks, pool, _FOLD_STEPS)
        return np.stack(list(pool.map(force, ends)))

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
        starts = [self._catalogue(self.causes.part)]
        if starts[0].effects:
            starts.append(self.law.part)
        equations = [rung for start in starts if (rung := self._equation(start)) is not None]
        return min(equations, key=lambda one: (one.loses, _power(one)), default=None)

    def _equation(self, start: FittedModel) -> _Rung | None:
        """The equation beside a model, with the terms that it needs.

        It loses nowhere, if there is such a one; else it is the one with the most terms.
        """
        selection = select(start.model, start.values, self.masks, self.problem.pool)
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
            good = not (self.losses(rung, self.law) or self._beyond(rung, self.law))
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
        best = self._without_superfluous_effects(best)
        return replace(best, final=self._fitted(best.final.model, best.part.values, 1e-6))

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
        start, without = below.part, below.without
        if OUTSIDE in start.causes:
            start = self._catalogue(start)
            without = self._without(start)
        term = learn(start.model, start.force, without, self.masks, self.problem.seed)
        model, text = self._extended(start.model, below.chosen, term.network)
        part = fit_model(model.resolve_steps(start.values, 1), start.values, 0)
        whole = replace(model, data=self.problem.data).resolve_steps(start.values)
        return _Rung(
            fit_model(whole, start.values, 0), part, without, term.left_out, below.chosen,
            below.stability, text,
        ), term.share  # fmt: skip

    def _catalogue(self, part: FittedModel) -> FittedModel:
        """A fitted model without generic terms, for which an equation is the place."""
        model, values = part.model, part.values
        for place, cause in reversed(list(enumerate(model.causes))):
            if cause == OUTSIDE:
                gone = model.slices()[place]
                values = np.delete(values, np.arange(gone.start, gone.stop))
                model = model.without(place)
        return part if model is part.model else fit_model(model, values, _LAST_STEPS, 1e-5)

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
        return replace(model, parameterisation=own, expected=expected), text

    def losses(self, rung: _Rung, against: _Rung) -> tuple[str, ...]:
        """Conditions left out of a fit, and conditions held out, on which a rung loses."""
        data = self.problem.data
        every = np.logical_or.reduce(self.masks)
        missed = self.data.relative(against.left_out, every)
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
            units = [(f"c_{k}_{p}", one.term.unit + f"/A^{p}" * (p > 0)) for p in one.powers]
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
        effects = map(of_device, final.effects)
        applied = zip(effects, final.model.parameters_of(final.values), strict=True)
        return extend(inner, list(applied)) if final.effects else inner

    def text(self, rung: _Rung) -> str:
        """File of the extended law; empty without terms."""
        return rung.text

    def replaced_causes(self, rung: _Rung) -> tuple[str, ...]:
        """Causes of the catalogue in whose place an equation stands."""
        left = rung.final.causes
        return tuple(cause for cause in self.causes.final.causes if cause not in left)

    def has_generic_terms(self) -> bool:
        """Whether causes include a term that no law file can hold."""
        return OUTSIDE in self.causes.final.causes

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
        remains = named**2 - floor**2
        little = remains < NEARLY_ALL * (before**2 - floor**2) and (
            max(remains, fitted**2 - diagnosis.noise_floor**2) < REMAINS**2
        )
        if little and named**2 < ADEQUATE * least**2:
            return "explained"
        return "partly_explained" if named < before else diagnosis.verdict

    def extend(self, diagnosis: D, rung: _Rung, errors: Rung) -> D:
        """A diagnosis whose extended device has the rung's law."""
        assert diagnosis.judged is not None
        data = self.problem.data
        force = data.bounded(rung.final.force)
        after = {name: force[run] for name, run in zip(data.names, data.runs, strict=True)}
        errors_after = Errors(errors.fit, errors.held_out)
        return replace(
            diagnosis,
            noise_floor=min(diagnosis.noise_floor, errors.fit),
            held_out_noise_floor=min(diagnosis.held_out_noise_floor, errors.held_out),
            error_after=errors_after,
            extended=self.device(rung, diagnosis.judged),
            gain=gain_interval(self.problem.squared_blocks(force), self.problem.seed),
            traces=tuple(replace(one, after=after[one.name]) for one in diagnosis.traces),
        )


def climb(ladder: Tiers[R], diagnosis: D, tier: Tier) -> D:
    """Add the second tier to a diagnosis, and the third if it is wanted."""
    rungs: dict[str, R] = {}
    errors: dict[str, Rung] = {}

    def add(name: str, rung: R) -> None:
        rungs[name] = rung
        good = [one for one in errors.values() if not one.loses]
        errors[name] = ladder.errors(name, rung, good)

    add("law", ladder.law)
    add("causes", ladder.causes)
    ladder.progress("finding an equation")
    equation = ladder.equation()
    if equation is not None:
        add("equation", equation)
    if tier == "learned":
        ladder.progress("learning")
        below = [name for name, one in errors.items() if not one.loses][-1]
        rung, share = ladder.learned(rungs[below])
        add("learned", rung)
    shown_rungs = list(errors.values())
    allowed = {name: one for name, one in errors.items() if name not in ladder.superseded}
    offered = _offered(allowed, ladder.has_generic_terms(), ladder.negligible)
    deciding = {name: _deciding_error(one) for name, one in errors.items()}
    named = min(value for name, value in deciding.items() if name != "learned")
    attainable, better_law = _attainable(deciding, ladder.better_law())
    noise = ladder.noise_floor(diagnosis)
    floor = min(noise, attainable) if noise > 0 else 0.0
    misfit = max(deciding["law"] ** 2 - floor**2, 1e-300)
    has_learned = "learned" in deciding
    notes = _refusals(shown_rungs, ladder.WORSE_THAN)
    blamed = bool(diagnosis.causes)
    if errors["causes"].worse and deciding["causes"] ** 2 - floor**2 > MUCH_LEFT * misfit:
        diagnosis, said = _without_losing(diagnosis)
        notes += said
    best = rungs[offered]
    replaced = ladder.replaced_causes(best) if best.chosen else ()
    if replaced:
        notes += _replaced_note(diagnosis, replaced)
        if _only_imitated(deciding, floor):
            terms = {one.term.cause for one in best.chosen}
            diagnosis, said = _without_imitations(diagnosis, set(replaced) - terms)
            notes += said
    if equation is None:
        notes.append(ladder.NO_EQUATION)
    if tier == "learned":
        notes.append(_dissipation(share))
    result = Ladder(
        rungs=tuple(shown_rungs),
        terms=ladder.terms(equation) if equation is not None else (),
        law_text=ladder.text(best),
        offered=offered,
        attainable=attainable,
        explainable=(named**2 - attainable**2) / misfit if has_learned else float("nan"),
        inexplicable=(attainable**2 - floor**2) / misfit if has_learned else float("nan"),
        notes=tuple(notes),
        better_law=better_law,
        quantity=ladder.QUANTITY,
    )
    if offered == "law" and blamed:
        return _withheld(diagnosis, result)
    if offered == "law" or (offered == "causes" and not has_learned):
        return replace(diagnosis, ladder=result)
    least = max(attainable, floor)
    new_verdict = ladder.verdict(diagnosis, best, named, least, deciding["law"])
    if offered == "causes":
        return replace(diagnosis, ladder=result, verdict=new_verdict)
    return replace(
        ladder.extend(diagnosis, best, errors[offered]),
        ladder=result,
        verdict=new_verdict,
        unexplained_share=float(np.clip((deciding[offered] ** 2 - floor**2) / misfit, 0.0, 1.0)),
    )


def _refusals(rungs: Sequence[Rung], worse_than: str) -> list[str]:
    """Why models that lose somewhere are not offered."""
    losing = [one for one in rungs if one.worse or one.beyond]
    return [
        f"{_NAMES[one.name]} worse than the law in {', '.join(one.worse + one.beyond)}, "
        "and not offered."
        for one in losing
    ] + [
        worse_than.format(_NAMES[one.name], " and the ".join(one.worse_than))
        for one in rungs
        if one.worse_than and one not in losing
    ]


def _attainable(
    deciding: dict[str, float], better: tuple[LawRank, LawRank] | None
) -> tuple[float, str]:
    """Least error of the rungs, or that which a better law promises, and then a sentence."""
    least = min(deciding.values())
    if better is None:
        return least, ""
    # both on short data, so that only their ratio can be compared with the rungs
    other, own = better
    promised = deciding["law"] * other.left_out / own.left_out
    if promised >= least:
        return least, ""
    return promised, (
        f"Another law is better: {other.title} ({other.law}) leaves {100 * other.left_out:.3g} % "
        f"on short data, and {own.title} {100 * own.left_out:.3g} %: a greater gain than that of "
        "any tier."
    )


def _replaced_note(diagnosis: Diagnosis, replaced: Collection[str]) -> list[str]:
    """A note of the causes in whose place an equation stands."""
    if all(cause.name in replaced for cause in diagnosis.causes):
        return ["The equation stands in place of the causes."]
    labels = [c.label for c in diagnosis.causes if c.name in replaced and c.name != OUTSIDE]
    return [f"The equation stands in place of {', '.join(labels)}."] if labels else []


def _without_imitations(diagnosis: D, replaced: Collection[str]) -> tuple[D, list[str]]:
    """A diagnosis without the causes that an equation replaces, and a note of their names."""
    imitated = [c for c in diagnosis.causes if c.name in replaced and c.name != OUTSIDE]
    if not imitated:
        return diagnosis, []
    labels = ", ".join(one.label for one in imitated)
    remaining = tuple(one for one in diagnosis.causes if one not in imitated)
    note = f"Not named, since only an imitation of the equation: {labels}."
    return _only(diagnosis, remaining), [note]


def _without_losing(diagnosis: D) -> tuple[D, list[str]]:
    """A diagnosis without its causes, which lose somewhere and leave much, and a note of them."""
    labels = ", ".join(one.label for one in diagnosis.causes if one.name != OUTSIDE)
    if not labels:
        return diagnosis, []
    remaining = tuple(one for one in diagnosis.causes if one.name == OUTSIDE)
    note = f"Not named, since worse than the law somewhere, with much left: {labels}."
    return _only(diagnosis, remaining), [note]


def _only(diagnosis: D, causes: tuple[Cause, ...]) -> D:
    """A diagnosis with some of its causes, without the tests that tell causes apart."""
    plan = diagnosis.test_plan
    if plan is not None:
        plan = replace(plan, tests=tuple(test for test in plan.tests if not test.tells))
    return replace(diagnosis, causes=causes, next_test=None, test_plan=plan)


def _only_imitated(deciding: dict[str, float], floor: float) -> bool:
    """Whether an equation in place of causes leaves far less than they do."""
    left = [deciding[name] ** 2 - floor**2 for name in ("equation", "causes")]
    return left[0] < IMITATION * left[1]


def _dissipation(share: float) -> str:
    """Whether the learned term dissipates by construction."""
    if share >= DISSIPATIVE_GAIN:
        return "The learned term dissipates by construction."
    return (
        "The learned term may give energy back: one that dissipates by construction removes "
        f"{100 * max(share, 0.0):.0f} % of what it removes."
    )


def _withheld(diagnosis: D, ladder: Ladder) -> D:
    """A diagnosis whose causes lose somewhere: they stay named, but the law is not extended."""
    note = "No tier is offered: the extended law is the law without its causes."
    verdict = "partly_explained" if diagnosis.verdict == "explained" else diagnosis.verdict
    return replace(
        diagnosis,
        ladder=replace(ladder, notes=(*ladder.notes, note)),
        gain=None,
        verdict=verdict if diagnosis.causes else "unexplained",
        error_after=diagnosis.error_before,
        extended=diagnosis.judged,
        traces=tuple(replace(one, after=one.before) for one in diagnosis.traces),
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


def _deciding_error(rung: Rung) -> float:
    """Error on the validation data: held out if there are any, else left out."""
    return rung.held_out if np.isfinite(rung.held_out) else rung.left_out


def _lost(after: NDArray, before: NDArray, data: MeasuredRuns, least: float) -> Iterator[str]:
    """Conditions of the fitted samples on which a residual (N) is larger than the one before."""
    if not data.fitted.any():
        return
    folds = conditions(data)
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


def _offered(errors: dict[str, Rung], generic: bool, negligible: float = 0.0) -> str:
    """The rung with the least error left out, or held out, among those that lose nowhere."""
    # One nearly as good is preferred to the learned term, and causes to an equation beside them
    # whose gain is negligible. An equation takes the place of causes with a generic term, since
    # such a term cannot be saved.
    good = {
        name: one.left_out if np.isfinite(one.left_out) else one.held_out
        for name, one in errors.items() if not one.loses
    }  # fmt: skip
    named = good.get("causes", np.inf) < good.get("law", np.inf)
    beyond = {"equation": negligible if named else 0.0}
    beyond["learned"] = beyond["equation"] + max(
        negligible, (EQUATION_PREFERRED - 1) * good.get("learned", 0.0)
    )
    if generic and "equation" in good:
        good.pop("causes", None)
    return min(good, key=lambda name: good[name] + beyond.get(name, 0.0))
