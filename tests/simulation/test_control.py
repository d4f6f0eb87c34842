"""Closed loop: when decisions are made, what they are based on, when they take effect."""

from dataclasses import replace

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.simulation.control import CoilDriver, Sensors
from isolation_sim.simulation.outputs import QUANTITIES, output_names
from isolation_sim.simulation.run import simulate


def law_of_motion(t, m):
    """A smooth command, so that small errors stay small."""
    return 1.5 + np.tanh(20 * m.base_displacement_m) + 0.4 * np.tanh(4 * m.base_velocity_m_s)


@pytest.mark.parametrize("period", [0.013, 0.03, 0.005])
def test_closed_loop_follows_scipy(
    period, stiffening, strong_motion, rule, by_scipy, worst, motion
):
    controller = rule(law_of_motion, period)
    run = simulate(stiffening, strong_motion, controller)
    command = [0.0]

    def decide(t, q, v, states):
        command[0] = 1.5 + np.tanh(20 * q[0]) + 0.4 * np.tanh(4 * v[0])

    instants = np.arange(0.0, strong_motion.duration - 1e-9, period)
    q, v, _ = by_scipy(
        stiffening, [strong_motion], lambda start, t: command, instants, decide, rtol=1e-9
    )
    np.testing.assert_allclose(controller.times, instants, atol=1e-12)
    assert worst(motion(run), np.concatenate([q, v], axis=1)) < 5e-6


def test_plain_python_equals_a_schedule_of_its_commands(
    stiffening, strong_motion, rule, scheduled, worst
):
    controller = rule(law_of_motion, 0.03)
    run = simulate(stiffening, strong_motion, controller)
    replay = simulate(stiffening, strong_motion, scheduled(controller.commands, controller.times))
    assert worst(run.values, replay.values) < 1e-9
    np.testing.assert_array_equal(run.current, replay.current)


MEASURED = ("base_displacement_m", "floor5_acceleration_m_s2", "isolator_force_N",
            "ground_acceleration_m_s2")  # fmt: skip


@pytest.fixture(scope="module")
def fine_run(stiffening, strong_motion, held):
    """What there is to measure, every 0.001 s."""
    return simulate(stiffening, strong_motion.resampled(0.001), held(), tolerance=1e-9)


@pytest.mark.parametrize(
    ("period", "sensors"),
    [
        (0.02, {}),
        (0.05, {}),
        (0.03, {"delay": 0.007}),
        (0.02, {"delay": 0.05}),
        (0.03, {"sampling": 0.02}),
        (0.025, {"sampling": 0.04, "delay": 0.013}),
        (0.1, {"sampling": 0.1, "delay": 0.1}),
    ],
)
def test_measurements_are_of_the_right_instants(
    period, sensors, stiffening, strong_motion, rule, fine_run
):
    """Of the latest sample that is old enough; before the first, the building is at rest."""
    controller = rule(lambda t, m: 1.5, period, MEASURED)
    simulate(stiffening, strong_motion, controller, sensors=Sensors(**sensors))
    delay, sampling = sensors.get("delay", 0.0), sensors.get("sampling")
    age = np.round((np.array(controller.times) - delay) * 1000).astype(int)
    if sampling is not None:
        whole = round(sampling * 1000)
        age = age // whole * whole
    seen = np.array(controller.seen)[:, :4]
    for column, name in enumerate(MEASURED):
        exact = fine_run.output(name)[np.maximum(age, 0)]
        later = np.flatnonzero(age > 0)  # at the start, the current has not been set yet
        error = np.abs(seen[later, column] - exact[later]).max()
        assert error < 1e-5 * np.abs(fine_run.output(name)).max(), name


def test_measurement_at_the_start_is_of_the_building_at_rest(stiffening, strong_motion, rule):
    controller = rule(lambda t, m: 1.5, 0.05, MEASURED)
    simulate(stiffening, strong_motion, controller, sensors=Sensors(delay=0.12))
    for seen in controller.seen[:3]:
        assert seen[:3] == (0.0, 0.0, 0.0)
        assert seen.ground_acceleration_m_s2 == strong_motion.acceleration[0]
    assert controller.seen[3].base_displacement_m != 0


def test_force_at_rest_is_measured_from_the_start(hybrid, strong_motion, rule):
    """A law with an initial force F0, before its first command."""
    element = hybrid.elements[0]
    device = element.device.with_parameters(F0=3.0)
    plant = replace(hybrid, elements=(replace(element, device=device),))
    controller = rule(lambda t, m: 1.5, 0.5, ("isolator_force_N",))
    run = simulate(plant, strong_motion, controller)
    assert run.output("isolator_force_N")[0] == pytest.approx(3.0 * device.force_scale)
    assert controller.seen[0].isolator_force_N == pytest.approx(3.0 * device.force_scale)


@pytest.mark.parametrize("delay", [0.0, 0.007, 0.03, 0.11])
def test_commands_take_effect_after_the_computation_delay(
    delay, stiffening, strong_motion, rule, scheduled, worst, motion
):
    controller = rule(lambda t, m: 1.0 + np.sin(7 * t) ** 2, 0.05)
    run = simulate(stiffening, strong_motion, controller, computation_delay=delay)
    time = np.array(controller.times) + delay
    current = np.array(controller.commands)
    if delay:
        time, current = np.append(0.0, time), np.append(0.0, current)
    inside = time < strong_motion.duration
    same = simulate(stiffening, strong_motion, scheduled(current[inside], time[inside]))
    assert worst(motion(run)[1:], motion(same)[1:]) < 5e-6
    at = np.searchsorted(time, run.time + 1e-9, side="right") - 1
    np.testing.assert_array_equal(run.current[:-1, 0], current[at][:-1])


def test_coil_currents_are_measured_before_they_change(stiffening, strong_motion, rule):
    controller = rule(lambda t, m: 1.0 + t, 0.1)
    simulate(stiffening, strong_motion, controller, driver=CoilDriver(initial=0.7))
    seen = [m.coil0_current_A for m in controller.seen]
    np.testing.assert_allclose(seen, [0.7, *controller.commands[:-1]], rtol=1e-15)


@pytest.mark.parametrize("measures", [(), ("base_displacement_m",)])
def test_noise_of_an_unknown_quantity_is_refused(stiffening, strong_motion, rule, held, measures):
    sensors = Sensors(noise={"velocity": 0.01})
    controller = rule(lambda t, m: 1.5, 0.1, measures) if measures else held()
    message = (
        r"sensors: noise: given 'velocity'; did you mean 'velocity_m_s'\? expected: "
        "displacement_m, velocity_m_s, acceleration_m_s2, drift_m, deformation_m, "
        "force_N, base_displacement_m"
    )
    with pytest.raises(InputError, match=message):
        simulate(stiffening, strong_motion, controller, sensors=sensors)


def test_the_quantities_are_those_of_the_outputs(stiffening):
    names = output_names(stiffening)
    assert all(name.endswith(QUANTITIES) for name in names)
    assert all(any(name.endswith(q) for name in names) for q in QUANTITIES)


def test_noise_comes_from_its_seed_and_has_its_standard_deviation(stiffening, strong_motion, rule):
    def measure(**options):
        controller = rule(lambda t, m: 1.5, 0.005, ("base_displacement_m", "floor1_velocity_m_s"))
        simulate(stiffening, strong_motion, controller, sensors=Sensors(**options))
        return np.array(controller.seen)

    clean = measure()
    noise = {"displacement_m": 2e-3, "floor1_velocity_m_s": 0.05}
    one, again = measure(noise=noise, seed=5), measure(noise=noise, seed=5)
    other = measure(noise=noise, seed=6)
    np.testing.assert_array_equal(one, again)
    error = (one - clean)[:, :2] / [2e-3, 0.05]
    n = len(error)
    assert np.all(np.abs(error.std(0) - 1) < 4 / np.sqrt(2 * n))
    assert np.all(np.abs(error.mean(0)) < 4 / np.sqrt(n))
    assert np.abs(np.corrcoef(error.T)[0, 1]) < 4 / np.sqrt(n)
    assert np.abs(np.corrcoef(error[:-1, 0], error[1:, 0])[0, 1]) < 4 / np.sqrt(n)
    assert np.abs(np.corrcoef(error[:, 0], (other - clean)[:, 0])[0, 1]) < 4 / np.sqrt(n)
    np.testing.assert_array_equal(one[:, 2], clean[:, 2])  # the coil knows its current


def test_noise_of_one_output_goes_before_that_of_its_quantity(stiffening, strong_motion, rule):
    for noise in (
        {"displacement_m": 1e-3, "base_displacement_m": 0.0},
        {"base_displacement_m": 0.0, "displacement_m": 1e-3},
    ):
        controller = rule(lambda t, m: 1.5, 0.5)
        simulate(stiffening, strong_motion, controller, sensors=Sensors(noise=noise))
        assert controller.seen[0].base_displacement_m == 0.0, noise


def test_noise_of_nothing_that_is_measured_is_refused(stiffening, strong_motion, rule):
    with pytest.raises(InputError, match=r"'accelration_m_s2'.*base_displacement_m"):
        simulate(
            stiffening, strong_motion, rule(law_of_motion, 0.1),
            sensors=Sensors(noise={"accelration_m_s2": 1.0}),
        )  # fmt: skip


@pytest.mark.parametrize(
    ("options", "part"),
    [({"delay": -0.1}, "delay"), ({"delay": np.nan}, "delay"), ({"sampling": 0.0}, "sampling"),
     ({"noise": {"displacement_m": -1.0}}, "noise of displacement_m")],
)  # fmt: skip
def test_sensors_that_cannot_be_are_refused(options, part):
    with pytest.raises(InputError, match=part):
        Sensors(**options)


def test_measuring_what_is_not_there_names_the_nearest(stiffening, strong_motion, rule):
    with pytest.raises(InputError, match="did you mean 'base_velocity_m_s'"):
        simulate(stiffening, strong_motion, rule(law_of_motion, 0.1, ("base_velocty_m_s",)))


@pytest.mark.parametrize("time", [[0.0, 1.234567, 2.0], [0.0, 1.23, 1.2345, 3.999]])
def test_steps_end_where_the_current_changes(
    time, stiffening, strong_motion, scheduled, by_scipy, worst, motion
):
    """Instants between samples."""
    amperes = np.array([0.5, 3.0, 1.0, 2.5])[: len(time)]
    run = simulate(stiffening, strong_motion, scheduled(amperes, time))
    assert np.all(np.abs(run.grid.time[:, None] - time).min(0) < 1e-8)

    def current(start, t):
        return (amperes[np.searchsorted(time, start + 1e-9, side="right") - 1],)

    q, v, _ = by_scipy(stiffening, [strong_motion], current, time)
    assert worst(motion(run), np.concatenate([q, v], axis=1)) < 5e-6


def test_command_just_before_the_end(stiffening, strong_motion, scheduled, held, motion, worst):
    end = strong_motion.duration
    run = simulate(stiffening, strong_motion, scheduled([1.5, 2.0], [0.0, end - 1e-9]))
    assert worst(motion(run), motion(simulate(stiffening, strong_motion, held()))) < 1e-9


@pytest.mark.parametrize("time", [[0.0, 2.0, 1.0], [-1.0, 1.0, 2.0], [0.0, 1.0, np.nan]])
def test_schedule_with_impossible_instants_is_refused(time, stiffening, strong_motion, scheduled):
    with pytest.raises(InputError, match="instant"):
        simulate(stiffening, strong_motion, scheduled([1.0, 2.0, 3.0], time))


def test_command_for_another_number_of_coils_is_refused(stiffening, strong_motion, rule):
    with pytest.raises(InputError, match=r"rule.*2 .*1"):
        simulate(stiffening, strong_motion, rule(lambda t, m: [1.0, 2.0], 0.1))


@pytest.mark.parametrize("period", [0.0, -1.0, np.nan])
def test_period_that_cannot_be_is_refused(period, stiffening, strong_motion, rule):
    with pytest.raises(InputError, match="rule: period"):
        simulate(stiffening, strong_motion, rule(law_of_motion, period))
