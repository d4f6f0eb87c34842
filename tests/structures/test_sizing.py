"""Periods, damping and scales of isolated structures, against closed forms."""

import numpy as np
import pytest

import isolation_sim as iso
from isolation_sim.errors import InputError
from isolation_sim.simulation.run import fixed_base_run
from isolation_sim.structures import plan_building, yielding_storeys
from isolation_sim.structures.modes import translational_period
from isolation_sim.structures.plausibility import implausible
from isolation_sim.structures.sizing import middle_current

MASS, STIFFNESS, DAMPING = 3e5, 4e6, 2e5


@pytest.fixture(scope="module")
def slab():
    """A rigid mass: one degree of freedom once it stands on isolators."""
    return iso.from_matrices([[MASS]], [[0.0]], [[0.0]], name="slab")


def test_periods_and_damping_of_one_degree_of_freedom(slab):
    isolated = slab.on(iso.law("kelvin_voigt", {"k": STIFFNESS, "c": DAMPING}))
    omega = np.sqrt(STIFFNESS / MASS)
    assert isolated.periods() == pytest.approx([2 * np.pi / omega], rel=1e-9)
    assert isolated.damping_ratio() == pytest.approx(DAMPING / (2 * MASS * omega), rel=1e-9)


def test_modes_are_those_of_the_eigenvalue_problem():
    """Against SciPy on the assembled matrices."""
    from scipy.linalg import eigh

    isolated = iso.reference_building().on(iso.law("kelvin_voigt", {"k": 2e7, "c": 1e6}))
    structure = isolated.structure
    stiffness = structure.stiffness.copy()
    stiffness[0, 0] += 2e7
    squares, shapes = eigh(stiffness, structure.mass)
    modes = isolated.modes()
    np.testing.assert_allclose(modes.periods, 2 * np.pi / np.sqrt(squares), rtol=1e-9)
    np.testing.assert_allclose(np.abs(modes.shapes), np.abs(shapes), atol=1e-9)


def test_a_structure_that_stands_on_the_ground_is_refused():
    fixed = iso.from_matrices(np.eye(2) * 2e5, np.zeros((2, 2)), [[4e8, -2e8], [-2e8, 2e8]])
    with pytest.raises(InputError, match=r"below 0\.\d+ s, the period of .* lack the base's row"):
        fixed.on(iso.reference_isolators(), target_period_s=2.0)


@pytest.mark.parametrize("target", [1.5, 2.0, 3.2])
def test_a_target_period_is_met_at_the_middle_current(target):
    isolated = iso.reference_building().on(iso.law("strain_stiffening"), target_period_s=target)
    assert isolated.periods(1.5)[0] == pytest.approx(target, rel=1e-6)
    device = isolated.elements[0].device
    assert device.length * device.tested_deformation == pytest.approx(0.04 * target)


def test_a_design_displacement_and_a_damping_ratio_are_met(slab):
    device = iso.law("strain_stiffening")
    isolated = slab.on(device, target_period_s=2.5, design_displacement_m=0.2, damping=0.4)
    scaled = isolated.elements[0].device
    assert scaled.length * scaled.tested_deformation == pytest.approx(0.2)
    assert isolated.damping_ratio(1.5) == pytest.approx(0.4, rel=1e-6)
    assert isolated.element_names == ("isolator", "damper")


def lead_rubber(stiffness, strength, u_y):
    """A bilinear bearing, its corner as sharp as the law has it."""
    numbers = {"k": stiffness, "c": 0.0, "alpha": strength / u_y, "A": 1.0, "n": 10.0, "F0": 0.0}
    return iso.law("bouc_wen", numbers | dict.fromkeys(("beta", "gamma"), 0.5 / u_y**10))


def test_an_effective_period_is_that_of_the_bilinear_loop(slab):
    """The period at rest is that of the stiffness before yielding, a third of it."""
    k, strength, u_y, D = 1.0, 0.12, 0.01, 0.25
    isolated = slab.on(
        lead_rubber(k, strength, u_y), effective_period_s=2.5, design_displacement_m=D
    )
    stiffness = MASS * (2 * np.pi / 2.5) ** 2
    scale = isolated.elements[0].device.force_scale
    assert scale == pytest.approx(stiffness / (k + strength / D), rel=1e-4)
    effective = isolated.effective(D)
    assert (effective.period, effective.stiffness) == pytest.approx((2.5, stiffness), rel=1e-8)
    area = 4 * scale * strength * (D - u_y)
    assert effective.damping == pytest.approx(area / (2 * np.pi * stiffness * D**2), rel=0.01)
    assert isolated.periods()[0] < 0.9


def test_effective_properties_of_spring_and_dashpot_are_exact(slab):
    isolated = slab.on(iso.law("kelvin_voigt", {"k": STIFFNESS, "c": DAMPING}))
    omega = np.sqrt(STIFFNESS / MASS)
    effective = isolated.effective(0.1)
    expected = STIFFNESS, DAMPING * omega / (2 * STIFFNESS), 2 * np.pi / omega
    assert tuple(effective) == pytest.approx(expected, rel=1e-9)
    with pytest.raises(InputError, match=r"displacement: given 0\.0; expected"):
        isolated.effective(0.0)
    # beyond the range the polynomials of the current give a law that grows without end
    reference = iso.reference_building().on(iso.reference_isolators())
    with pytest.raises(InputError, match=r"current 9 A is outside 0 to 5"):
        reference.effective(0.08, 9.0)


@pytest.mark.parametrize(("n", "tau"), [(2.0, 1.0), (1000.0, 2e-5)])
def test_effective_properties_of_a_friction_pendulum(slab, n, tau):
    W, R, mu, u_y, D = 1e6, 2.5, 0.06, 1e-3, 0.2
    values = {"W": W, "R": R, "mu_max": mu, "mu_min": mu, "a": 50.0, "u_y": u_y, "n": n, "tau": tau}
    effective = slab.on(iso.law("friction_pendulum", values)).effective(D)
    assert effective.stiffness == pytest.approx(W / R + mu * W / D, rel=1e-6)
    damping = 2 / np.pi * mu / (D / R + mu) * (1 - u_y / D)
    assert effective.damping == pytest.approx(damping, rel=1e-3)


def test_springs_beside_the_isolators_limit_the_effective_period():
    """A slab on springs of its own: isolators only make it stiffer."""
    held = iso.from_matrices([[MASS]], [[0.0]], [[STIFFNESS]], name="slab")
    device = iso.law("kelvin_voigt", {"k": 1.0, "c": 0.0})
    effective = held.on(device, effective_period_s=1.5, design_displacement_m=0.1).effective(0.1)
    assert effective.period == pytest.approx(1.5, rel=1e-8)
    with pytest.raises(InputError, match=r"expected: below 1\.72 s, the period of slab without"):
        held.on(device, effective_period_s=2.0, design_displacement_m=0.1)


def test_an_effective_damping_is_attained_at_the_design_displacement():
    text = (
        "[structure]\nkind = 'shear'\nfloor_masses_kg = [2e5]\nbase_mass_kg = 1e5\n"
        "storey_stiffnesses_N_per_m = [4e8]\n[isolator]\nlaw = 'strain_stiffening'\n"
        "effective_period_s = 2.5\ndesign_displacement_m = 0.2\ndamping_ratio = 0.35\n"
    )
    isolated = iso.Scenario.from_toml(text).build().isolated
    effective = isolated.effective(0.2, 1.5)
    assert (effective.period, effective.damping) == pytest.approx((2.5, 0.35), rel=2e-3)
    assert isolated.element_names == ("isolator", "damper")
    with pytest.raises(InputError, match="target_period_s and effective_period_s are both set"):
        iso.Scenario.from_toml(text + "target_period_s = 2.0\n").build()


def test_the_old_name_of_the_damping_ratio_is_accepted(slab):
    isolated = slab.on(iso.law("kelvin_voigt", {"k": STIFFNESS, "c": DAMPING}))
    with pytest.warns(FutureWarning, match="now called damping_ratio"):
        assert isolated.effective_damping() == isolated.damping_ratio()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"target_period_s": 0.4}, "target_period_s: given 0.4; expected: above 0.5"),
        ({"target_period_s": -1.0}, "target_period_s: given -1.0; expected: a finite number"),
        ({"target_period_s": 2.0, "damping": 0.01}, "damping: given 0.01; expected: 0."),
        (
            {"target_period_s": 2.0, "count": 3},
            "count and target_period_s are both set; expected: one of the two",
        ),
        ({"design_displacement_m": 0.1}, "design_displacement_m is set without target_period_s or"),
        ({"effective_period_s": 2.0}, "effective_period_s needs design_displacement_m"),
        (
            {"effective_period_s": 2.0, "target_period_s": 2.0},
            "target_period_s and effective_period_s are both set",
        ),
        (
            {"effective_period_s": 2.0, "design_displacement_m": 0.1, "damping": 0.01},
            "damping: given 0.01; expected: 0.",
        ),
    ],
)
def test_what_cannot_be_attained_is_refused(options, message):
    with pytest.raises(InputError, match=message):
        iso.reference_building().on(iso.law("strain_stiffening"), **options)


def test_a_scenario_takes_a_target_period():
    text = (
        "[isolator]\ntarget_period_s = 2.5\ndamping_ratio = 0.35\n"
        "[nominal]\nforce_factor = 2.0\n[simulation]\nfixed_base = true\n"
    )
    job = iso.Scenario.from_toml(text).build()
    assert job.isolated.periods(1.5)[0] == pytest.approx(2.5, rel=1e-6)
    assert job.isolated.damping_ratio(1.5) == pytest.approx(0.35, rel=1e-6)
    true, nominal = (each.elements[0].device for each in (job.isolated, job.options["nominal"]))
    assert nominal.force_scale == pytest.approx(2 * true.force_scale)
    assert job.fixed_base
    with pytest.raises(InputError, match="force_scale and target_period_s are both set"):
        iso.Scenario.from_toml("[isolator]\ntarget_period_s = 2.0\nforce_scale = 9.0\n").build()


def test_the_repr_names_masses_periods_and_the_tested_range():
    text = repr(iso.reference_building().on(iso.reference_isolators()))
    for part in ("1550 t", "fixed-base period 0.5 s", "at 0 A", "80 mm", "tested current 3 A"):
        assert part in text


def test_the_period_at_full_current_is_that_at_the_highest_tested_one():
    plant = iso.reference_building().on(iso.reference_isolators())
    periods = plant.facts()["Isolated period at rest"].split(", ")
    assert plant.current_range(0)[1] > plant.tested_current(0) == 3.0
    assert periods[1].startswith(f"{plant.modes(3.0).periods[0]:.3g} s at 3 A (")


@pytest.mark.parametrize(
    ("masses", "stiffnesses", "period", "message"),
    [
        ([250.0], [1e9], 2.0, "check for masses in t"),
        ([2.5e5], [2e3], 2.0, "check for stiffnesses in kN/m"),
        ([2.5e5], [1e8], 50.0, "isolated period of 50 s"),
        ([2.5e5], [1e7], 0.9, "below its fixed-base period of 0.993 s"),
    ],
)
def test_a_wrong_unit_is_reported_with_the_period(masses, stiffnesses, period, message):
    building = iso.shear_building(masses, stiffnesses, base_mass=1e5)
    isolated = building.on(iso.law("linear", {"k": 1.0}))
    (line,) = implausible(isolated, period)
    assert message in line


def test_the_reference_building_is_plausible():
    assert implausible(iso.reference_building().on(iso.reference_isolators()), 2.05) == ()


def test_biaxial_devices_at_their_positions_take_a_target_period():
    """Without them nothing holds the rotation of a building in plan."""
    building = plan_building([2e5], [3e8], [2e8], base_mass=2e5, plan=(20.0, 12.0))
    device = iso.law("strain_stiffening")
    isolated = building.on(device, target_period_s=2.0, biaxial=True)
    middle = middle_current(device)
    assert isolated.periods(middle)[0] == pytest.approx(2.0, rel=1e-9)
    said = r"a mode has no period, .*; base_rotation: biaxial isolators .* with their positions$"
    with pytest.raises(InputError, match=said):
        building.on(device, target_period_s=2.0)


def test_storeys_that_yield_have_the_fixed_base_period_of_the_elastic_ones():
    """They are as stiff as before at rest, though the linear part is a twentieth of it."""
    isolated = iso.reference_building().on(iso.reference_isolators())
    yielding = yielding_storeys(isolated, 1.2e6)
    assert "fixed-base period 0.5 s" in repr(yielding)
    assert implausible(yielding, 1.2) == ()


def test_all_storeys_that_yield_are_in_the_fixed_base_run():
    """Under a weak motion it is the fixed-base run of the elastic building."""
    isolated = iso.reference_building().on(iso.reference_isolators())
    weak = iso.el_centro_1940().cut(0, 3).scaled(1e-3)
    elastic, yielding = (
        fixed_base_run(one, weak).criteria["peak_drift_m"]
        for one in (isolated, yielding_storeys(isolated, 1.2e6))
    )
    assert yielding == pytest.approx(elastic, rel=1e-6)


def test_torsion_is_named_and_is_not_the_isolated_period():
    """Soft isolators at the middle of the slab leave torsion the longest mode."""
    k = [4e8, 3e8]
    building = plan_building([3e5, 3e5], k, k, base_mass=3e5, plan=(24.0, 15.0), damping_ratio=0.03)
    bearing = iso.law("kelvin_voigt", {"k": 8e6, "c": 2e5})
    rotation = iso.law("kelvin_voigt", {"k": 8e7, "c": 2e6})
    isolated = building.on(bearing).with_element(rotation, "base_rotation")
    torsion, sway = isolated.periods()[0], translational_period(isolated)
    assert sway == pytest.approx(2 * np.pi * np.sqrt(9e5 / 8e6), rel=0.05) and torsion > 1.5 * sway
    facts = isolated.facts()
    assert facts["Isolated period at rest"].startswith(f"{sway:.3g} s (damping")
    assert facts["Isolated period at rest"].endswith(f"; torsion {torsion:.3g} s)")
    assert facts["Damping on a fixed base"] == "3 % in every mode"
