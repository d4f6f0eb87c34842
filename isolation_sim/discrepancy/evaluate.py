"""Errors of a law, with effects or without, on any measured runs."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..effects import separate
from ..effects.effect import in_sentence
from ..errors import InputError
from ..identification.campaign import Campaign, read_campaign
from ..identification.error_notes import divergence_note
from ..identification.fitted import LawEvaluation, RunError
from ..identification.law_fit import NOT_AVERAGED, from_off
from ..identification.measured.force_channel import Averaging, averaging_note, find_averaging
from ..identification.measured.run_starts import start_note
from ..identification.measured_runs import MeasuredRuns, measured_runs
from ..identification.parameterisation import Parameterisation
from ..identification.run_preparation import repaired
from ..laws import Device
from .device.carried_history import can_carry_history, carry_history, has_unknown_starts
from .device.model import Model

_LESS = 0.7
"""Part of a law's squared error that averaging its force must leave, where few runs suggest it."""


def evaluate(device: Device, campaign: Campaign | str | Path) -> LawEvaluation:
    """Compute the errors of a law on measured runs; nothing is fitted."""
    if not isinstance(campaign, Campaign):
        campaign = read_campaign(campaign)
    campaign, wrong = repaired(campaign)
    base, applied = separate(device)
    if len(base.current.coefficients) > 1:
        raise InputError(
            f"{base.name}: parameters are given piecewise in the current; expected: one polynomial "
            "for all currents"
        )
    averaging = find_averaging(campaign.runs)
    none = np.zeros_like(averaging.widths)
    data = _scaled(measured_runs(campaign.runs, Averaging(none, none)), base)
    # as many currents as a polynomial has coefficients
    currents = np.arange(base.current.coefficients.shape[2], dtype=float)
    parameterisation = Parameterisation(base.law, currents, (1.0, 1.0, 1.0))
    values = np.concatenate(
        [parameterisation.of(base, bounded=False),
         *([numbers[q.name] for q in effect.parameters] for effect, numbers in applied)]
    )  # fmt: skip
    model = Model(data, parameterisation, effects=tuple(effect for effect, _ in applied))
    model = model.resolve_steps(values).settle_starts(values)
    data = model.data
    force, history = _forces(model, values, base.force_scale)
    data, force = _averaged(data, force, averaging)
    errors = tuple(
        RunError(run, force[a:b], first)
        for run, (a, b), first in zip(
            campaign.runs, pairwise(data.starts), data.settled, strict=True
        )
    )
    begin = start_note(data.periods, base.law), data.unsettled_note()
    own = (*wrong, averaging_note(data.averaging), *begin)
    notes = filter(None, (divergence_note(errors), *_notes(device, campaign), *own, history))
    return LawEvaluation(device, campaign, errors, tuple(notes))


def _forces(model: Model, values: NDArray, scale: float) -> tuple[NDArray, str]:
    """Forces of a law, N, and a note if its effects go on from run to run, as in one specimen."""
    force = scale * model.forces(values, False)[0]
    going_on = [effect for effect in model.effects if can_carry_history(effect)]
    if not going_on or model.data.past is None:
        return force, ""
    effects = tuple(carry_history(one) if one in going_on else one for one in model.effects)
    data = replace(model.data, force=model.data.force / scale)
    other = scale * replace(model, effects=effects, data=data).forces(values, False)[0]
    misfits = [float(np.sum((one - model.data.force) ** 2)) for one in (other, force)]
    if not misfits[0] < _LESS * misfits[1]:
        return force, ""
    names = ", ".join(in_sentence(one.cause) for one in going_on)
    rests = " (after rests as each run's forces suggest)" * any(map(has_unknown_starts, effects))
    return other, f"{names}: goes on from run to run{rests}, which is nearer to the forces"


def _averaged(
    data: MeasuredRuns, force: NDArray, averaging: Averaging
) -> tuple[MeasuredRuns, NDArray]:
    """Average the force of a law as the channel does, if that is near to the measured force."""
    # Clear signs of an average count unless the force itself is clearly nearer; where runs are too
    # few to tell, the averaged one has to be.
    clear = bool(averaging.widths.any())
    widths = averaging.widths if clear else averaging.suspected
    if not widths.any():
        return data, force
    averaged = replace(data, averaging=widths)
    recorded = averaged.record(force)
    wrong, after = (float(np.sum((one - data.force) ** 2)) for one in (force, recorded))
    keeps = wrong >= NOT_AVERAGED**2 * after if clear else after < _LESS * wrong
    return (averaged, recorded) if keeps else (data, force)


def _scaled(data: MeasuredRuns, base: Device) -> MeasuredRuns:
    """Runs in the scales of the law's numbers; the forces stay in N."""
    past, length, energy = data.past, base.length, base.length * base.force_scale
    if past is not None:
        past = past._replace(
            deformation=past.deformation / length, travel=past.travel / length,
            work=past.work / energy, dissipated=past.dissipated / energy,
        )  # fmt: skip
    return replace(data, x=data.x / length, v=data.v / length, a=data.a / length, past=past)


def _notes(device: Device, campaign: Campaign) -> tuple[str, ...]:
    """Runs outside the range of the law's numbers."""
    notes = []
    low, high = device.current_range
    # noise of the current is no larger current
    slack = 0.01 * (high - low) if np.isfinite(high - low) else 0.0
    outside = [
        run.name for run in campaign.runs
        if from_off(run.current.min(), high) < low - slack or run.current.max() > high + slack
    ]  # fmt: skip
    if outside:
        notes.append(f"current outside {low:g} to {high:g} A in {', '.join(outside)}")
    most = device.tested_deformation * device.length
    # noise of the displacement is no larger deformation
    beyond = 1.01 * most
    large = [run.name for run in campaign.runs if np.max(np.abs(run.displacement)) > beyond]
    if large:
        notes.append(f"deformation above the tested {1e3 * most:.3g} mm in {', '.join(large)}")
    return tuple(notes)
