"""Wrong samples of a channel are found and interpolated; what a device does is not."""

from dataclasses import replace

import numpy as np
import pytest

from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.discrepancy.evaluate import evaluate
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.fit import fit
from isolation_sim.identification.measured.data_checks import data_notes
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.run_preparation import repaired, spikes

TIME = 0.005 * np.arange(1200)
X = 0.01 * np.sin(2 * np.pi * TIME)
V = 0.02 * np.pi * np.cos(2 * np.pi * TIME)
NOISE = np.random.default_rng(3).standard_normal(len(TIME))


def run(force, displacement=X, name="one"):
    return TestRun(name, TIME, displacement, V, force, np.zeros(len(TIME)), False)


@pytest.mark.parametrize("noise", [0.0, 2.0])
@pytest.mark.parametrize(
    ("places", "value"), [([400], 1e4), ([700], -300.0), ([500, 501, 502], 0.0)]
)
def test_spikes_and_dropouts_are_detected_and_interpolated(noise, places, value):
    clean = 2e4 * X + 500 * V + noise * NOISE
    force = clean.copy()
    force[places] = value if value else 1e3
    assert spikes(force).tolist() == places
    result, notes = repaired(Campaign("rig", "made", (run(force),)))
    (better,) = result.runs
    np.testing.assert_allclose(better.force, clean, atol=8.0 if noise == 0 else 15.0)
    assert np.array_equal(better.displacement, X)
    assert notes == [
        f"one: {len(places)} sample{'s lie' if len(places) > 1 else ' lies'} far off the others in "
        f"the force, first at {TIME[places[0]]:.4g} s; interpolated"
    ]


def test_a_spike_where_the_force_is_steep():
    force = 1e3 * np.tanh((TIME - 3.0) / 0.02) + 2.0 * NOISE
    force[602] = -5e4
    assert spikes(force).tolist() == [602]


def test_noise_as_large_as_the_force_is_said():
    noted = data_notes([run(100.0 * NOISE)], np.zeros(1))
    assert any("noise is 94 % of the force" in each for each in noted), noted


def test_fit_evaluate_and_diagnose_repair_and_say_so():
    force, displacement = 2e4 * X + 500 * V + 2.0 * NOISE, X.copy()
    force[300], displacement[600] = 1e5, 0.05
    runs = tuple(run(force, displacement, name) for name in ("one", "two"))
    campaign = Campaign("rig", "made", (*runs, replace(runs[0], name="three", hold_out=True)))
    fitted = fit(campaign, "kelvin_voigt", starts=2)
    assert fitted.error < 0.02
    assert fitted.device.parameters_at(0.0)[0] == pytest.approx(2e4, rel=0.01)
    diagnosis = diagnose(campaign, "kelvin_voigt")
    assert diagnosis.verdict == "adequate"
    text = "one: 1 sample lies far off the others in the displacement, first at 3 s; interpolated"
    assert text in diagnosis.data_notes and text in fitted.notes
    assert text in evaluate(fitted.device, campaign).notes


@pytest.mark.parametrize(
    "force",
    [
        2e4 * X + 150 * np.sign(V),
        2e4 * X + 150 * np.tanh(V / 1e-4) + 2.0 * NOISE,
        # an impact on an end stop in every cycle, a few samples long
        2e4 * X + 4e7 * np.maximum(np.abs(X) - 0.00995, 0) * np.sign(X),
        # one impact in the whole run
        2e4 * X + 800.0 * np.exp(-((TIME - 2.25) ** 2) / 0.005**2),
        # a transient at the beginning
        2e4 * X + 500 * V + 900.0 * np.exp(-TIME / 1e-3),
        150 * np.sign(NOISE),
        50.0 * NOISE,
    ],
)  # fmt: skip
def test_what_a_device_does_is_left_alone(force):
    assert not spikes(force).size
    campaign = Campaign("rig", "made", (run(force),))
    same, notes = repaired(campaign)
    assert same is campaign and not notes


def test_a_channel_that_stands_still_has_no_spikes():
    assert not spikes(np.zeros(50)).size


@pytest.mark.parametrize("level", [0.0, 2.0])
def test_a_wrong_sample_of_a_constant_current_is_detected(level):
    current = np.full(len(TIME), level)
    current[300] = -9999.0
    one = replace(run(2e4 * X + 500 * V), current=current)
    result, notes = repaired(Campaign("rig", "made", (one,)))
    assert np.all(result.runs[0].current == level)
    assert notes == [
        "one: 1 sample lies far off the others in the current, first at 1.5 s; interpolated"
    ]


def test_steps_and_quantisation_of_a_current_are_left_alone():
    current = np.repeat(np.arange(12) % 3, 100) + 0.1 * (np.arange(1200) % 7 == 0)
    one = replace(run(2e4 * X + 500 * V), current=current)
    assert repaired(Campaign("rig", "made", (one,)))[1] == []
