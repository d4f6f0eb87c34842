"""Laws in two directions: the same along every line, on a circle in slip, and never a source."""

from __future__ import annotations

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.laws import LAWS
from isolation_sim.laws.emit import symbols

BY_AXES = {"park_wen_ang"}
"""As published: absolute values direction by direction, so that oblique lines differ."""
ALONG_X = {"improved_bouc_wen"}
"""Softer in extension, which is along x."""

PLAN = sorted(name for name, law in LAWS.items() if law.plan)


@pytest.fixture(params=PLAN)
def planar(request, devices):
    """A device of every law that has a form in plan."""
    return next(d for d in devices.values() if d.law.name == request.param)


def sample(device, draw, n=200):
    """Motion along a line, its states, and parameters at the middle of the currents."""
    x, v, states, current = draw(device, n)
    parameters = tuple(np.broadcast_to(p, n) for p in device.parameters_at(current))
    return x / device.length, v / device.length, states, parameters


def offset(device, parameters):
    """A constant force is along x, whatever the motion."""
    names = device.law.parameter_names
    return parameters[names.index("F0")] if "F0" in names else 0.0


@pytest.mark.parametrize("angle", [0.0, np.pi / 2, 0.7, -2.0])
def test_along_a_line_it_is_the_law_itself(planar, draw, angle):
    law = planar.law
    if law.name in BY_AXES and abs(np.sin(2 * angle)) > 1e-9:
        pytest.skip("as published it is so along x and along y alone")
    if law.name in ALONG_X and angle != 0.0:
        pytest.skip("extension is along x")
    x, v, states, parameters = sample(planar, draw)
    unit = np.cos(angle), np.sin(angle)
    along = tuple(s * u for u in unit for s in states)
    motion = tuple(x * u for u in unit), tuple(v * u for u in unit)
    forces, rates = law.in_plan.respond(*motion, along, parameters)
    constant = offset(planar, parameters)
    expected = law.force(x, v, states, parameters) - constant
    for force, u, own in zip(forces, unit, (constant, 0.0), strict=True):
        np.testing.assert_allclose(force - own, expected * u, atol=1e-12 * np.abs(expected).max())
    own_rates = law.rates(x, v, states, parameters)
    for rate, target in zip(rates, [r * u for u in unit for r in own_rates], strict=True):
        np.testing.assert_allclose(rate, target, atol=1e-11 * np.abs(own_rates).max())
    if law.stored_energy is not None:
        stored = law.stored_energy(x, states, parameters)
        both = law.in_plan.stored_energy(motion[0], along, parameters)
        np.testing.assert_allclose(both, stored, rtol=1e-11, atol=1e-12 * np.max(stored))


def test_in_plan_no_law_is_a_source(planar):
    """Power less the growth of the stored energy is never negative, whatever the two motions."""
    import casadi

    law = planar.law.in_plan
    if law.stored_energy is None:
        pytest.skip("no stored energy is known")
    names = ["x", "y", "v", "w", *law.state_names]
    x, y, v, w, *states = inputs = symbols(names)
    parameters = planar.parameters_at(1.0)
    forces, rates = law.respond((x, y), (v, w), tuple(states), parameters)
    energy = law.stored_energy((x, y), tuple(states), parameters)
    power = forces[0] * v + forces[1] * w
    growth = casadi.gradient(energy, x) * v + casadi.gradient(energy, y) * w
    for state, rate in zip(states, rates, strict=True):
        growth += casadi.gradient(energy, state) * rate
    function = casadi.Function("lost", inputs, [power - growth, power])
    scale = planar.deformation_scale / planar.length
    points = scale * np.random.default_rng(5).uniform(-1, 1, (len(names), 500))
    lost, size = (np.array(row)[0] for row in function.map(500)(*points[:, np.newaxis]))
    assert lost.min() >= -1e-12 * np.abs(size).max()


@pytest.mark.parametrize("name", ["bouc_wen", "park_wen_ang", "friction_pendulum"])
def test_on_the_circle_it_stays_there(name, devices):
    """z . z' = 0 for every loading motion at the radius at which the law yields."""
    law, device = LAWS[name].in_plan, devices[name]
    values = dict(zip(law.parameter_names, device.parameters_at(0.0), strict=True))
    rng = np.random.default_rng(1)
    # park_wen_ang: where both components load
    along, across = rng.uniform(0, np.pi / 2, (2, 100))
    v = np.cos(along), np.sin(along)
    speed = 1.0
    radius = {
        "bouc_wen": (1.0 / (values.get("beta", 1) + values.get("gamma", 1)))
        ** (1 / values.get("n", 2.0)),
        "park_wen_ang": 1.0,
        "friction_pendulum": values.get("mu_max", 0)
        - (values.get("mu_max", 0) - values.get("mu_min", 0)) * np.exp(-values.get("a", 0) * speed),
    }[name]
    z = radius * np.cos(across), radius * np.sin(across)
    rates = law.rates((0.0, 0.0), v, z, tuple(values.values()))
    size = np.abs(rates).max()
    assert np.abs(z[0] * rates[0] + z[1] * rates[1]).max() < 1e-13 * radius * size


def test_friction_beyond_the_circle_returns_radially(devices):
    """At rest mu is mu_min: outside the circle f falls towards it, within the time tau."""
    law, device = LAWS["friction_pendulum"].in_plan, devices["friction_pendulum"]
    values = dict(zip(law.parameter_names, device.parameters_at(0.0), strict=True))
    direction = np.array([0.6, 0.8])
    for length in (0.0, 0.9, 1.2, 3.0):
        f = tuple(length * values["mu_min"] * direction)
        rates = law.rates((0.0, 0.0), (0.0, 0.0), f, tuple(values.values()))
        beyond = max(length - 1.0, 0.0) * values["mu_min"]
        np.testing.assert_allclose(rates, -beyond / values["tau"] * direction, atol=1e-12)


def test_load_changes_scale_the_pendulum_until_uplift(devices):
    law, device = LAWS["friction_pendulum"], devices["friction_pendulum"]
    parameters, states = device.parameters_at(0.0), (0.03, -0.02)
    plain, _ = law.in_plan.respond((0.1, 0.2), (0.3, -0.1), states, parameters)
    for change, factor in ((0.4, 1.4), (-0.3, 0.7), (-1.0, 0.0), (-2.0, 0.0)):
        loaded, _ = law.under_axial_load.respond(
            (0.1, 0.2, change), (0.3, -0.1, 9.0), states, parameters
        )
        np.testing.assert_allclose(loaded, (*(factor * f for f in plain), 0.0), atol=1e-9)


def test_a_law_without_such_a_form_says_so():
    with pytest.raises(InputError, match="under a vertical load that changes"):
        _ = LAWS["linear"].under_axial_load
    with pytest.raises(InputError, match="has no form in two directions"):
        _ = LAWS["dynamic_stiffness"].in_plan


def test_extension_is_along_x(devices, draw):
    """Across x the law is symmetric, with the mean of the two stiffnesses."""
    device = devices["improved_bouc_wen-table_4"]
    law = device.law.in_plan
    parameters = device.parameters_at(0.5)
    values = dict(zip(law.parameter_names, parameters, strict=True))
    for y in (-0.003, 0.002):
        forces, _ = law.respond((0.0, y), (0.0, 0.0), (0.0, 0.0), parameters)
        assert forces[1] == pytest.approx(values["k"] * (1 - values["d"] / 2) * y)
    for sign in (1, -1):
        forces, rates = law.respond(
            (1e-3, sign * 2e-3), (0.02, sign * 0.05), (0.3, sign * 0.4), parameters
        )
        first = (forces[0], sign * forces[1]), (rates[0], sign * rates[1])
        if sign == 1:
            expected = first
    np.testing.assert_allclose(first, expected)
