"""Test files as machines write them become a campaign, or are refused in one line."""

from __future__ import annotations

import json

import numpy as np
import pytest

import isolation_sim as iso
from isolation_sim.identification.campaign import read_campaign
from isolation_sim.identification.raw_tests.channels import heading_of
from isolation_sim.identification.raw_tests.rate import rate_in

N = 400
TIME = np.arange(N) / 200
X = 5e-3 * np.sin(2 * np.pi * TIME)
FORCE = 1e5 * X + 20 * np.cos(2 * np.pi * TIME)
CURRENT = np.full(N, 2.0)
SI = {"time": TIME, "displacement": X, "force": FORCE, "current": CURRENT}


def rows(form, *columns):
    return "".join(form % row + "\n" for row in zip(*columns, strict=True))


PLAIN = rows("%.4f,%.6f,%.6f", TIME, 1e3 * X, FORCE / 1e3)
HEADING = "Time (s),Disp (mm),Force (kN)\n"
TEXTS = {
    "mts.csv": (
        'MTS793|BTW|ENU|1|2|.|/|:|1|0|0|A\n\nData Header:,,Time:,49.9,Sec,11/3/2023 10:21:33 AM\n'
        '"Ch 1 Displacement","Ch 1 Force","Coil Current","Running Time"\nmm,kN,A,Sec\n'
        + rows("%.6f,%.6f,%.3f,%.4f", 1e3 * X, FORCE / 1e3, CURRENT, TIME), "utf-8",
    ),
    "units_row.txt": (
        "Prüfung 12;\nBediener: Müller\n\nZeit\tWeg\tPrüfkraft\tSpulenstrom\ns\tmm\tkN\tA\n"
        + rows("%.4f\t%.6f\t%.6f\t%.2f", TIME, 1e3 * X, FORCE / 1e3, CURRENT).replace(".", ","),
        "utf-16",
    ),
    "blanks.dat": (
        "Prüfstand 2, 20 °C\nZeit / s  Weg / cm  Kraft / N  Strom / mA\n"
        + rows("%8.4f %9.6f %9.3f %7.1f", TIME, 1e2 * X, FORCE, 1e3 * CURRENT), "latin-1",
    ),
    "comments.asc": (
        "% rig 3\n% rate: 200 Hz\n% t [ms]\tposition [in]\tload [lbf]\ti [A]\n"
        + rows("%.1f\t%.8f\t%.6f\t%.2f", 1e3 * TIME, X / 0.0254, FORCE / 4.4482216, CURRENT),
        "utf-8",
    ),
    "no_first_unit.csv": (
        "Row;Time;Disp;Force;I\n;ms;mm;N;A\n"
        + rows("%d;%.1f;%.6f;%.4f;%.2f", np.arange(N), 1e3 * TIME, 1e3 * X, FORCE, CURRENT)
        .replace(".", ","), "utf-8",
    ),
    "quoted.csv": (
        '"Time, s","Displacement, mm","Force, kN","Current, A"\n'
        + rows('"%.4f","%.6f","%.6f","%.2f"', TIME, 1e3 * X, FORCE / 1e3, CURRENT)
        .replace(".", ","), "utf-8",
    ),
    "axial.txt": (
        "Time\tCommand\tAxial Displacement\tAxial Force\tCoil Current\ns\tmm\tmm\tkN\tA\n"
        + rows("%.4f\t%.6f\t%.6f\t%.6f\t%.2f", TIME, 1.01e3 * X, 1e3 * X, FORCE / 1e3, CURRENT),
        "utf-8",
    ),
    "more.csv": (
        "Clock,Time [s],Disp Command,Disp,Axial,Shear,Current,\n,,(mm),(mm),(kN),(kN),(A),\n"
        + rows("10:21:%05.2f,%.4f,%.5f,%.6f,%.3f,%.6f,%.2f,",
               TIME, TIME, 1e3 * X, 1e3 * X, 100 + TIME, FORCE / 1e3, CURRENT)
        + "\nEnd of test, 12:00\n", "utf-8",
    ),
}  # fmt: skip


def written(folder, text, name="test.csv"):
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def refused(tests, **options):
    with pytest.raises(iso.InputError) as caught:
        iso.import_tests(tests, **options)
    message = str(caught.value)
    assert "\n" not in message
    return message


def assert_is_the_test(run):
    for what, values in SI.items():
        measured = getattr(run, what)
        np.testing.assert_allclose(measured, values, rtol=1e-4, atol=1e-4 * np.max(values))


@pytest.mark.parametrize("name", TEXTS)
def test_text_files_of_machines(tmp_path, name):
    text, encoding = TEXTS[name]
    (tmp_path / name).write_text(text, encoding=encoding)
    imported = iso.import_tests(tmp_path / name, tmp_path / "out")
    assert_is_the_test(imported.campaign.runs[0])
    (read,) = read_campaign(tmp_path / "out").runs
    np.testing.assert_array_equal(read.force, imported.campaign.runs[0].force)
    assert imported.summary() in (tmp_path / "out" / "import.txt").read_text()
    assert "exists already" in refused(tmp_path / name, out=tmp_path / "out")


@pytest.mark.parametrize(
    ("line", "current"),
    [
        ("Spulenstrom;1,5 A", 1.5), ("# Coil current [mA]: 500", 0.5), ("Current = 2 A", 2.0),
        ("Current: -2 A", -2.0), ("Current: 0-2 A", 0.0),
        ("Max. current: 3 A", 0.0), ("Current: 2", 0.0), ("Test current sensor 3 A", 0.0),
    ],
)  # fmt: skip
def test_the_current_above_the_table(tmp_path, line, current):
    rows = "\n".join(f"{t};{1e3 * x};{f}" for t, x, f in zip(TIME, X, FORCE, strict=True))
    path = written(tmp_path, f"a rig\n{line}\nZeit [s];Weg [mm];Kraft [N]\n{rows}\n")
    imported = iso.import_tests(path)
    assert set(imported.campaign.runs[0].current) == {current}
    told = f"test: a current of {current:g} A, as the file says" in imported.notes
    assert told == (current != 0)
    assert set(iso.import_tests(path, current=1.0).campaign.runs[0].current) == {1.0}


def test_a_number_that_is_cut_off_or_has_another_decimal_mark(tmp_path):
    rows = [
        f"{t:.4f};{1e3 * x:.4f};{f / 10:.3f}".replace(".", ",")
        for t, x, f in zip(TIME, X, FORCE, strict=True)
    ]
    text = "Zeit [s];Weg [mm];Kraft [daN]\n" + "\n".join(rows)
    whole = iso.import_tests(written(tmp_path, text)).campaign.runs[0]
    np.testing.assert_allclose(whole.force, FORCE, atol=0.01)
    cut = iso.import_tests(written(tmp_path, text[:-2]))
    assert len(cut.campaign.runs[0].time) == len(TIME) - 1
    assert f"test: what stands below line {len(TIME)} is left out" in cut.notes
    # with a line end it may be a number of fewer digits
    short = iso.import_tests(written(tmp_path, text[:-2] + "\n"))
    assert len(short.campaign.runs[0].time) == len(TIME)
    point = written(tmp_path, text.replace(rows[9], rows[9].rpartition(";")[0] + ";1.234"))
    assert "line 11, column Kraft [daN]: given '1.234' below decimal commas" in refused(point)


def test_a_sheet_per_test(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["MRE isolator", "J. Doe"])
    for name in ("4mm 1Hz", "4mm 2Hz"):
        sheet = book.create_sheet(name)
        sheet.append(["Test", name])
        sheet.append([None, "Zeit [s]", "Weg [mm]", "Kraft [kN]", "Strom [A]"])
        for row in zip(TIME, 1e3 * X, FORCE / 1e3, CURRENT, strict=True):
            sheet.append([None, *map(float, row)])
    book.save(tmp_path / "all.xlsx")
    imported = iso.import_tests(tmp_path / "all.xlsx", hold_out=["*2Hz"])
    runs = imported.campaign.runs
    assert [run.name for run in runs] == ["all_4mm_1Hz", "all_4mm_2Hz"]
    assert [run.hold_out for run in runs] == [False, True]
    assert_is_the_test(runs[1])
    assert "all_4mm_2Hz: the forces are those of another test" in imported.notes[-1]
    assert imported.folder is None and not (tmp_path / "campaign.toml").exists()


def test_excel_without_openpyxl(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "openpyxl", None)
    (tmp_path / "all.xlsx").write_bytes(b"")
    assert "pip install 'isolation-sim[excel]'" in refused(tmp_path)


@pytest.mark.parametrize("kind", ["struct", "struct array", "variables", "matrix"])
def test_matlab_files(tmp_path, kind):
    from scipy.io import savemat

    struct = {"time": TIME, "disp": 1e3 * X, "force": FORCE, "curr": CURRENT}
    units = {"displacement": "mm", "force": "N", "current": "A"}
    matrix = {"data": np.column_stack(list(struct.values())),
              "colheaders": np.array(["Time (s)", "x (mm)", "F (N)", "I (A)"], object)}  # fmt: skip
    array = np.array([tuple(struct.values())] * 2, dtype=[(key, object) for key in struct])
    content = {"struct": {"data": struct}, "struct array": {"tests": array},
               "variables": {**struct, "rate": 200.0}, "matrix": {"A": matrix}}  # fmt: skip
    savemat(tmp_path / "a.mat", content[kind])
    if kind != "matrix":
        message = refused(tmp_path)
        assert "'disp' (displacement), 'force' (force), 'curr' (current)" in message
        assert "--unit displacement=UNIT (mm, m, cm" in message
    imported = iso.import_tests(tmp_path, units={} if kind == "matrix" else units)
    assert len(imported.campaign.runs) == (2 if kind == "struct array" else 1)
    assert_is_the_test(imported.campaign.runs[0])


@pytest.mark.parametrize("kind", ["beside", "above"])
def test_a_current_that_is_one_number_of_a_struct(tmp_path, kind):
    from scipy.io import savemat

    columns = {"time_s": TIME, "disp_mm": 1e3 * X, "force_N": FORCE}
    struct = {**columns, "current_A": 2.0, "i": 3}
    above = {"current_A": 2.0, "data": {**columns, "amplitude": 4.0}}
    savemat(tmp_path / "a.mat", {"test": struct if kind == "beside" else above})
    (run,) = iso.import_tests(tmp_path).campaign.runs
    assert run.current_measured and set(run.current) == {2.0}


def test_matlab_files_of_version_7_3(tmp_path):
    # as MATLAB writes them: columns first, texts as numbers, cells and structs by references
    h5py = pytest.importorskip("h5py")
    columns = {"time": TIME, "disp": 1e3 * X, "force": FORCE, "curr": CURRENT}
    units = ("s", "mm", "N", "A")

    def put(place, name, value, kind):
        place.create_dataset(name, data=value).attrs["MATLAB_class"] = np.bytes_(kind)

    with h5py.File(tmp_path / "one.mat", "w", userblock_size=512) as file:
        test = file.create_group("test")
        for (name, values), unit in zip(columns.items(), units, strict=True):
            put(test, name, values[None], "double")
            put(
                test.require_group("units"),
                name,
                np.array([[ord(unit[0])], *([ord(c)] for c in unit[1:])], np.uint16),
                "char",
            )
    with h5py.File(tmp_path / "several.mat", "w", userblock_size=512) as file:
        tests = file.create_group("tests")
        for name, values in columns.items():
            refs = []
            for k in range(2):
                put(file.require_group("#refs#"), f"{name}{k}", values[None], "double")
                refs.append(file[f"#refs#/{name}{k}"].ref)
            tests.create_dataset(
                f"{name}_{units[[*columns].index(name)]}", data=np.array([refs], h5py.ref_dtype)
            )
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, HDF5 schema 1.00 .".ljust(124) + b"\0\2IM"
    for name, count in (("one", 1), ("several", 2)):
        path = tmp_path / f"{name}.mat"
        path.write_bytes(header + path.read_bytes()[128:])
        imported = iso.import_tests(path)
        assert len(imported.campaign.runs) == count
        for run in imported.campaign.runs:
            assert_is_the_test(run)


SAMPLES = {"time (s)": TIME, "x (mm)": 1e3 * X, "F (N)": FORCE, "I (A)": CURRENT}
MATRIX = np.column_stack([*SAMPLES.values()])
AS_JSON = {
    "columns": {"test 1": {**SAMPLES, "operator": "Li"}, "rate": 200},
    "rows": {"columns": [*SAMPLES], "data": MATRIX},
    "numbered samples": {key: dict(enumerate(values)) for key, values in SAMPLES.items()},
    "an object per sample": [dict(zip(SAMPLES, row, strict=True)) for row in MATRIX.tolist()],
}  # as published, and as pandas writes tables


@pytest.mark.parametrize("content", AS_JSON.values(), ids=AS_JSON)
def test_json_files(tmp_path, content):
    text = json.dumps(content, default=lambda array: array.tolist())
    imported = iso.import_tests(written(tmp_path, text, "a.json"))
    assert_is_the_test(imported.campaign.runs[0])
    assert "a.json: not JSON" in refused(written(tmp_path, text[:-9], "a.json"))


def test_a_json_matrix_without_names(tmp_path):
    rows_of_text = json.dumps({"data": MATRIX.tolist()}).replace("[0.005,", "[null,")
    file = written(tmp_path, rows_of_text, "a.json")
    assert "columns 'column 1', 'column 2'" in refused(file)
    columns = {"time": 1, "displacement": 2, "force": 3, "current": 4}
    units = {"displacement": "mm", "force": "N", "current": "A"}
    imported = iso.import_tests(file, columns=columns, units=units)
    assert_is_the_test(imported.campaign.runs[0])
    assert any("time" in note and "1 sample" in note for note in imported.notes), imported.notes


@pytest.mark.parametrize("kind", ["group", "compound", "matrix"])
def test_hdf5_files(tmp_path, kind):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        group = file.create_group("test 1")
        if kind == "compound":
            group["log"] = np.array([*map(tuple, MATRIX)], [(name, float) for name in SAMPLES])
        elif kind == "matrix":
            group["log"] = MATRIX
            group.attrs["columns"] = [*SAMPLES]
        else:
            for (name, values), unit in zip(SAMPLES.items(), ("s", "mm", "N", "A"), strict=True):
                group[name.split()[0]] = values
                group[name.split()[0]].attrs["units"] = unit
    assert_is_the_test(iso.import_tests(tmp_path).campaign.runs[0])
    assert "not an HDF5 file" in refused(written(tmp_path, "none", "b.hdf5"))


def test_formats_without_their_library(tmp_path, monkeypatch):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        file["x"] = X
    header = b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM"
    (tmp_path / "a.mat").write_bytes(header + (tmp_path / "a.mat").read_bytes()[128:])
    for name, module, extra in (
        ("a.mat", "h5py", "hdf5"), ("a.h5", "h5py", "hdf5"), ("a.tdms", "nptdms", "tdms"),
    ):  # fmt: skip
        (tmp_path / name).touch()
        monkeypatch.setitem(__import__("sys").modules, module, None)
        assert f"pip install 'isolation-sim[{extra}]'" in refused(tmp_path / name)
        monkeypatch.undo()
    assert "not a MATLAB .mat file" in refused(written(tmp_path, header.decode() + "x", "b.mat"))
    assert "not a file *.tdms" in refused(written(tmp_path, "no TDMS", "b.tdms"))
    assert "no table" in refused(written(tmp_path, "TDSm cut off", "c.tdms"))


LVM = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t{point}\n"
    "X_Columns\t{columns}\nDate\t2026/11/27\n***End_of_Header***\t\n\t\n{segments}"
)
SEGMENT = (
    "Channels\t3\t\t\nSamples\t400\t400\t400\nY_Unit_Label\tMillimeters\tNewtons\tAmps\t\n"
    "X_Dimension\tTime\tTime\tTime\t\nX0\t0\t0\t0\t\nDelta_X\t{step}\t{step}\t{step}\t\n"
    "***End_of_Header***\t\t\t\t\n{names}\tComment\n{rows}"
)


@pytest.mark.parametrize("columns", ["One", "Multi", "No"])
def test_measurement_files_of_labview(tmp_path, columns):
    each = (1e3 * X, FORCE, CURRENT)
    names, form, values = {
        "One": ("X_Value\tWeg\tKraft\tStrom", "%.4f\t%.6f\t%.4f\t%.2f", (TIME, *each)),
        "Multi": (
            "X_Value\tWeg\tX_Value\tKraft\tX_Value\tStrom",
            "\t".join(["%.4f"] * 6), [c for one in each for c in (TIME, one)],
        ),
        "No": ("X_Value\tWeg\tKraft\tStrom", "\t%.6f\t%.4f\t%.2f", each),
    }[columns]  # fmt: skip
    segment = SEGMENT.format(step="0.005", names=names, rows=rows(form, *values))
    text = LVM.format(point=",", columns=columns, segments=2 * segment.replace(".", ","))
    runs = iso.import_tests(written(tmp_path, text, "rig.lvm")).campaign.runs
    assert [run.name for run in runs] == ["rig_1", "rig_2"]
    for run in runs:
        assert_is_the_test(run)
    assert "LabVIEW Measurement" in refused(written(tmp_path, HEADING + PLAIN, "other.lvm"))


@pytest.mark.parametrize("clock", [False, True])
def test_tdms_files_of_labview(tmp_path, clock):
    tdms = pytest.importorskip("nptdms")
    step = {} if clock else {"wf_increment": 0.005}
    channels = [
        tdms.ChannelObject("4mm_1Hz", name, values, {"unit_string": unit, **step})
        for name, values, unit in (
            ("Position", 1e3 * X, "mm"), ("Load", FORCE, "N"), ("Coil current", CURRENT, "A"),
        )
    ]  # fmt: skip
    if clock:
        times = np.datetime64("2026-11-27T10:00:00") + (5 * np.arange(N)).astype("timedelta64[ms]")
        channels.append(tdms.ChannelObject("4mm_1Hz", "Time", times))
    with tdms.TdmsWriter(tmp_path / "rig.tdms") as file:
        file.write_segment([*channels, tdms.ChannelObject("settings", "limits", np.ones(3))])
    (run,) = iso.import_tests(tmp_path).campaign.runs
    assert_is_the_test(run)


@pytest.mark.parametrize(
    "form",
    ["10:%02d:%06.3f", "27.11.2026 10:%02d:%06.3f", "2026-11-27T10:%02d:%06.3fZ", "0:%02d:%06.3f",
     "11/27/2026 10:%02d:%06.3f PM"],
)  # fmt: skip
def test_times_of_day(tmp_path, form):
    cells = [form % divmod(59 * 60 + 58.5 + t, 60) for t in TIME]
    # over an hour, and for half of them over midnight
    over = [c.replace("10:60", "11:00").replace("0:60", "1:00") for c in cells]
    text = "Zeit;Weg [mm];Kraft [N];Strom [A]\n"
    text += rows("%s;%.6f;%.6f;%.2f", over, 1e3 * X, FORCE, CURRENT)
    imported = iso.import_tests(written(tmp_path, text))
    assert_is_the_test(imported.campaign.runs[0])
    assert "h:min:s" in imported.summary()


def test_a_test_over_midnight(tmp_path):
    cells = [f"23:59:{59 + t:06.3f}" if t < 1 else f"00:00:{t - 1:06.3f}" for t in TIME]
    text = "Date,Clock,Disp (mm),Force (N)\n"
    text += rows("27/11/26,%s,%.6f,%.6f", cells, 1e3 * X, FORCE)
    run = iso.import_tests(written(tmp_path, text), current=2.0).campaign.runs[0]
    assert_is_the_test(run)


def test_times_rounded_to_seconds_are_refused(tmp_path):
    cells = [f"10:00:{int(t):02d}" for t in TIME]
    text = "Clock,Disp (mm),Force (N)\n" + rows("%s,%.6f,%.6f", cells, 1e3 * X, FORCE)
    message = refused(written(tmp_path, text))
    assert "--column time=none --rate 200" in message
    run = iso.import_tests(
        tmp_path / "test.csv", columns={"time": "none"}, rate=200.0, current=2.0
    ).campaign.runs[0]
    assert_is_the_test(run)


def test_several_sensors_of_a_quantity(tmp_path):
    text = "Time (s),LVDT 1 (mm),LVDT 2 (cm),Cell left (kN),Cell right (kN),Current (A)\n"
    text += rows("%.4f,%.6f,%.7f,%.6f,%.6f,%.2f", TIME, 1.2e3 * X, 0.8e2 * X, 0.3e-3 * FORCE,
                 0.7e-3 * FORCE, CURRENT)  # fmt: skip
    path = written(tmp_path, text)
    message = refused(path, columns={"force": 4})
    assert "'LVDT 1 (mm)', 'LVDT 2 (cm)'" in message and "whose mean is read" in message
    columns = {"displacement": ["LVDT 1", "LVDT 2"], "force": [4, 5]}
    imported = iso.import_tests(path, columns=columns)
    assert_is_the_test(imported.campaign.runs[0])
    assert "Cell right (kN)" in imported.summary()
    assert "different columns" in refused(path, columns={**columns, "force": [4, "Cell left"]})


@pytest.mark.parametrize(
    ("names", "options", "noted"),
    [
        (("4mm_0A", "4mm_2A"), {}, True),
        (("4mm_0A", "4mm_2A"), {"current_from_name": True}, False),
        (("4mm_0A", "4mm_2A"), {"columns": {"current": "none"}}, False),
        (("4mm_2A", "8mm_2A"), {}, False),
        (("4mm_2A", "8mm"), {}, False),
    ],
)
def test_currents_in_the_names_are_noted_if_no_column_has_them(tmp_path, names, options, noted):
    for name in names:
        (tmp_path / f"{name}.csv").write_text(HEADING + PLAIN)
    summary = iso.import_tests(tmp_path, **options).summary()
    assert ("--current-from-name reads them" in " ".join(summary.split())) == noted


def test_several_tables_of_a_file(tmp_path):
    table = "Data Acquisition: cycle %d\nTime,Disp,Force,Current\ns,mm,N,A\n"
    numbers = rows("%.4f,%.6f,%.6f,%.2f", TIME, 1e3 * X, FORCE, CURRENT)
    path = written(tmp_path, "Rig 4\n" + "".join(table % k + numbers for k in (1, 10, 100)))
    runs = iso.import_tests(path).campaign.runs
    assert [run.name for run in runs] == ["test_1", "test_2", "test_3"]
    for run in runs:
        assert_is_the_test(run)


def test_a_column_that_tells_the_tests_apart(tmp_path):
    numbers = rows("%.4f,%.6f,%.6f,%.2f", TIME, 1e3 * X, FORCE, CURRENT).splitlines()
    names = ["R2", "R10", ""]
    stacked = [f"{name},{line}" for name in names for line in numbers] + ["R4,0,0,0,0", ""]
    path = written(
        tmp_path, "Specimen,Time (s),Disp (mm),Force (N),Current (A)\n" + "\n".join(stacked)
    )
    assert "--test-column" in refused(path)
    assert "expected: one of 'Specimen', 'Time (s)'" in refused(path, test_column="specimens")
    imported = iso.import_tests(path, test_column="Specimen")
    assert [run.name for run in imported.campaign.runs] == ["test_R2", "test_R10"]
    assert "1 rows of test 'R4' left out" in " ".join(imported.notes)
    for run in imported.campaign.runs:
        assert_is_the_test(run)


def test_a_text_among_the_numbers(tmp_path):
    lines = rows("%.4f,%.6f,%.6f,%.2f", TIME, 1e3 * X, FORCE, CURRENT).splitlines(keepends=True)
    heading = "Time,Disp,Force,Current\ns,mm,N,A\n"
    path = written(tmp_path, heading + "".join([*lines[:150], "cycle 2\n", *lines[150:], "end"]))
    imported = iso.import_tests(path)
    assert_is_the_test(imported.campaign.runs[0])
    assert "line 153 among the numbers left out, 'cycle 2'" in imported.notes[0]
    assert "what stands below line 403 is left out" in imported.notes[0]
    few = [*lines[:150], "stopped\n", *lines[150:155], "resumed\n", *lines[155:]]
    imported = iso.import_tests(written(tmp_path, heading + "".join(few)))
    assert "lines 153 to 159 among the numbers left out, 'stopped'" in imported.notes[0]
    # the times begin again: another test
    runs = iso.import_tests(written(tmp_path, heading + "Test 2\n".join(["".join(lines)] * 2)))
    assert [run.name for run in runs.campaign.runs] == ["test_1", "test_2"]
    for run in runs.campaign.runs:
        assert_is_the_test(run)


def test_a_reader_of_ones_own(tmp_path, monkeypatch):
    import pandas

    from isolation_sim.identification.raw_tests.files import TEST_READERS

    monkeypatch.setattr(TEST_READERS, "_registered", {})

    def read_rig(path):
        values = np.fromfile(path).reshape(-1, 3)
        frame = pandas.DataFrame(values, columns=["Disp [mm]", "Force [N]", "Current [A]"])
        frame.attrs["rate_Hz"] = 200.0
        return {"first": frame, "second": frame}

    iso.register("test reader", read_rig, "rig")
    np.column_stack([1e3 * X, FORCE, CURRENT]).tofile(tmp_path / "a.rig")
    runs = iso.import_tests(tmp_path).campaign.runs
    assert [run.name for run in runs] == ["a_first", "a_second"]
    for run in runs:
        assert_is_the_test(run)
    (tmp_path / "b.rig").write_bytes(b"12345678")
    assert "test reader 'rig': given ValueError" in refused(tmp_path / "b.rig")


@pytest.mark.parametrize(
    ("heading", "unit", "quantities"),
    [
        ("Kraft in kN", "kN", ("force",)),
        ("velocity_mm_s", "mm_s", ("velocity",)),
        ("Current A", "A", ("current",)),
        ("Displacement A", "", ("displacement",)),
        ("Kstorage_N/mm", "N/mm", ()),
        ("F_N", "N", ("force",)),
        ("f [Hz]", "Hz", ()),
        ("T [°C]", "°C", ("temperature",)),
        ('Geschwindigkeit "mm/s"', "mm/s", ("velocity",)),
        ("Weg 'mm'", "mm", ("displacement",)),
        ('Sensor "left"', "", ()),
        ("Amps", "Amps", ()),
        ("A", "", ()),
        ("Force (mN)", "mN", ()),
        ("Force setpoint (N)", "N", ()),
        ("Temp [deg_C]", "deg_C", ("temperature",)),
        ("Load Cell Temp (deg C)", "deg C", ("temperature",)),
    ],
)
def test_headings(heading, unit, quantities):
    assert heading_of(heading)[1:3] == (unit, quantities)


@pytest.mark.parametrize("of_other", ["Vertical load", "Vertikallast", "Axialkraft", "Normalkraft"])
def test_a_force_along_another_axis_is_secondary(of_other):
    for name, secondary in ((of_other, True), ("Last", False), ("Prüfkraft", False)):
        heading = heading_of(f"{name} (kN)")
        assert heading.quantities == ("force",)
        assert heading.secondary == secondary


def test_a_unit_may_be_a_multiple(tmp_path):
    volts, turned = 6 * CURRENT, -FORCE / 1e3
    table = np.column_stack([TIME, 1e3 * X, turned, volts])
    text = "t_s,x_mm,F_kN,U_V\n" + "\n".join(",".join(f"{v:.9g}" for v in row) for row in table)
    path = written(tmp_path, text, "volts.csv")
    units = {"force": "-1 kN", "current": f"{1 / 6!r} A"}
    imported = iso.import_tests(path, columns={"current": "U_V"}, units=units)
    (run,) = imported.campaign.runs
    assert run.force == pytest.approx(FORCE, rel=1e-6)
    assert run.current == pytest.approx(CURRENT, rel=1e-6)
    assert any("force in -1 kN as given" in note for note in imported.notes)
    for wrong in ("0 kN", "2 V", "1e kN", "-kN"):
        message = refused(path, columns={"current": "none"}, units={"force": wrong})
        assert f"--unit force: given '{wrong}'; expected: N, kN" in message
        assert "or a multiple such as '-0.5 N'" in message


def test_choices_of_the_caller(tmp_path):
    path = written(tmp_path, "a,Load cell (V),b\n" + PLAIN, "2A_0p5mm.csv")
    columns = {"time": "a", "force": 3, "displacement": "Load cell"}
    units = {"force": "kN", "displacement": "mm"}
    imported = iso.import_tests(path, columns=columns, units=units, current_from_name=True)
    assert_is_the_test(imported.campaign.runs[0])
    assert any("displacement in mm as given, not in V" in note for note in imported.notes)
    assert "--unit force: given '3'; expected: N, kN" in refused(path, units={"force": 3})
    assert "unknown quantity of --column 'F'" in refused(path, columns={"F": "b"})
    without = {**columns, "time": "none"}
    imported = iso.import_tests(path, columns=without, units=units, rate=200.0, current=2.0)
    assert_is_the_test(imported.campaign.runs[0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (PLAIN, "none recognised as time and displacement and force; expected: --column time="),
        ("t,amp_mm,lossfactor\n" + PLAIN, "none recognised as force; expected: --column force="),
        ("Time (s),X disp (mm),Y disp (mm),F (kN)\n" + rows("%f,%f,%f,%f", *[TIME] * 4),
         "2 columns for the displacement, 'X disp (mm)', 'Y disp (mm)'; expected: one of them"),
        ("Time (s),Disp command (mm),F (kN)\n" + PLAIN, "none recognised as displacement"),
        ("Time (s),x (mm),Vert load (kN),Arm (kN)\n" + rows("%f,%f,%f,%f", *[TIME] * 4),
         "2 columns for the force, 'Vert load (kN)', 'Arm (kN)'; expected: one of them"),
        ("t,x_mm,F_kN\n" + rows("%.1f,%.6f,%.6f", 1e3 * TIME, X, X), "no unit, and steps of 5"),
        ("x (mm),F (kN)\n" + "Block 2\n".join([rows("%f,%f", X, X)] * 2),
         "from line 2, and again from line 403; expected: one table, a heading above each, or a"),
        (HEADING + PLAIN.replace("0.5000,0.000000", "0.5000,OVER"), "column Disp (mm): given 'OV"),
        (HEADING + rows("%.2f,%.6f,%.6f", TIME, X, X), "line 4: given the first of 199 times"),
        (HEADING + rows("%.4f,%.6f,%.6f", TIME % 1, X, X), "line 202: given a time of 0 s after"),
        ("only text\n", "no table; expected: 16 rows of numbers"),
    ],
)  # fmt: skip
def test_what_is_not_clear_is_refused(tmp_path, text, message):
    text = text.replace("0.5000,-0.000000", "0.5000,OVER")
    assert message in refused(written(tmp_path, text))


def test_rows_are_repaired_with_notes(tmp_path):
    lines = PLAIN.splitlines()
    lines[10] = lines[10].rpartition(",")[0] + ","
    lines[20] = lines[20].rpartition(",")[0] + ",NaN"
    lines[30] = lines[31]
    lines[-1] = lines[-1].rpartition(",")[0] + ","
    lines[60:80] = []
    imported = iso.import_tests(written(tmp_path, HEADING + "\n".join(lines)))
    (run,) = imported.campaign.runs
    assert run.time[0] == pytest.approx(0.4) and run.time[-1] == pytest.approx(TIME[-2])
    assert imported.notes[0] == (
        "test: 1 incomplete row at the ends left out; 1 row of a repeated time left out; "
        "2 samples are missing in the force, first at 0.05 s; interpolated; no samples from 0.295 "
        "to 0.4 s; used from 0.4 to 1.99 s"
    )
    np.testing.assert_allclose(run.force, np.interp(run.time, TIME, FORCE), rtol=1e-3, atol=1e-3)
    lines = [line.rpartition(",")[0] + "," if 30 <= k < 36 else line
             for k, line in enumerate(PLAIN.splitlines())]  # fmt: skip
    message = refused(written(tmp_path, HEADING + "\n".join(lines), "b.csv"))
    assert "b.csv, line 32, column Force (kN): given 6 samples in a row" in message


def test_numbers_above_and_text_below_are_noted(tmp_path):
    lines = PLAIN.splitlines()
    path = written(tmp_path, "\n".join([HEADING + lines[0], "stopped", *lines[1:], "end", "4"]))
    imported = iso.import_tests(path)
    assert imported.campaign.runs[0].time.size == N - 1
    assert imported.notes[0] == (
        "test: numbers above line 4 are left out; what stands below line 402 is left out"
    )


def test_uneven_times_are_resampled(tmp_path):
    time = TIME + np.random.default_rng(0).normal(0, 3e-4, N)
    x = 5e-3 * np.sin(2 * np.pi * time)
    path = written(tmp_path, HEADING + rows("%.6f,%.8f,%.8f", time, 1e3 * x, 100 * x))
    imported = iso.import_tests(path)
    (run,) = imported.campaign.runs
    assert run.step == pytest.approx(0.005, rel=1e-3)
    assert "resampled to 5" in imported.notes[0]
    np.testing.assert_allclose(
        run.displacement, 5e-3 * np.sin(2 * np.pi * run.time), atol=1e-6
    )  # fmt: skip


def test_wrong_units_are_noted(tmp_path):
    for k, (x, current) in enumerate([(1.0, 2.0), (1.0, 2.0), (1e-3, 2.0), (1.0, 2000.0)]):
        data = rows("%.4f,%.8f,%.6f,%.1f", TIME, 1e3 * x * X, FORCE + k, current * np.ones(N))
        written(tmp_path, "t [s],x [mm],F [N],I [A]\n" + data, f"T{k}.csv")
    notes = iso.import_tests(tmp_path).notes
    assert any(
        "T2: force over displacement is 1e+03 times that of the other runs" in note
        for note in notes
    )
    assert any("T3: current reaches 2e+03 A, in the other runs 2 A" in note for note in notes)


def test_tests_of_a_folder(tmp_path):
    for k in ("1", "2", "10", "1.5", "11"):
        written(tmp_path, HEADING + PLAIN, f"T{k}.csv")
    written(tmp_path, "notes of the operator\n", "notes.txt")
    (tmp_path / "photo.jpg").write_bytes(b"\xff")
    steps = []
    imported = iso.import_tests(
        str(tmp_path), hold_out=3, leave_out=["T11*"], progress=steps.append
    )
    assert steps[:2] == ["reading notes.txt", "reading T1.csv"] and steps[-1] == "checking T10"
    held = {run.name: run.hold_out for run in imported.campaign.runs}
    assert held == {"T1": False, "T1.5": False, "T2": True, "T10": False}
    assert [*held] == ["T1", "T1.5", "T2", "T10"]
    assert "notes.txt: no table of numbers; left out" in imported.notes
    assert "a pattern that fits a test" in refused(tmp_path, hold_out=["x*"])
    assert "a pattern that fits a test" in refused(tmp_path, leave_out=["x*"])
    assert "expected: 2 or more" in refused(tmp_path, hold_out=1)
    assert "expected: test files (.asc, .csv" in refused(tmp_path / "photo.jpg")
    current = "Time (s),Disp (mm),Force (kN),I (A)\n" + rows("%.4f,%.6f,%.6f,1", TIME, X, X)
    written(tmp_path, current, "T12.csv")
    assert "none recognised as the current, which 'T12' has" in refused(tmp_path)


@pytest.mark.parametrize(
    ("line", "rate"),
    [
        ("Sampling rate: 200 Hz", 200.0),
        ("Abtastrate [kHz];0,2", 200.0),
        ("NPTS= 400, DT= .0050 SEC", 200.0),
        ("Delta_X\t5.000E-3", 200.0),
        ("sampling interval 5 ms", 200.0),
        ("fs=200; sampling rate 200.0", 200.0),
        ("Sampling: 200 S/s", 200.0),
        ("Recorded at 0.2 kS/s, displacement rate 5 mm/s", 200.0),
        ("Data acquisition rate 200 Hz", 200.0),
        ("low-pass filter: 200 Hz", None),
        ("sampling rate 100 Hz, dt 0.005 s", None),
    ],
)
def test_sampling_rate_of_a_header(line, rate):
    assert rate_in([line]) == rate


def test_the_rate_of_the_file_stands_for_a_column_of_time(tmp_path):
    data = rows("%.6f,%.6f", 1e3 * X, FORCE / 1e3)
    path = written(tmp_path, "Rig 3, sampling rate 200 Hz\nDisp (mm),Force (kN)\n" + data)
    imported = iso.import_tests(path, current=2.0)
    assert_is_the_test(imported.campaign.runs[0])
    assert "test: 200 samples per second, as the file says" in imported.notes
    assert iso.import_tests(path, rate=100.0).campaign.runs[0].step == pytest.approx(0.01)


@pytest.mark.parametrize("beside", [{"fs": 200.0}, {"dt": 0.005}, {"t": TIME}])
def test_a_matrix_with_its_names_units_and_time_beside_it(tmp_path, beside):
    from scipy.io import savemat

    names, units = np.array([["disp", "load"], ["mm", "kN"]], object)
    matrix = np.column_stack([1e3 * X, FORCE / 1e3])
    savemat(tmp_path / "a.mat", {"units": units, "names": names, "data": matrix, **beside})
    imported = iso.import_tests(tmp_path, current=2.0)
    assert_is_the_test(imported.campaign.runs[0])


def test_a_file_with_a_turned_sign_is_named_with_its_columns_and_turned(tmp_path):
    for name, sign in (("a", 1), ("b", -1), ("c", 1)):
        written(tmp_path, HEADING + rows("%.4f,%.6f,%.6f", TIME, 1e3 * X, sign * FORCE / 1e3),
                f"{name}.csv")  # fmt: skip
    (note,) = (n for n in iso.import_tests(tmp_path).notes if "turned" in n)
    assert note == (
        f"{tmp_path / 'b.csv'}: the stiffness is negative, and that of the other tests is not; "
        "the sign of 'Force (kN)' or of 'Disp (mm)' is turned: --unit 'b:force=-1 kN' or --unit "
        "'b:displacement=-1 mm' turns it"
    )
    right = iso.import_tests(tmp_path, units={"b:force": "-1 kN", "force": "kN"})
    np.testing.assert_allclose(right.campaign.runs[1].force, FORCE, atol=1e-3)
    assert not any("turned" in each for each in right.notes)
    message = refused(tmp_path, units={"d*:force": "-1 kN"})
    assert message.startswith("--unit: given 'd*'; expected: ")
    # all of them
    damped = rows("%.4f,%.6f,%.6f", TIME, 1e3 * X, -np.cos(2 * np.pi * TIME))
    (note,) = (n for n in iso.import_tests(written(tmp_path, HEADING + damped)).notes if "tur" in n)
    assert "the loops run the wrong way round" in note
    assert note.endswith("--unit 'force=-1 kN' or --unit 'displacement=-1 mm' turns it")


def test_a_column_is_chosen_for_some_tests(tmp_path):
    """Machines of one folder call their sensors differently."""
    each = rows("%.4f,%.6f,%.6f,%.6f", TIME, 1e3 * X, FORCE / 1e3, -FORCE / 1e3)
    for name, first, second in (("one_a", "Force", "Force 2"), ("two_a", "Cell", "Other")):
        heading = f"Time (s),Disp (mm),{first} (kN),{second} (kN)\n"
        written(tmp_path, heading + each, f"{name}.csv")
    chosen = {"two_*:force": "Cell", "force": "Force"}
    for run in iso.import_tests(tmp_path, columns=chosen).campaign.runs:
        np.testing.assert_allclose(run.force, FORCE, atol=1e-3)
    message = refused(tmp_path, columns={"force": "Force"})
    assert "two_a.csv, --column force: given 'Force'; expected: one of" in message
    assert message.endswith("--column 'PATTERN:QUANTITY=HEADING' for some tests")
    message = refused(tmp_path, columns=chosen | {"three_*:force": "Cell"})
    assert message.startswith("--column: given 'three_*'; expected: ")
    assert "quantity of --column" in refused(tmp_path, columns={"two_*:forces": "Cell"})


@pytest.mark.parametrize(
    "options", [{"units": {"velocity": "mm/s"}}, {"columns": {"velocity": "none"}}]
)
def test_a_velocity_in_another_unit_is_refused_with_what_helps(tmp_path, options):
    velocity = 5.0 * 2 * np.pi * np.cos(2 * np.pi * TIME)
    text = "time [s],displacement [mm],force [N],velocity [m/s]\n"
    text += rows("%.4f,%.6f,%.3f,%.5f", TIME, 1e3 * X, FORCE, velocity)
    (tmp_path / "run.csv").write_text(text)
    said = "velocity=UNIT for another one, or --column velocity=none"
    with pytest.raises(iso.InputError, match=f"column velocity .*{said}"):
        iso.import_tests(tmp_path / "run.csv")
    (run,) = iso.import_tests(tmp_path / "run.csv", **options).campaign.runs
    inner = slice(50, -50)
    np.testing.assert_allclose(run.velocity[inner], velocity[inner] / 1e3, atol=1e-3)


def test_a_heading_with_more_names_than_columns_is_told(tmp_path):
    text = "rig 3\ntime [s],displacement [mm],force [N],current [A],remark\n"
    text += rows("%.4f,%.6f,%.3f,%.1f", TIME, 1e3 * X, FORCE, CURRENT)
    (tmp_path / "run.csv").write_text(text)
    with pytest.raises(
        iso.InputError, match="line 2 has 5 names for 4 columns of numbers; expected"
    ):
        iso.import_tests(tmp_path / "run.csv")


def test_all_tests_that_cannot_be_read_are_named_together(tmp_path):
    """And a note that many tests share stands once."""
    for name in ("a", "b", "c"):
        written(tmp_path, HEADING + PLAIN, f"{name}.csv")
    volts = iso.import_tests(tmp_path, units={"force": "-1 kN"}).notes
    assert sum("force in -1 kN as given" in note for note in volts) == 1
    (tmp_path / "empty.csv").write_text("")
    written(tmp_path, (HEADING + PLAIN).replace("Force (kN)", "Volume (l)"), "d.csv")
    with pytest.raises(iso.InputError) as refused:
        iso.import_tests(tmp_path)
    text = str(refused.value)
    assert text.startswith("2 of 5 tests cannot be read: ") and "--leave-out" in text
    assert "empty.csv: given an empty file" in text and "none recognised as force" in text
    with pytest.raises(iso.InputError, match=r"^\S+empty.csv: given an empty file"):
        iso.import_tests(tmp_path / "empty.csv")
