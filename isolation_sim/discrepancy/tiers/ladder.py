"""Climb the ladder of a diagnosis: law, causes, equation, learned term.

Every rung is a law that is fitted through its simulation. Of device tests it predicts conditions
that were left out of its fit. A rung is offered only if it loses on none of them, nor on data held
out. Device tests and building records have rungs of their own (``tiers.device_tests``,
``tiers.building``).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Generic, NamedTuple, Protocol, TypeVar

import numpy as np

from ..decisions import DISSIPATIVE_GAIN, EQUATION_GAIN, EQUATION_PREFERRED, IMITATION, MUCH_LEFT
from ..device.generic_terms import OUTSIDE
from ..diagnosis import Cause, Diagnosis
from ..inference import verdict
from ..verdict import Verdict
from .law_file import Chosen
from .result import EquationTerm, Ladder, Rung, Tier

if TYPE_CHECKING:
    from ...identification.law_choice import LawRank

_NAMES = {
    "causes": "The causes are", "equation": "The equation is", "learned": "The learned term is"
}  # fmt: skip


class _WithTerms(Protocol):
    """A rung that may have an equation's terms."""

    @property
    def chosen(self) -> tuple[Chosen, ...]:
        """The terms."""
        ...

    @property
    def text(self) -> str:
        """File of the extended law; empty without terms."""
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

    def is_simpler(self, one: R, other: R) -> bool:
        """Whether a rung has fewer numbers than another one."""
        return False

    def better_law(self) -> tuple[LawRank, LawRank] | None:
        """The best of the other laws compared, and the law itself; None if none is better."""
        return None


CAUSES_ALONE = "Verdict on the causes alone"
"""Title of the last step where an equation or a learned term extends the law."""


def climb(ladder: Tiers[R], diagnosis: D, tier: Tier) -> D:
    """Add the second tier to a diagnosis, and the third if ``tier`` is learned."""
    rungs, errors, learning = _fit_rungs(ladder, tier)
    allowed = {name: one for name, one in errors.items() if name not in ladder.superseded}
    offered = _offered(allowed, ladder.has_generic_terms(), ladder.negligible)
    gives_way = offered == "causes" and _gives_way(ladder, diagnosis, rungs, errors)
    if gives_way:
        offered = "equation"
    best = rungs[offered]
    left = _errors_left(ladder, diagnosis, errors)
    blamed = bool(diagnosis.causes)
    notes = _refusals(list(errors.values()), ladder.WORSE_THAN)
    if errors["causes"].worse and left.share("causes") > MUCH_LEFT:
        diagnosis, said = _without_losing(diagnosis)
        notes += said
    replaced = ladder.replaced_causes(best) if best.chosen else ()
    if replaced:
        notes += _replaced_note(diagnosis, replaced)
        if gives_way or left.only_imitated:
            terms = {one.term.cause for one in best.chosen}
            diagnosis, said = _without_imitations(diagnosis, set(replaced) - terms)
            notes += said
    equation = rungs.get("equation")
    if equation is None:
        notes.append(ladder.NO_EQUATION)
    result = Ladder(
        rungs=tuple(errors.values()),
        terms=ladder.terms(equation) if equation is not None else (),
        law_text=best.text,
        offered=offered,
        attainable=left.attainable,
        explainable=left.explainable,
        inexplicable=left.inexplicable,
        notes=(*notes, *learning),
        better_law=left.better_law,
        quantity=ladder.QUANTITY,
    )
    if offered == "law" and blamed:
        return _withheld(diagnosis, result)
    if offered == "law" or (offered == "causes" and "learned" not in rungs):
        return replace(diagnosis, ladder=result)
    least = max(left.attainable, left.floor)
    reached = ladder.verdict(diagnosis, best, left.named, least, left.deciding["law"])
    if offered == "causes":
        # what only acts like causes explains a part at most
        if reached == "explained":
            every = verdict(diagnosis.causes, adequate=False, explained=True) == "explained"
            reached = "explained" if every else "partly_explained"
        return replace(diagnosis, ladder=result, verdict=reached)
    # the last step is about the causes, which are no longer what the verdict is about
    *steps, last = diagnosis.steps
    diagnosis = replace(diagnosis, steps=(*steps, replace(last, title=CAUSES_ALONE)))
    return replace(
        ladder.extend(diagnosis, best, errors[offered]),
        ladder=result,
        verdict=reached,
        unexplained_share=float(np.clip(left.share(offered), 0.0, 1.0)),
    )


def _fit_rungs(ladder: Tiers[R], tier: Tier) -> tuple[dict[str, R], dict[str, Rung], list[str]]:
    """Rungs and their errors by name, from the law up, and a note of the learned term."""
    rungs: dict[str, R] = {}
    errors: dict[str, Rung] = {}

    def add(name: str, rung: R) -> None:
        rungs[name] = rung
        errors[name] = ladder.errors(name, rung, [one for one in errors.values() if not one.loses])

    add("law", ladder.law)
    add("causes", ladder.causes)
    ladder.progress("finding an equation")
    equation = ladder.equation()
    if equation is not None:
        add("equation", equation)
    if tier != "learned":
        return rungs, errors, []
    ladder.progress("learning")
    below = [name for name, one in errors.items() if not one.loses][-1]
    rung, dissipating = ladder.learned(rungs[below])
    add("learned", rung)
    return rungs, errors, [_dissipation(dissipating)]


def _gives_way(
    ladder: Tiers[R], diagnosis: Diagnosis, rungs: dict[str, R], errors: dict[str, Rung]
) -> bool:
    """Whether all causes only act like one, and a simpler equation predicts as much as they do."""
    return (
        "equation" in rungs
        and not any(cause.is_named for cause in diagnosis.causes)
        and ladder.is_simpler(rungs["equation"], rungs["causes"])
        and not errors["equation"].loses
        and _deciding_error(errors["equation"])
        < _deciding_error(errors["causes"]) + ladder.negligible
    )


class _ErrorsLeft(NamedTuple):
    """Errors of the rungs on the validation data, against what can be attained at most."""

    deciding: dict[str, float]
    """Of each rung."""
    named: float
    """The least of law, causes and equation."""
    attainable: float
    """The least of all, or that of a better law."""
    better_law: str
    """A sentence on that law; empty without one."""
    floor: float
    """What noise leaves."""
    negligible: float = 0.0
    """Decrease that explains nothing."""

    def share(self, name: str) -> float:
        """Share of the law's misfit that a rung leaves."""
        return self._of_misfit(self.deciding[name], self.floor)

    @property
    def only_imitated(self) -> bool:
        """Whether an equation in place of causes leaves far less than they do."""
        return self.share("equation") < IMITATION * self.share("causes")

    @property
    def explainable(self) -> float:
        """Share that only a flexible model explains; NaN without one."""
        return self._of_misfit(self.named, self._model) if "learned" in self.deciding else np.nan

    @property
    def inexplicable(self) -> float:
        """Share that nothing measured explains; NaN without a flexible model."""
        return self._of_misfit(self._model, self.floor) if "learned" in self.deciding else np.nan

    @property
    def _model(self) -> float:
        """Error of the best model; a negligible gain explains nothing."""
        gains = self.named - self.attainable > self.negligible
        return self.attainable if gains else self.named

    def _of_misfit(self, error: float, other: float) -> float:
        misfit = max(self.deciding["law"] ** 2 - self.floor**2, 1e-300)
        return (error**2 - other**2) / misfit


def _errors_left(ladder: Tiers[R], diagnosis: Diagnosis, errors: dict[str, Rung]) -> _ErrorsLeft:
    deciding = {name: _deciding_error(one) for name, one in errors.items()}
    attainable, better_law = _attainable(deciding, ladder.better_law())
    noise = ladder.noise_floor(diagnosis)
    return _ErrorsLeft(
        deciding,
        named=min(value for name, value in deciding.items() if name != "learned"),
        attainable=attainable,
        better_law=better_law,
        floor=min(noise, attainable) if noise > 0 else 0.0,
        negligible=ladder.negligible,
    )


def _refusals(rungs: Sequence[Rung], worse_than: str) -> list[str]:
    """Why models that lose somewhere are not offered."""
    losing = [one for one in rungs if one.worse or one.beyond]
    return [f"{_NAMES[one.name]} not offered: {_losses(one)}." for one in losing] + [
        worse_than.format(_NAMES[one.name], " and the ".join(one.worse_than))
        for one in rungs
        if one.worse_than and one not in losing
    ]


def _losses(rung: Rung) -> str:
    """Where a model is worse than the law, and where it diverges or gives energy back."""
    worse = f"worse than the law in {', '.join(rung.worse)}" if rung.worse else ""
    beyond = f"a force that diverges or gives energy back in {', '.join(rung.beyond)}"
    return "; ".join(filter(None, (worse, beyond if rung.beyond else "")))


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
    if promised**2 > (1 - EQUATION_GAIN) * least**2:
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
        extended=diagnosis.nominal,
        traces=tuple(replace(one, after=one.before) for one in diagnosis.traces),
    )


def _deciding_error(rung: Rung) -> float:
    """Error on the validation data: held out if there are any, else left out."""
    return rung.held_out if np.isfinite(rung.held_out) else rung.left_out


def _offered(errors: dict[str, Rung], generic: bool, negligible: float = 0.0) -> str:
    """The rung with the least error left out, or held out, among those that lose nowhere."""
    # One nearly as good is preferred to the learned term, and law or causes to an equation
    # whose gain is negligible. An equation takes the place of causes with a generic term, since
    # such a term cannot be saved.
    good = {
        name: one.left_out if np.isfinite(one.left_out) else one.held_out
        for name, one in errors.items() if not one.loses
    }  # fmt: skip
    nearly = max(negligible, (EQUATION_PREFERRED - 1) * good.get("learned", 0.0))
    beyond = {"equation": negligible, "learned": negligible + nearly}
    if generic and "equation" in good:
        good.pop("causes", None)
    return min(good, key=lambda name: good[name] + beyond.get(name, 0.0))
