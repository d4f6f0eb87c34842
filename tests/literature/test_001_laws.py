"""001, Tao et al.: Table 4's model against Table 3 and the text, and Table 3 against itself."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from isolation_sim.laws import law
from studies.papers.conditions_001 import departures
from studies.papers.tables import TAO_COMPLEX_MODULUS

# Tables 4 and 3 as printed: I; alpha, beta, gamma, theta, k, c, d, W (mm), O
TABLE_4 = """
0 6301 9254 56694 309 3.24e6 1.05e5 .098 .890 8116
0.5 727 447 66829 8881 3.75e6 3.10e5 .074 .694 8952
1 2408 4634 11571 3484 3.96e6 3.96e5 .120 .643 9567
1.5 943 1928 28303 8827 4.14e6 4.26e5 .158 .608 11822
2 2025 23390 15213 5872 4.51e6 4.83e5 .134 .625 6473
2.5 1520 2187 41086 6554 4.73e6 5.86e5 .139 .601 8461
"""
# Variation of stiffness and of damping from 0 A to 2 A, %, by scheme
TABLE_3_STIFFNESS = (
    "75.6 -3.3 68.2 71.8 68.5 15.9 -16.9 16.0 6.9 -16.7 8.3 65.9 .9 52.1 58.8 56.5 14.9 -19.5 14.4"
)
TABLE_3_DAMPING = (
    "676.0 1472.9 525.9 435.4 417.8 510.0 1434.6 409.7 407.8 1545.1 362.0 424.4 1100.3 315.5 290.1 "
    "296.3 346.1 1308.7 288.2"
)


@pytest.mark.parametrize("row", TABLE_4.strip().splitlines())
def test_parameters_are_those_of_table_4(row):
    current, *printed = map(float, row.split())
    printed[7] *= 1e-3
    assert law("improved_bouc_wen").parameters_at(current) == pytest.approx(printed, rel=1e-12)


@pytest.mark.parametrize(
    ("first", "digits", "printed"), [(3, 3, TABLE_3_STIFFNESS), (5, 2, TABLE_3_DAMPING)]
)
def test_columns_of_table_3_have_their_variations(first, digits, printed):
    columns = np.array([row[first : first + 2] for row in TAO_COMPLEX_MODULUS.values()])
    last_digit = 10.0 ** (np.floor(np.log10(columns)) - digits)
    ratio = columns[:, 1] / columns[:, 0]
    rounding = 100 * ratio * np.sum(0.5 * last_digit / columns, axis=1) + 0.05
    departure = 100 * (ratio - 1) - np.array(printed.split(), float)
    assert np.all(np.abs(departure) <= 1.01 * rounding)


@pytest.fixture(scope="module")
def loops(steady_loop):
    device = law("improved_bouc_wen")
    return {current: steady_loop(device, 1e-3, current, 0.5, cycles=3, points=2000)
            for current in (0.0, 2.0)}  # fmt: skip


def test_tensile_peaks(loops):
    peaks = [np.max(loops[current][2]) for current in (0.0, 2.0)]
    np.testing.assert_allclose(peaks, [3.037e3, 5.535e3], rtol=5e-4)
    np.testing.assert_allclose(peaks, [3.115e3, 5.721e3], rtol=0.05)
    assert peaks[1] / peaks[0] - 1 == pytest.approx(0.823, abs=2e-3)


def test_table_4_is_for_its_own_frequency(steady_loop):
    # ERRATA: at 0.1 Hz it gives 3.336 and 5.865 kN of compression; printed: 3.083 and 6.331
    device = law("improved_bouc_wen")
    results = [-np.min(steady_loop(device, 1e-3, i, 0.1, cycles=3, points=2000)[2]) for i in (0, 2)]
    np.testing.assert_allclose(results, [3.336e3, 5.865e3], rtol=1e-3)


def test_complex_modulus_without_current(loops, complex_modulus):
    stiffness, damping = complex_modulus(*loops[0.0])
    assert (stiffness, damping) == (
        pytest.approx(3.165e6, rel=1e-3),
        pytest.approx(1.346e5, rel=1e-3),
    )
    printed = TAO_COMPLEX_MODULUS[2]
    assert stiffness == pytest.approx(printed[3], rel=0.02)
    assert damping == pytest.approx(printed[5], rel=0.07)


def test_metres_in_the_hysteresis_show_in_the_complex_modulus(loops, complex_modulus):
    stiffness, _ = complex_modulus(*loops[2.0])
    assert stiffness == pytest.approx(5.31e6, rel=2e-3)


@pytest.mark.parametrize("current", [0.0, 0.5, 1.0, 1.5, 2.0, 2.5])
def test_law_is_the_printed_one(steady_loop, current):
    """The normalised state and the one-line step against the equations as ERRATA prints them."""
    device = law("improved_bouc_wen")
    alpha, beta, gamma, theta, k, c, d, W, O = device.parameters_at(current)  # noqa: E741
    amplitude, frequency = 1e-3, 0.5
    x, v, force = steady_loop(device, amplitude, current, frequency, cycles=2, points=400)

    def rate(t, z):
        w = 2 * np.pi * frequency
        v = amplitude * w * np.cos(w * t)
        return alpha * v - beta * abs(v) * abs(z) * z - gamma * v * abs(z) ** 2

    t = 2.0 + np.arange(400) / 200
    z = solve_ivp(rate, (0, 4), [0.0], t_eval=t, rtol=1e-8, atol=1e-12, max_step=0.01).y[0]

    def step(x, v):
        W2 = (1 - d) * W
        if (x >= W and v < 0) or (x < -W2 and v >= 0):
            return 0.0
        if W - 1 / O <= x < W and v < 0:
            return O * (W - x)
        if -W2 <= x < -W2 + 1 / O and v >= 0:
            return O * (W2 + x)
        return 1.0

    f = np.array([step(*pair) for pair in zip(x, v, strict=True)])
    printed = (1 - d * (x >= 0)) * k * x + f * c * v + theta * z
    np.testing.assert_allclose(force, printed, atol=1e-4 * np.max(np.abs(printed)))


def test_phase_detects_the_corrupt_rows():
    sound, corrupt = departures(0), departures(2)
    assert set(corrupt) == {2, 7, 10, 13, 18}
    assert max(map(abs, sound.values())) < 3
    assert min(corrupt.values()) > 20
    # one common error
    assert np.ptp(list(corrupt.values())) < 0.25 * np.mean(list(corrupt.values()))


def test_printed_extremes():
    rows = np.array([row[3:] for row in TAO_COMPLEX_MODULUS.values()])
    gain = rows[:, 3] / rows[:, 2] - 1
    assert np.max(gain) == pytest.approx(15.451, rel=0.01)  # the artefact
    sound = [k for k, row in enumerate(TAO_COMPLEX_MODULUS.values()) if row[1] != 0.5]
    assert np.max(gain[sound]) == pytest.approx(6.76, rel=0.01)
    assert np.max(rows[:, 1] / rows[:, 0] - 1) == pytest.approx(0.756, rel=0.01)
