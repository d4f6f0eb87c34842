import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground_motions import band_limited_noise, band_limited_series


def power(series, dt):
    """One-sided periodogram over one whole period of the series."""
    return np.fft.rfftfreq(len(series), dt), 2 * dt / len(series) * np.abs(np.fft.rfft(series)) ** 2


@pytest.mark.parametrize(("low", "high"), [(0.0, 20.0), (1.0, 10.0)])
def test_the_band_is_exact_and_flat_without_a_taper(low, high):
    series = band_limited_series(low, high, 19.99, 0.01, rms=1.0, seed=5, taper=0.0)
    frequency, density = power(series, 0.01)
    inside = (frequency >= low - 1e-9) & (frequency <= high + 1e-9) & (frequency > 0)
    lines = np.count_nonzero(inside)
    # Lines 1 / (n dt) apart share the mean square equally.
    np.testing.assert_allclose(density[inside], 20.0 / lines, rtol=1e-9)
    assert np.max(density[~inside]) < 1e-20


@given(st.integers(0, 2**32), st.floats(0.01, 100.0))
@settings(deadline=None)
def test_targets_are_hit_whatever_the_seed(seed, size):
    rms = band_limited_series(0.5, 10.0, 5.0, 0.02, rms=size, seed=seed)
    assert np.sqrt(np.mean(rms**2)) == pytest.approx(size, rel=1e-13)
    pga = band_limited_noise(0.5, 10.0, 5.0, 0.02, pga=size, seed=seed)
    assert pga.pga == pytest.approx(size, rel=1e-15)


def test_seeds_repeat_and_differ():
    def make(seed):
        return band_limited_noise(1.0, 10.0, 5.0, 1 / 256, rms=1.0, seed=seed)

    assert make(1) == make(1)
    correlation = np.corrcoef(make(1).acceleration, make(2).acceleration)[0, 1]
    assert abs(correlation) < 0.3


def test_values_are_gaussian_over_seeds():
    values = np.concatenate(
        [band_limited_series(0, 20, 60, 0.02, rms=1, seed=s, taper=0) for s in range(20)]
    )
    assert np.mean(values**4) == pytest.approx(3.0, abs=0.1)
    assert np.mean(values**3) == pytest.approx(0.0, abs=0.1)
    assert np.mean(values) == pytest.approx(0.0, abs=1e-12)


def test_the_taper_brings_both_ends_to_zero_and_leaves_the_middle():
    plain = band_limited_series(1, 10, 10, 0.01, rms=1, seed=3, taper=0.0)
    tapered = band_limited_series(1, 10, 10, 0.01, rms=1, seed=3, taper=0.1)
    assert tapered[0] == tapered[-1] == 0.0
    ratio = (tapered / plain)[150:-150]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)
    assert abs(tapered[50] / plain[50]) == pytest.approx(ratio[0] / 2, rel=1e-9)


def test_the_record_says_how_it_was_made():
    record = band_limited_noise(0.0, 20.0, 60.0, rms=1.0, seed=7)
    assert record.source == (
        "band_limited_noise(low_hz=0.0, high_hz=20.0, duration=60.0, dt=0.01, rms=1.0, seed=7, "
        "taper=0.05)"
    )
    assert eval(record.source, {"band_limited_noise": band_limited_noise}) == record
    assert record.duration == 60.0


@pytest.mark.parametrize(
    ("changed", "parts"),
    [
        ({"low_hz": -1.0}, ("low_hz (Hz)", "-1.0", "0 or above")),
        ({"low_hz": 12.0}, ("low_hz and high_hz (Hz)", "12 and 10", "low_hz < high_hz")),
        ({"low_hz": 10.0}, ("low_hz and high_hz (Hz)", "10 and 10", "low_hz < high_hz")),
        ({"high_hz": 50.1}, ("high_hz (Hz)", "50.1", "Nyquist frequency, 50 Hz")),
        ({"low_hz": 1.01, "high_hz": 1.02}, ("over 5.01 s", "a multiple of 0.199601 Hz")),
        ({"duration": -5.0}, ("duration (s)", "-5.0", "above 0")),
        ({"duration": 0.001}, ("duration (s)", "0.001", "one step or more (dt 0.01 s)")),
        ({"dt": 0.0}, ("dt (s)", "0.0", "above 0")),
        ({"rms": None}, ("rms and pga", "neither", "exactly one")),
        ({"pga": 1.0}, ("rms and pga", "given rms and pga", "exactly one")),
        ({"rms": -1.0}, ("rms", "-1.0", "above 0")),
        ({"taper": 0.6}, ("taper (share)", "0.6", "from 0 to 0.5")),
        ({"seed": -1}, ("seed", "-1", "whole number")),
        ({"seed": "a"}, ("seed", "'a'", "whole number")),
    ],
)
def test_bad_arguments_are_refused(refused, changed, parts):
    arguments = {"low_hz": 1.0, "high_hz": 10.0, "duration": 5.0, "dt": 0.01, "rms": 1.0, "seed": 0}
    with refused(*parts):
        band_limited_noise(**(arguments | changed))


@given(st.integers(5, 3000), st.sampled_from([0.1, 0.01, 0.02, 0.005, 1 / 256, 1 / 30]))
@settings(deadline=None)
def test_whole_steps_stay_whole_whatever_the_rounding(steps, dt):
    duration = sum([dt] * steps) if steps < 50 else steps * dt
    assert len(band_limited_noise(0.0, 0.5 / dt, duration, dt, rms=1.0, seed=0)) == steps + 1
    padded = band_limited_noise(0.0, 0.5 / dt, 10 * dt, dt, rms=1.0, seed=0).padded(duration)
    assert len(padded) == 11 + steps
