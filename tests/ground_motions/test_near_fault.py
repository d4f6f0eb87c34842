import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground_motions import (
    MAKRIS_KINDS,
    makris_pulse,
    mavroeidis_papageorgiou_pulse,
    ricker_pulse,
)


@given(
    period=st.floats(0.5, 6.0),
    cycles=st.floats(1.1, 5.0),
    phase=st.floats(-math.pi, math.pi),
    before=st.floats(0.02, 1.0),
)
@settings(deadline=None)
def test_mavroeidis_papageorgiou_final_state(period, cycles, phase, before):
    record = mavroeidis_papageorgiou_pulse(0.8, period, cycles, phase, 0.02, before=before)
    left = 0.8 * period * math.cos(phase) * math.sin(math.pi * cycles)
    left /= 2 * math.pi * (1 - cycles**2)
    assert record.velocity[-1] == pytest.approx(0.0, abs=1e-10)
    assert record.displacement[-1] == pytest.approx(left, abs=1e-10)


def test_mavroeidis_papageorgiou_velocity_is_the_formula():
    a, period, cycles, phase, dt = 0.9, 2.0, 2.3, 0.7, 0.005
    record = mavroeidis_papageorgiou_pulse(a, period, cycles, phase, dt, before=0.5)
    t = record.time - 0.5 - cycles * period / 2
    velocity = a / 2 * (1 + np.cos(2 * np.pi / (cycles * period) * t))
    velocity *= np.cos(2 * np.pi / period * t + phase)
    velocity[np.abs(t) > cycles * period / 2] = 0.0
    np.testing.assert_allclose(record.velocity, velocity, rtol=0, atol=2e-4)


def test_whole_cycles_return_to_the_start():
    record = mavroeidis_papageorgiou_pulse(1.0, 1.0, cycles=3.0, phase=0.0)
    assert record.displacement[-1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("kind", MAKRIS_KINDS)
@pytest.mark.parametrize("before", [0.5, 0.123])
def test_makris_final_state(kind, before):
    record = makris_pulse(kind, 0.7, 1.3, 0.01, before=before)
    assert record.velocity[-1] == pytest.approx(0.0, abs=1e-12)
    left = 0.5 * 0.7 * 1.3 if kind == "A" else 0.0
    assert record.displacement[-1] == pytest.approx(left, abs=1e-12)


def test_makris_velocities_are_the_formulas():
    v, period, dt = 0.7, 1.3, 0.001
    for kind, formula in (
        ("A", lambda x: 0.5 * (1 - np.cos(x))),
        ("B", np.sin),
        ("C1", lambda x: np.sin(x + 0.0697 * np.pi) - np.sin(0.0697 * np.pi)),
        ("C2", lambda x: np.sin(x + 0.0410 * np.pi) - np.sin(0.0410 * np.pi)),
    ):
        record = makris_pulse(kind, v, period, dt, before=0.5)
        inside = (record.time > 0.51) & (record.time < 0.5 + period - 0.01)
        x = 2 * np.pi * (record.time[inside] - 0.5) / period
        # The phases of kinds C as printed by Makris and Chang, to four digits.
        np.testing.assert_allclose(record.velocity[inside], v * formula(x), rtol=0, atol=3e-4)


def test_makris_accelerations_of_kinds_a_and_b():
    w = 2 * np.pi / 1.3
    assert makris_pulse("A", 0.7, 1.3, 0.001).pga == pytest.approx(0.7 * w / 2, rel=1e-4)
    assert makris_pulse("B", 0.7, 1.3, 0.001).pga == pytest.approx(0.7 * w, rel=1e-3)


def test_ricker_is_the_formula_and_ends_at_rest():
    period, dt = 1.2, 0.002
    record = ricker_pulse(0.5, period, dt, before=0.3)
    x = math.pi * (record.time - 0.3 - 2 * period) / period
    peak = 0.5 * math.sqrt(2 * math.e) * math.pi / period
    expected = peak * (1 - 2 * x**2) * np.exp(-(x**2))
    np.testing.assert_allclose(record.acceleration, expected, rtol=0, atol=2e-4 * peak)
    assert record.pgv == pytest.approx(0.5, rel=1e-4)
    assert record.velocity[-1] == pytest.approx(0.0, abs=1e-12)
    assert record.displacement[-1] == pytest.approx(0.0, abs=1e-12)


def test_the_ricker_spectrum_peaks_at_its_period():
    record = ricker_pulse(1.0, 0.8, 0.01, after=40.0)
    amplitude = np.abs(np.fft.rfft(record.acceleration))
    frequency = np.fft.rfftfreq(len(record), record.dt)
    assert frequency[np.argmax(amplitude)] == pytest.approx(1 / 0.8, abs=frequency[1])


@pytest.mark.parametrize(
    "make",
    [
        lambda dt: mavroeidis_papageorgiou_pulse(1.0, 1.0, 2.0, 0.0, dt),
        lambda dt: ricker_pulse(1.0, 1.0, dt),
        lambda dt: makris_pulse("B", 1.0, 1.0, dt),
    ],
)
def test_the_peak_velocity_falls_short_by_the_stated_share(make):
    for dt in (0.04, 0.02):
        assert 1.0 - make(dt).pgv == pytest.approx(2 / 3 * (math.pi * dt) ** 2, rel=0.35)


def test_the_source_makes_the_record_again():
    for record, function in (
        (mavroeidis_papageorgiou_pulse(1.0, 2.0, 2.5, 0.3), mavroeidis_papageorgiou_pulse),
        (makris_pulse("C1", 1.0, 2.0), makris_pulse),
        (ricker_pulse(1.0, 2.0), ricker_pulse),
    ):
        assert eval(record.source, {function.__name__: function}) == record


@pytest.mark.parametrize(
    ("call", "parts"),
    [
        (lambda: makris_pulse("D", 1.0, 1.0), ("kind", "'D'", "A, B, C1, C2")),
        (lambda: makris_pulse("a", 1.0, 1.0), ("kind", "'a'", "did you mean 'A'?")),
        (lambda: makris_pulse("A", -1.0, 1.0), ("peak_velocity (m/s)", "-1.0", "above 0")),
        (lambda: makris_pulse("A", 1.0, 0.0), ("pulse_period (s)", "0.0", "above 0")),
        (lambda: ricker_pulse(0.0, 1.0), ("peak_velocity (m/s)", "0.0", "above 0")),
        (lambda: ricker_pulse(1.0, 1.0, dt=-0.1), ("dt (s)", "-0.1", "above 0")),
        (lambda: ricker_pulse(1.0, 0.01, dt=0.02), ("dt (s)", "0.02", "at most 0.01")),
        (lambda: ricker_pulse(1.0, 1.0, before=0.0), ("before (s)", "0.0", "0.01 or above")),
        (lambda: ricker_pulse(1.0, 1.0, after=-1), ("after (s)", "-1", "0.01 or above")),
        (
            lambda: mavroeidis_papageorgiou_pulse(1.0, 1.0, cycles=1.0),
            ("cycles", "1.0", "above 1"),
        ),
        (
            lambda: mavroeidis_papageorgiou_pulse(1.0, 1.0, phase=math.inf),
            ("phase (rad)", "inf", "finite"),
        ),
    ],
)
def test_bad_arguments_are_refused(refused, call, parts):
    with refused(*parts):
        call()
