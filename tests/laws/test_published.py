"""The papers' numbers, at the tolerance that the papers support (ERRATA)."""

from math import erf

import numpy as np
import pytest
from scipy.integrate import trapezoid

from isolation_sim.errors import InputError
from isolation_sim.laws import available_conditions, law, published
from isolation_sim.laws.hybrid import condition
from studies.papers.tables import LI_LI_STIFFNESS_N_PER_MM


def loop(device, amplitudes, currents, frequency=1.0, cycles=20, points=512):
    """Last cycle of a sinusoidal test by RK4: effective stiffness and damping ratio."""
    omega = 2 * np.pi * frequency
    dt = 1 / frequency / points
    states = np.zeros(
        (len(device.law.states), *np.broadcast_shapes(amplitudes.shape, currents.shape))
    )

    def motion(t):
        return amplitudes * np.sin(omega * t), amplitudes * omega * np.cos(omega * t)

    def rate(t, s):
        return np.array(np.broadcast_arrays(*device.rates(*motion(t), tuple(s), currents)))

    positions, forces, velocities = [], [], []
    for i in range(cycles * points):
        t = i * dt
        if i >= (cycles - 1) * points:
            x, v = motion(t)
            forces.append(device.force(x, v, tuple(states), currents))
            positions.append(x)
            velocities.append(v)
        a = rate(t, states)
        b = rate(t + dt / 2, states + dt / 2 * a)
        c = rate(t + dt / 2, states + dt / 2 * b)
        d = rate(t + dt, states + dt * c)
        states = states + dt / 6 * (a + 2 * b + 2 * c + d)
    force, velocity = np.array(forces), np.array(velocities)
    top, bottom = points // 4, 3 * points // 4
    stiffness = (force[top] - force[bottom]) / (2 * amplitudes)
    lost = np.sum(force * velocity, axis=0) * dt
    return stiffness, lost / (2 * np.pi * stiffness * amplitudes**2)


def test_static_limits():
    device = law("strain_stiffening")
    limits = [device.linearised(float(i), 1e-6).real / 1e3 for i in range(4)]
    np.testing.assert_allclose(limits, [13.7, 36.5, 59.2, 82.0], atol=0.05)


def test_generalised_model_at_1_hz():
    amplitudes = np.array([[2.0], [4.0], [8.0]]) * 1e-3
    stiffness, ratio = loop(law("strain_stiffening"), amplitudes, np.arange(4.0)[np.newaxis])
    expected = [
        [30.05, 50.00, 67.74, 87.48],
        [31.41, 51.16, 68.67, 88.14],
        [32.94, 53.00, 70.68, 90.05],
    ]
    np.testing.assert_allclose(stiffness / 1e3, expected, atol=0.006)
    expected = [[0.168, 0.234, 0.188, 0.141], [0.165, 0.231, 0.187, 0.140]]
    np.testing.assert_allclose(ratio, [*expected, [0.184, 0.236, 0.189, 0.141]], atol=6e-4)


def test_base_model_at_1_hz():
    device = law("strain_stiffening", "base_model")
    stiffness, ratio = loop(device, np.array([2e-3, 4e-3, 8e-3]), np.zeros(1))
    np.testing.assert_allclose(stiffness / 1e3, [7.314, 13.09, 27.97], rtol=5e-4)
    np.testing.assert_allclose(ratio, [0.203, 0.132, 0.165], atol=6e-4)
    # without the stiffening branch: the standard solid at every amplitude
    solid = device.with_parameters(alpha=0.0).linearised(0.0, 1.0)
    assert solid.real / 1e3 == pytest.approx(5.318, abs=6e-4)
    assert solid.imag / (2 * solid.real) == pytest.approx(0.276, abs=6e-4)
    # and k1 rigid: Kelvin-Voigt
    kelvin = law("kelvin_voigt", {"k": 200.0, "c": 2000.0}).linearised(0.0, 1.0)
    assert kelvin.imag / (2 * kelvin.real) == pytest.approx(31.4, abs=0.05)


def test_alpha_reaches_zero_where_the_range_ends():
    device = law("strain_stiffening")
    low, high = device.current_range
    assert (low, high) == (0.0, pytest.approx(5.203125, rel=1e-15))
    assert device.parameters_at(high)[4] == pytest.approx(0.0, abs=1e-6)
    assert device.parameters_at(high + 0.01)[4] < 0


def means(table):
    return np.array(list(table.values())).mean(axis=0)


def test_refit_of_the_hybrid_tables_is_the_default():
    device = law("hybrid")
    assert device.source == law("hybrid", "generalised_refitted").source
    per_mm = {"alpha": 1.0, "beta": 1e-3, "gamma": 1.0, "sigma_squared": 1e6}
    expected = {  # ERRATA, 002; the paper prints .0034 for the slope of beta
        "alpha": (35.78, 8.883),
        "beta": (0.4299, 0.03156),
        "gamma": (5.248, 26.557, -4.803),
        "sigma_squared": (12.8058,),
    }
    coefficients = dict(zip(device.current.names, device.current.coefficients[0], strict=True))
    for name, row in expected.items():
        computed = per_mm[name] * coefficients[name][: len(row)]
        np.testing.assert_allclose(computed, row, rtol=2e-4)
    slope = law("hybrid", "generalised_printed").current.coefficients[0][1][1]
    assert slope == pytest.approx(3.4)  # 1/(m A)


def test_means_of_the_hybrid_tables():
    for table, expected, digit in (
        (published.YU_ALPHA_N, [35.94, 44.39, 53.62, 62.47], 0.006),
        (published.YU_BETA_PER_MM, [0.4378, 0.4456, 0.5011, 0.5244], 6e-5),
        (published.YU_GAMMA_N, [5.384, 26.59, 39.56, 41.56], 0.006),
    ):
        np.testing.assert_allclose(means(table), expected, atol=digit)


def test_hybrid_tables_add_up_to_the_printed_numbers():
    """Sums over currents and over conditions, added up from the paper's text."""
    for table, currents, conditions in (
        (published.YU_ALPHA_N, "323.45 399.52 482.58 562.24",
         "174.41 203.40 171.46 182.52 208.91 242.08 187.86 193.18 203.97"),
        (published.YU_BETA_PER_MM, "3.94 4.01 4.51 4.72",
         "3.10 2.58 3.00 1.84 1.61 1.62 1.14 1.19 1.10"),
        (published.YU_GAMMA_N, "48.46 239.35 356.03 374.01",
         "66.24 75.89 85.82 93.28 104.46 121.91 130.54 153.92 185.79"),
        (published.YU_SIGMA_SQUARED_MM2, "114.59 118.52 115.19 112.71",
         "8.06 8.93 10.85 28.02 32.05 38.40 97.76 107.07 129.87"),
    ):  # fmt: skip
        rows = np.array(list(table.values()))
        for axis, sums in enumerate((currents, conditions)):
            printed = np.array(sums.split(), float)
            np.testing.assert_allclose(np.sum(rows, axis=axis), printed, rtol=0, atol=1e-6)


@pytest.mark.parametrize("chosen", ["generalised_printed", "generalised_refitted"])
def test_gamma_peaks_below_the_end_of_the_range(chosen):
    device = law("hybrid", chosen)
    currents = np.linspace(0, 3, 301)
    peak = currents[np.argmax(device.parameters_at(currents)[2])]
    assert 2.7 < peak < 2.8 and device.current_range == (0.0, 3.0)


@pytest.mark.parametrize("current", [0.0, 1.0, 2.0, 3.0])
def test_hybrid_loop_in_closed_form(current):
    # ERRATA, 002: K_eff = alpha sinh(beta X) / X, EDC = 2 gamma sigma sqrt(2 pi) erf(X / sigma r2)
    amplitude = 8e-3
    device = condition(8, 1, current).with_parameters(v_s=1e-6)
    alpha, beta, gamma, sigma_squared, _, _ = device.parameters_at(current)
    at_reversal = device.force(amplitude, 0.0, (), current)
    assert at_reversal == pytest.approx(alpha * np.sinh(beta * amplitude), rel=1e-14)
    x = np.linspace(-amplitude, amplitude, 4001)
    up, down = (device.force(x, v, (), current) for v in (1.0, -1.0))
    sigma = np.sqrt(sigma_squared)
    edc = 2 * gamma * sigma * np.sqrt(2 * np.pi) * erf(amplitude / (sigma * np.sqrt(2)))
    assert trapezoid(up - down, x) == pytest.approx(edc, rel=1e-6)


def test_conditions_hold_the_printed_rows():
    for (amplitude, frequency), row in published.YU_ALPHA_N.items():
        every = condition(amplitude, frequency)
        for k, current in enumerate(published.CURRENTS_A):
            one = condition(amplitude, frequency, current)
            assert one.parameters_at(0.0)[0] == row[k]
            np.testing.assert_allclose(every.parameters_at(current), one.parameters_at(current))
            beta = 1e3 * published.YU_BETA_PER_MM[amplitude, frequency][k]
            width = 1e-6 * published.YU_SIGMA_SQUARED_MM2[amplitude, frequency][k]
            assert one.parameters_at(9.0)[1:4:2] == pytest.approx((beta, width))
        assert every.tested_deformation == pytest.approx(1e-3 * amplitude)


@pytest.mark.parametrize("value", [(3, 1), (2, 3), (2, 1, 1.5)])
def test_conditions_that_were_not_tested(value):
    with pytest.raises(InputError, match="no test at"):
        condition(*value)


def test_every_column_of_the_tables_is_a_set():
    names = available_conditions("hybrid")
    single = [name for name in names if name.endswith("A")]
    assert (len(single), len(names) - len(single)) == (36, 9)
    for (amplitude, frequency), alpha in published.YU_ALPHA_N.items():
        widths = published.YU_SIGMA_SQUARED_MM2[amplitude, frequency]
        every = law("hybrid", f"{amplitude:g}mm_{frequency:g}Hz")
        assert every.current_range == (0.0, 3.0)
        for current, force, width in zip(range(4), alpha, widths, strict=True):
            one = law("hybrid", f"{amplitude:g}mm_{frequency:g}Hz_{current}A")
            assert one == condition(amplitude, frequency, current)
            assert one.parameters_at(0.0)[0] == force
            assert one.parameters_at(0.0)[3] == pytest.approx(1e-6 * width)
            assert every.parameters_at(current) == pytest.approx(one.parameters_at(0.0))
    names = available_conditions("linearised_bouc_wen")
    assert len(names) == 48
    # row by row of the printed page: 0.4 T, 0.15 mm
    printed = published.LINEARISED_PARAMETERS["k1"][3][1]
    assert printed == (6.803768, 6.991248, 7.540305, 7.751187)
    for frequency, k1 in zip((6, 10, 14, 20), printed, strict=True):
        one = law("linearised_bouc_wen", f"0.4T_0.15mm_{frequency}Hz")
        assert one.parameters_at(0.0)[1] == pytest.approx(1e3 * k1)
    assert available_conditions("linear") == ()


def test_corrupt_columns_say_so():
    def flagged(name):
        return {each for each in available_conditions(name) if ";" in law(name, each).source}

    expected = {"0.2T_0.1mm_20Hz", "0.3T_0.1mm_14Hz", "0.4T_0.2mm_20Hz"}
    assert flagged("linearised_bouc_wen") == expected
    assert "corrupt" in law("linearised_bouc_wen", "0.2T_0.1mm_20Hz").source
    at_0 = {f"{A}mm_{f}Hz_0A" for A in (2, 4, 8) for f in (1, 2, 4)}
    every = {name.removesuffix("_0A") for name in at_0}
    assert flagged("hybrid") == at_0 | every | {"4mm_2Hz_1A", "4mm_4Hz_1A"}
    assert "outlier" in law("hybrid", "8mm_2Hz_0A").source
    # the same device by Li & Li, Table 1
    ratios = [
        stiffness[0] / (alpha[0] * np.sinh(amplitude * beta[0]) / amplitude)
        for amplitude, stiffness in LI_LI_STIFFNESS_N_PER_MM.items()
        for alpha, beta in [
            (table[amplitude, 1.0] for table in (published.YU_ALPHA_N, published.YU_BETA_PER_MM))
        ]
    ]
    text = f"{1 / max(ratios):.1f} to {1 / min(ratios):.1f} times too stiff at 1 Hz"
    assert text in law("hybrid", "4mm_1Hz_0A").source


def test_refuses_a_condition_that_was_not_tested():
    with pytest.raises(InputError, match="did you mean '2mm_1Hz_3A'"):
        law("hybrid", "2mm_1Hz_3.5A")
    with pytest.raises(InputError, match="unknown law"):
        available_conditions("hybryd")
