import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ground_motions import (
    STANDARD_GRAVITY,
    el_centro_1940,
    read,
    read_folder,
    read_text,
    write_csv,
)  # fmt: skip


@pytest.fixture
def text(tmp_path):
    def write(content, name="motion.txt"):
        path = tmp_path / name
        path.write_text(content)
        return path

    return write


def test_one_column(text):
    record = read_text(text("# note\n1\n\n% note\n-2e0\n3\n"), unit="gal", dt=0.02)
    np.testing.assert_allclose(record.acceleration, [0.01, -0.02, 0.03], rtol=1e-15)
    assert (record.dt, record.name, record.file_unit) == (0.02, "motion", "gal")


@pytest.mark.parametrize("content", ["1 2 -3\n0 5 6\n-7\n", "h (g)\n1\n2\n-3\n0\n5\n6\n-7\n",
                                     "1 2 -3 0 5 6 -7", "1 2\n-3 0\n5 6\n-7\n"])  # fmt: skip
def test_accelerations_that_go_on_from_line_to_line(text, content):
    record = read(text(content, "motion.acc"), unit="m/s2", dt=0.01)
    assert record.acceleration.tolist() == [1, 2, -3, 0, 5, 6, -7]


@pytest.mark.parametrize("content", ["3 0.005\n1\n2\n-3\n", "title\n 3 0.005\n1 2\n-3\n",
                                     "3  0.005\n0.005 1\n0.01 2\n0.015 -3\n"])  # fmt: skip
def test_a_first_line_with_the_number_of_samples_and_the_step(text, refused, content):
    path = text(content, "motion.txt")
    record = read(path, unit="m/s2")
    assert (record.acceleration.tolist(), record.dt) == ([1, 2, -3], 0.005)
    if "0.015" not in content:
        assert read(path, unit="m/s2", dt=0.005).dt == 0.005
        with refused(f"{path}, dt", "0.01 beside 0.005 in the first line"):
            read(path, unit="m/s2", dt=0.01)


@pytest.mark.parametrize("delimiter", [" ", "\t", ", ", ";", "   "])
def test_two_columns(text, delimiter):
    path = text("".join(f"{time}{delimiter}{a}\n" for time, a in ((0.1, 1), (0.15, 2), (0.2, 3))))
    record = read_text(path, unit="G")
    np.testing.assert_allclose(record.acceleration, np.array([1, 2, 3]) * STANDARD_GRAVITY)
    assert record.dt == 0.05
    assert record.file_unit == "g"


def test_a_column_of_several_beside_times(text, refused, tmp_path):
    """As the files of Taiwan's agency, whose data are time, up, north and east, in gal."""
    rows = "".join(f"{0.02 * k:10.3f}{k:10.3f}{-2 * k:10.3f}{3 * k:10.3f}\n" for k in range(3))
    path = text("#SampleRate(Hz): 50\n#DataSequence: Time U(+); N(+); E(+)\n" + rows, "1-EAS.dat")
    north = read(path, unit="gal", column="3")
    np.testing.assert_allclose(north.acceleration, [0.0, -0.02, -0.04])
    assert (north.dt, north.name) == (0.02, "1-EAS_3")
    with refused(f"{path}, dt", "4 columns and no dt", 'column="2" of several'):
        read(path, unit="gal")
    with refused(f"{path}, column", "'5'", "2 to 4"):
        read(path, unit="gal", column="5")
    alone = text("1 2 3\n-4 5 6\n7 8 9\n", "alone.acc")
    assert read(alone, unit="m/s2", dt=0.02, column="2").acceleration.tolist() == [2, 5, 8]
    alone.unlink()
    (record,) = read_folder(tmp_path, unit="gal", column=["3", "4", "2"])
    assert [each.name for each in (*record.components, record.vertical)] == [
        "1-EAS_3", "1-EAS_4", "1-EAS_2",
    ]  # fmt: skip


@pytest.mark.parametrize("delimiter", ["\t", ";", " ", "   "])
def test_decimal_commas(text, delimiter):
    rows = (("0,00", "1"), ("0,05", "-2,5"), ("0,10", "3,25"))
    path = text("t (s)\tacc\n" + "".join(f"{t}{delimiter}{a}\n" for t, a in rows))
    record = read_text(path, unit="m/s2")
    assert (record.acceleration.tolist(), record.dt) == ([1.0, -2.5, 3.25], 0.05)


@pytest.mark.parametrize(
    ("unit", "factor", "name"),
    [("ft/s2", 0.3048, "ft/s2"), ("IN/SEC^2", 0.0254, "in/s2"), ("cm/s²", 0.01, "cm/s2")],
)
def test_units_as_they_are_written(text, unit, factor, name):
    record = read_text(text("1\n2\n"), unit=unit, dt=0.1)
    assert record.acceleration.tolist() == pytest.approx([factor, 2 * factor])
    assert record.file_unit == name


def test_header_lines_are_passed_over(text):
    content = "9 stations\nacc in g\n1\n2\n"
    record = read_text(text(content), unit="m/s2", dt=1.0, skip_lines=2)
    assert record.acceleration.tolist() == [1.0, 2.0]


@pytest.mark.parametrize("header", ["Time(s)  Acc(g)\n", "Station 9\n\ntime, acc\n", '"t";"a"\n'])
def test_lines_above_the_first_number_are_a_header(text, header):
    record = read(text(header + "0.00 0.1\n0.02 -0.2\n0.04 0\n"), unit="m/s2")
    assert (record.acceleration.tolist(), record.dt) == ([0.1, -0.2, 0.0], 0.02)


@given(values=st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=40), dt=st.floats(1e-3, 1.0))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_written_numbers_are_read_back(text, values, dt):
    path = text("\n".join(map(repr, values)))
    record = read_text(path, unit="m/s2", dt=dt)
    assert record.acceleration.tolist() == values
    assert record.dt == dt
    two = text("\n".join(f"{i * dt!r} {value!r}" for i, value in enumerate(values)))
    record = read_text(two, unit="m/s2")
    assert record.acceleration.tolist() == values
    assert record.dt == pytest.approx(dt, rel=1e-11)


@pytest.mark.parametrize(
    ("content", "options", "parts"),
    [
        ("1\n2\n", {"unit": "yd/s2", "dt": 1}, ("unit", "'yd/s2'", "expected: m/s2, g", "gal")),
        ("1\n2\n", {"unit": "cm/s", "dt": 1}, ("unit", "'cm/s'", "did you mean 'cm/s2'?")),
        ("1\n2\n", {"unit": "g"}, ("dt", "one column and no dt", "the step in s")),
        ("1\n2\n", {"unit": "g", "dt": -1}, ("dt (s)", "-1", "above 0")),
        ("0 1\n1 2\n", {"unit": "g", "dt": 1}, ("dt", "1 beside a column", "without times")),
        ("1 2 3\n", {"unit": "g"}, ("dt", "3 columns and no dt", "without times: dt=", "dt_s in")),
        ("0 1 2\n1 2 3\n2 0\n", {"unit": "g", "dt": 1}, ("dt", "beside a column of times")),
        ("3 1\n1 2 3\n", {"unit": "g", "dt": 1}, ("line 2", "3 columns", "2, as above; fewer in")),
        ("0 1\n1\n", {"unit": "g"}, ("line 2", "1 column;", "2, as above")),
        ("0 1\n1 b\n", {"unit": "g"}, ("line 2, column 2", "'b'", "a finite number")),
        ("1\n# c\nnan\n", {"unit": "g", "dt": 1}, ("line 3, column 1", "'nan'", "finite")),
        ("t a\n0 1\nt a\n", {"unit": "g"}, ("line 3, column 1", "'t'", "finite number")),
        ("t a\n0 1\n1 b\n", {"unit": "g"}, ("line 3, column 2", "'b'", "finite number")),
        ("time acc\n", {"unit": "g"}, ("0 samples", "two samples")),
        ("1 1\n0 1\n", {"unit": "g"}, ("column 1, line 2", "0 after 1", "increase")),
        ("0 1\n1 1\n3 1\n4 1\n", {"unit": "g"}, ("column 1, line 3", "2 s where 1 s", "uniform")),
        ("1\n", {"unit": "g", "dt": 1}, ("1 samples", "two samples")),
        ("# c\n", {"unit": "g", "dt": 1}, ("0 samples", "two samples")),
        ("", {"unit": "g", "dt": 1}, ("an empty file", "UTF-8")),
    ],
)
def test_bad_text_is_refused(text, refused, content, options, parts):
    path = text(content)
    with refused(path, *parts):
        read_text(path, **options)


def test_latin_1_in_the_lines_above_the_numbers(tmp_path):
    path = tmp_path / "rock.txt"
    path.write_bytes("Estación El Peñón\n% Túnel\n1\n2\n".encode("latin-1"))
    assert read_text(path, "g", 0.1, skip_lines=1).dt == 0.1


def test_read_goes_by_suffix(text, tmp_path):
    record = el_centro_1940()
    path = write_csv(record, tmp_path / "a.CSV")
    assert np.array_equal(read(path).acceleration, record.acceleration)
    chosen = read(path, column="ground_acceleration_m_s2")
    assert np.array_equal(chosen.acceleration, record.acceleration)
    for name in ("a.txt", "a.dat"):
        assert read(text("1\n2\n", name), unit="m/s2", dt=0.5).acceleration.tolist() == [1.0, 2.0]
    at2 = text("T\nE\nUNITS OF G\nNPTS= 2, DT= .5 SEC\n1 2\n", "a.at2")
    assert read(str(at2)).pga == 2 * STANDARD_GRAVITY


def test_a_reader_that_returns_no_record_is_refused(text, tmp_path, refused):
    text("import numpy\n\n\ndef read(path):\n    return numpy.zeros(9)\n", "own.py")
    reader = f"{tmp_path / 'own.py'}:read"
    with refused("own.py:read", "a ndarray of", "motion.txt", "a Record"):
        read(text("1\n2\n"), reader=reader)


def test_an_error_in_a_reader_names_the_reader(text, tmp_path, refused):
    text("import numpy\n\n\ndef read(path):\n    return numpy.loadtxt(path)\n", "own.py")
    reader = f"{tmp_path / 'own.py'}:read"
    with refused("own.py:read", "ValueError: could not convert", "a Record of", "motion.txt"):
        read(text("1\ntwo\n"), reader=reader)


@pytest.mark.parametrize(
    ("name", "options", "parts"),
    [
        ("a.xlsx", {}, ("suffix '.xlsx'", ".at2, .csv, .dat, .ew,", "reader of your own")),
        ("a", {}, ("suffix ''", ".at2, .csv, .dat, .ew,")),
        ("a.vt2", {}, ("a .vt2 file", "units of g")),
        ("a.csv", {"dt": 0.1}, ("option dt", "0.1", "for .csv files: column, unit")),
        ("a.at2", {"dt": 0.1}, ("option dt", "0.1", "for .at2 files: no options")),
        ("a.at2", {"column": "x"}, ("option column", "'x'", "for .at2 files: no options")),
        ("a.txt", {}, ("option unit", "nothing", "unit='g'")),
    ],
)
def test_bad_calls_are_refused(text, refused, name, options, parts):
    path = text("1\n2\n", name)
    with refused(path, *parts):
        read(path, **options)
