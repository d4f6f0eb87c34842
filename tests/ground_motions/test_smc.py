"""Files of the US Geological Survey (SMC) as their format description shows them."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ground_motions import read, read_folder, read_smc
from isolation_sim.identification.raw_tests.smc_file import read_smc as read_table

NULL, NO_REAL = -32768, 1.7e38


def number(value):
    """A number in ten characters, such as -3.9166E+0."""
    mantissa, exponent = f"{value:.4e}".split("e")
    return f"{mantissa}E{int(exponent):+d}".rjust(10)


def rows(cells, columns):
    return ["".join(cells[k : k + columns]) for k in range(0, len(cells), columns)]


def smc(
    values, rate=200.0, kind="2 CORRECTED ACCELEROGRAM  ", component="  360", comments=2,
    corners=(),
):  # fmt: skip
    """The text of a file."""
    text = [kind, "*", "2555b", "     2011  08  23    1751 SOMEWHERE, XX", "Moment Mag= 5.80",
            f"station = XX: Hill; Fire Station  component={component}     ",
            "epicentral dist =    121.4       pk acc =  3.91E+1", "inst type=K2",
            "*", "*", "*"]  # fmt: skip
    integers, reals = [NULL] * 48, [NO_REAL] * 50
    integers[15], integers[16] = comments or NULL, len(values)
    reals[1] = rate
    reals[32 : 32 + len(corners)] = corners
    text += rows([f"{each:10d}" for each in integers], 8)
    text += rows([f"{each:15.7E}" for each in reals], 5)
    text += [f"| comment {k}" for k in range(comments)]
    return "\n".join([*text, *rows([number(each) for each in values], 8), ""])


@given(
    values=st.lists(st.integers(-99_999, 99_999).map(lambda k: k * 1e-2), min_size=2),
    rate=st.sampled_from([50.0, 100.0, 200.0]),
    comments=st.integers(0, 3),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_written_numbers_are_read_back(written, values, rate, comments):
    record = read_smc(written("a.smc", smc(values, rate, comments=comments)))
    np.testing.assert_allclose(record.acceleration * 100, values, rtol=1e-12, atol=1e-300)
    assert record.dt == 1 / rate


def test_header_and_uncorrected_accelerogram(written):
    text = smc([1.0, -2.0, 3.0])
    record = read(written("2516b_a.smc", text))
    assert (record.name, record.file_unit) == ("2516b_a", "cm/s2")
    assert record.source.endswith("station XX: Hill; Fire Station, component 360")
    path = written("raw.smc", text.replace("2 CORRECTED", "1 UNCORRECTED"))
    with pytest.warns(UserWarning, match="uncorrected; baseline_corrected"):
        assert read(path).pga == 0.03


def test_the_components_of_a_station_are_one_record(written, tmp_path):
    for name, component in (("a", "  UP"), ("b", "  360"), ("c", "   90")):
        written(f"0111{name}.smc", smc([1.0, -2.0], component=component))
    with pytest.warns(UserWarning, match=r"by their headers: 0111b \(0111b.smc, 0111c.smc, 0111a"):
        (record,) = read_folder(tmp_path)
    assert [each.name for each in (*record.components, record.vertical)] == [
        "0111b", "0111c", "0111a",
    ]  # fmt: skip


def test_velocities_beside_accelerations_in_a_folder_are_not_used(written, tmp_path):
    written("np_a.smc", smc([1.0, -2.0]))
    written("np_v.smc", smc([1.0, -2.0], kind="3 VELOCITY                "))
    with pytest.warns(UserWarning, match=r"not used: np_v.smc"):
        (record,) = read_folder(tmp_path)
    assert record.name == "np_a"


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (smc([1.0, 2.0]).replace("2 CORRECTED ACCELEROGRAM", "5 RESPONSE SPECTRA"),
         ("line 1", "'5 RESPONSE SPECTRA'", "2 CORRECTED ACCELEROGRAM")),
        (smc([0.1, 1.0, 0.2, 2.0], rate=NO_REAL), ("no sampling rate", "uneven times")),
        (smc([1.0, 2.0], rate=0.0), ("line 18, sampling rate (Hz)", "0")),
        (smc([1.0] * 16).rsplit("\n", 2)[0], ("number of samples 16 over 8 samples",)),
        (smc([1.0, 2.0]).replace("2.0000E+0", "2.0x00E+0"), ("column 2", "'2.0x00E+0'")),
        ("\n".join(smc([1.0, 2.0]).split("\n")[:20]), ("15 real numbers in the header", "50")),
    ],
)  # fmt: skip
def test_what_is_no_smc_file(written, refused, text, parts):
    path = written("a.smc", text)
    with refused(path, *parts):
        read(path)


@pytest.mark.parametrize(
    ("kind", "heading", "values"),
    [
        ("2 CORRECTED ACCELEROGRAM", "acceleration 171 deg Roof, east core [cm/s2]", "cm/s2"),
        ("4 DISPLACEMENT", "displacement 171 deg Roof, east core [cm]", "cm"),
    ],
)
def test_a_channel_of_a_structure_has_its_place_and_filter(written, kind, heading, values):
    # as of station 1103 on 4 January 2018: a corner of 0.3 Hz twice, and a ramp from 54 to 60 Hz
    text = smc([1.0, -2.0] * 8, kind=kind, component=" 171", corners=(0.3, -2.0, 54.0, 60.0))
    path = written("RE.smc", text.replace("| comment 1", "|<loclbl=>Roof, east core<end>"))
    (table,) = read_table(path)
    assert [(one.text, one.unit) for one in table.headings] == [(heading, values)]
    assert (table.rate, table.filtered) == (200.0, ((0.3,), (54.0, 60.0)))
    assert table.notes == ["filtered below 0.3 Hz: slower and residual motion is missing"]
    np.testing.assert_array_equal(table.numbers(0)[:2], [1.0, -2.0])


def test_a_channel_without_a_filter(written):
    (table,) = read_table(written("raw.smc", smc([1.0] * 16, kind="1 UNCORRECTED ACCELEROGRAM")))
    assert (table.filtered, table.notes) == (None, ["uncorrected accelerations"])
    assert table.headings[0].text == "acceleration 360 deg [cm/s2]"
