"""The command ``isolation-sim fit``, as a user calls it."""

import json

import numpy as np
import pytest

from isolation_sim import Scenario, law, load
from isolation_sim.cli import main
from isolation_sim.identification.campaign import Campaign, write_campaign
from isolation_sim.identification.measured.run_table import TestRun

STIFFNESS, DAMPING = {0.0: 2e4, 2.0: 5e4}, 300.0


@pytest.fixture
def campaign(tmp_path):
    """Sinusoidal tests of a spring and dashpot at two currents, one run held out."""
    random = np.random.default_rng(0)
    time = np.arange(0, 4, 1 / 128)
    runs = []
    for current, stiffness in STIFFNESS.items():
        for frequency, hold_out in ((1.0, False), (2.0, False), (3.0, True)):
            w = 2 * np.pi * frequency
            x, v = 4e-3 * np.sin(w * time), 4e-3 * w * np.cos(w * time)
            force = stiffness * x + DAMPING * v + random.normal(0, 1.0, time.size)
            runs.append(
                TestRun(
                    f"{frequency:g}Hz_{current:g}A", time, x, v, force,
                    np.full(time.size, current), hold_out,
                )
            )  # fmt: skip
    return write_campaign(Campaign("spring", "made for a test", tuple(runs)), tmp_path / "tests")


def called(capsys, *arguments):
    """Exit code, standard output and standard error of a call."""
    code = 0
    try:
        main([str(a) for a in arguments])
    except SystemExit as end:
        code = end.code or 0
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_fit_gives_the_numbers_back(campaign, capsys):
    code, out, _ = called(capsys, "fit", campaign, "--law", "kelvin_voigt", "--json")
    report = json.loads(out)
    assert code == 0
    results = {(p["name"], p["current_A"]): p for p in report["parameters"]}
    for current, stiffness in STIFFNESS.items():
        assert results["k", current]["low"] < stiffness < results["k", current]["high"]
        assert results["c", current]["low"] < DAMPING < results["c", current]["high"]
    assert [r["hold_out"] for r in report["runs"]].count(True) == 2
    assert report["held_out_error"] < 0.03


def test_fitted_law_stands_in_a_scenario(campaign, capsys, tmp_path):
    out = tmp_path / "fitted.toml"
    code, output, _ = called(capsys, "fit", campaign, "--law", "kelvin_voigt", "--out", out)
    assert code == 0
    assert "pooled" in output
    device = Scenario.read(out).build().isolated.elements[0].device
    x, v = np.array([0.001, -0.002]), np.array([0.1, 0.05])
    expected = law("kelvin_voigt", parameters={"k": 5e4, "c": DAMPING}).force(x, v, (), 2.0)
    np.testing.assert_allclose(device.force(x, v, (), 2.0), expected, rtol=0.02)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--law", "kelvin_vogt"], "unknown law 'kelvin_vogt'; did you mean 'kelvin_voigt'?"),
        (["--law", "kelvin_voigt", "--current-degree", "2"], "need 3 currents; the fitted runs"),
        (
            ["--law", "kelvin_voigt", "--current-degree", "-1"],
            "current degree: given -1; expected: 0",
        ),
        (["--law", "kelvin_voigt", "--starts", "0"], "starts: given 0; expected: 1 or more"),
        (["--law", "kelvin_voigt", "--fix", "q=1"], "unknown parameter of kelvin_voigt 'q'"),
        (
            ["--law", "kelvin_voigt", "--fix", "k"],
            "--fix k: expected: a name and a value, such as n=2",
        ),
    ],
)
def test_bad_input_is_one_line(campaign, capsys, arguments, message):
    code, out, err = called(capsys, "fit", campaign, *arguments)
    assert code == 2
    assert out == ""
    assert message in err
    assert len(err.strip().splitlines()) == 1


@pytest.mark.parametrize("option", ["--out", "--report"])
def test_a_folder_where_a_file_should_go_is_reported(campaign, capsys, tmp_path, option):
    taken = tmp_path / "taken.toml"
    taken.mkdir()
    before = set(tmp_path.rglob("*"))
    arguments = ("--law", "kelvin_voigt", "--starts", 1, "--quiet", option, taken)
    code, _, err = called(capsys, "fit", campaign, *arguments)
    assert code == 2
    assert err == f"isolation-sim: {taken}: a folder; expected: a file\n"
    assert set(tmp_path.rglob("*")) == before


def test_missing_column_names_file_and_column(campaign, capsys):
    path = campaign / "1Hz_0A.csv"
    path.write_text(path.read_text().replace("force_N", "weight_N", 1))
    code, _, err = called(capsys, "fit", campaign, "--law", "kelvin_voigt")
    assert code == 2
    assert "1Hz_0A.csv" in err
    assert "force_N" in err


def test_a_fit_leads_to_its_report(campaign, capsys, tmp_path):
    out = tmp_path / "fitted.toml"
    _, output, _ = called(capsys, "fit", campaign, "--law", "kelvin_voigt", "--out", out, "--quiet")
    assert output == f"fitted law: {out}\nreport: {tmp_path / 'fitted.html'}\n"
    assert "Kelvin-Voigt" in (tmp_path / "fitted.html").read_text()


def test_a_fit_in_a_folder_is_loaded(campaign, capsys, tmp_path):
    folder = tmp_path / "my_fit"
    inputs = ("--law", "kelvin_voigt", "--starts", 2, "--out", folder)
    code, out, _ = called(capsys, "fit", campaign, *inputs)
    assert code == 0 and "my_fit.html" not in out and (folder / "report.html").is_file()
    assert load(folder).device.law.name == "kelvin_voigt"
    code, _, err = called(capsys, "fit", campaign, *inputs)
    assert code == 2 and "my_fit: is not empty; expected: a new folder, or --force" in err
    (folder / "mine.txt").write_text("kept")
    assert called(capsys, "fit", campaign, *inputs, "--force", "--quiet")[0] == 0
    assert (folder / "mine.txt").read_text() == "kept"


def test_the_fit_is_exported_and_read_back(campaign, capsys, tmp_path):
    from pandas import read_excel
    from scipy.io import loadmat

    words = ["fit", campaign, "--law", "kelvin_voigt", "--quiet"]
    forms = ["--export", "mat", "--export", "xlsx"]
    code, _, errors = called(capsys, *words, *forms)
    assert code == 2 and "--export mat: needs a file for the law; expected: --out" in errors
    out = tmp_path / "fitted.toml"
    assert called(capsys, *words, *forms, "--out", out)[0] == 0
    device = Scenario.read(out).isolator.device()
    tree = loadmat(tmp_path / "fitted.mat", simplify_cells=True)
    sheets = read_excel(tmp_path / "fitted.xlsx", sheet_name=None)
    for table in (tree["law"], sheets["law"]):
        powers = [np.array(table[key]) for key in table if key.startswith("power")]
        for k, name in enumerate(table["parameter"]):
            own = device.law.parameter_names.index(name)
            at_2 = sum(power[k] * 2.0**n for n, power in enumerate(powers))
            assert at_2 == pytest.approx(device.parameters_at(2.0)[own], rel=1e-12)
    assert len(sheets["parameters"]) == len(tree["parameters"]["value"]) == 4
    assert len(sheets["runs"]) == 6
    loops = sheets["loops_1Hz_2A"]
    residual = loops["force_N"] - loops["fitted_force_N"]
    assert 0.5 < residual.std() < 2.0


def test_files_of_a_machine_are_imported_and_fitted(tmp_path, capsys):
    (tmp_path / "raw").mkdir()
    time = np.arange(0, 4, 1 / 128)
    for current, stiffness in STIFFNESS.items():
        x, v = 4e-3 * np.sin(2 * np.pi * time), 8e-3 * np.pi * np.cos(2 * np.pi * time)
        columns = time, 1e3 * x, 1e-3 * (stiffness * x + DAMPING * v)
        rows = ("; ".join(f"{value:.7f}" for value in row) for row in zip(*columns, strict=True))
        text = "Rig 2\nZeit; Weg; Kraft\n[s]; [mm]; [kN]\n" + "\n".join(rows).replace(".", ",")
        (tmp_path / "raw" / f"1Hz_{current:g}A.txt").write_text(text)
    raw, tests = str(tmp_path / "raw"), str(tmp_path / "tests")
    code, out, _ = called(capsys, "import", raw, "--current-from-name")
    assert code == 0 and "nothing is written" in out
    code, out, _ = called(capsys, "import", raw, "--current-from-name", "--out", tests)
    assert code == 0 and f"campaign: {tests}" in out and "Weg" in out and "-4 to 4" in out
    code, _, errors = called(capsys, "import", raw, "--out", tests)
    assert code == 2 and "exists already" in errors
    code, _, errors = called(capsys, "import", raw, "--unit", "force")
    assert code == 2 and "--unit force: expected: a name and a value, such as force=kN" in errors
    code, out, _ = called(capsys, "fit", tests, "--law", "kelvin_voigt", "--json")
    loaded = {row["name"]: row["value"] for row in json.loads(out)["parameters"]}
    assert code == 0 and loaded["k"] in (pytest.approx(2e4), pytest.approx(5e4))
