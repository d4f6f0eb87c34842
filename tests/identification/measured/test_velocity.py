"""Displacement, velocity and acceleration from noisy displacement, against the exact ones."""

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.identification.measured.velocity import _without_hum, smooth


@pytest.mark.parametrize(("frequency", "step", "n"), [(1, 1 / 256, 1280), (5, 0.005, 450)])
@pytest.mark.parametrize(("noise", "expected"), [(0.0, 2e-3), (1e-3, 5e-3), (1e-2, 2e-2)])
def test_sinusoid(frequency, step, n, noise, expected):
    time, omega = step * np.arange(n), 2 * np.pi * frequency
    x = np.sin(omega * time + 0.3) + noise * np.random.default_rng(1).standard_normal(n)
    exact = omega * np.cos(omega * time + 0.3)
    assert np.std(smooth(x, step)[1] - exact) < expected * np.std(exact)


def test_many_frequencies_beat_plain_differences():
    rng = np.random.default_rng(2)
    time = np.arange(0, 20, 1 / 256)
    omega = 2 * np.pi * rng.uniform(0.5, 10, 60)[:, None]
    phase = omega * time + rng.uniform(0, 6, (60, 1))
    exact = np.cos(phase).sum(axis=0)
    x = (np.sin(phase) / omega).sum(axis=0)
    x += 1e-2 * np.std(x) * rng.standard_normal(time.size)
    error = np.std(smooth(x, 1 / 256)[1] - exact)
    assert error < 0.02 * np.std(exact)
    assert error < 0.15 * np.std(np.gradient(x, 1 / 256) - exact)


def test_a_parabola_is_exact_and_rest_is_zero():
    time = 0.1 * np.arange(11)
    np.testing.assert_allclose(smooth(time**2, 0.1)[1], 2 * time, atol=1e-12)
    np.testing.assert_array_equal(smooth(np.zeros(6), 0.1)[1], 0.0)


def test_motion_that_starts_abruptly_keeps_its_start():
    time = np.arange(0, 6, 1 / 256)
    rising = 1 - np.exp(-((time / 0.25) ** 3))
    x = rising * np.sin(np.pi * time)
    exact = np.gradient(x, 1 / 256, edge_order=2)
    noisy = x + 7e-3 * np.random.default_rng(3).standard_normal(time.size)
    error = smooth(noisy, 1 / 256)[1] - exact
    assert np.std(error[:256]) < 0.04 * np.std(exact)
    assert np.std(error[256:]) < 0.02 * np.std(exact)


def test_acceleration_and_displacement_of_a_beat():
    time = np.arange(0, 8, 1 / 200)
    low, high = 2 * np.pi * 1.5, 2 * np.pi * 2.2
    x = np.sin(low * time) + np.sin(high * time)
    exact = -(low**2) * np.sin(low * time) - high**2 * np.sin(high * time)
    noisy = x + 1e-2 * np.random.default_rng(4).standard_normal(time.size)
    value, _, acceleration = smooth(noisy, 1 / 200)
    assert np.std(value - x) < 0.4 * 1e-2
    assert np.std(acceleration - exact) < 0.05 * np.std(exact)


@pytest.mark.parametrize(
    ("x", "step"), [([1.0, 2.0], 0.1), ([1.0, np.nan, 1, 1, 1], 0.1), (np.ones(9), 0.0)]
)
def test_refused(x, step):
    with pytest.raises(InputError, match="expected"):
        smooth(x, step)


@pytest.mark.parametrize(("mains", "rate"), [(50.04, 200), (59.97, 256), (50.0, 125)])
def test_hum_of_the_mains_is_no_motion(mains, rate):
    """A cut-off would follow it."""
    time = np.arange(10 * rate) / rate
    omega = 2 * np.pi * 0.7
    noise = 1e-4 * np.random.default_rng(3).standard_normal(time.size)
    x = np.sin(omega * time) + noise
    hum = 2e-4 * np.sin(2 * np.pi * mains * time + 1)
    (_, quiet, _), (_, with_hum, _) = smooth(x, 1 / rate), smooth(x + hum, 1 / rate)
    assert np.std(with_hum - quiet) < 2e-3
    # a motion of that frequency remains
    fast = np.sin(2 * np.pi * mains * time)
    assert np.std(smooth(fast, 1 / rate)[0]) == pytest.approx(np.std(fast), rel=0.1)


def test_a_harmonic_of_the_motion_is_no_hum():
    """A triangle wave of 2 Hz has its 25th multiple at 50 Hz."""
    time = np.arange(2000) / 200
    x = 2 / np.pi * np.arcsin(np.sin(4 * np.pi * time + 0.3))
    x += 1e-4 * np.random.default_rng(3).standard_normal(time.size)
    assert np.array_equal(_without_hum(x, 1 / 200), x)
