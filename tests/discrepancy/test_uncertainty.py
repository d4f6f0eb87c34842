"""Intervals of a diagnosis hold the truth although the measured motion is noisy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from isolation_sim.discrepancy.device.intervals import intervals
from isolation_sim.discrepancy.device.model import FittedModel, Model, fit_model
from isolation_sim.effects import effect
from isolation_sim.identification import motion_noise as module
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.law_fit import parameterise
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured.velocity import smooth
from isolation_sim.identification.measured_runs import measured_runs
from isolation_sim.identification.motion_noise import (
    INTERVAL_EXAMPLES,
    errors_by_motion,
    motion_noise,
)
from isolation_sim.laws import LAWS

RATE, SECONDS = 256, 12.0
STIFFNESS, DAMPING, MASS = 2e4, 300.0, 12.0
SEEDS = 8


def campaign(seed, noise=0.03):
    """Random motion of a spring, a dashpot and a plate, by sums of sinusoids."""
    rng = np.random.default_rng(seed)
    time = np.arange(0, SECONDS, 1 / RATE)
    runs = []
    for k in range(3):
        omega, phase = 2 * np.pi * rng.uniform(0.3, 6.0, 20), rng.uniform(0, 2 * np.pi, 20)
        turned = np.outer(time, omega) + phase
        x = 1e-3 * np.sin(turned).sum(axis=1)
        v = 1e-3 * (omega * np.cos(turned)).sum(axis=1)
        a = -1e-3 * (omega**2 * np.sin(turned)).sum(axis=1)
        force = STIFFNESS * x + DAMPING * v + MASS * a
        seen = [y + noise * np.std(y) * rng.standard_normal(len(y)) for y in (x, force)]
        zero = np.zeros(len(time))
        velocity = smooth(seen[0], 1 / RATE)[1]
        runs.append(TestRun(f"run{k}", time, seen[0], velocity, seen[1], zero))
    return Campaign("plate", "made", runs)


def with_a_plate(runs):
    data = measured_runs(runs.runs)
    model = Model(data, parameterise(runs, LAWS["kelvin_voigt"], data))
    model = model.with_effects(effect("inertia_force", "mass"))
    start = model.parameterisation.starts(1, 0)[0]
    return fit_model(model, np.concatenate([start, [1.0]]), 50, 1e-10)


@pytest.mark.slow
def test_the_truth_is_held_although_every_fit_is_off_in_the_same_direction():
    errors, expected, inside = [], [], []
    for seed in range(SEEDS):
        final = with_a_plate(campaign(seed))
        shifts = motion_noise(final.model.data, INTERVAL_EXAMPLES // 2, seed)
        (numbers,) = intervals(final, shifts)
        result = numbers["mass"]
        assert result.low <= result.value <= result.high
        inside.append(result.low <= MASS <= result.high)
        errors.append(result.value - MASS)
        expected.append(np.median(errors_by_motion(final.model, final.values, shifts)[:, -1]))
    # smoothing takes acceleration away; the examples start from smooth motion and know most of it
    assert np.mean(errors) < -4 * np.std(errors) / np.sqrt(SEEDS)
    assert 0.4 < np.mean(expected) / np.mean(errors) < 1.1
    assert sum(inside) >= binom.ppf(1e-4, SEEDS, 0.95)


def test_without_noise_there_is_nothing_to_correct():
    final = with_a_plate(campaign(0, noise=0.0))
    shifts = motion_noise(final.model.data, 2)
    assert np.max(np.abs(errors_by_motion(final.model, final.values, shifts))) < 1e-3
    assert intervals(final, shifts)[0]["mass"].value == pytest.approx(MASS, rel=1e-3)


def test_the_steps_of_thinned_samples_resolve_a_stiff_law(monkeypatch):
    monkeypatch.setattr(module, "SEARCHED", 900)
    runs = campaign(0)
    data = measured_runs(runs.runs)
    model = Model(data, parameterise(runs, LAWS["maxwell"], data))
    model = model.with_effects(effect("inertia_force", "mass"))
    # a time constant of a tenth of a sample
    numbers = {"k": 1e6, "c": 400.0}
    values = np.array([*(numbers[q.name] for q in model.parameterisation.free), MASS])
    final = FittedModel.at(model.resolve_steps(values), values)
    assert len(errors_by_motion(final.model, final.values, motion_noise(data, 2))) == 2


def test_a_stop_that_is_never_touched_has_no_determined_gap():
    """Random motion against a stop ahead; the largest deformation behind is without contact."""
    runs = campaign(0, noise=0.005)
    with_stop = []
    for run in runs.runs:
        x = run.displacement
        inside = 0.6 * np.max(np.abs(x))
        contact = 1e5 * np.maximum(x - inside, 0.0)
        with_stop.append(replace(run, force=run.force + contact))
    data = measured_runs(with_stop)
    model = Model(data, parameterise(replace(runs, runs=with_stop), LAWS["kelvin_voigt"], data))
    model = model.with_effects(effect("end_stop", "two_gaps"))
    start = model.parameterisation.starts(1, 0)[0]
    largest = float(np.max(np.abs(data.x)))
    values = np.concatenate([start, [1e5, 0.6 * largest, 1.4 * largest, 1.0]])
    final = fit_model(model, values, 50, 1e-10)
    (numbers,) = intervals(final, motion_noise(data, INTERVAL_EXAMPLES // 2))
    assert not numbers["behind"].determined
    assert numbers["ahead"].determined and numbers["stiffness"].determined
