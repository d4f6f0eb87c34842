"""Every registered law with every published set, for tests that hold for all of them."""

import numpy as np
import pytest

from isolation_sim.laws import available_laws, available_sets, law
from isolation_sim.laws.hybrid import condition
from isolation_sim.laws.strain_stiffening_power import base_model as power_model

EXPLICIT = {
    "linear": {"k": (2.0e4, 3.0e3)},
    "kelvin_voigt": {"k": (2.0e4, 3.0e3), "c": 800.0},
    "maxwell": {"k": (2.0e4, 3.0e3), "c": 800.0},
    "bouc_wen": {
        "k": (2.0e4, 3.0e3), "c": 300.0, "alpha": (4.0e4, 1.0e4), "A": 1.0, "beta": 5.0e3,
        "gamma": (3.0e3, -1.0e3), "n": 1.7, "F0": 0.0,
    },
    "lugre": {
        "k0": (2.0e4, 3.0e3), "c0": 300.0, "alpha": 800.0, "beta": (5.0e4, 1.0e4),
        "epsilon": 40.0, "F0": 0.0,
    },
    "dahl": {"k": (2.0e4, 3.0e3), "c": 300.0, "sigma": (4.0e4, 1.0e4), "F_c": 150.0},
    "spring_pot": {"k": (2.0e4, 3.0e3), "a": (0.1, 0.05)},
    "spencer": {
        "k0": (1.0e4, 2.0e3), "c0": (600.0, 100.0), "k1": 2.0e3, "c1": (4.0e3, 5.0e2), "x0": 0.0,
        "F_y": (150.0, 80.0), "rho": 900.0, "sigma": 0.6, "n": 1.8,
    },
    "hyperbolic_tangent": {
        "k": (2.0e3, 3.0e2), "c": 600.0, "alpha": (150.0, 80.0), "beta": 60.0, "delta": 0.8,
        "x_s": 1.0e-3, "F0": 0.0,
    },
    "gamota_filisko": {
        "k1": (2.0e4, 3.0e3), "c1": 900.0, "k2": (5.0e4, 1.0e4), "F_c": (60.0, 20.0), "c0": 700.0,
        "F0": 0.0,
    },
    "rate_dependent_bouc_wen": {
        "k": (2.0e4, 3.0e3), "c": 700.0, "v_c": 0.02, "F_y": (150.0, 80.0), "rho": 900.0,
        "sigma": 0.6, "n": 1.8, "r": 0.5, "F0": 0.0,
    },
    "park_wen_ang": {
        "k": (2.0e4, 3.0e3), "c": 300.0, "Q": (800.0, 200.0), "u_y": 0.01, "beta": 0.6,
        "gamma": 0.4,
    },
    "friction_pendulum": {
        "W": 1.0e4, "R": 1.5, "mu_max": 0.1, "mu_min": 0.05, "a": 30.0, "u_y": 0.002, "n": 2.0,
    },
}  # fmt: skip


def all_devices():
    """Devices by a printable name."""
    devices = {
        f"{name}-{chosen}": law(name, chosen)
        for name in available_laws()
        for chosen in available_sets(name)
    }
    devices |= {name: law(name, numbers) for name, numbers in EXPLICIT.items()}
    devices["hybrid-condition"] = condition(4, 2, 3)
    devices["hybrid-interpolated"] = condition(8, 1).scaled(length=10, force=300)
    devices["strain_stiffening_power-even"] = power_model(4, 3)
    return devices


DEVICES = all_devices()


@pytest.fixture(scope="session")
def devices():
    """Every device by name."""
    return DEVICES


@pytest.fixture(params=DEVICES, scope="session")
def device(request):
    """Every device in turn."""
    return DEVICES[request.param]


@pytest.fixture(params=[n for n, d in DEVICES.items() if d.stores_energy], scope="session")
def storing_device(request):
    """Every device with a stored-energy function in turn."""
    return DEVICES[request.param]


@pytest.fixture
def draw():
    """Random x, v, states and currents of a device, each of shape (n,)."""

    def sample(device, n=400, seed=0):
        rng = np.random.default_rng(seed)
        scale = device.deformation_scale
        x, v = scale * rng.uniform(-1, 1, n), 10 * scale * rng.uniform(-1, 1, n)
        states = tuple(scale / device.length * rng.uniform(-1, 1, (len(device.law.states), n)))
        low, high = device.current_range
        current = rng.uniform(max(low, 0.0), min(high, 3.0), n)
        return x, v, states, current

    return sample
