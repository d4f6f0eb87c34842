"""Step by step: the same bits as a run, state saved and restored, what is refused."""

import io
import time
from dataclasses import replace

import numpy as np
import pytest

from isolation_sim.errors import Diverged, InputError
from isolation_sim.simulation.control import CoilDriver, Sensors
from isolation_sim.simulation.run import simulate
from isolation_sim.simulation.simulator import Simulator

MEASURED = ("base_displacement_m", "base_velocity_m_s", "floor5_acceleration_m_s2",
            "isolator_force_N", "ground_acceleration_m_s2")  # fmt: skip


def switching(t, m):
    """A command that jumps, so that steps are cut."""
    return 3.0 if m.base_displacement_m * m.base_velocity_m_s > 0 else 0.0


CASES = {
    "ideal": (0.02, {}),
    "many samples a step": (0.1, {}),
    "several steps a sample": (0.004, {}),
    "not a multiple of the sample": (0.013, {}),
    "not a part of the record": (0.03, {}),
    "coil": (0.02, {"driver": CoilDriver(lag=0.03, slew=60.0, step=0.1)}),
    "late": (0.02, {"sensors": Sensors(delay=0.031), "computation_delay": 0.047}),
    "noisy": (
        0.02,
        {
            "sensors": Sensors(
                {"displacement_m": 1e-3, "velocity_m_s": 0.01, "acceleration_m_s2": 0.1},
                sampling=0.01, dropout=0.2, compensation=0.01, seed=5,
            ),
            "driver": CoilDriver(lag=0.02),
        },
    ),
}  # fmt: skip


def stepped(simulator, n=None, ground=None, measurement=None):
    """Measurements and commands of some steps, all by default."""
    seen, values = [measurement or simulator.reset()], []
    while not simulator.done and len(values) != n:
        values.append(switching(simulator.time, seen[-1]))
        seen.append(simulator.step(values[-1], *([] if ground is None else [next(ground)])))
    return np.array(seen), values


@pytest.mark.parametrize("case", CASES)
def test_the_same_bits_as_a_run(case, stiffening, strong_motion, rule):
    period, options = CASES[case]
    controller = rule(switching, period, MEASURED)
    simulate(stiffening, strong_motion, controller, **options)
    simulator = Simulator(stiffening, strong_motion, period=period, measures=MEASURED, **options)
    seen, inputs = stepped(simulator)
    assert simulator.measures == (*MEASURED, "coil0_current_A")
    assert len(inputs) == simulator.n_steps == len(controller.commands)
    assert len(set(inputs)) == 2
    assert inputs == controller.commands
    np.testing.assert_array_equal(seen[:-1], np.array(controller.seen))
    # once more from rest
    np.testing.assert_array_equal(stepped(simulator)[0], seen)


def test_the_last_measurement_is_of_the_end(stiffening, strong_motion, rule):
    run = simulate(stiffening, strong_motion, rule(switching, 0.02, MEASURED))
    seen, _ = stepped(Simulator(stiffening, strong_motion, measures=MEASURED))
    # a run's forces and accelerations are those after the current has changed
    for name in ("base_displacement_m", "base_velocity_m_s", "ground_acceleration_m_s2"):
        values = seen[:, MEASURED.index(name)]
        np.testing.assert_allclose(values, run.output(name), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("delay", [0.0, 0.033])
@pytest.mark.parametrize("parts", [1, 4])
def test_ground_motion_step_by_step(delay, parts, stiffening, strong_motion):
    record = replace(strong_motion, acceleration=strong_motion.acceleration + 0.1)
    options = {"period": parts * record.dt, "measures": MEASURED, "computation_delay": delay}
    seen, _ = stepped(Simulator(stiffening, record, **options))
    free = Simulator(stiffening, duration=record.duration, dt=record.dt, **options)
    rows = iter(record.acceleration[1:].reshape(-1, parts, 1))
    first = free.reset(ground_acceleration=record.acceleration[0])
    result, _ = stepped(free, ground=rows, measurement=first)
    np.testing.assert_array_equal(result, seen)


@pytest.mark.parametrize("case", CASES)
def test_a_state_continues_to_the_same_bits(case, stiffening, strong_motion):
    period, options = CASES[case]
    options = {"period": period, "measures": MEASURED, **options}
    simulator = Simulator(stiffening, strong_motion, **options)
    begun, _ = stepped(simulator, 37)
    middle = simulator.state
    rest, _ = stepped(simulator, measurement=simulator._measurement._make(begun[-1]))
    # through a file, into another simulator that has seen something else and other noise
    file = io.BytesIO()
    np.savez(file, **middle)
    file.seek(0)
    other = Simulator(stiffening, strong_motion, **options)
    other.reset(seed=99)
    for _ in range(39):
        other.step(1.0)
    other.state = np.load(file)
    assert other.time == simulator.period * 37
    again, _ = stepped(other, measurement=other._measurement._make(begun[-1]))
    np.testing.assert_array_equal(again, rest)


def test_a_seed_draws_the_noise(stiffening, strong_motion, rule):
    sensors = Sensors({"base_velocity_m_s": 0.01}, dropout=0.1)
    simulator = Simulator(stiffening, strong_motion, measures=MEASURED, sensors=sensors)
    first = stepped(simulator)[0]
    simulator.reset(seed=3)
    third = stepped(simulator)[0]
    assert (third != first).any()
    controller = rule(switching, 0.02, MEASURED)
    simulate(stiffening, strong_motion, controller, sensors=replace(sensors, seed=3))
    np.testing.assert_array_equal(third[:-1], np.array(controller.seen))


def test_all_outputs_are_measured_by_default(stiffening, strong_motion):
    simulator = Simulator(stiffening, strong_motion)
    assert set(MEASURED) < set(simulator.measures)
    assert simulator.measures[-1] == "coil0_current_A"
    assert (simulator.low[0], simulator.high[0]) == stiffening.current_range(0)


def test_a_step_costs_little_besides_integration(stiffening, strong_motion):
    """The call is measured where there is nothing to integrate: the kernel stops at once."""
    simulator = Simulator(stiffening, strong_motion, measures=MEASURED)
    simulator.reset()
    position, finished = simulator._work.position, simulator._work.sizes.n_segments
    least = np.inf
    for _ in range(20):
        position[0] = finished
        begun = time.perf_counter()
        for _ in range(100):
            simulator._k = 0
            simulator.step(1.0)
        least = min(least, (time.perf_counter() - begun) / 100)
    print(f"{1e6 * least:.2f} us a step besides integration")
    assert least < 20e-6  # about 4 us; a busy machine takes several times as long


def test_what_is_refused(stiffening, strong_motion):
    simulator = Simulator(stiffening, strong_motion, measures=MEASURED)
    with pytest.raises(InputError, match=r"current 9 A at t = 0 s is outside 0 to 5\.203 A"):
        simulator.step(9.0)
    simulator.reset()
    with pytest.raises(InputError, match=r"current: given \[1, 2\] A; expected: one number, or 1"):
        simulator.step([1, 2])
    with pytest.raises(InputError, match="expected: none, since there is a record"):
        simulator.step(1.0, 0.0)
    with pytest.raises(InputError, match="expected: none, since there is a record"):
        Simulator(stiffening, strong_motion, duration=1.0)
    with pytest.raises(InputError, match="period: given None, without a record; expected"):
        Simulator(stiffening, duration=1.0)
    with pytest.raises(InputError, match=r"dt: given 0.03 s; expected: the period"):
        Simulator(stiffening, period=0.1, duration=1.0, dt=0.03)
    with pytest.raises(InputError, match="base_displacment_m"):
        Simulator(stiffening, strong_motion, measures=["base_displacment_m"])
    with pytest.raises(InputError, match="state is of another simulator"):
        simulator.state = Simulator(stiffening, strong_motion, period=0.1).state
    free = Simulator(stiffening, period=0.02, duration=0.04)
    with pytest.raises(InputError, match="ground_acceleration is missing"):
        free.step(1.0)
    with pytest.raises(InputError, match=r"shape \(1, 1\)"):
        free.step(1.0, [1.0, 2.0])
    free.step(1.0, 0.1)
    free.step(1.0, 0.1)
    assert free.done
    with pytest.raises(InputError, match=r"the last step, to 0.04 s, has been taken"):
        free.step(1.0, 0.1)


def test_divergence_is_reported(stiffening):
    free = Simulator(stiffening, period=0.02, duration=10.0)
    with pytest.raises(Diverged, match="times further than they were tested"):
        while True:
            free.step(0.0, 1e4)


def test_clamped_where_asked(stiffening, strong_motion):
    simulator = Simulator(stiffening, strong_motion, current_outside="clamp")
    assert simulator.step(9.0).coil0_current_A == simulator.high[0]
