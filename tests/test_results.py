"""What runs leave on disk."""

from __future__ import annotations

import csv
import errno
import json

import numpy as np
import pytest
import xarray

import isolation_sim as iso
from ground_motions import Record
from isolation_sim import read_run, write_run
from isolation_sim.io.csv_table import write_table
from isolation_sim.io.files import json_text, write_text
from isolation_sim.io.results_folder import ResultsFolder, file_name, files_into
from isolation_sim.reports.html.run_report import write_comparison


@pytest.fixture(scope="module")
def comparison():
    t = np.arange(0, 3, 0.02)
    record = Record(np.sin(2 * np.pi * t), 0.02, name="sine")
    isolated = iso.reference_building().on(iso.reference_isolators())
    return iso.compare(isolated, record, ["passive_off", "passive_on"])


def test_histories_survive_with_units_and_scenario(comparison, tmp_path):
    run = comparison.runs["passive_on"]
    path = write_run(run, tmp_path / "run.nc", "# scenario\n")
    data = read_run(path)
    assert data.attrs["scenario"] == "# scenario\n"
    assert data.attrs["controller"] == "passive_on"
    assert data.attrs["criterion_peak_drift_m"] == run.criteria["peak_drift_m"]
    assert set(data) == set(run.history)
    for name, values in run.history.items():
        np.testing.assert_array_equal(data[name].values, values.values)
        assert data[name].attrs["units"] == values.attrs["units"]
    assert data["dof"].values.tolist() == list(run.isolated.structure.names)


def test_any_reader_of_netcdf_reads_it(comparison, tmp_path):
    path = write_run(comparison.runs["passive_on"], tmp_path / "run.nc")
    with xarray.open_dataset(path) as data:
        assert data.displacement.sizes == {"time": 150, "dof": 6}


@pytest.mark.parametrize("content", [None, b"", b"time_s,a\n", b"\x89HDF\r\n\x1a\n"])
def test_what_is_not_netcdf_is_refused(content, tmp_path):
    path = tmp_path / "run.nc"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(iso.InputError, match=r"run\.nc: .*expected: netCDF") as caught:
        read_run(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("present", [False, True])
@pytest.mark.parametrize("kind", ["results", "saved"])
def test_a_full_disk_leaves_no_part_of_a_result(tmp_path, kind, present):
    folder = tmp_path / "new" / "out"
    if present:
        folder.mkdir(parents=True)
    before = sorted(tmp_path.rglob("*"))
    into = ResultsFolder(folder) if kind == "results" else files_into(folder, False)
    with pytest.raises(OSError, match="No space") as caught, into as entered:
        place = getattr(entered, "unfinished", entered)
        write_text("1", place / "a.csv")
        raise OSError(errno.ENOSPC, "No space left on device", str(place / "b.csv"))
    assert caught.value.filename == str(folder / "b.csv")
    assert sorted(tmp_path.rglob("*")) == before


def test_a_failed_write_keeps_the_old_file(comparison, tmp_path):
    path = write_text("old", tmp_path / "table.csv")
    with pytest.raises(ValueError, match="dict contains"):
        write_table([{"a": 1}, {1: object(), "b": set()}, {"a": Broken()}], path)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["table.csv"]


def test_a_write_that_fails_names_the_file(tmp_path):
    (tmp_path / "taken").mkdir()
    for path in (tmp_path / "taken", tmp_path / "nowhere" / "a.txt"):
        with pytest.raises(OSError, match="directory") as caught:
            write_text("text", path)
        assert caught.value.filename == str(path)
    assert [p.name for p in tmp_path.iterdir()] == ["taken"]


class Broken:
    def __str__(self):
        raise ValueError("dict contains what cannot be written")


@pytest.mark.usefixtures("no_drawing")
def test_everything_of_a_comparison(comparison, tmp_path):
    write_comparison(comparison, tmp_path, "# scenario\n")
    results = {str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()}
    figures = {
        "time_histories", "floor_envelopes", "energy", "loops", "currents", "structure",
    }  # fmt: skip
    assert results == {
        "passive_off.nc", "passive_on.nc", "criteria.csv", "criteria.json", "table.txt",
        "scenario.toml", "report.html", "README.txt", "result.npz",
    } | {f"figures/{name}.{kind}" for name in figures for kind in ("svg", "png")}  # fmt: skip
    with (tmp_path / "criteria.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["controller"] for row in rows] == ["passive_off", "passive_on"]
    peak = comparison.criteria["passive_on"]["peak_drift_m"]
    assert float(rows[1]["peak_drift_m"]) == peak
    report = json.loads((tmp_path / "criteria.json").read_text())
    assert report["runs"][1]["criteria"]["peak_drift_m"] == peak
    assert "base displacement" in (tmp_path / "table.txt").read_text()


def test_json_has_null_for_what_is_no_number():
    text = json_text({"a": [float("nan"), 1.0, float("inf")]}, indent=None)
    assert text == '{"a": [null, 1.0, null]}'


@pytest.mark.parametrize(
    ("name", "file"), [("on_off", "on_off"), ("2 A/s", "2_A_s"), ("..", "unnamed"), (".a", "a")]
)
def test_file_names(name, file):
    assert file_name(name) == file


def test_a_results_folder_appears_whole(tmp_path):
    target_folder = tmp_path / "deep" / "results"
    with ResultsFolder(target_folder) as folder:
        (folder.unfinished / "a").write_text("")
        assert not target_folder.exists()
    assert folder.path == target_folder
    assert [p.name for p in target_folder.iterdir()] == ["a"]


def test_a_results_folder_never_replaces_another(tmp_path):
    target_folder = tmp_path / "results"
    for expected in ("results", "results-2", "results-3"):
        with ResultsFolder(target_folder) as folder:
            (folder.unfinished / "a").write_text(expected)
        assert folder.path.name == expected
    assert (target_folder / "a").read_text() == "results"


def test_an_empty_folder_is_used(tmp_path):
    with ResultsFolder(tmp_path) as folder:
        (folder.unfinished / "a").write_text("")
    assert (tmp_path / "a").exists()


def test_a_failed_results_folder_leaves_nothing(tmp_path):
    with pytest.raises(RuntimeError), ResultsFolder(tmp_path / "new" / "results"):
        raise RuntimeError
    assert not list(tmp_path.iterdir())


def test_a_results_folder_below_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(iso.InputError, match="results cannot be written there"):
        with ResultsFolder(tmp_path / "file" / "results"):
            pass


@pytest.mark.usefixtures("no_drawing")
def test_a_folder_says_what_is_in_it(comparison, tmp_path):
    write_comparison(comparison, tmp_path, "# scenario\n")
    title, _, *lines = (tmp_path / "README.txt").read_text().splitlines()
    assert title.startswith(comparison.title)
    text = {line.split()[0].rstrip("/") for line in lines}
    assert text == {path.name for path in tmp_path.iterdir()} - {"README.txt"}
    assert all(len(line.split()) > 3 for line in lines)
