import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ground_motions import STANDARD_GRAVITY, InputError, read_at2

TITLE = "PEER NGA STRONG MOTION DATABASE RECORD"
EVENT = "Made-up Valley-02, 1/2/1903, Nowhere Array #9, 180"
UNITS = "ACCELERATION TIME SERIES IN UNITS OF G"
NEW = "NPTS=   {npts}, DT=   {dt} SEC,"
OLD_UNITS = "ACCELERATION TIME HISTORY IN UNITS OF G. FILTER POINTS: HP=0.2 Hz LP=15.0 Hz"
OLD_1990S = "   {npts}    {dt}    NPTS, DT"
HEADERS = {
    "nga_west2": (UNITS, NEW),
    "without_comma": (UNITS, "NPTS=   {npts}, DT=   {dt} SEC"),
    "peer_2000": (OLD_UNITS, "NPTS=  {npts}, DT= {dt} SEC"),
    "peer_1990s": (OLD_UNITS, OLD_1990S),
}


@pytest.fixture
def at2(tmp_path):
    def write(
        body="1 2\n3 4",
        *,
        units=UNITS,
        points=NEW,
        npts=None,
        dt=".0100",
        name="RSN1_MADE.AT2",
        end="\n",
    ):
        npts = len(body.split()) if npts is None else npts
        path = tmp_path / name
        header = [TITLE, EVENT, units, points.format(npts=npts, dt=dt)]
        path.write_bytes(end.join([*header, *body.split("\n"), ""]).encode())
        return path

    return write


@pytest.mark.parametrize("units_and_points", HEADERS.values(), ids=HEADERS)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_headers_of_every_age(at2, units_and_points, end):
    units, points = units_and_points
    body = "  -.8338791E-03   .8376303E-03  1.0000000E+00\n   .5000000E+00"
    record = read_at2(at2(body, units=units, points=points, end=end))
    expected = np.array([-0.8338791e-3, 0.8376303e-3, 1.0, 0.5]) * STANDARD_GRAVITY
    np.testing.assert_allclose(record.acceleration, expected, rtol=1e-15)
    assert record.dt == 0.01
    assert record.name == "RSN1_MADE"
    assert record.file_unit == "g"
    assert record.source.endswith(f"RSN1_MADE.AT2, {EVENT}")


@given(
    values=st.lists(st.integers(-50_000_000, 50_000_000).map(lambda i: i * 1e-7), min_size=2),
    dt=st.sampled_from([".0050", ".01000", "0.02", "1.0E-2"]),
    columns=st.integers(1, 8),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_written_numbers_are_read_back(at2, values, dt, columns):
    cells = [f"{value:15.7E}" for value in values]
    body = "\n".join("".join(cells[i : i + columns]) for i in range(0, len(cells), columns))
    record = read_at2(at2(body, dt=dt))
    np.testing.assert_allclose(
        record.acceleration / STANDARD_GRAVITY, values, rtol=1e-7, atol=1e-300
    )
    assert record.dt == float(dt)


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        ({"name": "a.VT2"}, ("a .VT2 file", "(AT2) in units of g")),
        ({"name": "a.dt2"}, ("a .dt2 file", "(AT2) in units of g")),
        (
            {"units": "VELOCITY TIME SERIES IN UNITS OF CM/S"},
            ("line 3", "a velocity time series", "AT2"),
        ),
        (
            {"units": "DISPLACEMENT TIME HISTORY IN UNITS OF CM"},
            ("line 3", "a displacement time series", "AT2"),
        ),
        ({"units": "ACCELERATION"}, ("lines 1 to 4", "no units", "UNITS OF G")),
        ({"npts": 5}, ("line 4", "NPTS 5 over 4 samples", "equal numbers")),
        ({"npts": 3}, ("line 4", "NPTS 3 over 4 samples", "equal numbers")),
        ({"npts": "many"}, ("line 4", "NPTS 'many'", "a whole number")),
        ({"dt": "UNKNOWN"}, ("line 4, DT", "'UNKNOWN'", "finite number")),
        ({"dt": "0.0"}, ("line 4, DT (s)", "0.0", "above 0")),
        ({"points": "no numbers here"}, ("lines 1 to 6", "no number of points", "NPTS=")),
        ({"body": "1 2\n3 x4"}, ("line 6, column 2", "'x4'", "a finite number")),
        ({"body": "1 2\nNaN 4"}, ("line 6, column 1", "'NaN'", "a finite number")),
        ({"body": "1 inf 3"}, ("line 5, column 2", "'inf'", "a finite number")),
        ({"body": "1"}, ("1 samples", "two samples or more")),
    ],
)
def test_bad_files_are_refused(at2, refused, options, parts):
    path = at2(**options)
    with refused(path, *parts):
        read_at2(path)


def test_an_empty_and_a_missing_file(tmp_path, refused):
    path = tmp_path / "a.at2"
    with pytest.raises(InputError, match=r"a\.at2: no such file$"):
        read_at2(path)
    path.write_bytes(b"")
    with refused(path, "an empty file", "UTF-8 text"):
        read_at2(path)


@pytest.mark.parametrize("count", [995, 1003])
def test_a_few_samples_more_or_less_are_used_with_a_warning(at2, count):
    path = at2("\n".join(["0.1"] * count), npts=1000)
    with pytest.warns(UserWarning, match=rf"line 4: NPTS is 1000; {count} samples are there"):
        assert len(read_at2(path)) == count


def test_the_end_of_file_mark_of_dos_is_no_number(at2):
    path = at2("1 2\n3 4")
    path.write_bytes(path.read_bytes() + b"\x1a")
    assert len(read_at2(path)) == 4
