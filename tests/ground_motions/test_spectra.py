import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.signal import StateSpace, lsim

from ground_motions import Record, el_centro_1940, oscillator_response, response_spectrum

G_INCH = 0.0254


def lsim_response(record, period, damping):
    """Relative displacement, relative velocity and absolute acceleration by SciPy's lsim."""
    w = 2 * math.pi / period
    system = StateSpace(
        [[0, 1], [-(w**2), -2 * damping * w]],
        [[0], [-1]],
        [[1, 0], [0, 1], [-(w**2), -2 * damping * w]],
        np.zeros((3, 1)),
    )
    return lsim(system, record.acceleration, record.time, interp=True)[1].T


@pytest.mark.parametrize("period", [0.003, 0.05, 0.5, 2.0, 30.0])
@pytest.mark.parametrize("damping", [0.0, 0.05, 0.9])
def test_history_agrees_with_lsim(period, damping):
    record = el_centro_1940()
    response = oscillator_response(record, period, damping)
    expected = lsim_response(record, period, damping)
    for ours, theirs in zip(
        (response.displacement, response.velocity, response.absolute_acceleration),
        expected,
        strict=True,
    ):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9 * np.max(np.abs(theirs)))


def test_history_agrees_with_an_adaptive_integrator():
    record = el_centro_1940().cut(0.0, 4.0)
    w, z = 2 * math.pi / 0.7, 0.05
    state, states = np.zeros(2), [np.zeros(2)]
    for i in range(len(record) - 1):  # a segment a sample: the corners would limit the accuracy
        a, b = record.acceleration[i : i + 2]

        def rate(t, y, a=a, b=b):
            return [y[1], -(w**2) * y[0] - 2 * z * w * y[1] - a - (b - a) * t / record.dt]

        run = solve_ivp(rate, (0, record.dt), state, method="DOP853", rtol=1e-12, atol=1e-14)
        state = run.y[:, -1]
        states.append(state)
    expected = np.array(states)
    response = oscillator_response(record, 0.7, z)
    np.testing.assert_allclose(response.displacement, expected[:, 0], rtol=0, atol=1e-10)
    np.testing.assert_allclose(response.velocity, expected[:, 1], rtol=0, atol=1e-9)


@pytest.mark.parametrize("period", [0.013, 0.1, 0.37, 1.0, 4.0])
@pytest.mark.parametrize("damping", [0.0, 0.05, 0.5])
def test_peaks_are_those_of_a_very_fine_history(period, damping):
    record = el_centro_1940().cut(1.0, 2.5)
    spectrum = response_spectrum(record, [period], damping, free_vibration=False)
    fine = record.resampled(min(record.dt, period) / 400)
    expected = np.max(np.abs(lsim_response(fine, period, damping)), axis=1)
    ours = np.array([spectrum.sd[0], spectrum.sv[0], spectrum.sa[0]])
    # Samples at 400 a period miss a peak by at most (pi / 400)^2 / 2 of it, never exceed it.
    assert np.all(ours >= expected * (1 - 1e-9))
    np.testing.assert_allclose(ours, expected, rtol=4e-5)


def test_undamped_step():
    # u = a / w^2 (cos wt - 1): twice the static displacement, and velocity a / w.
    a, period = 2.0, 0.73
    w = 2 * math.pi / period
    record = Record(np.full(2001, a), 0.01)
    spectrum = response_spectrum(record, [period], 0.0, free_vibration=False)
    assert spectrum.sd[0] == pytest.approx(2 * a / w**2, rel=1e-11)
    assert spectrum.sv[0] == pytest.approx(a / w, rel=1e-11)
    assert spectrum.sa[0] == pytest.approx(2 * a, rel=1e-11)


@pytest.mark.parametrize("damping", [0.01, 0.2, 0.7])
def test_damped_step(damping):
    a, period = 2.0, 0.73
    w = 2 * math.pi / period
    overshoot = math.exp(-math.pi * damping / math.sqrt(1 - damping**2))
    record = Record(np.full(2001, a), 0.01)
    spectrum = response_spectrum(record, [period], damping, free_vibration=False)
    assert spectrum.sd[0] == pytest.approx(a / w**2 * (1 + overshoot), rel=1e-11)


@pytest.mark.parametrize("share", [0.1, 0.35, 0.5])
def test_free_vibration_after_a_rectangular_pulse(share):
    # Amplitude 2 a / w^2 sin(w t / 2) after a pulse shorter than half a period, reached only later.
    a, period = 1.5, 2.0
    w = 2 * math.pi / period
    record = Record(np.full(round(share * period / 0.01) + 1, a), 0.01)
    spectrum = response_spectrum(record, [period], 0.0)
    expected = 2 * a / w**2 * math.sin(w * share * period / 2)
    assert spectrum.sd[0] == pytest.approx(expected, rel=1e-11)
    if share < 0.5:
        stopped = response_spectrum(record, [period], 0.0, free_vibration=False)
        assert stopped.sd[0] < 0.9 * expected


def test_free_vibration_decays_by_the_logarithmic_decrement():
    record = Record([1.0, 1.0, *np.zeros(4000)], 0.005)
    u = oscillator_response(record, 1.0, 0.03).displacement
    damped_period = 1.0 / math.sqrt(1 - 0.03**2)
    start = 2.0
    ratio = np.interp(start + damped_period, record.time, u) / np.interp(start, record.time, u)
    decrement = 2 * math.pi * 0.03 / math.sqrt(1 - 0.03**2)
    assert math.log(1 / ratio) == pytest.approx(decrement, rel=1e-3)


def test_harmonic_steady_state():
    # Resonance of a damped oscillator: amplitude a / (2 z w^2).
    z, period, a = 0.1, 0.5, 1.0
    w = 2 * math.pi / period
    record = Record(a * np.sin(w * np.arange(0, 40, 0.001)), 0.001)
    spectrum = response_spectrum(record, [period], z, free_vibration=False)
    assert spectrum.sd[0] == pytest.approx(a / (2 * z * w**2), rel=2e-5)


def test_rigid_and_nearly_rigid_oscillators_follow_the_ground():
    record = el_centro_1940()
    spectrum = response_spectrum(record, [0.0, 1e-4, 0.002], 0.05)
    assert spectrum.psa[0] == spectrum.sa[0] == record.pga
    assert (spectrum.sd[0], spectrum.sv[0], spectrum.psv[0]) == (0.0, 0.0, 0.0)
    np.testing.assert_allclose(spectrum.psa / record.pga, 1.0, rtol=3e-3)


def test_very_soft_oscillators_stand_still_while_the_ground_moves():
    record = el_centro_1940().baseline_corrected(2, highpass_hz=0.2).padded(after=5.0)
    spectrum = response_spectrum(record, [300.0], 0.0, free_vibration=False)
    assert spectrum.sd[0] == pytest.approx(record.pgd, rel=0.02)
    assert spectrum.sv[0] == pytest.approx(record.pgv, rel=0.02)


def test_pseudo_values_belong_together():
    periods = np.array([0.1, 0.5, 2.0])
    spectrum = el_centro_1940().spectrum(periods, 0.02)
    w = 2 * np.pi / periods
    np.testing.assert_allclose(spectrum.psv, w * spectrum.sd, rtol=1e-14)
    np.testing.assert_allclose(spectrum.psa, w**2 * spectrum.sd, rtol=1e-14)
    undamped = el_centro_1940().spectrum(periods, 0.0)
    np.testing.assert_allclose(undamped.psa, undamped.sa, rtol=1e-14)


@pytest.mark.parametrize(
    ("period", "damping", "inches"),
    [(0.5, 0.02, 2.67), (1.0, 0.02, 5.97), (2.0, 0.02, 7.47), (2.0, 0.0, 9.91), (2.0, 0.05, 5.37)],
)
def test_chopra_figure_6_4_1(period, damping, inches):
    """Peak deformations printed in A. K. Chopra, Dynamics of Structures, figure 6.4.1."""
    sd = el_centro_1940().spectrum([period], damping).sd[0] / G_INCH
    assert sd == pytest.approx(inches, rel=0.008)


@given(st.floats(-3, 3).filter(lambda x: abs(x) > 1e-3), st.floats(0.02, 5.0))
@settings(max_examples=25, deadline=None)
def test_spectra_scale_with_the_motion(factor, period):
    record = el_centro_1940()
    scaled = record.scaled(factor).spectrum([period])
    np.testing.assert_allclose(scaled.sd, abs(factor) * record.spectrum([period]).sd, rtol=1e-11)


def test_refining_the_record_changes_no_peak():
    record = el_centro_1940()
    periods = [0.005, 0.03, 0.4, 3.0]
    coarse, fine = record.spectrum(periods), record.resampled(0.004).spectrum(periods)
    for name in ("sd", "sv", "sa"):
        np.testing.assert_allclose(getattr(coarse, name), getattr(fine, name), rtol=1e-9)


@pytest.mark.parametrize(
    ("periods", "damping", "parts"),
    [
        ([1.0, -0.5], 0.05, ("periods (s)", "-0.5", "0, or finite and 2e-05 s or longer")),
        ([math.nan], 0.05, ("periods (s)", "nan", "finite")),
        ([1e-6], 0.05, ("periods (s)", "1e-06", "2e-05 s or longer")),
        ([[1.0]], 0.05, ("periods (s)", "shape (1, 1)", "one row")),
        (["long"], 0.05, ("periods: given ['long']", "an array of numbers")),
        ([1.0], 1.0, ("damping (ratio)", "1.0", "from 0 to below 1")),
        ([1.0], -0.1, ("damping (ratio)", "-0.1", "from 0 to below 1")),
        ([1.0], math.nan, ("damping (ratio)", "nan", "from 0 to below 1")),
    ],
)
def test_bad_arguments_are_refused(refused, periods, damping, parts):
    with refused(*parts):
        el_centro_1940().spectrum(periods, damping)


def test_a_history_needs_a_period(refused):
    with refused("period (s)", "0.0", "above 0"):
        oscillator_response(el_centro_1940(), 0.0)
