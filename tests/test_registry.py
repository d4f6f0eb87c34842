"""Laws, effects, controllers, studies and readers by name: the project's own and a user's alike.

The guide's examples stand in for a user's: as a package outside the checkout with entry points of
its own, as plain files named by their path, and as objects registered in this process.
"""

from __future__ import annotations

import ast
import hashlib
import json
import shutil
import subprocess
import sys
import tomllib
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas
import pytest
from scipy.io import loadmat

import ground_motions.registry as mechanism
import isolation_sim as iso
from ground_motions import Record, read, ricker_pulse
from ground_motions.readers import READERS
from ground_motions.registry import Registry, package_code
from isolation_sim.cli import main
from isolation_sim.criterion import CRITERIA
from isolation_sim.effects import EFFECTS
from isolation_sim.identification.campaign import Campaign, TestRun, write_campaign
from isolation_sim.identification.raw_tests.files import TEST_READERS
from isolation_sim.laws import LAWS
from isolation_sim.registry import COMMANDS, CONTROLLERS, STUDIES
from isolation_sim.sweeps.design import Design
from isolation_sim.sweeps.plan import SweepPlan

pytestmark = pytest.mark.usefixtures("no_drawing")

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("ground_motions", "isolation_sim", "controllers", "studies")
REGISTRIES = (LAWS, EFFECTS, CONTROLLERS, CRITERIA, STUDIES, COMMANDS, READERS, TEST_READERS)

READER = '''"""Files of a recorder of one's own."""

import numpy as np

from ground_motions import Record


def read_mg(path, dt=0.02):
    """Read accelerations in mg, one per line."""
    return Record(np.loadtxt(path) * 9.80665e-3, dt, name="mine")
'''

# arithmetic for which other tests compile the diagnosis, under a name of one's own
BEARING = '''"""A law of one's own."""

from dataclasses import replace

from isolation_sim.laws.kelvin_voigt import LAW as KELVIN_VOIGT

LAW = replace(KELVIN_VOIGT, name="my_bearing")
'''

STUDY = '''"""A study of one's own."""

from studies.study import Outcome

TITLE = "Nothing is varied"


def outcome(folder, short, step):
    """Return one row."""
    return Outcome([{"case": "only", "peak_m": 1.0}], "One case.", {})
'''

CRITERION = '''"""A criterion of one's own."""

import numpy as np

from isolation_sim import Criterion

CHANGES = Criterion(
    "command_changes",
    "changes of the command",
    lambda run: np.count_nonzero(np.diff(run.command, axis=0)),
)
'''

ENTRY_POINTS = """
[isolation_sim.laws]
my_bearing = guide_parts.bearing:LAW
cubic = guide_parts.cubic:LAW
[isolation_sim.effects]
slack = guide_parts.slack:FORMS
[isolation_sim.controllers]
outwards = guide_parts.outwards:Outwards
[isolation_sim.criteria]
command_changes = guide_parts.effort:CHANGES
[isolation_sim.studies]
soft = guide_parts.soft
still = guide_parts.still
[ground_motions.readers]
mg = guide_parts.reader:read_mg
"""


def forget() -> None:
    """Look for entry points anew, as a new process does."""
    for registry in REGISTRIES:
        registry.__dict__.pop("_entries", None)
        registry._loaded.clear()
        registry._registered.clear()


@pytest.fixture
def parts(tmp_path) -> Path:
    """The guide's examples and a reader, as files in a folder of their own."""
    folder = tmp_path / "parts"
    folder.mkdir()
    for name in ("cubic", "slack", "outwards", "soft"):
        shutil.copy(ROOT / "docs" / "examples" / f"{name}.py", folder)
    text = (folder / "outwards.py").read_text()
    cited = text.replace("    period = 0.02\n", '    period = 0.02\n    source = "a folk rule"\n')
    (folder / "outwards.py").write_text(cited)
    (folder / "reader.py").write_text(READER)
    (folder / "bearing.py").write_text(BEARING)
    (folder / "still.py").write_text(STUDY)
    (folder / "effort.py").write_text(CRITERION)
    return folder


def install(site: Path, package: str, entry_points: str) -> None:
    """Metadata of a package, as an installer leaves it."""
    info = site / f"{package}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(entry_points)


@pytest.fixture
def site(tmp_path, monkeypatch):
    """A folder of installed packages, outside the checkout."""
    folder = tmp_path / "site"
    folder.mkdir()
    monkeypatch.syspath_prepend(str(folder))
    forget()
    yield folder
    forget()
    for name in [name for name in sys.modules if name.startswith("guide_parts")]:
        del sys.modules[name]


@pytest.fixture
def package(site, parts) -> Path:
    shutil.copytree(parts, site / "guide_parts")
    (site / "guide_parts" / "__init__.py").touch()
    install(site, "guide_parts", ENTRY_POINTS)
    return site


def command(words: list[str]) -> None:
    """Run ``isolation-sim``, which must end well."""
    with pytest.raises(SystemExit) as stopped:
        main(words)
    assert not stopped.value.code


MOTION = 300 * np.sin(np.arange(0, 2, 0.02) * 2 * np.pi)  # mg

SCENARIO = """
[ground]
file = "motion.mg"
{reader}
[isolator]
law = "{cubic}"
parameters = {{ k = [3e6, 2e6], k3 = 1e8, c = [4e5, 1e5] }}
current_range_A = [0.0, 3.0]
length_scale = 1.0
force_scale = 1.0
[[isolator.effect]]
name = "{slack}"
gap = 2e-4
[[controller]]
name = "{outwards}"
full_speed = 0.2
[simulation]
criteria = ["{effort}"]
"""

INSIDE = {"cubic": "LAW", "bearing": "LAW", "slack": "FORMS", "outwards": "Outwards",
          "effort": "CHANGES", "reader": "read_mg"}  # fmt: skip
KINDS = {"cubic": "law", "bearing": "law", "slack": "effect", "outwards": "controller",
         "effort": "criterion", "reader": "reader", "still": "study"}  # fmt: skip
WAYS = ("package", "file", "module", "registered")


def names(way: str) -> dict[str, str]:
    """What each part is called if it enters in some way."""
    if way == "file":
        return {part: f"parts/{part}.py:{inside}" for part, inside in INSIDE.items()}
    if way == "module":
        return {part: f"guide_parts.{part}:{inside}" for part, inside in INSIDE.items()}
    own = {"bearing": "my_bearing", "effort": "command_changes", "reader": "mg"}
    return {part: part for part in INSIDE} | own


def scenario_text(way: str) -> str:
    """The scenario of all five parts; a package's reader goes by the suffix of the file."""
    own = names(way)
    reader = "" if way == "package" else f'reader = "{own["reader"]}"'
    return SCENARIO.format(**own | {"reader": reader})


@pytest.fixture
def desk(tmp_path, parts, monkeypatch) -> Path:
    """A folder with a scenario for each way, outside the checkout, and the process in another."""
    for way in WAYS:
        (tmp_path / f"{way}.toml").write_text(scenario_text(way))
    np.savetxt(tmp_path / "motion.mg", MOTION)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    return tmp_path


@pytest.fixture(params=WAYS)
def way(request, desk, site, parts) -> str:
    """One of the ways in which the parts of one's own enter."""
    if request.param in ("package", "module"):
        request.getfixturevalue("package")
    if request.param == "module":
        shutil.rmtree(site / "guide_parts-1.0.dist-info")
        forget()
    if request.param == "registered":
        for part, kind in KINDS.items():
            scope = {"__name__": f"guide_parts_{part}"}
            exec((parts / f"{part}.py").read_text(), scope)
            thing = SimpleNamespace(**scope) if kind == "study" else scope[INSIDE[part]]
            own = {"study": "still", "reader": "mg"}.get(kind)
            iso.register(kind, thing, own)
    return str(request.param)


def digest_line(desk: Path, part: str) -> str:
    """How results name the code of a file."""
    code = desk / "parts" / f"{part}.py"
    return f"{code}, SHA-256 {hashlib.sha256(code.read_bytes()).hexdigest()}"


def test_run_report_and_cite(way, desk, capsys):
    """The same run each way, by separately written steps; sources are told, files by their hash."""
    command(["run", str(desk / f"{way}.toml"), "--out", "out", "--no-figures", "--quiet"])
    (file,) = Path("out").glob("*.nc")
    history = iso.read_run(file)
    assert float(abs(history["displacement"]).max()) > 1e-3
    assert float(history["current"].max()) > 0.1
    registries = {each.kind: each for each in REGISTRIES}
    own = {part: registries[kind][str(desk / f"parts/{part}.py:{INSIDE[part]}")]
           for part, kind in KINDS.items() if part in INSIDE}  # fmt: skip
    numbers = iso.laws.CurrentDependence.polynomial({"k": [3e6, 2e6], "k3": [1e8], "c": [4e5, 1e5]})
    device = iso.Device(
        own["cubic"], numbers, current_range=(0.0, 3.0), length=1.0, force_scale=1.0
    )
    device = iso.effects.extend(device, [(own["slack"][0], {"gap": 2e-4})])
    record = Record(MOTION * 9.80665e-3, 0.02, name="mine")
    isolated = iso.reference_building().on(device)
    run = iso.simulate(isolated, record, own["outwards"](full_speed=0.2))
    np.testing.assert_array_equal(run.history["displacement"], history["displacement"])
    # the results say which code was run, and run again from anywhere
    saved, page = Path("out/scenario.toml").read_text(), Path("out/report.html").read_text()
    for part in ("cubic", "slack", "outwards", "effort", "reader"):
        for text in (saved, page):
            assert (digest_line(desk, part).rpartition(" ")[2] in text) == (way == "file")
    assert iso.Scenario.from_toml(saved) == iso.Scenario.read(desk / f"{way}.toml")
    for subject in ("out", str(desk / f"{way}.toml")):
        capsys.readouterr()
        command(["cite", subject, "--json"])
        said = capsys.readouterr().out
        for source in ("Duffing", "geometry", "a folk rule"):
            assert source in said and source in page


def test_tune_takes_a_controller_of_one_s_own(way, desk):
    name = names(way)["outwards"].replace("parts/", f"{desk}/parts/")
    command(["tune", name, "--scenario", str(desk / f"{way}.toml"), "--motions", "scenario",
             "--unseen", "mixture:1", "--evaluations", "2", "--workers", "1", "--out", "tuned",
             "--quiet", "--export", "mat", "--export", "xlsx"])  # fmt: skip
    saved = Path("tuned/controller.toml").read_text()
    assert f'name = "{name}"' in saved
    assert (digest_line(desk, "outwards").rpartition(" ")[2] in saved) == (way == "file")
    state = Path("tuned/tuning.json").read_text()
    for part in ("cubic", "slack", "outwards", "effort", "reader"):
        assert (digest_line(desk, part).rpartition(" ")[2] in state) == (way == "file")
    scores = pandas.read_csv("tuned/scores.csv")
    exported = loadmat("tuned/results.mat", simplify_cells=True)["scores"]
    np.testing.assert_array_equal(exported["score_after"], scores["score_after"])
    sheets = pandas.read_excel("tuned/results.xlsx", sheet_name=None)
    pandas.testing.assert_frame_equal(sheets["scores"], scores)
    assert set(sheets) == {"scores", "sensitivity", "trials"}
    command(["run", "tuned/controller.toml", "--out", "again", "--no-figures", "--quiet"])


def test_study_takes_one_of_one_s_own(way, desk):
    if way == "module":
        pytest.skip("a study is itself a module: it is named by its file or entry point")
    name = f"{desk}/parts/still.py" if way == "file" else "still"
    command(["study", name, "--out", "out", "--quiet"])
    assert "One case." in Path("out/finding.txt").read_text()
    for file in ("finding.txt", "report.html"):
        assert (digest_line(desk, "still") in (Path("out") / file).read_text()) == (way == "file")


def test_list_shows_what_has_a_name(way, capsys):
    for subject, part in (("laws", "cubic"), ("effects", "slack"), ("controllers", "outwards"),
                          ("readers", "mg"), ("studies", "still")):  # fmt: skip
        command(["list", subject, "--json"])
        rows = json.loads(capsys.readouterr().out)
        results = [each for each in rows if part in each.values()]
        assert len(results) == (way in ("package", "registered"))


def test_sweep_takes_all_of_them(way, desk):
    """In two worker processes, which refuse what is registered in this process alone."""
    vary = [{"field": "controller.full_speed", "values": [0.1, 0.4]}]
    described = plan(desk, way, vary=vary)
    if way == "registered":
        with pytest.raises(iso.InputError, match=r"was registered in this process.*py:NAM"):
            iso.sweep(described, desk / "sweep", workers=2)
    result = iso.sweep(described, desk / "sweep", workers=1 if way == "registered" else 2)
    assert result.table["status"].tolist() == ["ok", "ok"]
    assert (result.table["command_changes"] > 0).all()
    assert "command_changes" in result.criteria
    saved = (result.folder / "manifest.json").read_text()
    for part in ("cubic", "slack", "outwards", "effort", "reader"):
        digest = digest_line(desk, part).rpartition(" ")[2]
        assert (digest in saved) == (way == "file")


def test_the_verbs_in_python_take_places(desk):
    device = iso.law(str(desk / "parts/cubic.py:LAW"), {"k": 3e6, "k3": 1e8, "c": 4e5})
    assert device.law.name == "cubic"
    assert iso.law(device.law, {"k": 3e6, "k3": 1e8, "c": 4e5}) == device
    isolated = iso.reference_building().on(iso.reference_isolators())
    ground = read(desk / "motion.mg", reader=str(desk / "parts/reader.py:read_mg"))
    np.testing.assert_allclose(ground.acceleration, MOTION * 9.80665e-3)
    place = str(desk / "parts/outwards.py:Outwards")
    run = iso.simulate(isolated, ground, controller=place)
    same = iso.simulate(isolated, ground, iso.controller(place, highest=3.0))
    np.testing.assert_array_equal(run.values, same.values)
    assert iso.compare(isolated, ground, ["passive_off", place]).runs.keys() == {
        "passive_off", "outwards"}  # fmt: skip


def plan(desk: Path, way: str = "file", **keys) -> SweepPlan:
    scenario = tomllib.loads(scenario_text(way))
    return SweepPlan.from_dict({"scenario": scenario, "energy": True, **keys}, desk)


def test_a_sweep_whose_code_has_changed_is_another_sweep(desk):
    described = plan(desk)
    files = Design(described).content()["files"]
    assert {Path(path).name for path in files} == {
        "motion.mg", "cubic.py", "slack.py", "outwards.py", "effort.py", "reader.py"}  # fmt: skip
    (desk / "parts" / "outwards.py").write_text(
        (desk / "parts" / "outwards.py").read_text().replace("setting(3.0", "setting(2.0")
    )
    assert Design(described).content()["files"] != files


@pytest.fixture(scope="module")
def loops() -> Campaign:
    """Loops of a spring and a dashpot at one current, with noise."""
    rng, time, runs = np.random.default_rng(3), np.arange(0, 2, 1 / 64), []
    for amplitude in (2e-3, 4e-3):
        x, v = amplitude * np.sin(6 * time), 6 * amplitude * np.cos(6 * time)
        force = 3e4 * x + 800 * v + rng.normal(0, 0.5, time.size)
        runs.append(TestRun(f"{amplitude}m", time, x, v, force, np.ones(time.size),
                            velocity_measured=True))  # fmt: skip
    return Campaign("made-up device", "test_registry", tuple(runs))


def test_a_tuning_is_not_continued_with_other_code_of_a_package(package, desk):
    """A change of any of its files counts, as the named one may import it."""
    given = {"motions": ricker_pulse(0.3, 1.0), "unseen": {}, "evaluations": 9, "out": desk / "own"}
    iso.tune("outwards", **given)
    (package / "guide_parts" / "__init__.py").write_text("SCALE = 2.0\n")
    with pytest.raises(iso.InputError, match="code differs from the tuning begun there"):
        iso.tune("outwards", **given, resume=True)


def test_the_code_of_packages_is_known_by_names_and_places(package):
    """Names of this project and files have no package of their own."""
    one = package_code(["outwards", "mpc", "parts/outwards.py:Outwards"])
    assert list(one) == ["package guide_parts"]
    assert package_code(["guide_parts.outwards:Outwards"]) == one
    assert package_code(["mpc", "bouc_wen"]) == {}


def test_fit_diagnose_and_evaluate_take_a_law_of_one_s_own(way, desk, loops, capsys):
    write_campaign(loops, desk / "tests")
    place = str(desk / "parts/bearing.py:LAW")
    law = place if way == "file" else names(way)["bearing"]
    words = ["--law", law, "--quiet"]
    command(["fit", str(desk / "tests"), *words, "--starts", "2", "--out", "fitted.toml"])
    text = Path("fitted.toml").read_text()
    fitted = iso.Scenario.from_toml(text).isolator
    assert fitted.law == law
    assert ("[code]" in text) == (way == "file")
    assert fitted.scaled().parameters_at(1.0)[0] == pytest.approx(3e4, rel=0.02)
    capsys.readouterr()
    command(["diagnose", str(desk / "tests"), *words, "--parameters", "fitted.toml", "--json",
             "--out", "diagnosis", "--no-consequence", "--export", "mat"])  # fmt: skip
    assert json.loads(capsys.readouterr().out)["verdict"] == "adequate"
    saved = [path.read_text() for path in Path("diagnosis").iterdir() if path.is_file()
            and path.suffix in (".json", ".html")]  # fmt: skip
    digest = digest_line(desk, "bearing").rpartition(" ")[2]
    assert any(digest in text for text in saved) == (way == "file")
    exported = loadmat("diagnosis/results.mat", simplify_cells=True)["errors"]
    errors = pandas.read_csv("diagnosis/errors.csv")
    np.testing.assert_array_equal(exported["error_before"], errors["error_before"])
    assert 0 < errors["error_before"].max() < 0.05
    command(["evaluate", "fitted.toml", str(desk / "tests"), "--json", "--report", "errors.html"])
    assert json.loads(capsys.readouterr().out)["error"] < 0.05
    assert (digest in Path("errors.html").read_text()) == (way == "file")


def test_the_list_shows_an_installed_package_s_parts(package, capsys):
    for subject, name, text in (
        ("laws", "cubic", "k3 (N/m^3)"), ("effects", "slack", "gap (m)"),
        ("controllers", "outwards", "full_speed (m/s)"), ("readers", "mg", "mg, one per line"),
        ("studies", "soft", "How soft may isolation be?"),
    ):  # fmt: skip
        command(["list", subject, "--json"])
        (row,) = [e for e in json.loads(capsys.readouterr().out) if name in e.values()]
        assert text in " ".join(row.values())
    command(["study", "--help"])
    assert "How soft may isolation be?" in capsys.readouterr().out


# --- names, places and what is wrong with them


def test_a_misspelt_name_in_a_file_is_answered_with_those_of_the_file(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(
        "import numpy as np\nfrom controllers import Controller\n\n"
        "class Sky(Controller):\n    pass\n"
    )
    with pytest.raises(iso.InputError, match=r"'Nope'; expected: Sky$"):
        iso.controller(f"{file}:Nope")


def law_file(folder: Path, text: str) -> str:
    (folder / "mine.py").write_text(text)
    return f"{folder / 'mine.py'}:LAW"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, r"cannot be read \(No such file or directory\)"),
        ("LAV = 1\n", "unknown name .*did you mean 'LAV'"),
        ("LAW = 3.0\n", "given 3.0; expected: an isolation_sim.laws.Law"),
        ("LAW = 1 +\n", "cannot be loaded: SyntaxError"),
        ("import not_there\n", "cannot be loaded: ModuleNotFoundError: .*not_there"),
        ("raise RuntimeError('two\\nlines')\n", "cannot be loaded: RuntimeError: two lines"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_in_a_line(tmp_path, text, message):
    place = f"{tmp_path / 'mine.py'}:LAW" if text is None else law_file(tmp_path, text)
    with pytest.raises(iso.InputError, match=message) as refused:
        iso.law(place)
    assert str(place) in str(refused.value) and "\n" not in str(refused.value)


def test_a_file_is_run_only_when_its_path_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("linear", "mine"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('run by accident')\n")
    assert iso.law("linear", {"k": 1.0}).law.name == "linear"
    with pytest.raises(iso.InputError, match="unknown law 'mine'"):
        iso.law("mine")
    assert not list(tmp_path.rglob("__pycache__"))


def test_a_file_is_run_once_as_long_as_it_stays_the_same(parts):
    place = str(parts / "cubic.py:LAW")
    law = LAWS[place]
    assert LAWS[place] is law
    text = (parts / "cubic.py").read_text()
    (parts / "cubic.py").write_text(text.replace("Cubic spring beside", "Cubic spring with"))
    changed = LAWS[place]
    assert changed is not law and changed.title == "Cubic spring with a dashpot"
    assert not list(parts.rglob("__pycache__"))


def test_what_is_registered_has_one_name_and_one_owner(site, parts):
    (law,) = (LAWS[str(parts / "cubic.py:LAW")],)
    iso.register("law", law)
    assert "cubic" in iso.available_laws() and LAWS["cubic"] is law
    with pytest.raises(iso.InputError, match="registered already in this process"):
        iso.register("law", law)
    iso.register("law", law, replace=True)
    with pytest.raises(iso.InputError, match="cannot be registered as 'square'"):
        iso.register("law", law, "square")
    with pytest.raises(iso.InputError, match="unknown kind 'lav'; did you mean 'law'"):
        iso.register("lav", law)  # type: ignore[arg-type]
    with pytest.raises(iso.InputError, match="controller: given a Law; expected: a class with na"):
        iso.register("controller", law)
    linear = type(law)(**{**vars(law), "name": "linear"})
    with pytest.raises(iso.InputError, match=r"'linear' is given by register\(\) and isolation-"):
        iso.register("law", linear)


def test_a_name_of_two_packages_is_an_error_that_names_both(package, site):
    install(site, "other_parts", "[isolation_sim.laws]\ncubic = other_parts:LAW\n")
    forget()
    assert iso.law("linear", {"k": 1.0})  # the others are found as before
    with pytest.raises(iso.InputError, match="'cubic' is given by guide_parts and other_parts"):
        iso.law("cubic")


def test_a_package_s_fault_is_reported_with_its_name(package, site, capsys):
    install(site, "broken", "[isolation_sim.controllers]\nlost = guide_parts.nowhere:Lost\n"
                            "alias = guide_parts.outwards:Outwards\n")  # fmt: skip
    forget()
    with pytest.raises(iso.InputError) as refused:
        iso.controller("lost")
    assert str(refused.value) == (
        "controller 'lost' of package broken (guide_parts.nowhere:Lost) cannot be loaded: "
        "ModuleNotFoundError: No module named 'guide_parts.nowhere'"
    )
    with pytest.raises(iso.InputError, match=r"of package broken .* calls itself 'outwards'"):
        iso.controller("alias")
    # the list has the others
    capsys.readouterr()
    with pytest.raises(SystemExit) as end:
        main(["list", "controllers"])
    shown = capsys.readouterr()
    assert not end.value.code and "passive_off" in shown.out and "outwards" in shown.out
    assert shown.err.count("warning: controller ") == 2 and "Traceback" not in shown.err


def test_a_controller_without_a_title_is_listed_with_its_first_line(capsys, monkeypatch):
    monkeypatch.setattr(CONTROLLERS["passive_off"], "title", "")
    with pytest.raises(SystemExit):
        main(["list", "controllers"])
    assert "Zero current, or" in capsys.readouterr().out


def test_without_an_installation_the_reason_is_reported(monkeypatch):
    monkeypatch.setattr(mechanism, "checkout_entries", dict)
    monkeypatch.setattr(mechanism, "entry_points", lambda group: EntryPoints())
    empty = Registry("isolation_sim.laws", "law", "a law", lambda result: result)
    with pytest.raises(iso.InputError, match=r"isolation-sim is not installed.*pip install"):
        empty["linear"]


def test_an_installed_copy_is_recognised_by_its_metadata(site, monkeypatch):
    """Without pyproject.toml beside it, as in site-packages; no real copy has this group."""
    group = "isolation_sim.installed_laws"
    install(site, "isolation-sim", f"[{group}]\nmaxwell=isolation_sim.laws.maxwell:LAW\n")
    monkeypatch.setattr(mechanism, "checkout_entries", dict)
    installed = Registry(group, "law", "a law", lambda result: result)
    assert list(installed) == ["maxwell"] and installed["maxwell"] is LAWS["maxwell"]


# --- the project's own


def own() -> dict[str, dict[str, str]]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]


def test_every_own_name_loads_and_is_the_thing_s_own():
    groups = own()
    assert set(groups) == {registry.group for registry in REGISTRIES}
    for registry in REGISTRIES:
        for name, place in groups[registry.group].items():
            module, _, inside = place.partition(":")
            point = EntryPoint(name, f"{module}:{inside}" if inside else module, registry.group)
            assert registry[name] is point.load()


@pytest.mark.parametrize(
    ("group", "folder", "holds"),
    [
        ("isolation_sim.laws", "isolation_sim/laws", "LAW"),
        ("isolation_sim.effects", "isolation_sim/effects", "FORMS"),
        ("isolation_sim.studies", "studies", "outcome"),
    ],
)
def test_no_file_waits_for_its_line(group, folder, holds):
    with_it = set()
    for path in (ROOT / folder).glob("*.py"):
        for node in ast.parse(path.read_text()).body:
            names = [getattr(node, "name", "")]
            names += [getattr(each, "id", "") for each in getattr(node, "targets", ())]
            if holds in names:
                with_it.add(f"{folder.replace('/', '.')}.{path.stem}")
    assert {place.partition(":")[0] for place in own()[group].values()} == with_it


def test_a_law_loads_no_other_law_and_no_controller():
    code = (
        "import sys, isolation_sim as iso\n"
        "iso.law('maxwell', {'k': 1.0, 'c': 1.0})\n"
        "print(*(name for name in sys.modules if name.startswith(('controllers', 'studies'))))\n"
        "print('isolation_sim.laws.lugre' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "\nFalse\n"


def test_code_that_has_changed_since_a_file_was_written_is_reported(desk, loops, capsys):
    """In the scenario of a run and in the file of a fit; a file without digests is accepted."""
    write_campaign(loops, desk / "tests")
    law = str(desk / "parts/bearing.py:LAW")
    command(["fit", str(desk / "tests"), "--law", law, "--quiet", "--starts", "2",
             "--out", "fitted.toml"])  # fmt: skip
    command(["run", str(desk / "file.toml"), "--out", "out", "--no-figures", "--quiet"])
    commands = {
        "fitted.toml": ["evaluate", "fitted.toml", str(desk / "tests"), "--quiet"],
        "out/scenario.toml": ["run", "out/scenario.toml", "--no-figures"],
    }
    parts = {"fitted.toml": "bearing", "out/scenario.toml": "slack"}
    for changed in (False, True):
        for file, words in commands.items():
            code = desk / "parts" / f"{parts[file]}.py"
            if changed:
                code.write_text(code.read_text() + "# changed\n")
            capsys.readouterr()
            command(words)
            line = f"{code} has changed since {file} was written: results may differ"
            captured = " ".join(capsys.readouterr().err.split())
            assert (line in captured) == changed
    text = Path("fitted.toml").read_text()
    without = text.partition("[code]")[0]
    assert iso.Scenario.from_toml(without) == iso.Scenario.from_toml(text)
    with pytest.raises(iso.InputError, match="code: given 3; expected: a table"):
        iso.Scenario.from_toml("code = 3")
