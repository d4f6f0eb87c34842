"""Files of ESM (and AFAD) and of GeoNet, as their format descriptions show them."""

import numpy as np
import pytest

from ground_motions import read, read_folder

ESM = """\
EVENT_NAME: CENTRAL ITALY
EVENT_TIME_HHMMSS: 06:40:18
STATION_CODE: NRC
VS30_M/S: 498
SAMPLING_INTERVAL_S: 0.005
NDATA: 4
DURATION_S: 0.015
STREAM: HGE
UNITS: cm/s^2
PGA_CM/S^2: -476.43
DATA_TYPE: Acceleration
USER1:
0.5
-12.25
 3.0E+00
-1
"""


def test_esm(written):
    record = read(written("IT.NRC..HGE.D.EMSC-20161030.ACC.MP.ASC", ESM))
    np.testing.assert_allclose(record.acceleration, [0.005, -0.1225, 0.03, -0.01], rtol=1e-12)
    assert (record.dt, record.file_unit) == (0.005, "cm/s2")
    assert record.name == "IT.NRC..HGE.D.EMSC-20161030.ACC.MP"
    assert record.source.endswith("station NRC, stream HGE")


def test_a_record_that_is_not_processed_is_said_to_be(written):
    path = written("a.asc", ESM.replace("USER1:", "BASELINE_CORRECTION: BASELINE NOT REMOVED"))
    with pytest.warns(UserWarning, match="its baseline is not removed"):
        read(path)


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("SAMPLING_INTERVAL_S", "STEP", ("line 1", "'EVENT_NAME: CENTRAL ITALY'", "DYNA")),
        ("UNITS: cm/s^2", "UNITS: cm/s", ("line 9, UNITS", "unit 'cm/s'")),
        ("_S: 0.005", "_S: 0", ("line 5, SAMPLING_INTERVAL_S", "0")),
        ("NDATA: 4", "NDATA: 5", ("NDATA 5 over 4 samples",)),
        ("TYPE: Acceleration", "TYPE: VELOCITY", ("line 11, DATA_TYPE", "'VELOCITY'")),
        ("-12.25", "nan", ("line 14", "'nan'")),
        (ESM, "0.1\n0.2\n", ("line 1", "'0.1'", "DYNA")),
    ],
)
def test_what_is_no_esm_file(written, refused, old, new, parts):
    path = written("a.asc", ESM.replace(old, new))
    with refused(path, *parts):
        read(path)


def test_velocities_beside_accelerations_in_a_folder_are_not_used(written, refused, tmp_path):
    written("IT.NRC..HGE.D.20161030.C.ACC.ASC", ESM)
    written("IT.NRC..HGE.D.20161030.C.VEL.ASC", ESM.replace("TYPE: Acceleration", "TYPE: VELOCITY"))
    with pytest.warns(UserWarning, match=r"not used: IT.NRC..HGE.D.20161030.C.VEL.ASC"):
        (record,) = read_folder(tmp_path)
    assert record.name == "IT.NRC..HGE.D.20161030.C.ACC"
    (tmp_path / "IT.NRC..HGE.D.20161030.C.ACC.ASC").unlink()
    with refused("no file of a record"):
        read_folder(tmp_path)


def test_the_components_of_a_station_are_one_record(written, tmp_path):
    for direction in "ENZ":
        written(f"IT.NRC..HG{direction}.D.EMSC-20161030.ACC.MP.ASC", ESM)
    for direction in "ENU":  # as of AFAD
        written(f"20230206011732_4614_ap_Acc_{direction}.asc", ESM)
    for number in "23":
        written(f"HI.ALK1.00.HN{number}.D.20140126.C.ACC.ASC", ESM)
    with pytest.warns(UserWarning, match="components of one record"):
        afad, greek, esm = read_folder(tmp_path)
    assert [each.name[13] for each in greek.components] == ["3", "2"]
    assert (afad.name, esm.name) == (
        "20230206011732_4614_ap_Acc", "IT.NRC..HG.D.EMSC-20161030.ACC.MP"
    )  # fmt: skip
    assert [each.name[-1] for each in (*afad.components, afad.vertical)] == ["N", "E", "U"]
    assert [each.name[10] for each in (*esm.components, esm.vertical)] == ["N", "E", "Z"]


def component(direction, samples, step=0.005):
    """A component with velocities and displacements behind its accelerations."""
    texts = ["Corrected accelerogram 20110221_235142_REHS_20 GNS Science"]
    texts += [f"line {k}" for k in range(2, 17)]
    axis = "Vertical" if direction == "Up" else "Longitudinal"
    texts[12] = f"Component {direction:5} {axis} Accelerometer Axis"
    integers = [0] * 40
    integers[33:36] = len(samples), 3, 11
    reals = [0.0] * 60
    reals[25] = step
    rows = [integers[k : k + 10] for k in range(0, 40, 10)]
    texts += ["".join(f"{one:8d}" for one in row) for row in rows]
    texts += ["".join(f"{one:8.3f}" for one in reals[k : k + 10]) for k in range(0, 60, 10)]
    for values in (samples, [7.0] * 3, [8.0] * 11):
        rows = [values[k : k + 10] for k in range(0, len(values), 10)]
        texts += ["".join(f"{one:8.1f}" for one in row) for row in rows]
    return "\n".join(texts) + "\n"


SAMPLES = [float(k) for k in range(12)]
SAMPLES[3] = -12345.6  # cells that touch
GEONET = component("N76W", SAMPLES) + component("Up", SAMPLES[::-1]) + component("S14W", SAMPLES)


def test_geonet(written, refused, tmp_path):
    path = written("20110221_235142_REHS_20.V2A", GEONET)
    record = read(path, column="N76W")
    np.testing.assert_allclose(record.acceleration * 1e3, SAMPLES, rtol=1e-12)
    assert (record.dt, record.file_unit) == (0.005, "mm/s2")
    assert record.name == "20110221_235142_REHS_20_N76W"
    np.testing.assert_allclose(read(path, column="Up").acceleration * 1e3, SAMPLES[::-1])
    with refused(path, "3 components and no choice", "N76W, Up, S14W"):
        read(path)
    with refused(path, "column: given 'S14E'", "S14W"):
        read(path, column="S14E")
    (both,) = read_folder(tmp_path)
    ends = [each.name.rpartition("_")[2] for each in (*both.components, both.vertical)]
    assert ends == ["N76W", "S14W", "Up"]


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (GEONET.replace("Corrected", "Uncorrected", 1), ("line 1", "'Uncorrected", "V2A")),
        (GEONET.replace("Component", "Direction", 1), ("line 13", "'Direction N76W")),
        (
            GEONET.replace("Component N76W  Longitudinal Accelerometer Axis", "Component"),
            ("line 13", "'Component'"),
        ),
        (GEONET.replace("   0.005", "   0.000", 1), ("line 23, column 6 (s)", "0")),
        (GEONET.replace("-12345.6", "-12345.x", 1), ("line 27, column 4", "'-12345.x'")),
        (GEONET.replace("    10.0", "", 1), ("lines 27 to 28: given 11 samples",)),
        (GEONET[:-30], ("lines", "by the header of S14W")),
        (component("N76W", SAMPLES) * 2, ("components N76W, N76W",)),
    ],
)
def test_what_is_no_file_of_geonet(written, refused, text, parts):
    path = written("a.v2a", text)
    with refused(path, *parts):
        read(path, column="N76W")


def test_an_uncorrected_file_of_geonet_is_refused_with_its_reason(written, refused):
    path = written("a.V1A", GEONET.replace("Corrected", "Uncorrected"))
    with refused(path, "line 1", "'Uncorrected", "a corrected accelerogram of GeoNet (V2A)"):
        read(path)
