"""Rests of a device within noisy tests."""

import numpy as np
import pytest

from isolation_sim.identification.measured.holds import hold_still
from isolation_sim.identification.measured.velocity import smooth

STEP, NOISE = 1 / 128, 1e-3


def ramp_and_hold(seconds=8.0):
    """A ramp of half a second to 1, a rest, a ramp back to -0.5 and another rest."""
    time = np.arange(0, 2 * seconds, STEP)
    x = np.interp(time, [0, 1, 1.5, seconds, seconds + 0.5], [0, 0, 1, 1, -0.5])
    return time, x, np.gradient(x, STEP)


def noisy(values, size, seed=0):
    return values + size * np.random.default_rng(seed).standard_normal(len(values))


def test_a_device_that_is_held_does_not_move():
    time, x, v = ramp_and_hold()
    still = hold_still(noisy(x, NOISE), noisy(v, 0.01, 1), 0 * x, STEP)
    for begin, end in ((0.1, 0.9), (2, 7.5), (9, 15.5)):
        rest = (time > begin) & (time < end)
        assert np.max(np.abs(still[1][rest])) < 2e-3  # of 2 and 3 in the ramps, with 0.01 of noise
        np.testing.assert_allclose(still[0][rest], x[rest], atol=2 * NOISE)
    ramp = (time > 1.1) & (time < 1.4)
    np.testing.assert_array_equal(still[0][ramp], noisy(x, NOISE)[ramp])


@pytest.mark.parametrize("frequency", [0.01, 0.1, 0.7, 1.0, 2.0, 4.0, 17.3])
@pytest.mark.parametrize("noise", [0.0, NOISE])
def test_a_sinusoid_never_rests(frequency, noise):
    time = np.arange(0, max(6 / frequency, 5), STEP)
    x = noisy(np.sin(2 * np.pi * frequency * time), noise)
    v = 2 * np.pi * frequency * np.cos(2 * np.pi * frequency * time)
    still = hold_still(x, v, v, STEP)
    np.testing.assert_array_equal(still[0], x)
    np.testing.assert_array_equal(still[1], v)


def test_a_beat_does_not_rest_where_it_is_small():
    time = np.arange(0, 40, STEP)
    x = np.sin(2 * np.pi * 1.0 * time) + np.sin(2 * np.pi * 1.05 * time)
    v = np.gradient(x, STEP)
    moved = hold_still(x, v, v, STEP)[0] - x
    assert np.max(np.abs(moved)) < 0.01


def test_creep_after_a_ramp_keeps_its_speed():
    time = np.arange(0, 10, STEP)
    x = np.minimum(time, 1) + 2e-3 * np.maximum(time - 1, 0)
    still = hold_still(noisy(x, NOISE), np.gradient(x, STEP), 0 * x, STEP)
    rest = (time > 2) & (time < 9)
    np.testing.assert_allclose(still[1][rest], 2e-3, rtol=0.4)
    np.testing.assert_allclose(still[0][rest], x[rest], atol=NOISE)


@pytest.mark.parametrize("noise", [0.0, 1e-4, NOISE])
def test_ends_of_ramps_are_no_part_of_a_rest(noise):
    step, ramp = 1e-3, 0.35
    time = np.arange(0, 8, step)
    x, v = np.zeros_like(time), np.zeros_like(time)
    for begin, height in ((0.6, 0.5), (1.8, 0.5), (3.0, -0.6), (4.2, -0.9), (6.0, 0.5)):
        part = np.clip((time - begin) / ramp, 0, 1)
        x += height * (1 - np.cos(np.pi * part)) / 2
        v += height * np.pi / (2 * ramp) * np.sin(np.pi * part)
    still = hold_still(noisy(x, noise), v, 0 * x, step)
    assert np.max(np.abs(still[1] - v)) < (0.02 + 5 * noise**0.5) * np.max(np.abs(v))
    assert np.all(np.abs(still[1][(time > 2.3) & (time < 2.9)]) < 1e-3)


@pytest.mark.parametrize("size", [1e-4, 2e-6])
def test_what_moves_by_more_than_the_noise_does_not_rest(size):
    """A device that moves off slowly before a large motion: beyond the noise it moves."""
    time = STEP * np.arange(2000)
    begin = STEP * 500
    x = size * np.sin(2 * np.pi * 0.7 * time) ** 2
    x += np.where(time > begin, 0.1 * np.sin(2 * np.pi * 0.5 * (time - begin)), 0.0)
    v = np.gradient(x, STEP)
    still = hold_still(x, v, 0 * x, STEP, 2e-5)
    rests = still[1][100:300] == still[1][100]
    assert rests.all() == (size < 2e-5)


def test_a_device_rests_between_bursts_of_motion():
    step, noise = 2.5e-3, 5e-6
    time = np.arange(0, 6, step)
    moving = time % 2 < 1.5  # and 0.5 s of rest
    x = np.where(moving, 0.01 * np.sin(2 * np.pi * 2 * (time % 2)), 0.0)
    still = hold_still(*smooth(noisy(x, noise), step), step, noise)
    for begin in (1.5, 3.5):
        rest = still[1][(time > begin + 0.1) & (time < begin + 0.4)]
        assert np.ptp(rest) < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_a_short_rest_at_an_end_of_a_run_reaches_it(seed):
    step, rest, noise = 1 / 200, 0.4, 1e-3
    time = np.arange(0, 10 + 2 * rest, step)
    x = np.sin(np.pi * np.clip((time - rest) / 10, 0, 1) * 20)
    smoothed = smooth(noisy(x, noise, seed), step)
    moved = np.abs(smoothed[1]) > 0.05
    still = hold_still(*smoothed, step, noise)
    for begin, end in ((-1, 0.37), (10.44, 12)):
        held = (time > begin) & (time < end)
        assert np.max(np.abs(smoothed[1][held])) > 0.05
        np.testing.assert_array_equal(still[1][held], 0.0)
    between = (time > 0.5) & (time < 10.3) & moved
    np.testing.assert_array_equal(still[1][between], smoothed[1][between])
