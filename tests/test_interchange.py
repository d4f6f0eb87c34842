"""Results for MATLAB and spreadsheets: everything is there, and is read back the same."""

import numpy as np
import pandas
import pytest
from scipy.io import loadmat

import isolation_sim as iso
from ground_motions import Record
from isolation_sim.cli import main
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.io import interchange
from isolation_sim.io.columns import columns_bytes
from isolation_sim.io.files import read_netcdf
from isolation_sim.reports.units import in_engineering_units
from isolation_sim.structures import plan_building

SCENARIO = """
[ground]
name = "el_centro_1940_ns"
scale_to_pga_g = 0.1
[[controller]]
name = "passive_off"
[[controller]]
name = "on_off"
"""


def command(*words):
    with pytest.raises(SystemExit) as stop:
        main(list(map(str, words)))
    return stop.value.code


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("interchange")
    (folder / "short.toml").write_text(SCENARIO)
    out = folder / "out"
    words = ["--no-figures", "--quiet", "--export", "mat", "--export", "xlsx"]
    assert command("run", folder / "short.toml", "--out", out, *words) == 0
    return out


def test_matlab_has_each_table_and_history(results):
    tree = loadmat(results / "results.mat", simplify_cells=True)
    table = pandas.read_csv(results / "criteria.csv")
    assert list(tree["criteria"]["controller"]) == ["passive_off", "on_off"]
    for name in table.columns[1:]:
        np.testing.assert_array_equal(tree["criteria"][name], table[name])
    for name in ("passive_off", "on_off"):
        history, result = read_netcdf(results / f"{name}.nc"), tree[name]
        for key, array in history.variables.items():
            np.testing.assert_array_equal(result[key], np.squeeze(array.values))
        assert result["units"]["displacement"] == "m"
        assert result["attributes"]["controller"] == name


def test_a_workbook_has_each_table_and_history(results):
    sheets = pandas.read_excel(results / "results.xlsx", sheet_name=None)
    table = pandas.read_csv(results / "criteria.csv")
    pandas.testing.assert_frame_equal(sheets["criteria"], table)
    history = read_netcdf(results / "on_off.nc")
    sheet = sheets["on_off"]
    np.testing.assert_allclose(sheet["time (s)"], history.time, rtol=1e-15)
    for floor in history.dof.values:
        column = sheet[f"displacement {floor} (m)"]
        np.testing.assert_allclose(column, history.displacement.sel(dof=floor), rtol=1e-14)
    assert len(sheet) == history.sizes["time"]


def test_csv_has_each_history(results, capsys):
    assert command("export", "csv", results) == 0
    folder = results / "results_csv"
    assert sorted(path.name for path in folder.iterdir()) == ["on_off.csv", "passive_off.csv"]
    table, history = pandas.read_csv(folder / "on_off.csv"), read_netcdf(results / "on_off.nc")
    np.testing.assert_allclose(table["time (s)"], history.time, rtol=1e-9)
    for floor in history.dof.values:
        column = table[f"displacement {floor} (m)"]
        np.testing.assert_allclose(column, history.displacement.sel(dof=floor), rtol=1e-9)
    assert "results_csv/" in (results / "README.txt").read_text()
    assert command("export", "csv", results) == 2
    assert "or --force, which replaces its files" in capsys.readouterr().err
    assert command("export", "csv", results, "--force") == 0


def test_a_building_without_coils(tmp_path):
    """Its histories have no channels, which netCDF 3 cannot express."""
    device = '[isolator]\nlaw = "kelvin_voigt"\nparameters = { k = 5e3, c = 1e3 }\n'
    (tmp_path / "a.toml").write_text(SCENARIO.split("[[controller]]")[0] + device)
    with (tmp_path / "a.toml").open("a") as file:
        file.write('[[controller]]\nname = "passive_off"\n')
    words = ["--no-figures", "--quiet", "--export", "mat", "--export", "xlsx"]
    assert command("run", tmp_path / "a.toml", "--out", tmp_path / "out", *words) == 0
    history = iso.read_run(tmp_path / "out" / "passive_off.nc")
    assert "current" not in history and history.displacement.shape[0] > 100
    tree = loadmat(tmp_path / "out" / "results.mat", simplify_cells=True)
    assert "displacement" in tree["passive_off"]


def test_an_export_that_fails_leaves_the_finished_run(tmp_path, monkeypatch, capsys):
    def fails(parts, path):
        raise iso.InputError("too large")

    monkeypatch.setitem(interchange.FORMS, "mat", fails)
    (tmp_path / "short.toml").write_text(SCENARIO)
    words = ["--no-figures", "--quiet", "--export", "mat"]
    assert command("run", tmp_path / "short.toml", "--out", tmp_path / "out", *words) == 2
    assert "too large" in capsys.readouterr().err
    assert (tmp_path / "out" / "criteria.csv").exists()


def test_the_folder_says_what_they_are(results):
    text = (results / "README.txt").read_text()
    assert "load results.mat" in text
    assert "results.xlsx" in text


def test_any_folder_of_results(results, tmp_path, capsys):
    rows = pandas.DataFrame({"case": [0, 1], "level, m/s^2": [0.5, np.nan], "9 lives": ["a", "b"]})
    (tmp_path / "table.npz").write_bytes(
        columns_bytes({name: np.array(list(rows[name])) for name in rows})
    )
    assert command("export", "mat", tmp_path) == 0
    loaded = loadmat(tmp_path / "results.mat", simplify_cells=True)["table"]
    np.testing.assert_array_equal(loaded["level__m_s_2"], rows["level, m/s^2"])
    assert list(loaded["x9_lives"]) == ["a", "b"]
    out = tmp_path / "book.xlsx"
    assert iso.export_results(tmp_path, "xlsx", out) == out
    pandas.testing.assert_frame_equal(pandas.read_excel(out), rows)


def test_a_library_that_is_not_installed_is_said_before_the_work(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "openpyxl", None)
    assert command("run", "--export", "xlsx", "--out", tmp_path / "none") == 2
    said = capsys.readouterr().err
    assert "xlsx needs openpyxl" in said and "simulating" not in said
    assert not (tmp_path / "none").exists()


def test_what_is_refused(tmp_path, results, capsys):
    assert command("run", "--export", "xls", "--out", tmp_path / "none") == 2
    assert "xlsx" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()
    assert command("export", "mat", tmp_path) == 2
    assert "holds no results" in capsys.readouterr().err


def test_the_folder_of_a_fit_is_exported_as_fit_exports_it(tmp_path):
    time = np.arange(0, 2, 1 / 64)
    x, v = 4e-3 * np.sin(6 * time), 24e-3 * np.cos(6 * time)
    noise = np.random.default_rng(0).normal(0, 1.0, time.size)
    run = TestRun("sine", time, x, v, 2e4 * x + 300 * v + noise, np.zeros(time.size))
    fit = iso.fit(Campaign("spring", "made for a test", (run,)), "kelvin_voigt", starts=1)
    fit.save(tmp_path / "fit")
    sheets = [
        pandas.read_excel(path, sheet_name=None)
        for path in (
            fit.save(tmp_path / "own.xlsx"), iso.export_results(tmp_path / "fit", "xlsx"),
        )
    ]  # fmt: skip
    assert sheets[0].keys() == sheets[1].keys() >= {"law", "parameters", "runs"}
    for name, table in sheets[0].items():
        pandas.testing.assert_frame_equal(sheets[1][name], table)
    with pytest.raises(iso.InputError, match="nothing: no such folder"):
        iso.export_results(tmp_path / "nothing", "mat")


def test_engineering_units_are_those_of_printed_tables(results, tmp_path):
    iso.export_results(results, "csv", tmp_path / "csv", "engineering")
    si, loaded = (
        pandas.read_csv(results / "criteria.csv"),
        pandas.read_csv(tmp_path / "csv/criteria.csv"),
    )
    for name, shown, factor in (
        ("peak_base_displacement_m", "peak_base_displacement_mm", 1e3),
        ("rms_base_shear_N", "rms_base_shear_kN", 1e-3),
        ("energy_input_J", "energy_input_kJ", 1e-3),
        ("peak_floor_acceleration_m_s2", "peak_floor_acceleration_m_s2", 1.0),
        ("J3", "J3", 1.0),
    ):
        np.testing.assert_allclose(loaded[shown], factor * si[name], rtol=1e-9)
        assert factor == 1 or name not in loaded
    history = pandas.read_csv(tmp_path / "csv/on_off.csv")
    moved = read_netcdf(results / "on_off.nc")["displacement"].sel(dof="base").values.ravel()
    np.testing.assert_allclose(history["displacement base (mm)"], 1e3 * moved, rtol=1e-9)
    code = command(
        "export", "xlsx", results, "--units", "engineering", "--out", tmp_path / "a.xlsx"
    )
    assert code == 0
    sheet = pandas.read_excel(tmp_path / "a.xlsx", sheet_name="criteria")
    np.testing.assert_allclose(sheet["rms_drift_mm"], 1e3 * si["rms_drift_m"])
    with pytest.raises(iso.InputError, match="unknown units 'imperial'"):
        iso.export_results(results, "csv", tmp_path / "no", "imperial")


@pytest.mark.filterwarnings("ignore::isolation_sim.PlausibilityWarning")
def test_rotations_are_in_rad_in_both_units(tmp_path):
    """One isolator off the centre of mass: the slab turns by the moment of its force."""
    slab = plan_building(
        [1e3], [1e9], [1e9], base_mass=1e5, plan=(6.0, 6.0), eccentricity=(0.0, 1.0)
    )  # fmt: skip
    isolated = slab.on(iso.law("kelvin_voigt", {"k": 4e6, "c": 2e5}), biaxial=True)
    pulse = Record(np.sin(np.linspace(0.0, 6.0, 60)), 0.02, name="pulse")
    run = iso.simulate(isolated, [pulse, pulse.scaled(0.0)])
    run.save(tmp_path / "run")
    angle = run.output("base_rotation_displacement_m")
    assert np.abs(angle).max() > 1e-4
    for units, length, factor in (("si", "m", 1.0), ("engineering", "mm", 1e3)):
        iso.export_results(tmp_path / "run", "csv", tmp_path / units, units)
        table = pandas.read_csv(tmp_path / units / "history.csv")
        np.testing.assert_allclose(table["displacement base_rotation (rad)"], angle, atol=1e-12)
        moved = run.output("base_x_displacement_m")
        np.testing.assert_allclose(
            table[f"displacement base_x ({length})"], factor * moved, atol=1e-9
        )
        assert "acceleration base_rotation (rad/s^2)" in table
        assert "velocity base_y (m/s)" in table


def test_units_of_single_columns_and_of_statistics():
    table = pandas.DataFrame({
        "k_N_per_m": [1.0], "moment_N_m": [1.0], "gap_m": [2], "peak_drift_ratio": [0.01],
        "note_m": ["x"], "case": [3],
    })  # fmt: skip
    (row,) = in_engineering_units(table).to_dict("records")
    assert row == {
        "k_N_per_m": 1.0, "moment_N_m": 1.0, "gap_mm": 2e3, "peak_drift_percent": 1.0,
        "note_m": "x", "case": 3,
    }  # fmt: skip
    statistics = pandas.DataFrame(
        {"criterion": ["peak_drift_m", "J1"], "mean": [0.01, 0.5], "runs": [7, 7]}
    )
    rows = in_engineering_units(statistics).to_dict("records")
    assert rows == [
        {"criterion": "peak_drift_mm", "mean": 10.0, "runs": 7},
        {"criterion": "J1", "mean": 0.5, "runs": 7},
    ]


def test_csv_of_a_folder_that_has_csv_files_alone(tmp_path):
    table = pandas.DataFrame({"motion": ["a", "b"], "peak_drift_m": [0.5, 0.25]})
    table.to_csv(tmp_path / "runs.csv", index=False)
    assert command("export", "csv", tmp_path) == 0
    pandas.testing.assert_frame_equal(pandas.read_csv(tmp_path / "results_csv/runs.csv"), table)
