"""Wrong samples of a channel are found and interpolated; what a device does is not."""

import numpy as np
import pytest

from isolation_sim.discrepancy.data_checks import data_notes
from isolation_sim.identification.measured_runs import measured_runs
from isolation_sim.identification.run_table import TestRun
from isolation_sim.identification.spikes import spikes, without_spikes

TIME = 0.005 * np.arange(1200)
X = 0.01 * np.sin(2 * np.pi * TIME)
V = 0.02 * np.pi * np.cos(2 * np.pi * TIME)
NOISE = np.random.default_rng(3).standard_normal(len(TIME))


def run(force, displacement=X, name="one"):
    return TestRun(name, TIME, displacement, V, force, np.zeros(len(TIME)), False)


@pytest.mark.parametrize("noise", [0.0, 2.0])
@pytest.mark.parametrize(
    ("places", "value"), [([400], 1e4), ([700], -300.0), ([0], 900.0), ([500, 501, 502], 0.0)]
)
def test_spikes_and_dropouts_are_found_and_interpolated(noise, places, value):
    clean = 2e4 * X + 500 * V + noise * NOISE
    force = clean.copy()
    force[places] = value if value else 1e3
    assert spikes(force).tolist() == places
    repaired = without_spikes(run(force))
    np.testing.assert_allclose(repaired.force, clean, atol=8.0 if noise == 0 else 15.0)
    assert np.array_equal(repaired.displacement, X)
    assert data_notes([run(force)], np.zeros(1))[0].startswith(
        f"one: {len(places)} sample{'s lie' if len(places) > 1 else ' lies'} far off the others in "
        f"the force, first at {TIME[places[0]]:.4g} s"
    )


def test_a_spike_where_the_force_is_steep():
    force = 1e3 * np.tanh((TIME - 3.0) / 0.02) + 2.0 * NOISE
    force[602] = -5e4
    assert spikes(force).tolist() == [602]


def test_noise_as_large_as_the_force_is_said():
    noted = data_notes([run(100.0 * NOISE)], np.zeros(1))
    assert any("noise is 94 % of the force" in each for each in noted), noted


def test_a_fit_sees_the_repaired_channels():
    force, displacement = 2e4 * X + 500 * V, X.copy()
    force[300], displacement[600] = 1e5, 0.05
    data = measured_runs([run(force, displacement)])
    assert np.max(np.abs(data.force)) < 400 and np.max(np.abs(data.x)) < 0.0101


@pytest.mark.parametrize(
    "force",
    [
        2e4 * X + 150 * np.sign(V),
        2e4 * X + 150 * np.tanh(V / 1e-4) + 2.0 * NOISE,
        # an impact on an end stop in every cycle, a few samples long
        2e4 * X + 4e7 * np.maximum(np.abs(X) - 0.00995, 0) * np.sign(X),
        # one impact in the whole run
        2e4 * X + 800.0 * np.exp(-((TIME - 2.25) ** 2) / 0.005**2),
        150 * np.sign(NOISE),
        50.0 * NOISE,
    ],
)  # fmt: skip
def test_what_a_device_does_is_left_alone(force):
    assert not spikes(force).size
    one = run(force)
    assert without_spikes(one) is one


def test_a_channel_that_stands_still_has_no_spikes():
    assert not spikes(np.zeros(50)).size
