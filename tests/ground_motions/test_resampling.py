import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground_motions import Record, el_centro_1940


@given(st.integers(2, 12))
@settings(deadline=None)
def test_refining_by_a_whole_ratio_is_the_same_motion(ratio):
    record = el_centro_1940()
    fine = record.resampled(record.dt / ratio)
    assert len(fine) == (len(record) - 1) * ratio + 1
    np.testing.assert_allclose(fine.acceleration[::ratio], record.acceleration, rtol=0, atol=1e-12)
    np.testing.assert_allclose(fine.velocity[::ratio], record.velocity, rtol=0, atol=1e-12)
    np.testing.assert_allclose(fine.displacement[::ratio], record.displacement, rtol=0, atol=1e-11)
    assert fine.arias_intensity() == pytest.approx(record.arias_intensity(), rel=1e-12)
    assert fine.pgv == pytest.approx(record.pgv, rel=1e-12)


@given(st.floats(0.05, 0.999))
@settings(deadline=None)
def test_refining_by_any_ratio_stays_on_the_motion(ratio):
    record = Record([0.0, 3.0, -1.0, 2.0, 5.0], 0.2)
    fine = record.resampled(0.2 * ratio)
    k, s = np.divmod(fine.time, 0.2)
    k = np.minimum(k.astype(int), 3)
    s = fine.time / 0.2 - k
    a = record.acceleration
    np.testing.assert_allclose(fine.acceleration, a[k] * (1 - s) + a[k + 1] * s, atol=1e-12)
    assert record.duration - fine.dt < fine.duration <= record.duration * (1 + 1e-12)


def test_coarsening_keeps_what_is_below_and_removes_what_is_above_nyquist():
    time = np.arange(4001) * 0.005
    low, high = np.sin(2 * np.pi * 1.5 * time), np.sin(2 * np.pi * 38.0 * time)
    coarse = Record(low + high, 0.005).resampled(0.02)  # Nyquist 25 Hz; 38 Hz would appear at 12
    inner = slice(100, -100)
    expected = np.sin(2 * np.pi * 1.5 * coarse.time)
    np.testing.assert_allclose(coarse.acceleration[inner], expected[inner], rtol=0, atol=5e-3)
    naive = (low + high)[::4]
    assert np.max(np.abs(naive[inner] - expected[inner])) > 0.9


@pytest.mark.parametrize(("dt", "new_dt"), [(0.005, 0.0078125), (0.01, 1 / 30), (0.02, 0.025)])
def test_coarsening_by_a_fraction_keeps_the_time_axis(dt, new_dt):
    time = np.arange(3001) * dt
    record = Record(np.sin(2 * np.pi * 1.0 * time), dt).resampled(new_dt)
    assert record.dt == new_dt
    assert record.duration <= time[-1] * (1 + 1e-12) < record.duration + new_dt
    inner = slice(200, -200)
    expected = np.sin(2 * np.pi * record.time)
    np.testing.assert_allclose(record.acceleration[inner], expected[inner], rtol=0, atol=5e-3)


@given(count=st.integers(60, 200), ratio=st.sampled_from([1.5625, 1.25, 2.0, 10 / 3, 7.0]))
@settings(deadline=None)
def test_a_coarser_record_ends_within_the_old_one_and_keeps_its_level(count, ratio):
    record = Record(np.full(count, 3.0), 0.01).resampled(0.01 * ratio)
    assert record.duration <= (count - 1) * 0.01 * (1 + 1e-12) < record.duration + record.dt
    np.testing.assert_allclose(record.acceleration, 3.0, rtol=2e-3)


def test_the_present_step_changes_nothing():
    record = el_centro_1940()
    assert record.resampled(0.02) is record


@pytest.mark.parametrize(
    ("dt", "parts"),
    [
        (0.0, ("dt (s)", "0.0", "above 0")),
        (-1.0, ("dt (s)", "-1.0", "above 0")),
        (20.0, ("dt (s)", "20", "half the duration (31.18 s)")),
        (0.02 * math.pi, ("dt (s)", "3.14159 times", "whole numbers up to 1000")),
    ],
)
def test_bad_steps_are_refused(refused, dt, parts):
    with refused(*parts):
        el_centro_1940().resampled(dt)
