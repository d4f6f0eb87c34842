import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, lsim

from isolation_sim.discrepancy.adapters.device_tests import sentence
from isolation_sim.discrepancy.device.effect_evaluation import evaluate
from isolation_sim.discrepancy.device.interference import (
    _own_frequency,
    _strong_lines,
    interference,
)
from isolation_sim.discrepancy.device.model import run_means
from isolation_sim.discrepancy.diagnose import diagnose, kind_of
from isolation_sim.discrepancy.loops.table import read_loop_table
from isolation_sim.effects import effect
from isolation_sim.errors import InputError
from isolation_sim.identification.measured.data_checks import data_notes
from isolation_sim.identification.measured.noise import white_noise
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured_runs import hold_out_some, measured_runs

RATE, STIFFNESS = 256.0, 4e4


def a_run(
    name="run", frequency=1.0, force=None, noise=0.0, seed=0, seconds=6.0, current=None, rate=RATE
):
    time = np.arange(0, seconds, 1 / rate)
    x = 5e-3 * np.sin(2 * np.pi * frequency * time)
    v = 5e-3 * 2 * np.pi * frequency * np.cos(2 * np.pi * frequency * time)
    if force is None:
        force = STIFFNESS * x
    force = force + noise * np.random.default_rng(seed).standard_normal(len(time))
    amperes = np.zeros(len(time)) if current is None else current(time)
    return TestRun(name, time, x, v, force, amperes, velocity_measured=True)


def test_noise_is_read_off_a_signal_that_moves():
    run = a_run(noise=3.0)
    assert white_noise(run.force) == pytest.approx(3.0, rel=0.1)


def test_a_quarter_of_the_runs_is_held_out():
    runs = [a_run(f"run{k}", 0.5 + 0.1 * k) for k in range(8)]
    data = hold_out_some(measured_runs(runs), runs)
    held = [not data.fitted[start] for start in data.starts[:-1]]
    assert sum(held) == 2


def test_the_last_third_of_a_lone_runs_path_is_held_out():
    """Of steady motion it is the last third; an earthquake ends quietly."""
    run = a_run()
    n = len(run.time)
    steady = hold_out_some(measured_runs([run]), [run])
    assert not steady.fitted[-(n // 3) + 2 :].any() and steady.fitted[: n - n // 3 - 2].all()
    fading = np.exp(-run.time)
    quake = replace(run, displacement=fading * run.displacement, velocity=fading * run.velocity)
    data = hold_out_some(measured_runs([quake]), [quake])
    held = np.sum(np.abs(data.v[~data.fitted]))
    assert held == pytest.approx(np.sum(np.abs(data.v)) / 3, rel=0.02)


@pytest.mark.parametrize("currents", [(0.0, 1.0), (0.0, 1.0, 2.0), (0.0, 1.0, 2.0, 3.0)])
def test_runs_of_all_currents_are_held_out_and_fitted(currents):
    runs = [
        a_run(f"run{k}_{i}", 0.5 + 0.1 * k, current=lambda t, i=i: i + 0 * t)
        for k in range(6) for i in currents
    ]  # fmt: skip
    held = ~hold_out_some(measured_runs(runs), runs).fitted
    data = measured_runs(runs)
    seen = [data.current[held & (data.current == i)].size for i in currents]
    assert min(seen) > 0 and max(seen) <= 2 * min(seen)


def test_thinning_leaves_long_and_short_runs_alike():
    data = measured_runs([a_run("long", seconds=40.0), a_run("short", seconds=5.0)])
    thin = data.thinned(2000)
    long, short = thin.lengths
    assert long == pytest.approx(1024, rel=0.05) and short == len(a_run(seconds=5.0).time)
    np.testing.assert_array_equal(thin.x, data.x[data.places(2000)])


def test_a_current_lag_follows_a_step_as_in_the_textbook():
    lag = 0.05
    data = measured_runs([a_run(current=lambda t: 2.0 * (t >= 1.0))])
    seen = evaluate(
        effect("current_lag", "first_order"), data, np.zeros(len(data.x)), np.array([lag])
    )["current"]
    time = np.arange(len(data.x)) / RATE
    exact = 2.0 * (1 - np.exp(-np.maximum(time - 1.0, 0.0) / lag))
    # a step between two samples is known to half a sample
    assert np.max(np.abs(seen - exact)) < 2.0 * (0.5 / RATE) / lag


@pytest.mark.parametrize("delay", [1e-3, 4e-3, 16e-3])
def test_a_late_channel_is_late_by_less_than_a_sample_too(delay):
    def force(t):
        return 100 * np.sin(6 * np.pi * t) + 30 * np.sin(14 * np.pi * t + 1)

    data = measured_runs([a_run()])
    time = np.arange(len(data.x)) / RATE
    for form in ("dead_time", "filter"):
        change = evaluate(effect("sensor_delay", form), data, force(time), np.array([delay]))
        recorded = force(time) + change["force"]
        late = force(time - delay)
        if form == "filter":
            late = sum(
                a * np.sin(w * time + b - np.arctan(w * delay)) / np.hypot(1, w * delay)
                for a, w, b in ((100, 6 * np.pi, 0), (30, 14 * np.pi, 1))
            )
        steady = time > 0.5
        assert np.std((recorded - late)[steady]) < 0.005 * np.std(late)


def test_a_filtered_force_is_that_of_scipy():
    delay = 0.012
    data = measured_runs([a_run()])
    time = np.arange(len(data.x)) / RATE
    force = 50 + 100 * np.sin(6 * np.pi * time) + 30 * np.sign(np.sin(14 * np.pi * time))
    change = evaluate(effect("sensor_delay", "butterworth"), data, force, np.array([delay]))
    b, a = butter(2, np.sqrt(2) / delay, analog=True)
    expected = lsim((b, a), force - force[0], time)[1] + force[0]
    error = force + change["force"] - expected
    assert np.std(error[time > 0.1]) < 0.05 * np.std(expected)


def test_a_common_line_is_detected_and_none_where_there_is_none():
    frequencies = (0.4, 0.7, 1.0, 1.3, 1.7)
    quiet = [a_run(f"run{k}", f, noise=1.0, seed=k) for k, f in enumerate(frequencies)]
    data = measured_runs(quiet)
    assert interference(data, STIFFNESS * data.x) is None
    loud = []
    for k, f in enumerate(frequencies):
        time = quiet[k].time
        hum = 3.0 * np.sin(2 * np.pi * 11.3 * time + k)
        loud.append(a_run(f"run{k}", f, STIFFNESS * quiet[k].displacement + hum, 1.0, k))
    data = measured_runs(loud)
    disturbance = interference(data, STIFFNESS * data.x)
    assert disturbance is not None and not disturbance.modulates
    assert disturbance.frequency == pytest.approx(11.3, abs=0.1)
    lost = STIFFNESS * data.x
    lost[data.runs[-1]] = np.nan  # the law diverges in this run
    disturbance = interference(data, lost)
    assert disturbance is None or np.isfinite(disturbance.force).all()


@pytest.mark.parametrize("varies", [False, True])
def test_multiples_of_the_motion_are_no_line(varies):
    """Friction on sinusoids of few frequencies, of one amplitude or of several."""
    runs = []
    for k, f in enumerate((0.5, 0.5, 0.5, 2.0, 2.0, 2.0)):
        time = np.arange(int((36 if varies else 8) * RATE)) / RATE
        size = 1 + 0.2 * k
        if varies:
            size = size * (0.6 + 0.4 * np.sin(2 * np.pi * time / 36) ** 2)
        motion = 0.005 * size * np.sin(2 * np.pi * f * time)
        rubbing = 20 * np.tanh(np.gradient(motion, time) / 5e-4)
        noise = np.random.default_rng(k).normal(0, 0.5, len(time))
        force = STIFFNESS * motion + rubbing + noise
        speed = np.gradient(motion, time)
        still = np.zeros_like(time)
        runs.append(TestRun(f"run{k}", time, motion, speed, force, still, velocity_measured=True))
    data = measured_runs(runs)
    assert interference(data, STIFFNESS * data.x) is None


@pytest.mark.parametrize("cycles", [2.0, 2.5, 3.0])
@pytest.mark.parametrize("triangles", [False, True])
def test_a_slow_test_of_two_cycles_has_a_frequency(cycles, triangles):
    """Its multiples are no interference."""
    time = np.arange(2001) / 100
    motion = np.sin(2 * np.pi * cycles / 20 * time)
    if triangles:
        motion = 2 / np.pi * np.arcsin(0.995 * motion)
    frequency = _own_frequency(*_strong_lines(motion, 0.01), 20.01)
    assert frequency == pytest.approx(cycles / 20, rel=0.1)


def test_the_line_of_short_runs_holds_in_a_long_one():
    """Mains of 50 Hz: a deviation of 0.05 Hz would turn its phase once in 20 s."""
    loud = []
    for k, (f, seconds) in enumerate([(0.8, 3.0), (1.1, 3.0), (1.4, 3.0), (1.7, 3.0), (0.5, 20.0)]):
        quiet = a_run(f"run{k}", f, seconds=seconds)
        hum = 3.0 * np.sin(2 * np.pi * 50 * quiet.time + k)
        loud.append(a_run(f"run{k}", f, quiet.force + hum, 1.0, k, seconds))
    data = measured_runs(loud)
    disturbance = interference(data, STIFFNESS * data.x)
    assert disturbance.frequency == pytest.approx(50, abs=0.01)
    left = data.force - STIFFNESS * data.x - disturbance.force
    assert np.std(left[data.runs[-1]]) == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("modulates", [False, True])
def test_a_line_is_found_in_runs_of_unequal_rates(modulates):
    """A run whose rate is too low for the frequency says nothing about it."""
    rates = (100.0, 128.0, 200.0, 250.0, 1000.0)
    quiet, loud = [], []
    for k, rate in enumerate(rates):
        run = a_run(f"run{k}", 0.4 + 0.3 * k, seconds=6.0 + 2 * k, rate=rate)
        hum = np.sin(2 * np.pi * 50.02 * run.time + k)
        hum *= 0.05 * run.force if modulates else 3.0
        size = dict(noise=1.0, seed=k, seconds=6.0 + 2 * k, rate=rate)
        quiet.append(a_run(f"run{k}", 0.4 + 0.3 * k, **size))
        loud.append(a_run(f"run{k}", 0.4 + 0.3 * k, run.force + hum, **size))
    data = measured_runs(quiet)
    assert interference(data, STIFFNESS * data.x) is None
    data = measured_runs(loud)
    disturbance = interference(data, STIFFNESS * data.x)
    assert disturbance.frequency == pytest.approx(50.02, abs=0.01)
    assert disturbance.modulates == modulates
    left = data.force - STIFFNESS * data.x - disturbance.force
    assert np.std(left) == pytest.approx(1.0, rel=0.05)


def test_means_are_taken_run_by_run():
    data = measured_runs([a_run("a"), a_run("b", seconds=8.0)])
    values = np.concatenate([np.full(n, k + 1.0) for k, n in enumerate(data.lengths)])
    np.testing.assert_allclose(run_means(data, values), values)


def test_a_clipped_channel_is_reported():
    force = np.clip(STIFFNESS * a_run().displacement, -150.0, 150.0)
    runs = [a_run("clipped", force=force), a_run("fine", frequency=0.8)]
    notes = data_notes(runs, np.zeros(2))
    assert len(notes) == 1 and "clipped" in notes[0] and "force" in notes[0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b\n1,2\n", "expected: a campaign folder"),
        ("", "expected: a campaign folder"),
    ],
)
def test_a_file_of_another_kind_is_refused(tmp_path, text, message):
    path = tmp_path / "data.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        kind_of(path)


LOOPS = "amplitude_mm,frequency_Hz,current_A,effective_stiffness_N_per_mm,damping_ratio\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (LOOPS + "2,1,0,5,0.2\n" * 3, "3 rows; expected: 6 or more"),
        (LOOPS + "2,1,0,5,0.2\n" * 5 + "2,1,0,-5,0.2\n", "stiffness -5000; expected: above 0"),
        (LOOPS + "2,1,0,x,0.2\n" * 6, "line 2, column effective_stiffness_N_per_mm"),
        (LOOPS.replace("damping_ratio", "damping"), "damping"),
        (LOOPS.replace("damping_ratio", "hold_out"), "no column damping_ratio; expected: one of"),
        (LOOPS.replace("current_A", "loss_factor"), "no column current_A"),
        (LOOPS.strip() + ",loss_factor\n", "columns damping_ratio and loss_factor; expected"),
    ],
)
def test_a_loop_table_that_cannot_be_used_is_refused(tmp_path, text, message):
    path = tmp_path / "loops.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_loop_table(path)


@pytest.mark.parametrize(
    ("column", "value"), [("loss_factor", 0.4), ("loss_stiffness_N_per_mm", 2.0)]
)
def test_a_dynamic_stiffness_is_a_loop_table(tmp_path, column, value):
    path = tmp_path / "loops.csv"
    head = f"amplitude_mm,frequency_Hz,current_A,storage_stiffness_N_per_mm,{column}\n"
    path.write_text(head + f"2,1,0,5,{value}\n" * 6)
    table = read_loop_table(path)
    assert table.stiffness == pytest.approx(5000) and table.damping == pytest.approx(0.2)
    assert kind_of(path) == "loops"


def test_a_law_that_reproduces_its_loops_is_adequate(tmp_path):
    # a spring beside a dashpot: K = k, zeta = c omega / (2 k)
    rows = [
        f"{x},{f},0,20,{0.5 * 2 * np.pi * f / (2 * 20):.9f}"
        for x in (2, 4, 8)
        for f in (0.5, 1.0, 2.0)
    ]
    path = tmp_path / "loops.csv"
    path.write_text(LOOPS + "\n".join(rows) + "\n")
    diagnosis = diagnose(path, "kelvin_voigt")
    assert diagnosis.verdict == "adequate" and not diagnosis.causes
    assert diagnosis.error_before.fit < 1e-3
    assert json.loads(diagnosis.to_json())["causes"] == []


def test_numbers_of_another_law_are_refused():
    from isolation_sim.laws import law

    with pytest.raises(InputError, match="expected: of bouc_wen"):
        diagnose("anywhere", "bouc_wen", law("linear", {"k": 1.0}))


def test_notes_about_the_data_are_sentences():
    names = ["run1"]
    assert sentence("sampling intervals differ: 2, 4 ms", names) == (
        "Sampling intervals differ: 2, 4 ms."
    )
    assert sentence("run1: force is 1/9.81 times that of run2", names).startswith("run1: ")
    question = "run1: current reaches 1e+03 A; is its unit right?"
    assert sentence(question, names) == question
