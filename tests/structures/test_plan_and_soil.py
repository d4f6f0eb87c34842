"""Buildings in plan, the weight on isolators, and soil springs, against hand calculation."""

from __future__ import annotations

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import STANDARD_GRAVITY, el_centro_1940
from isolation_sim.errors import InputError
from isolation_sim.laws import LAWS, law
from isolation_sim.simulation.plausibility import overturned_by_more
from isolation_sim.structures import (
    cones,
    load_change_rows,
    on_soil,
    overturning_rows,
    plan_building,
    shear_building,
    with_p_delta,
    with_vertical_motion,
)

STOREYS = {"base_mass": 3e5, "plan": (20.0, 12.0), "heights": [3.0, 3.0]}


def building(**changes):
    return plan_building([2e5, 2e5], [3e8, 2e8], [2e8, 1e8], **STOREYS | changes)


def test_a_symmetric_plan_is_two_shear_buildings():
    two = building().fixed_base_periods()
    x = shear_building([2e5, 2e5], [3e8, 2e8], base_mass=3e5).fixed_base_periods()
    y = shear_building([2e5, 2e5], [2e8, 1e8], base_mass=3e5).fixed_base_periods()
    for period in (*x, *y):
        assert np.abs(two / period - 1).min() < 1e-12
    # the rest rotate: k (a/2)^2 about m (a^2 + b^2) / 12
    assert building().total_mass == pytest.approx(7e5)


def test_eccentric_mass_couples_translation_and_rotation():
    """One rigid slab on four springs: a 3 x 3 eigenproblem written by hand."""
    structure = plan_building(
        [1.0], [1e9], [1e9], base_mass=6e5, plan=(20.0, 12.0), eccentricity=(1.5, 0.0)
    )
    k = 1e6
    device = law("linear", {"k": 4 * k})
    periods = structure.on(device, biaxial=True).periods()[:3]
    m, e, r2 = 6e5, 1.5, (20.0**2 + 12.0**2) / 12
    stiffness = np.diag([4 * k, 4 * k * (10.0**2 + 6.0**2)])
    mass = m * np.array([[1, e], [e, r2 + e * e]])
    coupled = 2 * np.pi / np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, stiffness)))
    expected = sorted([*coupled, 2 * np.pi * np.sqrt(m / (4 * k))], reverse=True)
    np.testing.assert_allclose(periods, expected, rtol=1e-4)


def test_p_delta_lengthens_the_period():
    structure = shear_building([1.0], [1e9], base_mass=5e5)
    k, height = 2e7, 0.4
    period = with_p_delta(structure, height).on(law("linear", {"k": k})).periods()[0]
    left = k - 5e5 * 9.80665 / height
    assert period == pytest.approx(2 * np.pi * np.sqrt(5e5 / left), rel=1e-4)
    with pytest.raises(InputError, match="p_delta_height_m: given 0"):
        with_p_delta(structure, 0.0)


def test_p_delta_on_soil_acts_between_base_and_foundation():
    k, height, foundation = 2e7, 0.4, 2e5
    soil = cones(6.0, 120.0, 1800.0, 0.3)
    structure = shear_building([1.0], [1e9], base_mass=5e5)
    device = law("linear", {"k": k})
    built = on_soil(with_p_delta(structure, height).on(device), soil, foundation)
    across = np.array([[1.0, -1.0], [-1.0, 1.0]])
    left = k - 5e5 * 9.80665 / height
    stiffness = left * across + np.diag([0.0, soil.sway_stiffness])
    squared = np.linalg.eigvals(np.linalg.solve(np.diag([5e5, foundation]), stiffness))
    expected = 2 * np.pi / np.sqrt(squared.real.min())
    assert built.periods()[0] == pytest.approx(expected, rel=1e-4)
    # the order does not matter: the weight is that above the isolators
    later = with_p_delta(on_soil(structure.on(device), soil, foundation).structure, height)
    np.testing.assert_allclose(later.stiffness, built.structure.stiffness, rtol=1e-12)
    assert built.structure.fixed_base().p_delta == 0.0


def test_overturning_balances_the_moment():
    structure = building()
    rows = overturning_rows(structure)
    # pushed along x by unit drifts: storey shears 3e8 and 2e8 over 3 m each
    q = np.zeros(9)
    q[[3, 6]] = 1.0, 2.0
    load = structure.total_mass * 9.80665 / 4
    change = load * rows @ q
    assert change.sum() == pytest.approx(0.0, abs=1e-3)
    moment = change @ structure.isolator_positions[:, 0]
    assert moment == pytest.approx(3.0 * (3e8 + 2e8))
    assert change @ structure.isolator_positions[:, 1] == pytest.approx(0.0, abs=1e-2)
    # rigid motion loads nothing
    rigid = structure.influence[:, 0]
    assert np.abs(rows @ rigid).max() < 1e-9


def test_cones_have_the_static_stiffness_of_a_disk():
    """G = rho v^2; 8 G r / (2 - nu) and 8 G r^3 / (3 (1 - nu)) for a disk on a half-space."""
    radius, v, density = 9.0, 250.0, 1900.0
    for poisson in (0.0, 0.25, 1 / 3, 0.45):
        soil, shear = cones(radius, v, density, poisson), density * v**2
        assert soil.sway_stiffness == pytest.approx(8 * shear * radius / (2 - poisson))
        rocking = 8 * shear * radius**3 / (3 * (1 - poisson))
        assert soil.rocking_stiffness == pytest.approx(rocking)
        assert soil.sway_damping == pytest.approx(density * v * np.pi * radius**2)
    assert cones(radius, v, density, 0.25).trapped_inertia == 0.0
    with pytest.raises(InputError, match=r"poisson_ratio: given 0\.6"):
        cones(radius, v, density, 0.6)


def test_stiff_soil_is_rigid_ground_and_soft_soil_is_a_spring_in_series():
    structure = shear_building([2e5], [4e8], base_mass=3e5, heights=[3.0])
    isolated = structure.on(law("linear", {"k": 5e6}))
    rigid = isolated.periods()[0]
    stiff = on_soil(isolated, cones(8.0, 5e4, 2000.0, 0.3), 1e5, 1e6)
    assert stiff.structure.names[-2:] == ("foundation_x", "rocking_x")
    assert stiff.periods()[0] == pytest.approx(rigid, rel=1e-4)
    soft = cones(8.0, 20.0, 1800.0, 0.3)
    period = on_soil(isolated, soft, 1.0, 1.0).periods()[0]
    # flexibilities of base and floor: isolators, sway, and above them rocking and the storey
    below = 1 / 5e6 + 1 / soft.sway_stiffness
    above = 3.0**2 / soft.rocking_stiffness + 1 / 4e8
    flexibility = np.array([[below, below], [below, below + above]])
    longest = np.linalg.eigvals(flexibility @ np.diag([3e5, 2e5])).max()
    assert period == pytest.approx(2 * np.pi * np.sqrt(longest), rel=1e-4)
    assert period > 1.05 * rigid
    assert on_soil(isolated, soft, 1e5, 1e6).fixed_base().structure.n_dofs == 1


def test_a_run_on_soil():
    structure = shear_building([2e5], [4e8], base_mass=3e5, heights=[3.0])
    plant = on_soil(
        structure.on(law("linear", {"k": 5e6})), cones(8.0, 150.0, 1800.0, 0.3), 1e5, 1e6
    )
    run = iso.simulate(plant, el_centro_1940().cut(0, 8.0), "passive_off")
    # the foundation settles within a sample, between the points at which losses are summed
    assert run.energy.closure_error < 1e-5
    history = run.history
    extension = history.displacement.sel(dof="base") - history.displacement.sel(dof="foundation_x")
    np.testing.assert_allclose(extension, history.deformation[:, 0], atol=1e-12)


def test_vertical_motion_is_apart_from_soil_and_criteria():
    """On soft soil, with rocking: without vertical ground motion everything is as before."""
    soil = cones(10.0, 150.0, 1800.0, 0.4)
    device = law("friction_pendulum", dict(LAWS["friction_pendulum"].example))
    plain = building()
    moving = with_vertical_motion(plain, 0.1)
    assert moving.directions == ("x", "y", "z")
    assert moving.total_mass == plain.total_mass
    rows = load_change_rows(moving, overturning=True)
    np.testing.assert_allclose(rows[:, :-1], overturning_rows(plain), atol=1e-12)
    np.testing.assert_allclose(rows[:, -1], -((2 * np.pi / 0.1) ** 2) / STANDARD_GRAVITY)
    ground = el_centro_1940().cut(0.0, 3.0)
    runs = []
    for structure in (plain, moving):
        loads = load_change_rows(structure, overturning=True)
        isolated = structure.on(device.scaled(10, 500), biaxial=True, load_changes=loads)
        still = (ground.scaled(0.0),) * len(structure.vertical)
        runs.append(
            iso.simulate(on_soil(isolated, soil, 4e5, 1e7), (ground, ground.scaled(0.5), *still))
        )
    assert runs[1].criteria == pytest.approx(runs[0].criteria, rel=1e-6)
    with pytest.raises(InputError, match="moves horizontally"):
        with_vertical_motion(moving, 0.1)
    with pytest.raises(InputError, match="vertical_period_s: given"):
        with_vertical_motion(plain, 0.0)


def test_forces_in_storeys_that_the_overturning_lacks_are_warned_of():
    structure = building()
    numbers = {"W": 1e7, "R": 1.5, "mu_max": 0.08, "mu_min": 0.05, "a": 20.0, "u_y": 0.002}
    bearing = law("friction_pendulum", numbers | {"n": 2.0, "tau": 1.0})
    loads = load_change_rows(structure, overturning=True)
    isolated = structure.on(bearing, biaxial=True, load_changes=loads)
    assert not list(overturned_by_more(isolated))
    damper = law("kelvin_voigt", {"k": 0.0, "c": 2e7})
    (line,) = overturned_by_more(isolated.with_element(damper, structure.storeys[0], name="damper"))
    assert "those of damper are not in it" in line
