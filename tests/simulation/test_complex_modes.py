"""Complex modes reproduce the system that they were made of."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from isolation_sim.errors import InputError
from isolation_sim.simulation.complex_modes import complex_modes


def system(seed, n, damped, free):
    """Mass, damping, stiffness, influence and one element row of a random chain of masses."""
    rng = np.random.default_rng(seed)
    mass = np.diag(rng.uniform(1, 3, n) * 1e5)
    springs = rng.uniform(0.5, 2, n) * 1e7
    springs[0] *= 0.0 if free else 1.0
    stiffness = np.diag(springs + np.append(springs[1:], 0.0))
    stiffness -= np.diag(springs[1:], 1) + np.diag(springs[1:], -1)
    damping = damped * stiffness * 1e-2 + 1e3 * np.eye(n) * (not free)
    return mass, damping, stiffness, np.ones((n, 1)), np.eye(n)[:1]


@given(
    st.integers(0, 10**6), st.integers(1, 8), st.sampled_from([0.0, 0.3, 5.0]), st.booleans(),
    st.floats(1e6, 1e8),
)  # fmt: skip
@settings(deadline=None, max_examples=25)
def test_modes_are_the_state_matrix_taken_apart(seed, n, damped, free, reference):
    mass, damping, stiffness, influence, b = system(seed, n, damped, free)
    length, scale = 10.0, 250.0
    modes = complex_modes(
        mass, damping, stiffness, influence, b, np.array([length]), np.array([scale]),
        np.array([reference * length / scale]),
    )  # fmt: skip
    k = stiffness + b.T @ b * modes.stiffness[0] * scale / length
    c = damping + b.T @ b * modes.damping[0] * scale / length
    inverse = np.linalg.inv(mass)
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ k, -inverse @ c]])
    shapes, values = modes.shapes, modes.eigenvalues
    size = np.abs(values) * np.abs(shapes).max(0) + np.abs(shapes[n:]).max(0)
    assert np.all(np.abs(a @ shapes - shapes * values).max(0) < 1e-8 * np.abs(a).max() * size)
    zeros = np.zeros((n, 1))
    for inputs, columns in (
        (-np.concatenate([zeros, influence]), modes.ground),
        (-np.concatenate([zeros, inverse @ b.T * scale]), modes.force),
    ):
        made = (shapes @ columns.T).real
        np.testing.assert_allclose(made, inputs, atol=1e-7 * np.abs(inputs).max())
    moved = np.array([b @ shapes[:n], b @ shapes[n:]])[:, 0] / length
    np.testing.assert_allclose(modes.deformation[0], moved, rtol=1e-12)


def test_a_free_mass_with_an_element_gets_a_reference_that_holds_it():
    modes = complex_modes(
        np.array([[2e5]]), np.zeros((1, 1)), np.zeros((1, 1)), np.ones((1, 1)),
        np.ones((1, 1)), np.ones(1), np.ones(1), np.zeros(1),
    )  # fmt: skip
    assert modes.stiffness[0] > 0
    assert np.all(np.abs(modes.eigenvalues) > 0.1)


def test_a_free_mass_that_no_element_holds_is_refused():
    with pytest.raises(InputError, match="complete set of modes"):
        complex_modes(
            np.diag([2e5, 1e5]), np.zeros((2, 2)), np.diag([1e6, 0.0]), np.ones((2, 1)),
            np.array([[1.0, 0.0]]), np.ones(1), np.ones(1), np.zeros(1),
        )  # fmt: skip


def test_overdamped_modes_are_of_the_type_that_the_kernel_is_compiled_for():
    modes = complex_modes(
        np.array([[1e5]]), np.array([[1e7]]), np.array([[4e6]]), np.ones((1, 1)),
        np.ones((1, 1)), np.ones(1), np.ones(1), np.zeros(1),
    )  # fmt: skip
    assert modes.packed().dtype == complex
