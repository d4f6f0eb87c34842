"""At a constant current no law creates energy: F v - dU/dt >= 0."""

import numpy as np

from isolation_sim.laws.emit import symbols


def test_dissipation_is_never_negative(storing_device, draw):
    device = storing_device
    import casadi

    names = ["x", "v", *device.law.state_names, "current"]
    x, v, *states, current = inputs = symbols(names)
    states = tuple(states)
    power = device.force(x, v, states, current) * v
    energy = device.stored_energy(x, states, current)
    growth = casadi.gradient(energy, x) * v
    for state, rate in zip(states, device.rates(x, v, states, current), strict=True):
        growth += casadi.gradient(energy, state) * rate
    function = casadi.Function("dissipation", inputs, [power - growth, power])
    xs, vs, ss, currents = draw(device, 2000, seed=1)
    lost, size = function.map(xs.size)(*(np.atleast_2d(row) for row in (xs, vs, *ss, currents)))
    lost, size = np.array(lost)[0], np.array(size)[0]
    assert np.min(lost) >= -1e-12 * np.max(np.abs(size))
    assert np.max(lost) > 0 or device.law.name == "linear"


def test_stored_energy_is_never_negative(storing_device, draw):
    device = storing_device
    x, _, states, current = draw(device, 500)
    assert np.min(device.stored_energy(x, states, current)) >= 0
