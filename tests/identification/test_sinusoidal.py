"""A device moved sinusoidally: against SciPy, with and without a mean deformation."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from isolation_sim.identification.sinusoidal import sinusoidal
from isolation_sim.laws import law

MEAN, X, FREQUENCY = -3.5e-3, 1e-3, 2.0
OMEGA = 2 * np.pi * FREQUENCY


def test_mean_deformation_of_a_standard_solid():
    device = law("standard_solid")
    k0, k1, c0 = (device.parameters_at(0.0)[device.law.parameter_names.index(n)]
                  for n in ("k0", "k1", "c0"))  # fmt: skip
    motion = sinusoidal(device, X, 0.0, FREQUENCY, cycles=12, mean_deformation=MEAN)
    modulus = k1 * (k0 + 1j * OMEGA * c0) / (k0 + k1 + 1j * OMEGA * c0)
    late = motion.time >= 10 / FREQUENCY
    expected = k0 * k1 / (k0 + k1) * MEAN + X * np.imag(
        modulus * np.exp(1j * OMEGA * motion.time[late])
    )
    assert motion.force[late] == pytest.approx(expected, rel=1e-6)
    assert motion.displacement[:2] == pytest.approx(MEAN + X * np.sin(OMEGA * motion.time[:2]))


def test_preloaded_improved_bouc_wen():
    device, currents, cycles = law("improved_bouc_wen"), np.array([0.0, 2.0]), 3
    motion = sinusoidal(device, X, currents, FREQUENCY, cycles, 1024, mean_deformation=MEAN)
    assert motion.force.shape == (cycles * 1024 + 1, 2)
    ends = (0.25 + 0.5 * np.arange(-1, 2 * cycles + 1)) / FREQUENCY
    for case, current in enumerate(currents):
        parameters = device.parameters_at(current)

        def rates(t, z, parameters=parameters):
            x, v = MEAN + X * np.sin(OMEGA * t), X * OMEGA * np.cos(OMEGA * t)
            return device.law.rates(x, v, tuple(z), parameters)

        z, expected = np.zeros(1), np.zeros(motion.time.size)
        for span in pairwise(np.clip(ends, 0.0, motion.time[-1])):  # from reversal to reversal
            inside = (motion.time >= span[0]) & (motion.time <= span[1])
            options = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13, "dense_output": True}
            solution = solve_ivp(rates, span, z, **options)
            z, expected[inside] = solution.y[:, -1], solution.sol(motion.time[inside])[0]
        assert motion.states[:, 0, case] == pytest.approx(expected, abs=2e-4)


def test_mean_deformations_broadcast():
    device = law("improved_bouc_wen")
    motion = sinusoidal(device, [[1e-3], [2e-3]], 0.0, cycles=3, mean_deformation=[0.0, MEAN])
    alone = sinusoidal(device, 2e-3, 0.0, cycles=3, mean_deformation=MEAN)
    assert np.array_equal(motion.force[:, 1, 1], alone.force)
    assert motion.measured(1, 1).displacement_offset.value == pytest.approx(MEAN, rel=1e-6)


def test_states_start_at_rest():
    from isolation_sim.effects import effect, extend

    plain = law("kelvin_voigt", {"k": (2e4, 3e3), "c": 800.0})
    device = extend(plain, [(effect("current_lag"), {"lag": 0.1})])
    expected = sinusoidal(plain, X, 2.0, FREQUENCY, cycles=3).force
    motion = sinusoidal(device, X, 2.0, FREQUENCY, cycles=3)
    assert motion.force == pytest.approx(expected, rel=1e-9, abs=1e-9)
