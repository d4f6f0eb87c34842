"""Diagnosis of device tests: a law with effects, fitted to a campaign's forces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...effects import extend
from ...identification.campaign import Campaign
from ...identification.error_notes import outlier_note
from ...identification.fitted import RunError
from ...identification.law_choice import LawChoice, LawRank, choose_law
from ...identification.law_fit import SEARCHED, fit_law, parameterise, refine_law
from ...identification.law_model import coarse_step_error
from ...identification.measured.data_checks import data_notes
from ...identification.measured.noise import correlation_time
from ...identification.measured.run_starts import start_note
from ...identification.measured_runs import MeasuredRuns, hold_out_some, measured_runs
from ...identification.motion_noise import motion_noise
from ...laws import Device
from ...laws.law import Law
from ...laws.registry import LAWS
from ..decisions import (
    COARSEST_STEPS,
    COMPLETES,
    FAR_BETTER,
    FAR_OFF,
    MANY_EFFECTS,
    NOISE_EXAMPLES,
    RATE_SAMPLES,
    REMAINS,
    RESOLVED_MISFIT,
    SIGNIFICANCE,
    SIGNIFICANT,
    TO_BLAME,
    TO_BLAME_FITTED,
    WITH_A_CAUSE_LESS,
)
from ..device.carried_history import of_device_in_order
from ..device.causes import effect_causes, periodic_cause, wrong_numbers
from ..device.common_curve import (
    linear_in_current,
    several_curves,
    with_saturation,
)
from ..device.effect_search import EffectSearch
from ..device.force_errors import ForceErrors, is_all
from ..device.generic_terms import OUTSIDE, generic_terms, variables
from ..device.interference import Interference, interference
from ..device.model import FittedModel, Model, fit_model
from ..device.next_test import rival_tests
from ..device.noise_examples import noise_residuals
from ..device.observable_effects import observable_effects
from ..device.validated_search import ValidatedSearch
from ..diagnosis import Cause, Errors, Trace, worst_first
from ..planned_tests import TestPlan, missing_conditions
from ..problem import Evaluation, Problem, Text
from ..residuals import Dependence, of_device_tests, smallest_set
from ..search import Round, SearchResult


class DeviceTests(Problem[FittedModel]):
    """A campaign against a law, with given parameter values or with fitted ones."""

    # The search runs on thinned samples that are fitted; ``law`` and ``final`` are fitted to all of
    # them and evaluated on the samples held out (``device.validated_search``).

    predicts_residual = True

    def __init__(
        self,
        campaign: Campaign,
        law: Law,
        device: Device | None,
        degree: int | None,
        seed: int,
        pool: ThreadPoolExecutor,
        progress: Callable[[str], None],
        significance: float = SIGNIFICANCE,
        choice: LawChoice | None = None,
        data: MeasuredRuns | None = None,
        repaired: Sequence[str] = (),
        saturates: bool = False,  # Whether the degree is 1 because of ``saturates_alike``
    ):
        self.choice, self.degree, self._repaired = choice, degree, repaired
        self.saturates = saturates
        self.significance = significance
        self.campaign, self.device, self.seed, self.pool = campaign, device, seed, pool
        self.progress = progress
        self.data_name, self.model_name = campaign.name, law.title
        self.data = data or hold_out_some(measured_runs(campaign.runs), campaign.runs)
        self._parameterisation = parameterise(campaign, law, self.data, degree, prescribed=device)
        self.disturbance: Interference | None = None
        self.law: FittedModel  # Alone, on all samples

    def nominal(self) -> FittedModel:
        """Fit the law, remove interference, and simulate the noise."""
        self._fit_law()
        self.disturbance = interference(self.data, self.law.force)
        if self.disturbance is not None:
            self.data = replace(self.data, force=self.data.force - self.disturbance.force)
            self._fit_law()
        beside = self.data.noise_beside(self.law.force)
        if np.isfinite(beside.corner) and is_all(self.data, self.law.force, beside.deviation):
            # beside the law a low-pass is seen that the motion hides in the force
            corner = np.full(len(self.data.runs), beside.corner)
            self.data = replace(self.data, force_noise=beside.deviation, force_corner=corner)
            self._fit_law()
        data = self.data
        self.shifts = motion_noise(data, NOISE_EXAMPLES, self.seed)
        noise = noise_residuals(self.law, self.shifts, self.seed)
        # the law leaves no more than noise
        simulated = float(np.mean(np.sum(noise[data.fitted] ** 2, axis=0)))
        noise *= np.sqrt(min(1.0, self.law.cost / simulated)) if simulated > 0 else 1.0
        self.errors = ForceErrors(data, noise, self.significance)
        part = data.thinned(SEARCHED).without_held_out()
        # in the search a law that misses much is not followed more exactly
        missed = data.relative(data.bounded(self.law.force) - data.force, data.fitted)
        step_error = coarse_step_error(missed, RESOLVED_MISFIT, COARSEST_STEPS)
        model = replace(self.law.model, data=part, step_error=step_error)
        # a law that lacks an effect may leave its right values for others at a bound
        start = self.law if model.inside is None else replace(self.law, values=model.inside)
        base = start.on(model.resolve_steps(start.values, 1))
        places = data.places(SEARCHED)
        fitted = places[data.fitted[places]]
        current_varies = bool(np.ptp(part.current) > 0)
        within_runs = any(np.ptp(part.current[run]) > 0 for run in part.runs)
        self.space = EffectSearch(
            base,
            observable_effects(part),
            generic_terms(
                float(np.max(np.abs(part.x))),
                current_varies,
                bool(part.has_temperature and np.ptp(part.temperature) > 1),
                RATE_SAMPLES * float(np.median(data.dt)) if within_runs else 0.0,
            ),
            noise_residuals(base, self.shifts[:, :, fitted], self.seed),
            self.pool,
            lambda: self.progress("trying effects"),
            self._another_is_far_better,
        )
        return base

    def _fit_law(self) -> None:
        model = Model(self.data, self._parameterisation)
        self.prescribed: FittedModel | None = None
        if self.device is None:
            start = self.choice.best.values if self.choice is not None else None
            if start is not None and len(start) != model.n_law:  # of another degree
                start = None
            model, best = fit_law(
                model, self.pool, seed=self.seed, start=start,
                advance=lambda: self.progress("fitting the law"),
            )  # fmt: skip
        else:
            start = self._parameterisation.of(self.device)
            model = replace(model, expected=start)
            model, best = refine_law(model, refine_law(model, start)[1].x)
            self.prescribed = FittedModel.at(model, start)
        self.law = FittedModel.of(model, best)
        self.data = model.data

    def dependences(self, base: FittedModel) -> list[Dependence]:
        """Analyse the residual of the law on the searched samples."""
        return of_device_tests(base, self.space.noise_cost)

    def search(self, base: FittedModel) -> SearchResult[FittedModel]:
        """Search for effects that hold on all samples."""
        self.validated = ValidatedSearch(
            self.space, self.errors, self.law, self.prescribed, self.seed
        )
        result = self.validated.search(base, lambda: self.progress("fitting all samples"))
        # many effects may stand for the form of another law
        many = len(self.final.effects) >= MANY_EFFECTS
        if many or self.errors.is_large(self.after, self.errors.validation_samples):
            self._compare_laws()
        return result

    @property
    def final(self) -> FittedModel:
        """The law with the effects found, on all samples."""
        return self.validated.final

    @property
    def before(self) -> NDArray:
        """Force of the evaluated simulation, N."""
        return self.validated.before

    @property
    def after(self) -> NDArray:
        """Force with all selected effects, N."""
        return self.validated.after

    def law_beside_causes(self) -> LawRank | None:
        """Another law that needs a cause less, or leaves far less beside the same causes."""
        # The law that alone is nearest may have imitated a cause by what a further one mends, and
        # a simple law may be as near as the right one while causes are missing.
        final = self.final
        if self.choice is None or not final.effects:
            return None
        errors, fitted = self._errors_of(final), self.data.fitted
        floor = np.nan_to_num([self.errors.noise_floor(one) for one in (fitted, ~fitted)])
        far_less = np.sqrt(floor**2 + COMPLETES * np.maximum(errors**2 - floor**2, 0.0))
        limits: dict[int | None, NDArray] = {}
        if not self.errors.is_noise(self.after, fitted):
            limits[None] = far_less
        limits |= dict.fromkeys(range(len(final.effects)), WITH_A_CAUSE_LESS * errors)
        found: list[tuple[int, LawRank]] = []
        for rank in self.choice.near:
            p = parameterise(self.campaign, LAWS[rank.law], self.data, self.degree)
            more = len(p.scale) - final.model.n_law
            places = [
                k for k in limits if k is None or more <= len(final.effects[k].parameters)
            ]  # fmt: skip
            if rank is self.choice.best or not places:
                continue
            model, alone = refine_law(Model(self.data, p), rank.values)
            for place in places:
                effects = final.effects if place is None else final.model.without(place).effects
                values = final.values if place is None else final.values_without(place)
                own = values[final.model.n_law :]
                one = fit_model(model.with_effects(*effects), np.concatenate([alone.x, own]))
                if (self._errors_of(one) <= limits[place]).all():
                    found.append((len(one.values), rank))
        return min(found, key=lambda one: one[0])[1] if found else None

    def saturates_alike(self) -> bool:
        """Whether a saturation explains the currents better than each parameter's own curve."""
        final, saturated = self.final, self._saturated
        if saturated is None:
            return False
        # noise of the motion leaves more than that of the force
        noise = final.cost / len(final.residual)
        return saturated.cost - final.cost < noise * (final.penalty - saturated.penalty)

    @cached_property
    def _saturated(self) -> FittedModel | None:
        """One saturation that follows the currents to noise where parameters are curved."""
        final, fitted, errors = self.final, self.data.fitted, self.errors
        p = final.model.parameterisation
        chosen = self.degree is not None or self.prescribed is not None
        if chosen or p.n_powers != 3 or "field_saturation" in final.causes:
            return None
        if not errors.is_noise(self.after, fitted) or not several_curves(final):
            return None
        linear = linear_in_current(final)
        saturated = with_saturation(linear)
        if saturated is None or not errors.is_noise(saturated.force, fitted):
            return None
        corrected = self._errors_of(linear)[0] ** 2 - self._errors_of(saturated)[0] ** 2
        return saturated if corrected > self.significance**2 else None

    def _errors_of(self, model: FittedModel) -> NDArray:
        """Relative errors of a model on fitted and on held-out samples."""
        data = self.data
        residual = data.bounded(model.force) - data.force
        errors = [data.relative(residual, chosen) for chosen in (data.fitted, ~data.fitted)]
        return np.nan_to_num(errors)

    def _compare_laws(self) -> LawChoice:
        """All laws on short data, compared once."""
        if self.choice is None:
            self.choice = choose_law(
                self.campaign, self.data, self.degree, self.pool, seed=self.seed,
                advance=lambda: self.progress("comparing laws"), prescribed=self.device,
            )  # fmt: skip
        return self.choice

    def _another_is_far_better(self, current: FittedModel) -> bool:
        """Whether causes leave a large error, and another law alone one that is smaller by far."""
        # More causes would only imitate the other law, at much expense.
        data = current.model.data
        error = data.relative(data.bounded(current.force) - data.force, data.fitted)
        noise = float(np.mean(np.sum((self.space.noise / data.weight[:, np.newaxis]) ** 2, axis=0)))
        floor = np.sqrt(noise / float(np.sum(data.force**2)))
        if error < max(REMAINS, FAR_BETTER * floor):
            return False
        choice = self._compare_laws()
        name = current.model.parameterisation.law.name
        return name not in [one.law for one in choice.near] and error > FAR_BETTER * choice.least

    def evaluate(self, result: SearchResult[FittedModel]) -> Evaluation:
        """Compare the forces before and after on fitted and on held-out samples."""
        data, errors = self.data, self.errors.beside_its_noise(self.after)
        alone = self.errors.is_noise(self.after, data.fitted)
        self.has_own_noise = errors is not self.errors and not alone
        self.errors = self.validated.errors = errors
        left = self.validated.left()
        residuals = self.before - data.force, self.after - data.force
        before, after = (
            Errors(data.relative(r, data.fitted), data.relative(r, ~data.fitted)) for r in residuals
        )
        floors = (errors.noise_floor(chosen) for chosen in (data.fitted, ~data.fitted))
        noise = Errors(*map(min, floors, (after.fit, after.held_out)))
        # on the samples that judge, and without a large error on those that were fitted
        explained = errors.is_noise(self.after, errors.validation_samples)
        explained = explained and not errors.is_large(self.after, data.fitted)
        return Evaluation(
            before, after, noise, left, errors.is_noise(self.law.force, data.fitted), explained,
            errors.squared_blocks(self.before, self.after),
            {} if self.choice is None else {"law_choice": self._choice_details(self.choice)},
        )  # fmt: skip

    def causes(self, result: SearchResult[FittedModel], evaluation: Evaluation) -> list[Cause]:
        """Interference, the effects found, and given parameter values that are wrong."""
        causes = []
        if self.disturbance is not None:
            misfit, beside = self.errors.misfit(self.before), bool(self.final.effects)
            causes.append(periodic_cause(self.disturbance, self.errors, misfit, beside))
        if self.final.effects:
            causes += effect_causes(
                self.space, result.best, self.final, self.errors, self.shifts, self.seed,
                1 - min(evaluation.unexplained, 1.0), self.validated.left(self.data.fitted),
                self._wrong_family,
            )  # fmt: skip
        if self.prescribed is not None and self.final is not self.prescribed:
            causes += wrong_numbers(self.law, self.prescribed.force, self.errors)
        return causes

    def depends_on(
        self, dependences: Sequence[Dependence], causes: Sequence[Cause], evaluation: Evaluation
    ) -> tuple[str, ...]:
        """Variables of the interference or the generic term found, or of the residual analysis."""
        if evaluation.adequate and not causes:
            return ()
        if self.disturbance is not None:
            return ("time", "frequency")
        term = next((c for c in causes if c.name == OUTSIDE), None)
        return smallest_set(dependences) if term is None else variables(term.form)

    def test_plan(self, result: SearchResult[FittedModel], causes: Sequence[Cause]) -> TestPlan:
        """Propose sinusoids under which rival causes differ most, and conditions not tested."""
        confusable = {c.name: c.confusable_with for c in causes if c.confusable_with}
        tests = rival_tests(self.final, self.space, result.best, confusable)
        missing, notes = missing_conditions(self.campaign.runs)
        return TestPlan(self.campaign.name, (*tests, *missing), notes)

    def devices(self, result: SearchResult[FittedModel]) -> tuple[Device, Device]:
        """The evaluated law, and the law with the selected effects."""
        data, law, final = self.data, self.law, self.final.without_offsets
        low, high = law.model.parameterisation.span
        evaluated = Device(
            law=law.model.parameterisation.law,
            current=law.model.parameterisation.dependence(law.values),
            current_range=(low, high) if high > low else (-np.inf, np.inf),
            tested_deformation=float(np.max(np.abs(data.x))),
            tested_current=high,
            source=f"diagnosed from {self.campaign.name}",
        )
        current = final.model.parameterisation.dependence(final.values[: final.model.n_law])
        applied = of_device_in_order(final.effects, final.model.parameters_of(final.values))
        extended = extend(replace(evaluated, current=current), applied)
        return evaluated if self.device is None else self.device, extended

    def traces(self, result: SearchResult[FittedModel]) -> tuple[Trace, ...]:
        """Force against deformation, run by run."""
        data = self.data
        return worst_first(
            Trace(
                name=name,
                held_out=not bool(data.fitted[run.start]),
                time=np.arange(run.stop - run.start) * dt,
                across=1e3 * data.x[run],
                across_label="deformation, mm",
                label="force, N",
                measured=data.force[run],
                before=self.before[run],
                after=self.after[run],
                settled=first,
            )
            for name, dt, run, first in zip(
                data.names, data.dt, data.runs, data.settled, strict=True
            )
        )

    @cached_property
    def data_notes(self) -> tuple[str, ...]:
        """Return suspicious features of the runs."""
        runs, fitted = self.campaign.runs, self.data.fitted
        errors = [
            RunError(replace(run, hold_out=not bool(fitted[at.start])), self.after[at], first)
            for run, at, first in zip(runs, self.data.runs, self.data.settled, strict=True)
        ]
        alone = outlier_note(errors)
        notes = data_notes(runs, self.data.averaging)
        unsettled = self.data.unsettled_note()
        first = [note for note in (alone, unsettled) if note]
        return (*first, *self._repaired, *notes)

    def data_text(self) -> Text:
        """Number, duration and range of the runs, and suspicious features."""
        data, runs = self.data, self.campaign.runs
        held = int(np.sum(~data.fitted[data.starts[:-1]]))
        held_out = "1 run is" if held == 1 else f"{held or 'No'} runs are"
        if len(runs) == 1:
            held_out = "The last third of its path is"
        duration = float(np.sum(data.lengths * data.dt))
        law = self.law.model.parameterisation.law
        notes = " ".join(
            sentence(note, [run.name for run in runs])
            for note in (*self.data_notes, start_note(data.periods, law))
            if note
        )
        low, high = data.current.min(), data.current.max()
        currents = f", currents {low:.3g} to {high:.3g} A" if data.current.any() else ""
        return Text(
            f"{len(runs)} run{'s' * (len(runs) > 1)}, {duration:.0f} s in all, deformations up "
            f"to {1e3 * np.max(np.abs(data.x)):.3g} mm{currents}. "
            f"{held_out} held out to validate the result. "
            f"{notes or 'Nothing looks wrong in the data.'}"
        )

    def noise_text(self) -> Text:
        """White noise of force and displacement."""
        data = self.data
        own = float(np.median(data.force_noise / data.force_size))
        moved = float(np.median(data.displacement_noise)) * 1e3
        return Text(
            f"By the data's own high frequencies, noise is {100 * own:.2g} % of the force in the "
            f"median run and {moved:.2g} mm in the displacement. Both pass through the model and "
            "leave an error even of a perfect one: the noise floor."
        )

    def choice_text(self) -> Text | None:
        """The laws that were compared."""
        if self.choice is None:
            return None
        return Text(
            self._choice_words(self.choice),
            ("law", "numbers", "fitted runs, %", "left out, %"),
            tuple(
                (one.law, str(one.n_numbers), f"{100 * one.error:.2f}", f"{100 * one.left_out:.2f}")
                for one in self.choice.ranks
            ),
        )

    def _choice_words(self, choice: LawChoice) -> str:
        """The choice, and whether the nominal law is of the wrong family."""
        if not self._wrong_family:
            return choice.text
        words = f"{self.model_name} is of the wrong family for these data. {choice.text}"
        if self.is_far_off:
            words += " Beside such a law an equation is looked for on request only (tiers)."
        return words

    def _choice_details(self, choice: LawChoice) -> dict[str, Any]:
        ranks = [
            {"law": one.law, "numbers": one.n_numbers}
            | {
                name: error if np.isfinite(error) else None
                for name, error in (("error", one.error), ("left_out", one.left_out))
            }
            for one in choice.ranks
        ]
        return {
            "text": self._choice_words(choice), "wrong_family": self._wrong_family, "laws": ranks
        }  # fmt: skip

    @property
    def _wrong_family(self) -> bool:
        """Whether another law alone fits far better, and no worse than this one with its causes."""
        if self.choice is None:
            return False
        name = self.law.model.parameterisation.law.name
        near = [one.law for one in self.choice.near]
        return name not in near and self.choice.least < self.errors.relative(self.after)

    @property
    def is_far_off(self) -> bool:
        """Whether an equation beside the law would only stand in for another law."""
        if self.choice is None or not self._wrong_family:
            return False
        own = self.choice.rank(self.law.model.parameterisation.law.name)
        return own is not None and own.left_out > FAR_OFF * self.choice.least

    def model_text(self, evaluation: Evaluation) -> Text:
        """Error of the law and features of its residual."""
        law, space, errors = self.law, self.space, evaluation.before
        times = law.cost / len(law.residual) * len(space.noise) / space.noise_cost
        memory = correlation_time(law.residual, np.array([0, len(law.residual)]))
        how = "fitted to the data" if self.prescribed is None else "as given"
        held_out = f", {100 * errors.held_out:.2f} % on those held out"
        text = (
            f"{self.model_name}, {how}: error {100 * errors.fit:.2f} % on the fitted runs"
            f"{held_out if errors.held_out > 0 else ''}; noise alone leaves "
            f"{100 * evaluation.noise.fit:.2f} %. Fitted as well as it can be, its squared "
            f"residual is {float(f'{times:.3g}'):g} times that of noise, "
            f"and a residual resembles its neighbours over {memory:.0f} samples."
        )
        if self.has_own_noise:
            text += (
                " The noise is not white: its strength is that of what remains above the "
                "frequencies of the motion."
            )
        if self.disturbance is not None:
            text += (
                f" A line at {self.disturbance.frequency:.2f} Hz that all runs share was removed "
                "from the force first."
            )
        if self._saturated is not None:
            text += (
                " Its parameters are quadratic in the current. Parameters that are linear in one "
                "saturating current (field_saturation) follow the data to noise, too."
            )
        if self.saturates:
            text += (
                " Its parameters are linear in the current: one saturation follows the currents "
                "as well as another quadratic curve of each parameter."
            )
        return Text(text)

    def trials_text(self, tried: Round[FittedModel]) -> Text:
        """Share of the squared residual above noise that each effect leaves."""
        noise = self.space.noise_cost
        before = max(tried.base.cost - noise, 1e-300)
        return Text(
            f"{len(self.space.effects)} variants of effects were screened, and the best fitted "
            "together with the law. The table shows the share of the squared residual above the "
            "noise that each leaves:",
            ("effect", "form", "left, %"),
            tuple(
                (one.effects[-1].title + " (taken)" * (one is tried.taken), one.effects[-1].form,
                 f"{100 * (one.cost - noise) / before:.3g}")
                for one in tried.tried
            ),
        )  # fmt: skip

    def outcome_text(
        self, result: SearchResult[FittedModel], evaluation: Evaluation, causes: Sequence[Cause]
    ) -> Text:
        """Why nothing was found, and effects that are too small to matter."""
        unstable, negligible = self.validated.unstable, self.validated.negligible
        if unstable:
            return Text(
                "Dropped, since most fits from other runs do not ask for it: "
                f"{', '.join(unstable)}."
            )
        if negligible:
            below = 100 * self.validated.negligible_below
            least = f"less than {below:.2g} % of the force is negligible"
            return Text(f"{'; '.join(negligible)}: {least}.")
        if causes:
            return Text("")
        if any(one.taken is not None for one in result.rounds):
            return Text(
                "Effects lowered the squared residual in the search, but none is named: in the end "
                f"they remove less than {100 * TO_BLAME_FITTED:.0f} % of the misfit of the fitted "
                f"runs or {100 * TO_BLAME:.0f} % of that of the runs held out, make some of these "
                "worse, or gain no more than chance."
            )
        return Text(
            "No effect lowered the squared residual by more than "
            f"{SIGNIFICANT:.0f} times the noise's share of it."
        )


def sentence(note: str, names: Sequence[str]) -> str:
    """A note about the data as a sentence; the name of a run keeps its letters."""
    begin = note if note.startswith(tuple(names)) else note[:1].upper() + note[1:]
    return begin if note.endswith("?") else f"{begin}."
