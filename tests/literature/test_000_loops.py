"""Li & Li: stiffness and damping ratio of the published models, integrated (ERRATA's tables)."""

from __future__ import annotations

import numpy as np
import pytest

from isolation_sim.identification.loop_measures import loop_measures
from isolation_sim.laws import law

POINTS, CYCLES = 512, 20

STIFFNESS = {  # N/mm at 0, 1, 2, 3 A
    2: (30.05, 50.00, 67.74, 87.48),
    4: (31.41, 51.16, 68.67, 88.14),
    8: (32.94, 53.00, 70.68, 90.05),
}
DAMPING_RATIO = {
    2: (0.168, 0.234, 0.188, 0.141),
    4: (0.165, 0.231, 0.187, 0.140),
    8: (0.184, 0.236, 0.189, 0.141),
}
# section 4.1, base set: K in N/mm, damping ratio
BASE_MODEL = {2: (7.314, 0.203), 4: (13.09, 0.132), 8: (27.97, 0.165)}


def integrated(device, amplitude, current, frequency=1.0):
    """RK4 of the law's states along a sinusoid, all amplitudes and currents at once."""
    omega, h = 2 * np.pi * frequency, 1 / (frequency * POINTS)
    parameters = device.parameters_at(current)
    size = np.broadcast(amplitude, current).shape

    def motion(t):
        return amplitude * np.sin(omega * t), amplitude * omega * np.cos(omega * t)

    def rates(t, states):
        return np.array(device.law.rates(*motion(t), tuple(states), parameters))

    states = np.zeros((len(device.law.states), *size))
    times, xs, fs = [], [], []
    for k in range(POINTS * CYCLES + 1):
        t = k * h
        x, v = motion(t)
        times.append(t)
        xs.append(np.broadcast_to(x, size))
        fs.append(device.law.force(x, v, tuple(states), parameters))
        a = rates(t, states)
        b = rates(t + h / 2, states + h / 2 * a)
        c = rates(t + h / 2, states + h / 2 * b)
        d = rates(t + h, states + h * c)
        states = states + h / 6 * (a + 2 * b + 2 * c + d)
    return np.array(times), np.array(xs), np.array(fs)


@pytest.fixture(scope="module")
def generalised():
    amplitude = 1e-3 * np.array([2.0, 4.0, 8.0])[:, None]
    return integrated(law("strain_stiffening"), amplitude, np.arange(4.0)[None, :])


@pytest.mark.parametrize("row", [0, 1, 2])
@pytest.mark.parametrize("current", [0, 1, 2, 3])
def test_generalised_model(generalised, row, current):
    t, x, f = generalised
    m = loop_measures(t, x[:, row, current], f[:, row, current], skip=CYCLES - 5)
    amplitude = (2, 4, 8)[row]
    stiffness = 1e3 * STIFFNESS[amplitude][current]
    assert m.effective_stiffness.value == pytest.approx(stiffness, rel=5e-3)
    # printed to three digits: half a unit of the last is 0.36 % of the smallest
    ratio = DAMPING_RATIO[amplitude][current]
    assert m.damping_ratio.value == pytest.approx(ratio, rel=5e-3)


@pytest.mark.parametrize("amplitude", [2, 4, 8])
def test_base_model(amplitude):
    base = law("strain_stiffening", "base_model")
    t, x, f = integrated(base, np.array([1e-3 * amplitude]), np.array([0.0]))
    m = loop_measures(t, x[:, 0], f[:, 0], skip=CYCLES - 5)
    stiffness, ratio = BASE_MODEL[amplitude]
    assert m.effective_stiffness.value == pytest.approx(1e3 * stiffness, rel=5e-3)
    assert m.damping_ratio.value == pytest.approx(ratio, rel=5e-3)


@pytest.mark.parametrize("amplitude", [2, 4, 8])
def test_kelvin_voigt_base_set(amplitude):
    device = law("kelvin_voigt", {"k": 200.0, "c": 2000.0})
    t, x, f = integrated(device, np.array([1e-3 * amplitude]), np.array([0.0]))
    m = loop_measures(t, x[:, 0], f[:, 0])
    assert m.effective_stiffness.value == pytest.approx(200.0, rel=5e-3)
    assert m.damping_ratio.value == pytest.approx(31.4, rel=5e-3)


def test_standard_solid_is_the_law_without_stiffening():
    device = law("strain_stiffening", "base_model").with_parameters(alpha=0.0)
    t, x, f = integrated(device, np.array([4e-3]), np.array([0.0]))
    m = loop_measures(t, x[:, 0], f[:, 0], skip=CYCLES - 5)
    assert m.effective_stiffness.value == pytest.approx(5318.0, rel=1e-3)
    assert m.damping_ratio.value == pytest.approx(0.276, rel=5e-3)
    k0, k1, c0, omega = 200.0, 7000.0, 2000.0, 2 * np.pi
    modulus = k1 * (k0 + 1j * omega * c0) / (k0 + k1 + 1j * omega * c0)
    assert m.storage_stiffness.value == pytest.approx(modulus.real, rel=1e-6)
    assert m.loss_stiffness.value == pytest.approx(modulus.imag, rel=1e-6)
