"""Criteria that are selected beside the peaks and RMS values: values, tables, sweeps, tuning."""

from __future__ import annotations

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import Record
from isolation_sim.criteria import is_gain
from isolation_sim.reports.tables import as_text, run_table, title_of
from isolation_sim.structures import plan_building

pytestmark = pytest.mark.usefixtures("no_drawing")

TIME = np.arange(0, 4, 0.02)
GROUND = Record(2.0 * np.sin(2 * np.pi * 0.6 * TIME) * (TIME < 2), 0.02, name="burst")
SHIPPED = ("isolator_travel_m", "residual_base_displacement_m", "rms_current_A")

FILE = '''"""A criterion of one's own."""

import numpy as np

from isolation_sim import Criterion

CHANGES = Criterion(
    "command_changes",
    "changes of the command",
    lambda run: np.count_nonzero(np.diff(run.command, axis=0)),
    better="larger",
)
'''

SCENARIO = """
[ground]
kind = "ricker_pulse"
pulse_period_s = 2.0
peak_velocity_m_s = 0.3
[[controller]]
name = "constant"
amperes = 1.0
[[controller]]
name = "on_off"
[simulation]
criteria = ["isolator_travel_m", "my_criteria.py:CHANGES"]
"""


@pytest.fixture(scope="module")
def plant():
    return iso.reference_building().on(iso.reference_isolators())


@pytest.fixture
def scenario(tmp_path):
    (tmp_path / "my_criteria.py").write_text(FILE)
    (tmp_path / "job.toml").write_text(SCENARIO)
    return tmp_path / "job.toml"


def test_loads_of_isolators_follow_from_the_moment_of_inertia_forces():
    masses, heights, width = [2e5, 2e5, 1e5], [4.0, 3.0, 3.0], 5.0
    places = [[-width / 2, -4], [width / 2, -4], [-width / 2, 4], [width / 2, 4]]
    plant = plan_building(
        masses, [3e8] * 3, [3e8] * 3, base_mass=2e5, plan=(7.0, 10.0), heights=heights,
        isolator_positions=places, damping_ratio=1e-5,
    ).on(iso.law("linear", {"k": 2e6}), biaxial=True)  # fmt: skip
    names = ("isolator_unloading_ratio", "isolator_overload_ratio")
    still = GROUND.scaled(0.0)
    run = iso.simulate(plant, (GROUND, still), "passive_off", criteria=names)
    inertia = [mass * run.output(f"floor{k}_x_acceleration_m_s2")
               for k, mass in enumerate(masses, 1)]  # fmt: skip
    moment = np.cumsum(heights) @ inertia
    # two isolators on each side carry the moment
    load = np.abs(moment).max() / width / 2 / (7e5 * 9.80665 / 4)
    assert 0.05 < load < 2
    for name in names:
        assert run.criteria[name] == pytest.approx(load, rel=0.01)
    reference = iso.reference_building().on(iso.reference_isolators())
    with pytest.raises(iso.InputError, match="no isolator positions"):
        iso.simulate(reference, GROUND, "passive_off", criteria=names)


@pytest.mark.filterwarnings("ignore::isolation_sim.PlausibilityWarning")
def test_the_shipped_ones_are_those_of_the_histories(plant):
    run = iso.simulate(plant, GROUND, "on_off", criteria=SHIPPED)
    current = np.asarray(run.current)[:, 0]
    rms = np.sqrt(np.mean(current[:-1] ** 2))  # held between two decisions
    assert run.criteria["rms_current_A"] == pytest.approx(rms, rel=1e-12)
    # the base still swings
    assert np.isnan(run.criteria["residual_base_displacement_m"])


@pytest.mark.filterwarnings("ignore::isolation_sim.PlausibilityWarning")
def test_the_travel_is_that_between_the_samples_too(plant):
    run, fine = (
        iso.simulate(plant, ground, "passive_on", criteria=["isolator_travel_m"])
        for ground in (GROUND, GROUND.resampled(0.0005))
    )
    path = np.asarray(fine.history["displacement"].sel(dof="base")).ravel()
    travel = float(np.abs(np.diff(path)).sum())
    assert run.criteria["isolator_travel_m"] == pytest.approx(travel, rel=1e-4)


@pytest.mark.filterwarnings("ignore::isolation_sim.PlausibilityWarning")
@pytest.mark.parametrize("lag", [0.0, 0.004])
def test_the_rms_current_is_that_between_the_samples_too(plant, lag):
    """Pulses of a quarter of a sample, and their closed form."""
    record, quarter = Record(np.zeros(51), 0.02, name="rest"), 0.005
    instants = np.arange(0.0, 1.0, quarter)
    pulses = np.where(np.arange(len(instants)) % 4 == 1, 2.0, 0.0)
    control = iso.controller("prescribed", time=instants, amperes=pulses)
    driver = iso.CoilDriver(lag=lag)
    run = iso.simulate(plant, record, control, driver=driver, criteria=["rms_current_A"])
    square, current = 0.0, 0.0
    for command in pulses:
        gap, fall = current - command, np.exp(-quarter / lag) if lag else 0.0
        square += command**2 * quarter + 2 * command * gap * lag * (1 - fall)
        square += gap**2 * lag / 2 * (1 - fall**2)
        current = command + gap * fall
    assert run.criteria["rms_current_A"] == pytest.approx(np.sqrt(square), rel=1e-6)


@pytest.mark.filterwarnings("ignore::isolation_sim.PlausibilityWarning")
def test_a_sliding_base_that_stops_aside_has_a_residual_displacement():
    """A rigid slab on dry friction alone: it stays where it comes to rest."""
    building = iso.shear_building([2e5], [1e9], base_mass=2e5)
    device = iso.law("dahl", {"k": 0.0, "c": 0.0, "sigma": 3e8, "F_c": 3e5})
    pulse = Record(np.where(TIME < 1.0, 3.0, 0.0), 0.02, name="push").padded(after=10)
    run = iso.simulate(building.on(device), pulse, criteria=["residual_base_displacement_m"])
    last = abs(float(np.asarray(run.history["displacement"].sel(dof="base")).ravel()[-1]))
    assert last > 0.1
    assert run.criteria["residual_base_displacement_m"] == pytest.approx(last, rel=1e-3)


@pytest.mark.filterwarnings("ignore::isolation_sim.PlausibilityWarning")
def test_a_residual_displacement_is_not_that_of_a_swing():
    """A pendulum with friction stays aside, without friction it swings for long."""
    values = {"W": 3.9e6, "R": 2.5, "a": 50.0, "u_y": 5e-4, "n": 2.0, "tau": 0.01}
    building = iso.shear_building([2e5], [1e9], base_mass=2e5)
    residuals = []
    for friction in (0.03, 1e-4):
        device = iso.law("friction_pendulum", values | {"mu_max": friction, "mu_min": friction})
        run = iso.simulate(
            building.on(device), GROUND.padded(after=60), criteria=["residual_base_displacement_m"]
        )
        base = np.asarray(run.history["displacement"].sel(dof="base")).ravel()
        residuals.append((run.criteria["residual_base_displacement_m"], abs(base[-1])))
    (stays, last), (swings, _) = residuals
    assert last > 1e-4 and stays == pytest.approx(last, rel=1e-3)
    assert np.isnan(swings)


@pytest.mark.filterwarnings("ignore::isolation_sim.PlausibilityWarning")
def test_tables_have_its_label_unit_and_mark(plant, tmp_path, monkeypatch):
    switches = iso.Criterion(
        "stroke_m", "path of a valve", lambda run: len(run.controller), "larger"
    )
    compared = iso.compare(plant, GROUND, ["passive_off", "on_off"], criteria=[switches])
    assert compared.criteria["on_off"]["stroke_m"] == 6.0
    assert is_gain("stroke_m") and not is_gain("peak_drift_m")
    (line,) = (line for line in as_text(compared.table()).splitlines() if "valve" in line)
    assert line.split() == ["path", "of", "a", "valve,", "mm", "11000*", "6000"]
    # of another process, which has not loaded it
    compared.save(tmp_path / "saved")
    monkeypatch.setattr("isolation_sim.criterion._SELECTED", {})
    text = as_text(run_table(compared.runs["on_off"]))
    assert "stroke, mm" in text and not is_gain("stroke_m")
    saved = iso.load(tmp_path / "saved")
    assert "path of a valve, mm" in as_text(saved.table()) and is_gain("stroke_m")
    with pytest.raises(iso.InputError, match="criterion stroke_m is of a saved result"):
        saved.runs["on_off"].selected[0].of(None)


@pytest.mark.filterwarnings("ignore::isolation_sim.PlausibilityWarning")
def test_many_runs_have_the_values_of_single_ones(plant):
    cases = [iso.Case(plant, GROUND, iso.controller("constant", amperes=k / 4)) for k in range(9)]
    batch = iso.simulate_many(cases, criteria=SHIPPED[::2])
    for k in (0, 8):
        alone = iso.simulate(plant, GROUND, cases[k].controller, criteria=SHIPPED[::2])
        for name in (*SHIPPED[::2], "peak_drift_m"):
            assert batch.criteria[name][k] == alone.criteria[name]
    np.testing.assert_allclose(batch.criteria["rms_current_A"], np.arange(9) / 4, rtol=1e-9)


@pytest.mark.filterwarnings("ignore::isolation_sim.PlausibilityWarning")
def test_scenario_sweep_and_saved_results_have_it(scenario, tmp_path, monkeypatch):
    compared = iso.run_scenario(scenario)
    values = compared.criteria
    assert values["constant"]["command_changes"] == 0 < values["on_off"]["command_changes"]
    compared.save(tmp_path / "saved")
    assert iso.load(tmp_path / "saved").criteria == values
    plan = {"scenario": str(scenario), "vary": [{"field": "driver.lag_s", "values": [0.0, 0.05]}]}
    swept = iso.sweep(iso.SweepPlan.from_dict(plan, tmp_path), tmp_path / "sweep", workers=2)
    assert {"isolator_travel_m", "command_changes"} <= set(swept.criteria)
    first = swept.table.iloc[[0, 1]].set_index("controller")
    for name in values:
        assert first.loc[name, "isolator_travel_m"] == values[name]["isolator_travel_m"]
    # of another process, which has not loaded its file
    monkeypatch.setattr("isolation_sim.criterion._SELECTED", {})
    loaded = iso.load(tmp_path / "sweep")
    assert loaded.best("command_changes")["controller"].iloc[0] == "on_off"
    assert title_of("command_changes") == "changes of the command"


@pytest.mark.filterwarnings("ignore::isolation_sim.PlausibilityWarning")
def test_a_saved_suite_has_it(plant, tmp_path, monkeypatch):
    number = iso.Criterion(
        "number", "length of its name", lambda run: len(run.controller), "larger"
    )
    controllers = ["passive_off", "on_off"]
    iso.compare_records(plant, [GROUND], controllers, criteria=[number]).save(tmp_path / "suite")
    monkeypatch.setattr("isolation_sim.criterion._SELECTED", {})
    suite = iso.load(tmp_path / "suite")
    assert is_gain("number") and title_of("number") == "length of its name"
    assert suite.table["number"].tolist() == [11, 6]


@pytest.mark.filterwarnings("ignore::isolation_sim.PlausibilityWarning")
def test_tuning_minimises_it(scenario, tmp_path):
    tuned = iso.tune(
        "on_off", scenario=scenario, motions="scenario", unseen="mixture:1", evaluations=3,
        criteria={"isolator_travel_m": 1.0}, workers=2, out=tmp_path / "tuned",
    )  # fmt: skip
    assert all(np.isfinite(one.mean) for one in tuned.trials)
    assert "isolator_travel_m" in (tmp_path / "tuned" / "tuning.json").read_text()


def test_tuning_does_not_minimise_what_is_to_be_large(scenario, tmp_path):
    refused = (
        "criterion command_changes: given one whose larger value is better; expected: one to mi"
    )
    with pytest.raises(iso.InputError, match=refused):
        iso.tune(
            "on_off", scenario=scenario, motions="scenario", unseen="mixture:1", evaluations=2,
            criteria={"command_changes": 1.0}, workers=1, out=tmp_path / "tuned",
        )  # fmt: skip


def _fails(run):
    raise ZeroDivisionError("no sample")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: [iso.Criterion("f_m", "f", _fails)], "criterion f_m, run passive_off: ZeroDiv"),
        (lambda: [iso.Criterion("f_m", "f", _fails)], "Error: no sample (test_criterion.py:"),
        (lambda: [iso.Criterion("f_m", "f", lambda run: "x")], "f_m of run passive_off: given 'x'"),
        (lambda: [iso.Criterion("f m", "f", _fails)], "name of a criterion: given 'f m'; expected"),
        (lambda: [iso.Criterion("f_m", "f", 3.0)], "f_m: of: given 3.0; expected: a function"),
        (lambda: [iso.Criterion("f_m", "f", _fails, "most")], "f_m: better: given 'most'; exp"),
        (lambda: [iso.Criterion("peak_drift_m", "f", len)], "peak_drift_m is one of every run"),
        (lambda: [iso.Criterion("J1", "f", len)], "criterion J1 is a column of every table"),
        (lambda: [iso.Criterion("normalised_travel", "f", len)], "not beginning with normalised_"),
        (lambda: ["isolator_travel_m", "isolator_travel_m"], "selected twice; expected: once"),
        (lambda: ["isolator_travl_m"], "unknown criterion 'isolator_travl_m'"),
        (lambda: [3], "criteria[0]: given 3; expected: text or a Criterion"),
    ],
)
def test_what_cannot_be_used_is_refused(plant, make, message):
    with pytest.raises(iso.InputError) as caught:
        iso.simulate(plant, GROUND, criteria=make())
    assert message in str(caught.value)
