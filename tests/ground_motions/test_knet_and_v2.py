"""Files of K-NET, KiK-net, COSMOS and CSMIP as their format descriptions show them."""

import numpy as np
import pytest

from ground_motions import read, read_folder
from ground_motions.component_names import Component
from ground_motions.readers.v2 import component_of

KNET = """\
Origin Time       2006/01/18 23:25:00
Lat.              37.798
Lon.              142.200
Depth. (km)       36
Mag.              5.7
Station Code      MYG002
Station Lat.      38.7262
Station Lon.      141.5109
Station Height(m) 79
Record Time       2006/01/18 23:25:46
Sampling Freq(Hz) 4Hz
Duration Time(s)  2
Dir.              N-S
Scale Factor      3920(gal)/6182761
Max Acc. (gal)    48.060
Last Correction   2006/01/18 23:25:31
Memo.             
    8009     9006     7998     8001     8009
    8007     8002     8005
"""


@pytest.mark.parametrize("suffix", ["NS", "EW", "UD", "NS1", "ud2"])
def test_knet(written, suffix):
    record = read(written(f"MYG0020601182325.{suffix}", KNET))
    counts = np.array([8009, 9006, 7998, 8001, 8009, 8007, 8002, 8005.0])
    expected = (counts - counts.mean()) * 39.20 / 6182761
    np.testing.assert_allclose(record.acceleration, expected, rtol=1e-12)
    assert (record.dt, record.name, record.file_unit) == (
        0.25, f"MYG0020601182325_{suffix}", "gal",
    )  # fmt: skip
    assert "station MYG002, direction N-S" in record.source


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("Origin Time", "Time", ("line 1", "'Time ", "K-NET")),
        ("Dir.              N-S\n", "", ("line 17", "'Memo.'")),
        ("4Hz", "four", ("line 11, Sampling Freq(Hz)", "'four'", "100Hz")),
        ("3920(gal)", "3920(m/s2)", ("line 14, Scale Factor", "(gal)/")),
        ("Station Code ", "Site Code    ", ("no line 'Station Code'",)),
        ("    8007     8002     8005\n", "", ("8 over 5 samples",)),
        ("8007", "8oo7", ("line 19, column 1", "'8oo7'")),
    ],
)
def test_other_headers_are_no_knet(written, refused, old, new, parts):
    path = written("a.NS", KNET.replace(old, new))
    with refused(path, *parts):
        read(path)


def reals(**values):
    cells = [f"{values.get(f'v{k}', -999.0):13.6f}" for k in range(1, 101)]
    return "\n".join("".join(cells[k : k + 6]) for k in range(0, 100, 6))


def cosmos(step="20.0", **values):
    header = "\n".join("    -999" * 10 for _ in range(10))
    return f"""Corrected acceleration   (Format v01.20 with 13 text lines) Src: 000aab.V2c
Statn No: 03- 24279 Code:CE-24279   Chan  3: 90 Deg
 100 Integer-header values follow on 10 lines, Format= (10I8)
{header}
 100 Real-header values follow on 17 lines, Format= (6F13.6)
{reals(v62=float(step), **values)}
   1 Comment line(s) follow, each starting with a "|":
| 4 acceleration
   10 acceleration pts, approx   0 secs, units=cm/sec2(04),Format=(8F9.4)
   1.0000-100.0000   2.0000   3.0000   4.0000   5.0000   6.0000   7.0000
   8.0000   9.0000
   10 velocity     pts, approx   0 secs, units=cm/sec  (05),Format=(8F9.4)
   1.0000   1.0000
End-of-data for Chan  3 velocity
"""


def test_cosmos(written):
    record = read(written("CE24279.V2c", cosmos()))
    np.testing.assert_allclose(record.acceleration * 100, [1, -100, 2, 3, 4, 5, 6, 7, 8, 9])
    assert (record.dt, record.name, record.file_unit) == (0.02, "CE24279", "cm/s2")
    assert record.source.endswith("channel 3")
    # without the step of the series, that of the record
    assert read(written("a.v2", cosmos("-999", v34=0.05))).dt == 0.05


CSMIP = """CORRECTED ACCELEROGRAM     24279-S1870-94020.03
CHAN  {channel}:  90 DEG
   10 POINTS OF INSTRUMENT- AND BASELINE-CORRECTED ACCEL, VELOC AND DISPL DATA
   10 points of accel data equally spaced at  .020 sec, in cm/sec2. (8f10.3)
  {first:8.3f} -1000.000     3.000     4.000     5.000     6.000     7.000     8.000
     9.000    10.000
   10 points of veloc data equally spaced at  .020 sec, in cm/sec.  (8f10.3)
     1.000     2.000     3.000     4.000     5.000     6.000     7.000     8.000
     9.000    10.000
/&  ----------  End of data for channel  {channel}  ----------
"""
ONE = CSMIP.format(channel=1, first=1.0)


def test_csmip(written, refused):
    one = read(written("one.v2", CSMIP.format(channel=3, first=2.5)))
    np.testing.assert_allclose(one.acceleration * 100, [2.5, -1000, 3, 4, 5, 6, 7, 8, 9, 10])
    assert (one.dt, one.name) == (0.02, "one")
    path = written("two.v2", CSMIP.format(channel=1, first=0) + CSMIP.format(channel=2, first=4.5))
    two = read(path, column="2")
    assert (two.acceleration[0], two.name) == (0.045, "two_2")
    with refused("2 channels and no choice", "column= one of '1' (90 DEG), '2' (90 DEG)"):
        read(path)
    with refused("column", "'3'", "1, 2"):
        read(path, column="3")


def test_the_vertical_channel_of_three_is_told_by_its_direction(written, refused, tmp_path):
    channels = [CSMIP.format(channel=k, first=k) for k in (1, 2, 3)]
    path = written("station.v2", "".join(channels).replace("2:  90 DEG", "2:  Up"))
    (record,) = read_folder(tmp_path)
    assert [each.name for each in (*record.components, record.vertical)] == [
        "station_1", "station_3", "station_2",
    ]  # fmt: skip
    path.write_text("".join(channels[:2]).replace("2:  90 DEG", "2:  Up"))
    assert [each.name for each in read_folder(tmp_path)[0].components] == ["station_1"]
    path.write_text("".join(channels))  # none is vertical
    with refused("3 channels and no choice"):
        read_folder(tmp_path)


def test_csmip_until_1990(written):
    """Units in brackets, no format, and the channel of the station beside that of its recorder."""
    old = CSMIP.replace("sec, in cm/sec2. (8f10.3)", "SEC.  (UNITS: CM/SEC/SEC)")
    old = old.replace("CHAN  {channel}:  90 DEG", "CHAN  1: 90 DEG  (STA CHN: {channel})")
    path = written("meloland.v2", old.format(channel=1, first=1) + old.format(channel=14, first=2))
    record = read(path, column="14")
    np.testing.assert_allclose(record.acceleration[:3] * 100, [2, -1000, 3])
    assert (record.dt, record.name, record.file_unit) == (0.02, "meloland_14", "cm/s2")


def test_channels_in_several_files_are_paired_by_their_headers(written, tmp_path):
    """CESMD gives a file for each channel; two at one place are a record, the vertical is not."""
    directions = {1: "110 DEG", 2: "UP", 3: "20 DEG", 4: "UP", 5: "110 DEG"}
    places = {4: "DECK", 5: "PIER"}
    for k, direction in directions.items():
        words = f"{direction}   LOCATION: {places.get(k, 'FREEFIELD')}"
        text = CSMIP.format(channel=k, first=k).replace(" 90 DEG", words)
        written(f"CHAN00{k}.V2", text.replace("ACCELEROGRAM ", "ACCELEROGRAM"))
    with pytest.warns(UserWarning) as told:
        station, pier = read_folder(tmp_path)
    assert [each.name for each in (*station.components, station.vertical)] == [
        "CHAN001", "CHAN003", "CHAN002",
    ]  # fmt: skip
    assert ([each.name for each in pier.components], pier.vertical) == (["CHAN005"], None)
    structure, vertical, together = (str(each.message) for each in told)
    assert "not called free field by their headers" in structure
    assert structure.endswith("are: CHAN004.V2 (DECK), CHAN005.V2 (PIER)")
    assert "not used, vertical components alone: CHAN004.V2" in vertical
    assert "by their headers: CHAN001 (CHAN001.V2, CHAN003.V2, CHAN002.V2)" in together


def test_vertical_components_alone_are_no_records(written, refused, tmp_path):
    written("CHAN002.V2", ONE.replace(" 90 DEG", "UP"))
    with refused("vertical components alone", "horizontal"):
        read_folder(tmp_path)


def test_cosmos_files_of_a_station_are_one_record(written, tmp_path):
    start = "Rcrd start time: 2018/11/30 17:29:39.137 UTC"
    for k, direction in ((1, "90 Deg"), (2, "Up"), (3, "360 Deg")):
        text = cosmos().replace("Chan  3: 90 Deg", f"Chan  {k}: {direction}\n{start}")
        written(f"bmr_{k}.V2c", text)
    with pytest.warns(UserWarning, match=r"bmr_1 \(bmr_1.V2c, bmr_3.V2c, bmr_2.V2c\)"):
        (record,) = read_folder(tmp_path)
    assert record.vertical is not None


def test_direction_and_location_of_cosmos_are_in_one_line(written, tmp_path):
    """From channel 10 on a single blank stands before each word."""
    start = "Rcrd start time: 2018/11/30 17:29:39.137 UTC"
    for k, direction in ((10, " 90 deg"), (11, "Up"), (12, "360 deg")):
        line = f"Sta Chan  {k}:{direction} (Rcrdr Chan {k}) Location:Free field"
        written(f"a{k}.V2c", cosmos().replace("Chan  3: 90 Deg", f"\n{line}\n{start}"))
    one = component_of(tmp_path / "a10.V2c")
    assert (one.direction, one.location) == ("90 deg", "Free field")
    with pytest.warns(UserWarning, match=r"a10 \(a10.V2c, a12.V2c, a11.V2c\)"):
        read_folder(tmp_path)


@pytest.mark.parametrize(
    ("location", "on_structure"),
    [("Ground", False), ("Freefield", False), ("1 m from free-field hut", False), ("", False),
     ("Ground Floor", True), ("Roof, north", True)],
)  # fmt: skip
def test_the_ground_alone_is_no_structure(location, on_structure):
    assert Component("a", "Up", location).is_on_structure == on_structure


def test_other_quantities_beside_accelerations_in_a_folder_are_not_used(written, tmp_path):
    written("BMR.BNE.acc.V2c", cosmos())
    written("BMR.BNE.vel.V2c", cosmos().replace("Corrected acceleration", "Corrected velocity"))
    moved = cosmos().replace("cm/sec2(04)", "cm(06)").replace("acceleration", "displacement")
    written("BMR.BNE.dis.V2c", moved)
    with pytest.warns(UserWarning, match=r"not used: BMR.BNE.dis.V2c, BMR.BNE.vel.V2c"):
        (record,) = read_folder(tmp_path)
    assert record.name == "BMR.BNE.acc"


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (ONE.replace("CORRECTED ACCEL", "UNCORRECTED ACCEL"), ("line 1", "corrected accel")),
        (ONE.replace("in cm/sec2", "in counts"), ("line 4", "units 'counts'", "cm/sec2")),
        (ONE.replace("points of accel", "points of veloc"), ("no accelerations",)),
        (ONE.replace("     9.000    10.000\n", ""), ("line 6, column 1", "finite number")),
        (ONE.split("     9.000")[0], ("line 4", "number of points 10 over 8 samples")),
        (cosmos("200.0"), ("value 62", "a step of 0.2 s", "last 0 s")),
        (cosmos("-999"), ("value 34 (s)", "above 0")),
        (cosmos().replace("Real-header", "Other"), ("no real header",)),
    ],
)
def test_other_headers_are_no_v2(written, refused, text, parts):
    path = written("a.v2", text)
    with refused(path, *parts):
        read(path)
