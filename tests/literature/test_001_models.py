"""001, Tao et al.: the three models' loops, millimetres in z, and the preloaded schemes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from isolation_sim.identification.sinusoidal import sinusoidal
from isolation_sim.laws import law
from isolation_sim.laws.published import TAO_CURRENTS_A
from studies.papers.conditions_001 import modulus
from studies.papers.models_001 import complex_modulus, hysteresis, in_millimetres, traditional
from studies.papers.tables import TAO_COMPLEX_MODULUS

POINTS = 2000


def printed_loop(current, amplitude, frequency, position=0.0, factor=1.0):
    """The printed equations by SciPy, z fed with metres times a factor: a settled cycle."""
    alpha, beta, gamma, theta, k, c, d, W, O = (  # noqa: E741
        float(p) for p in law("improved_bouc_wen").parameters_at(current)
    )
    omega = 2 * np.pi * frequency

    def rate(t, z):
        u = factor * amplitude * omega * np.cos(omega * t)
        return alpha * u - beta * abs(u) * abs(z) * z - gamma * u * z**2

    t = (1 + (np.arange(POINTS) + 0.5) / POINTS) / frequency
    z = solve_ivp(
        rate, (0, 2 / frequency), [0.0], "LSODA", t, rtol=1e-8, atol=1e-10,
        max_step=2e-3 / frequency,
    ).y[0]  # fmt: skip
    x = position + amplitude * np.sin(omega * t)
    v = amplitude * omega * np.cos(omega * t)
    W2 = (1 - d) * W
    forward = np.clip(O * (W2 + x), 0, 1)
    step = np.where(v >= 0, forward, np.clip(O * (W - x), 0, 1))
    force = (1 - d * (x >= 0)) * k * x + step * c * v + theta * z
    return np.sin(omega * t), np.cos(omega * t), force


@pytest.mark.parametrize("shape", [-0.9, 0.0, 0.8])
@pytest.mark.parametrize("slope", [2500.0, pytest.param(9000.0, marks=pytest.mark.slow)])
def test_steady_hysteresis_in_closed_form(shape, slope):
    both = slope**2 / 1500.0  # beta + gamma, alpha = 1500 1/m
    values = dict(k=0.0, c=0.0, alpha=1.0, A=1500.0, n=2.0, F0=0.0,
                  beta=both * (1 - shape) / 2, gamma=both * (1 + shape) / 2)  # fmt: skip
    device = law("bouc_wen", values)
    x, v, z = sinusoidal(device, [1e-3], 0.0, 0.5, 4, POINTS).last_cycle(0)
    closed = hysteresis(x, v, 1e-3, slope, shape)
    away = np.abs(v) > 0.02 * np.max(v)
    np.testing.assert_allclose(closed[away], z[away] * np.sqrt(both / 1500.0), atol=2e-4)


@pytest.mark.parametrize(("factor", "stiffness"), [(1.0, 5.306e6), (1e3, 4.590e6)])
def test_millimetres_in_z(factor, stiffness):
    sine, _, force = printed_loop(2.0, 1e-3, 0.5, factor=factor)
    computed = 2 * np.mean(force * sine) / 1e-3
    assert computed == pytest.approx(stiffness, rel=1e-3)
    x, _, closed = in_millimetres(2.0, factor)
    assert closed @ x / (x @ x) == pytest.approx(computed, rel=1e-3)
    # the peak does not tell the units apart
    assert np.max(closed) == pytest.approx(5535.0, rel=1e-3)


@pytest.mark.parametrize("scheme", [12, 13, 16, 17])
@pytest.mark.parametrize("current", [0.0, 2.0])
def test_preloaded_schemes(scheme, current):
    amplitude, frequency, position, *_ = TAO_COMPLEX_MODULUS[scheme]
    sine, cosine, force = printed_loop(current, 1e-3 * amplitude, frequency, 1e-3 * position)
    omega = 2 * np.pi * frequency
    expected = [2e3 * np.mean(force * y) / amplitude / w for y, w in ((sine, 1), (cosine, omega))]
    result = modulus(amplitude, frequency, current, position)
    assert result == pytest.approx(expected, rel=3e-3)


def test_the_traditional_model_contains_the_linear_one():
    for current in TAO_CURRENTS_A:
        assert traditional(current).error < complex_modulus(current).error
