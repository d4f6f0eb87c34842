"""The clipped regulator and what it is made of."""

from dataclasses import replace

import numpy as np
import pytest

import isolation_sim as iso
from controllers import CurrentMap, controller
from controllers.clipped_lqr import gain_by_newton, linear_model, regulator_gain
from controllers.device_model import DeviceModel
from controllers.device_states import SCRATCH, follow_states
from isolation_sim.errors import InputError
from isolation_sim.laws import law
from isolation_sim.laws.hybrid import condition
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import plan_building, reference_building, reference_isolators

from .conftest import both_forms, context_of


def smooth_measurements(nominal, n_steps, period, seed=0):
    """Displacements that sway, their velocities, and coil currents."""
    rng = np.random.default_rng(seed)
    n, t = nominal.structure.n_dofs, np.arange(n_steps) * period
    size, omega, phase = rng.uniform(0.01, 0.1, n), rng.uniform(2, 8, n), rng.uniform(0, 6, n)
    q = size * (np.sin(omega * t[:, None] + phase) - np.sin(phase))
    p = size * omega * np.cos(omega * t[:, None] + phase)
    return np.hstack([q, p, rng.uniform(0, 3, (n_steps, nominal.n_channels))])


def mixed():
    """Three isolators of two laws on two coils, and a spring that no coil drives."""
    stiffening = reference_isolators().scaled(force=0.3)
    hybrid = reference_isolators(law("hybrid")).scaled(force=0.3)
    isolated = reference_building().with_element(stiffening, "base", 0, "a")
    isolated = isolated.with_element(hybrid, "base", 1, "b")
    isolated = isolated.with_element(stiffening, "base", 1, "c")
    return isolated.with_element(law("linear", {"k": 1e5}), "base", None, "d")


BELIEFS = {
    "tabulated": lambda: reference_building().on(condition(8, 1).scaled(length=10, force=3000)),
    "linear": lambda: reference_building().on(law("linear", {"k": (5e6, 3e6)})),
    "mixed": mixed,
}


@pytest.mark.parametrize("which", BELIEFS)
def test_both_forms_agree_for_other_laws(which):
    nominal = BELIEFS[which]()
    one = controller("clipped_lqr")
    context = context_of(one, nominal)
    plain, fast = both_forms(one, context, smooth_measurements(nominal, 60, 0.02))
    # where the nearest force is an extremum, the current there is found to the root of rounding
    assert np.abs(plain - fast).max() <= (1e-9 if which in ("linear", "mixed") else 1e-7)
    assert plain.shape == (60, nominal.n_channels)
    assert np.all((plain >= 0) & (plain <= 3)) and np.ptp(plain) > 1


def test_the_gain_is_that_of_the_riccati_equation_with_the_cross_weight():
    import control

    rng = np.random.default_rng(0)
    a, b = rng.standard_normal((6, 6)), rng.standard_normal((6, 2))
    outputs, through = rng.standard_normal((8, 6)), rng.standard_normal((8, 2))
    weights = outputs.T @ outputs, np.eye(2) + through.T @ through, outputs.T @ through
    expected, _, _ = control.lqr(a, b, *weights)
    np.testing.assert_allclose(regulator_gain(a, b, *weights), expected, rtol=1e-8, atol=1e-10)


def test_a_regulator_that_hardly_spares_force_is_designed_all_the_same():
    """With the cross weight in it, this Riccati equation cannot be solved accurately."""
    stiff = reference_building().on(law("linear", {"k": (5e6, 3e6)}))
    one = controller("clipped_lqr", largest_acceleration=0.1037, largest_force=0.402,
                     largest_displacement=1.305, largest_velocity=0.8051)  # fmt: skip
    reference = np.array([2.16])
    _, linear = linear_model(stiff, reference)
    gains = one.force_gains(stiff, reference)[0]
    device = stiff.elements[0].device.linearised(2.16, 0.5)
    # the isolator gives way to the wanted force: what is left of its own is in the linear model
    expected = gains - np.concatenate([device.real * stiff.elements[0].direction, np.zeros(6)])
    n, inverse = linear.n_dofs, np.linalg.inv(linear.mass)
    lower = -inverse @ np.hstack([linear.stiffness, linear.damping])
    lower -= inverse @ np.outer(stiff.elements[0].direction, expected)
    a = np.vstack([np.eye(n, 2 * n, k=n), lower])
    assert np.linalg.eigvals(a).real.max() < -0.1


def test_beats_the_constant_current_that_moves_the_base_as_far(isolated, el_centro):
    def peaks(one):
        run = simulate(isolated, el_centro, one)
        accelerations = [run.output(f"{q}_acceleration_m_s2") for q in isolated.structure.names]
        return np.abs(run.output("base_displacement_m")).max(), np.abs(accelerations).max()

    base, acceleration = peaks(controller("clipped_lqr", preset="published"))
    constants = [peaks(controller("constant", amperes=i)) for i in np.linspace(0, 3, 61)]
    same = min(constants, key=lambda p: abs(p[0] - base))
    assert acceleration < 0.98 * same[1]


def test_device_states_follow_the_plant(isolated, record):
    one = controller("clipped_lqr")
    run = simulate(isolated, record, one.in_python())
    twin = one.in_python()
    simulate(isolated, record, twin)
    n_states = 2
    followed = twin._step.memory[6 : 6 + n_states]
    # the last decision is one interval before the end
    peak = np.abs(run.states[:, 0]).max(axis=0)
    assert np.all(np.abs(followed - run.states[-2, 0]) <= 2e-3 * peak)


def test_target_force_is_mapped_by_the_nominal_model(isolated):
    one = controller("clipped_lqr")
    context = context_of(one, isolated)
    measured = smooth_measurements(isolated, 30, 0.02)
    device = isolated.elements[0].device
    gains = one.force_gains(isolated, np.array([1.5]))
    one.reset(context)
    for k, row in enumerate(measured):
        command = one.current(0.02 * k, row)[0]
        states = one._step.memory[6:8].tolist()
        mapped = CurrentMap(device, 0, 3)(float(gains[0] @ row[:-1]), row[0], row[6], states)
        assert command == pytest.approx(mapped.current, abs=1e-9)


def test_gain_is_that_of_a_regulator(isolated):
    """Bryson's weights on one output alone, against the Riccati equation written out."""
    from scipy.linalg import solve_continuous_are

    one = controller(
        "clipped_lqr", largest_displacement=0.1, largest_velocity=np.inf,
        largest_acceleration=np.inf, largest_force=0.1,
    )  # fmt: skip
    frequency, linear = linear_model(isolated, np.array([1.5]))
    n, inverse = linear.n_dofs, np.linalg.inv(linear.mass)
    a = np.block([
        [np.zeros((n, n)), np.eye(n)],
        [-inverse @ linear.stiffness, -inverse @ linear.damping],
    ])  # fmt: skip
    b = np.zeros((2 * n, 1))
    b[n:, 0] = -inverse[:, 0]
    q = np.zeros((2 * n, 2 * n))
    q[0, 0] = 1 / 0.1**2
    unit = 0.1 * linear.total_mass * 9.80665
    p = solve_continuous_are(a, b * unit, q, np.eye(1))
    gain = unit * (unit * b.T @ p)
    k = isolated.elements[0].device.linearised(1.5, frequency)
    passive = np.zeros(2 * n)
    passive[0], passive[n] = k.real, k.imag / (2 * np.pi * frequency)
    gains = one.force_gains(isolated, np.array([1.5]))
    assert np.allclose(gains[0], passive - gain[0], rtol=1e-6, atol=1e-6 * np.abs(gains).max())
    assert frequency == pytest.approx(0.5, rel=0.05)


@pytest.mark.parametrize("alpha", [5e9, 5e13])
def test_following_is_accurate_and_stable_however_stiff(alpha):
    device = law("strain_stiffening").with_parameters(alpha=(alpha,))
    model, h, x = DeviceModel([device]), 0.1, 8e-3
    states, work = np.zeros(2), np.zeros(SCRATCH * 2)
    row = model.numbers[: model.n_numbers]
    from scipy.integrate import solve_ivp

    follow_states(0, (0.0, 0.0), (x, 0.0), h, states, 1.0, row, work, model.state_rates)

    def rates(t, s):
        tau = t / h
        deformation, velocity = x * tau**2 * (3 - 2 * tau), x * 6 * tau * (1 - tau) / h
        return device.rates(deformation, velocity, tuple(s), 1.0)

    exact = solve_ivp(rates, (0, h), [0, 0], method="Radau", rtol=1e-10, atol=1e-14).y[:, -1]
    assert np.allclose(states, exact, rtol=1e-3, atol=1e-9)


@pytest.mark.parametrize("name", ["clipped_lqr", "on_off", "best_constant"])
def test_an_unlimited_supply_is_used_from_0_A_to_what_was_tested(name, record):
    device = replace(law("linear", {"k": (5e6, 3e6)}), tested_current=2.0)
    run = simulate(reference_building().on(device), record, controller(name))
    assert run.command.min() >= 0 and run.command.max() <= 2
    assert run.command.max() > 0 or name == "best_constant"


def test_needs_a_coil():
    nominal = reference_building().on(law("linear", {"k": 1e7}))
    one = controller("clipped_lqr")
    with pytest.raises(InputError, match="no element of the nominal model is driven by a coil"):
        one.reset(context_of(one, nominal))


def test_isolators_that_move_a_plan_building_alike_are_designed_all_the_same():
    """Eight forces of three independent ones: the solver by invariant subspaces fails."""
    stiff = np.array([420e6, 380e6, 330e6, 270e6, 190e6])
    building = plan_building(
        [320e3, 300e3, 280e3, 260e3, 180e3], stiff, stiff - [1e8, 1e8, 1e8, 1e8, 8e7],
        base_mass=350e3, plan=(24.0, 15.0), damping_ratio=0.03, eccentricity=(1.2, 0.0),
        isolator_positions=[[-12, -7.5], [12, -7.5], [-12, 7.5], [12, 7.5]],
    )  # fmt: skip
    isolated = building.on(law("strain_stiffening").scaled(length=25, force=400), biaxial=True)
    gains = controller("clipped_lqr").force_gains(isolated, np.array([1.5]))
    assert gains.shape == (8, 36) and np.isfinite(gains).all()


def test_newtons_gain_is_that_of_the_riccati_equation():
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal((6, 6)) - 4 * np.eye(6), rng.standard_normal((6, 2))
    outputs, through = rng.standard_normal((8, 6)), rng.standard_normal((8, 2))
    weights = outputs.T @ outputs, np.eye(2) + through.T @ through, outputs.T @ through
    np.testing.assert_allclose(
        gain_by_newton(a, b, *weights), regulator_gain(a, b, *weights), rtol=1e-8, atol=1e-10
    )
    with pytest.raises(ValueError, match="not stable"):
        gain_by_newton(-a, b, *weights)


def test_a_design_that_fails_leaves_the_other_controllers(isolated, record):
    impossible = controller("clipped_lqr", largest_acceleration=1e-9, largest_force=1e9)
    result = iso.compare(isolated, record, ["passive_off", impossible])
    assert list(result.runs) == ["passive_off"]
    assert "largest_acceleration = 1e-09" in result.failures()[0]
