"""Nothing of a user's is lost, and nothing goes wrong without a word."""

import os
import signal
import subprocess
import sys
import textwrap
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import el_centro_1940, near_fault
from isolation_sim.cli import main
from isolation_sim.effects import effect, extend
from isolation_sim.errors import Diverged, InputError, PlausibilityWarning, TestedRangeWarning
from isolation_sim.io.files import check_new_files, check_writable
from isolation_sim.io.results_folder import ResultsFolder, write_contents
from isolation_sim.reports.tables import as_text, criteria_tables
from isolation_sim.scenario.building import MoatWall
from isolation_sim.simulation.batch import Case
from isolation_sim.structures import plan_building

pytestmark = pytest.mark.usefixtures("no_drawing")

ROOT = Path(__file__).resolve().parents[1]
SHORT = '[ground]\nstop_s = 2.0\n[[controller]]\nname = "passive_off"\n'


@pytest.fixture(scope="module")
def shake():
    return el_centro_1940().cut(0, 4)


@pytest.fixture(scope="module")
def isolated():
    return iso.reference_building().on(iso.reference_isolators())


def warnings_of(kind, call):
    """Warnings of a kind that a call gives, and what it returns."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = call()
    return [str(each.message) for each in caught if issubclass(each.category, kind)], result


def command(capsys, *arguments):
    code = 0
    try:
        main([str(each) for each in arguments])
    except SystemExit as stop:
        code = int(stop.code or 0)
    return code, *capsys.readouterr()


def test_deformation_beyond_the_tests_is_reported_once_in_python(shake, isolated):
    strong = shake.scaled(3.0).padded(after=10.0)
    lines, run = warnings_of(TestedRangeWarning, lambda: iso.simulate(isolated, strong))
    peak = 1e3 * run.criteria["peak_base_displacement_m"]
    assert lines == run.warnings()
    assert lines == [
        f"isolator deforms further than its law was tested, 80 mm at this scale: "
        f"passive off {peak:.0f} mm"
    ]
    lines, _ = warnings_of(
        TestedRangeWarning, lambda: iso.compare(isolated, strong, ["passive_off", "passive_on"])
    )
    assert len(lines) == 1
    # a weak motion and a controller's own trials are silent
    assert (
        warnings_of(TestedRangeWarning, lambda: iso.simulate(isolated, shake.scaled(0.2)))[0] == []
    )


def test_current_beyond_the_tests_is_reported(shake, isolated):
    lines, run = warnings_of(
        TestedRangeWarning,
        lambda: iso.simulate(isolated, shake.scaled(0.2), iso.controller("constant", amperes=4.0)),
    )
    assert lines == [
        "coil 0 carries more current than its devices were tested with, 3 A: constant 4 A"
    ]
    assert run.test_comparison.current_ratio == pytest.approx(4 / 3)


def test_a_batch_says_how_many_runs_leave_the_tests(shake, isolated):
    """Ratios equal those of single runs, for an element in a storey too."""
    braced = isolated.with_element(
        iso.law("strain_stiffening").scaled(length=0.1, force=10.0), "storey1", 0, "brace"
    )
    cases = [
        Case(plant, shake.scaled(factor), iso.controller("constant", amperes=2.0))
        for factor in (0.1, 1.0, 2.0, 3.0)
        for plant in (isolated, braced)
    ] * 2
    lines, batch = warnings_of(TestedRangeWarning, lambda: iso.simulate_many(cases))
    assert len(lines) == 1 and " of 16 runs deform an isolator or element further" in lines[0]
    for k in (0, 3, 6, 7):
        case = cases[k]
        _, run = warnings_of(
            TestedRangeWarning,
            lambda case=case: iso.simulate(case.isolated, case.ground, case.controller),
        )
        assert batch.deformation_over_tested[k] == pytest.approx(
            run.test_comparison.deformation_ratio, rel=1e-6
        )
        deformed = np.abs(run.history["deformation"]).max(axis=0)
        assert run.test_comparison.deformation == pytest.approx(deformed, rel=2e-3)


def test_the_deformation_of_an_isolator_in_plan_is_the_vector(shake):
    """In the structure's scale, whatever the isolator's length scale."""
    stiffness = [3e8, 3e8]
    structure = plan_building([3e5] * 2, stiffness, stiffness, base_mass=3e5, plan=(20.0, 12.0))
    plan = structure.on(iso.law("improved_bouc_wen").scaled(2.0, 3e3), biaxial=True)
    lines, run = warnings_of(
        TestedRangeWarning, lambda: iso.simulate(plan, (shake, shake.scaled(0.8)))
    )
    along = np.asarray(run.history["deformation"])[:, :2]
    peaks = np.sqrt(np.max(np.sum(along**2, axis=1)))
    assert peaks > 1.1 * np.abs(along).max()
    assert run.test_comparison.deformation.max() == pytest.approx(peaks, rel=2e-3)
    tested = run.test_comparison.tested_deformation[0]
    assert any(f"{1e3 * peaks:.0f} mm" in line for line in lines) == (peaks > tested)


def test_isolators_alike_have_one_line_with_the_largest_deformation(shake):
    corners = [(8.0, 5.0), (8.0, -5.0), (-8.0, 5.0), (-8.0, -5.0)]
    structure = plan_building(
        [3e5], [3e8], [3e8], base_mass=3e5, plan=(20.0, 12.0), isolator_positions=corners
    )
    plan = structure.on(iso.reference_isolators(), biaxial=True)
    strong = shake.scaled(3.0)
    lines, run = warnings_of(TestedRangeWarning, lambda: iso.simulate(plan, (strong, strong)))
    (line,) = [line for line in lines if "deforms further" in line]
    peak = 1e3 * run.test_comparison.deformation.max()
    assert " (and 3 like it) deforms" in line and line.endswith(f"passive off {peak:.0f} mm")


def test_many_runs_say_what_single_runs_say(shake, tmp_path):
    """Each kind is counted; a run that has a warning alone is among them."""
    building = iso.reference_building()
    plants = building.on(friction(0.0)), building.on(iso.reference_isolators())
    motions = shake.padded(after=8.0), shake, shake.scaled(9.80665)
    cases = [
        Case(plant, motion, iso.controller("passive_off")) for plant in plants for motion in motions
    ] * 2
    lines, batch = warnings_of(PlausibilityWarning, lambda: iso.simulate_many(cases))
    single = [
        warnings_of(PlausibilityWarning, lambda c=c: iso.simulate(*case_of(c)))[0] for c in cases
    ]
    for part in ("no restoring stiffness", "3.13 g", "still move", "displaced"):
        number = sum(any(part in line for line in alone) for alone in single)
        (line,) = (line for line in lines if part in line)
        assert 0 < number < 12 and line.startswith(f"{number} of 12 runs")
    assert set(lines) <= set(batch.warnings())
    # fewer runs are computed one by one, and say the same
    few = warnings_of(PlausibilityWarning, lambda: iso.simulate_many(cases[:6]))[1]
    for name in ("moving_at_end", "displacement_at_end", "implausible"):
        assert np.array_equal(getattr(few, name), getattr(batch, name)[:6])


def case_of(case):
    return case.isolated, case.ground, case.controller


def test_a_sweep_says_what_single_runs_say(tmp_path):
    plan = {
        "scenario": {"ground": {"name": "el_centro_1940_ns", "stop_s": 4.0},
                     "controller": [{"name": "passive_off"}]},
        "vary": [{"field": "ground.scale_factor", "values": [0.2, 0.4, 10.0]}],
    }  # fmt: skip
    swept = iso.sweep(plan, tmp_path / "sweep", workers=1)
    moving = "3 of 3 runs still move at the end"
    assert any(line.startswith(moving) for line in swept.warnings())
    assert any(line.startswith("1 of 3 runs: ground motion") for line in swept.warnings())
    assert f"warning: {moving}" in str(swept)
    assert f"Warning: {moving}" in swept.to_html(tmp_path / "report.html").read_text()
    # a table of an earlier release has no such columns
    old = iso.load(tmp_path / "sweep")
    vars(old)["table"] = swept.table.drop(columns=["moving_at_end", "implausible"])
    assert not any("still move" in line for line in old.warnings())


def test_fifty_times_the_tests_ends_the_run_and_names_the_scale(shake):
    """A laboratory device that was not scaled, and one whose tests are said to reach further."""
    unscaled = iso.reference_building().on(iso.law("strain_stiffening").scaled(force=30.0))
    with pytest.raises(Diverged, match=r"50 times further .* check length_scale and force_scale"):
        iso.simulate(unscaled, shake.scaled(3.0))


def test_a_motion_out_of_scale_is_blamed_and_not_the_controller(shake, isolated):
    with pytest.raises(Diverged, match=r"ground motion peaks at \d+ m/s\^2 .*check its unit"):
        iso.simulate(isolated, shake.scaled(100.0))


def test_a_wrong_unit_of_masses_is_reported_with_the_period(shake):
    building = iso.shear_building([250.0] * 3, [5e8] * 3, base_mass=300.0)
    lines, run = warnings_of(
        PlausibilityWarning,
        lambda: iso.simulate(
            building.on(iso.reference_isolators()), shake.scaled(0.1).padded(after=10.0)
        ),
    )
    assert len(lines) == 1
    assert "fixed-base period of 0.00998 s" in lines[0] and "masses in t" in lines[0]
    assert lines[0] in iso.Comparison({"passive_off": run}).warnings()


@pytest.mark.parametrize(
    ("call", "part"),
    [
        (lambda record: record.padded(after=1e9), "5e+10 samples; expected: up to 20,000,000"),
        (lambda record: record.resampled(1e-7), "resampled to 1e-07 s"),
        (lambda record: Case and _with_period(record), "period is 1e-09 s, 4e+09 decisions"),
    ],
)
def test_what_does_not_fit_into_memory_is_refused(shake, call, part):
    with pytest.raises(InputError) as caught:
        call(shake)
    assert part in str(caught.value) and "\n" not in str(caught.value)


def _with_period(record):
    isolated = iso.reference_building().on(iso.reference_isolators())
    return iso.simulate(isolated, record, iso.controller("on_off", period=1e-9))


@pytest.mark.parametrize(
    ("vary", "part"),
    [
        ([{"field": "isolator.count", "low": 1.0, "high": 2.0, "count": 10**8}], "makes 1e+08"),
        ([{"field": "isolator.count", "low": 0.1, "high": 2.0, "step": 1e-9}], "makes 1.9e+09"),
        ([{"field": f, "low": 0.1, "high": 2.0, "count": 10**4}
          for f in ("isolator.count", "ground.scale_factor")], "100,000,000 cases (10000 x 10000)"),
    ],
)  # fmt: skip
def test_a_sweep_of_endless_cases_is_refused(tmp_path, vary, part):
    with pytest.raises(InputError) as caught:
        iso.sweep({"vary": vary}, tmp_path / "out", workers=1)
    assert part in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_files_are_new_and_places_can_be_written(tmp_path):
    old = tmp_path / "old.toml"
    old.write_text("mine")
    with pytest.raises(InputError, match="exists; expected: a new name, or --force"):
        check_new_files(False, None, old)
    check_new_files(True, old)
    check_new_files(False, tmp_path / "new" / "file.toml")
    with pytest.raises(InputError, match="a folder; expected: a file"):
        check_new_files(True, tmp_path)
    with pytest.raises(InputError, match=r"old\.toml is a file; expected: a folder"):
        check_writable(old / "below")


def test_results_are_replaced_on_request_alone(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("job.toml").write_text(SHORT)
    for expected, text in ((0, "warning"), (2, "out: is not empty; expected: a new folder, or")):
        words = ("run", "job.toml", "--out", "out", "--quiet", "--no-figures")
        code, _, err = command(capsys, *words)
        assert code == expected and text in err
    Path("out/mine.txt").write_text("mine")
    code, out, _ = command(
        capsys, "run", "job.toml", "--out", "out", "--quiet", "--no-figures", "--overwrite"
    )
    assert (code, out) == (0, "results: out\n")
    assert Path("out/mine.txt").read_text() == "mine" and Path("out/criteria.csv").exists()
    assert "mine" not in Path("out/README.txt").read_text()
    Path("other").mkdir()
    Path("other/thesis.txt").write_text("mine")
    code, _, err = command(capsys, "run", "job.toml", "--out", "other", "--overwrite")
    assert code == 2 and "other: is no results folder" in err
    assert Path("other/thesis.txt").read_text() == "mine"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["job.toml", "other", "out"]


def test_a_failure_while_overwriting_keeps_the_old_results(tmp_path):
    with ResultsFolder(tmp_path / "out") as folder:
        (folder.unfinished / "criteria.csv").write_text("old")
        write_contents(folder.unfinished, "old")
    with pytest.raises(RuntimeError), ResultsFolder(tmp_path / "out", overwrite=True):
        raise RuntimeError
    assert (tmp_path / "out" / "criteria.csv").read_text() == "old"
    assert [each.name for each in tmp_path.iterdir()] == ["out"]


def test_a_terminated_command_leaves_nothing_behind(tmp_path):
    """SIGTERM while results are being written."""
    script = """
        import os, signal, sys
        from isolation_sim.reports.html import run_report
        import isolation_sim.comparison as module
        def stop(*_):
            os.kill(os.getpid(), signal.SIGTERM)
            import time; time.sleep(10)
        module.simulated = stop
        from isolation_sim.cli import main
        main(["run", "--out", "results/deep/out"])
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)], cwd=tmp_path, capture_output=True,
        text=True, timeout=60, env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert done.returncode == 128 + signal.SIGTERM, done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


IN_A_CALLBACK = """
import ctypes, signal, time, types
from isolation_sim import cli

compiler = ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGTERM))

def work(*arguments, **options):
    compiler()
    for _ in range(400):  # a long sleep would end before the signal's handler runs
        time.sleep(0.05)
    print("went on")

cli.get_command = lambda app: types.SimpleNamespace(main=work)
cli.main()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGTERM to catch")
def test_a_signal_while_a_law_compiles_ends_the_command():
    """Python ignores what is raised within a callback from C, such as that of the compiler."""
    done = subprocess.run(
        [sys.executable, "-c", IN_A_CALLBACK], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (143, "", "")


def test_a_name_of_ones_own_that_hides_a_package_is_reported(tmp_path):
    """A controllers.py beside a script, and a ground_motions.py."""
    code = "import isolation_sim as iso; iso.controller('passive_off')"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for name, kind in (("controllers", "InputError"), ("ground_motions", "ImportError")):
        (tmp_path / f"{name}.py").write_text("")
        (tmp_path / "script.py").write_text(code)
        done = subprocess.run(
            [sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True,
            env=environment, timeout=60,
        )  # fmt: skip
        last = done.stderr.strip().splitlines()[-1]
        assert kind in last and f"{name}.py hides the package '{name}' of isolation-sim" in last
        (tmp_path / f"{name}.py").unlink()


def test_workers_find_the_projects_packages_first(tmp_path, monkeypatch):
    from isolation_sim import workers

    (tmp_path / "controllers.py").write_text("raise RuntimeError")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(workers, "_COMMAND", "import controllers; print(controllers.__file__)")
    process = workers._start_process()
    assert process.stdout is not None
    assert str(ROOT) in process.stdout.read().decode()
    process.kill()
    process.wait()


def test_a_home_that_cannot_be_written_is_replaced(tmp_path, monkeypatch, capsys):
    from isolation_sim.compilation import generated

    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.delenv("ISOLATION_SIM_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(blocked))
    monkeypatch.setattr(generated.tempfile, "gettempdir", lambda: str(tmp_path))
    generated._writable.cache_clear()
    result = generated.cache_folder()
    assert result.parent == tmp_path and result.is_dir()
    assert "set ISOLATION_SIM_CACHE" in capsys.readouterr().err
    generated.cache_folder()
    assert capsys.readouterr().err == ""  # once
    monkeypatch.setenv("ISOLATION_SIM_CACHE", str(blocked / "below"))
    with pytest.raises(InputError, match=r"ISOLATION_SIM_CACHE=.*cannot be written"):
        generated.cache_folder()
    generated._writable.cache_clear()


def test_numbers_of_eleven_controllers_stay_whole():
    names = [f"model_predictive_{k}" for k in range(11)]
    criteria = {name: {"peak_drift_m": 1e-3 * (k + 1.2721)} for k, name in enumerate(names)}
    table = criteria_tables(criteria, {name: {} for name in names})
    for width in (60, 80, 100, 200):
        text = as_text(table, width)
        assert max(map(len, text.splitlines())) <= width and "…" not in text
        for k in range(11):
            assert f"{k + 1.2721:#.4g}" in text
        assert text.count("*") == 1 + text.count("* best of the row")


def test_a_fixed_base_stands_beside_the_runs(shake, isolated):
    """Its response is that of SciPy's integration of the building alone."""
    from scipy.integrate import solve_ivp

    _, comparison = warnings_of(
        TestedRangeWarning,
        lambda: iso.compare(isolated, shake, ["passive_off", "passive_on"], fixed_base=True),
    )
    building = isolated.structure.fixed_base()
    inverse = np.linalg.inv(building.mass)
    n = building.n_dofs

    def rates(t, y):
        ground = np.interp(t, shake.time, shake.acceleration)
        forces = building.damping @ y[n:] + building.stiffness @ y[:n]
        return np.concatenate([y[n:], -inverse @ forces - building.influence[:, 0] * ground])

    exact = solve_ivp(
        rates,
        (0, 4),
        np.zeros(2 * n),
        t_eval=np.linspace(0, 4, 4001),
        rtol=1e-8,
        atol=1e-10,
        max_step=0.02,
    )
    drift = np.abs(building.drift_rows @ exact.y[:n]).max()
    assert comparison.fixed_base.criteria["peak_drift_m"] == pytest.approx(drift, rel=2e-3)
    text = str(comparison)
    assert (
        "fixed" in text and f"{1e3 * comparison.fixed_base.criteria['peak_drift_m']:#.4g}" in text
    )
    assert "J1" in str(iso.Comparison(comparison.runs)) and "fixed base" not in comparison.criteria
    assert (
        comparison.to_pandas().peak_drift_m.iloc[-1]
        == comparison.fixed_base.criteria["peak_drift_m"]
    )
    assert iso.json_report(comparison)["fixed_base"] == comparison.fixed_base.criteria


@pytest.mark.parametrize(
    ("change", "part"),
    [
        (
            lambda record: record.scaled(9.80665),
            "3.13 g; records rarely exceed 2 g: check its unit and scale",
        ),
        (lambda record: replace(record, dt=2.0), "a step of 2 s; records have 0.1 s at most"),
    ],
)
def test_an_implausible_motion_is_reported(shake, change, part):
    rigid = iso.reference_building().on(iso.law("linear", {"k": 6e7}))
    record = change(shake)
    lines, run = warnings_of(PlausibilityWarning, lambda: iso.simulate(rigid, record))
    (line,) = (each for each in lines if "ground motion" in each)
    assert part in line and line in run.warnings()


def test_units_that_agree_with_each_other_alone_are_reported(shake):
    """Masses in t and stiffnesses in kN/m beside isolators in N/m; bearings that are too stiff."""
    masses, storeys = [320.0, 300.0, 180.0], [420e3, 380e3, 190e3]
    sizes = {"base_mass": 350.0, "heights": [4.5, 3.5, 3.5]}
    small = iso.shear_building(masses, storeys, **sizes)
    large = iso.shear_building(
        [1e3 * m for m in masses], [1e3 * k for k in storeys], **sizes | {"base_mass": 350e3}
    )
    for building, stiffness, part in (
        (small, 8e6, "hardly longer than its fixed-base period of"),
        (large, 8e9, "hardly longer than its fixed-base period of"),
        (small, 8e3, "383 kg per storey of 3.83 m; floors have 2000 kg or more"),
    ):
        isolated = building.on(iso.law("kelvin_voigt", {"k": stiffness, "c": 0.02 * stiffness}))
        lines, _ = warnings_of(
            PlausibilityWarning, lambda plant=isolated: iso.simulate(plant, shake)
        )
        assert any(part in line for line in lines)
    right = large.on(iso.law("kelvin_voigt", {"k": 8e6, "c": 2e5}))
    lines, _ = warnings_of(
        PlausibilityWarning, lambda: iso.simulate(right, shake.padded(after=20.0))
    )
    assert lines == []


def friction(stiffness):
    """A damper that slides at 300 kN, with a spring parallel to it."""
    numbers = {"k": stiffness, "c": 1e3, "alpha": 3e5, "A": 1e3, "beta": 5e2, "gamma": 5e2}
    return iso.law("bouc_wen", numbers | {"n": 1.0, "F0": 0.0})


def test_isolators_that_do_not_return_the_base_are_reported(shake):
    building = iso.reference_building()
    quiet = shake.padded(after=8.0)
    lines, run = warnings_of(
        PlausibilityWarning, lambda: iso.simulate(building.on(friction(0.0)), quiet)
    )
    assert "no restoring stiffness along x" in lines[0] and "isolated period at rest" in lines[0]
    assert "the base does not return: it ends displaced" in lines[1]
    assert "passive off" in lines[1] and len(lines) == 2
    assert lines == iso.Comparison({"passive_off": run}).warnings()
    assert "effective_period_s" not in lines[0]
    # a bearing whose stiffness before it yields was taken for that of its period
    device = friction(3e4).scaled(length=1, force=30)
    lines, _ = warnings_of(
        PlausibilityWarning, lambda: iso.simulate(building.on(device, target_period_s=2.0), quiet)
    )
    assert lines[0].endswith("; scale bearings that yield by effective_period_s")
    # a bearing beside the damper returns it
    together = building.on(friction(0.0)).with_element(iso.law("linear", {"k": 1.5e7}), "base")
    assert warnings_of(PlausibilityWarning, lambda: iso.simulate(together, quiet))[0] == []
    assert "isolated period at rest" in repr(together)


def test_isolators_that_return_the_base_at_some_currents_alone_are_reported(shake):
    spring = iso.law("linear", {"k": [2e7, -2e7]}, current_range=(0.0, 1.0))
    held = iso.reference_building().on(friction(0.0)).with_element(spring, "base", channel=0)
    lines, _ = warnings_of(PlausibilityWarning, lambda: iso.simulate(held, shake, "passive_off"))
    assert [" at 1 A: " in line for line in lines if "no restoring" in line] == [True]


def test_a_building_that_still_moves_at_the_end_is_reported(isolated, tmp_path):
    pulse = near_fault.ricker_pulse(0.3, 1.5, dt=0.01, before=0.5, after=0.5)
    lines, run = warnings_of(PlausibilityWarning, lambda: iso.simulate(isolated, pulse))
    assert len(lines) == 1 and lines[0].startswith("the building still moves at the end")
    assert lines[0].endswith("quiet_after_s: passive off")
    assert lines[0] in run.warnings()
    assert iso.load(run.save(tmp_path / "run")).warnings() == run.warnings()
    quiet = pulse.padded(after=10.0)
    assert warnings_of(PlausibilityWarning, lambda: iso.simulate(isolated, quiet))[0] == []


def test_contacts_with_walls_and_end_stops_are_reported(isolated, shake, tmp_path):
    """In one run, in a comparison, in many runs, and after loading."""
    wall = MoatWall(gap_m=0.1, stiffness_N_per_m=1e8).add_to(isolated)
    stop = {"gap": 0.004, "stiffness": 1e6, "exponent": 1.0}
    device = extend(iso.reference_isolators(), [(effect("end_stop", "power"), stop)])
    stopped = iso.reference_building().on(device)
    for plant, name in ((wall, "moat_wall"), (stopped, "isolator")):
        lines, run = warnings_of(
            PlausibilityWarning, lambda plant=plant: iso.simulate(plant, shake)
        )
        (line,) = (each for each in lines if "touched" in each)
        beyond = abs(run.output(f"{name}_deformation_m")) > (0.1 if name == "moat_wall" else 0.04)
        assert run.contacts == {name: np.count_nonzero(np.diff(beyond.astype(int)) == 1)}
        assert line.endswith(f"passive off {name} {run.contacts[name]}") and line in run.warnings()
    loaded = iso.load(run.save(tmp_path / "run"))
    assert loaded.contacts == run.contacts and loaded.warnings() == run.warnings()
    cases = [Case(wall, shake.scaled(0.1 * k), iso.controller("passive_off")) for k in range(1, 11)]
    lines, batch = warnings_of(PlausibilityWarning, lambda: iso.simulate_many(cases))
    touching = np.count_nonzero(batch.contacts)
    assert any(line.startswith(f"{touching} of 10 runs touch") for line in lines)
    assert batch.contacts[-1] == iso.simulate(wall, shake).contacts["moat_wall"]


def test_el_centro_in_the_main_job_is_not_implausible(isolated):
    names = ["passive_off", "passive_on", "on_off", "clipped_lqr"]
    lines, _ = warnings_of(
        PlausibilityWarning, lambda: iso.compare(isolated, el_centro_1940(), names)
    )
    assert lines == []
