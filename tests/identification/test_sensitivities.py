"""The compiled simulation under measured motion, and its derivatives, law by law."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from isolation_sim.identification.sensitivities import Motion, Simulator
from isolation_sim.laws import LAWS

N = 161


def motion_along(wave, currents=(0.5, 2.0)):
    """One run a current, at 5 ms."""
    time = 0.005 * np.arange(N)
    k = len(currents)
    return Motion(
        starts=N * np.arange(k + 1),
        displacement=np.tile(wave.displacement(time), k),
        velocity=np.tile(wave.velocity(time), k),
        current=np.repeat(currents, N),
        dt=np.full(k, 0.005),
    )


def simulator_of(name, numbers, motion, n_steps):
    """Simulator with two powers of the current a parameter, and its coefficients."""
    law = LAWS[name]
    theta = np.concatenate([numbers[name][q.name] for q in law.parameters])
    return Simulator(law, motion, 2, n_steps), theta


def relative(difference, reference):
    return np.sqrt(np.mean(difference**2) / np.mean(reference**2))


def test_numbers_for_every_registered_law(numbers):
    assert set(numbers) == set(LAWS)


@pytest.mark.parametrize("name", LAWS)
def test_force_is_that_of_an_independent_integration(name, numbers, wave, reference_force):
    motion = motion_along(wave)
    simulator, theta = simulator_of(name, numbers, motion, n_steps=16)
    force, none = simulator.run(theta, derivatives=False)
    assert none.shape == (0, len(theta))
    time = 0.005 * np.arange(N)
    cubic = CubicHermiteSpline(time, motion.displacement[:N], motion.velocity[:N])
    for k, current in enumerate((0.5, 2.0)):
        parameters = theta.reshape(-1, 2) @ [1.0, current]
        exact = reference_force(LAWS[name], parameters, cubic, cubic.derivative(), time, 1e-10)
        assert relative(force[k * N : (k + 1) * N] - exact, exact) < 1e-6


def integrated_between_corners(law, parameters, cubic, time):
    """Force by SciPy, from sample to sample and to each reversal and each zero between them."""
    corners = [piece.roots(extrapolate=False) for piece in (cubic, cubic.derivative())]
    knots = np.unique(np.concatenate([time, *corners]))

    def rates(t, s):
        return np.array(law.rates(cubic(t), cubic(t, 1), tuple(s), parameters), float)

    state = np.zeros(len(law.states))
    results = [state]
    for span in pairwise(knots):
        state = solve_ivp(rates, span, state, "DOP853", rtol=1e-11, atol=1e-16).y[:, -1]
        if span[1] in time:
            results.append(state)
    return law.force(cubic(time), cubic(time, 1), tuple(np.transpose(results)), parameters)


@pytest.mark.parametrize("name", ["bouc_wen", "improved_bouc_wen", "lugre", "dahl"])
def test_corners_of_yielding_laws_cost_no_accuracy(name, numbers, wave):
    motion = motion_along(wave, currents=(0.5,))
    time = 0.005 * np.arange(N)
    simulator, theta = simulator_of(name, numbers, motion, n_steps=1)
    cubic = CubicHermiteSpline(time, motion.displacement, motion.velocity)
    parameters = tuple(theta.reshape(-1, 2) @ [1.0, 0.5])
    exact = integrated_between_corners(LAWS[name], parameters, cubic, time)

    def worst(simulator):
        force = simulator.run(theta, derivatives=False)[0]
        return np.max(np.abs(force - exact)) / np.max(np.abs(exact))

    assert worst(simulator) < 5e-5
    for tolerance in (1e-5, 1e-6):
        resolved = simulator.resolved(theta, tolerance)
        assert worst(resolved) < tolerance
        assert resolved.n_steps.max() <= 8


@pytest.mark.parametrize("name", LAWS)
def test_derivatives_are_those_of_the_simulated_force(name, numbers, wave):
    simulator, theta = simulator_of(name, numbers, motion_along(wave), n_steps=2)
    force, jacobian = simulator.run(theta)
    np.testing.assert_allclose(force, simulator.run(theta, derivatives=False)[0], rtol=1e-12)
    for k in range(len(theta)):
        # a power's size is its parameter's, where the coefficient itself is zero
        step = np.zeros_like(theta)
        step[k] = 1e-4 * np.max(np.abs(theta[k - k % 2 : k - k % 2 + 2]))

        def shifted(times, step=step):
            return simulator.run(theta + times * step, derivatives=False)[0]

        slope = (8 * (shifted(1) - shifted(-1)) - (shifted(2) - shifted(-2))) / (12 * step[k])
        off = np.abs(slope - jacobian[:, k]) / np.sqrt(np.mean(jacobian[:, k] ** 2))
        # where a difference straddles a corner of the law it is none of the derivative
        assert np.quantile(off, 0.98) < 1e-6


@pytest.mark.parametrize("name", ["strain_stiffening", "bouc_wen", "linear"])
def test_runs_do_not_influence_each_other(name, numbers, wave):
    both, theta = simulator_of(name, numbers, motion_along(wave), n_steps=2)
    alone, _ = simulator_of(name, numbers, motion_along(wave, currents=(2.0,)), n_steps=2)
    for whole, part in zip(both.run(theta), alone.run(theta), strict=True):
        np.testing.assert_array_equal(whole[N:], part)


def test_steps_are_taken_as_the_law_needs_them(numbers, wave):
    motion = motion_along(wave)
    coarse, theta = simulator_of("bouc_wen", numbers, motion, n_steps=1)
    reference = simulator_of("bouc_wen", numbers, motion, n_steps=64)[0].run(theta)[0]
    for tolerance in (1e-3, 1e-5):
        resolved = coarse.resolved(theta, tolerance)
        assert relative(resolved.run(theta)[0] - reference, reference) < tolerance
    assert coarse.resolved(theta, 1e-6).n_steps.max() > coarse.n_steps.max()
    linear, theta = simulator_of("linear", numbers, motion, n_steps=1)
    assert linear.resolved(theta).n_steps.max() == 1


def test_every_run_has_its_own_steps(numbers, wave):
    """A run sampled a hundred times slower needs more steps where a law has a time scale."""
    fast = motion_along(wave)
    slow = replace(
        fast, velocity=np.concatenate([fast.velocity[:N], fast.velocity[N:] / 100]),
        dt=np.array([0.005, 0.5]),
    )  # fmt: skip
    coarse, theta = simulator_of("maxwell", numbers, slow, n_steps=1)
    resolved = coarse.resolved(theta, 1e-5)
    assert resolved.n_steps[1] >= 4 * resolved.n_steps[0]
    reference = simulator_of("maxwell", numbers, slow, n_steps=64)[0].run(theta)[0]
    assert relative(resolved.run(theta)[0] - reference, reference) < 1e-5


@pytest.mark.parametrize("name", ["kelvin_voigt", "strain_stiffening", "spencer"])
def test_a_steady_current_is_the_limit_of_one_that_moves(name, numbers, wave):
    steady = motion_along(wave)
    moved = steady.current * (1 + 1e-12 * np.sin(np.arange(len(steady.current))))
    simulator, theta = simulator_of(name, numbers, steady, n_steps=2)
    moving, _ = simulator_of(name, numbers, replace(steady, current=moved), n_steps=2)
    for one, other in zip(simulator.run(theta), moving.run(theta), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-7, atol=1e-9 * np.max(np.abs(one)))


def test_threads_may_share_a_simulator(numbers, wave):
    simulator, theta = simulator_of("maxwell", numbers, motion_along(wave), n_steps=2)
    alone = [simulator.run(k * theta) for k in (1.0, 2.0)]
    with ThreadPoolExecutor(2) as pool:
        together = list(pool.map(simulator.run, [theta, 2 * theta] * 8))
    for k, run in enumerate(together):
        for one, other in zip(run, alone[k % 2], strict=True):
            np.testing.assert_array_equal(one, other)


def test_steps_resolve_derivatives_where_the_force_is_bounded_by_itself():
    # a damper's values at which a fit ended: coarse steps give the force, and derivatives of 1e298
    law, frequency, dt = LAWS["spencer"], 0.25, 0.08
    time = dt * np.arange(200)
    omega = 2 * np.pi * frequency
    motion = Motion(
        starts=np.array([0, 200]), displacement=0.025 * np.cos(omega * time),
        velocity=-0.025 * omega * np.sin(omega * time), current=np.zeros(200), dt=np.array([dt]),
    )  # fmt: skip
    values = {"k0": 0.0, "c0": 1118.9, "k1": 1202.9, "c1": 24669.0, "x0": 6.3e-4, "F_y": 130.0,
              "rho": 16674.0, "sigma": 2.0, "n": 4.23}  # fmt: skip
    theta = np.array([values[q.name] for q in law.parameters])
    resolved = Simulator(law, motion).resolved(theta, 2e-4)
    finer = Simulator(law, motion, n_steps=4 * resolved.n_steps)
    force, jacobian = resolved.run(theta)
    finer_force, finer_jacobian = finer.run(theta)
    assert relative(force - finer_force, finer_force) < 1e-3
    assert relative((jacobian - finer_jacobian) * theta, finer_jacobian * theta) < 0.1


STIFF_LAWS = ["maxwell", "strain_stiffening", "bouc_wen"]


@pytest.mark.parametrize("name", STIFF_LAWS)
def test_rosenbrock_steps_converge_to_the_same_force(name, numbers, wave):
    motion = motion_along(wave)
    fine, theta = simulator_of(name, numbers, motion, n_steps=64)
    reference = fine.run(theta)
    steps = np.array([4, 4])
    errors = [
        [relative(one - exact, exact) for one, exact in zip(computed, reference, strict=True)]
        for computed in (fine.with_steps(k * steps, steps > 0).run(theta) for k in (1, 2))
    ]
    assert errors[1][0] < 1e-4
    assert errors[1][1] < 1e-2
    assert errors[1][0] < errors[0][0] / 4  # of third order


@pytest.mark.parametrize("name", STIFF_LAWS)
def test_derivatives_of_rosenbrock_steps(name, numbers, wave):
    simulator, theta = simulator_of(name, numbers, motion_along(wave), n_steps=2)
    simulator = simulator.with_steps(simulator.n_steps, np.array([True, True]))
    _, jacobian = simulator.run(theta)
    for k in range(len(theta)):
        step = np.zeros_like(theta)
        step[k] = 1e-4 * np.max(np.abs(theta[k - k % 2 : k - k % 2 + 2]))
        forces = [simulator.run(theta + t * step, False)[0] for t in (1, -1, 2, -2)]
        slope = (8 * (forces[0] - forces[1]) - (forces[2] - forces[3])) / (12 * step[k])
        off = np.abs(slope - jacobian[:, k]) / np.sqrt(np.mean(jacobian[:, k] ** 2))
        assert np.quantile(off, 0.98) < 1e-6


def stiff_maxwell(n_samples, relaxations):
    """Springs in series with dashpots of some relaxation times, s, a run each, at 10 ms."""
    law, dt = LAWS["maxwell"], 0.01
    runs = len(relaxations)
    time = np.tile(dt * np.arange(n_samples), runs)
    omega = 2 * np.pi * 1.3
    motion = Motion(
        starts=n_samples * np.arange(runs + 1), displacement=5e-3 * np.sin(omega * time),
        velocity=5e-3 * omega * np.cos(omega * time),
        current=np.repeat(np.arange(float(runs)), n_samples), dt=np.full(runs, dt),
    )  # fmt: skip
    dashpots = 2e4 * np.array(relaxations)
    powers = np.polynomial.polynomial.polyfit(np.arange(runs), dashpots, runs - 1)
    spring = [2e4] + [0.0] * (runs - 1)
    rows = [spring if q.name.startswith("k") else powers for q in law.parameters]
    return Simulator(law, motion, runs), np.concatenate(rows)


def test_few_steps_resolve_a_stiff_law():
    simulator, theta = stiff_maxwell(6000, (5e-5, 0.2))
    resolved = simulator.resolved(theta, 2e-4)
    assert resolved.stiff.tolist() == [True, False]
    assert resolved.n_steps.max() <= 8
    exact = Simulator(simulator.law, simulator.motion, simulator.n_powers, 512).run(theta)
    result = resolved.run(theta)
    assert np.max(np.abs(result[0] - exact[0])) < 2e-4 * np.max(np.abs(exact[0]))
    assert relative((result[1] - exact[1]) * theta, exact[1] * theta) < 1e-3
    # on few samples they are not worth their compilation, unless the others diverge
    diverging, theta = stiff_maxwell(600, (5e-5, 0.2))
    assert diverging.resolved(theta, 2e-4).stiff.tolist() == [True, False]
    few, theta = stiff_maxwell(600, (4e-4, 0.2))
    assert not few.resolved(theta, 2e-4).stiff.any()
    many, theta = stiff_maxwell(6000, (4e-4, 0.2))
    assert many.resolved(theta, 2e-4).stiff.tolist() == [True, False]


def test_a_run_that_diverges_does_not_set_the_steps_of_another():
    both, theta = stiff_maxwell(600, (3e-4, 0.03))
    slow = both.resolved(theta, 1e-6).n_steps[1]
    alone, theta = stiff_maxwell(600, (0.03,))
    assert slow == alone.resolved(theta, 1e-6).n_steps[0]
