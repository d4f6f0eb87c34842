"""Every registered law with every published set, for tests that hold for all of them."""

import numpy as np
import pytest

from isolation_sim.laws import LAWS, available_laws, available_sets, law
from isolation_sim.laws.hybrid import condition
from isolation_sim.laws.strain_stiffening_power import base_model as power_model


def all_devices():
    """Devices by a printable name."""
    devices = {
        f"{name}-{chosen}": law(name, chosen)
        for name in available_laws()
        for chosen in available_sets(name)
    }
    devices |= {name: law(name, one.example) for name, one in LAWS.items() if one.example}
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
