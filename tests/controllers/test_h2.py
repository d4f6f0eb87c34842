"""The H2 design and its sampled form."""

import control
import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov
from scipy.signal import cont2discrete

from controllers import CurrentMap, controller

from .conftest import context_of


@pytest.fixture(scope="module")
def design(isolated):
    one = controller("h2", preset="published")
    plant, unit, linear = one.plant(isolated, np.array([1.5]), 0.02)
    return plant, unit, linear, plant.controller()


def norm(plant, k):
    """H2 norm of the loop, from its Lyapunov equation alone."""
    a = np.block([
        [plant.a, plant.b2 @ k.C],
        [k.B @ plant.c2, k.A + k.B @ plant.d22 @ k.C],
    ])  # fmt: skip
    b = np.vstack([plant.b1, k.B @ plant.d21])
    c = np.hstack([plant.c1, plant.d12 @ k.C])
    if np.linalg.eigvals(a).real.max() >= 0:
        return np.inf
    return float(np.sqrt(np.trace(c @ solve_continuous_lyapunov(a, -b @ b.T) @ c.T)))


def test_no_neighbour_is_better(design):
    plant, _, _, k = design
    best, rng = norm(plant, k), np.random.default_rng(0)
    for _ in range(60):
        factors = [1 + 0.02 * rng.standard_normal(m.shape) for m in (k.A, k.B, k.C)]
        # entries are changed in modal coordinates, in which all matter alike
        poles, shapes = np.linalg.eig(k.A)
        inverse = np.linalg.inv(shapes)
        other = control.ss(
            (shapes @ np.diag(poles * factors[0].diagonal()) @ inverse).real,
            k.B * factors[1], k.C * factors[2], k.D,
        )  # fmt: skip
        assert norm(plant, other) > best


def test_norm_is_the_sum_of_both_problems_optima(design):
    """Doyle et al. 1989: the cost of full information plus that of estimating the gain's output."""
    plant, _, _, k = design
    gain = -k.C
    held = plant.a - plant.b2 @ gain
    outputs = plant.c1 - plant.d12 @ gain
    regulated = solve_continuous_lyapunov(held.T, -outputs.T @ outputs)
    text = plant.a - k.B @ plant.c2
    noise = plant.b1 - k.B @ plant.d21
    error = solve_continuous_lyapunov(text, -noise @ noise.T)
    weight = plant.d12.T @ plant.d12
    total = np.trace(plant.b1.T @ regulated @ plant.b1) + np.trace(weight @ gain @ error @ gain.T)
    assert norm(plant, k) == pytest.approx(np.sqrt(total), rel=1e-6)


def test_feedback_helps_the_linear_structure(design):
    plant, _, _, k = design
    idle = control.ss(-np.eye(1), np.zeros((1, len(plant.c2))), np.zeros((1, 1)), k.D)
    assert norm(plant, k) < 0.9 * norm(plant, idle)


def test_target_force_is_the_sampled_controllers(isolated, design):
    _, unit, linear, k = design
    one = controller("h2", preset="published")
    context = context_of(one, isolated)
    one.reset(context)
    a, b, c, d, _ = cont2discrete((k.A, k.B, k.C, k.D), 0.02, "bilinear")
    rng, device = np.random.default_rng(2), isolated.elements[0].device
    state, t = np.zeros(len(a)), np.arange(30) * 0.02
    motion = np.column_stack([0.05 * np.sin(3 * t), 0.15 * np.cos(3 * t)])
    for i, moment in enumerate(t):
        y = rng.standard_normal(6)
        current = one.current(moment, np.concatenate([y, motion[i], [1.0]]))[0]
        expected = linear.passive[0] @ motion[i] + unit * float((c @ state + d @ y)[0])
        state = a @ state + b @ y
        states = one._step.memory[2 * len(a) + 6 :][:2]
        mapped = CurrentMap(device, 0, 3)(expected, *motion[i], states.tolist())
        assert current == pytest.approx(mapped.current, abs=1e-8)
