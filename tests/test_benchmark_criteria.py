"""The benchmark's nine criteria, recomputed from histories by separate code."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import Record, el_centro_1940
from isolation_sim.criteria import criteria
from isolation_sim.errors import InputError
from isolation_sim.simulation.batch import Case, simulate_many

HEIGHTS = 6.0, 2.0
"""m, of two storeys."""
POSITIONS = np.array(
    [[-8.0, -5.0], [-8.0, 6.0], [10.0, 6.0], [10.0, -5.0], [1.0, 0.5], [10.0, 2.0]]
)
"""m, of six isolators, two of them within the corners."""
MASSES = 1e5, 2.5e5, 2.5e5
"""kg, of the base and the floors."""
GYRATION = 5.0
"""m, radius of gyration of each of them."""


def tower(**geometry):
    """Two storeys of x, y and rotation, stiffer at one side, on a base that rotates."""
    mass = np.kron(np.diag(MASSES[1:]), np.diag([1.0, 1.0, GYRATION**2]))
    storey = np.array([[2e7, 0.0, -2e7], [0.0, 3e7, 1.5e7], [-2e7, 1.5e7, 1.5e9]])
    chain = np.array([[2.0, -1.0], [-1.0, 1.0]])
    stiffness = np.kron(chain, storey)
    return iso.from_fixed_base(
        mass, 2e-3 * stiffness, stiffness,
        MASSES[0] * np.diag([1.0, 1.0, GYRATION**2]),
        rigid_motion=np.tile(np.eye(3), (2, 1)), shaken=(0, 1),
        names=[f"{level}_{axis}" for level in ("base", "floor1", "floor2") for axis in "xyr"],
        **geometry,
    )  # fmt: skip


def isolated(**geometry):
    """On MR isolators about an eccentric centre, with linear springs to the ground beside them."""
    building = tower(**geometry)
    springs = building.stiffness.copy()
    springs[[0, 1], [0, 1]] += 8e5
    springs[2, 2] += 8e5 * 60.0
    building = replace(building, stiffness=springs)
    device = iso.reference_isolators().scaled(force=0.4)
    result = building
    for axis, arm in (("x", -1.5), ("y", -8.0)):
        row = building.direction_row(f"base_{axis}") + arm * building.direction_row("base_r")
        result = result.with_element(device, row, 0, f"isolator_{axis}")
    return result


@pytest.fixture(scope="module")
def runs():
    """Coils off and on, sampled every 2 ms; the ground still moves at the end."""
    plant = isolated(heights=np.repeat(HEIGHTS, 3), isolator_positions=POSITIONS)
    coarse = el_centro_1940().cut(0.0, 6.0)
    time = np.arange(0.0, 6.0, 0.002)
    along_x = np.interp(time, coarse.time, coarse.acceleration)
    along_y = 0.8 * np.interp(time + 1.3, coarse.time, coarse.acceleration, right=0.0)
    ground = [Record(along_x, 0.002), Record(along_y, 0.002)]
    return {name: iso.simulate(plant, ground, name) for name in ("passive_off", "passive_on")}


def integral(values, time):
    return float(np.sum((values[1:] + values[:-1]) / 2 * np.diff(time)))


def measures(run):
    """Peaks, RMS values and energies that the benchmark's paper defines, from the histories."""
    time = run.time

    def pair(owner, quantity):
        return np.array([run.output(f"{owner}_{axis}_{quantity}") for axis in "xy"])

    def rms(vectors):
        return np.sqrt(integral((vectors**2).sum(axis=0), time) / (time[-1] - time[0]))

    def peak(vectors):
        return np.sqrt((vectors**2).sum(axis=0)).max()

    levels = "base", "floor1", "floor2"
    moved = zip(MASSES, levels, strict=True)
    inertia = [mass * pair(level, "acceleration_m_s2") for mass, level in moved]
    shear, upper_shear = sum(inertia), inertia[1] + inertia[2]
    turn = run.output("base_r_displacement_m")
    (u, v) = pair("base", "displacement_m")
    isolators = [np.array([u - y * turn, v + x * turn]) for x, y in POSITIONS]
    floors = [pair(level, "acceleration_m_s2") for level in levels[1:]]
    below = ["base", "floor1"]
    drifts = [
        (pair(high, "displacement_m") - pair(low, "displacement_m")) / h
        for low, high, h in zip(below, levels[1:], HEIGHTS, strict=True)
    ]
    force = pair("isolator", "force_N")
    power = (force * pair("isolator", "velocity_m_s")).sum(axis=0)
    ground = np.array([record.acceleration for record in run.records])
    steps = np.diff(time)
    velocity = np.zeros_like(ground)
    velocity[:, 1:] = np.cumsum((ground[:, 1:] + ground[:, :-1]) / 2 * steps, axis=1)
    return {
        "V0": peak(shear), "V1": peak(upper_shear), "F": peak(force),
        "d": max(map(peak, isolators)), "rms d": max(map(rms, isolators)),
        "a": max(map(peak, floors)), "rms a": max(map(rms, floors)),
        "drift": max(map(peak, drifts)),
        "work": integral(power, time), "input": integral((shear * velocity).sum(axis=0), time),
    }  # fmt: skip


def test_all_nine_against_separate_code(runs):
    result = criteria(runs["passive_on"], runs["passive_off"])
    on, off = measures(runs["passive_on"]), measures(runs["passive_off"])
    expected = {
        "J1": on["V0"] / off["V0"], "J2": on["V1"] / off["V1"], "J3": on["d"] / off["d"],
        "J4": on["drift"] / off["drift"], "J5": on["a"] / off["a"], "J6": on["F"] / on["V0"],
        "J7": on["rms d"] / off["rms d"], "J8": on["rms a"] / off["rms a"],
        "J9": on["work"] / on["input"],
    }  # fmt: skip
    assert {name: result[name] for name in expected} == pytest.approx(expected, rel=5e-4)
    # the building tells every one of them from the variant under a name of its own
    for index, variant in {
        "J3": "normalised_peak_base_displacement",
        "J4": "normalised_peak_drift",
        "J5": "normalised_peak_floor_acceleration",
        "J7": "normalised_rms_base_displacement",
        "J8": "normalised_rms_floor_acceleration",
        "J9": "normalised_device_dissipation",
    }.items():
        assert abs(result[index] / result[variant] - 1) > 5e-3, (
            index,
            result[index],
            result[variant],
        )
    # the springs carry a part of the shear
    assert expected["J6"] < 0.95


def test_quantities_of_the_geometry(runs):
    run = runs["passive_on"]
    separate = measures(run)
    for name, expected in (
        ("peak_isolator_displacement_m", "d"),
        ("peak_drift_ratio", "drift"),
        ("peak_superstructure_acceleration_m_s2", "a"),
        ("rms_isolator_displacement_m", "rms d"),
        ("rms_superstructure_acceleration_m_s2", "rms a"),
    ):
        assert run.criteria[name] == pytest.approx(separate[expected], rel=5e-4)
    assert run.criteria["peak_isolator_displacement_m"] > run.criteria["peak_base_displacement_m"]


def test_unknown_geometry_leaves_its_quantities_out(runs):
    run = runs["passive_on"]
    plain = iso.simulate(isolated(), run.records, "passive_on")
    gone = set(run.criteria) - set(plain.criteria)
    assert gone == {
        f"{kind}_{name}"
        for kind in ("peak", "rms")
        for name in ("isolator_displacement_m", "drift_ratio")
    }
    reference = iso.simulate(isolated(), run.records, "passive_off")
    ratios = criteria(plain, reference)
    assert ratios["J3"] == ratios["normalised_peak_base_displacement"]
    assert ratios["J4"] == ratios["normalised_peak_drift"]


def test_equal_heights_do_not_change_a_shear_building():
    ground = el_centro_1940().cut(0, 5)

    def ratios(heights):
        building = iso.shear_building([2e5] * 3, [2e8] * 3, base_mass=3e5, heights=heights).on(
            iso.reference_isolators()
        )
        off, on = (iso.simulate(building, ground, name) for name in ("passive_off", "passive_on"))
        return criteria(on, off)

    without, equal, unequal = ratios(None), ratios([3.5] * 3), ratios([9.0, 3.0, 0.5])
    assert equal["J4"] == pytest.approx(without["J4"], rel=1e-12)
    assert equal["peak_drift_ratio"] == pytest.approx(without["peak_drift_m"] / 3.5, rel=1e-12)
    assert unequal["J4"] != pytest.approx(without["J4"], rel=1e-3)


def test_structures_of_different_geometry_side_by_side():
    """A block's runs share names and items of criteria, whatever the cases' order."""
    ground = el_centro_1940().cut(0, 3)
    device = iso.reference_isolators()
    plants = [
        iso.shear_building([2e5] * 3, [2e8 + k] * 3, base_mass=3e5, heights=heights).on(device)
        for k, heights in enumerate([None, [3.0, 4.0, 5.0], [3.0, 3.0, 3.0]] * 4)
    ]
    controller = iso.controller("passive_on")
    batch = simulate_many([Case(plant, ground, controller) for plant in plants], threads=1)
    for k, plant in enumerate(plants):
        single = iso.simulate(plant, ground, "passive_on").criteria
        for name, values in batch.criteria.items():
            assert values[k] == single.get(name, np.nan) or name not in single
            assert np.isnan(values[k]) == (name not in single)


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ({"isolator_positions": [[0.0, 1.0, 2.0]]}, "isolator_positions has shape"),
        ({"isolator_positions": [[0.0, np.nan]]}, r"isolator_positions\[0, 1\]: given nan"),
        ({"heights": [3.0] * 5 + [0.0]}, "heights: given .* expected: above zero"),
    ],
)
def test_geometry_that_cannot_be_used(value, said):
    with pytest.raises(InputError, match=said):
        tower(**value)


def test_positions_need_a_slab_that_moves_in_its_plane():
    with pytest.raises(InputError, match="need a base of three dofs, along x, along y and in rot"):
        iso.from_matrices(np.eye(2), np.eye(2), np.eye(2), isolator_positions=[[0.0, 1.0]])


def test_one_isolator_and_isolators_in_a_line(runs):
    """No convex hull encloses them; all are looked at."""
    run = runs["passive_on"]
    for places in ([[10.0, 6.0]], [[0.0, 0.0], [1.0, 2.0], [-2.0, -4.0]]):
        plant = isolated(isolator_positions=places)
        result = iso.simulate(plant, run.records, "passive_on")
        turn = result.output("base_r_displacement_m")
        u, v = (result.output(f"base_{axis}_displacement_m") for axis in "xy")
        expected = max(np.hypot(u - y * turn, v + x * turn).max() for x, y in places)
        assert result.criteria["peak_isolator_displacement_m"] == pytest.approx(expected, rel=5e-4)


def test_geometry_from_a_file(tmp_path):
    building = tower()
    path = tmp_path / "tower.npz"
    np.savez(
        path, M=building.mass, C=building.damping, K=building.stiffness,
        influence=building.influence, base=[0, 1, 2], storey_heights_m=np.repeat(HEIGHTS, 3),
        isolator_positions_m=POSITIONS,
    )  # fmt: skip
    loaded = iso.read_matrices(path)
    np.testing.assert_array_equal(loaded.isolator_positions, POSITIONS)
    np.testing.assert_array_equal(loaded.heights, np.repeat(HEIGHTS, 3))
    assert loaded.fixed_base().isolator_positions is None
