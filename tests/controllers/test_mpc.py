"""Predictive control: prediction, programme, safety, preview."""

from dataclasses import replace
from types import MethodType

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.signal import TransferFunction, lfilter, lsim

from controllers import controller
from controllers.best_constant import weighted_peak
from controllers.coils import coil_table
from controllers.compiled import CompiledController
from controllers.mpc import MPC
from controllers.predictive.condense_kernel import condense
from controllers.predictive.decision import ACCELERATION_AHEAD, DEVIATIONS, FAILED, STATE
from controllers.predictive.flat_arrays import array1
from controllers.predictive.force_scale import balance, learn_scale
from controllers.predictive.ground_kernel import (
    DRIFT,
    FORGETTING,
    RECENT,
    extrapolate,
    forecast_deviation,
    ground_innovation,
    least_squares_update,
    look_ahead,
)
from controllers.predictive.linear_devices import spring_and_dashpot
from controllers.predictive.prediction import Prediction, growing_blocks
from controllers.predictive.slow_ground import follow_slow, slow_lengths
from ground_motions import Record, mavroeidis_papageorgiou_pulse
from isolation_sim.errors import InputError
from isolation_sim.laws import Device
from isolation_sim.laws.current_dependence import CurrentDependence
from isolation_sim.laws.registry import LAWS
from isolation_sim.scenario.building import MoatWall
from isolation_sim.simulation.batch import Case, simulate_many
from isolation_sim.simulation.complex_modes import real_rows
from isolation_sim.simulation.control import CoilDriver, Sensors
from isolation_sim.simulation.plan import modes_for
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import (
    from_matrices,
    reference_building,
    reference_isolators,
    shear_building,
)

from .conftest import context_of
from .predictor import Predictor, Uncontrolled

LAGGING = CoilDriver(lag=0.05, high=3.0)
WITHOUT_REGRET = np.array([1.0] * 8 + [0.0])
COILS = np.array([[0.05, np.inf, 0.0, 3.0, 0.0]])


@pytest.fixture(scope="module")
def started(isolated, record):
    """A run with a wandering current, and its state after 3 s as a prediction takes it."""
    time = np.arange(0, 8, 0.02)
    commands = 1.5 + 1.2 * np.sin(3 * time)
    run = simulate(
        isolated, record, controller("prescribed", time=time, amperes=commands), driver=LAGGING
    )
    names, at = isolated.structure.names, 150
    q = np.array([run.output(f"{name}_displacement_m")[at] for name in names])
    v = np.array([run.output(f"{name}_velocity_m_s")[at] for name in names])
    return run, at, q, v, commands[:, np.newaxis]


def kelvin_voigt(**numbers):
    dependence = CurrentDependence.polynomial(numbers)
    return Device(LAWS["kelvin_voigt"], dependence, current_range=(0.0, 3.0))


def predicted(started, n_blocks=10, n_steps=40, change=None, longest=np.inf):
    run, at, q, v, commands = started
    block = np.arange(n_steps) * n_blocks // n_steps
    prediction = Predictor(run.isolated, COILS, 0.02, block, longest)
    plan = commands[at : at + n_steps].copy()
    if change is not None:
        plan[block == change[0]] += change[1]
    ground = run.records[0].acceleration[at : at + n_steps + 1, np.newaxis].copy()
    prediction.predict(
        prediction.modes_of(q, v), run.states[at].copy(), run.current[at].copy(), plan,
        prediction.between(ground),
    )  # fmt: skip
    return prediction


def test_prediction_is_the_engines_response(started):
    run, at = started[:2]
    prediction = predicted(started)
    names = run.isolated.structure.names
    outputs = [f"{name}_acceleration_m_s2" for name in names]
    outputs = ["base_displacement_m", *outputs, "base_velocity_m_s"]
    for column, name in enumerate(outputs):
        exact = run.output(name)[at : at + 41]
        error = np.abs(prediction.y[:, column] - exact)
        assert error.max() < 0.04 * np.abs(exact).max()
        assert error[0] < 1e-9 * np.abs(exact).max()


def test_substeps_bring_the_prediction_to_the_engines_response(started):
    run, at = started[:2]
    names = [f"{name}_acceleration_m_s2" for name in run.isolated.structure.names]
    names = ["base_displacement_m", *names, "base_velocity_m_s"]
    exact = np.transpose([run.output(name)[at : at + 41] for name in names])
    coarse, middle, fine = (
        np.abs(predicted(started, longest=longest).y - exact).max(axis=0)
        for longest in (0.01, 0.005, 0.0025)
    )
    # second order
    assert np.all(middle < 0.4 * coarse) and np.all(fine < 0.4 * middle)


@pytest.mark.parametrize("longest", [np.inf, 0.005])
def test_derivatives_are_those_of_the_prediction(started, longest):
    exact = predicted(started, longest=longest).dy.copy()
    step = 1e-5
    for block in (0, 4, 9):
        ahead = predicted(started, change=(block, step), longest=longest).y
        behind = predicted(started, change=(block, -step), longest=longest).y
        difference = (ahead - behind) / (2 * step)
        scale = np.abs(difference).max(axis=0)
        assert np.all(np.abs(exact[:, :, block] - difference) <= 1e-6 * scale)


def test_derivatives_remember_nothing_of_the_call_before(started):
    run, at, q, v, commands = started
    prediction = predicted(started, n_blocks=40)
    y, dy, past = prediction.y.copy(), prediction.dy.copy(), prediction.past.copy()
    z = prediction.modes_of(q, v)
    states, current = run.states[at].copy(), run.current[at].copy()
    ground = prediction.between(run.records[0].acceleration[at : at + 41, np.newaxis])
    prediction.predict(-3 * z, states, current, commands[: len(prediction.block)].copy(), -ground)
    assert np.abs(prediction.dy - dy).max() > 0.1 * np.abs(dy).max()
    plan = commands[at : at + len(prediction.block)].copy()
    prediction.predict(z, states, current, plan, ground)
    for again, once in ((prediction.y, y), (prediction.dy, dy), (prediction.past, past)):
        assert np.array_equal(again, once)


def test_followed_device_states_are_the_plants(started):
    run, at = started[:2]
    prediction, states = predicted(started), None
    states = prediction.initial_states()
    modes = run.modal[run.grid.samples]
    for k in range(at):
        current = (run.current[k] + run.current[k + 1]) / 2
        prediction.follow(modes[k], modes[k + 1], 0.02, states, current)
    assert np.abs(states - run.states[at]).max() < 1e-3 * np.abs(run.states).max()


@pytest.mark.parametrize(("n_steps", "n_blocks"), [(1, 1), (40, 20), (60, 20), (30, 30), (7, 3)])
def test_blocks_begin_with_single_steps_and_grow(n_steps, n_blocks):
    block = growing_blocks(n_steps, n_blocks)
    lengths = np.bincount(block)
    assert len(block) == n_steps and len(lengths) == n_blocks
    assert np.all(np.diff(block) >= 0) and lengths.min() >= 1
    if n_steps > 2 * n_blocks:
        assert lengths[0] <= 2 < lengths[-1]
    elif n_steps > n_blocks:
        assert lengths[0] == 1 < lengths[-1]


@pytest.mark.parametrize(("ahead", "longest"), [(0, np.inf), (0, 0.01), (25, 0.005)])
def test_uncontrolled_peaks_are_those_of_a_run_without_current(isolated, record, ahead, longest):
    run = simulate(isolated, record, controller("passive_off"), driver=LAGGING)
    displacement = np.abs(run.output("base_displacement_m"))
    acceleration = np.abs(
        [run.output(f"{name}_acceleration_m_s2") for name in isolated.structure.names]
    ).max(axis=0)
    one = Uncontrolled(isolated, COILS, 0.02, longest, ahead)
    ground = np.array(record.acceleration[:, np.newaxis])
    for k in range(300):
        one.follow_ground(one.between(ground[k : k + 1 + ahead]))
        if k in (100, 299):
            seen = k + 1 + ahead
            assert one.peaks[0] == pytest.approx(displacement[:seen].max(), rel=0.02)
            assert one.peaks[1] == pytest.approx(acceleration[:seen].max(), rel=0.03)


def test_the_course_without_current_is_that_of_a_run_on_the_forecast_ground(isolated, record):
    run = simulate(isolated, record, controller("passive_off"), driver=LAGGING)
    displacement = np.abs(run.output("base_displacement_m"))
    acceleration = np.abs(
        [run.output(f"{name}_acceleration_m_s2") for name in isolated.structure.names]
    ).max(axis=0)
    known, n_ahead = 6, 40
    one = Uncontrolled(isolated, COILS, 0.02, 0.01, known - 1, n_ahead)
    ground = np.array(record.acceleration[:, np.newaxis])
    # the forecast is right, so that the peaks go on as those of the run do
    for k in range(50):
        one.follow_ground(one.between(ground[k : k + known + n_ahead]))
    exact = np.maximum.accumulate(np.stack([displacement, acceleration], axis=1))
    assert one.peak_history.shape == (known + n_ahead, 2)
    assert exact[49 + known + n_ahead, 1] > 1.1 * exact[49, 1]
    np.testing.assert_allclose(one.peak_history, exact[49 : 49 + known + n_ahead], rtol=0.03)


@pytest.mark.parametrize(
    "settings",
    [{}, pytest.param({"filter": "extended", "learning": 20.0}, marks=pytest.mark.slow)],
)
def test_a_near_fault_pulse_is_not_answered_with_more_acceleration(isolated, settings):
    """With neither regret nor caution in its forecast the controller loses; it does not with both.

    A velocity pulse of 1 s: no constant current is better than none, whose J is 2.
    """
    pulse = mavroeidis_papageorgiou_pulse(0.34, 1.0, 2.6, 0.3, 0.02, after=3.0)
    off = simulate(isolated, pulse, controller("passive_off"), driver=LAGGING)

    def over_off(**value):
        run = simulate(isolated, pulse, MPC(**settings, **value), driver=LAGGING)
        return weighted_peak(run, off)

    assert over_off(regret=0.0, fading=None) > 2.15
    assert over_off() < 2.02


@pytest.mark.parametrize("sign", [1.0, pytest.param(-1.0, marks=pytest.mark.slow)])
def test_a_long_pulse_is_ridden_out_stiffly(isolated, sign):
    """Constant 3 A is far better than none under it; too late, mpc has no gain at all."""
    pulse = mavroeidis_papageorgiou_pulse(0.5, 4.5, 2.0, 0.5, 0.02, after=4.0).scaled(sign)
    off, on = (
        simulate(isolated, pulse, controller(name), driver=LAGGING)
        for name in ("passive_off", "passive_on")
    )
    late, early = (
        weighted_peak(simulate(isolated, pulse, MPC(stiff_start=start), driver=LAGGING), off)
        for start in (0.0, MPC.stiff_start)
    )
    assert weighted_peak(on, off) < 1.2
    assert late > weighted_peak(on, off) + 0.3
    assert early < weighted_peak(on, off) + 0.02


@pytest.mark.parametrize("period", [2.6, 4.5])
def test_with_preview_the_stiff_start_costs_nothing_under_a_pulse(isolated, period):
    """The best constant current is none under the shorter pulse, the highest under the longer."""
    pulse = mavroeidis_papageorgiou_pulse(0.45, period, 2.0, 0.5, 0.02, after=4.0).scaled(-1.0)
    off, on, ahead = (
        simulate(isolated, pulse, one, driver=LAGGING)
        for one in (controller("passive_off"), controller("passive_on"), MPC(preview=0.8))
    )
    stiff = weighted_peak(on, off)
    assert (stiff > 2.0) == (period < 3.0)
    assert weighted_peak(ahead, off) < min(stiff, 2.0)


def swing(period):
    """A sinusoid that begins gently, 12 s at 50 Hz, m/s^2."""
    time = np.arange(0, 12, 0.02)
    return (1.0 - np.exp(-((time / 2.0) ** 2))) * np.sin(2 * np.pi * time / period)


class SlowGround:
    """The samples so far of a ground motion that may be slow."""

    def __init__(self, step, limit):
        n_samples, n_rates = slow_lengths(step)
        self.fixed_inputs = step, limit, np.zeros((n_samples, 1)), np.zeros(n_rates), np.zeros(2)

    def follow(self, sample):
        return follow_slow(sample, 0.0, *self.fixed_inputs)


@pytest.mark.parametrize(("period", "slow"), [(1.0, False), (1.8, False), (2.6, True), (4.0, True)])
def test_slow_is_a_sinusoid_of_more_than_the_limit(period, slow):
    one = SlowGround(0.02, 2.1)
    lines = [one.follow(np.array([a])) for a in swing(period)]
    assert not lines[0] and any(lines)  # at rest; then it moves, and nothing is known yet
    assert lines[-1] == slow


def test_a_short_period_releases_for_good():
    one = SlowGround(0.02, 2.1)
    assert [one.follow(np.array([a])) for a in swing(4.0)][-1]
    assert not one.follow(np.array([-1.0]))
    assert not any(one.follow(np.zeros(1)) for _ in range(50))


def solved_programmes(monkeypatch, isolated, ground, **settings):
    """Every programme of a run and its solution."""
    memory_array, decide = [], MPC.current

    def recorded(self, t, measurement):
        command = decide(self, t, measurement)
        if self.report.iterations[-1]:
            programme, x = self.programme()
            memory_array.append(([np.array(a) for a in programme], x.copy()))
        return command

    monkeypatch.setattr(MPC, "current", recorded)
    one = MPC(**settings)
    simulate(isolated, ground, one, driver=LAGGING)
    return one, memory_array


def test_solutions_are_those_of_an_interior_point_method(monkeypatch, isolated, record):
    import casadi

    one, memory_array = solved_programmes(monkeypatch, isolated, record.cut(0.0, 4.0))
    # while the start is stiff, none is solved
    assert len(memory_array) > 150 and one.report.failed == 0
    worst = 0.0
    for (hessian, gradient, rows, upper, lower), x in memory_array[20::40]:
        n = len(gradient)
        unknown = casadi.SX.sym("x", n)
        cost = casadi.bilin(hessian, unknown, unknown) / 2 + casadi.dot(gradient, unknown)
        problem = {"x": unknown, "f": cost, "g": casadi.mtimes(casadi.DM(rows), unknown)}
        options = {"ipopt.print_level": 0, "print_time": False, "ipopt.tol": 1e-12,
                   "ipopt.bound_relax_factor": 0.0, "ipopt.sb": "yes"}  # fmt: skip
        solver = casadi.nlpsol("qp", "ipopt", problem, options)
        limits = [np.where(np.abs(b) < 1e29, b, np.copysign(np.inf, b)) for b in (lower, upper)]
        other = solver(lbx=limits[0][:n], ubx=limits[1][:n], lbg=limits[0][n:], ubg=limits[1][n:])
        cost_of = [0.5 * p @ hessian @ p + gradient @ p for p in (x, np.ravel(other["x"]))]
        worst = max(worst, (cost_of[0] - cost_of[1]) / max(1.0, abs(cost_of[1])))
        assert x[0] == pytest.approx(float(other["x"][0]), abs=1e-4)
    assert worst < 1e-6


@pytest.mark.parametrize("lag", [0.0, 1e-4, 0.05])
def test_no_bound_and_no_slew_is_ever_violated(isolated, record, lag):
    driver = CoilDriver(lag=lag, slew=10.0, low=0.5, high=2.0, initial=1.0)
    one = MPC(preview=0.4, effort=0.0, displacement=1.0)
    run = simulate(isolated, record, one, driver=driver)
    assert run.command.min() >= 0.5 and run.command.max() <= 2.0
    if lag > 0:
        reach = 10.0 * 0.02 / (1 - np.exp(-0.02 / lag))
        assert np.abs(run.command - run.current).max() <= reach * (1 + 1e-6)
    else:
        steps = np.diff(run.command[:, 0], prepend=1.0)
        assert np.abs(steps).max() <= 10.0 * 0.02 * (1 + 1e-6)
    assert one.report.failed == 0 and np.ptp(run.command) > 0.5


@pytest.mark.parametrize("wrong", ["no current within reach", "not a number"])
def test_unusable_solutions_are_counted_and_the_plan_before_is_retained(isolated, wrong):
    driver = CoilDriver(lag=0.05, slew=10.0, high=2.0, initial=0.7)
    one = MPC(stiff_start=0.0)
    context = replace(context_of(one, isolated, high=2.0), driver=driver)
    one.reset(context)
    measured = np.zeros(len(context.outputs))
    # the slew allows 0.6 A more or less than the coil has, and the supply 2 A
    measured[-1] = 3.0 if wrong == "no current within reach" else 0.7
    measured[0] = 0.01 if wrong == "no current within reach" else np.nan
    commands = [one.current(0.02 * k, measured) for k in range(10)]
    assert one.report.failed == len(one.report.seconds) == 10
    # as near to the plan as the coil can follow
    assert np.all(np.array(commands) == (2.0 if wrong == "no current within reach" else 0.7))
    assert "10 failed" in str(one.report)


def test_plain_python_and_a_batch_decide_as_the_run_does(isolated, record):
    """The function without the compiler; side by side, with no Python between the decisions."""
    one, part = MPC(horizon=0.2, blocks=4, stiff_start=0.0), record.cut(1.0, 2.5)
    run = simulate(isolated, part, one, driver=LAGGING)
    plain = MPC(horizon=0.2, blocks=4, stiff_start=0.0)
    plain.current = MethodType(CompiledController.current, plain)
    again = simulate(isolated, part, plain, driver=LAGGING)
    np.testing.assert_allclose(again.command, run.command, rtol=0, atol=1e-12)
    assert np.ptp(run.command) > 0.3
    motions = [part.scaled(factor) for factor in np.linspace(0.3, 1.0, 8)]
    batch = simulate_many([Case(isolated, motion, one) for motion in motions], driver=LAGGING)
    for name in ("peak_base_displacement_m", "peak_floor_acceleration_m_s2"):
        assert batch.criteria[name][-1] == run.criteria[name]


def test_late_solutions_are_counted_and_the_plan_before_is_retained(isolated, record):
    one = MPC(deadline=1e-9, stiff_start=0.0)
    run = simulate(isolated, record.cut(0.0, 2.0), one, driver=CoilDriver(initial=0.7))
    assert one.report.late == 100 and np.all(run.command == 0.7)


@pytest.mark.parametrize("preview", [0.0, 0.5])
def test_sees_no_further_than_its_preview(isolated, record, preview):
    changed = record.acceleration.copy()
    changed[200:] = 0.0
    other = Record(changed, record.dt)
    first, second = (
        simulate(isolated, ground, MPC(preview=preview), driver=LAGGING).command
        for ground in (record, other)
    )
    differs = np.flatnonzero(np.any(first != second, axis=1))
    assert 200 - preview / record.dt <= differs[0] <= 202 - preview / record.dt


def test_preview_lowers_the_weighted_peaks_of_el_centro(isolated, record):
    def weighted(one):
        run = simulate(isolated, record, one, driver=LAGGING)
        return sum(run.criteria[f"peak_{q}"] / off.criteria[f"peak_{q}"] for q in (
            "base_displacement_m", "floor_acceleration_m_s2"))  # fmt: skip

    off = simulate(isolated, record, controller("passive_off"), driver=LAGGING)
    best = weighted(controller("best_constant"))
    assert weighted(MPC(preview=0.8)) < 0.8 * best
    assert weighted(MPC()) < 0.98 * best


def test_autoregressive_model_is_the_weighted_least_squares():
    rng = np.random.default_rng(3)
    series, order = [0.0, 0.0], 2
    for _ in range(400):
        series.append(1.6 * series[-1] - 0.8 * series[-2] + rng.normal())
    past, coefficients, covariance = np.zeros(order), np.zeros(order), np.eye(order)
    noise, errors = np.zeros(1), []
    for value in series:
        errors.append(value - coefficients @ past)
        least_squares_update(value, past, coefficients, covariance, np.zeros(order), noise)
    rows = np.stack([series[1:-1], series[:-2]], axis=1)
    weight = np.sqrt(FORGETTING ** np.arange(len(rows))[::-1])
    exact = np.linalg.lstsq(rows * weight[:, None], np.array(series[2:]) * weight, rcond=None)[0]
    assert np.allclose(coefficients, exact, atol=2e-3)
    weight = (1 - RECENT) * RECENT ** np.arange(len(errors))[::-1]
    assert noise[0] == pytest.approx(weight @ np.square(errors))

    past[0] = 1.0
    ground = np.array([1.0, 0.5, 0.0, 0.0])
    extrapolate(2, coefficients, past, ground, np.zeros(2), (0.0, 0.02, 1.0, 0.9), np.zeros(4))
    # every forecast keeps 0.9 of what the model expects
    expected = 0.9 * np.clip(coefficients @ [0.5, 1.0], -1.0, 1.0)
    assert ground[2] == pytest.approx(expected)
    assert ground[3] == pytest.approx(0.9 * np.clip(coefficients @ [expected, 0.5], -1.0, 1.0))


def test_the_ground_s_velocity_comes_back_to_zero():
    """Without drive it decays; what is expected of a driven ground has the drive it was made of."""
    h, steps, settling = 0.02, 400, 0.8
    returning = (1.0 / settling, h, 1.0, 1.0)
    ground, motion = np.zeros(steps + 1), np.array([0.0, 0.3])
    extrapolate(1, np.zeros(0), np.zeros(0), ground, motion.copy(), returning, np.zeros(steps + 1))
    velocity = 0.3 + cumulative_trapezoid(ground, dx=h, initial=0.0)
    # the acceleration starts from 0, not from the pull
    expected = velocity[1] * np.exp(-np.arange(steps) * h / settling)
    np.testing.assert_allclose(velocity[1:], expected, atol=2e-4)
    # an acceleration from its own drive, by the differential equation of the velocity
    time = np.arange(steps + 1) * h
    acceleration = np.sin(3.0 * time) * np.exp(-0.5 * time)
    at, innovations = np.zeros(2), []
    for value in acceleration:
        innovations.append(ground_innovation(value, at, returning))
    velocity = cumulative_trapezoid(acceleration, dx=h, initial=0.0)
    np.testing.assert_allclose(innovations, acceleration + velocity / settling, atol=1e-12)
    # known samples give the same
    computed = np.zeros(steps + 1)
    extrapolate(steps + 1, np.zeros(0), np.zeros(0), acceleration, np.zeros(2), returning, computed)
    np.testing.assert_allclose(computed[1:], innovations[1:], atol=1e-12)


@pytest.mark.slow
def test_a_random_motion_is_foreseen_better_by_its_velocity():
    """The share of the velocity's change over 0.6 s that is known, on motions of another program.

    The ground is white noise through Kanai and Tajimi's and Clough and Penzien's filters, made
    by SciPy, not by the project.
    """
    h, ahead = 0.02, 30
    ground_filter = ([20.0 * 0.4, 100.0], [1.0, 8.0, 100.0])
    second = ([1.0, 0.0, 0.0], [1.0, 1.2, 1.0])
    system = TransferFunction(
        np.polymul(ground_filter[0], second[0]), np.polymul(ground_filter[1], second[1])
    )
    known = {}
    for settling in (None, 1.0):
        pull = 0.0 if settling is None else 1.0 / settling
        returning = (pull, h, float(np.exp(-h / DRIFT)), 1.0)
        errors, changes = [], []
        for seed in range(4):
            time = np.arange(2000) * h
            noise = np.random.default_rng(seed).normal(size=2000)
            _, series, _ = lsim(system, noise, time)
            past, coefficients, covariance = np.zeros(10), np.zeros(10), 0.01 * np.eye(10)
            motion, variance = np.zeros(2), np.zeros(1)
            for k in range(2000 - ahead):
                now = ground_innovation(series[k], motion, returning)
                least_squares_update(now, past, coefficients, covariance, np.zeros(10), variance)
                if k >= 500 and k % 5 == 0:
                    ground = np.zeros(ahead + 1)
                    ground[0] = series[k]
                    extrapolate(
                        1, coefficients, past, ground, motion.copy(), returning,
                        np.zeros(ahead + 1),
                    )  # fmt: skip
                    changes.append(series[k + 1 : k + 1 + ahead].sum() * h)
                    errors.append(changes[-1] - ground[1:].sum() * h)
        known[settling] = 1.0 - np.mean(np.square(errors)) / np.mean(np.square(changes))
    assert known[1.0] > known[None] + 0.1


def test_without_a_model_the_ground_is_expected_to_rest(isolated, record):
    one = MPC(order=0, settling=None)
    simulate(isolated, record.cut(0.0, 3.0), one, driver=LAGGING)
    assert one.report.failed == 0 and one.memory_array(DEVIATIONS)[1:].min() > 0.0
    ahead = one.memory_array(ACCELERATION_AHEAD)
    assert np.abs(ahead[:, 0]).max() > 0.0 and not ahead[:, 1:].any()


def test_accelerations_vary_as_drawn_from_the_model(isolated):
    """Against the spread of predictions under many continuations of the ground motion."""
    rng = np.random.default_rng(4)
    coefficients, noise, reach, n_draws = np.array([[1.5, -0.7]]), 0.04, 4, 2000
    prediction = Predictor(isolated, COILS, 0.02, np.arange(8))
    pulses = np.concatenate([prediction.pulses(np.array([i]), reach) for i in (0.0, 3.0)])
    deviations = np.zeros((reach + 1, prediction.n_accelerations, 2))
    forecast_deviation(coefficients, np.array([[noise]]), pulses, np.zeros(reach), deviations)
    for k, current in enumerate((0.0, 3.0)):
        drawn = np.empty((n_draws, reach + 1, prediction.n_accelerations))
        for draw in drawn:
            ground = np.zeros((9, 1))
            for at in range(1, 9):
                known = coefficients[0, : min(at, 2)] @ ground[at - 1 :: -1, 0][:2]
                ground[at] = known + rng.normal(0.0, noise**0.5)
            prediction.predict(
                np.zeros(12), prediction.initial_states(), np.array([current]),
                np.full((8, 1), current), prediction.between(ground),
            )  # fmt: skip
            draw[:] = prediction.y[: reach + 1, 1:7]
        spread = drawn.std(axis=0)
        assert np.all(
            np.abs(deviations[..., k] - spread) <= 0.08 * spread.max(axis=1, keepdims=True)
        )
    assert np.all(deviations[1:, 0, 1] > deviations[1:, 0, 0])


def condensed(p, level, clear, weights, resting, without=0.0):
    """The programme around 1.5 A, in units of 0.1 m and 1 m/s^2, three samples known; its rows."""
    n_steps, n_outputs, width = p.dy[1:].shape
    n = width + 3
    most = 4 * (n_steps + 1) * n_outputs
    without = np.broadcast_to(without, n_steps + 1).copy()
    programme = (np.zeros((n, n)), np.zeros(n), np.zeros((most, n)), *np.zeros((2, n + most)))
    plan = np.full((n_steps, 1), 1.5)
    count = condense(
        tuple(p.own_results), plan, plan[0], p.block, COILS, 0.02, (1, 6),
        np.array([0.1, 1.0, 0.3]), np.full(2, level), (3, 1.0, clear, without), weights, resting,
        programme, np.zeros(width),
    )  # fmt: skip
    return programme, count


def test_margin_lowers_the_level_of_accelerations_the_more_the_higher_the_current(started):
    def constraints(clear):
        p = predicted(started)
        (_, gradient, rows, upper, _), count = condensed(
            p, -100.0, clear, WITHOUT_REGRET, np.zeros(8)
        )
        # all are above such levels: both signs of a displacement and six accelerations, every step
        shape, n = (len(p.dy), 7, 2), len(gradient)
        return p.past, rows[:count].reshape(*shape, n), upper[n : n + count].reshape(shape)

    clear = np.zeros((3, 6, 2))
    clear[1], clear[2] = (0.1, 0.1), (0.2, 0.5)
    _, rows, upper = constraints(np.zeros((3, 6, 2)))
    past, rows_known, upper_known = constraints(clear)
    assert np.array_equal(rows_known[:, 0], rows[:, 0])
    assert np.array_equal(upper_known[:, 0], upper[:, 0])
    assert np.array_equal(upper_known[:3], upper[:3])  # three samples of the ground are known
    assert np.allclose(upper[3, 1:] - upper_known[3, 1:], 0.1)
    # from the second unforeseen sample on: 0.2 without current, 0.5 with 3 A
    after = np.minimum(np.arange(4, 41), 39)
    current, slope = past[after, 0, -1], past[after, 0, :-1]
    expected = 0.2 + 0.3 * current / 3.0
    assert np.allclose((upper - upper_known)[4:, 1:], expected[:, np.newaxis, np.newaxis])
    moved = (rows_known - rows)[4:, 1:, :, :-3]
    assert np.allclose(moved, 0.3 * slope[:, np.newaxis, np.newaxis])
    assert np.abs(moved).max() > 0.1


def test_the_regret_is_above_the_accelerations_without_current_step_by_step(started):
    """Its rows are those of the accelerations over their level, with a bound and a slack apart."""
    p, unseen = predicted(started), np.zeros((3, 6, 2))
    weights, without = np.zeros(9), -100.0 - np.arange(41.0)
    weights[8] = 1.0
    (_, gradient, rows, upper, _), count = condensed(p, 0.0, unseen, weights, np.zeros(8), without)
    n = len(gradient)
    assert gradient[-1] == 1.0
    assert count == 41 * 6 * 2  # both signs of six accelerations, every step, and nothing else
    assert np.all(rows[:count, -3:] == [0.0, 0.0, -1.0])
    both = upper[n : n + count].reshape(41, 6, 2)
    np.testing.assert_allclose(both[..., 0], without[:, np.newaxis] - p.y[:, 1:7])
    np.testing.assert_allclose(both[..., 1], without[:, np.newaxis] + p.y[:, 1:7])
    weights[7], weights[8] = 1.0, 0.0
    (_, _, over_level, *_), _ = condensed(p, -100.0, unseen, weights, np.zeros(8))
    np.testing.assert_array_equal(rows[:count, :-3], over_level[:count, :-3])


def test_a_programme_leaves_the_prediction_as_it_is(started):
    """Two programmes of one prediction are the same, and derivatives stay in m/A and m/s^2/A."""
    p = predicted(started)
    values = [array.copy() for array in p.own_results]
    results = [condensed(p, 1.0, np.zeros((3, 6, 2)), np.ones(9), np.zeros(8)) for _ in range(2)]
    for array, before in zip(p.own_results, values, strict=True):
        assert np.array_equal(array, before)
    (first, count), (second, again) = results
    assert count == again
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


def test_the_cost_at_the_end_is_on_the_amplitude_once_the_ground_rests(started):
    weights, unseen = np.zeros(9), np.zeros((3, 6, 2))
    weights[2] = 0.7
    p = predicted(started)
    end, by_command = p.y[-1, [0, 7]], 3.0 * p.dy[-1, [0, 7]]  # a range of 3 A is the unit
    square = np.diag([1 / 0.1**2, 1 / 0.3**2])
    curvature = 2 * 0.7 * by_command.T @ square @ by_command
    for added in (np.zeros(2), np.array([-0.03, 0.2])):
        resting = np.array([added[0], *np.zeros(6), added[1]])
        (hessian, gradient, *_), _ = condensed(predicted(started), 100.0, unseen, weights, resting)
        hessian, gradient = hessian[:-3, :-3], gradient[:-3]
        np.testing.assert_allclose(gradient, 2 * 0.7 * by_command.T @ square @ (end + added))
        np.testing.assert_allclose(hessian, curvature, atol=1e-12 * np.abs(curvature).max())


class Ahead:
    """A ground motion in one direction that is looked ahead at, sample by sample."""

    def __init__(self, n_sub, n_steps, order, settling, memory_array):
        self.returning = 0.0 if settling is None else 1.0 / settling, 0.02, memory_array, 1.0
        self.n_sub, self.end = n_sub, np.zeros((1, 2))
        self.acceleration = np.zeros((1, n_steps + 1))
        self.path = np.zeros((1, n_steps * n_sub + 1))
        self.model = (
            np.zeros((1, 2)), self.end, np.zeros((1, order)), np.zeros((1, order)),
            0.01 * np.eye(order)[np.newaxis], np.zeros((1, 1)), np.zeros(order),
            np.zeros(n_steps + 1), np.zeros(0),
        )  # fmt: skip

    def look(self, measured, known):
        look_ahead(
            np.array([measured]), known, self.n_sub, self.returning, self.model,
            np.zeros((2, 0, 1)), self.acceleration, self.path, np.zeros((1, 1, 2)),
        )  # fmt: skip


def test_the_ground_s_velocity_at_the_end_is_that_of_the_motion_ahead(record):
    h, n_steps, n_known, decay = 0.02, 30, 20, np.exp(-0.02 / DRIFT)
    ahead = Ahead(1, n_steps, 0, None, decay)
    for k in range(100):
        ahead.look(record.acceleration[k], record.acceleration[k + 1 : k + 1 + n_known])
    # what is not known is expected to be at rest
    seen = np.concatenate([record.acceleration[: 100 + n_known], np.zeros(n_steps - n_known)])
    velocity = lfilter([decay * h / 2] * 2, [1.0, -decay], seen)
    assert ahead.end[0, 1] == pytest.approx(velocity[-1], rel=1e-9)
    assert abs(velocity[-1]) > 0.01


@pytest.mark.parametrize("n_known", [0, 6])
def test_what_is_known_of_the_ground_is_known_between_the_decisions(n_known):
    n_steps, n, rng = 10, 4, np.random.default_rng(2)
    motion = rng.normal(size=400)
    ahead = Ahead(n, n_steps, 3, 1.0, 1.0)
    for k in range(5):
        ahead.look(motion[4 * k], motion[4 * k + 1 : 4 * (k + n_known) + 1])
    np.testing.assert_allclose(ahead.path[0, : n_known * n + 1], motion[16 : 16 + n_known * n + 1])
    np.testing.assert_allclose(ahead.path[:, ::n], ahead.acceleration, atol=1e-12)
    # behind it, on lines
    bent = np.diff(ahead.path[0, n_known * n :], 2)
    bent[n - 1 :: n] = 0.0
    np.testing.assert_allclose(bent, 0.0, atol=1e-12)


def test_bases_move_with_the_ground_in_their_own_direction():
    none, turned = np.zeros((2, 2)), np.array([[0.8, -0.6], [0.6, 0.8]])
    plain = from_matrices(np.diag([2e5, 3e5]), none, none, influence=turned, base=(0, 1))
    isolated = plain.on(kelvin_voigt(k=(1e6, 1e6), c=1e4))
    coils = np.repeat(COILS, isolated.n_channels, axis=0)
    result = Prediction(isolated, coils, 0.02).along
    np.testing.assert_array_equal(result, turned)


@pytest.mark.slow
def test_linear_variant_predicts_with_springs_and_dashpots(isolated, record, monkeypatch):
    linear = spring_and_dashpot(isolated, COILS, 0.5)
    for current in (0.0, 1.25, 3.0):
        mine = linear.elements[0].device.linearised(current, 0.5)
        assert mine == pytest.approx(isolated.elements[0].device.linearised(current, 0.5), rel=1e-3)
    # in plain Python: a kernel of its own takes a minute to compile, for the same function
    settings, part = {"horizon": 0.4, "blocks": 8, "stiff_start": 0.0}, record.cut(1.0, 2.5)
    one = MPC(model="linear", **settings)
    with monkeypatch.context() as patch:
        patch.setattr("controllers.compiled.COMPILED", False)
        patch.setattr(MPC, "compiled", lambda self, context: None)
        run = simulate(isolated, part, one, driver=LAGGING)
    full = simulate(isolated, part, MPC(**settings), driver=LAGGING)
    assert one.report.failed == 0 and len(one.report.seconds) > 70
    assert np.abs(run.command - full.command).max() > 0.05


@pytest.mark.parametrize("observer", ["kalman", "extended"])
def test_an_observer_takes_most_of_the_noises_harm(isolated, record, observer):
    noise = {"displacement_m": 5e-4, "velocity_m_s": 5e-3, "acceleration_m_s2": 0.02,
             "deformation_m": 5e-4}  # fmt: skip

    def peak(filter_name, sensors):
        run = simulate(
            isolated, record, controller("mpc", filter=filter_name), driver=LAGGING, sensors=sensors
        )
        return run.criteria["peak_floor_acceleration_m_s2"]

    noisy = Sensors(noise=noise, seed=1)
    clean = peak("none", Sensors())
    assert peak(observer, noisy) - clean < 0.5 * (peak("none", noisy) - clean)


def test_with_an_observer_neither_displacements_nor_velocities_are_measured(isolated):
    expected = controller("mpc", filter="kalman").measures(isolated)
    names = isolated.structure.names
    assert expected == (
        *(f"{name}_acceleration_m_s2" for name in names), "isolator_deformation_m",
        "ground_acceleration_m_s2",
    )  # fmt: skip


def test_the_carried_state_is_the_plants(started):
    run, at, q, v, commands = started
    n_steps = 3
    prediction = Predictor(run.isolated, COILS, 0.02, np.zeros(n_steps))
    ground = run.records[0].acceleration[at : at + n_steps + 1, np.newaxis].copy()
    z, states, coil = prediction.carried(
        prediction.modes_of(q, v), run.states[at].copy(), run.current[at].copy(),
        commands[at : at + n_steps].copy(), prediction.between(ground),
    )  # fmt: skip
    names = run.isolated.structure.names
    later = [
        np.array([run.output(f"{name}_{what}")[at + n_steps] for name in names])
        for what in ("displacement_m", "velocity_m_s")
    ]
    exact, here = prediction.modes_of(*later), prediction.modes_of(q, v)
    assert np.abs(z - exact).max() < 0.02 * np.abs(exact - here).max()
    np.testing.assert_allclose(coil, run.current[at + n_steps], rtol=1e-6)
    moved = np.abs(run.states[at + n_steps] - run.states[at]).max()
    assert np.abs(states - run.states[at + n_steps]).max() < 0.05 * moved


def test_a_nominal_delay_makes_up_for_the_sensors(isolated, record):
    def peak(delay, nominal):
        run = simulate(
            isolated, record, controller("mpc", delay=nominal), driver=LAGGING,
            sensors=Sensors(delay=delay),
        )  # fmt: skip
        return run.criteria["peak_floor_acceleration_m_s2"]

    prompt, late, carried = peak(0.0, 0.0), peak(0.04, 0.0), peak(0.04, 0.04)
    assert carried - prompt < 0.5 * (late - prompt)


def test_half_a_period_of_delay_counts_as_one(isolated, record):
    none, half, whole = (
        simulate(isolated, record, controller("mpc", delay=delay, period=0.02)).command
        for delay in (0.0, 0.01, 0.02)
    )
    np.testing.assert_array_equal(half, whole)
    assert np.abs(half - none).max() > 0.1


def force_scale(isolated, step):
    """Estimate with a memory of 10 s."""
    prior = 0.1**2 / step
    inputs = *balance(isolated), float(np.exp(-step / 10.0)), prior, np.full(2, prior)
    return lambda acceleration, force: learn_scale(acceleration, force, *inputs)


def test_a_factor_on_the_force_is_learnt(isolated):
    structure, step, factor = isolated.structure, 0.02, 0.7
    estimate = force_scale(isolated, step)
    rng = np.random.default_rng(3)
    for _ in range(1000):
        force = 3e6 * rng.standard_normal(1)
        # internal forces, which every pair of levels exchanges, must not count
        inner = 2e5 * rng.standard_normal(structure.n_dofs)
        inner -= inner.mean()
        pull = -isolated.element_rows.T @ (factor * force) + inner
        result = estimate(np.linalg.solve(structure.mass, pull), force)
        assert 0.3 <= result <= 3.0
    assert result == pytest.approx(factor, rel=0.01)


def test_at_rest_the_estimate_stays(isolated):
    estimate = force_scale(isolated, 0.02)
    result = [estimate(np.zeros(isolated.structure.n_dofs), np.zeros(1)) for _ in range(1000)]
    assert result[-1] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("observer", "left"), [("none", 0.4), pytest.param("extended", 0.6, marks=pytest.mark.slow)]
)
def test_learning_makes_up_for_a_wrong_nominal_model(isolated, record, observer, left):
    element = isolated.elements[0]
    wrong = replace(element, device=element.device.scaled(force=0.7))
    nominal = replace(isolated, elements=(wrong,))

    def score(learning=None, nominal_device=None):
        law = controller("mpc", filter=observer, learning=learning)
        run = simulate(isolated, record, law, driver=LAGGING, nominal=nominal_device)
        off = simulate(isolated, record, controller("passive_off"), driver=LAGGING)
        names = ("peak_base_displacement_m", "peak_floor_acceleration_m_s2")
        return sum(run.criteria[n] / off.criteria[n] for n in names), law.report.force_scale

    (right, _), (misled, _) = score(), score(nominal_device=nominal)
    learnt, force_scale = score(20.0, nominal)
    assert force_scale == pytest.approx(1 / 0.7, rel=0.05)
    assert learnt - right < left * (misled - right)


def test_devices_without_coil_join_the_prediction(record):
    """A Maxwell damper in a storey: another law, with another number of states."""
    building = reference_building().on(kelvin_voigt(k=(4e6, 3e6), c=4e5))
    maxwell = Device(LAWS["maxwell"], CurrentDependence.constant({"k": 2e7, "c": 2e6}))
    damped = building.with_element(maxwell, "storey1")
    one = MPC(horizon=0.1, blocks=2)
    context = context_of(one, damped)
    run = simulate(damped, record.cut(0.0, 3.0), controller("passive_off"))
    seen = run.to_pandas()[list(context.outputs)].to_numpy()[100]
    decision, command = one.decision(context), np.full(1, np.nan)
    decision.function(2.0, seen, decision.settings, decision.memory, command, *decision.methods)
    assert array1(decision.memory, STATE)[FAILED] == 0 and 0.0 <= command[0] <= 3.0


def test_structure_without_a_coil_is_refused(record):
    plain = shear_building([1e5], [1e7], base_mass=1e5).on(kelvin_voigt(k=1e6, c=1e4))
    with pytest.raises(
        InputError, match="mpc: no element of the nominal model is driven by a coil"
    ):
        simulate(plain, record, MPC())


def test_coils_are_limited_to_tested_currents(isolated):
    table = coil_table(context_of(MPC(), isolated, high=9.0))
    assert table.tolist() == [[0.0, np.inf, 0.0, 3.0, 0.0]]


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_a_moat_wall_is_predicted(isolated, record, exponent):
    """Its force is a power of the overrun, whose derivative by the exponent has a logarithm."""
    walled = MoatWall(gap_m=0.05, stiffness_N_per_m=1e8, exponent=exponent).add_to(isolated)
    runs = [simulate(walled, record, c) for c in (controller("mpc"), controller("passive_off"))]
    planned, off = (run.criteria["peak_floor_acceleration_m_s2"] for run in runs)
    assert runs[1].criteria["peak_base_displacement_m"] > 0.05
    assert planned < 0.8 * off


def test_overdamped_modes_are_read_from_the_measured_motion(el_centro):
    own = reference_building()
    damped = from_matrices(own.mass, 30 * own.damping, own.stiffness)
    isolated = damped.on(reference_isolators())
    modes, _ = modes_for(isolated)
    assert np.any(modes.eigenvalues.imag == 0)
    coils = np.array([[0.05, np.inf, 0.0, 3.0, 0.0]])
    to_modes = Prediction(isolated, coils, 0.02).to_modes
    rows = real_rows(modes.shapes)
    np.testing.assert_allclose(rows @ to_modes, np.eye(len(rows)), atol=1e-9)
    part = el_centro.cut(1.0, 4.0)
    read, estimated = (
        simulate(isolated, part, MPC(**each)).current for each in ({}, {"filter": "kalman"})
    )
    assert np.abs(read - estimated).max() < 0.3 * np.ptp(read)
