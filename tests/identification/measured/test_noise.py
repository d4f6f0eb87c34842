"""Noise of a displacement that passed an amplifier's low-pass, or none."""

import numpy as np
import pytest
from scipy.signal import butter, sosfilt, sosfiltfilt

from isolation_sim.identification.measured.noise import (
    channel_noise,
    coloured_noise,
    cycles_of,
    displacement_noise,
    noise_beside_steps,
    rounding_step,
    sensor_noise,
    slow_noise,
    steady_noise,
    white_noise,
)
from isolation_sim.identification.measured.velocity import smooth

from ...pink_noise import pink_noise

RATE, CORNER, SECONDS = 500.0, 25.0, 12.0
TIME = np.arange(0, SECONDS, 1 / RATE)
NOISE = 1e-3


def sinusoid():
    omega = 2 * np.pi * 0.7
    return np.sin(omega * TIME), -(omega**2) * np.sin(omega * TIME)


def random_motion(seed=0):
    rng = np.random.default_rng(seed)
    omega = 2 * np.pi * rng.uniform(0.2, 3.0, 40)[:, None]
    phase = omega * TIME + rng.uniform(0, 6, (40, 1))
    size = np.std(np.sin(phase).sum(axis=0))
    return np.sin(phase).sum(axis=0) / size, -(omega**2 * np.sin(phase)).sum(axis=0) / size


def filtered_noise(seed):
    """White noise of a standard deviation behind a low-pass of order 4."""
    white = np.random.default_rng(seed).standard_normal(TIME.size)
    return NOISE * sosfilt(butter(4, CORNER / (RATE / 2), output="sos"), white)


@pytest.mark.parametrize("motion", [sinusoid, random_motion])
@pytest.mark.parametrize("seed", range(4))
def test_noise_behind_a_low_pass_is_as_strong_as_the_white_noise_before_it(motion, seed):
    x = motion()[0] + filtered_noise(seed)
    assert white_noise(x) < 0.1 * NOISE  # what the highest frequencies tell
    assert sensor_noise(x).deviation == pytest.approx(NOISE, rel=0.4)


@pytest.mark.parametrize("order", [2, 4])
def test_a_corner_at_two_fifths_of_the_sampling_rate_is_seen(order):
    # the highest frequencies are then those of the noise, of its skirt and of what lies beyond
    low_pass = butter(order, 0.4, fs=1.0, output="sos")
    noise = [np.random.default_rng(k).standard_normal(TIME.size) for k in range(4)]
    behind = [NOISE * sosfilt(low_pass, one) for one in noise]
    channel = channel_noise(
        [random_motion(k)[0] + one for k, one in enumerate(behind)], [1 / RATE] * 4
    )
    np.testing.assert_allclose(channel.deviation, np.std(behind), rtol=0.2)
    assert channel.corner == pytest.approx(0.4 * RATE, rel=0.15)


@pytest.mark.parametrize("motion", [sinusoid, random_motion])
def test_white_noise_is_what_it_was(motion):
    x = motion()[0] + NOISE * np.random.default_rng(3).standard_normal(TIME.size)
    assert sensor_noise(x).deviation == pytest.approx(white_noise(x), rel=0.1)
    assert sensor_noise(x).deviation == pytest.approx(NOISE, rel=0.1)


@pytest.mark.parametrize("motion", [sinusoid, random_motion])
def test_a_noiseless_motion_has_none(motion):
    assert sensor_noise(motion()[0]).deviation < 1e-6


@pytest.mark.parametrize("servo", [8.0, 12.0])
def test_ramps_behind_a_servo_are_no_noise(servo):
    corners = [0, 0.5, 1.1, 1.9, 2.86, 3.66, 4.62, 5.42, 6.5, 7.3, 7.78, 8.28]
    levels = np.array([0, 0, 30, 30, -18, -18, 30, 30, -24, -24, 0, 0])
    time = np.arange(0, corners[-1], 1 / 4000)
    sos = butter(2, servo, fs=4000, output="sos")
    x = sosfilt(sos, np.interp(time, corners, levels))[::16]
    x += 2e-3 * np.random.default_rng(0).standard_normal(x.size)
    assert sensor_noise(x).deviation < 4e-3


@pytest.mark.parametrize("rate", [100.0, 250.0, 1000.0])
def test_a_soft_start_is_no_noise(rate):
    random = np.random.default_rng(1)
    for _ in range(20):
        frequency, ramp = random.uniform(0.3, 4), random.uniform(0.3, 3)
        time = np.arange(0, random.integers(5, 30) / frequency, 1 / rate)
        begun = np.clip(time * frequency / ramp, 0, 1)
        x = begun**2 * (3 - 2 * begun) * np.sin(2 * np.pi * frequency * time)
        x += NOISE / 5 * random.standard_normal(time.size)
        assert sensor_noise(x).deviation < 2 * NOISE / 5


def test_a_weak_motion_of_high_frequency_is_no_noise():
    x = sinusoid()[0] + 0.05 * np.sin(2 * np.pi * 9 * TIME) + filtered_noise(0)
    exact = sinusoid()[1] - 0.05 * (2 * np.pi * 9) ** 2 * np.sin(2 * np.pi * 9 * TIME)
    assert sensor_noise(x).deviation == pytest.approx(NOISE, rel=0.4)
    assert np.std(smooth(x, 1 / RATE)[2] - exact) < 0.15 * np.std(exact)


@pytest.mark.parametrize("motion", [sinusoid, random_motion])
def test_the_acceleration_does_not_follow_noise_behind_a_low_pass(motion):
    # with the noise of the highest frequencies alone it is nothing but noise
    x, exact = motion()
    noise = filtered_noise(1)
    followed = np.std(np.gradient(np.gradient(noise, 1 / RATE), 1 / RATE))
    error = np.std(smooth(x + noise, 1 / RATE)[2] - exact)
    assert error < 0.2 * followed
    assert error < 0.05 * np.std(exact)


def force_runs(noise):
    """Forces of a spring with friction under sinusoids, one of them fast and irregular."""
    runs = []
    for k, frequency in enumerate((0.2, 0.5, 1.0, 2.0, 3.0)):
        phase = 2 * np.pi * frequency * TIME
        force = np.sin(phase) + 0.2 * np.tanh(np.cos(phase) / 0.1) + noise(k)
        runs.append(force)
    abrupt = np.sign(np.sin(2 * np.pi * 4.3 * TIME)) * np.sin(2 * np.pi * TIME)
    return [*runs, abrupt + noise(9)]


def test_runs_that_hide_the_corner_have_the_noise_of_the_others():
    noise = channel_noise(force_runs(filtered_noise), [1 / RATE] * 6)
    true = [np.std(filtered_noise(k)) for k in (0, 1, 2, 3, 4, 9)]
    np.testing.assert_allclose(noise.deviation, true, rtol=0.4)
    assert noise.corner == pytest.approx(CORNER, rel=0.3)


def test_beside_a_known_force_a_corner_is_seen_that_its_turns_hide():
    turns = [np.sign(np.sin(2 * np.pi * f * TIME)) for f in (0.5, 0.7, 0.9, 1.3)]
    forces = [one + filtered_noise(k) for k, one in enumerate(turns)]
    true = [np.std(filtered_noise(k)) for k in range(4)]
    assert channel_noise(forces, [1 / RATE] * 4).corner == np.inf
    noise = channel_noise(forces, [1 / RATE] * 4, known=turns)
    assert noise.corner == pytest.approx(CORNER, rel=0.3)
    np.testing.assert_allclose(noise.deviation, true, rtol=0.2)


def test_a_motion_that_hides_the_corner_has_the_noise_of_the_others_at_most():
    fast = 0.03 * np.sin(2 * np.pi * np.cumsum(np.linspace(0.5, 22.0, TIME.size)) / RATE)
    motions = [sinusoid()[0], random_motion(1)[0], 0.5 * random_motion(2)[0], fast]
    x = [motion + filtered_noise(k) for k, motion in enumerate(motions)]
    assert sensor_noise(x[-1]).deviation < 0.1 * NOISE
    np.testing.assert_allclose(displacement_noise(x, [1 / RATE] * 4), NOISE, rtol=0.4)
    # the others have none, so that the channel has no corner
    quiet = [x[0], *motions[1:]]
    assert displacement_noise(quiet, [1 / RATE] * 4)[1:].max() < 0.01 * NOISE


def test_white_noise_of_a_channel_has_no_corner():
    def white(k):
        return NOISE * np.random.default_rng(k).standard_normal(TIME.size)

    runs = force_runs(white)
    noise = channel_noise(runs, [1 / RATE] * 6)
    assert noise.corner == np.inf
    white_ones = [white_noise(run) for run in runs[:-1]]
    np.testing.assert_array_equal(noise.deviation[:-1], white_ones)


def test_friction_that_reverses_in_a_bearing_is_no_filtered_noise():
    """Harmonics of a few ramped cycles are broad, and look like a plateau with a corner."""
    random = np.random.default_rng(8)
    forces, motions = [], []
    for amplitude, frequency in ((2, 0.5), (4, 1.0), (8, 2.0)):
        for friction in (8.0, 4.0, 2.0, 1.0):
            time = np.arange(0, 4 / frequency + 0.6, 1 / 200)
            cycles = np.clip((time - 0.3) * frequency, 0, 4)
            x = (
                amplitude
                * np.minimum(np.minimum(cycles, 4 - cycles), 1)
                * np.sin(2 * np.pi * cycles)
            )
            slip = np.tanh(np.gradient(x, time) / (2 * amplitude * frequency))
            forces.append(10 * x + friction * slip + 0.3 * random.standard_normal(time.size))
            motions.append(x)
    noise = channel_noise(forces, [1 / 200] * len(forces), motions)
    assert noise.corner == np.inf
    np.testing.assert_allclose(noise.deviation, 0.3, rtol=0.3)


def test_drawn_noise_has_unit_variance_and_its_corner():
    random = np.random.default_rng(5)
    drawn = [coloured_noise(random, TIME.size, 1 / RATE, CORNER) for _ in range(5)]
    assert np.std(drawn) == pytest.approx(1, rel=0.01)
    assert all(white_noise(one) < 1e-3 for one in drawn)
    same = np.random.default_rng(5).standard_normal(10)
    np.testing.assert_array_equal(coloured_noise(np.random.default_rng(5), 10, 0.1, 8.0), same)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_velocity_that_jumps_has_the_noise_between_its_jumps(noise):
    rng, time = np.random.default_rng(3), 0.01 * np.arange(200)
    triangles = np.sign(np.sin(2 * np.pi * 0.5 * time + 0.1)) + noise * rng.standard_normal(200)
    assert white_noise(triangles) > 0.03
    assert steady_noise(triangles) == pytest.approx(noise, rel=0.2, abs=1e-12)


def test_steps_of_a_force_are_no_noise():
    steps = np.sign(np.sin(2 * np.pi * 1.3 * TIME))
    random = np.random.default_rng(6)
    runs = [np.sin(2 * np.pi * f * TIME) for f in (0.4, 0.8, 1.2, 1.6)]
    noisy = [run + NOISE * random.standard_normal(TIME.size) for run in [*runs, steps * runs[1]]]
    assert white_noise(noisy[-1]) > 4 * NOISE
    np.testing.assert_allclose(channel_noise(noisy, [1 / RATE] * 5).deviation, NOISE, rtol=0.2)


def test_steps_of_a_fast_force_are_no_noise():
    time = np.arange(0, 10, 0.01)  # 25 samples a cycle
    steps = 1 + np.floor(time / 1.43) % 3
    random = np.random.default_rng(8)
    runs = [steps * np.sin(2 * np.pi * 4 * time + one) for one in range(3)]
    noisy = [run + 0.01 * random.standard_normal(time.size) for run in runs]
    assert all(white_noise(one) > 0.02 for one in noisy)
    np.testing.assert_allclose(channel_noise(noisy, [0.01] * 3).deviation, 0.01, rtol=0.4)


@pytest.mark.parametrize("corner", [0.3, 0.6])
def test_filtered_noise_is_not_underestimatednoise_beside_steps(corner):
    white = np.random.default_rng(9).standard_normal(TIME.size)
    filtered = sosfilt(butter(2, corner, output="sos"), white)
    assert noise_beside_steps(filtered) > white_noise(filtered)


def test_a_coarse_converter_has_noise():
    runs = [np.round(np.sin(2 * np.pi * f * TIME) / 0.02) * 0.02 for f in (0.2, 0.3)]
    assert np.median(np.abs(np.diff(runs[0], 2))) == 0
    assert np.all(channel_noise(runs, [1 / RATE] * 2).deviation > 1e-4)


@pytest.mark.parametrize("bits", [10, 12, 14])
def test_rounding_that_recurs_in_every_cycle_is_noise(bits):
    time, omega = np.arange(8000) / 400, 2 * np.pi
    exact, step = 0.013 * np.sin(omega * time), 0.03 / 2**bits
    rounded = step * np.round(exact / step)
    assert rounding_step(rounded) == pytest.approx(step, rel=1e-9)
    noise = sensor_noise(rounded)
    assert noise.rounded and noise.deviation == pytest.approx(step / np.sqrt(12), rel=1e-9)
    # it does not reach the velocity
    velocity = 0.013 * omega * np.cos(omega * time)
    wrong = np.std(smooth(rounded, 1 / 400)[1] - velocity)
    assert wrong < 0.1 * np.std(np.gradient(rounded, 1 / 400) - velocity)


def test_ramps_and_parabolas_are_not_rounded():
    phase = np.arange(8000) % 400
    ramps, parabolas = 0.01 * np.abs(phase - 200) / 100, 1e-6 * (phase - 200.0) ** 2
    for one in (ramps, parabolas, np.sin(phase * np.pi / 200), 0.0 * phase):
        assert rounding_step(one) == 0.0 and not sensor_noise(one + 1e-9 * phase).rounded


def test_harmonics_of_few_cycles_are_no_noise():
    time, random = np.arange(1280) / 256, np.random.default_rng(4)
    forces, displacements = [], []
    for size in (4.0, 8.0):
        x = 0.6 + size * np.sin(2 * np.pi * time)
        force = 40 * x
        for m in range(2, 9):
            force = force + 1.2 * np.cos(2 * np.pi * m * time + m * m)
        forces.append(force + 0.6 * random.standard_normal(time.size))
        displacements.append(x + 0.005 * random.standard_normal(time.size))
    noise = channel_noise(forces, [1 / 256] * 2, displacements)
    assert np.isinf(noise.corner)
    np.testing.assert_allclose(noise.deviation, 0.6, rtol=0.1)
    assert np.any(channel_noise(forces, [1 / 256] * 2).deviation > 0.9)


@pytest.mark.parametrize(("cycles", "frequency"), [(5.0, 1.0), (7.37, 1.474), (0.0, 0.4)])
def test_cycles_of_a_sinusoid_are_counted(cycles, frequency):
    time = np.arange(1280) / 256
    assert cycles_of(3 * np.sin(2 * np.pi * frequency * time)) == pytest.approx(cycles, abs=0.05)


def moved(random, n, period):
    """A random motion of such a mean period, in samples."""
    x = sosfiltfilt(butter(4, 2 / period, output="sos"), random.standard_normal(n))
    return x / np.std(x)


@pytest.mark.parametrize("pink", [0.0, 0.5, 2.0])
def test_slow_noise_is_told_by_the_frequencies_above_the_motion(pink):
    random, n = np.random.default_rng(8), 4096
    noise = random.standard_normal(n) + pink * pink_noise(random, n)
    x = moved(random, n, 80)
    assert slow_noise(noise, x) == pytest.approx(np.std(noise), rel=0.25)
    # what a law misses is far more than that
    missed = np.sign(np.gradient(x))
    assert slow_noise(noise + 6 * missed, x) < 0.8 * np.std(noise + 6 * missed)
    ripple = np.sin(12 * x)
    assert slow_noise(0.1 * noise + ripple, x) == 0.0


def test_a_motion_near_the_highest_frequencies_tells_no_slow_noise():
    random = np.random.default_rng(9)
    assert slow_noise(random.standard_normal(512), moved(random, 512, 5)) == 0.0
