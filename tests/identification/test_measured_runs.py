"""The runs of a fit count by their noise, or alike where a law misses the force by far more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.fit import fit
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured.velocity import smooth
from isolation_sim.identification.measured_runs import measured_runs
from isolation_sim.identification.motion_noise import motion_noise

from ..pink_noise import pink_noise

N, DT = 2000, 0.005
NOISE = (0.1, 3.0, 0.3)
SIZES = (2e-3, 8e-3, 5e-3)


@pytest.fixture
def runs():
    random = np.random.default_rng(3)
    time = DT * np.arange(N)
    made = []
    for k, (noise, size) in enumerate(zip(NOISE, SIZES, strict=True)):
        omega = 2 * np.pi * (0.6 + 0.3 * k)
        x, v = size * np.sin(omega * time), size * omega * np.cos(omega * time)
        force = 2e4 * x + 800.0 * v + noise * random.standard_normal(N)
        made.append(TestRun(f"run{k}", time, x, v, force, np.zeros(N)))
    return made


def least_squares(runs, sigma):
    columns = np.concatenate(
        [np.stack([r.displacement, r.velocity], 1) / s for r, s in zip(runs, sigma, strict=True)]
    )
    force = np.concatenate([r.force / s for r, s in zip(runs, sigma, strict=True)])
    return np.linalg.lstsq(columns, force)[0]


def fitted(runs):
    device = fit(Campaign("made", "made", tuple(runs)), "kelvin_voigt", threads=1).device
    return np.asarray(device.parameters_at(0.0))


def test_a_force_beyond_the_limit_of_its_channel_tells_no_stiffness(runs):
    limit = 0.6 * float(np.max(runs[1].force))
    clipped = [replace(run, force=np.clip(run.force, -limit, limit)) for run in runs]
    data = measured_runs(clipped)
    assert [bool(data.clipped[run].any()) for run in data.runs] == [False, True, True]
    # what is left shows the noise of the channel
    np.testing.assert_allclose(data.force_noise, NOISE, rtol=0.2)
    np.testing.assert_allclose(fitted(clipped)[:2], (2e4, 800.0), rtol=0.01)


def test_a_device_rests_though_its_sensor_wanders():
    random, runs = np.random.default_rng(2), []
    time = DT * np.arange(N)
    for k, size in enumerate(SIZES):
        ends = np.clip(time, 0, 1) * np.clip(7 - time, 0, 1)
        x = size * ends**2 * (3 - 2 * ends) * np.sin(2 * np.pi * (0.6 + 0.3 * k) * time)
        noisy = x + 1e-5 * pink_noise(random, N)
        velocity = smooth(noisy, DT)[1]
        runs.append(TestRun(f"run{k}", time, noisy, velocity, 2e4 * x, np.zeros(N)))
    data = measured_runs(runs)
    at_rest = [data.v[run][int(7.8 / DT) : int(9.5 / DT)] for run in data.runs]
    assert min(np.mean(v == v[len(v) // 2]) for v in at_rest) > 0.9


def test_a_force_that_yields_without_noise_is_not_clipped():
    time = DT * np.arange(N)
    force = np.clip(300.0 * np.sin(2 * np.pi * time), -200.0, 200.0)
    runs = [TestRun("plastic", time, 1e-3 * time, np.full(N, 1e-3), force, np.zeros(N))]
    assert not measured_runs(runs).clipped.any()


def test_a_current_that_is_steady_up_to_noise_is_its_mean(runs):
    noise = 0.005 * np.random.default_rng(4).standard_normal(N)
    drift = np.linspace(-0.02, 0.02, N)
    currents = (1.0 + noise, 1.0 + drift + noise / 5, 1.0 + 0.5 * np.sign(drift) + noise)
    runs = [replace(run, current=one) for run, one in zip(runs, currents, strict=True)]
    first, *others = np.split(measured_runs(runs).current, 3)
    np.testing.assert_allclose(first, np.mean(currents[0]), rtol=1e-12)
    for result, inputs in zip(others, currents[1:], strict=True):
        np.testing.assert_array_equal(result, inputs)


@pytest.mark.parametrize(("most", "selected"), [(2.0, False), (0.5, True)])
def test_a_current_below_zero_is_noise_about_no_current_if_it_is_small(runs, most, selected):
    switched = np.where(np.arange(N) // 100 % 2, most, -0.02)
    runs = [replace(run, current=switched) for run in runs]
    expected = switched if selected else np.maximum(switched, 0.0)
    np.testing.assert_array_equal(measured_runs(runs).current, np.tile(expected, 3))


def test_runs_count_by_their_noise_under_the_right_law(runs):
    by_noise = least_squares(runs, NOISE)
    assert fitted(runs) == pytest.approx(by_noise, rel=2e-4)
    assert by_noise != pytest.approx(least_squares(runs, (1, 1, 1)), rel=2e-4)


def test_runs_count_alike_where_the_law_is_wrong(runs):
    wrong = [replace(run, force=run.force + 4e8 * run.displacement**3) for run in runs]
    alike = least_squares(wrong, (1, 1, 1))
    assert fitted(wrong) == pytest.approx(alike, rel=5e-3)
    assert alike != pytest.approx(least_squares(wrong, NOISE), rel=0.1)


def test_noise_keeps_its_mean_square_when_a_misfit_is_added(runs):
    data = measured_runs(runs)
    noise = np.repeat(data.assumed_noise, data.lengths)
    assert noise / np.repeat(data.sigma, data.lengths) == pytest.approx(1.0)
    weighed = data.weigh(data.force + 50.0)
    assert np.mean((noise * weighed.weight) ** 2) == pytest.approx(1.0)
    assert np.ptp(weighed.sigma) < 0.01 * weighed.sigma[0]


def test_noise_of_an_accelerometer_is_not_the_motion(runs):
    """What the displacement does not show is kept, if it is more than noise."""
    random, time = np.random.default_rng(6), DT * np.arange(N)
    # 5 micrometres at 25 Hz, below a step of the displacement
    shaking = 5e-6 * np.sin(2 * np.pi * 25 * time)
    true = [-((2 * np.pi * (0.6 + 0.3 * k)) ** 2) * run.displacement for k, run in enumerate(runs)]
    seen = [one - (2 * np.pi * 25) ** 2 * shaking for one in true]
    coarse = [np.round(run.displacement / 2e-5) * 2e-5 for run in runs]
    computed = measured_runs([
        replace(run, displacement=x, acceleration=a + 0.05 * random.standard_normal(N))
        for run, x, a in zip(runs, coarse, seen, strict=True)
    ])  # fmt: skip
    inner = np.tile(np.abs(time - time[-1] / 2) < 0.45 * time[-1], len(runs))
    assert np.std((computed.a - np.concatenate(seen))[inner]) < 0.03


def with_velocity(seed, of_displacement, of_velocity):
    """A sinusoid with noise of both channels, m and m/s; its run and exact velocity."""
    rng, time = np.random.default_rng(seed), np.arange(2000) / 200.0
    phase = 2 * np.pi * 1.5 * time
    x, v = 0.007 * np.sin(phase), 0.007 * 2 * np.pi * 1.5 * np.cos(phase)
    recorded = v + of_velocity * rng.standard_normal(time.size)
    noisy_x = x + of_displacement * rng.standard_normal(time.size)
    run = TestRun("a", time, noisy_x, recorded, 1e4 * x, 0 * x, velocity_measured=True)
    return run, v


def test_noise_of_a_measured_velocity_is_not_the_motion():
    run, v = with_velocity(7, 1e-6, 2e-4)
    data = measured_runs([run])
    assert np.std(data.v - v) < 0.3 * np.std(run.velocity - v)
    assert data.velocity_noise[0] == pytest.approx(2e-4, rel=0.2)
    assert np.isinf(measured_runs([replace(run, velocity_measured=False)]).velocity_noise[0])
    # what the velocity shows and the displacement does not is motion
    exact, v = with_velocity(7, 2e-4, 0.0)
    assert np.std(measured_runs([exact]).v - v) < 1e-3 * np.std(v)


def test_noise_of_a_measured_velocity_passes_the_smoothing():
    run, v = with_velocity(8, 1e-4, 5e-3)
    data = measured_runs([run])
    drawn = motion_noise(data, 8)[:, 1]
    assert np.std(drawn) == pytest.approx(np.std(data.v - v), rel=0.5)
