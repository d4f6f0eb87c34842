"""Steady loops, by an integrator that has nothing to do with ours."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp


@pytest.fixture(scope="session")
def steady_loop():
    """Last cycle of a sinusoidal test: function of device, amplitude, current, frequency."""

    def loop(device, amplitude, current=0.0, frequency=1.0, cycles=20, points=512):
        omega = 2 * np.pi * frequency

        def motion(t):
            return amplitude * np.sin(omega * t), amplitude * omega * np.cos(omega * t)

        def rate(t, states):
            return device.rates(*motion(t), states, current)

        t = (cycles - 1 + np.arange(points) / points) / frequency
        solution = solve_ivp(
            rate, (0.0, cycles / frequency), device.initial_states(), t_eval=t, rtol=1e-8,
            atol=1e-12, max_step=0.02 / frequency,
        )  # fmt: skip
        x, v = motion(t)
        return x, v, device.force(x, v, solution.y, current)

    return loop


@pytest.fixture(scope="session")
def stiffness_and_damping():
    """Effective stiffness and damping ratio of a loop that starts at x = 0 (000, Eqs 3-5)."""

    def measure(x, v, force):
        n = len(x)
        amplitude = x[n // 4]
        stiffness = (force[n // 4] - force[3 * n // 4]) / (2 * amplitude)
        # trapezoidal over a whole cycle, exact for the sines of which a smooth loop consists
        period = 2 * np.pi * amplitude / v[0]
        lost = np.mean(force * v) * period
        return stiffness, lost / (2 * np.pi * stiffness * amplitude**2)

    return measure


@pytest.fixture(scope="session")
def complex_modulus():
    """Storage stiffness and equivalent damping from the first harmonic (001, Eqs 12-18)."""

    def measure(x, v, force):
        amplitude, speed = np.max(x), np.max(v)
        omega = speed / amplitude
        storage = 2 * np.mean(force * x) / amplitude**2
        loss = 2 * np.mean(force * v) / (speed * amplitude)
        return storage, loss / omega

    return measure
