"""One half of a hybrid test: the device alone, and the building with a force from outside."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import isolation_sim as iso
from isolation_sim.errors import InputError

PERIOD = 0.01
DEVICES = {
    "strain_stiffening": iso.law("strain_stiffening").scaled(length=10, force=3000),
    "bouc_wen": iso.law(
        "bouc_wen",
        parameters={
            "k": 1e5,
            "c": 2e4,
            "alpha": 3e5,
            "A": 1.0,
            "beta": 20.0,
            "gamma": 10.0,
            "n": 2.0,
            "F0": 0.0,
        },
    ),
    "kelvin_voigt": iso.law("kelvin_voigt", parameters={"k": 2e6, "c": 1e5}),
}


def by_scipy(device, path, currents):
    """Forces at the ends of the steps; ``path(k, t)``: displacement and velocity in step k."""
    y, forces = np.zeros(len(device.law.states)), []
    for k, current in enumerate(currents):
        if len(y):
            y = solve_ivp(
                lambda t, y, k=k, i=current: device.rates(*path(k, t), tuple(y), i),
                (0.0, PERIOD), y, method="DOP853", rtol=1e-9, atol=1e-12,
            ).y[:, -1]  # fmt: skip
        forces.append(device.force(*path(k, PERIOD), tuple(y), current))
    return np.array(forces)


@pytest.mark.parametrize("name", DEVICES)
@pytest.mark.parametrize("ramps", [False, True])
def test_the_device_follows_scipy(name, ramps):
    device = DEVICES[name]
    size = 0.5 * min(device.deformation_scale, 0.2)
    times = np.arange(81) * PERIOD
    low, high = device.current_range if device.depends_on_current else (0.0, 0.0)
    currents = low + (min(high, 3.0) - low) * (np.arange(80) // 16 % 2)
    x = size * (times + np.sin(9 * times))
    v = size * (1 + 9 * np.cos(9 * times))

    def path(k, t):
        s, h = t / PERIOD, PERIOD
        if ramps:
            return x[k] + s * (x[k + 1] - x[k]), (x[k + 1] - x[k]) / h
        basis = np.array([2 * s**3 - 3 * s**2 + 1, s**3 - 2 * s**2 + s, 3 * s**2 - 2 * s**3,
                          s**3 - s**2])  # fmt: skip
        slope = np.array([6 * s**2 - 6 * s, 3 * s**2 - 4 * s + 1, 6 * s - 6 * s**2,
                          3 * s**2 - 2 * s])  # fmt: skip
        ends = np.array([x[k], h * v[k], x[k + 1], h * v[k + 1]])
        return basis @ ends, slope @ ends / h

    simulator = iso.DeviceSimulator(device, PERIOD)
    if not ramps:
        simulator._end[2] = v[0]  # the motion begins at a velocity; a test would ramp up to it
    results = [
        simulator.step(x[k + 1], currents[k], None if ramps else v[k + 1]) for k in range(80)
    ]

    exact = by_scipy(device, path, currents)
    assert np.max(np.abs(results - exact)) < 2e-6 * np.max(np.abs(exact))


def test_a_device_s_state_continues_to_the_same_bits():
    simulator = iso.DeviceSimulator(iso.reference_isolators(), PERIOD)
    path = 0.1 * np.sin(np.arange(40) * 0.3)
    for x in path[:20]:
        simulator.step(x, 1.0)
    middle = simulator.state
    rest = [simulator.step(x, 2.0) for x in path[20:]]
    other = iso.DeviceSimulator(iso.reference_isolators(), PERIOD)
    other.step(0.3, 3.0)
    other.state = middle
    assert other.time == pytest.approx(20 * PERIOD)
    assert [other.step(x, 2.0) for x in path[20:]] == rest
    other.reset()
    assert [other.step(x, 1.0) for x in path[:1]] == [0.0]


def test_a_building_takes_a_force_from_outside():
    """Linear under piecewise-linear ground motion and held force: exact by matrix exponential."""
    building = iso.reference_building()
    structure = building.on(iso.measured_force())
    rng = np.random.default_rng(1)
    ground, forces = rng.normal(0, 1, 51), 1e5 * rng.normal(0, 1, 50)
    names = [f"{dof}_displacement_m" for dof in building.names]
    simulator = iso.Simulator(
        structure, period=PERIOD, duration=50 * PERIOD, measures=names, tolerance=1e-10
    )
    simulator.reset(ground_acceleration=ground[0])
    n, inverse = building.n_dofs, np.linalg.inv(building.mass)
    a = np.zeros((2 * n + 3, 2 * n + 3))
    a[:n, n : 2 * n] = np.eye(n)
    a[n : 2 * n, : 2 * n] = -inverse @ np.hstack([building.stiffness, building.damping])
    a[n : 2 * n, 2 * n] = -building.influence[:, 0]  # ground acceleration
    a[n : 2 * n, 2 * n + 1] = -inverse[:, 0]  # force on the base
    a[2 * n, 2 * n + 2] = 1.0  # its rate
    step, z = expm(a * PERIOD), np.zeros(2 * n + 3)
    for k, force in enumerate(forces):
        z[2 * n :] = ground[k], force, (ground[k + 1] - ground[k]) / PERIOD
        z = step @ z
        result = simulator.step(force, ground[k + 1])
        np.testing.assert_allclose(result[:n], z[:n], rtol=1e-7, atol=1e-12)


def test_both_halves_make_the_whole(strong_motion, stiffening):
    """A hybrid test without its laboratory; the force lags by a period, so that it only tends."""
    fine = strong_motion.resampled(0.0005)
    names = ["base_displacement_m", "base_velocity_m_s"]
    whole = iso.simulate(stiffening, fine, iso.controller("constant", amperes=1.0))
    building = iso.Simulator(
        iso.reference_building().on(iso.measured_force()), fine, measures=names
    )
    isolators = iso.DeviceSimulator(iso.reference_isolators(), fine.dt)
    moved, path = building.reset(), [0.0]
    while not building.done:
        force = isolators.step(moved.base_displacement_m, 1.0, moved.base_velocity_m_s)
        moved = building.step(force)
        path.append(moved.base_displacement_m)
    exact = whole.output("base_displacement_m")
    assert np.max(np.abs(path - exact)) < 0.01 * np.max(np.abs(exact))


def test_what_is_refused():
    device = iso.reference_isolators()
    with pytest.raises(InputError, match="period: given 0 s; expected: above 0"):
        iso.DeviceSimulator(device, 0)
    with pytest.raises(InputError, match="tolerance: given 1; expected: 1e-12 to 1e-2"):
        iso.DeviceSimulator(device, 0.01, tolerance=1)
    simulator = iso.DeviceSimulator(device, 0.01)
    with pytest.raises(InputError, match="current 9 A is outside"):
        simulator.step(0.0, 9.0)
    with pytest.raises(InputError, match="displacement: given nan m"):
        simulator.step(np.nan)
    with pytest.raises(InputError, match="state is of another device"):
        simulator.state = iso.DeviceSimulator(iso.law("linear", parameters={"k": 1.0}), 0.1).state
