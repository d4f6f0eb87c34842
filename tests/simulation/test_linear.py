"""Linear plants against the matrix exponential, with the ground linear between samples."""

import numpy as np
import pytest
from scipy.linalg import expm

from ground_motions import Record
from isolation_sim.laws import law
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import (
    Element,
    IsolatedStructure,
    from_matrices,
    reference_building,
    shear_building,
)


def exact_response(mass, damping, stiffness, influence, ground, dt):
    """Displacements and velocities at the samples, (n_samples, 2 n)."""
    n, g = influence.shape
    inverse = np.linalg.inv(mass)
    system = np.zeros((2 * n + 2 * g, 2 * n + 2 * g))
    system[:n, n : 2 * n] = np.eye(n)
    system[n : 2 * n, :n] = -inverse @ stiffness
    system[n : 2 * n, n : 2 * n] = -inverse @ damping
    system[n : 2 * n, 2 * n : 2 * n + g] = -influence
    system[2 * n : 2 * n + g, 2 * n + g :] = np.eye(g)
    step = expm(system * dt)[: 2 * n]
    response = np.zeros((len(ground), 2 * n))
    for k in range(len(ground) - 1):
        slope = (ground[k + 1] - ground[k]) / dt
        response[k + 1] = step @ np.concatenate([response[k], ground[k], slope])
    return response


def exact_with_isolator(structure, k, c, record):
    base = np.zeros((structure.n_dofs,) * 2)
    base[0, 0] = 1.0
    return exact_response(
        structure.mass, structure.damping + c * base, structure.stiffness + k * base,
        structure.influence, record.acceleration[:, None], record.dt,
    )  # fmt: skip


def spring_and_dashpot(k, c):
    return law("kelvin_voigt", parameters={"k": k, "c": c})


def test_linear_isolator_is_exact(el_centro, no_coil, motion, worst):
    structure = reference_building()
    device = law("linear", parameters={"k": 600.0}).scaled(length=10, force=2.5e5)
    run = simulate(structure.on(device), el_centro, no_coil)
    exact = exact_with_isolator(structure, 600.0 * 2.5e5 / 10, 0.0, el_centro)
    assert worst(motion(run), exact) < 1e-9


def test_spring_and_dashpot_to_a_tight_tolerance(el_centro, no_coil, motion, worst):
    structure = reference_building()
    device = spring_and_dashpot(600.0, 100.0).scaled(length=10, force=2.5e5)
    run = simulate(structure.on(device), el_centro, no_coil, tolerance=1e-11)
    exact = exact_with_isolator(structure, 1.5e7, 2.5e6, el_centro)
    assert worst(motion(run), exact) < 1e-9


def test_spring_and_dashpot_at_the_default_tolerance(el_centro, no_coil, motion, worst):
    structure = reference_building()
    run = simulate(structure.on(spring_and_dashpot(1.5e7, 2.5e6)), el_centro, no_coil)
    assert worst(motion(run), exact_with_isolator(structure, 1.5e7, 2.5e6, el_centro)) < 5e-6


@pytest.mark.parametrize("ratio", [1.0, 1.0 + 1e-9, 5.0, 300.0])
def test_overdamped_structure(ratio, strong_motion, no_coil, motion, worst):
    """Real eigenvalues; at a ratio of one they coincide and have one eigenvector."""
    m, k = 1e5, 4e6
    structure = from_matrices([[m]], [[2 * ratio * np.sqrt(k * m)]], [[k / 2]])
    isolated = structure.on(spring_and_dashpot(k / 2, 0.0))
    run = simulate(isolated, strong_motion, no_coil, tolerance=1e-11)
    exact = exact_with_isolator(structure, k / 2, 0.0, strong_motion)
    assert worst(motion(run), exact) < 1e-9


def test_base_held_by_a_dashpot_alone(strong_motion, no_coil, motion, worst):
    """The stiffness is singular: the building may be pushed anywhere."""
    structure = reference_building()
    isolated = structure.on(spring_and_dashpot(0.0, 3e6))
    run = simulate(isolated, strong_motion, no_coil, tolerance=1e-11)
    exact = exact_with_isolator(structure, 0.0, 3e6, strong_motion)
    assert worst(motion(run), exact) < 1e-9


def test_forty_storeys(el_centro, no_coil, motion, worst):
    """Stiffness-proportional damping makes the highest modes overdamped."""
    structure = shear_building(
        [3e5] * 40, np.linspace(9e8, 2e8, 40), base_mass=5e5, damping_ratio=0.05
    )
    run = simulate(structure.on(spring_and_dashpot(3e7, 0.0)), el_centro, no_coil)
    exact = exact_with_isolator(structure, 3e7, 0.0, el_centro)
    assert worst(motion(run), exact) < 1e-9


def two_way_building():
    """Three floors, alike in x and y: every eigenvalue is there twice."""
    one = shear_building([2e5] * 2, [1e8] * 2, base_mass=2.5e5, damping_ratio=0.03)
    both = [np.kron(m, np.eye(2)) for m in (one.mass, one.damping, one.stiffness)]
    return from_matrices(*both, influence=np.kron(np.ones((3, 1)), np.eye(2)), base=(0, 1))


def test_alike_in_both_directions(el_centro, strong_motion, no_coil, motion, worst):
    """Springs in x, in y, and along the diagonal of the roof, where they couple both."""
    structure = two_way_building()
    other = Record(el_centro.acceleration[400:601], 0.02)
    diagonal = np.array([0, 0, 0, 0, 0.6, 0.8])
    for k_diagonal in (0.0, 3e6):
        isolated = structure.on(spring_and_dashpot(1.5e7, 0.0)).with_element(
            spring_and_dashpot(k_diagonal, 0.0), diagonal
        )
        run = simulate(isolated, [strong_motion, other], no_coil, tolerance=1e-10)
        stiffness = structure.stiffness + k_diagonal * np.outer(diagonal, diagonal)
        stiffness[[0, 1], [0, 1]] += 1.5e7
        ground = np.stack([strong_motion.acceleration, other.acceleration], axis=1)
        exact = exact_response(
            structure.mass, structure.damping, stiffness, structure.influence, ground, 0.02
        )
        assert worst(motion(run), exact) < 1e-9


def test_two_channels_and_an_element_on_none(el_centro, strong_motion, scheduled, motion, worst):
    """Springs in x and y follow their own channels, the roof's follows none."""
    structure = two_way_building()
    other = Record(el_centro.acceleration[400:601], 0.02)
    spring = law("kelvin_voigt", parameters={"k": (1e7, 4e6), "c": (0.0, 0.0)})
    roof = np.array([0, 0, 0, 0, 0.6, 0.8])
    isolated = IsolatedStructure(
        structure,
        (
            Element(spring, np.eye(6)[0], 1, "x"),
            Element(spring, np.eye(6)[1], 0, "y"),
            Element(spring_and_dashpot(2e6, 0.0), roof, None, "roof"),
        ),
    )
    run = simulate(isolated, [strong_motion, other], scheduled([[0.5, 2.0]]), tolerance=1e-10)
    stiffness = structure.stiffness + 2e6 * np.outer(roof, roof)
    stiffness[0, 0] += 1e7 + 4e6 * 2.0
    stiffness[1, 1] += 1e7 + 4e6 * 0.5
    ground = np.stack([strong_motion.acceleration, other.acceleration], axis=1)
    exact = exact_response(
        structure.mass, structure.damping, stiffness, structure.influence, ground, 0.02
    )
    assert worst(motion(run), exact) < 1e-9
    np.testing.assert_array_equal(run.current, np.tile([0.5, 2.0], (len(run.time), 1)))
