from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground_motions import Record, band_limited_noise, el_centro_1940


@given(
    order=st.integers(0, 10),
    offset=st.floats(-0.5, 0.5),
    slope=st.floats(-0.05, 0.05),
    highpass=st.sampled_from([None, 0.05, 0.2]),
)
@settings(max_examples=40, deadline=None)
def test_the_final_velocity_is_zero(order, offset, slope, highpass):
    clean = el_centro_1940()
    record = Record(clean.acceleration + offset + slope * clean.time, clean.dt)
    corrected = record.baseline_corrected(order, highpass)
    assert abs(corrected.velocity[-1]) < 1e-12
    assert len(corrected) == len(record)


def test_an_added_line_is_taken_away_again():
    clean = el_centro_1940().baseline_corrected(order=1)
    drifting = Record(clean.acceleration + 0.2 - 0.03 * clean.time, clean.dt)
    assert drifting.pgd > 10.0 * clean.pgd
    np.testing.assert_allclose(
        drifting.baseline_corrected(order=1).acceleration, clean.acceleration, rtol=0, atol=1e-12
    )


def test_a_higher_order_leaves_less_velocity():
    record = el_centro_1940()
    left = [np.mean(record.baseline_corrected(order).velocity ** 2) for order in range(6)]
    assert all(later <= earlier * (1 + 1e-12) for earlier, later in pairwise(left))
    assert left[5] < left[0]


def test_no_other_line_with_zero_final_velocity_leaves_less():
    record = el_centro_1940().baseline_corrected(order=1)
    t = record.time / record.duration - 0.5  # any multiple of t keeps the final velocity at zero
    least = np.mean(record.velocity**2)
    for weight in (-1e-2, -1e-4, 1e-4, 1e-2):
        other = Record(record.acceleration + weight * t, record.dt)
        assert abs(other.velocity[-1]) < 1e-12
        assert np.mean(other.velocity**2) > least


def test_the_high_pass_has_no_phase_and_halves_at_its_corner():
    dt, corner = 0.01, 0.5
    time = np.arange(8001) * dt
    inner = slice(3000, 5000)
    for frequency, gain in ((0.1, 0.0), (corner, 0.5), (2.0, 1.0)):
        wave = np.sin(2 * np.pi * frequency * time) * np.sin(np.pi * time / time[-1]) ** 2
        corrected = Record(wave, dt).baseline_corrected(0, highpass_hz=corner).acceleration
        np.testing.assert_allclose(corrected[inner], gain * wave[inner], rtol=0, atol=0.02)


def test_random_motion_stops_drifting():
    record = band_limited_noise(0.0, 20.0, 30.0, pga=3.0, seed=4)
    corrected = record.baseline_corrected(2, highpass_hz=0.1)
    assert corrected.pgd < 0.3 * record.pgd
    assert corrected.pga == pytest.approx(record.pga, rel=0.05)


def test_the_source_says_so():
    assert "baseline corrected (order 3, high-pass 0.1 Hz)" in (
        el_centro_1940().baseline_corrected(3, 0.1).source
    )


@pytest.mark.parametrize(
    ("order", "highpass", "parts"),
    [
        (-1, None, ("order", "-1", "0 to 10")),
        (11, None, ("order", "11", "0 to 10")),
        (1.5, None, ("order", "1.5", "whole number")),
        (1, 0.0, ("highpass_hz (Hz)", "0.0", "above 0")),
        (1, 25.0, ("highpass_hz (Hz)", "25", "Nyquist frequency, 25 Hz")),
    ],
)
def test_bad_arguments_are_refused(refused, order, highpass, parts):
    with refused(*parts):
        el_centro_1940().baseline_corrected(order, highpass)
