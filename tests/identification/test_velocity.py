"""Velocity from noisy displacement, against the exact one."""

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.identification.velocity import differentiate


@pytest.mark.parametrize(("frequency", "step", "n"), [(1, 1 / 256, 1280), (5, 0.005, 450)])
@pytest.mark.parametrize(("noise", "accepted"), [(0.0, 2e-3), (1e-3, 5e-3), (1e-2, 5e-2)])
def test_sinusoid(frequency, step, n, noise, accepted):
    time, omega = step * np.arange(n), 2 * np.pi * frequency
    x = np.sin(omega * time + 0.3) + noise * np.random.default_rng(1).standard_normal(n)
    exact = omega * np.cos(omega * time + 0.3)
    assert np.std(differentiate(x, step) - exact) < accepted * np.std(exact)


def test_many_frequencies_beat_plain_differences():
    rng = np.random.default_rng(2)
    time = np.arange(0, 20, 1 / 256)
    omega = 2 * np.pi * rng.uniform(0.5, 10, 60)[:, None]
    phase = omega * time + rng.uniform(0, 6, (60, 1))
    exact = np.cos(phase).sum(axis=0)
    x = (np.sin(phase) / omega).sum(axis=0)
    x += 1e-2 * np.std(x) * rng.standard_normal(time.size)
    error = np.std(differentiate(x, 1 / 256) - exact)
    assert error < 0.12 * np.std(exact)
    assert error < 0.8 * np.std(np.gradient(x, 1 / 256) - exact)


def test_a_parabola_is_exact_and_rest_is_zero():
    time = 0.1 * np.arange(11)
    np.testing.assert_allclose(differentiate(time**2, 0.1), 2 * time, atol=1e-12)
    np.testing.assert_array_equal(differentiate(np.zeros(6), 0.1), 0.0)


@pytest.mark.parametrize(
    ("x", "step"), [([1.0, 2.0], 0.1), ([1.0, np.nan, 1, 1, 1], 0.1), (np.ones(9), 0.0)]
)
def test_refused(x, step):
    with pytest.raises(InputError, match="accepted"):
        differentiate(x, step)
