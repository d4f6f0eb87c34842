"""Headers of PEER files of real shape: names of stations, and how units and steps are written."""

import numpy as np
import pytest

from ground_motions import ACCELERATION_UNITS, STANDARD_GRAVITY, read_at2

NGA = "PEER NGA STRONG MOTION DATABASE RECORD"
WEST1 = "ACCELERATION TIME HISTORY IN UNITS OF G"
WEST2 = "ACCELERATION TIME SERIES IN UNITS OF G"
POINTS = "NPTS=       4, DT=   .0050 SEC,"
BODY = "  -.8338791E-03   .8376303E-03  1.0000000E+00\n   .5000000E+00\n"

ACCEPTED = {
    # databases and their age
    "nga_west2": (NGA, "Chi-Chi_ Taiwan, 9/20/1999, TCU052, E", WEST2, POINTS),
    "nga_west2_text": (NGA, "Northern Calif-03, 12/21/1954, Ferndale City Hall, 44", WEST2,
                       "NPTS=      4, DT=   .0050 SEC,"),
    "nga_west1": (NGA, "SAN FERNANDO 02/09/71 14:00, PACOIMA DAM, 164 (CDMG STATION 279)", WEST1,
                  "4    0.0050    NPTS, DT"),
    "nga_east": ("PEER NGA-East Strong Motion Database Record",
                 "Mineral, 2011-08-23, North Anna Unit 1 Containment, 90", WEST2, POINTS),
    "peer_2000": ("PEER STRONG MOTION DATABASE RECORD. PROCESSING BY PACIFIC ENGINEERING.",
                  "KOBE 01/16/95 2046, KJMA, 000",
                  WEST1 + ".  FILTER POINTS: HP=0.05 Hz LP=Null Hz", "NPTS=  4, DT= .0050 SEC"),
    "pacific_engineering": ("PACIFIC ENGINEERING AND ANALYSIS STRONG-MOTION DATA",
                            "IMPERIAL VALLEY 10/15/79 2319, EL CENTRO ARRAY 6, 230        ",
                            WEST1 + "      ", "4 0.0050 NPTS, DT"),
    "italian": ("ITACA STRONG MOTION DATA CONVERTED TO AT2 FORMAT",
                "E_ID: IT-2009-0009 STATION_ID: AQV", WEST1, "4    0.005    NPTS, DT"),
    "peknold": ("Data for El Centro 1940 North South Component (Peknold Version)",
                "4 points at equal spacing of 0.0050 sec", "The units are (g)",
                "NPTS=  4, DT= .00500 SEC"),
    # names of stations that hold the word, or begin as it does
    "power_plant": (NGA, "Whittier Narrows-01, 10/1/1987, Unit 4 Power Plant, 90", WEST2, POINTS),
    "unit_no_comma": (NGA, "Parkfield, 6/28/1966, SCE UNIT 4 POWER PLANT, 90", WEST2, POINTS),
    "fire_unit": (NGA, "Loma Prieta, 10/18/1989, Fire Unit of Hollister, 0", WEST2, POINTS),
    "unit_at_the_end": (NGA, "Morgan Hill, 4/24/1984, Storage Unit", WEST2, POINTS),
    "unit_m": (NGA, "Morgan Hill, 4/24/1984, Unit M, 90", WEST2, POINTS),
    "united": (NGA, "Northridge-01, 1/17/1994, UNITED Methodist Church, 180", WEST2, POINTS),
    "united_states": ("UNITED STATES GEOLOGICAL SURVEY", "Borrego, 4/9/1968, El Centro", WEST2,
                      POINTS),
    "community": (NGA, "Northridge-01, 1/17/1994, COMMUNITY Hospital, 360", WEST2, POINTS),
    "community_lower": (NGA, "coalinga-01, 5/2/1983, community hospital roof, 90", WEST2, POINTS),
    "opportunity": (NGA, "Borah Peak, 10/28/1983, Opportunity Units School, 0", WEST2, POINTS),
    "displacement": (NGA, "Kocaeli, 8/17/1999, Displacement Meter Vault, 90", WEST2, POINTS),
    "number_of_points": (NGA, "Duzce, 11/12/1999, DT Junction NPTS Road, 90", WEST2, POINTS),
    # accents, in the encodings in use
    "latin_1_tunnel": (NGA, "Manjil, 6/20/1990, Túnel de Güejar, L".encode("latin-1"), WEST2,
                       POINTS),
    "latin_1_rock": (NGA, "Baja, 4/4/2010, El Peñón, 0".encode("latin-1"), WEST2, POINTS),
    "latin_1_first_line": ("Base de datos sísmica, Año 2010".encode("latin-1"), "Maule", WEST2,
                           POINTS),
    "utf_8": (NGA, "Düzce, 11/12/1999, Sakarya İstasyonu", WEST2, POINTS),
    "byte_order_mark": (("\ufeff" + NGA).encode(), "Kobe, 1/16/1995, KJMA, 0", WEST2, POINTS),
    # how the units are set
    "lower_case": (NGA.lower(), "kobe", WEST2.lower(), "npts=  4, dt= .0050 sec"),
    "colon": (NGA, "Kobe", "Acceleration, Units: g", POINTS),
    "equals": (NGA, "Kobe", "ACCELERATION UNITS = G", POINTS),
    "bare": (NGA, "Kobe", "ACCELERATION TIME SERIES, UNITS G", POINTS),
    "in_brackets": (NGA, "Kobe", "ACCELERATION TIME SERIES (UNITS OF G)", POINTS),
    "full_stop": (NGA, "Kobe", "ACCELERATION TIME HISTORY IN UNITS OF G.", POINTS),
    "on_the_points_line": (NGA, "Kobe", "ACCELERATION", POINTS + " UNITS OF G"),
    # how points and step are set
    "tabs": (NGA + "\t", "Kobe\tKJMA", "ACCELERATION\tTIME SERIES IN\tUNITS OF\tG",
             "NPTS=\t4,\tDT=\t.0050\tSEC,"),
    "no_blanks": (NGA, "Kobe", WEST2, "NPTS=4,DT=.005SEC"),
    "blanks_about": (NGA, "Kobe", WEST2, "NPTS =  4 ,  DT =  0.0050  SEC"),
    "no_comma": (NGA, "Kobe", WEST2, "NPTS= 4 DT= 5.0E-3 SEC"),
    "colons": (NGA, "Kobe", WEST2, "NPTS: 4, DT: 0.005 s"),
    "step_first": (NGA, "Kobe", WEST2, "DT= 0.005 SEC, NPTS= 4"),
    "commas_between_numbers": (NGA, "Kobe", WEST2, "4, 0.0050, NPTS, DT"),
    "points_in_brackets": (NGA, "Kobe", WEST2, "4   0.0050  NPTS, DT (SEC)"),
    "more_lines": (NGA, "Kobe", "Station: Community College Unit 2", "Magnitude 6.9", WEST2,
                   POINTS),
    "other_units_too": (NGA, "Kobe, elevation units: m, distance units: km", WEST2, POINTS),
}  # fmt: skip

REFUSED = {
    "tenths_of_g": ((NGA, "Kobe", "UNITS OF G/10", POINTS), ("line 3", "units 'G/10'")),
    "unknown": ((NGA, "Kobe", "ACCELERATION IN UNITS OF FURLONGS", POINTS),
                ("line 3", "units 'FURLONGS'")),
    "only_a_plant": ((NGA, "Whittier, Unit 4 Power Plant", "ACCELERATION", POINTS),
                     ("lines 1 to 4", "no units", "UNITS OF G")),
    "only_united": ((NGA, "UNITED Community, 90", "ACCELERATION", POINTS),
                    ("lines 1 to 4", "no units")),
    "two_units": ((NGA, "Kobe, UNITS OF CM/S/S", WEST2, POINTS), ("line 3", "units cm/s2 and g")),
    "velocity": ((NGA, "Kobe", "VELOCITY TIME SERIES IN UNITS OF CM/S", POINTS),
                 ("line 3", "a velocity time series")),
    "no_step": ((NGA, "Kobe", WEST2, "NPTS= 4"), ("no number of points and step", "NPTS=")),
    "no_count": ((NGA, "Kobe", WEST2, "DT= .005 SEC"), ("no number of points and step",)),
    "step_in_words": ((NGA, "Kobe", WEST2, "NPTS= 4, DT= UNKNOWN"), ("line 4, DT", "'UNKNOWN'")),
    "count_is_no_integer": ((NGA, "Kobe", WEST2, "NPTS= 4.5, DT= .005"), ("line 4", "NPTS '4.5'")),
    # USGS and COSMOS files under a PEER suffix: no line of NPTS and DT among the first ten
    "smc": (("2 CORRECTED ACCELEROGRAM", "*", "*", "         *", "STATION: COMMUNITY HOSPITAL"),
            ("no number of points and step",)),
    "cosmos": (("Corrected acceleration  (Format v01.20 with 13 text lines)", "Peñón, Unit 4",
                "4  acceleration pts, approx 0 secs, units=cm/sec2(04)"),
               ("no number of points and step",)),
}  # fmt: skip


# other databases and conversions: the unit that the header declares
OTHER_UNITS = {
    "cm_s_s": ("Kobe", "ACCELERATION TIME SERIES IN UNITS OF CM/S/S", "cm/s2"),
    "cm_sec2": ("Kobe", "ACCELERATION, UNITS: cm/sec**2", "cm/s2"),
    "m_s2": ("Kobe", "ACCELERATION TIME SERIES IN UNITS OF M/S^2", "m/s2"),
    "gal": ("Kobe", "ACCELERATION UNITS ARE GAL", "gal"),
    "inches": ("Kobe", "ACCELERATION IN UNITS OF IN/S/S", "in/s2"),
    "plant_and_cm": ("Unit 4 Power Plant", "ACCELERATION IN UNITS OF CM/S/S", "cm/s2"),
    "unit_g_station": ("Unit G, 90", "ACCELERATION IN UNITS OF CM/S/S", "cm/s2"),
}


def write(folder, header, end):
    encoded = [line if isinstance(line, bytes) else line.encode() for line in header]
    path = folder / "RSN1_MADE.AT2"
    body = BODY.replace("\n", end.decode()).encode()
    path.write_bytes(end.join(encoded) + end + body)
    return path


@pytest.mark.parametrize("end", [b"\n", b"\r\n"], ids=["lf", "crlf"])
@pytest.mark.parametrize("header", ACCEPTED.values(), ids=ACCEPTED)
def test_accepted(tmp_path, header, end):
    record = read_at2(write(tmp_path, header, end))
    expected = np.array([-0.8338791e-3, 0.8376303e-3, 1.0, 0.5]) * STANDARD_GRAVITY
    np.testing.assert_allclose(record.acceleration, expected, rtol=1e-15)
    assert (record.dt, record.file_unit) == (0.005, "g")


@pytest.mark.parametrize(("event", "units", "unit"), OTHER_UNITS.values(), ids=OTHER_UNITS)
def test_other_units(tmp_path, event, units, unit):
    record = read_at2(write(tmp_path, (NGA, event, units, POINTS), b"\n"))
    expected = np.array([-0.8338791e-3, 0.8376303e-3, 1.0, 0.5]) * ACCELERATION_UNITS[unit]
    np.testing.assert_allclose(record.acceleration, expected, rtol=1e-15)
    assert record.file_unit == unit


@pytest.mark.parametrize(("header", "parts"), REFUSED.values(), ids=REFUSED)
def test_refused(tmp_path, refused, header, parts):
    path = write(tmp_path, header, b"\n")
    with refused(path, *parts):
        read_at2(path)


def test_the_source_keeps_the_accents(tmp_path):
    record = read_at2(write(tmp_path, ACCEPTED["latin_1_rock"], b"\n"))
    assert record.source.endswith("El Peñón, 0")
