"""A displacement recorded late is found whatever its delay."""

import numpy as np
import pytest

from isolation_sim.discrepancy.device.effect_evaluation import evaluate
from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.effects import effect
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured_runs import measured_runs

DT = 1 / 500


def position(time, rate):
    """A sine with an envelope that lets it begin and end in motion."""
    return 5e-3 * np.sin(2 * np.pi * rate * time) * np.minimum(np.maximum(time, 0.0), 1.0)


def run(name, rate, late, hold_out=False, noise=0.0):
    time = np.arange(0.0, 4.0, DT)
    x, before, after = (position(time + by, rate) for by in (0.0, -1e-5, 1e-5))
    v = (after - before) / 2e-5
    force = 3e4 * x + 700 * v
    force += noise * np.std(force) * np.random.default_rng(int(9 * rate)).standard_normal(len(x))
    recorded = position(time - late, rate)
    velocity = np.gradient(recorded, DT)
    return TestRun(name, time, recorded, velocity, force, np.zeros_like(x), hold_out)


@pytest.mark.parametrize("late", [0.05, 0.03, 0.0007, -0.0003, -0.0127])
def test_the_motion_is_that_of_another_instant(late):
    form, data = effect("sensor_delay"), measured_runs([run("one", 4.0, late)])
    x, v = evaluate(form, data, data.force, np.array([-late]))["motion"]
    exact = position(np.arange(0.0, 4.0, DT), 4.0)
    # without the first quarter of a second: the measured velocity has a corner there
    inside = slice(125, -30)
    assert x[inside] == pytest.approx(exact[inside], abs=2e-3 * 5e-3)
    assert v[inside] == pytest.approx(np.gradient(exact, DT)[inside], abs=5e-3 * np.max(v))
    # at the end the motion goes on by a guess
    assert x[-30:] == pytest.approx(exact[-30:], abs=4e-2 * 5e-3)


def test_a_late_displacement_is_named_with_its_delay():
    rates = (0.5, 1.0, 2.0, 3.0, 4.0, 2.5)
    runs = [run(f"r{k}", f, 0.03, k in (2, 3), 0.005) for k, f in enumerate(rates)]
    diagnosis = diagnose(Campaign("late", "made", tuple(runs)), "kelvin_voigt", tiers="causes")
    (cause,) = diagnosis.causes
    assert (cause.name, cause.form) == ("sensor_delay", "shift")
    assert cause.parameters["delay"].value == pytest.approx(-0.03, rel=0.02)
    assert diagnosis.verdict == "explained"


def test_the_old_name_of_the_form_is_accepted():
    with pytest.warns(FutureWarning, match="shift"):
        assert effect("sensor_delay", "second_order") is effect("sensor_delay", "shift")
