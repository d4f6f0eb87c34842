"""Intervals of a fit hold the truth although the measured motion is noisy."""

import numpy as np
import pytest

from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.fit import fit
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured.velocity import smooth
from isolation_sim.identification.motion_noise import interval_of

STIFFNESS, DAMPING, STEP, SEEDS = 2e4, 800.0, 1 / 200, 4


def noisy_run(seed, noise=0.01):
    rng = np.random.default_rng(seed)
    time = np.arange(0, 10, STEP)
    omega, phase = 2 * np.pi * rng.uniform(0.3, 3.0, 8), rng.uniform(0, 2 * np.pi, 8)
    turned = np.outer(time, omega) + phase
    x, v = 2e-3 * np.sin(turned).sum(axis=1), 2e-3 * (omega * np.cos(turned)).sum(axis=1)
    seen = x + noise * np.max(np.abs(x)) * rng.standard_normal(len(x))
    force = STIFFNESS * x + DAMPING * v
    force += 0.005 * np.std(force) * rng.standard_normal(len(x))
    return TestRun(f"run{seed}", time, seen, smooth(seen, STEP)[1], force, 0 * x)


def test_intervals_hold_what_smoothing_takes_away():
    inside = []
    for seed in range(SEEDS):
        runs = [noisy_run(4 * seed + k) for k in range(4)]
        fitted = fit(Campaign("four", "made", runs), "kelvin_voigt", starts=2)
        k, c = fitted.estimates
        assert k.determined and c.determined and k.high - k.low < 0.1 * STIFFNESS
        inside += [k.low < STIFFNESS < k.high, c.low < DAMPING < c.high]
    assert np.mean(inside) >= 0.85


def test_few_examples_determine_nothing():
    shift, half = interval_of(np.zeros((3, 2)))
    np.testing.assert_array_equal(shift, [0, 0])
    assert np.isinf(half).all()
    assert interval_of(np.random.default_rng(0).normal(1.0, 0.1, (12, 1)))[0] == pytest.approx(
        1.0, abs=0.1
    )
