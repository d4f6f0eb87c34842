"""Switching rules."""

from collections import namedtuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from controllers import controller
from controllers.on_off import RULES
from isolation_sim.simulation.run import simulate

from .conftest import both_forms, context_of


def test_switches_as_an_independent_integration_does(isolated, el_centro):
    structure, device = isolated.structure, isolated.elements[0].device
    record = el_centro.cut(0.0, 4.0)
    n, period, dt = structure.n_dofs, 0.1, record.dt
    inverse = np.linalg.inv(structure.mass)
    b = isolated.elements[0].direction

    def rates(t, s, current):
        q, p, states = s[:n], s[n : 2 * n], tuple(s[2 * n :])
        force = device.force(b @ q, b @ p, states, current)
        a_g = np.interp(t, record.time, record.acceleration)
        inner = structure.damping @ p + structure.stiffness @ q + b * force
        acceleration = -inverse @ inner - structure.influence[:, 0] * a_g
        return np.concatenate([p, acceleration, device.rates(b @ q, b @ p, states, current)])

    state, current, path, currents = np.zeros(2 * n + 2), 0.0, [], []
    for k, t in enumerate(record.time):
        if k % round(period / dt) == 0:
            product = (b @ state[:n]) * (b @ state[n : 2 * n])
            current = 3.0 if product > 0 else 0.0
        path.append(state[0])
        currents.append(current)
        options = {"method": "DOP853", "rtol": 1e-8, "atol": 1e-10, "args": (current,)}
        state = solve_ivp(rates, (t, t + dt), state, **options).y[:, -1]

    run = simulate(isolated, record, controller("on_off", on=3, off=0, period=period))
    assert np.array_equal(run.command[:-1, 0], currents[:-1])
    path = np.array(path)
    assert np.abs(run.output("base_displacement_m") - path).max() <= 1e-5 * np.abs(path).max()


@pytest.mark.parametrize("rule", RULES)
def test_every_command_follows_the_rule(isolated, record, rule):
    run = simulate(isolated, record, controller("on_off", rule=rule, period=0.1))
    decided = np.arange(0, len(run.time) - 1, 5)
    command = run.command[decided, 0]
    x, v = (run.output(f"isolator_{q}")[decided] for q in ("deformation_m", "velocity_m_s"))
    # what was measured just before the command changed, and the force with it
    device, states = isolated.elements[0].device, tuple(run.states[decided, 0].T)
    force = device.force(x, v, states, np.append(0.0, command[:-1]))
    jump = device.force(x, v, states, command) - force
    a = run.output("base_acceleration_m_s2")[decided] + jump / isolated.structure.mass[0, 0]
    w = np.zeros(len(decided))
    for k in range(1, len(w)):
        w[k] = w[k - 1] * np.exp(-2 * np.pi * 0.1 * 0.1) + 0.1 * (a[k] + a[k - 1]) / 2
    first = {"stiffness": x, "dissipation": force, "acceleration": a, "skyhook": w}[rule]
    product = first * v
    clear = np.abs(product) > 1e-9 * np.abs(product).max()
    assert np.array_equal(command[clear], np.where(product > 0, 3.0, 0.0)[clear])


def test_dead_band_keeps_the_last_current(isolated):
    one = controller("on_off", on=2, off=0.5, dead_band=0.1)
    one.reset(context_of(one, isolated))
    measured = namedtuple("Measurement", "x v coil")
    products = [0.05, 0.2, 0.05, -0.05, -0.2, 0.05]
    values = [one.current(0.02 * k, measured(1.0, p, 0.0))[0] for k, p in enumerate(products)]
    assert values == [0.5, 2, 2, 2, 0.5, 0.5]


@pytest.mark.parametrize("rule", RULES)
def test_two_coils_and_two_isolators_on_one(rule):
    from isolation_sim.structures import reference_building, reference_isolators

    device = reference_isolators().scaled(force=1 / 3)
    nominal = reference_building().with_element(device, "base", 0, "a")
    nominal = nominal.with_element(device, "base", 1, "b").with_element(device, "base", 0, "c")
    one = controller("on_off", rule=rule)
    context = context_of(one, nominal)
    rng = np.random.default_rng(0)
    plain, fast = both_forms(one, context, rng.standard_normal((50, len(context.outputs))))
    assert plain.shape == (50, 2) and np.array_equal(plain, fast)
    assert set(plain.ravel()) == {0.0, 3.0} and np.any(plain[:, 0] != plain[:, 1])
