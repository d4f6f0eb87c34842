"""Campaign folders: read to SI, refused in one line, written and read back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.identification.campaign import Campaign, read_campaign, write_campaign
from isolation_sim.identification.measured.run_table import TestRun, read_run
from isolation_sim.identification.run_preparation import repaired

N = 200
TIME = 0.01 * np.arange(N)
COLUMNS = {
    "time_s": TIME,
    "displacement_mm": 4 * np.sin(2 * np.pi * TIME),
    "current_A": np.ones(N),
    "force_N": 100 * np.cos(2 * np.pi * TIME),
}
TOML = 'name = "tests"\nsource = "here"\n\n[[run]]\nfile = "a.csv"\n'


def write_csv(path, columns, edit=lambda lines: lines):
    rows = zip(*(np.asarray(c).tolist() for c in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    path.write_text("\n".join(edit(lines)) + "\n")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "campaign.toml").write_text(TOML)
    write_csv(tmp_path / "a.csv", COLUMNS)
    return tmp_path


def refused(folder):
    with pytest.raises(InputError) as caught:
        read_campaign(folder)
    message = str(caught.value)
    assert "\n" not in message and "expected" in message
    return message


def test_reads_to_si(folder):
    campaign = read_campaign(folder)
    assert (campaign.name, campaign.source) == ("tests", "here")
    (run,) = campaign.runs
    assert run.name == "a" and not run.hold_out and not run.velocity_measured
    np.testing.assert_allclose(run.displacement, 1e-3 * COLUMNS["displacement_mm"])
    np.testing.assert_array_equal(run.force, COLUMNS["force_N"])
    assert run.step == pytest.approx(0.01)
    velocity = 8e-3 * np.pi * np.cos(2 * np.pi * TIME)
    np.testing.assert_allclose(run.velocity, velocity, atol=5e-3 * np.max(velocity))
    with pytest.raises(ValueError, match="read-only"):
        run.force[0] = 0.0


def test_the_toml_file_itself_is_accepted(folder):
    assert read_campaign(folder / "campaign.toml").runs[0].name == "a"


def test_units_and_optional_columns(folder):
    columns = {
        "time_s": TIME,
        "displacement_m": 4e-3 * np.sin(2 * np.pi * TIME),
        "velocity_mm_s": 8 * np.pi * np.cos(2 * np.pi * TIME),
        "acceleration_g": np.ones(N),
        "current_A": np.zeros(N),
        "force_kN": COLUMNS["force_N"] / 1000,
        "temperature_C": np.full(N, 21.0),
        "set_point": np.zeros(N),
    }
    write_csv(folder / "a.csv", columns)
    run = read_campaign(folder).runs[0]
    np.testing.assert_allclose(run.force, COLUMNS["force_N"])
    np.testing.assert_allclose(run.velocity, columns["velocity_mm_s"] / 1000)
    np.testing.assert_allclose(run.acceleration, 9.80665)
    assert run.velocity_measured and run.temperature[0] == 21.0
    assert run.ignored_columns == ("set_point",)
    assert read_campaign(folder).column_notes == [
        "columns that are not used (runs that have them): set_point (1)"
    ]


def test_a_device_without_coil_has_no_current(folder, tmp_path):
    passive = {name: column for name, column in COLUMNS.items() if name != "current_A"}
    write_csv(folder / "a.csv", passive)
    campaign = read_campaign(folder)
    assert not campaign.runs[0].current_measured and not campaign.runs[0].current.any()
    assert campaign.column_notes == ["no column current_A: the device counts as one without coil"]
    again = read_campaign(write_campaign(campaign, tmp_path / "again"))
    assert not again.runs[0].current_measured
    write_csv(folder / "b.csv", COLUMNS)
    (folder / "campaign.toml").write_text(TOML + '[[run]]\nfile = "b.csv"\n')
    assert "no current_A in 'a'; expected: a current in all runs" in refused(folder)


def test_hold_out_splits(folder):
    write_csv(folder / "b.csv", COLUMNS)
    (folder / "campaign.toml").write_text(TOML + '[[run]]\nfile = "b.csv"\nhold_out = true\n')
    campaign = read_campaign(folder)
    assert [r.name for r in campaign.fitted] == ["a"]
    assert [r.name for r in campaign.held_out] == ["b"]


def test_missing_folder_toml_and_csv(folder, tmp_path):
    assert "does not exist" in refused(tmp_path / "none")
    (folder / "a.csv").rename(folder / "a1.csv")
    assert "campaign.toml, run 1: no file 'a.csv'; did you mean 'a1.csv'?" in refused(folder)
    (folder / "campaign.toml").unlink()
    assert "no campaign.toml" in refused(folder)


@pytest.mark.parametrize(
    ("toml", "expected_message"),
    [
        ("name = ", "not TOML"),
        ('nome = "x"\n' + TOML, "did you mean 'name'?"),
        (TOML + "holdout = true\n", "did you mean 'hold_out'?"),
        (TOML + 'hold_out = "yes"\n', "true or false"),
        (TOML + "hold_out = true\n", "left to fit"),
        ('name = "x"\n', "no run"),
        ('name = "x"\nrun = 3\n', "no run"),
        ("[[run]]\nhold_out = false\n", "no file"),
        (TOML + '[[run]]\nfile = "a.csv"\n', "run 2: file 'a.csv' again"),
        ("name = 3\n" + TOML[15:], "text in quotes"),
    ],
)
def test_bad_toml(folder, toml, expected_message):
    (folder / "campaign.toml").write_text(toml)
    message = refused(folder)
    assert expected_message in message and "campaign.toml" in message


def changed(**columns):
    return {k: v for k, v in (COLUMNS | columns).items() if v is not None}


@pytest.mark.parametrize(
    ("columns", "expected_message"),
    [
        (changed(force_N=None), "force_N or force_kN"),
        (changed(displacement_mm=None), "displacement_mm or displacement_m"),
        (changed(current_A=None, curent_A=np.ones(N)), "expected: current_A"),
        (changed(displacement_m=np.ones(N)), "displacement given twice"),
        (changed(force_N=None, force_lbf=np.ones(N)), "'force_lbf'"),
        (changed(velocty_mm_s=np.ones(N)), "velocity_mm_s"),
        (changed(velocity_m_s=8 * np.pi * np.cos(2 * np.pi * TIME)), "in the unit that"),
        (changed(velocity_mm_s=-8 * np.pi * np.cos(2 * np.pi * TIME)), "opposite sign"),
        (changed(force_N=np.where(np.arange(N) == 7, np.inf, 1.0)), "line 9, column force_N"),
        (changed(force_N=np.full(N, 3.0)), "same number throughout"),
        (changed(time_s=TIME[::-1]), "times that increase"),
        (changed(time_s=TIME + 0.5 * (TIME > 1.0)), "a step of 0.51 s where 0.01 s is usual"),
        ({k: v[:9] for k, v in COLUMNS.items()}, "9 samples"),
    ],
)
def test_bad_columns(folder, columns, expected_message):
    write_csv(folder / "a.csv", columns)
    message = refused(folder)
    assert expected_message in message and "a.csv" in message


def test_bad_rows(folder):
    write_csv(folder / "a.csv", COLUMNS, lambda lines: [*lines[:5], "1,2", *lines[5:]])
    assert "line 6: 2 cells" in refused(folder)
    write_csv(folder / "a.csv", COLUMNS, lambda lines: [*lines[:5], "0.04,x,1,2", *lines[6:]])
    assert "line 6, column displacement_mm" in refused(folder)


def test_comments_and_blank_lines_are_skipped(folder):
    write_csv(folder / "a.csv", COLUMNS, lambda lines: ["# rig 3", "", *lines])
    assert read_run(folder / "a.csv").time.size == N


def test_written_and_read_back(tmp_path):
    noise = np.random.default_rng(0).standard_normal(N)
    run = TestRun("one", TIME, noise, noise, noise, np.ones(N), velocity_measured=False)
    velocity = 2 * np.pi * np.cos(2 * np.pi * TIME)
    two = replace(
        run,
        name="two",
        displacement=np.sin(2 * np.pi * TIME),
        velocity=velocity,
        hold_out=True,
        velocity_measured=True,
        temperature=np.full(N, 20.0),
    )
    path = write_campaign(Campaign('a "b"', "s", (run, two)), tmp_path / "new" / "c")
    back = read_campaign(path)
    assert (back.name, back.source) == ('a "b"', "s")
    np.testing.assert_array_equal(back.runs[0].force, noise)
    np.testing.assert_array_equal(back.runs[1].velocity, velocity)
    assert back.runs[1].hold_out and back.runs[1].temperature is not None
    assert sorted(p.name for p in path.parent.iterdir()) == ["c"]
    with pytest.raises(InputError, match="exists already"):
        write_campaign(back, path)


def test_run_refuses_what_no_test_gives():
    good = TestRun("r", TIME, TIME, TIME, TIME, TIME)
    for field, value in (("force", TIME[1:]), ("force", TIME * np.nan), ("time", TIME**2)):
        with pytest.raises(InputError, match="r, "):
            replace(good, **{field: value})


def test_measured_damper_reads(shared_data):
    campaign = read_campaign(shared_data / "mr_damper")
    assert len(campaign.runs) == 18
    for run in campaign.runs:
        _, frequency, current = run.name.split("_")
        peak = 2 * np.pi * float(frequency[:-2]) * np.ptp(run.displacement) / 2
        assert np.max(np.abs(run.velocity)) == pytest.approx(peak, rel=0.06)
        assert np.median(run.current) == pytest.approx(float(current[:-1]), abs=0.05)


@pytest.mark.parametrize("separator", [";", "\t"])
def test_decimal_commas_are_read(folder, separator):
    expected = read_run(folder / "a.csv").displacement

    def local(lines):
        return [lines[0].replace(",", separator)] + [
            line.replace(",", separator).replace(".", ",") for line in lines[1:]
        ]

    write_csv(folder / "a.csv", COLUMNS, local)
    np.testing.assert_array_equal(read_run(folder / "a.csv").displacement, expected)
    write_csv(folder / "a.csv", COLUMNS, lambda lines: [*local(lines)[:-1], f"1{separator}x"])
    assert f"line {N + 1}: 2 cells" in refused(folder)


@pytest.mark.parametrize("cut", [np.round, np.floor])
def test_times_in_milliseconds_at_256_hz_are_read(folder, cut):
    write_csv(folder / "a.csv", COLUMNS | {"time_s": cut(1e3 * np.arange(N) / 256) / 1e3})
    assert read_run(folder / "a.csv").step == pytest.approx(1 / 256, rel=1e-4)
    # one that lies elsewhere is no rounding
    moved = np.round(1e3 * np.arange(N) / 256) / 1e3 + 1e-3 * (np.arange(N) == 60)
    write_csv(folder / "a.csv", COLUMNS | {"time_s": moved})
    assert "s where 0.004 s is usual" in refused(folder)


def test_empty_cells_and_nan_are_interpolated_with_a_note(folder):
    def lose(lines):
        for row, column, mark in ((50, 1, ""), (90, 3, "NaN"), (91, 3, ""), (60, 2, "nan")):
            cells = lines[row + 1].split(",")
            cells[column] = mark
            lines[row + 1] = ",".join(cells)
        return lines

    write_csv(folder / "a.csv", COLUMNS, lose)
    campaign = read_campaign(folder)
    (run,) = campaign.runs
    np.testing.assert_allclose(1e3 * run.displacement, COLUMNS["displacement_mm"], atol=0.02)
    np.testing.assert_allclose(run.force, COLUMNS["force_N"], atol=1.0)
    assert np.all(run.current == 1.0)
    assert repaired(campaign)[1] == [
        "a: 1 sample is missing in the displacement, first at 0.5 s; interpolated",
        "a: 1 sample is missing in the current, first at 0.6 s; interpolated",
        "a: 2 samples are missing in the force, first at 0.9 s; interpolated",
    ]


@pytest.mark.parametrize(
    ("column", "rows", "message"),
    [
        (3, range(70, 76), "line 72, column force_N: given 6 samples in a row without a number"),
        (1, range(10, 40, 10), "line 12, column displacement_mm: given the first of 3 samples"),
        (2, [0], "line 2, column current_A: given no number; expected: numbers in the first"),
        (0, [7], "line 9, column time_s: given ''; expected: a finite number"),
    ],
)
def test_long_gaps_and_many_are_refused(folder, column, rows, message):
    def lose(lines):
        for row in rows:
            cells = lines[row + 1].split(",")
            cells[column] = ""
            lines[row + 1] = ",".join(cells)
        return lines

    write_csv(folder / "a.csv", COLUMNS, lose)
    assert message in refused(folder)


def test_all_missing_columns_are_named_with_the_import(folder):
    write_csv(folder / "a.csv", {"t": TIME, "displacement_mm": TIME, "F": TIME})
    message = refused(folder)
    assert "no column of time and force among t, displacement_mm, F" in message
    assert "expected: time_s, force_N or force_kN; isolation-sim import reads" in message
