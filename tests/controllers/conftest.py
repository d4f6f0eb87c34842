"""Every registered controller, the reference building and the start of El Centro."""

import ctypes

import numpy as np
import pytest

from controllers import CONTROLLERS, available_controllers, controller
from ground_motions import el_centro_1940
from isolation_sim.simulation.control import RunContext, Sensors
from isolation_sim.structures import from_matrices, reference_building, reference_isolators

# settings without which a controller cannot be built, or takes longer than its contract needs
NEEDED = {
    "prescribed": {"time": (0.0, 1.0, 3.5), "amperes": (0.0, 2.0, 0.5)},
    "clairvoyant": {"iterations": 4, "interval": 0.08},
}


def build(name, **settings):
    """With its published settings: tuned ones may hardly act."""
    selected = {"preset": "published"} if "published" in CONTROLLERS[name].presets else {}
    return controller(name, **NEEDED.get(name, {}), **selected, **settings)


NOISE = {
    "displacement_m": 5e-4, "velocity_m_s": 5e-3, "acceleration_m_s2": 0.02, "deformation_m": 5e-4,
    "force_N": 5e3,
}  # fmt: skip
"""Standard deviation of each quantity's sensor."""


def noisy_sensors(one, isolated):
    """Noise of every quantity that the controller measures, and 20 ms of delay."""
    measured = one.measures(isolated)
    silent = [name for name in measured if not name.endswith(tuple(NOISE))]
    assert not silent, f"no noise is known for {silent}"
    noise = {key: size for key, size in NOISE.items() if any(n.endswith(key) for n in measured)}
    return Sensors(noise=noise, delay=0.02, seed=1)


@pytest.fixture(params=available_controllers())
def name(request):
    return request.param


@pytest.fixture(scope="session")
def isolated():
    return reference_building().on(reference_isolators())


@pytest.fixture(scope="session")
def el_centro():
    return el_centro_1940()


@pytest.fixture(scope="session")
def record(el_centro):
    return el_centro.cut(0.0, 8.0)


def twice(structure):
    """The same building once along each of two directions, on the reference isolators."""
    two = np.eye(2)
    matrices = (np.kron(m, two) for m in (structure.mass, structure.damping, structure.stiffness))
    influence = np.kron(structure.influence, two)
    return from_matrices(*matrices, influence=influence, base=(0, 1)).on(reference_isolators())


def context_of(controller, nominal, period=0.02, duration=8.0, high=3.0):
    n = nominal.n_channels
    outputs = (*controller.measures(nominal), *(f"coil{c}_current_A" for c in range(n)))
    tested = np.array([nominal.tested_current(c) for c in range(n)])
    return RunContext(
        nominal, period, duration, np.zeros(n), np.full(n, high), np.minimum(tested, high), outputs
    )


def both_forms(controller, context, measurements):
    """Commands of the plain and the compiled form for measurements one after another."""
    controller.reset(context)
    compiled = controller.compiled(context)
    memory, command = compiled.memory.copy(), np.zeros(len(context.low))
    pointer, double = ctypes.POINTER(ctypes.c_double), ctypes.c_double
    kind = ctypes.CFUNCTYPE(None, double, *[pointer] * 4, ctypes.POINTER(ctypes.c_int64))
    function = kind(compiled.address)
    plain, fast = [], []
    for k, measured in enumerate(measurements):
        t = k * context.period
        plain.append(controller.current(t, measured))
        arrays = [np.ascontiguousarray(measured), compiled.settings, memory, command]
        sizes = np.array([*map(len, arrays), *compiled.numbers])
        function(
            t, *(a.ctypes.data_as(pointer) for a in arrays),
            sizes.ctypes.data_as(ctypes.POINTER(ctypes.c_int64)),
        )  # fmt: skip
        fast.append(command.copy())
    return np.array(plain), np.array(fast)
