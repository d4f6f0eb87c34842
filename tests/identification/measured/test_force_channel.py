"""A moving average in the force channel is found where SciPy put one, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.fit import fit
from isolation_sim.identification.law_fit import refine_law
from isolation_sim.identification.law_model import LawModel
from isolation_sim.identification.measured.data_checks import data_notes
from isolation_sim.identification.measured.force_channel import (
    Averaging,
    find_averaging,
    moving_average,
)
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured_runs import measured_runs
from isolation_sim.identification.parameterisation import Parameterisation
from isolation_sim.laws.registry import LAWS

MOTIONS = ((25, 0.1), (25, 0.25), (25, 0.5), (10, 1.0), (5, 3.0), (2, 5.0))
A_CYCLE, N = 100, 600
SIZES = 1000.0, 0.01, 0.1
"""Force, displacement and their time, about which parameters are drawn."""


def _motions():
    runs = []
    for amplitude, frequency in MOTIONS:
        omega, time = 2 * np.pi * frequency, np.arange(N) / (A_CYCLE * frequency)
        x, v = (
            1e-3 * amplitude * np.sin(omega * time),
            1e-3 * amplitude * omega * np.cos(omega * time),
        )
        runs.append(
            TestRun(f"{amplitude}mm_{frequency}Hz", time, x, v, x, np.zeros(N),
                    velocity_measured=True)
        )  # fmt: skip
    return tuple(runs)


def _under(law, seed, noise):
    """Sinusoidal runs of a law with random parameters, 600 samples each; None if it diverges."""
    runs = _motions()
    p = Parameterisation(LAWS[law], np.zeros(1), SIZES)
    values = p.starts(seed + 1, 7)[seed]
    data = measured_runs(runs)
    force = LawModel(data, p).resolve_steps(values).forces(values, False)[0]
    if not np.all(np.isfinite(force)):
        return None
    random = np.random.default_rng(seed)
    return tuple(
        replace(run, force=force[a] + noise * np.std(force[a]) * random.standard_normal(N))
        for run, a in zip(runs, data.runs, strict=True)
    )


def _friction(slope):
    """A spring beside smoothed friction, 0.2 % of noise."""
    random = np.random.default_rng(4)
    result = []
    for run in _motions():
        force = 1e4 * run.displacement + 500.0 * np.tanh(run.velocity / slope)
        noise = 1.0 * random.standard_normal(N)
        result.append(replace(run, force=force + noise))
    return tuple(result)


def _averaged(runs, samples):
    return tuple(
        replace(run, force=uniform_filter1d(run.force, samples, mode="nearest")) for run in runs
    )


def test_no_average_is_detected_in_clean_campaigns():
    laws = ("bouc_wen", "dahl", "four_parameter", "hybrid", "hyperbolic_tangent", "lugre",
            "strain_stiffening")  # fmt: skip
    campaigns = [
        (law, runs) for law in laws for seed, noise in enumerate((0.0, 0.002, 0.005, 0.01))
        if (runs := _under(law, seed, noise)) is not None
    ]  # fmt: skip
    assert len(campaigns) >= 20
    assert [law for law, runs in campaigns if find_averaging(runs).widths.any()] == []


@pytest.mark.parametrize("samples", [7, 11, 15])
def test_an_average_of_scipy_is_detected(samples):
    runs = _friction(0.005)
    assert not find_averaging(runs).widths.any()
    widths = find_averaging(_averaged(runs, samples)).widths
    frequencies = np.array([frequency for _, frequency in MOTIONS])
    np.testing.assert_allclose(widths * frequencies, samples / A_CYCLE, rtol=0.04)
    notes = data_notes(_averaged(runs, samples), widths)
    assert any("all runs: the force channel is a moving average" in note for note in notes)


def test_a_moving_average_is_that_of_scipy():
    y = np.random.default_rng(0).standard_normal((80, 2))
    fine = np.stack([np.interp(np.arange(7801) / 100 + 0.5, np.arange(80), c) for c in y.T], 1)
    expected = uniform_filter1d(fine, 460, axis=0)[50::100]  # about the samples 1, 2, ...
    inside = slice(5, 70)
    np.testing.assert_allclose(moving_average(y, 4.6)[1:][inside], expected[inside], atol=5e-3)
    line = np.arange(9.0)
    np.testing.assert_allclose(moving_average(line, 3.3), line, atol=1e-12)


def test_the_fit_compares_after_the_average():
    runs = _averaged(_friction(0.005), 11)
    campaign = Campaign("friction", "made", runs)
    fitted = fit(campaign, "hyperbolic_tangent", fixed={"delta": 0.0, "c": 0.0, "F0": 0.0},
                 starts=4)  # fmt: skip
    values = {e.name: e.value for e in fitted.estimates}
    assert values["alpha"] == pytest.approx(500.0, rel=0.01)
    assert values["beta"] == pytest.approx(200.0, rel=0.05)


@pytest.mark.parametrize("averaged", [True, False])
def test_an_average_counts_as_one_only_if_the_law_is_not_nearer_without_it(averaged):
    runs = _averaged(_friction(0.005), 11) if averaged else _friction(0.005)
    widths = np.array([11 / (A_CYCLE * frequency) for _, frequency in MOTIONS])
    data = measured_runs(runs, Averaging(widths, widths))
    fixed = {"delta": 0.0, "c": 0.0, "F0": 0.0}
    p = Parameterisation(LAWS["hyperbolic_tangent"], np.zeros(1), SIZES, fixed)
    start = dict(zip((q.name for q in p.free), p.starts(1, 0)[0], strict=True))
    start |= {"k": 0.8e4, "alpha": 450.0, "beta": 180.0}
    model, _ = refine_law(LawModel(data, p), np.array(list(start.values())))
    np.testing.assert_array_equal(model.data.averaging, widths if averaged else 0 * widths)
