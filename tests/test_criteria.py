"""Criteria against numbers worked out by hand and by another route."""

from types import SimpleNamespace

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import Record, el_centro_1940
from isolation_sim.criteria import benchmark_criteria, criteria
from isolation_sim.scenario.building import MoatWall
from isolation_sim.simulation.outputs import level_dofs, output_names, storey_rows

from .sampled_criteria import Response, response_criteria, response_of

RATIOS_TO_REFERENCE = ("J1", "J2", "J3", "J4", "J5", "J7", "J8")


class StubRun(SimpleNamespace):
    """What the criteria need of a run."""

    __class__ = iso.Run


@pytest.fixture(scope="module")
def runs():
    isolated = iso.reference_building().on(iso.reference_isolators())
    ground = el_centro_1940().cut(0, 10)
    return {name: iso.simulate(isolated, ground, name) for name in ("passive_off", "passive_on")}


def response(time, **value):
    """Quiet response with one column each, apart from what is given."""
    n = len(time)
    quiet = {
        "base_displacement": np.zeros((n, 1)),
        "floor_acceleration": np.zeros((n, 1)),
        "superstructure_acceleration": np.zeros((n, 1)),
        "drift": np.zeros((n, 1)),
        "base_shear": np.zeros(n),
        "structural_shear": np.zeros(n),
        "isolator_force": np.zeros(n),
    }
    return Response(time=time, **(quiet | value))


def stub_run(isolated, records, values):
    """What criteria read of a run, with outputs of our own choosing."""
    return StubRun(
        isolated=isolated,
        records=records,
        time=records[0].time,
        values=values,
        outputs=SimpleNamespace(names=output_names(isolated)),
        controller="stub",
    )


def biaxial_building():
    """Slab and floor that move in x, y and rotation; shaken in x and y."""
    mass = np.diag([2e3, 2e3, 5e3])
    return iso.from_fixed_base(
        mass,
        1e2 * mass,
        1e4 * mass,
        np.diag([3e3, 3e3, 7e3]),
        rigid_motion=np.eye(3),
        shaken=[0, 1],
        names=["base_x", "base_y", "base_r", "floor1_x", "floor1_y", "floor1_r"],
    )


def test_sine_of_known_peak_and_rms():
    time = np.linspace(0.0, 2.0, 201)
    sine = np.sin(2 * np.pi * time)
    values = response_criteria(
        response(
            time,
            base_displacement=0.2 * sine[:, None],
            floor_acceleration=np.stack([3 * sine, -4 * sine], axis=1),
            superstructure_acceleration=np.stack([3 * sine], axis=1),
            drift=np.stack([0.02 * sine, 0.01 * sine, 0 * sine], axis=1),
            base_shear=-7e3 * sine,
            structural_shear=5e3 * sine,
            isolator_force=7e3 * sine,
            isolator_displacement=np.stack([0.1 * sine, 0.3 * sine], axis=1),
            drift_ratio=np.stack([0.005 * sine, 0.006 * sine], axis=1),
        )
    )
    for key, amplitude in {
        "base_displacement_m": 0.2,
        "floor_acceleration_m_s2": 4.0,
        "drift_m": 0.02,
        "superstructure_acceleration_m_s2": 3.0,
        "isolator_displacement_m": 0.3,
        "drift_ratio": 0.006,
        "base_shear_N": 7e3,
        "structural_shear_N": 5e3,
        "isolator_force_N": 7e3,
    }.items():
        assert values[f"peak_{key}"] == pytest.approx(amplitude, rel=1e-14)
        assert values[f"rms_{key}"] == pytest.approx(amplitude / np.sqrt(2), rel=1e-12)
    assert len(values) == 18


def test_rms_is_over_the_duration_not_over_the_samples():
    # 1 for 1 s, then 0 for 3 s, unevenly sampled: mean square 1/4, and half of the 1 ms between
    time = np.array([0.0, 0.25, 0.5, 1.0, 1.001, 4.0])
    pulse = np.array([1.0, 1.0, 1.0, 1.0, 0.0, 0.0])
    values = response_criteria(response(time, base_shear=pulse))
    assert values["rms_base_shear_N"] == pytest.approx(np.sqrt(1.0005 / 4), rel=1e-12)


def test_peak_floor_and_rms_floor_may_differ():
    time = np.linspace(0, 1, 101)
    spike = np.where(np.arange(101) == 50, 9.0, 0.0)
    values = response_criteria(
        response(time, floor_acceleration=np.stack([spike, np.full(101, 2.0)], axis=1))
    )
    assert values["peak_floor_acceleration_m_s2"] == 9.0
    assert values["rms_floor_acceleration_m_s2"] == pytest.approx(2.0, rel=1e-14)


def test_batches_are_the_single_runs():
    random = np.random.default_rng(3)
    time = np.arange(40) * 0.02
    settings = {
        "base_displacement": random.normal(size=(2, 3, 40, 1)),
        "floor_acceleration": random.normal(size=(2, 3, 40, 6)),
        "superstructure_acceleration": random.normal(size=(2, 3, 40, 5)),
        "drift": random.normal(size=(2, 3, 40, 5)),
        "base_shear": random.normal(size=(2, 3, 40)),
        "structural_shear": random.normal(size=(2, 3, 40)),
        "isolator_force": random.normal(size=(2, 3, 40)),
    }
    batch = response_criteria(Response(time=time, **settings))
    for place in np.ndindex(2, 3):
        single = response_criteria(Response(time, **{k: v[place] for k, v in settings.items()}))
        for key, value in single.items():
            assert batch[key].shape == (2, 3)
            assert batch[key][place] == pytest.approx(value, rel=1e-14)


def test_a_structure_without_storeys_has_no_drift():
    time = np.arange(5) * 0.1
    values = response_criteria(response(time, drift=np.zeros((5, 0))))
    assert values["peak_drift_m"] == values["rms_drift_m"] == 0.0


def test_benchmark_criteria_by_hand():
    keys = (
        "base_shear_N",
        "structural_shear_N",
        "base_displacement_m",
        "drift_m",
        "superstructure_acceleration_m_s2",
        "isolator_force_N",
        "floor_acceleration_m_s2",
        "isolator_displacement_m",
        "drift_ratio",
    )
    controlled = {
        f"{kind}_{key}": float(k) for kind in ("peak", "rms") for k, key in enumerate(keys, 1)
    }
    uncontrolled = {key: 10.0 for key in controlled}
    energy = {
        "control_device_work_J": 3.0,
        "absolute_input_J": 4.0,
        "device_dissipation_J": 1.0,
        "input_J": 5.0,
    }
    values = benchmark_criteria(controlled, uncontrolled, energy)
    assert values == pytest.approx(
        {
            "J1": 0.1,
            "J2": 0.2,
            "J3": 0.8,
            "J4": 0.9,
            "J5": 0.5,
            "J6": 6.0,
            "J7": 0.8,
            "J8": 0.5,
            "J9": 0.75,
            "normalised_peak_base_displacement": 0.3,
            "normalised_rms_base_displacement": 0.3,
            "normalised_peak_drift": 0.4,
            "normalised_peak_floor_acceleration": 0.7,
            "normalised_rms_floor_acceleration": 0.7,
            "normalised_device_dissipation": 0.2,
        }
    )
    assert list(values)[:9] == [f"J{k}" for k in range(1, 10)]
    assert np.isnan(
        benchmark_criteria(controlled, uncontrolled, energy | {"absolute_input_J": 0.0})["J9"]
    )
    assert "J9" not in benchmark_criteria(controlled, uncontrolled)


def test_without_geometry_isolators_are_at_the_base_and_storeys_alike():
    keys = (
        "base_shear_N",
        "structural_shear_N",
        "base_displacement_m",
        "drift_m",
        "superstructure_acceleration_m_s2",
        "isolator_force_N",
        "floor_acceleration_m_s2",
    )
    controlled = {
        f"{kind}_{key}": float(k) for kind in ("peak", "rms") for k, key in enumerate(keys, 1)
    }
    uncontrolled = {key: 10.0 for key in controlled}
    values = benchmark_criteria(controlled, uncontrolled)
    assert (values["J3"], values["J4"], values["J7"]) == (0.3, 0.4, 0.3)
    # a side whose geometry is not known decides what is compared; in a sweep, not a number
    known = {"peak_isolator_displacement_m": 5.0, "peak_drift_ratio": np.nan}
    values = benchmark_criteria(controlled | known, uncontrolled)
    assert (values["J3"], values["J4"]) == (0.3, 0.4)


def test_the_reference_itself_scores_one(runs):
    values = criteria(runs["passive_off"], runs["passive_off"])
    for key in RATIOS_TO_REFERENCE:
        assert values[key] == 1.0
    # a single isolator carries the whole base shear
    assert values["J6"] == pytest.approx(1.0, rel=1e-9)
    assert all(type(value) is float for value in values.values())


def test_ratios_and_energies_of_a_run(runs):
    on, off = runs["passive_on"], runs["passive_off"]
    values = criteria(on, off)
    ratios = set(values) - set(on.criteria)
    assert {f"J{k}" for k in range(1, 10)} < ratios
    assert all(name.startswith(("J", "normalised_")) for name in ratios)
    assert values["J1"] == on.criteria["peak_base_shear_N"] / off.criteria["peak_base_shear_N"]
    assert values["J7"] == (
        on.criteria["rms_base_displacement_m"] / off.criteria["rms_base_displacement_m"]
    )
    final = on.energy.final
    assert values["J9"] == final["control_device_work_J"] / final["absolute_input_J"]
    assert values["normalised_device_dissipation"] == (
        final["device_dissipation_J"] / final["input_J"]
    )
    assert 0 < values["J9"] < 1


def test_shear_by_two_routes(runs):
    run = runs["passive_on"]
    result = response_of(run)
    history, mass = run.history, np.diag(run.isolated.structure.mass)
    inertia = -(history.acceleration.values * mass).sum(axis=1)
    peak = np.abs(inertia).max()
    assert result.base_shear == pytest.approx(inertia, abs=1e-9 * peak)
    # the isolator is all that the ground holds the building by
    assert result.base_shear == pytest.approx(history.force.values[:, 0], abs=1e-9 * peak)
    # and the first storey carries what the floors above it weigh in
    storey = run.isolated.structure
    spring = storey.stiffness[1, 0] * -history.drift.values[:, 0]
    above = -(history.acceleration.values * mass)[:, 1:].sum(axis=1)
    assert result.structural_shear == pytest.approx(above, abs=1e-9 * peak)
    assert np.abs(spring - result.structural_shear).max() < 0.05 * peak  # without its damping


def test_input_of_the_absolute_motion_is_the_shears_work_on_the_ground(runs):
    run = runs["passive_on"]
    (record,) = run.records
    power = -response_of(run).base_shear * record.velocity
    absolute = np.concatenate([[0], np.cumsum((power[1:] + power[:-1]) / 2 * record.dt)])
    assert run.energy.absolute_input_J == pytest.approx(absolute, abs=2e-3 * np.abs(absolute).max())
    # while the ground moves, the two inputs differ
    apart = run.energy.absolute_input_J - run.energy.input_J
    assert np.abs(apart).max() > 0.01 * np.abs(absolute).max()


def test_work_on_the_devices_is_what_they_lost_and_store(runs):
    energy = runs["passive_on"].energy
    stored = energy.device_stored_J - energy.device_stored_J[0]
    expected = energy.device_dissipation_J + stored - energy.field_work_J
    assert energy.control_device_work_J == pytest.approx(expected, abs=1e-6 * energy.input_J.max())


def test_vectors_over_two_directions():
    building = biaxial_building()
    device = iso.law("linear", {"k": 1e6})
    isolated = building.on(device)
    records = tuple(Record(np.zeros(8), dt=0.1) for _ in "xy")
    names = output_names(isolated)
    values = np.random.default_rng(5).normal(size=(8, len(names)))
    run = stub_run(isolated, records, values)
    column = {name: values[:, k] for k, name in enumerate(names)}
    result = response_of(run)
    assert result.base_displacement == pytest.approx(
        np.hypot(column["base_x_displacement_m"], column["base_y_displacement_m"])[:, None]
    )
    for level, name in enumerate(("base", "floor1")):
        assert result.floor_acceleration[:, level] == pytest.approx(
            np.hypot(column[f"{name}_x_acceleration_m_s2"], column[f"{name}_y_acceleration_m_s2"])
        )
    assert result.drift == pytest.approx(
        np.hypot(column["storey1_x_drift_m"], column["storey1_y_drift_m"])[:, None]
    )
    shear = [
        3e3 * column[f"base_{d}_acceleration_m_s2"] + 2e3 * column[f"floor1_{d}_acceleration_m_s2"]
        for d in "xy"
    ]
    assert result.base_shear == pytest.approx(np.hypot(*shear))
    assert result.structural_shear == pytest.approx(
        2e3 * np.hypot(column["floor1_x_acceleration_m_s2"], column["floor1_y_acceleration_m_s2"])
    )
    assert result.isolator_force == pytest.approx(
        np.hypot(column["isolator_x_force_N"], column["isolator_y_force_N"])
    )
    assert response_criteria(result)["peak_base_shear_N"] == pytest.approx(np.hypot(*shear).max())


def test_rotations_are_no_levels_and_no_storeys():
    building = biaxial_building()
    assert level_dofs(building).tolist() == [[0, 1], [3, 4]]
    assert storey_rows(building).tolist() == [[0, 1]]


def test_directions_of_different_extent_stand_alone():
    mass = np.eye(3)
    building = iso.from_matrices(
        mass, 0 * mass, mass, influence=[[1, 0], [0, 1], [1, 0]], base=(0, 1)
    )
    assert level_dofs(building).tolist() == [[0], [1], [2]]


def test_isolator_force_leaves_out_what_no_coil_drives():
    isolated = iso.reference_building().on(iso.reference_isolators())
    spring = iso.law("linear", {"k": 1e6})
    with_more = isolated.with_element(spring, "base", name="bearing")
    with_more = with_more.with_element(spring, "storey2", name="brace")
    record = Record(np.zeros(6), dt=0.1)
    names = output_names(with_more)
    values = np.random.default_rng(7).normal(size=(6, len(names)))
    result = response_of(stub_run(with_more, (record,), values)).isolator_force
    assert result == pytest.approx(values[:, names.index("isolator_force_N")])


@pytest.mark.parametrize(("lag", "error"), [(0.0, 0.0075), (0.01, 0.018)])
def test_rms_values_between_samples_converge_as_documented(lag, error):
    plant = iso.reference_building().on(iso.reference_isolators())
    rule, driver = iso.controller("on_off", period=0.02), iso.CoilDriver(lag=lag)
    rms = [
        iso.simulate(plant, motion, rule, driver=driver).criteria["rms_floor_acceleration_m_s2"]
        for motion in (
            el_centro_1940(),
            el_centro_1940().resampled(0.005),
            el_centro_1940().resampled(0.001),
        )
    ]
    assert rms[0] == pytest.approx(rms[2], rel=error)
    assert rms[1] == pytest.approx(rms[2], rel=5e-4)


def test_a_coil_in_a_storey_counts_for_j9_and_not_for_j6():
    """Whether the isolators have a coil themselves or not."""
    building, damper = iso.reference_building(), iso.reference_isolators()
    active = building.on(damper).with_element(damper, "storey2", channel=0, name="damper")
    own = active.facts()["Control devices"]
    assert own == "isolator, damper; left out of J6 and the control device force: damper"
    passive = building.on(iso.law("kelvin_voigt", {"k": 8e6, "c": 2e5}))
    inside = passive.with_element(damper, "storey2", channel=0, name="damper")
    assert inside.facts()["Control devices"] == (
        "damper; left out of J6 and the control device force: damper; left out of J9: isolator"
    )


def test_the_isolation_layer_has_bearings_and_the_wall_has_its_own_force():
    """Without a wall the layer's force is the base shear; J6 keeps to the control device."""
    bearing, wall = iso.law("kelvin_voigt", {"k": 8e6, "c": 2e5}), MoatWall(
        gap_m=0.05, stiffness_N_per_m=1e8
    )  # fmt: skip
    isolated = iso.reference_building().on(iso.reference_isolators())
    assert "Control devices" not in isolated.facts()
    mixed = isolated.with_element(bearing, "base", name="bearing")
    motion = el_centro_1940().cut(0, 6)
    values = iso.simulate(mixed, motion).criteria
    assert values["peak_isolation_force_N"] == pytest.approx(values["peak_base_shear_N"], rel=1e-6)
    assert values["peak_isolator_force_N"] < 0.8 * values["peak_base_shear_N"]
    assert "wall_force_N" not in "".join(values)
    within = wall.add_to(mixed)
    run = iso.simulate(within, motion)
    assert run.criteria["peak_wall_force_N"] > 0 and run.contacts["moat_wall"] > 0
    assert (
        "left out of J6, J9 and the control device force: bearing, moat_wall"
        in within.facts()["Control devices"]
    )


def test_a_reference_under_another_ground_motion_is_refused(runs):
    run = runs["passive_off"]
    other = StubRun(records=(el_centro_1940().cut(0, 5),), controller="other")
    with pytest.raises(iso.InputError, match="the reference 'other' has another ground motion"):
        criteria(run, other)
