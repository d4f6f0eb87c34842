"""Many runs at once equal the same runs one by one."""

from dataclasses import replace

import numba
import numpy as np
import pytest
from numba import types

from isolation_sim.errors import InputError
from isolation_sim.laws import CurrentDependence, law
from isolation_sim.simulation.batch import FEWEST, LANES, Case, _Conditions, simulate_many
from isolation_sim.simulation.control import CoilDriver, CompiledDecision, Sensors
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import shear_building

DOUBLES = types.CPointer(types.float64)


@numba.cfunc(
    types.void(types.float64, DOUBLES, DOUBLES, DOUBLES, DOUBLES, types.CPointer(types.int64))
)
def smooth_rule(t, measured, settings, memory, command, sizes):
    """A leaky integral of displacement (settings: gain, leak) around a mean current."""
    memory[0] = settings[1] * memory[0] + measured[0]
    for c in range(sizes[3]):
        command[c] = 1.5 + 1.4 * np.tanh(settings[0] * memory[0] + 0.1 * measured[sizes[0] - 1])


class Compiled:
    """A compiled controller, and the same rule in plain Python."""

    name = "compiled"

    def __init__(self, gain, period=0.04, python=False):
        self.gain, self.period, self.python = gain, period, python

    def prepare(self, context, trial):
        pass

    def measures(self, nominal):
        return ("base_displacement_m",)

    def schedule(self, context):
        return None

    def reset(self, context):
        self.memory = 0.0

    def compiled(self, context):
        if self.python:
            return None
        numbers = np.array([self.gain, 0.9])
        return CompiledDecision(smooth_rule.address, numbers, np.zeros(1), smooth_rule)

    def current(self, t, m):
        self.memory = 0.9 * self.memory + m.base_displacement_m
        return 1.5 + 1.4 * np.tanh(self.gain * self.memory + 0.1 * m.coil0_current_A)


@pytest.fixture(scope="module")
def plants(stiffening):
    """Six structures of as many storeys on devices of different scale."""
    device = stiffening.elements[0].device
    return [
        shear_building(
            [2.5e5 * (1 + 0.1 * k)] * 5, [3e8 * (1 - 0.1 * k)] * 5, base_mass=3e5 + 1e4 * k
        ).on(device.scaled(length=1 + 0.05 * k, force=1 + 0.1 * k))
        for k in range(5)
    ] + [stiffening]


@pytest.fixture(scope="module")
def records(strong_motion):
    return [strong_motion, strong_motion.scaled(0.3), strong_motion.scaled(-1.4)]


@pytest.fixture(scope="module")
def cases(plants, records, scheduled):
    """Not a multiple of the lanes; held currents, and two sets of switched ones."""
    results = []
    for k in range(2 * LANES + 5):
        plant, record = plants[k % 6], records[k % 3]
        if k % 4 == 0:
            controller = scheduled([0.5 + 0.05 * k, 2.5, 0.1], [0.0, 0.6, 1.22])
        else:
            controller = scheduled([0.1 * k % 3.0])
        results.append(Case(plant, record, controller))
    return results


@pytest.fixture(scope="module")
def alone(cases):
    return [simulate(case.isolated, case.ground, case.controller).criteria for case in cases]


def assert_equal(batch, singles, rtol=1e-12):
    assert batch.failure == [None] * len(singles)
    assert set(batch.criteria) == set(singles[0])
    for name, values in batch.criteria.items():
        expected = [single[name] for single in singles]
        np.testing.assert_allclose(values, expected, rtol=rtol, err_msg=name)


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_batch_equals_single_runs(threads, cases, alone):
    assert_equal(simulate_many(cases, threads=threads), alone)


def test_order_and_neighbours_do_not_matter(cases, alone):
    order = np.random.default_rng(3).permutation(len(cases))
    batch = simulate_many([cases[k] for k in order])
    assert_equal(batch, [alone[k] for k in order])
    for some in ([7], [2, 30], list(range(0, 37, 2))):
        assert_equal(simulate_many([cases[k] for k in some]), [alone[k] for k in some])


def test_same_case_gives_the_same_bits_wherever_it_stands(cases):
    first = simulate_many(cases)
    turned = simulate_many(cases[::-1])
    for name, values in first.criteria.items():
        np.testing.assert_array_equal(values, turned.criteria[name][::-1], err_msg=name)


def test_sharing_a_structure_s_coefficients_changes_no_bit(plants, records, scheduled):
    same = [Case(plants[0], records[k % 3], scheduled([0.15 * k])) for k in range(LANES)]
    shared = simulate_many(same)
    # a second structure, too few runs to give each its own blocks
    mixed = simulate_many([*same, Case(plants[1], records[0], scheduled([1.0]))])
    for name, values in shared.criteria.items():
        np.testing.assert_array_equal(mixed.criteria[name][:LANES], values)
    many = simulate_many([*same * 4, Case(plants[1], records[0], scheduled([1.0]))])
    for name, values in mixed.criteria.items():
        np.testing.assert_array_equal(many.criteria[name][[*range(LANES), -1]], values)


def test_current_switched_between_samples(plants, records, scheduled):
    cases = [
        Case(plants[k], records[0], scheduled([0.5, 2.5, 0.1], [0.0, 0.6, 1.23])) for k in range(6)
    ]
    alone = [simulate(c.isolated, c.ground, c.controller).criteria for c in cases]
    assert_equal(simulate_many(cases), alone)


def test_no_cases_no_results():
    batch = simulate_many([])
    assert batch.failure == [] and batch.clamped.shape == (0,)


def test_a_failing_case_leaves_the_others_alone(cases, alone, records, scheduled, stiffening):
    wild = Case(stiffening, records[0].scaled(1e3), scheduled([1.5]))
    refused = Case(stiffening, records[0], scheduled([99.0]))
    batch = simulate_many([*cases[:5], wild, *cases[5:20], refused, *cases[20:]])
    selected = [k for k in range(len(cases) + 2) if k not in (5, 21)]
    for name, values in batch.criteria.items():
        expected = [single[name] for single in alone]
        np.testing.assert_allclose(values[selected], expected, rtol=1e-12, err_msg=name)
        assert np.isnan(values[[5, 21]]).all()
    assert "50 times further than they were tested" in batch.failure[5]
    assert batch.failure[21].startswith("scheduled: current 99 A at t = 0 s is outside")


def test_a_refused_current_is_named_as_in_a_single_run(stiffening, records, scheduled):
    case = Case(stiffening, records[0], scheduled([1.0, 99.0], [0.0, 0.5]))
    with pytest.raises(InputError) as single:
        simulate(case.isolated, case.ground, case.controller)
    for count in (1, FEWEST):
        assert simulate_many([case] * count).failure == [str(single.value)] * count


def test_a_failure_does_not_depend_on_the_neighbours(stiffening, records, scheduled):
    """A device that was tested further, in the lane beside."""
    element = stiffening.elements[0]
    tougher = replace(element, device=replace(element.device, tested_deformation=0.5))
    wild = Case(stiffening, records[0].scaled(100.0), scheduled([1.5]))
    beside = Case(
        replace(stiffening, elements=(tougher,)), records[0].scaled(100.0), scheduled([1.5])
    )
    (alone,) = simulate_many([wild]).failure
    assert alone is not None
    assert simulate_many([beside]).failure == [None]
    assert simulate_many([wild, beside] * FEWEST).failure == [alone, None] * FEWEST


def test_devices_tabulated_at_different_currents(stiffening, records, scheduled):
    """Side by side in one block, with knots of their own."""
    element = stiffening.elements[0]
    cases = []
    for knots in ([0.0, 1.0, 3.0], [0.0, 2.0, 3.0], [0.0, 2.5, 3.0]):
        inputs = element.device.current
        names = element.device.law.parameter_names
        values = dict(zip(names, np.transpose([inputs.at(i) for i in knots]), strict=True))
        values["k1"] = values["k1"] * np.array([1.0, 1.4, 1.0])
        device = replace(
            element.device, current=CurrentDependence.table(knots, values, names),
            current_range=(0.0, 3.0),
        )  # fmt: skip
        plant = replace(stiffening, elements=(replace(element, device=device),))
        cases.append(Case(plant, records[0], scheduled([1.7])))
    alone = [simulate(c.isolated, c.ground, c.controller).criteria for c in cases]
    assert_equal(simulate_many(cases * 3), alone * 3)


@pytest.fixture(scope="module")
def compiled_cases(plants, records):
    return [Case(plants[k % 6], records[k % 3], Compiled(0.5 + 0.2 * k)) for k in range(LANES + 3)]


OPTIONS = {
    "ideal": {},
    "noise": {"sensors": Sensors(noise={"displacement_m": 1e-3}, seed=4)},
    "sensors": {"sensors": Sensors(delay=0.013, noise={"displacement_m": 1e-3}, seed=4)},
    "coil": {"driver": CoilDriver(lag=0.04, slew=30.0), "computation_delay": 0.011},
}


@pytest.mark.parametrize(
    "name",
    ["ideal", "noise", "sensors", "coil"],
)
def test_compiled_controllers_in_lanes_equal_single_runs(name, compiled_cases):
    options = OPTIONS[name]
    single = [simulate(c.isolated, c.ground, c.controller, **options) for c in compiled_cases]
    batch = simulate_many(compiled_cases, **options)
    # a rule that measures turns round-off into a slightly different command
    assert_equal(batch, [run.criteria for run in single], rtol=1e-9)


@pytest.mark.parametrize("name", OPTIONS)
def test_compiled_controller_equals_the_same_rule_in_python(name, plants, records, worst):
    options = OPTIONS[name]
    compiled = simulate(plants[1], records[0], Compiled(2.0), **options)
    python = simulate(plants[1], records[0], Compiled(2.0, python=True), **options)
    assert worst(compiled.values, python.values) < 1e-9
    assert np.ptp(compiled.current) > 0.5


def test_controllers_in_plain_python_run_among_the_others(cases, alone, plants, records):
    python = Case(plants[0], records[1], Compiled(1.0, python=True))
    batch = simulate_many([*cases[:3], python, *cases[3:]])
    expected = simulate(python.isolated, python.ground, python.controller).criteria
    assert_equal(batch, [*alone[:3], expected, *alone[3:]])


def test_few_runs_of_a_kind_leave_no_lanes_empty(plants, records, scheduled, monkeypatch):
    """An empty lane decides, too: a block of three took as long as one of sixteen."""
    few = [Case(plants[0], records[k % 3], Compiled(1.0 + k)) for k in range(FEWEST - 1)]
    many = [Case(plants[0], records[k % 3], scheduled([0.2 * k])) for k in range(FEWEST)]
    sizes, run_block = [], _Conditions.run_block

    def counted(self, block, *others):
        sizes.append(len(block))
        run_block(self, block, *others)

    monkeypatch.setattr(_Conditions, "run_block", counted)
    result = simulate_many([*few, *many])
    assert sizes == [FEWEST]
    singles = [simulate(c.isolated, c.ground, c.controller).criteria for c in (*few, *many)]
    assert_equal(result, singles)


def test_clamped_commands_are_counted_case_by_case(plants, records, scheduled):
    cases = [
        Case(plants[0], records[0], scheduled([1.0, 1.0 + k, 9.0], [0.0, 0.5, 1.0]))
        for k in range(8)
    ]
    batch = simulate_many(cases, current_outside="clamp", driver=CoilDriver(high=4.5))
    np.testing.assert_array_equal(batch.clamped, [1, 1, 1, 1, 2, 2, 2, 2])


def test_progress_counts_every_run(cases):
    counted = []
    simulate_many(cases, progress=counted.append, threads=2)
    assert sum(counted) == len(cases)


def test_options_that_cannot_be_are_refused(cases):
    with pytest.raises(InputError, match="tolerance"):
        simulate_many(cases[:2], tolerance=1.0)


def test_several_elements_cut_into_different_steps(hybrid, strong_motion, scheduled):
    """A lane that needs no finer steps keeps its state while its neighbours are cut."""
    plant = hybrid.with_element(law("kelvin_voigt", parameters={"k": 4e7, "c": 4e5}), "storey1")
    times = [0.0, 0.4, 0.9, 1.3, 2.1, 2.6]
    cases = [
        Case(plant, strong_motion.scaled(factor), scheduled(currents, times))
        for factor in (1e-3, 0.05, 0.4, 1.0)
        for currents in ([0.0, 3.0, 0.5, 2.0, 0.0, 1.0], [2.0, 0.0, 1.5, 0.0, 3.0, 0.2])
    ]
    batch = simulate_many(cases, threads=1)
    assert batch.failure == [None] * len(cases)
    for k, case in enumerate(cases):
        single = simulate(case.isolated, case.ground, case.controller)
        for name, value in single.criteria.items():
            assert batch.criteria[name][k] == pytest.approx(value, rel=1e-12), (k, name)
