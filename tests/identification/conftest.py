"""A law under a rich motion, integrated by SciPy: what the fits are tested on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import PPoly

from isolation_sim.identification.campaign import Campaign, TestRun
from isolation_sim.laws import LAWS, CurrentDependence

from ..splines import of_one_number

CURRENTS = (0.5, 2.0)
STEP, N_SAMPLES = 0.005, 801

# numbers that the motion below excites: value at 0 A, slope in 1/A
NUMBERS = {
    "strain_stiffening": {
        "c0": (900.0, 200.0), "k0": (6e3, 2e3), "c1": (2e3, 400.0), "k1": (3e4, 5e3),
        "alpha": (8e8, -1e8),
    },
    "hybrid": {
        "alpha": (40.0, 15.0), "beta": (250.0, 20.0), "gamma": (30.0, 20.0),
        "sigma_squared": (1.2e-5, 2e-6), "F0": (6.0, 1.0), "v_s": (0.01, 0.002),
    },
    "linear": {"k": (2e4, 3e3)},
    "kelvin_voigt": {"k": (2e4, 3e3), "c": (800.0, 100.0)},
    "maxwell": {"k": (2e4, 3e3), "c": (800.0, 100.0)},
    "standard_solid": {"c0": (800.0, 100.0), "k0": (1e4, 2e3), "k1": (3e4, 5e3)},
    "four_parameter": {
        "c0": (800.0, 100.0), "k0": (1e4, 2e3), "k1": (3e4, 5e3), "alpha": (8e8, 1e8),
    },
    "strain_stiffening_power": {
        "c0": (900.0, 200.0), "k0": (6e3, 2e3), "c1": (2e3, 400.0), "k1": (3e4, 5e3),
        "alpha": (4.0, 1.0), "p": (2.6, 0.2),
    },
    "strain_stiffening_field_gap": {
        "c0": (900.0, 200.0), "k0": (6e3, 2e3), "c1": (2e3, 400.0), "k1": (3e4, 5e3),
        "alpha": (8e8, -1e8), "gap_epsilon": (30.0, 5.0),
    },
    "bouc_wen": {
        "k": (1e4, 2e3), "c": (300.0, 50.0), "alpha": (4e4, 1e4), "A": (1.0, 0.0),
        "beta": (4e4, 5e3), "gamma": (1.5e4, -2e3), "n": (1.7, 0.0), "F0": (8.0, 1.0),
    },
    "improved_bouc_wen": {
        "alpha": (1.0, 0.0), "beta": (7e5, 1e5), "gamma": (3e5, -5e4), "theta": (1e5, 2e4),
        "k": (2e4, 3e3), "c": (900.0, 200.0), "d": (0.3, 0.05), "W": (2.5e-3, 0.0),
        "O": (400.0, 30.0),
    },
    "linearised_bouc_wen": {
        "C": (300.0, 50.0), "k1": (1e4, 2e3), "k2": (80.0, 15.0), "C_e": (250.0, 0.0),
        "k_e": (12.0, 2.0),
    },
    "dynamic_stiffness": {
        "k_0": (1e4, 2e3), "k_A": (-3e6, 0.0), "k_B": (5e3, 0.0), "k_f": (60.0, 0.0),
        "l_0": (2e3, 300.0), "l_A": (-1e6, 0.0), "l_B": (1e3, 0.0), "l_f": (8.0, 0.0),
        "B": (0.15, 0.0), "tau": (0.3, 0.0),
    },
    "lugre": {
        "k0": (1e4, 3e3), "c0": (300.0, 50.0), "alpha": (800.0, 0.0), "beta": (8e4, 1e4),
        "epsilon": (400.0, 50.0), "F0": (8.0, 1.0),
    },
    "dahl": {"k": (1e4, 2e3), "c": (300.0, 50.0), "sigma": (9e4, 1e4), "F_c": (100.0, 20.0)},
    "spring_pot": {"k": (2e4, 3e3), "a": (0.12, 0.04)},
    "spencer": {
        "k0": (2e4, 4e3), "c0": (300.0, 50.0), "k1": (8e3, 2e3), "c1": (1.5e3, 300.0),
        "x0": (2e-3, 0.0), "F_y": (90.0, 30.0), "rho": (900.0, 100.0), "sigma": (0.75, 0.05),
        "n": (1.7, 0.1),
    },
    "hyperbolic_tangent": {
        "k": (1e4, 2e3), "c": (300.0, 50.0), "alpha": (90.0, 30.0), "beta": (40.0, 5.0),
        "delta": (0.8, 0.1), "x_s": (8e-4, 1e-4), "F0": (8.0, 1.0),
    },
    "gamota_filisko": {
        "k1": (2e4, 5e3), "c1": (600.0, 100.0), "k2": (5e4, 1e4), "F_c": (40.0, 15.0),
        "c0": (500.0, 100.0), "F0": (8.0, 1.0),
    },
    "rate_dependent_bouc_wen": {
        "k": (1e4, 2e3), "c": (1500.0, 300.0), "v_c": (0.015, 0.002), "F_y": (90.0, 30.0),
        "rho": (900.0, 100.0), "sigma": (0.75, 0.05), "n": (1.7, 0.1), "r": (1.5, 0.3),
        "F0": (8.0, 1.0),
    },
}  # fmt: skip
# a law that needs no others takes those of its example
for own in LAWS.values():
    pairs = {key: (*np.atleast_1d(value).tolist(), 0.0)[:2] for key, value in own.example.items()}
    NUMBERS.setdefault(own.name, pairs)
# one of the parameters that scaling a state trades against each other, as the laws' files say
HELD = {
    "bouc_wen": {"A": 1.0},
    "improved_bouc_wen": {"alpha": 1.0},
    "linearised_bouc_wen": {"C_e": 250.0},
    "park_wen_ang": {"beta": 0.6},
    "friction_pendulum": {"W": 1.0e4, "n": 2.0, "tau": 1.0},
    # the motion stays beyond the amplitudes between which this law tells one from another
    "dynamic_stiffness": {
        "k_A": -3e6,
        "k_B": 5e3,
        "k_f": 60.0,
        "l_A": -1e6,
        "l_B": 1e3,
        "l_f": 8.0,
        "tau": 0.3,
        "B": 0.15,
    },
}


@dataclass(frozen=True)
class Wave:
    """Sum of sinusoids."""

    amplitude: np.ndarray
    omega: np.ndarray
    phase: np.ndarray

    def displacement(self, t):
        return np.sin(np.multiply.outer(t, self.omega) + self.phase) @ self.amplitude

    def velocity(self, t):
        turn = np.cos(np.multiply.outer(t, self.omega) + self.phase)
        return turn @ (self.amplitude * self.omega)


def rich_wave(seed=3):
    """Two tests' sinusoids and noise from 0.2 to 6 Hz, up to about 6 mm."""
    random = np.random.default_rng(seed)
    amplitude = np.concatenate([[3e-3, 1.6e-3], np.full(8, 0.35e-3)])
    frequency = np.concatenate([[0.5, 2.3], random.uniform(0.2, 6.0, 8)])
    return Wave(amplitude, 2 * np.pi * frequency, random.uniform(0, 2 * np.pi, 10))


def integrated(law, parameters, displacement, velocity, time, rtol=1e-8):
    """Force at the times, the states integrated by SciPy from rest."""
    parameters = tuple(parameters)
    x, v = (of_one_number(f) if isinstance(f, PPoly) else f for f in (displacement, velocity))
    states = np.zeros((0, len(time)))
    if law.states:

        def rates(t, s):
            return law.rates(x(t), v(t), tuple(s), parameters)

        solution = solve_ivp(
            rates,
            (time[0], time[-1]),
            np.zeros(len(law.states)),
            "LSODA",
            time,
            rtol=rtol,
            atol=1e-14,
            max_step=0.02,
        )
        assert solution.success
        states = solution.y
    return law.force(displacement(time), velocity(time), tuple(states), parameters)


@cache
def clean_runs(name):
    """One run a current, without noise."""
    law, runs = LAWS[name], []
    dependence = CurrentDependence.polynomial(NUMBERS[name], law.parameter_names)
    time = STEP * np.arange(N_SAMPLES)
    for k, current in enumerate(CURRENTS):
        wave = rich_wave(k)
        force = integrated(law, dependence.at(current), wave.displacement, wave.velocity, time)
        runs.append(
            TestRun(
                name=f"run{k}", time=time, displacement=wave.displacement(time),
                velocity=wave.velocity(time), force=force, current=np.full(N_SAMPLES, current),
            )
        )  # fmt: skip
    return tuple(runs)


def noisy_campaign(name, seed, noise=0.01, runs=None):
    """Runs with white noise of a share of the force's RMS."""
    from dataclasses import replace

    random = np.random.default_rng(seed)
    runs = clean_runs(name) if runs is None else runs
    size = noise * np.sqrt(np.mean([run.force**2 for run in runs]))
    noisy = [replace(r, force=r.force + size * random.standard_normal(r.force.size)) for r in runs]
    return Campaign(f"{name} {seed}", "made", tuple(noisy))


@pytest.fixture
def numbers():
    """Parameters' polynomials by law."""
    return NUMBERS


@pytest.fixture
def held():
    """Parameters to hold by law."""
    return HELD


@pytest.fixture
def campaign_of():
    """Function: campaign of a law and a seed."""
    return noisy_campaign


@pytest.fixture
def reference_force():
    """Function: force by SciPy."""
    return integrated


@pytest.fixture
def wave():
    """A rich motion."""
    return rich_wave()


@pytest.fixture
def true_value():
    """Function: a law's parameter at a current."""

    def value(name, parameter, current):
        constant, slope = NUMBERS[name][parameter]
        return constant + slope * current

    return value
