"""Lyapunov's direct method."""

import numpy as np
import pytest

from controllers import controller
from controllers.clipped_lqr import linear_model
from controllers.observers import KalmanFilter
from isolation_sim.simulation.run import simulate

from .conftest import context_of


def state_matrix(isolated):
    _, linear = linear_model(isolated, np.array([1.5]))
    n, inverse = linear.n_dofs, np.linalg.inv(linear.mass)
    lower = -inverse @ np.hstack([linear.stiffness, linear.damping])
    return np.vstack([np.eye(n, 2 * n, k=n), lower]), inverse


def test_energy_falls_as_the_squared_outputs_do(isolated):
    """Along free motion of the linear structure, energy lost is the integral of the outputs."""
    from scipy.linalg import expm

    one = controller("lyapunov", largest_displacement=0.1, largest_acceleration=np.inf)
    rows = one.energy_rows(context_of(one, isolated), np.array([1.5]))
    a, inverse = state_matrix(isolated)
    # energy's derivative along the base's velocity, from the energy left to come
    h, z, push = 1e-3, np.zeros(12), np.zeros(12)
    z[:6], push[6:] = 0.02, -inverse[:, 0]
    step = expm(a * h)

    def energy(start):
        path, total = start, 0.0
        for k in range(60000):
            total += (0.5 if k == 0 else 1.0) * h * (path[0] / 0.1) ** 2
            path = step @ path
        return total / 2

    slope = (energy(z + 1e4 * push) - energy(z - 1e4 * push)) / 2e4
    assert float(rows[0] @ z) == pytest.approx(slope, rel=1e-3)


def test_current_is_whichever_lets_the_energy_fall_faster(isolated, record):
    one = controller("lyapunov", softening=0.0)
    run = simulate(isolated, record, one)
    context = context_of(one, isolated)
    names = one.measures(isolated)
    # the currents before each decision, as the sensors give them
    before = np.vstack([[[0.0]], run.command[:-1]])
    seen = np.column_stack([*(run.output(name) for name in names)])
    jump = isolated.elements[0].device
    states = run.states[:, 0].T
    x, v = run.output("isolator_deformation_m"), run.output("isolator_velocity_m_s")
    forces = [jump.force(x, v, tuple(states), i) for i in (before[:, 0], run.current[:, 0])]
    # outputs at a sample are those just after the command; the sensors' are just before
    seen[:, 0] += (forces[1] - forces[0]) / isolated.structure.mass[0, 0]
    result = KalmanFilter(isolated, 0.02, limits=(context.low, [3.0]), jump=0.0).run(
        np.hstack([seen, before])
    )
    rise = (
        np.hstack([result.displacement, result.velocity])
        @ one.energy_rows(context, np.array([1.5]))[0]
    )
    followed = tuple(result.device_states[:, 0].T)
    change = rise * (jump.force(x, v, followed, 3.0) - jump.force(x, v, followed, 0.0))
    expected = np.where(change < 0, 3.0, 0.0)
    clear = np.abs(change) > 1e-6 * np.abs(change).max()
    assert np.array_equal(run.command[:-1][clear[:-1], 0], expected[:-1][clear[:-1]])
    assert 0.05 < np.mean(expected > 0) < 0.95


def test_softening_leads_in_by_proportion(isolated, record):
    hard = simulate(isolated, record, controller("lyapunov", softening=0.0)).command[:, 0]
    soft = simulate(isolated, record, controller("lyapunov", softening=50.0)).command[:, 0]
    assert set(hard) <= {0.0, 3.0}
    assert np.mean((soft > 0.01) & (soft < 2.99)) > 0.2
