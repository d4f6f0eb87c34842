"""Diagnosis of a campaign of device tests."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..effects import EFFECTS, Effect, extend
from ..identification.campaign import Campaign
from ..identification.workers import workers
from ..laws import Device
from ..laws.law import Law
from . import story
from .base_fit import SEARCHED, fitted_law, given_law, law_model, resolved
from .candidates import Fitted
from .checks import data_notes
from .diagnosis import Cause, Diagnosis, Errors, Interval, Verdict
from .evidence import dependences, depends_on
from .interference import interference
from .measured import Measured, measured
from .next_test import next_test
from .noise_examples import motion_noise, noise_residuals
from .outcome import Outcome
from .selection import SIGNIFICANT, Search
from .summary import confusable, gain_interval, p_value, shares
from .terms import OUTSIDE, terms, variables
from .uncertainty import intervals
from .zero import EACH_RUN, run_means

EXAMPLES = 6
"""Examples of noise against which a misfit is held."""
TO_BLAME = 0.35
"""Share of the misfit, on data held out, that effects have to remove together to be named."""
TO_BLAME_FITTED = 0.4
"""The same on the fitted runs: held out, a law that runs away makes any effect look helpful."""
EXPLAINED = 0.1
"""Unexplained share up to which a misfit counts as explained."""
ADEQUATE = 1.25
"""Cost over that of noise up to which a law without any effect counts as adequate."""
PARAMETERS = "parameter_values"
"""Name of the cause that a law's numbers, not its form, are wrong."""


def diagnose_campaign(
    campaign: Campaign,
    law: Law,
    device: Device | None = None,
    *,
    current_degree: int | None = None,
    seed: int = 0,
    threads: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Find what a law lacks to reproduce a campaign.

    Parameters
    ----------
    campaign : Campaign
        Measured runs.
    law : Law
        The law to judge.
    device : Device, optional
        Numbers with which to judge it; fitted to the campaign if not given.
    current_degree, seed, threads, progress : optional
        As of ``diagnose``.

    Returns
    -------
    Diagnosis

    Raises
    ------
    InputError
        If the law cannot be fitted to the campaign.
    """
    tell = progress or (lambda name: None)
    with workers(threads) as pool:
        outcome = _outcome(campaign, law, device, current_degree, seed, pool, tell)
        return _diagnosis(outcome, seed)


def _outcome(
    campaign: Campaign,
    law: Law,
    device: Device | None,
    degree: int | None,
    seed: int,
    pool: ThreadPoolExecutor,
    tell: Callable[[str], None],
) -> Outcome:
    def fit_base(data: Measured) -> tuple[Fitted, NDArray | None]:
        model = law_model(campaign, law, data, degree)
        if device is None:
            return fitted_law(model, pool, seed, lambda: tell("fitting the law")), None
        start = model.unknowns.of(device)
        base = given_law(model, start)
        return base, base.model.forces(start, False)[0]

    data = measured(campaign.runs)
    base, given = fit_base(data)
    disturbance = interference(data, base.force)
    if disturbance is not None:
        data = replace(data, force=data.force - disturbance.force)
        base, given = fit_base(data)
    shifts = motion_noise(data, EXAMPLES, seed)
    noise = noise_residuals(base, shifts, seed)
    chosen = data.fitted if data.fitted.all() else ~data.fitted
    floor = np.sqrt(np.mean((noise / data.weight[:, np.newaxis]) ** 2) / np.mean(data.force**2))

    part = data.thinned(SEARCHED).without_held_out()
    kept = data.kept(SEARCHED)
    small = base.on(resolved(replace(base.model, data=part), base.values, 1))
    part_noise = noise_residuals(small, shifts[:, :, kept[data.fitted[kept]]], seed)
    varies = np.ptp(part.current) > 0, part.has_temperature and np.ptp(part.temperature) > 1
    largest = float(np.max(np.abs(part.x)))
    search = Search(
        effects=_usable(part),
        terms=terms(largest, bool(varies[0]), bool(varies[1])),
        noise=part_noise,
        pool=pool,
        advance=lambda: tell("trying effects"),
    )
    evidence = dependences(small, search.noise_cost)
    found = search.run(small)
    tell("fitting all samples")
    outcome = Outcome(
        campaign=campaign,
        data=data,
        given=given,
        base=base,
        final=found.on(resolved(base.model, found.values)) if found.model.stages else base,
        search=search,
        evidence=evidence,
        disturbance=disturbance,
        floor=float(floor),
        shifts=shifts,
        noise_power=np.mean(noise**2, axis=1),
        chosen=chosen,
        notes=data_notes(campaign.runs),
    )
    # what helps on the fitted runs alone, or only where the law runs away, is no cause
    if outcome.left() > 1 - TO_BLAME or outcome.left(data.fitted) > 1 - TO_BLAME_FITTED:
        outcome = replace(outcome, final=base)
    return outcome


def _usable(data: Measured) -> list[Effect]:
    """Effects that the runs could show."""
    current_varies = bool(np.ptp(data.current) > 0)
    warmth_varies = data.has_temperature and bool(np.ptp(data.temperature) > 0.5)
    found = [EACH_RUN] if len(data.dt) > 2 else []
    for forms in EFFECTS.values():
        for effect in forms:
            if effect.current is not None and not current_varies:
                continue
            if "temperature" in effect.needs and not warmth_varies:
                continue
            found.append(effect)
    return found


def _diagnosis(outcome: Outcome, seed: int) -> Diagnosis:
    data, base, final = outcome.data, outcome.base, outcome.final
    before, after = outcome.before, outcome.after
    misfit = outcome.misfit(before)
    # noise that proves smaller than its estimate leaves nothing unexplained
    unexplained = outcome.left()
    causes = _causes(outcome, 1 - min(unexplained, 1.0), misfit)
    verdict = _verdict(outcome, causes, unexplained)
    if verdict == "adequate":
        unexplained = 0.0
    device = Device(
        law=base.model.unknowns.law,
        current=final.model.unknowns.dependence(final.values[: final.model.n_law]),
        current_range=_range(data),
        tested_deformation=float(np.max(np.abs(data.x))),
        tested_current=float(np.max(data.current)),
        source=f"diagnosed from {outcome.campaign.name}",
    )
    applied = [
        (stage.effect, final.parameters(k))
        for k, stage in enumerate(final.model.stages)
        if stage.effect is not EACH_RUN
    ]
    errors = []
    for force in (before, after):
        residual = force - data.force
        errors.append(
            Errors(data.relative(residual, data.fitted), data.relative(residual, ~data.fitted))
        )
    rivals = {c.name: c.confusable_with for c in causes if c.confusable_with}
    return Diagnosis(
        data=outcome.campaign.name,
        model=base.model.unknowns.law.title,
        verdict=verdict,
        noise_floor=outcome.floor,
        error_before=errors[0],
        error_after=errors[1],
        causes=tuple(causes),
        unexplained_share=float(min(unexplained, 1.0)),
        depends_on=_depends_on(outcome, verdict, causes),
        next_test=next_test(outcome.final, outcome.search, rivals),
        steps=story.steps(outcome, causes, verdict, errors),
        judged=replace(device, current=base.model.unknowns.dependence(base.values)),
        extended=extend(device, applied),
        gain=gain_interval(
            before - data.force, after - data.force, data.starts, outcome.chosen, seed
        )
        if causes
        else None,
        traces=story.traces(outcome),
    )


def _range(data: Measured) -> tuple[float, float]:
    low, high = float(data.current.min()), float(data.current.max())
    return (low, high) if high > low else (-np.inf, np.inf)


def _causes(outcome: Outcome, explained: float, misfit: float) -> list[Cause]:
    """Causes with their numbers, those that remove most first."""
    final, search = outcome.final, outcome.search
    found: list[Cause] = []
    if outcome.disturbance is not None:
        found.append(_periodic(outcome, misfit))
    if final.model.stages and search.found is not None:
        small = search.found
        others = [search.rivals(small, k) for k in range(len(small.effects))]
        # what the search found without each cause, on all samples
        costs = [
            replace(apart, model=final.model.without(k)).cost_of(outcome.chosen)
            for k, (apart, _) in enumerate(others)
        ]
        split = shares(costs, final.cost_of(outcome.chosen), explained)
        numbers = intervals(final, outcome.shifts)
        for k, (effect, (apart, rivals)) in enumerate(zip(small.effects, others, strict=True)):
            if effect is EACH_RUN:
                numbers[k] = {"spread": _spread(outcome)}
            cause = Cause(
                name=effect.cause,
                share=split[k],
                p_value=p_value(apart, small, search.noise, len(search.effects)),
                parameters=numbers[k],
                evidence=story.evidence(outcome, k, split[k], costs[k]),
                confusable_with=confusable(small, rivals, apart, effect.cause),
                form=effect.form,
            )
            found.append(cause)
    if outcome.given is not None and outcome.base is not None:
        found += _numbers_wrong(outcome, misfit)
    return sorted(found, key=lambda c: -c.share)


def _spread(outcome: Outcome) -> Interval:
    """RMS of the runs' own zeros, with the chi-squared interval of so many."""
    from scipy.special import chdtri

    free = replace(outcome.final.model, stages=())
    values = outcome.final.values[: free.n_law]
    residual = outcome.data.force - free.forces(values, False)[0]
    n = len(outcome.data.dt)
    means = run_means(outcome.data, residual)[outcome.data.starts[:-1]]
    size = float(np.sqrt(np.mean(means**2)))
    low, high = (size * np.sqrt(n / chdtri(n, q)) for q in (0.025, 0.975))
    return Interval(size, float(low), float(high), "N")


def _numbers_wrong(outcome: Outcome, misfit: float) -> list[Cause]:
    """The cause that the given numbers, not the law, are to blame for a part of the misfit."""
    assert outcome.given is not None
    data, refitted = outcome.data, outcome.base.force
    costs = [data.cost(force, data.fitted) for force in (outcome.given, refitted)]
    n = outcome.base.model.n_law
    if costs[0] - costs[1] < SIGNIFICANT + 2 * n or misfit == 0.0:
        return []
    share = 1 - outcome.misfit(refitted) / misfit
    if share < 0.02:
        return []
    from scipy.special import chdtrc

    return [
        Cause(
            name=PARAMETERS,
            share=share,
            p_value=float(chdtrc(n, costs[0] - costs[1])),
            parameters={},
            evidence=(
                f"Fitting the law's own {n} numbers to the data, without any effect, removes "
                f"{100 * share:.0f} % of the misfit."
            ),
        )
    ]


def _periodic(outcome: Outcome, misfit: float) -> Cause:
    one = outcome.disturbance
    assert one is not None
    size = float(np.sum((one.force * outcome.data.weight)[outcome.chosen] ** 2))
    what = "multiplies" if one.modulates else "adds to"
    resolution = 0.5 / float(np.max(outcome.data.lengths * outcome.data.dt))
    return Cause(
        name=OUTSIDE,
        share=size / (size + misfit),
        p_value=0.0,
        parameters={
            "frequency": Interval(
                one.frequency, one.frequency - resolution, one.frequency + resolution, "Hz"
            )
        },
        evidence=(
            f"A disturbance at {one.frequency:.2f} Hz {what} the force in all runs, whatever their "
            f"motion: {100 * one.size:.2g} % of it."
        ),
        form=f"periodic at {one.frequency:.2f} Hz, {what} the force",
    )


def _verdict(outcome: Outcome, causes: list[Cause], unexplained: float) -> Verdict:
    known = [c for c in causes if c.name != OUTSIDE]
    if not causes:
        fitted = outcome.data.fitted
        cost = outcome.base.cost_of(fitted) / max(int(fitted.sum()), 1)
        noise = outcome.search.noise_cost / len(outcome.search.noise)
        return "adequate" if cost < ADEQUATE * max(noise, 1.0) else "unexplained"
    if not known:
        return "unexplained"
    if len(known) == len(causes) and unexplained < EXPLAINED:
        return "explained"
    return "partly_explained"


def _depends_on(outcome: Outcome, verdict: Verdict, causes: list[Cause]) -> tuple[str, ...]:
    if verdict == "adequate":
        return ()
    if outcome.disturbance is not None:
        return ("time", "frequency")
    term = next((c for c in causes if c.name == OUTSIDE), None)
    if term is not None:
        return variables(term.form)
    return depends_on(outcome.evidence)
