import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ground_motions import (
    ACCELERATION_UNITS,
    STANDARD_GRAVITY,
    InputError,
    Record,
    el_centro_1940,
    read_csv,
    write_csv,
)

BENCHMARK = ("elcentro", "erzikan", "jiji", "kobe", "newhall", "rinaldi", "sylmar")


@pytest.fixture
def csv(tmp_path):
    def write(text):
        path = tmp_path / "motion.csv"
        path.write_text(text, encoding="utf-8", newline="")
        return path

    return write


@given(
    values=st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=60),
    dt=st.floats(1e-4, 1.0),
    digits=st.sampled_from([None, 9]),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_what_is_written_is_read_back(tmp_path, values, dt, digits):
    path = tmp_path / "round_trip.csv"
    record = Record(values, dt if digits is None else round(dt, digits))
    assert write_csv(record, path) == path
    back = read_csv(path)
    assert back.acceleration.tolist() == values
    assert back.dt == pytest.approx(record.dt, rel=1e-11)
    assert back.name == "round_trip"
    assert [file.name for file in tmp_path.iterdir()] == ["round_trip.csv"]


def test_a_written_file_says_what_it_holds(tmp_path):
    lines = write_csv(el_centro_1940(), tmp_path / "a.csv").read_text().splitlines()
    assert lines[0] == "# el_centro_1940_ns"
    assert "version of Chopra" in lines[1]
    assert lines[2] == "time_s,ground_acceleration_m_s2"
    assert all(len(line.partition(",")[0]) <= 5 for line in lines[3:])


def test_a_file_that_cannot_be_written(tmp_path, refused):
    path = tmp_path / "missing" / "a.csv"
    with refused(path, "cannot be written", "a writable place"):
        write_csv(el_centro_1940(), path)


@pytest.mark.parametrize(
    ("suffix", "factor", "unit"),
    [
        ("m_s2", 1.0, "m/s2"),
        ("cm_s2", 0.01, "cm/s2"),
        ("mm_s2", 0.001, "mm/s2"),
        ("gal", 0.01, "gal"),
        ("Gal", 0.01, "gal"),
        ("g", STANDARD_GRAVITY, "g"),
    ],
)
def test_units_are_converted(csv, suffix, factor, unit):
    record = read_csv(csv(f"time_s,ground_acceleration_{suffix}\n0,1\n0.01,-2\n"))
    np.testing.assert_allclose(record.acceleration, [factor, -2 * factor], rtol=1e-15)
    assert (record.file_unit, record.dt, record.name) == (unit, 0.01, "motion")


@pytest.mark.parametrize(
    ("heading", "unit"),
    [
        ("Time[s],Acc[cm/s2]", "cm/s2"),
        ("Zeit [s];Beschleunigung [m/s²]", "m/s2"),
        ("Time (sec)\tAcceleration (g)", "g"),
        ("time_s,acc_ft_s2", "ft/s2"),
        ("time_s,acc [in/s^2]", "in/s2"),
    ],
)
def test_usual_headings(csv, heading, unit):
    separator = next(each for each in ";\t," if each in heading)
    record = read_csv(csv(f"{heading}\n0{separator}1\n1{separator}-2\n"))
    np.testing.assert_allclose(record.acceleration, np.array([1, -2]) * ACCELERATION_UNITS[unit])
    assert (record.file_unit, record.name, record.dt) == (unit, "motion", 1.0)


def test_the_unit_of_a_column_without_one(csv, refused):
    path = csv("time,ns,ew\n0,1,2\n0.5,3,4\n")
    assert read_csv(path, "ew", "gal").acceleration.tolist() == [0.02, 0.04]
    with refused("2 acceleration columns", "column= one of ns, ew"):
        read_csv(path, unit="gal")
    with refused("unit", "'yd/s2'"):
        read_csv(path, "ew", "yd/s2")
    path = csv("time_s,ns_g\n0,1\n0.5,3\n")
    assert read_csv(path, unit="G").file_unit == "g"
    with refused("line 1", "unit 'gal' for column 'ns_g'", "g, as in its name"):
        read_csv(path, unit="gal")


@pytest.mark.parametrize("name", ["Vel (cm/s)", "Vel [cm/sec]", "disp_cm", "v_m_s", "F [kN]"])
def test_a_unit_makes_no_acceleration_of_another_quantity(csv, refused, name):
    path = csv(f"time_s,{name}\n0,1\n0.5,3\n")
    with refused(path, "an acceleration column"):
        read_csv(path, unit="g")
    with refused(path, f"column {name!r}"):
        read_csv(path, name, "g")
    assert read_csv(csv(f"time_s,{name},ns\n0,1,2\n0.5,3,4\n"), unit="gal").pga == 0.04


def test_comments_blank_lines_quotes_and_line_ends(csv):
    record = read_csv(
        csv('\ufeff# a note\r\n"time_s", "x_g" \r\n\r\n0, 1\r\n# between\r\n0.5 ,2\r\n\r\n')
    )
    np.testing.assert_allclose(record.acceleration / STANDARD_GRAVITY, [1, 2], rtol=1e-15)
    assert record.dt == 0.5


SEVERAL = "time_s,x_m_s2,y_g,displacement_m\n0,1,2,3\n1,4,5,6\n"


def test_a_column_is_chosen_by_name(csv):
    record = read_csv(csv(SEVERAL), column="y_g")
    np.testing.assert_allclose(record.acceleration / STANDARD_GRAVITY, [2, 5], rtol=1e-15)
    assert record.name == "motion_y"
    assert record.source.endswith("motion.csv, column y_g")


def test_the_ground_is_meant_where_there_are_floors_too(csv):
    path = csv("time_s,floor1_acceleration_m_s2,ground_acceleration_m_s2\n0,1,2\n1,4,5\n")
    assert read_csv(path).acceleration.tolist() == [2.0, 5.0]


def test_times_printed_short_still_give_the_step(csv):
    rows = "".join(f"{i / 256:.4f},0\n" for i in range(2049))
    assert read_csv(csv("time_s,x_g\n" + rows)).dt == pytest.approx(1 / 256, rel=1e-5)


def test_times_may_start_anywhere(csv):
    assert read_csv(csv("time_s,x_g\n-3.5,0\n-3.25,1\n-3.0,2\n")).dt == 0.25


@pytest.mark.parametrize(
    ("text", "column", "parts"),
    [
        ("", None, ("an empty file", "UTF-8 text")),
        (" \n\n", None, ("an empty file", "UTF-8 text")),
        ("# only\n", None, ("comments only", "column names")),
        ("t,x_g\n0,1\n1,2\n", None, ("line 1", "'t, x_g'", "'Time [s],Acceleration [cm/s2]'")),
        ("time_s|x_g\n0|1\n", None, ("line 1", "'time_s|x_g'", "time_s")),
        ("0.0,0.0\n0.1,0.2\n", None, ("line 1", "numbers", "a heading such as 'time_s,")),
        ("time_s,x_g,x_g\n0,1,2\n", None, ("line 1", "'x_g' twice", "different")),
        ("time_s,x_m\n0,1\n1,2\n", None, ("line 1", "'time_s, x_m'", "_m_s2", "_gal")),
        (SEVERAL, None, ("line 1", "2 acceleration columns", "x_m_s2, y_g")),
        (SEVERAL, "x_m_s", ("line 1", "'x_m_s'", "did you mean 'x_m_s2'? expected: x_m_s2, y_g")),
        (SEVERAL, "displacement_m", ("line 1", "'displacement_m'", "ends in a unit")),
        (SEVERAL, "time_s", ("line 1", "'time_s'", "ends in a unit")),
        ("time_s,x_g\n0,1\n", None, ("1 samples", "two samples or more")),
        ("time_s,x_g\n", None, ("0 samples", "two samples or more")),
        ("time_s,x_g\n0,1\n1\n", None, ("line 3", "1 cell;", "2, as in the header")),
        ("time_s,x_g\n0,1\n1,2,3\n", None, ("line 3", "3 cells", "2, as in the header")),
        ("time_s,x_g\n0,1\n1,abc\n", None, ("line 3, column x_g", "'abc'", "a finite number")),
        ("time_s,x_g\n0,1\n1,\n", None, ("line 3, column x_g", "''", "a finite number")),
        ("# c\ntime_s,x_g\n0,1\n1,nan\n", None, ("line 4, column x_g", "'nan'", "finite")),
        ("time_s,x_g\n0,1\n1,-inf\n", None, ("line 3, column x_g", "'-inf'", "finite")),
        ("time_s,x_g\n0,1\nnoon,2\n", None, ("line 3, column time_s", "'noon'", "finite")),
        ("time_s,x_g\n0,1\n1,2\n1,3\n", None, ("time_s, line 4", "1 after 1", "increase")),
        ("time_s,x_g\n0,1\n1,2\n.5,3\n", None, ("time_s, line 4", "0.5 after 1", "increase")),
        (
            "time_s,x_g\n0,1\n1,2\n2,3\n# lost\n4,4\n5,5\n",
            None,
            ("time_s, line 6", "a step of 2 s where 1 s is usual", "uniform"),
        ),
        ("time_s,x_g\n0,1\n1," + "9" * 200 + "x\n", None, ("line 3", "999...'", "finite")),
    ],
)
def test_bad_files_are_refused(csv, refused, text, column, parts):
    path = csv(text)
    with refused(path, *parts):
        read_csv(path, column)


@given(lost=st.integers(1, 58))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_a_lost_row_is_detected_and_named(tmp_path, refused, lost):
    path = tmp_path / "lost.csv"
    rows = [f"{0.02 * i:.2f},1" for i in range(60) if i != lost]
    path.write_text("\n".join(["time_s,x_g", *rows]))
    with refused(path, f"line {lost + 2}", "a step of 0.04 s", "uniform"):
        read_csv(path)


def test_a_missing_file(tmp_path):
    with pytest.raises(InputError, match=r"no\.csv: no such file$"):
        read_csv(tmp_path / "no.csv")


def test_a_folder(tmp_path, refused):
    with refused(tmp_path, "unreadable", "UTF-8 text"):
        read_csv(tmp_path)


@pytest.mark.parametrize(
    ("content", "parts"),
    [
        (b"time_s,x_g\n0,\xff\xfe\n1,0\n", ("line 2, column x_g", "a finite number")),
        (b"time_s,x_g\n\0\0\0\0", ("byte 11", "binary", "UTF-8")),
    ],
)
def test_binary_files(tmp_path, refused, content, parts):
    path = tmp_path / "binary.csv"
    path.write_bytes(content)
    with refused(path, *parts):
        read_csv(path)


def test_latin_1_in_a_comment(tmp_path):
    path = tmp_path / "tunnel.csv"
    path.write_bytes("# Túnel de Güejar\ntime_s,x_g\n0,0\n0.1,1\n".encode("latin-1"))
    assert read_csv(path).dt == 0.1


@pytest.mark.parametrize("name", BENCHMARK)
def test_benchmark_records(shared_data, name):
    path = shared_data / "benchmark_8_storey" / f"{name}.csv"
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    for i, direction in enumerate(("fault_normal", "fault_parallel"), start=1):
        record = read_csv(path, column=f"{direction}_m_s2")
        assert record.dt == 0.005
        assert record.name == f"{name}_{direction}"
        assert np.array_equal(record.acceleration, table[:, i])


@pytest.mark.parametrize(("name", "pga"), [("CNP100", 2.055), ("ICA50", 1.645), ("ICA100", 3.017)])
def test_shake_table_records(shared_data, name, pga):
    record = read_csv(shared_data / "bncs" / f"{name}.csv")
    assert record.dt == 0.005
    assert record.pga == pytest.approx(pga, abs=5e-4)
    assert math.isclose(record.time[-1], record.duration, rel_tol=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "Time,Acceleration\ns,g\n0,1\n0.5,-2\n",
        "\ufeffZeit;Beschleunigung\r\n[s];[g]\r\n0,0;1,0\r\n0,5;-2,0\r\n",
        "sep=;\nTime (s);Acc (g)\n0;1\n0.5;-2\n",
        "Station: ABC\nEvent: 2020, M 6.1\n\nTime (s),Acc (g)\n0,1\n0.5,-2\n",
        "Station;ABC\nDuration [s];0.5\nTime;Acc\nms;g\n0;1\n500;-2\n",
        "time_ms,acc_g\n0,1\n500,-2\n",
        "Time [msec],acc_g\n0,1\n500,-2\n",
        "time_s,acc_g,,\n0,1,,\n0.5,-2,,\n,,,\n",
        "time_s,acc_g\n0,1,\n0.5,-2,\n,,\n",
    ],
)
def test_tables_as_spreadsheets_and_loggers_write_them(csv, text):
    record = read_csv(csv(text))
    np.testing.assert_allclose(record.acceleration / STANDARD_GRAVITY, [1, -2], rtol=1e-15)
    assert (record.dt, record.file_unit) == (0.5, "g")


def test_two_decimal_marks_in_a_column_are_refused(csv, refused):
    """A point below decimal commas may separate thousands."""
    with refused("line 3, column 2", "'1.234' below decimal commas", "one decimal mark"):
        read_csv(csv("t [s];a [mm/s2]\n0,0;987,125\n0,5;1.234\n"))
    # of another column, the mark may be another
    read_csv(csv("t [s];a [mm/s2]\n0.0;987,125\n0.5;1,234\n"))


def test_lines_are_counted_from_the_top_of_the_file(csv, refused):
    with refused("line 6, column Acc [g]", "'x'", "a finite number"):
        read_csv(csv("a station\n\nTime,Acc\ns,g\n0,1\n0.5,x\n"))
