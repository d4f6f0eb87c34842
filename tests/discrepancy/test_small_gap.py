"""A clearance far smaller than the stroke is found beside friction."""

from dataclasses import replace

import numpy as np
import pytest

from isolation_sim.discrepancy.device.model import FittedModel, Model, fit_model
from isolation_sim.discrepancy.device.screen import fit_direction, screen_effect
from isolation_sim.effects import effect
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.law_fit import parameterise
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured_runs import measured_runs
from isolation_sim.laws import LAWS

NUMBERS = {"k": 2.5e5, "c": 1e3, "sigma": 1e8, "F_c": 4e4}
GAP = 1e-4


def sine(amplitude, frequency, step=1 / 200):
    time = np.arange(0, 3 / frequency, step)
    omega = 2 * np.pi * frequency
    x, v = amplitude * np.sin(omega * time), amplitude * omega * np.cos(omega * time)
    return TestRun(f"{amplitude} {frequency}", time, x, v, 1e5 * x, 0 * x, velocity_measured=True)


def test_a_gap_of_a_thousandth_of_the_stroke_is_screened():
    runs = [sine(0.12, f) for f in (0.2, 0.4)]
    play = effect("linkage_backlash", "play")
    data = measured_runs(runs)
    law = parameterise(Campaign("gap", "made", tuple(runs)), LAWS["dahl"], data)
    numbers = np.array([NUMBERS[q.name] for q in law.free])
    true = Model(data, law).with_effects(play)
    true = true.resolve_steps(np.append(numbers, GAP))
    force = true.forces(np.append(numbers, GAP), False)[0]
    noise = 0.003 * np.std(force) * np.random.default_rng(0).standard_normal(len(force))
    data = replace(true.data, force=force + noise)
    base = fit_model(Model(data, law), numbers, 30, 1e-8)
    direction = screen_effect(base, play, np.zeros((len(force), 1)))
    assert direction is not None
    found = fit_direction(base, direction)
    assert isinstance(found, FittedModel) and found.cost < 0.2 * base.cost
    assert found.values[-1] == pytest.approx(GAP, rel=0.1)
