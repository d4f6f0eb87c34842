"""Fit a law to a campaign: parameters with intervals, errors run by run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ground_motions.argument_types import checked

from ..errors import InputError
from ..laws import Device
from ..laws.law import Law
from ..laws.registry import LAWS
from ..workers import run_beside, workers
from .campaign import Campaign, read_campaign
from .current_basis import STEADY, tested_currents
from .error_notes import divergence_note, outlier_note
from .fitted import Estimate, Fit, RunError, labels, noise_of, pooled
from .law_choice import AUTO, choose_law
from .law_fit import LARGEST_DERIVATIVE, STARTS, fit_law, from_off, parameterise
from .law_model import LawModel
from .least_squares import Optimum, at_bound
from .measured.data_checks import data_notes, refuse_swapped
from .measured.noise import correlation_time
from .measured.run_starts import start_note
from .measured_runs import LEAST_NOISE, hold_out_some, measured_runs
from .motion_noise import INTERVAL_EXAMPLES, errors_by_motion, interval_of, motion_noise
from .parameterisation import Parameterisation
from .run_preparation import repaired, thin_runs
from .sensitivities import laws_to_compile

_DATA_NOTES = 5
"""Notes on the data, at most."""
_LACKING = 3.0
"""Residual over the force noise from which a note says that the law lacks something; displacement
noise alone can double the residual."""
_BETWEEN = 1.1
"""Factor on the larger force at two neighbouring currents from which the force between them is
implausible: a device's force rises or falls steadily with the current, and a curve may bulge."""


@checked
def fit(
    campaign: Campaign | str | Path,
    law: str | Law,
    *,
    current_degree: int | None = None,
    fixed: Mapping[str, float] | None = None,
    starts: int = STARTS,
    seed: int = 0,
    threads: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Fit:
    """Fit a law's parameters, polynomials of the current, to a campaign.

    The sum of squared force residuals of all runs that are not held out, each run's over its own
    force noise, is minimised by Levenberg-Marquardt steps within the law's bounds. The displacement
    is smoothed within its noise first. The search begins from published numbers and from seeded
    random starts whose sizes follow from the data by each parameter's unit. Poor starts are
    discarded with parameters that do not depend on the current; the best few then get their
    dependence, and the best one all samples. A weak spring holds parameters that the data leave
    open near the best start. The polynomials are handled in Bernstein's form, whose coefficients'
    bounds hold for the polynomial at every current in the range. ``diagnose`` fits a law with the
    same function: of a campaign that says which runs are held out, both give the same parameters.

    Parameters
    ----------
    campaign : Campaign, str or pathlib.Path
        The campaign, or its folder.
    law : str or Law
        The law, its registry name, or a place such as ``"my_laws.py:CUBIC"``; "auto" compares all
        registered laws on short data and takes the one that predicts the held-out runs best.
    current_degree : int, optional
        Degree of the polynomials of the current; by default the highest that the currents of the
        fitted runs determine, 2 at most.
    fixed : mapping of str to float, optional
        Parameters that are not fitted, in SI units. Of parameters among which one is redundant at
        constant currents, such as A, alpha, beta and gamma of the Bouc-Wen law, one is held in any
        case if no run changes its current.
    starts : int, default 20
        Number of starts.
    seed : int, default 0
        Seed of the random ones.
    threads : int, optional
        Number of threads; as many as there are processors by default.
    progress : callable, optional
        Called with 1 after each start.

    Returns
    -------
    Fit
        The fitted device, its parameters with intervals, and the errors run by run.

    Raises
    ------
    InputError
        If the campaign cannot be read, a name is unknown, the currents do not determine the
        polynomials, or no start leads to finite forces.
    """
    if law != AUTO and not isinstance(law, Law):
        law = LAWS[law]
    if not isinstance(campaign, Campaign):
        campaign = read_campaign(campaign)
    campaign, wrong = repaired(campaign)
    if starts < 1:
        raise InputError("starts", f"{starts}", "1 or more")
    refuse_swapped(campaign.runs)
    campaign, thinned = thin_runs(campaign)
    data = measured_runs(campaign.runs)
    choice = None
    if law == AUTO:
        with workers(threads) as pool, run_beside(laws_to_compile):
            some = hold_out_some(data, campaign.runs)
            choice = choose_law(campaign, some, current_degree, pool, seed=seed)
        law = LAWS[choice.best.law]
    assert isinstance(law, Law)
    model = LawModel(data, parameterise(campaign, law, data, current_degree, dict(fixed or {})))
    advance = (lambda: progress(1)) if progress is not None else (lambda: None)
    known = None if choice is None or fixed else choice.best.values
    with workers(threads) as pool:
        model, best = fit_law(model, pool, starts=starts, seed=seed, start=known, advance=advance)
    result = _result(campaign, model, best)
    chosen = "" if choice is None else choice.text
    begin = start_note(model.data.periods, law), model.data.unsettled_note()
    of_data = filter(
        None, (outlier_note(result.errors), *data_notes(campaign.runs, model.data.averaging))
    )
    diverges = divergence_note(result.errors)
    notes = filter(None, (diverges, *wrong, *thinned, *_first(of_data), chosen, *begin))
    return replace(result, notes=(*notes, *result.notes))


def _first(notes: Iterable[str]) -> list[str]:
    """The first notes on the data, and the number of the others."""
    notes = list(notes)
    others = len(notes) - _DATA_NOTES
    further = [f"{others} more notes on the data: isolation-sim diagnose lists them"]
    return notes[:_DATA_NOTES] + further * (others > 0)


def _result(campaign: Campaign, model: LawModel, best: Optimum) -> Fit:
    """Assemble the result."""
    p, runs = model.parameterisation, campaign.fitted
    # as fitted: noise on a steady current is no wider range, in which no bounds were kept
    currents = np.concatenate([
        model.data.current[at]
        for run, at in zip(campaign.runs, model.data.runs, strict=True) if not run.hold_out
    ])  # fmt: skip
    high = float(currents.max())
    low = from_off(float(currents.min()), high)
    device = Device(
        law=p.law,
        current=p.dependence(best.x),
        current_range=(low, high) if len(p.currents) > 1 else (-np.inf, np.inf),
        tested_deformation=max(float(np.abs(run.displacement).max()) for run in runs),
        tested_current=high,
        source=f"fitted to {campaign.name}",
        name=f"{p.law.name}, fitted",
    )
    force = model.forces(best.x, False)[0]
    errors = tuple(
        RunError(run, force[at], first)
        for run, at, first in zip(campaign.runs, model.data.runs, model.data.settled, strict=True)
    )
    estimates, covariance = _estimates(model, best)
    notes = _notes(campaign, estimates, covariance, best, errors)
    notes = (*_scale_notes(p), *_currents_note(campaign, model, best), *notes)
    return Fit(device, campaign, errors, notes, estimates, best.converged)


def _currents_note(campaign: Campaign, model: LawModel, best: Optimum) -> list[str]:
    """Warn where no run tests a law between the currents through which its polynomials pass."""
    fitted = tested_currents([run.current for run in campaign.fitted])
    everywhere = tested_currents([run.current for run in campaign.runs])
    steady = all(np.ptp(run.current) <= STEADY * max(fitted[-1], 1e-9) for run in campaign.fitted)
    n = len(model.parameterisation.currents)
    if n < 2 or n < len(fitted) or not steady or len(everywhere) > len(fitted):
        return []
    middles = (fitted[1:] + fitted[:-1]) / 2
    at = [_rms_force(model, best, current) for current in fitted]
    between = [_rms_force(model, best, current) for current in middles]
    ratios = np.array(between) / np.maximum(at[1:], at[:-1])
    worst = int(np.argmax(np.where(np.isfinite(ratios), ratios, np.inf)))
    middle = f"{middles[worst]:.3g} A"
    implausible = ""
    if not np.isfinite(ratios[worst]):
        implausible = f"; at {middle} its force is not finite"
    elif ratios[worst] > _BETWEEN:
        implausible = f"; at {middle} its force is {ratios[worst]:.2g} times that at its neighbours"
    several = ", ".join(f"{current:.3g}" for current in fitted[:-1])
    return [
        f"the runs have {several} and {fitted[-1]:.3g} A: between them the law is interpolated, "
        f"and no run tests it{implausible}; measure one at {middle} and hold it out"
    ]


def _rms_force(model: LawModel, best: Optimum, current: float) -> float:
    """RMS of the law's force under the motion of all runs, at one current."""
    motion = model.data.motion
    held = motion.with_current(np.full_like(motion.current, current))
    coefficients = model.parameterisation.coefficients(best.x)
    with np.errstate(all="ignore"):
        force = model.simulator(held).run(coefficients, False)[0]
        return float(np.sqrt(np.mean(force**2)))


def _scale_notes(p: Parameterisation) -> list[str]:
    """How parameters that the data leave open were chosen."""
    redundancy, scaling = p.law.redundancy, p.scaling
    held = {k: v for k, v in p.law.smoothing.items() if np.array_equal(p.fixed.get(k, np.nan), v)}
    notes = []
    if held:
        numbers = ", ".join(f"{name} = {value:g}" for name, value in held.items())
        notes.append(f"held, since they only round a corner off: {numbers}")
    if redundancy is None:
        return notes
    if scaling is not None:
        name = scaling.tied
        terms = " ".join(f"{'+' if f > 0 else '-'} {term}" for term, f in scaling.terms.items())
        choice = f"{terms.removeprefix('+ ')}, so that the hysteretic variable is 1 at most"
    elif np.array_equal(p.fixed.get(redundancy.held, np.nan), redundancy.value):
        name, choice = redundancy.held, f"held at {redundancy.value:g}"
    elif redundancy.of_data and redundancy.held in p.fixed:
        name = redundancy.held
        choice = f"held at {float(np.ravel(p.fixed[name])[0]):.4g}, a size from the data"
    else:
        return notes
    others = ", ".join(other for other in redundancy.among if other != name)
    return [*notes, f"{name} is {choice}: beside {others} it is redundant"]


def _estimates(model: LawModel, best: Optimum) -> tuple[tuple[Estimate, ...], NDArray]:
    """Values with 95 % intervals from the curvature, and their covariance."""
    p = model.parameterisation
    size = np.maximum(np.abs(best.x), 1e-12 * p.scale)
    derivatives = np.nan_to_num(best.jacobian)
    scaled = np.clip(derivatives, -LARGEST_DERIVATIVE, LARGEST_DERIVATIVE) * size
    n = len(p.currents)
    at_currents = np.kron(np.eye(len(p.free)), p.basis)
    residual = best.residual
    variance = float(residual @ residual) / max(len(residual) - len(best.x), 1)
    variance *= correlation_time(residual, model.data.without_held_out().starts)
    _, s, vt = np.linalg.svd(scaled.T @ scaled)
    keep = s > s[0] * 1e-13
    covariance = (vt[keep].T / s[keep]) @ vt[keep] * variance
    to_values = at_currents * size
    covariance = to_values @ covariance @ to_values.T
    values = at_currents @ best.x
    shift, half = _by_motion(model, best, at_currents)
    half = np.hypot(1.96 * np.sqrt(np.diag(covariance)), half)
    middle = values - shift
    # whatever basis of the open directions the decomposition has chosen
    undirected = np.linalg.norm(vt[~keep], axis=0) > 0.3
    bounded = (best.x <= p.lower) | (best.x >= p.upper)
    loose = (np.abs(at_currents) > 1e-9) @ (undirected | bounded)
    estimates = tuple(
        Estimate(
            name=quantity.name,
            unit=quantity.unit,
            current=float(current) if n > 1 else None,
            value=value,
            low=float(max(min(value, middle[i] - half[i]), quantity.lower)),
            high=float(min(max(value, middle[i] + half[i]), quantity.upper)),
            determined=bool(half[i] < abs(value) and not loose[i]),
            at_bound=at_bound(value, p.lower[i], p.upper[i], max(p.scale[i], abs(value))),
        )
        for k, quantity in enumerate(p.free)
        for i, current in enumerate(p.currents, k * n)
        for value in [float(values[i])]
    )
    return estimates, covariance


def _by_motion(model: LawModel, best: Optimum, at_currents: NDArray) -> tuple[NDArray, NDArray]:
    """Shift and half interval of the values at the currents by noise of the displacement."""
    if not np.any(model.data.displacement_noise > 0):
        return np.zeros(len(at_currents)), np.zeros(len(at_currents))
    shifts = list(motion_noise(model.data, INTERVAL_EXAMPLES))
    return interval_of(errors_by_motion(model, best.x, shifts) @ at_currents.T)


def _notes(
    campaign: Campaign,
    estimates: Sequence[Estimate],
    covariance: NDArray,
    best: Optimum,
    errors: Sequence[RunError],
) -> tuple[str, ...]:
    """Describe the undetermined parameters and the misfit of the law."""
    notes = []
    left = labels([e for e in estimates if not e.determined])
    if left:
        notes.append("the data do not determine " + ", ".join(left))
    spread = np.sqrt(np.diag(covariance)) + 1e-150
    correlation = covariance / np.outer(spread, spread)
    for i in range(len(estimates)):
        for j in range(i):
            a, b = estimates[j], estimates[i]
            if abs(correlation[i, j]) > 0.99 and a.determined and b.determined:
                notes.append(
                    f"{a.label} and {b.label} can hardly be distinguished (correlation "
                    f"{correlation[i, j]:.3f})"
                )
    if not best.converged:
        notes.append("the search ended before it converged")
    error = pooled(e for e in errors if not e.run.hold_out)
    noise = noise_of(campaign.fitted)
    if error > _LACKING * max(noise, LEAST_NOISE):
        ratio = error / max(noise, 1e-6)
        notes.append(
            f"the residual ({100 * error:.1f} %) is {ratio:.0f} times the data's own "
            f"noise ({100 * noise:.2g} %): the law lacks something; isolation-sim diagnose "
            "says what"
        )
    return tuple(notes)
