"""Results of all five verbs: saved, loaded as what they were, drawn and reported again."""

import inspect
import json
import pickle
import zipfile
from dataclasses import fields, replace

import numpy as np
import pytest
from matplotlib.figure import Figure

import isolation_sim as iso
from isolation_sim.archive import FILE, _object, load_archive, save_archive
from isolation_sim.cli import main
from isolation_sim.discrepancy.diagnosis import Cause, Diagnosis, Errors, Interval, Step, Trace
from isolation_sim.effects import effect, extend
from isolation_sim.errors import Diverged, InputError
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.laws import LAWS
from isolation_sim.laws.law import Law, Quantity
from isolation_sim.structures import plan_building
from studies.study import perform

pytestmark = pytest.mark.filterwarnings("ignore::isolation_sim.errors.TestedRangeWarning")


@pytest.fixture(scope="module")
def comparison():
    isolated = iso.reference_building().on(iso.reference_isolators())
    loaded = iso.compare(
        isolated, iso.el_centro_1940().cut(0, 3), ["passive_off", "clipped_lqr"], fixed_base=True
    )
    return iso.Comparison(
        loaded.runs, diverged={"mpc": Diverged("at t = 1 s")}, fixed_base=loaded.fixed_base
    )


@pytest.fixture(scope="module")
def fitted():
    time = np.arange(0, 3, 1 / 128)
    w = 2 * np.pi
    x, v = 4e-3 * np.sin(w * time), 4e-3 * w * np.cos(w * time)
    noise = np.random.default_rng(0).normal(0, 1.0, time.size)
    runs = tuple(
        TestRun(f"run{k}", time, x, v, 2e4 * x + 300 * v + noise, np.zeros(time.size), bool(k))
        for k in range(2)
    )
    return iso.fit(Campaign("spring", "made for a test", runs), "kelvin_voigt", starts=2)


@pytest.fixture(scope="module")
def diagnosis():
    t = np.linspace(0, 1, 50)
    device = iso.law("bouc_wen", {"k": 1e4, "c": 10.0} | _others())
    return Diagnosis(
        data="tests", model="bouc_wen", verdict="explained", noise_floor=0.01,
        error_before=Errors(0.2, float("nan")), error_after=Errors(0.02, float("nan")),
        causes=(Cause("coulomb_friction", 0.9, 1e-6, {"F": Interval(1.0, 0.9, 1.1, "N")}, "It."),),
        unexplained_share=0.05, depends_on=("velocity",), next_test=None,
        steps=(Step("Fit", "It fits.", ("a",), (("1",),)),), nominal=device,
        extended=extend(device, [(effect("coulomb_friction"), _numbers("coulomb_friction"))]),
        traces=(Trace("run", False, t, t, "x, mm", "F, N", np.sin(t), np.cos(t), np.sin(t)),),
        details={"seed": 0}, data_notes=("run: force clipped",),
    )  # fmt: skip


def _others():
    law = LAWS["bouc_wen"]
    known = {"k", "c"}
    return {q.name: max(1.0, q.lower if np.isfinite(q.lower) else 1.0)
            for q in law.parameters if q.name not in known}  # fmt: skip


def _numbers(cause):
    return {q.name: max(1e-3, q.lower if np.isfinite(q.lower) else 0) + 1e-3
            for q in effect(cause).parameters}  # fmt: skip


def same(a, b):
    """Whether two results hold the same data, looked at field by field."""
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    if isinstance(a, float):
        return a == b or (a != a and b != b)
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[k], b[k]) for k in a)
    if isinstance(a, Law):
        return a is b
    if hasattr(a, "__dataclass_fields__"):
        return type(a) is type(b) and all(
            same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a)
        )
    if isinstance(a, Exception):
        return str(a) == str(b)
    if isinstance(a, iso.Run | iso.Comparison):
        return type(a) is type(b) and same(a.__getstate__(), b.__getstate__())
    return a == b


def test_a_comparison_comes_back(comparison, tmp_path):
    loaded = iso.load(comparison.save(tmp_path / "out"))
    assert loaded.warnings() == comparison.warnings()
    for kind in ("time_histories", "loops", "currents", "floor_envelopes", "energy"):
        assert isinstance(loaded.plot(kind), Figure)
    again = loaded.save(tmp_path / "again")
    for name in ("report.html", "table.txt", "criteria.csv", "criteria.json"):
        assert (again / name).read_bytes() == (tmp_path / "out" / name).read_bytes()


def test_a_run_comes_back(comparison, tmp_path):
    run = comparison.runs["clipped_lqr"]
    loaded = iso.load(run.save(tmp_path / "run"))
    assert loaded.history.identical(run.history)
    with pytest.raises(InputError, match="unknown output"):
        loaded.output("floor9_acceleration_m_s2")


def test_a_fit_comes_back(fitted, tmp_path):
    loaded = iso.load(fitted.save(tmp_path / "fit"))
    assert loaded.to_dict() == fitted.to_dict()
    assert iso.Scenario.read(tmp_path / "fit" / "fitted.toml").isolator.law == "kelvin_voigt"


def test_a_diagnosis_comes_back(diagnosis, tmp_path):
    diagnosis.save(tmp_path / "diagnosis")
    loaded = iso.load(tmp_path / "diagnosis")
    assert loaded.extended.law is diagnosis.extended.law
    assert loaded.to_json() == diagnosis.to_json()


STUDY = '''"""A question of one's own."""
import matplotlib.figure
from studies.study import Outcome, swept
TITLE = "What does nothing do?"
PLAN = {
    "scenario": {"ground": {"stop_s": 1.0}, "controller": [{"name": "passive_off"}]},
    "vary": [{"field": "isolator.count", "values": [1.0]}],
}
def outcome(folder, short, step):
    runs = swept(PLAN, folder, step).table
    peak = float(runs["peak_drift_m"][0])
    rows = [{"case": "none", "peak_m": None}, {"case": "one", "peak_m": peak}]
    return Outcome(rows, "Little.\\n\\nVery little.", {"empty": matplotlib.figure.Figure()})
'''


def test_a_study_comes_back(tmp_path, capsys):
    (tmp_path / "mine.py").write_text(STUDY)
    outcome, folder = perform(str(tmp_path / "mine.py"), tmp_path / "out")
    study = iso.load(folder)
    assert isinstance(study, iso.Study)
    assert (study.title, study.finding) == ("What does nothing do?", outcome.finding)
    assert list(study.table["case"]) == ["none", "one"]
    assert np.isnan(study.table["peak_m"][0])
    assert study.table["peak_m"][1] == outcome.table[1]["peak_m"]
    assert study.figures == {"empty": folder / "figures" / "empty.svg"}
    assert study.sweep.table["peak_drift_m"][0] == study.table["peak_m"][1]
    assert repr(study) == "Study(What does nothing do? 2 rows, 1 figures)"
    for text in (str(study), study._repr_html_()):
        assert "never" in text and "Very little." in text


def cited(capsys, folder):
    with pytest.raises(SystemExit) as ended:
        main(["cite", str(folder)])
    return ended.value.code or 0, *capsys.readouterr()


def test_what_a_saved_result_cites(fitted, diagnosis, tmp_path, capsys):
    """A fit cites its law, a diagnosis its effects too, a study the runs of its sweep."""
    code, out, _ = cited(capsys, fitted.save(tmp_path / "fit"))
    assert code == 0 and "for: law kelvin_voigt" in out
    diagnosis.save(tmp_path / "diagnosis")
    code, out, _ = cited(capsys, tmp_path / "diagnosis")
    assert code == 0 and "for: law bouc_wen" in out and "effect coulomb_friction" in out
    (tmp_path / "mine.py").write_text(STUDY)
    _, folder = perform(str(tmp_path / "mine.py"), tmp_path / "out")
    code, out, _ = cited(capsys, folder)
    assert code == 0 and "El Centro" in out
    (tmp_path / "no").mkdir()
    (tmp_path / "no" / "finding.txt").write_text("A title\n\nNothing.\n")
    code, out, err = cited(capsys, tmp_path / "no")
    assert code == 2 and err.count("\n") == 1 and "name no sources" in err


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    plan = {
        "scenario": {"ground": {"stop_s": 1.0}, "controller": [{"name": "passive_off"}]},
        "vary": [{"field": "isolator.count", "values": [1.0, 1.2]}],
    }
    return iso.sweep(plan, tmp_path_factory.mktemp("swept") / "sweep", workers=1)


@pytest.fixture(scope="module")
def results(comparison, fitted, diagnosis, swept):
    """What each of the five verbs returns."""
    run = comparison.runs["clipped_lqr"]
    return {
        "simulate": run, "compare": comparison, "fit": fitted, "diagnose": diagnosis,
        "sweep": swept,
    }  # fmt: skip


@pytest.mark.parametrize("verb", ["simulate", "compare", "fit", "diagnose", "sweep"])
def test_results_of_every_verb_are_objects_that_behave(results, verb, tmp_path, capsys):
    """Saved, loaded, pickled, drawn, shown in a line, in a terminal, in a notebook and as data."""
    made = results[verb]
    if verb == "sweep":  # its folder is the result
        folder = made.folder
    else:
        made.save(tmp_path / "out")
        folder = tmp_path / "out"
    for loaded in (iso.load(folder), pickle.loads(pickle.dumps(made))):
        assert type(loaded) is type(made)
        assert isinstance(loaded.plot(), Figure)
        assert loaded.to_pandas().equals(made.to_pandas()) and len(made.to_pandas())
        assert same(loaded.criteria, made.criteria) and made.criteria
        assert repr(loaded) == repr(made) and "\n" not in repr(made) and len(repr(made)) < 300
        assert loaded.summary() == made.summary() == str(made) and len(str(made)) < 6000
        loaded.report()
        printed = capsys.readouterr().out
        assert printed.split() == made.summary().split()
        assert loaded._repr_html_().startswith("<pre")
        if verb != "sweep":
            assert same(loaded, made)


def test_a_summary_of_a_diagnosis_names_the_causes(diagnosis):
    text = diagnosis.summary()
    for part in ("bouc_wen against tests", "EXPLAINED", "coulomb_friction", "20.00", "2.00"):
        assert part in text
    table = diagnosis.to_pandas()
    assert table.loc[0, ["cause", "parameter", "value", "unit"]].tolist() == [
        "coulomb_friction", "F", 1.0, "N",
    ]  # fmt: skip
    assert "explained, coulomb_friction; error 20 % to 2 %, noise 1 %" in repr(diagnosis)


def test_a_run_in_plan_is_pickled():
    """Its laws in plan are made by a function, and have no name."""
    building = plan_building([3e5], [2e8], [2e8], base_mass=3e5, plan=(20.0, 12.0))
    isolated = building.on(iso.law("kelvin_voigt", {"k": 1e7, "c": 1e6}), biaxial=True)
    record = iso.el_centro_1940().cut(0, 2)
    made = iso.simulate(isolated, [record, record.scaled(0.5)], "passive_off")
    assert made.isolated.group_laws[0].directions == 2
    loaded = pickle.loads(pickle.dumps(made))
    assert loaded.isolated.group_laws == made.isolated.group_laws
    assert same(loaded.criteria, made.criteria)


def test_suites_and_tunings_are_loaded_too(tmp_path, swept):
    (tmp_path / "tuning.json").write_text(
        '{"content": {"controller": "on_off"}, "trials": [], "sensitivity": {}, "outcomes": []}'
    )
    assert isinstance(iso.load(tmp_path), iso.Tuning)
    (tmp_path / "suite.json").write_text('{"motions": [1, 2]}')
    with pytest.raises(InputError, match="no sweep there"):
        iso.load(tmp_path)
    (tmp_path / "sweep").symlink_to(swept.folder)
    assert repr(iso.load(tmp_path)).endswith("2 motions)")


def test_results_of_an_earlier_version_have_an_old_name(tmp_path, diagnosis):
    state = {f.name: getattr(diagnosis, f.name) for f in fields(diagnosis)}
    state["judged"] = state.pop("nominal")
    with pytest.warns(FutureWarning, match="judged is now called nominal"):
        earlier = _object(f"{Diagnosis.__module__}:{type(diagnosis).__name__}", state)
    assert same(earlier, diagnosis)
    with pytest.warns(FutureWarning, match="judged is now called nominal"):
        assert earlier.judged is diagnosis.nominal
    (tmp_path / "tuning.json").write_text(
        '{"content": {}, "trials": [], "sensitivity": {}, "judged": []}'
    )
    with pytest.warns(FutureWarning, match="judged is now called outcomes"):
        tuning = iso.load(tmp_path)
    with pytest.warns(FutureWarning, match="judged is now called outcomes"):
        assert tuning.judged == tuning.outcomes == []


@pytest.mark.parametrize("make", [
    lambda device: device,
    iso.passive,
    lambda device: extend(device, [(effect("current_lag"), _numbers("current_lag"))]),
])  # fmt: skip
def test_every_kind_of_law_is_restored(make, tmp_path):
    device = make(iso.law("strain_stiffening"))
    save_archive(device, tmp_path / FILE)
    for loaded in (load_archive(tmp_path / FILE), pickle.loads(pickle.dumps(device))):
        assert loaded.law is device.law and same(loaded, device)


def test_a_law_without_a_name_says_what_to_do(tmp_path):
    own = Law("own", "Own", (Quantity("k", "N/m", "stiffness"),), lambda x, v, s, p: p[0] * x)
    device = iso.law(own, {"k": 1.0})
    with pytest.raises(InputError, match=r"law 'own' cannot be saved.*register\('law'"):
        save_archive(device, tmp_path / FILE)
    assert not list(tmp_path.iterdir())


def test_a_result_whose_law_file_is_gone_shows_its_numbers(tmp_path):
    file = tmp_path / "my_laws.py"
    file.write_text(
        "from dataclasses import replace\n"
        "from isolation_sim.laws.kelvin_voigt import LAW\n\n"
        'OWN = replace(LAW, name="own")\n'
    )
    device = iso.law(f"{file}:OWN", {"k": 1.5e7, "c": 5e5})
    isolated = iso.reference_building().on(device)
    run = iso.simulate(isolated, iso.el_centro_1940().cut(0, 1))
    comparison = iso.Comparison({"passive_off": run})
    run.save(tmp_path / "run")
    comparison.save(tmp_path / "comparison")
    file.write_text(file.read_text() + "# changed\n")
    with pytest.warns(UserWarning, match=r"my_laws.py has changed since the result was saved"):
        iso.load(tmp_path / "run")
    file.unlink()
    with pytest.warns(UserWarning, match=r"my_laws.py: no such file; the result is loaded without"):
        loaded = iso.load(tmp_path / "run")
        both = iso.load(tmp_path / "comparison")
    assert loaded.criteria == run.criteria and loaded.warnings() == run.warnings()
    np.testing.assert_array_equal(loaded.history["displacement"], run.history["displacement"])
    assert loaded.plot() and both.plot("loops") and loaded.isolated.elements[0].device.name == "own"
    assert "own" in repr(both.runs["passive_off"].isolated.elements[0].device)
    assert both.to_html(tmp_path / "report.html").is_file() and str(both.table())
    with pytest.raises(InputError, match=r"my_laws.py: no such file; expected: the file of law"):
        iso.simulate(loaded.isolated, loaded.records)


@pytest.mark.parametrize("tree", [
    {"$object": "os:system", "state": {}},
    {"$object": "isolation_sim.io.files:write_text", "state": {}},
    {"$object": "isolation_sim.simulation.result:Ruin", "state": {}},
    {"$array": "none"}, {"$unknown": 1}, [{"$law": {"$tuple": ["named", "no_such_law"]}}],
])  # fmt: skip
def test_a_file_that_is_no_result_is_refused_and_nothing_is_run(tree, tmp_path):
    path = tmp_path / FILE
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("tree.json", json.dumps({"result": tree}))
    with pytest.raises(InputError, match=str(path)) as error:
        iso.load(path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("content", [None, b"", b"PK\x03\x04", b"text"])
def test_what_cannot_be_loaded_is_reported(content, tmp_path):
    if content is not None:
        (tmp_path / FILE).write_bytes(content)
    with pytest.raises(InputError, match="saved result"):
        iso.load(tmp_path)
    with pytest.raises(InputError, match="saved result"):
        iso.load(tmp_path / "nowhere")
    (tmp_path / "fitted.toml").write_text("")
    with pytest.raises(InputError, match=r"; iso.Scenario.read reads a .toml file of a scenario"):
        iso.load(tmp_path / "fitted.toml")


def test_a_repr_is_one_short_line(comparison, fitted):
    for result in (fitted.campaign, comparison.runs["passive_off"].isolated):
        assert len(repr(result)) < 300 and "\n" not in repr(result)


def test_tables_and_arrays_for_other_tools(comparison, fitted, swept):
    run = comparison.runs["clipped_lqr"]
    table = run.to_pandas()
    np.testing.assert_array_equal(
        table["floor5_acceleration_m_s2"], run.output("floor5_acceleration_m_s2")
    )
    assert table.index.name == "time_s" and "coil0_current_A" in table
    assert (
        comparison.to_pandas().loc["clipped_lqr", "J1"] == comparison.criteria["clipped_lqr"]["J1"]
    )
    both = comparison.to_xarray()
    np.testing.assert_array_equal(
        both.sel(controller="clipped_lqr").current.values, run.history.current.values
    )
    assert list(fitted.to_pandas()["name"]) == ["k", "c"]
    moved = swept.to_xarray().peak_base_displacement_m
    assert moved.sel(case=1, controller="passive_off") == swept.table.peak_base_displacement_m[1]


def test_the_public_names_alone_are_listed():
    assert set(dir(iso)) == {"__version__", *iso.__all__}
    assert {"Controller", "Record", "read_record", "load", "Batch", "Sweep"} <= set(dir(iso))


OPEN = {"controller": "settings", "with_parameters": "values"}
"""Functions whose names are those of a controller's settings or of a law's parameters."""


@pytest.mark.parametrize("name", [
    name for name in iso.__all__ if not isinstance(getattr(iso, name), type)
    or not issubclass(getattr(iso, name), Exception)
])  # fmt: skip
def test_editors_show_every_option(name):
    """Every exported function and class, and its methods: named parameters, each with a type."""
    thing = getattr(iso, name)
    calls = [thing]
    if isinstance(thing, type):
        calls += [
            each for own, each in vars(thing).items()
            if not own.startswith("_") and inspect.isfunction(each)
        ]  # fmt: skip
    for call in calls:
        for parameter in inspect.signature(call).parameters.values():
            if parameter.name == "self":
                continue
            assert parameter.kind is not parameter.VAR_POSITIONAL
            if parameter.kind is parameter.VAR_KEYWORD:
                assert OPEN.get(call.__name__) == parameter.name, call
            assert parameter.annotation is not parameter.empty, (call, parameter)
            assert "<lambda>" not in str(parameter), call


def test_dataclasses_are_replaced_as_before(comparison):
    """A loaded plant is as good as the first one: it simulates to the same numbers."""
    run = pickle.loads(pickle.dumps(comparison.runs["passive_off"]))
    plant = replace(run.isolated, elements=run.isolated.elements)
    again = iso.simulate(plant, run.records[0], "passive_off")
    assert again.criteria == run.criteria
