"""003: the regression as a device in time, against its own closed form."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from isolation_sim.errors import InputError
from isolation_sim.identification.sinusoidal import sinusoidal
from isolation_sim.laws import law
from studies.papers.paper_003 import PRINTED


def steady_moduli(device, amplitude, frequency, current):
    """Storage and loss stiffness of the first harmonic after 12 averaging times (SciPy)."""
    omega = 2 * np.pi * frequency
    tau = device.parameters_at(0.0)[-1]
    start = np.ceil(12 * tau * frequency) / frequency

    def rates(t, states):
        x, v = amplitude * np.sin(omega * t), amplitude * omega * np.cos(omega * t)
        return device.rates(x, v, tuple(states), current)

    t = start + np.arange(256) / 256 / frequency
    result = solve_ivp(rates, (0, t[-1]), (0.0, 0.0), "DOP853", t, rtol=1e-8, atol=1e-14)
    x, v = amplitude * np.sin(omega * t), amplitude * omega * np.cos(omega * t)
    forces = device.force(x, v, tuple(result.y), current)
    return 2 * np.mean(forces * x) / amplitude**2, 2 * np.mean(forces * v) / amplitude**2 / omega


def equation(part, amplitude_mm, field_T, frequency_hz):
    """The second Eqs 10 and 11 in N/m, by hand."""
    a, b, f, c = (float(PRINTED[part][name]) for name in ("A", "B", "f", "constant"))
    return 1e3 * (a * amplitude_mm + b * field_T + f * frequency_hz + c)


@pytest.mark.parametrize(
    ("amplitude", "field", "frequency"), [(0.1, 0.0, 20), (0.2, 0.4, 6), (0.15, 0.3, 12)]
)
def test_a_sinusoid_has_the_printed_stiffness(amplitude, field, frequency):
    device = law("dynamic_stiffness", "regression_printed")
    storage, loss = steady_moduli(device, 1e-3 * amplitude, frequency, field / 0.588)
    assert storage == pytest.approx(equation("storage", amplitude, field, frequency), rel=2e-3)
    assert loss == pytest.approx(equation("loss", amplitude, field, frequency), rel=2e-3)


def test_beyond_the_tests_the_ends_are_held():
    device = law("dynamic_stiffness", "regression_printed")
    storage, loss = steady_moduli(device, 0.5e-3, 2.0, 0.0)
    assert storage == pytest.approx(equation("storage", 0.2, 0, 6), rel=5e-3)
    assert loss == pytest.approx(equation("loss", 0.2, 0, 6), rel=5e-3)


def test_one_corrupt_column_turns_the_trend_with_amplitude():
    def growth(chosen):
        device = law("dynamic_stiffness", chosen)
        small, large = (steady_moduli(device, a, 10.0, 0.3)[0] for a in (0.1e-3, 0.2e-3))
        return (large - small) / 0.1e-3 / 1e6

    assert growth("regression_printed") == pytest.approx(1.4147, rel=0.02)
    assert growth("regression_sound") == pytest.approx(-2.39, rel=0.02)
    assert law("dynamic_stiffness") == law("dynamic_stiffness", "regression_sound")


def test_the_link_from_current_to_field_is_a_parameter():
    device = law("dynamic_stiffness")
    assert device.current_range == (0.0, pytest.approx(0.4 / 0.588))
    mine = law("dynamic_stiffness", {"B": [0.0, 0.3]})
    at = dict(zip(mine.law.parameter_names, mine.parameters_at(0.5), strict=True))
    assert at["B"] == pytest.approx(0.15)
    # the same field by another magnet is the same force
    states = (3e-5, 2e-5)
    assert mine.force(1e-4, 0.01, states, 0.5) == pytest.approx(
        device.force(1e-4, 0.01, states, 0.15 / 0.588), rel=1e-12
    )
    with pytest.raises(InputError, match="'B'"):
        law("dynamic_stiffness", {"B": [0.0, -0.3]})


def test_at_rest_it_thinks_of_the_reference_frequency():
    device = law("dynamic_stiffness")
    p = dict(zip(device.law.parameter_names, device.parameters_at(0.0), strict=True))
    damping = device.force(0.0, 1e-3, (0.0, 0.0), 0.0) / 1e-3
    assert damping == pytest.approx(
        (p["l_0"] + p["l_A"] * 1e-4 + p["l_f"] * 10) / (2 * np.pi * 10), rel=1e-3
    )


def test_a_sinusoidal_test_measures_it():
    device = law("dynamic_stiffness")
    measured = sinusoidal(device, 1.5e-4, 0.2, 8.0, cycles=100).measured(skip=96)
    storage, loss = steady_moduli(device, 1.5e-4, 8.0, 0.2)
    assert measured.storage_stiffness.value == pytest.approx(storage, rel=1e-3)
    assert measured.loss_stiffness.value == pytest.approx(loss, rel=1e-3)
