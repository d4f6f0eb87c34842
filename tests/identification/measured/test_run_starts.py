"""Runs cut out of steady cycles: found by their force, and led in by their own first cycle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.fit import fit
from isolation_sim.identification.measured.run_starts import find_starts
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured.velocity import smooth
from isolation_sim.identification.measured_runs import measured_runs
from isolation_sim.identification.sensitivities import Simulator
from isolation_sim.laws.registry import LAWS

STEP = 1 / 128
STIFFNESS, ALPHA, DAMPING, A, BETA, GAMMA = 8e4, 6e5, 900.0, 0.9, 9e4, 4e4


def _cycles(amplitude, frequency, current, phase, cycles, begin, seed, noise=0.01, hold_out=False):
    """Cycles of a Bouc-Wen device by SciPy, kept from the cycle ``begin`` on."""
    omega = 2 * np.pi * frequency
    n = int(cycles / frequency / STEP) + 1
    early = begin / frequency
    time = np.concatenate([[0.0], early + STEP * np.arange(n)]) if begin else STEP * np.arange(n)
    phases = omega * time + phase
    scale = 1 + 0.6 * current

    def rate(t, z):
        v = amplitude * omega * np.cos(omega * t + phase)
        return A * v - BETA * abs(v) * z * abs(z) - GAMMA * v * z * z

    z = solve_ivp(
        rate, (0.0, time[-1]), [0.0], "LSODA", time, rtol=1e-8, atol=1e-12, max_step=0.02
    ).y[0][-n:]
    x, v = amplitude * np.sin(phases)[-n:], amplitude * omega * np.cos(phases)[-n:]
    force = scale * (STIFFNESS * x + ALPHA * z) + DAMPING * v
    random = np.random.default_rng(seed)
    force += noise * np.std(force) * random.standard_normal(n)
    x = x + 1e-3 * noise * np.std(x) * random.standard_normal(n)
    return TestRun(
        f"run {seed}", STEP * np.arange(n), x, v, force, np.full(n, current), hold_out,
        velocity_measured=True,
    )  # fmt: skip


def _part(run, places):
    """A part of a run, which begins at time 0."""
    signals = ("displacement", "velocity", "force", "current")
    time = run.time[places]
    return replace(
        run, time=time - time[0], **{name: getattr(run, name)[places] for name in signals}
    )  # fmt: skip


def _campaign(begin, cycles=3.0, sizes=(2e-3, 6e-3, 1.5e-2)):
    random = np.random.default_rng(4)
    runs = []
    for amplitude in sizes:
        for frequency in (0.5, 2.0):
            for current in (0.0, 1.0, 2.0):
                phase = random.uniform(0, 2 * np.pi) if begin else 0.0
                k = len(runs)
                motion = amplitude, frequency, current, phase, cycles
                runs.append(_cycles(*motion, begin, k, hold_out=k % 6 == 4))
    return Campaign("steady cycles", "made", tuple(runs))


def test_a_slow_test_that_begins_softly_begins_at_rest():
    """Two triangles of 10 s after 0.3 s of rest; a Maxwell arm of 0.1 s."""
    time = STEP * np.arange(int(20.6 / STEP))
    x = 5e-3 * 2 / np.pi * np.arcsin(np.sin(0.2 * np.pi * np.maximum(time - 0.3, 0.0)))
    v, q = np.gradient(x, STEP), np.zeros(time.size)
    for k in range(1, time.size):
        q[k] = q[k - 1] + STEP * (v[k] - q[k - 1] / 0.1)
    force = 1e5 * x + 3e5 * q
    force += 0.01 * np.std(force) * np.random.default_rng(4).standard_normal(time.size)
    run = TestRun("slow", time, x, v, force, 0 * time)
    assert measured_runs([run]).periods[0] == 0.0
    # cut out of its motion it goes on as it began
    later = replace(_part(run, slice(200, None)), name="later")
    assert measured_runs([later]).periods[0] == pytest.approx(10.0, rel=0.01)


@pytest.fixture(scope="module")
def cut_out():
    return _campaign(begin=4)


def test_cycles_cut_out_are_detected(cut_out):
    data = measured_runs(cut_out.runs)
    frequency = [0.5, 0.5, 0.5, 2.0, 2.0, 2.0] * 3
    assert data.periods == pytest.approx(1 / np.array(frequency), rel=2e-3)


def test_runs_from_rest_are_left(cut_out):
    assert not measured_runs(_campaign(begin=0).runs).periods.any()
    random = np.random.default_rng(0)
    x = 1e-3 * np.convolve(random.standard_normal(2000), np.hanning(60), "same")
    run = cut_out.runs[0]
    noise = replace(
        run, time=STEP * np.arange(2000), displacement=x, velocity=np.gradient(x, STEP),
        force=1e5 * x, current=np.zeros(2000),
    )  # fmt: skip
    # a law tells, since the motion comes back
    data = measured_runs([noise])
    assert data.periods == 0 and data.return_times.any()


@pytest.mark.parametrize("closing", [False, True])
def test_one_closed_cycle_is_detected(closing):
    whole = _cycles(5e-3, 2.0, 0.0, 1.0, 2.0, 4, 0)
    n = 64 + closing
    one = _part(whole, slice(n))
    assert measured_runs([one]).periods == pytest.approx([0.5], rel=1e-6)
    rest = _cycles(5e-3, 2.0, 0.0, 0.0, 2.0, 0, 0)
    one = _part(rest, slice(n))
    assert not measured_runs([one]).periods.any()


def test_the_led_in_force_is_that_of_steady_cycles():
    """The simulation of a cut-out run is that of the end of the whole test."""
    whole = _cycles(5e-3, 1.7, 0.0, 0.0, 8.0, 0, 0, noise=0.0)
    cut = _part(whole, slice(350, None))
    data = measured_runs([cut])
    assert data.periods == pytest.approx([1 / 1.7], rel=1e-4)
    law = LAWS["bouc_wen"]
    theta = np.array([STIFFNESS, DAMPING, ALPHA, A, BETA, GAMMA, 2.0, 0.0])
    simulator = Simulator(law, data.motion, n_steps=4)
    force, jacobian = simulator.run(theta)
    assert np.max(np.abs(force - cut.force)) < 2e-3 * np.max(np.abs(cut.force))
    rest = Simulator(law, replace(data.motion, periods=None), n_steps=4)
    assert np.max(np.abs(rest.run(theta)[0] - cut.force)) > 0.05 * np.max(np.abs(cut.force))
    k = law.parameter_names.index("beta")
    moved = theta.copy()
    moved[k] *= 1 + 1e-6
    difference = (simulator.run(moved, False)[0] - force) / (1e-6 * theta[k])
    size = np.max(np.abs(difference))
    assert np.max(np.abs(difference - jacobian[:, k])) < 1e-4 * size


@pytest.mark.slow
def test_a_fit_to_cycles_cut_out(cut_out):
    result = fit(cut_out, "bouc_wen", current_degree=1)
    assert result.error < 0.0105
    assert any("in motion" in note for note in result.notes)


@pytest.mark.usefixtures("few_effects")
def test_nothing_is_missing_in_cycles_cut_out(cut_out):
    diagnosis = diagnose(cut_out, "bouc_wen", current_degree=1)
    assert diagnosis.verdict == "adequate" and not diagnosis.causes
    assert "All runs begin in motion" in repr(diagnosis.steps)


def _random_motion(seed, begin):
    """Random motion of the Bouc-Wen device by SciPy, kept from a time ``begin`` on."""
    random = np.random.default_rng(seed)
    frequencies = random.uniform(0.3, 3.0, 12)
    phases = random.uniform(0, 2 * np.pi, 12)
    sizes = 4e-3 * random.uniform(0.3, 1, 12) / frequencies

    def motion(t):
        angles = 2 * np.pi * np.multiply.outer(t, frequencies) + phases
        return np.sin(angles) @ sizes, np.cos(angles) @ (2 * np.pi * frequencies * sizes)

    def rate(t, z):
        v = motion(t)[1]
        return A * v - BETA * abs(v) * z * abs(z) - GAMMA * v * z * z

    n = int(8 / STEP)
    time = begin + STEP * np.arange(n)
    evaluated = np.concatenate([[0.0], time]) if begin else time
    z = solve_ivp(
        rate, (0.0, time[-1]), [0.0], "LSODA", evaluated, rtol=1e-8, atol=1e-12, max_step=0.02
    ).y[0][-n:]
    x, v = motion(time)
    force = STIFFNESS * x + ALPHA * z + DAMPING * v
    force += 0.01 * np.std(force) * random.standard_normal(n)
    return TestRun(
        f"run {seed}", time - begin, x, v, force, np.zeros(n), velocity_measured=True
    )  # fmt: skip


@pytest.mark.parametrize("begin", [pytest.param(0.0, marks=pytest.mark.slow), 3.0])
def test_a_fit_tells_where_random_motion_begins(begin):
    """A law that begins at rest in its middle has an error of some 10 %."""
    runs = tuple(_random_motion(seed, begin) for seed in (1, 2, 3))
    assert measured_runs(runs).return_times.any(axis=1).all()
    result = fit(Campaign("random", "made", runs), "bouc_wen")
    assert any("in motion" in note for note in result.notes) == bool(begin)
    assert result.error < (0.0135 if begin else 0.0105)


@pytest.mark.parametrize(
    "noise", [*(pytest.param(noise, marks=pytest.mark.slow) for noise in (0.0, 0.01)), 0.03]
)
def test_noise_does_not_move_a_run_that_begins_at_rest(noise):
    rng = np.random.default_rng(5)
    step, results = 1 / 200, {"rest": 0, "cut": 0}
    time = step * np.arange(1600)
    for _ in range(20):
        frequency, phase = rng.uniform(0.5, 3.0), rng.uniform(0, 2 * np.pi)
        # a second frequency, so that no cycle repeats
        cut = np.sin(2 * np.pi * frequency * time + phase) + np.sin(4.1 * frequency * time)
        motions = {"cut": cut, "rest": np.tanh(time / 0.5) ** 3 * cut}
        for name, motion in motions.items():
            x = 1e-2 * (motion + noise * np.std(motion) * rng.standard_normal(time.size))
            run = TestRun(name, time, x, smooth(x, step)[1], 1e5 * x, np.ones(time.size))
            results[name] += bool(measured_runs([run]).return_times.any())
    assert results["rest"] <= 1
    assert results["cut"] >= 19


def test_a_sum_of_sines_begins_at_rest():
    """As a test that is commanded so, whose velocity jumps at its start."""
    time = np.arange(1600) / 200
    x = 3e-3 * np.sin(4.4 * time) + 2.5e-3 * np.sin(11.9 * time)
    run = TestRun("mixed", time, x, smooth(x, 1 / 200)[1], 1e5 * x, np.ones(time.size))
    assert not measured_runs([run]).return_times.any()
    cut = replace(run, displacement=x + 5e-4)
    assert measured_runs([cut]).return_times.any()


def test_cycles_cut_out_whose_motion_dies_away():
    """The beginning of steady cycles is cut off at zero, and not the end of the test."""
    time = STEP * np.arange(int(12 / STEP))
    x = 5e-3 * np.sin(np.pi * time) * np.clip((12 - time) / 2, 0, 1)
    v = np.gradient(x, STEP)
    relaxing = np.zeros(len(time))
    for k in range(1, len(time)):
        relaxing[k] = (relaxing[k - 1] + x[k] - x[k - 1]) * np.exp(-STEP / 0.3)
    run = TestRun("cut", time, x, v, 2e4 * x + 3e4 * relaxing, np.zeros(len(time)))
    late = _part(run, np.arange(int(4 / STEP), len(time)))
    result = measured_runs([run, late]).periods
    assert result == pytest.approx([0.0, 2.0], abs=1e-3)


@pytest.mark.parametrize("begin", [0, 2])
def test_half_a_cycle_tells_by_its_force_whether_it_begins_at_rest(begin):
    """It begins at zero in both cases, and never returns to its beginning."""
    runs = [_cycles(a, 0.5, 0.0, 0.0, 3.0, 0, k) for k, a in enumerate((2e-3, 6e-3, 1.5e-2))]
    halves = [_cycles(a, 0.25, 0.0, 0.0, 0.5, begin, 5 + k) for k, a in enumerate((9e-3, 1.4e-2))]
    assert measured_runs(halves).return_times.any(axis=1).all()
    result = fit(Campaign("halves", "made", (*runs, *halves)), "bouc_wen")
    assert max(error.relative for error in result.errors) < 0.02
    assert any("unknown past" in note for note in result.notes) == bool(begin)


def _decaying(k, begin, noise=0.005):
    """A standard solid under free vibrations of several tones, kept from a time ``begin`` on."""
    random = np.random.default_rng(k)
    frequencies = np.array([0.31, 0.83, 1.9]) * random.uniform(0.9, 1.1, 3)
    phases = random.uniform(0, 2 * np.pi, 3)

    def motion(t):
        rise = np.minimum(t, 1.0)
        x = 4e-3 * np.sin(np.multiply.outer(t, 2 * np.pi * frequencies) + phases).sum(axis=-1)
        return rise * np.exp(-t / 3) * x

    # spring k1 in series with k0 beside c0: k1 = 9e4, k0 = 3e4 N/m, relaxed in 0.17 s
    time = np.arange(0.0, 14.0, STEP)
    y = solve_ivp(
        lambda t, y: -(1.2e5 * y - 3e4 * motion(t)) / 2e4 + _slope(motion, t),
        (0.0, time[-1]), [0.0], "LSODA", time, rtol=1e-8, atol=1e-12, max_step=0.02,
    ).y[0]  # fmt: skip
    force = 9e4 * y
    force = force + noise * np.std(force) * random.standard_normal(len(time))
    places = slice(round(begin / STEP), None)
    zero = np.zeros(len(time))
    v = np.array([_slope(motion, t) for t in time])
    run = TestRun(f"run {k}", time, motion(time), v, force, zero, velocity_measured=True)
    return _part(run, places)


def _slope(motion, t):
    return (motion(t + 1e-6) - motion(t - 1e-6)) / 2e-6


@pytest.mark.parametrize("begin", [0.0, 1.7])
def test_a_motion_that_does_not_come_back_counts_once_its_beginning_is_forgotten(begin):
    """The past is unknown where a decaying motion is cut out, and no later part is like it."""
    result = fit(Campaign("cut", "made", tuple(_decaying(k, begin) for k in range(4))),
                 "standard_solid")  # fmt: skip
    values = {each.name: each.value for each in result.estimates}
    assert values == pytest.approx({"c0": 2e4, "k0": 3e4, "k1": 9e4}, rel=0.01)
    assert max(error.relative for error in result.errors) < 0.012
    left_out = [note for note in result.notes if "unknown past" in note]
    assert len(left_out) == (begin > 0)
    # a relaxation time of 0.17 s: what remains of a start is noise after some of them
    assert all(error.settled * STEP < 2.0 for error in result.errors)


def _left_loaded(k, z):
    """Random motion from rest to rest of a Dahl device with 1 % of noise, and its friction state.

    It begins as friction was left.
    """
    random = np.random.default_rng(k)
    time = STEP * np.arange(1280)
    rise = np.clip(np.minimum(time, time[-1] - time) - 0.1, 0.0, 1.0)
    phases = random.uniform(0, 2 * np.pi, 9)
    frequencies = np.linspace(0.4, 2.0, 9) * random.uniform(0.9, 1.1, 9)

    def motion(t):
        rises = np.interp(t, time, rise * rise * (3 - 2 * rise))
        return 4e-3 * rises * np.sin(np.multiply.outer(t, 2 * np.pi * frequencies) + phases).sum(-1)

    def rate(t, z):
        v = _slope(motion, t)
        return (v - abs(v) * z) / 1e-3

    z = solve_ivp(rate, (0.0, time[-1]), [z], "RK23", time, rtol=1e-6, max_step=STEP).y[0]
    x, v = motion(time), np.array([_slope(motion, t) for t in time])
    force = 500.0 * z + 3e3 * x + 200.0 * v
    force = force + 0.01 * np.std(force) * random.standard_normal(len(time))
    zero = np.zeros(len(time))
    return TestRun(f"run {k}", time, x, v, force, zero, velocity_measured=True), z[-1]


def test_a_device_may_rest_under_a_force_from_the_test_before():
    """Friction of a device that stops stays in it, and the next run begins with it."""
    z, runs = 0.0, []
    for k in range(3):
        run, z = _left_loaded(k, z)
        runs.append(run)
    result = fit(Campaign("one after the other", "made", tuple(runs)), "dahl")
    assert max(error.relative for error in result.errors) < 0.013
    # sigma is the friction force over its length of 1 mm
    values = {each.name: each.value for each in result.estimates}
    assert values == pytest.approx({"k": 3e3, "c": 200.0, "sigma": 5e5, "F_c": 500.0}, rel=0.03)


@pytest.mark.parametrize(("z", "offset", "held"), [(0.8, 0.0, True), (0.0, 250.0, False)])
def test_an_offset_of_the_load_cell_is_no_force_from_before(z, offset, held):
    run = _left_loaded(0, z)[0]
    starts = find_starts([replace(run, force=run.force + offset)], np.array([3.0]))
    assert starts.return_times.any() == held
