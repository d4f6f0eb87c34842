"""Errors of saved laws, with effects and without, on data that they need not have seen."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

import isolation_sim as iso
from isolation_sim.cli import main
from isolation_sim.effects import device_section, effect, extend, separate
from isolation_sim.errors import InputError
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.laws import CurrentDependence, Device, law
from isolation_sim.laws.registry import LAWS
from isolation_sim.scenario import Scenario

pytestmark = pytest.mark.usefixtures("no_drawing")

N, DT = 600, 0.005
TIME = DT * np.arange(N)
OFFSET = 7.0


def spring_and_dashpot(run):
    current = run.current
    stiffness, damping = 9e3 + 2e3 * current + 300 * current**2, 400 + 50 * current
    return stiffness * run.displacement + damping * run.velocity


@pytest.fixture(scope="module")
def campaign():
    runs = []
    for k, current in enumerate((0.0, 0.5, 1.0)):
        omega = 2 * np.pi * (0.6 + 0.3 * k)
        x, v = 5e-3 * np.sin(omega * TIME), 5e-3 * omega * np.cos(omega * TIME)
        run = TestRun(f"run{k}", TIME, x, v, x, np.full(N, current), velocity_measured=True)
        force = 1.25 * (spring_and_dashpot(run) + OFFSET)
        runs.append(TestRun(run.name, TIME, x, v, force, run.current, velocity_measured=True))
    return Campaign("made", "made", tuple(runs))


@pytest.fixture(scope="module")
def device():
    current = CurrentDependence.polynomial({"k": [9e3, 2e3, 300.0], "c": [400.0, 50.0]})
    base = Device(LAWS["kelvin_voigt"], current, (0.0, 1.0), tested_deformation=4e-3)
    return extend(base, [(effect("force_offset"), {"level": OFFSET})])


def test_the_runs_in_which_a_law_diverges_are_named(campaign):
    values = {"k": 9e3, "c": 400.0, "alpha": 1e4, "A": 1.0, "beta": 1e4, "n": 2.0, "F0": 0.0}
    current = CurrentDependence.polynomial(
        {"gamma": [1e4, -1e12]} | {k: [y] for k, y in values.items()}
    )
    result = iso.evaluate(Device(LAWS["bouc_wen"], current, (0.0, 1.0)), campaign)
    assert [np.isfinite(one.relative) for one in result.errors] == [True, False, False]
    assert any(note.startswith("the law diverges in run1, run2: ") for note in result.notes)


def test_forces_and_errors_are_those_of_the_equation(device, campaign):
    result = iso.evaluate(device, campaign)
    assert result.error == pytest.approx(0.2) and len(result.errors) == 3
    for one in result.errors:
        np.testing.assert_allclose(one.force, spring_and_dashpot(one.run) + OFFSET, rtol=1e-6)
        assert one.relative == pytest.approx(0.2)
    assert result.notes == ("deformation above the tested 4 mm in run0, run1, run2",)


def test_a_scaled_device_answers_in_its_own_scale(device, campaign):
    large = iso.evaluate(device.scaled(2.0, 10.0), campaign).errors[2]
    expected = 10 * (spring_and_dashpot(large.run) / 2 + OFFSET)
    np.testing.assert_allclose(large.force, expected, rtol=1e-6)


def test_the_command_reads_what_was_saved(device, campaign, tmp_path, capsys):
    folder, file = tmp_path / "tests", tmp_path / "law.toml"
    folder.mkdir()
    lines = ["name = 'made'"]
    for run in campaign.runs:
        lines += ["[[run]]", f"file = '{run.name}.csv'"]
        columns = [run.time, run.displacement, run.velocity, run.force, run.current]
        np.savetxt(
            folder / f"{run.name}.csv", np.stack(columns, axis=1), delimiter=",", comments="",
            header="time_s,displacement_m,velocity_m_s,force_N,current_A", fmt="%.17g",
        )  # fmt: skip
    (folder / "campaign.toml").write_text("\n".join(lines))
    # the scales of a building are not those of the tests
    text = device_section(device).replace("length_scale = 1.0", "length_scale = 10.0")
    file.write_text(text)
    with pytest.raises(SystemExit) as ended:
        main(["evaluate", str(file), str(folder), "--json", "--report", str(tmp_path / "r.html")])
    assert ended.value.code == 0
    printed = json.loads(capsys.readouterr().out)
    assert [run["name"] for run in printed["runs"]] == ["run0", "run1", "run2"]
    assert printed["error"] == pytest.approx(0.2, rel=1e-6)
    assert "has an RMS force error of 20" in (tmp_path / "r.html").read_text()


def test_the_folder_of_a_fit_or_of_a_diagnosis_is_a_law_too(device, campaign, tmp_path):
    with pytest.raises(InputError, match=r"without extended_law.toml or fitted.toml; expected"):
        iso.evaluate(tmp_path, campaign)
    (tmp_path / "extended_law.toml").write_text(device_section(device))
    assert iso.evaluate(tmp_path, campaign).error == pytest.approx(0.2)
    # a nominal law has no effects, and those of a file are not left out unseen
    with pytest.raises(InputError, match=r"extended_law.toml: a law with effects; expected: fit, "):
        iso.diagnose(campaign, "kelvin_voigt", parameters=tmp_path)


def test_effects_of_the_instruments_count_in_an_evaluation(device, campaign, tmp_path):
    delay = effect("sensor_delay")
    base, (offset,) = separate(device)
    late = extend(base, [offset, (delay, {"delay": 0.02})])
    (tmp_path / "late.toml").write_text(device_section(late))
    evaluation, expected = (
        iso.evaluate(tmp_path / "late.toml", campaign),
        iso.evaluate(late, campaign),
    )
    assert evaluation.error == pytest.approx(expected.error, rel=1e-12)
    assert evaluation.error > iso.evaluate(device, campaign).error + 0.01


def test_softening_goes_on_from_run_to_run_where_the_forces_say_so():
    soft = effect("stress_softening")
    numbers = {"loss": 0.4, "length": 2e-3}
    base = Device(LAWS["kelvin_voigt"], CurrentDependence.constant({"k": 1e4, "c": 100.0}))
    runs, largest = [], 0.0
    for k, size in enumerate((8e-3, 4e-3, 2e-3)):
        x = size * np.sin(2 * np.pi * TIME)
        v = np.gradient(x, DT)
        largest = np.maximum.accumulate(np.maximum(np.abs(x), np.max(largest)))
        left = 1 - 0.4 * np.tanh((largest - np.abs(x)) / 2e-3)
        force = left * (1e4 * x + 100 * v)
        runs.append(TestRun(f"run{k}", TIME, x, v, force, 0 * TIME, velocity_measured=True))
    result = iso.evaluate(extend(base, [(soft, numbers)]), Campaign("made", "made", tuple(runs)))
    assert result.error < 0.02
    assert any("goes on from run to run" in note for note in result.notes)


@pytest.mark.parametrize("name", [n for n in LAWS if LAWS[n].sets])
def test_numbers_that_leave_the_bounds_beyond_their_range_load_back(name, tmp_path):
    result = LAWS[name]
    published = law(name)
    values = np.asarray(published.parameters_at(0.0), dtype=float)
    # nearly down to the bounds at 1 A, and outside of them at the published set's largest current
    low = [max(q.lower, 0.0) for q in result.parameters]
    rows = {
        q.name: [v, -0.9 * (v - a)] for q, v, a in zip(result.parameters, values, low, strict=True)
    }
    fitted = Device(result, CurrentDependence.polynomial(rows), (0.0, 1.0))
    extended = extend(fitted, [(effect("force_offset"), {"level": OFFSET})])
    file = tmp_path / "extended_law.toml"
    file.write_text(device_section(extended))
    loaded = Scenario.read(file).build().isolated.elements[0].device
    assert loaded.law.name == extended.law.name and loaded.current_range == (0.0, 1.0)
    for current in (0.0, 0.4, 1.0):
        assert loaded.parameters_at(current) == pytest.approx(extended.parameters_at(current))


def test_what_cannot_be_evaluated_is_refused(campaign, tmp_path):
    with pytest.raises(InputError, match="piecewise"):
        iso.evaluate(law("improved_bouc_wen"), campaign)
    with pytest.raises(InputError, match=r"nothing\.toml"):
        iso.evaluate(tmp_path / "nothing.toml", campaign)


def _friction_runs(samples):
    """Two tests of a spring beside smoothed friction; SciPy averages the force."""
    runs = []
    for frequency in (0.5, 1.0):
        time = np.arange(600) / (100 * frequency)
        omega = 2 * np.pi * frequency
        x, v = 5e-3 * np.sin(omega * time), 5e-3 * omega * np.cos(omega * time)
        force = 1e4 * x + 500.0 * np.tanh(v / 1e-3)
        if samples:
            force = uniform_filter1d(force, samples, mode="nearest")
        runs.append(TestRun(f"{frequency} Hz", time, x, v, force, 0 * x, velocity_measured=True))
    return Campaign("friction", "made", tuple(runs))


def test_two_runs_and_a_law_show_an_average_of_the_channel():
    numbers = {
        "k": [1e4],
        "c": [0.0],
        "alpha": [500.0],
        "beta": [1e3],
        "delta": [0.0],
        "x_s": [1.0],
        "F0": [0.0],
    }
    right = Device(LAWS["hyperbolic_tangent"], CurrentDependence.polynomial(numbers))
    averaged = iso.evaluate(right, _friction_runs(11))
    assert averaged.error < 0.005
    assert any("moving average" in note for note in averaged.notes)
    plain = iso.evaluate(right, _friction_runs(0))
    assert plain.error < 1e-6
    # friction that is smoother than the law's is no average
    smoother = iso.evaluate(right, _smoother())
    assert not any("moving average" in note for note in (*plain.notes, *smoother.notes))


def _smoother():
    runs = [
        replace(run, force=1e4 * run.displacement + 500.0 * np.tanh(run.velocity / 5e-3))
        for run in _friction_runs(0).runs
    ]
    return Campaign("smoother", "made", tuple(runs))


@pytest.mark.parametrize(
    ("cause", "numbers", "left"),
    [
        ("stress_softening", {"loss": 0.4, "length": 2e-3},
         lambda k, x: 1 - 0.4 * np.tanh((8e-3 - np.abs(x)) / 2e-3)),
        ("cyclic_degradation", {"loss": 0.4, "scale": 0.05}, lambda k, x: 0.8 - 0.05 * k),
        ("self_heating", {"gain": 1.0, "cooling": 5.0}, lambda k, x: 0.8 - 0.05 * k),
    ],
)  # fmt: skip
def test_a_history_scales_with_its_device(cause, numbers, left):
    base = Device(LAWS["kelvin_voigt"], CurrentDependence.constant({"k": 1e4, "c": 100.0}))
    small = extend(base, [(effect(cause), numbers)])
    runs = []
    for k, size in enumerate((8e-3, 4e-3, 2e-3, 8e-3)):
        x = size * np.sin(2 * np.pi * TIME)
        v = np.gradient(x, DT)
        force = left(k, x) * (1e4 * x + 100 * v)
        runs.append(TestRun(f"run{k}", TIME, x, v, force, 0 * TIME, velocity_measured=True))
    large = replace(small, length=2.0, force_scale=3.0)
    scaled = [
        replace(run, displacement=2 * run.displacement, velocity=2 * run.velocity,
                force=3 * run.force)
        for run in runs
    ]  # fmt: skip
    of_small, of_large = (
        iso.evaluate(device, Campaign("made", "made", tuple(of)))
        for device, of in ((small, runs), (large, scaled))
    )
    assert of_large.error == pytest.approx(of_small.error, rel=1e-6)
    assert any("goes on from run to run" in note for note in of_small.notes)
