"""Runs of far more samples than a fit needs are thinned, and lead to the same law and cause."""

from __future__ import annotations

import numpy as np
import pytest

from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.identification import run_preparation
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.fit import fit
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.run_preparation import LONGEST_STEP, SAMPLES_PER_CYCLE, thin_runs

K, C, FRICTION = 2e4, 800.0, 30.0


def sinusoid(name, amplitude, frequency, step, cycles, friction=0.0, seed=0):
    t = np.arange(0, cycles / frequency, step)
    x = amplitude * np.sin(2 * np.pi * frequency * t)
    v = 2 * np.pi * frequency * amplitude * np.cos(2 * np.pi * frequency * t)
    force = K * x + C * v + friction * np.tanh(v / 1e-3)
    noise = np.random.default_rng(seed).normal(0, 1.0, t.size)
    return TestRun(name, t, x, v, force + noise, np.zeros(t.size), velocity_measured=True)


def made_at(step, friction=0.0):
    conditions = [(5e-3, 0.5), (10e-3, 0.5), (10e-3, 1.0), (5e-3, 2.0)]
    runs = [sinusoid(f"r{k}", *one, step, 3, friction, k) for k, one in enumerate(conditions)]
    return Campaign("tests", "made here", tuple(runs))


def test_what_is_retained(monkeypatch):
    campaign = Campaign(
        "tests", "made here",
        (sinusoid("slow", 5e-3, 0.1, 1e-3, 2), sinusoid("quick", 5e-3, 5.0, 1e-3, 2),
         sinusoid("coarse", 5e-3, 0.1, 5e-3, 2)),
    )  # fmt: skip
    assert thin_runs(campaign) == (campaign, [])
    monkeypatch.setattr(run_preparation, "MOST_SAMPLES", 6000)
    (slow, quick, coarse), notes = thin_runs(campaign)[0].runs, thin_runs(campaign)[1]
    # 20,000 samples could leave one in ten, but a current has to be followed
    assert slow.step == pytest.approx(LONGEST_STEP)
    np.testing.assert_array_equal(slow.force, campaign.runs[0].force[::5])
    assert quick.time.size == 400 and 0.2 / 1e-3 >= SAMPLES_PER_CYCLE
    assert coarse.time.size == 4000
    assert notes == ["8400 of 24400 samples are used: of long runs one in 5 at most"]


def test_thinned_runs_have_the_same_law_and_cause(monkeypatch):
    monkeypatch.setattr(run_preparation, "MOST_SAMPLES", 3000)
    result = fit(made_at(1e-3), "kelvin_voigt", starts=1, threads=1)
    assert sum(run.time.size for run in result.campaign.runs) < 5500
    assert any("samples are used" in note for note in result.notes)
    np.testing.assert_allclose([one.value for one in result.estimates], [K, C], rtol=0.01)
    diagnosis = diagnose(made_at(1e-3, FRICTION), "kelvin_voigt", tiers="causes", threads=1)
    assert [cause.name for cause in diagnosis.causes] == ["coulomb_friction"]
    assert diagnosis.causes[0].parameters["level"].value == pytest.approx(FRICTION, rel=0.05)
    assert "samples are used" in str(diagnosis)
