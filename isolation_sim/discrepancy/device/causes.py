"""Causes of the misfit to device tests: share, chance, numbers, rivals and evidence of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...effects import Effect, Past
from ...effects.effect import in_sentence
from ...identification.measured_runs import MeasuredRuns
from .. import inference
from ..decisions import (
    BESIDE_REMAINDER,
    CONFUSABLE_GAIN,
    FORM_LEAVES,
    MAY_BE_ZERO,
    MUCH_LEFT,
    NEEDED,
    NUMBERS_WRONG,
    SIGNIFICANT,
)
from ..diagnosis import Cause, Interval
from .carried_history import has_unknown_starts, is_kept_damage
from .effect_search import EffectSearch
from .force_errors import ForceErrors
from .generic_terms import OUTSIDE
from .interference import Interference
from .intervals import acts_as_another, intervals, may_be_zero, needs_bound
from .model import EACH_RUN, FittedModel, fit_model, run_means
from .stability import stability

PARAMETERS = "parameter_values"
"""Name of the cause that the parameter values, not the form, of a law are wrong."""
_ARMS = (("extra_relaxation", "one_arm"), ("extra_relaxation", "two_arms"))
"""Effects that are a spectrum of one time or two."""
_STANDS_IN = "The law is of the wrong family: it may only stand in for what another law has."
_LESS = "It corrects less than what remains unexplained, and may only mend the form of another."
_BESIDE_TERM = "It corrects less than a term whose form is not quite right, and may only mend that."
_BESIDE_IMITATION = (
    "It corrects less than what only acts like a cause, and may only mend the form of that."
)
_NO_HISTORY = (
    "It fits as well if the device had all of it before the first run: no run shows how it came."
)
_GRADUAL = "It builds up over a test as the other does, and may only mend the form of that one."
_SPECTRUM = (
    "A spring-pot is a continuous spectrum of arms: the smaller one may only mend the other's form."
)
_NAME_VARIES = "Most fits to other runs put another cause in its place: it may only mend a form."
_FORM = "More remains than a cause of the right form leaves: another effect may act alike."
_MAY_BE_ZERO = "It may as well have the size zero, and may only mend the form of another."


def effect_causes(
    space: EffectSearch, searched: FittedModel, final: FittedModel, errors: ForceErrors,
    shifts: NDArray, seed: int, explained: float, left: float, wrong_family: bool,
) -> list[Cause]:  # fmt: skip
    """Infer the causes that the effects of a model are, on all samples in ``final``.

    ``shifts`` are examples of noise; ``explained`` is the share of the misfit that is split, and
    ``left`` the share that is left of the fitted runs; in a law that is of the ``wrong_family`` an
    effect only acts like a cause.
    """
    data, judging = errors.data, errors.validation_samples
    others = [space.rivals(searched, k) for k in range(len(searched.effects))]
    # values that the search found without each effect, on all samples
    lacking = [
        replace(without, model=final.model.without(k)) for k, (without, _) in enumerate(others)
    ]
    cost, *costs = (one.cost_of(judging) for one in (final, *lacking))
    split = inference.shares(costs, cost, explained)
    numbers = intervals(final, shifts)
    stable = stability(space, searched, seed)
    less_than_remains = _less_than_remains(errors, final, lacking)
    leaves_noise = errors.is_noise(data.bounded(final.force), judging)
    leaves_little = leaves_noise or errors.is_noise(data.bounded(final.force), data.fitted)
    wrong_form = not leaves_little and min(left, 1 - explained) > FORM_LEAVES
    mends_term = _less_than_a_term(searched.causes, split, leaves_noise)
    mends_spectrum = less_of_a_spectrum(searched.effects, split)
    causes = []
    for k, (effect, (without, rivals)) in enumerate(zip(searched.effects, others, strict=True)):
        doubt = _STANDS_IN if wrong_family else _LESS * less_than_remains[k]
        doubt = doubt or _BESIDE_TERM * mends_term[k] or _SPECTRUM * mends_spectrum[k]
        doubt = doubt or _FORM * wrong_form or _NO_HISTORY * lacks_history(searched, k)
        if effect is EACH_RUN:
            numbers[k] = {"spread": _spread(final)}
        elif len(lacking) > 1 and split[k] < MAY_BE_ZERO and may_be_zero(final, k, numbers[k]):
            doubt = doubt or _MAY_BE_ZERO
        elif imitate(searched.effects) and effect.gradual and split[k] < MAY_BE_ZERO:
            doubt = doubt or _GRADUAL
        if len(lacking) > 1 and split[k] < MAY_BE_ZERO and stable[k].named < NEEDED:
            doubt = doubt or _NAME_VARIES
        gain = without.cost - searched.cost
        another = acts_as_another(searched, k, gain)
        needed = needs_bound(searched, k, gain)
        numbers[k] = {
            name: replace(one, at_bound=name in another or (needed and one.at_bound))
            for name, one in numbers[k].items()
        }
        shown, ratio = judging, np.sqrt(costs[k] / max(cost, 1e-300))
        if leaves_noise and errors.is_noise(data.bounded(lacking[k].force), judging):
            # those held out do not tell
            shown = data.fitted
            ratio = np.sqrt(lacking[k].cost_of(shown) / max(final.cost_of(shown), 1e-300))
        causes.append(
            Cause(
                name=effect.cause,
                share=split[k],
                p_value=inference.chi_squared_chance(
                    max(gain, 0.0) / space.noise_gain(without, searched),
                    max(searched.n_parameters - without.n_parameters, 1),
                    len(space.effects),
                ),
                parameters=numbers[k],
                reason=_reason(effect, numbers[k], split[k], float(ratio), data, shown, doubt),
                confusable_with=inference.rivals(
                    effect.cause,
                    [
                        *((one.causes[-1], one.cost - searched.cost) for one in rivals),
                        *((name, 0.0) for name in stable[k].rivals),
                    ],
                    max(SIGNIFICANT, CONFUSABLE_GAIN * gain),
                ),
                form=effect.form,
                stability={
                    "conditions_left_out": stable[k].conditions,
                    "runs_resampled": stable[k].resamplings,
                },
                doubtful=bool(doubt),
            )
        )
    return beside_imitations(causes, explained)


def beside_imitations(causes: Sequence[Cause], explained: float) -> list[Cause]:
    """Doubt causes that correct less than what only acts like one, where much is left."""
    imitation = max((one.share for one in causes if not one.is_named), default=0.0)
    if 1 - explained < MUCH_LEFT:
        return list(causes)
    return [
        replace(one, doubtful=True, reason=f"{one.reason} {_BESIDE_IMITATION}")
        if one.is_named and one.share < imitation
        else one
        for one in causes
    ]


def lacks_history(searched: FittedModel, place: int) -> bool:
    """Whether a damage of one specimen fits as well if it was there before the first run."""
    effect, model = searched.effects[place], searched.model
    past = model.data.past
    if not (is_kept_damage(effect) and past is not None):
        return False
    all_of_it = Past(*(np.full_like(each, np.max(each)) for each in past))
    other = fit_model(replace(model, data=replace(model.data, past=all_of_it)), searched.values)
    return other.cost < searched.cost + SIGNIFICANT


def imitate(effects: Sequence[Effect]) -> bool:
    """Whether effects mend each other's form: losses that build up over a whole test."""
    # Heat and wear are told apart by a rest. Heat in two bodies, or wear that slows down, looks
    # like both.
    return sum(effect.gradual for effect in effects) > 1


def _less_than_a_term(
    causes: Sequence[str], split: Sequence[float], leaves_noise: bool
) -> list[bool]:
    """Which effects correct less than a generic term beside them that leaves more than noise."""
    # a term is no equation of a device: what it leaves has its form
    if leaves_noise or OUTSIDE not in causes:
        return [False] * len(causes)
    return [share < split[causes.index(OUTSIDE)] for share in split]


def less_of_a_spectrum(effects: Sequence[Effect], split: Sequence[float]) -> list[bool]:
    """Which effects correct less than another one that is a spectrum of relaxations, too."""
    linear = _spectra(effects)
    largest = max((share for share, one in zip(split, linear, strict=True) if one), default=0.0)
    return [one and share < largest for share, one in zip(split, linear, strict=True)]


def share_a_spectrum(effects: Sequence[Effect]) -> bool:
    """Whether several effects are a spectrum of relaxations, which is one cause in two forms."""
    return sum(_spectra(effects)) > 1


def _spectra(effects: Sequence[Effect]) -> list[bool]:
    return [
        effect.form == "spring_pot" or (effect.cause, effect.form) in _ARMS for effect in effects
    ]


def _less_than_remains(
    errors: ForceErrors, final: FittedModel, lacking: Sequence[FittedModel]
) -> list[bool]:
    """Which of several effects correct less than what remains, by models without each."""
    data, judging = errors.data, errors.validation_samples
    force = data.bounded(final.force)
    if len(lacking) == 1 or errors.is_noise(force, judging):
        return [False] * len(lacking)
    after = errors.relative(force) ** 2
    remains = after - errors.noise_floor(judging) ** 2
    without = (errors.relative(data.bounded(one.force)) ** 2 for one in lacking)
    return [max(one - after, 0.0) < BESIDE_REMAINDER * remains for one in without]


def _reason(
    effect: Effect, values: Mapping[str, Interval], share: float, ratio: float,
    data: MeasuredRuns, shown: NDArray, doubt: str,
) -> str:  # fmt: skip
    """Sentences on an effect; ``ratio``: the residual without it, on samples, over that with it."""
    where = "fitted" if shown is data.fitted else "held out"
    numbers = ", ".join(
        f"{quantity.meaning} {values[quantity.name].value:.3g}"
        + f" {quantity.unit}" * (quantity.unit != "1")
        for quantity in effect.parameters
        if values[quantity.name].determined
    )
    samples = f"the {int(np.sum(shown))} samples {where}"
    # a law that depends on the effect may fail without it
    larger = (
        f"the residual on {samples} is {ratio:.3g} times as large" if np.isfinite(ratio)
        else f"the fitted law diverges on {samples}"
    )  # fmt: skip
    hardly = ", and that on those held out is noise" * bool(where == "fitted" and not shown.all())
    percent = f"{100 * share:.0f}" if share > 0.01 else f"{100 * share:.1g}"
    return (
        f"Without {in_sentence(effect.title)} {larger}{hardly}; it removes "
        f"{percent} % of the misfit{' with ' * bool(numbers)}{numbers}.{_remarks(effect)}"
        + f" {doubt}"
        * bool(doubt)
    )


def _remarks(effect: Effect) -> str:
    """What a user should know of an effect that is named."""
    remarks = []
    if not effect.of_device:
        remarks.append("It is in the instruments: a simulation does not have it.")
    if has_unknown_starts(effect):
        remarks.append(
            "Rests between the runs are unknown: the state at the start of each run, held out or "
            "not, follows from the forces of the run."
        )
    if effect.alike:
        remarks.append(f"What looks alike: {effect.alike}.")
    return "".join(f" {one}" for one in remarks)


def _spread(final: FittedModel) -> Interval:
    """RMS of the runs' own load-cell offsets, with its chi-squared interval."""
    from scipy.special import chdtri

    data = final.model.data
    residual = data.force - final.without_offsets.force
    n = len(data.dt)
    means = run_means(data, residual)[data.starts[:-1]]
    size = float(np.sqrt(np.mean(means**2)))
    low, high = (size * np.sqrt(n / chdtri(n, q)) for q in (0.025, 0.975))
    return Interval(size, float(low), float(high), "N")


def wrong_numbers(law: FittedModel, prescribed: NDArray, errors: ForceErrors) -> list[Cause]:
    """Infer whether given parameter values, with the force ``prescribed``, N, are to blame.

    ``law`` has fitted ones.
    """
    from scipy.special import chdtrc

    data = errors.data
    gain = data.cost(prescribed, data.fitted) - data.cost(law.force, data.fitted)
    n = law.model.n_law
    misfit = errors.misfit(data.bounded(prescribed))
    if gain < SIGNIFICANT + 2 * n or misfit == 0.0:
        return []
    share = 1 - errors.misfit(law.force) / misfit
    if share < NUMBERS_WRONG:
        return []
    reason = (
        f"Fitting the law's own {n} numbers to the data, without any effect, removes "
        f"{100 * share:.0f} % of the misfit."
    )
    return [Cause(PARAMETERS, share, float(chdtrc(n, gain)), {}, reason)]


def periodic_cause(one: Interference, errors: ForceErrors, misfit: float, beside: bool) -> Cause:
    """Describe interference as a cause, whether or not beside others of the law's own misfit."""
    data = errors.data
    size = float(np.sum((one.force * data.weight)[errors.validation_samples] ** 2))
    how = "multiplies" if one.modulates else "adds to"
    resolution = 0.5 / float(np.max(data.lengths * data.dt))
    low, high = one.frequency - resolution, one.frequency + resolution
    return Cause(
        name=OUTSIDE,
        share=size / (size + misfit),
        p_value=0.0,
        parameters={"frequency": Interval(one.frequency, low, high, "Hz")},
        reason=(
            f"A disturbance at {one.frequency:.2f} Hz {how} the force in all runs, whatever "
            f"their motion: {100 * one.size:.2g} % of it."
            + " Shares of the other causes are of the misfit that remains without it."
            * beside
        ),
        form=f"periodic at {one.frequency:.2f} Hz, {how} the force",
    )
