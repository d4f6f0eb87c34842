"""Storeys that yield and moat walls, in Python and in the scenario file."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import isolation_sim as iso
from ground_motions import Record
from isolation_sim.errors import InputError
from isolation_sim.scenario import Scenario
from isolation_sim.structures import IsolatedStructure, cones, on_soil, yielding_storeys
from isolation_sim.structures.yielding import storey_stiffnesses

FLOORS, STIFFNESSES = [2e5, 1.5e5, 1e5], [3e8, 2e8, 1e8]


def building():
    return iso.shear_building(FLOORS, STIFFNESSES, base_mass=3e5)


def test_storey_stiffnesses_are_the_inputs():
    for structure in (building(), building().fixed_base()):
        np.testing.assert_allclose(storey_stiffnesses(structure), STIFFNESSES, rtol=1e-9)
    with pytest.raises(InputError, match="expected for yielding storeys: a shear building"):
        crossed = building().stiffness.copy()
        crossed[0, 3] = crossed[3, 0] = -1e7
        storey_stiffnesses(iso.from_matrices(building().mass, building().damping, crossed))


def test_yielding_storeys_against_an_independent_integration():
    """The reference building on a fixed base: Wen's equations by SciPy."""
    structure = iso.reference_building().fixed_base()
    shear, ratio, n = np.array([1.5e6, 1.4e6, 1.2e6, 9e5, 5e5]), 0.1, 3.0
    plant = yielding_storeys(IsolatedStructure(structure, ()), shear, ratio, n)
    stiffness, rows = storey_stiffnesses(structure), structure.drift_rows
    yield_drift = shear / stiffness
    dt, time = 0.01, np.arange(0, 3.001, 0.01)
    record = Record(4.0 * np.sin(10 * time), dt)
    inverse = np.linalg.inv(structure.mass)

    def rate(t, y):
        x, v, z = y.reshape(3, 5)
        drift, speed = rows @ x, rows @ v
        over = np.abs(z / yield_drift) ** n
        storey = stiffness * (ratio * drift + (1 - ratio) * z)
        ground = np.interp(t, time, record.acceleration)
        acceleration = -ground - inverse @ (rows.T @ storey + structure.damping @ v)
        slip = speed * (1 - 0.5 * over * (1 + np.sign(speed * z)))
        return np.concatenate((v, acceleration, slip))

    run = iso.simulate(plant, record, "passive_off").output("floor5_displacement_m")
    solved = solve_ivp(rate, (0, 3), np.zeros(15), t_eval=time, max_step=dt / 2, rtol=1e-7)
    assert np.all(np.abs(rows @ solved.y[:5]).max(axis=1)[[0, 4]] > yield_drift[[0, 4]])
    expected = solved.y[4]
    np.testing.assert_allclose(run, expected, rtol=0, atol=3e-4 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"yield_shear": [1e5, 1e5]}, "a number or 3, in N"),
        ({"yield_shear": -1.0}, "numbers above 0"),
        ({"yield_shear": 1e5, "hardening_ratio": 1.0}, "0 to below 1"),
        ({"yield_shear": 1e5, "smoothness": 0.5}, "1 or above"),
    ],
)
def test_numbers_out_of_range_are_refused(change, said):
    with pytest.raises(InputError, match=said):
        yielding_storeys(IsolatedStructure(building(), ()), **change)


YIELDING = """
[yielding]
yield_shear_N = {shear}
[[controller]]
name = "passive_off"
"""
WALL = """
[ground]
stop_s = 6.0
scale_factor = 2.0
[moat_wall]
gap_m = {gap}
stiffness_N_per_m = 5e8
[[controller]]
name = "passive_off"
"""


def test_the_yielding_section_of_a_scenario():
    scenario = Scenario.from_toml(YIELDING.format(shear="6e5"))
    assert Scenario.from_toml(scenario.to_toml()) == scenario
    result = scenario.build().isolated
    expected = yielding_storeys(Scenario().build().isolated, 6e5)
    assert result.element_names == expected.element_names
    assert result.element_names[:2] == ("isolator", "storey1_hysteresis")
    np.testing.assert_array_equal(result.structure.stiffness, expected.structure.stiffness)
    said = r"yielding: yield_shear: given \[600000.0, 600000.0\]; expected: a number or 5"
    with pytest.raises(InputError, match=said):
        Scenario.from_toml(YIELDING.format(shear="[6e5, 6e5]")).build()


def test_a_moat_wall_stops_the_base():
    gap = 0.12
    scenario = Scenario.from_toml(WALL.format(gap=gap))
    assert Scenario.from_toml(scenario.to_toml()) == scenario
    run = scenario.build().run("passive_off")
    free = Scenario.from_toml(WALL.format(gap=2.0)).build().run("passive_off")
    assert free.isolated.element_names == ("isolator", "moat_wall")
    # the wall is elastic: its energy is accounted for
    assert run.energy.closure_error < 1e-6
    assert free.criteria["peak_base_displacement_m"] > 1.2 * gap
    assert gap < run.criteria["peak_base_displacement_m"] < gap + 0.02
    assert run.criteria["peak_floor_acceleration_m_s2"] > (
        2 * free.criteria["peak_floor_acceleration_m_s2"]
    )


def test_on_a_held_base_every_storey_yields():
    """Periods of the elastic building, and its strength: the first storey stands on the base."""
    soil = cones(10.0, 150.0, 1800.0, 0.4)
    for structure in (
        building(),
        iso.shear_building(FLOORS, STIFFNESSES, base_mass=3e5, heights=[3.0] * 3),
    ):
        isolated = yielding_storeys(structure.on(iso.law("linear", {"k": 4e6})), 1e6, 0.1)
        for plant in (isolated, on_soil(isolated, soil, 4e5, 1e7)):
            held = plant.fixed_base()
            assert held.element_names == tuple(f"{s}_hysteresis" for s in structure.storeys)
            np.testing.assert_allclose(held.periods(), structure.fixed_base_periods())
            elastic = f"{structure.fixed_base_periods()[0]:.3g} s"
            assert plant.facts()["Fixed-base period"] == elastic
