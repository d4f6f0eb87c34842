"""Files of loggers become a building record, or are refused in one line."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import isolation_sim as iso
from isolation_sim.cli import main
from isolation_sim.discrepancy.building.raw_records.headings import read_heading, read_name
from isolation_sim.discrepancy.building.raw_records.settings import (
    RecordSettings,
    channel_of,
    read_settings,
)
from isolation_sim.discrepancy.building.record import read_building_record
from isolation_sim.identification.raw_tests.channels import heading_of

N, RATE = 600, 100.0
TIME = np.arange(N) / RATE
G = 9.80665
ONE = ("ground_acceleration", "base_acceleration", "floor1_acceleration", "isolator_displacement")


def motion(seed=0, axes=("",), floors=1, current=False, size=1.0):
    """Channels by key, in SI: at rest, then a base that moves on isolators, and rest again."""
    rng = np.random.default_rng(seed)
    channels = {}
    for axis in axes:
        word = f"_{axis}" if axis else ""
        late = np.clip(TIME - 1.0, 0.0, None)
        grown = np.sin(np.pi * late / late[-1]) ** 4
        slow, fast = rng.uniform((0.7, 1.5), (1.2, 2.5))
        x = 0.1 * grown * np.sin(2 * np.pi * slow * late)
        ground = size * grown * np.sin(2 * np.pi * fast * late)
        base = ground + np.gradient(np.gradient(x, TIME), TIME)
        channels[f"ground{word}_acceleration"] = ground
        channels[f"base{word}_acceleration"] = base
        for floor in range(1, floors + 1):
            above = base + 0.1 * floor * grown * np.sin(9 * late)
            channels[f"floor{floor}{word}_acceleration"] = above
        channels[f"isolator{word}_displacement"] = x
    if current:
        channels["current"] = np.where(TIME > 2, 1.5, 0.5)
    return channels


def text(columns, separator="\t", comma=False, form="%.9g"):
    rows = "\n".join(
        separator.join(form % one for one in row) for row in zip(*columns, strict=True)
    )
    return (rows.replace(".", ",") if comma else rows) + "\n"


def plain(channels=None, **changed):
    """A file whose headings say everything."""
    channels = {**(channels or motion()), **changed}
    heads = ",".join(["Time [s]", *(f"{key} [{si(key)}]" for key in channels)])
    return f"{heads}\n{text([TIME, *channels.values()], ',')}"


def si(key):
    one = channel_of(key)
    return one.unit if one else "A"


def written(folder, content, name="log.csv"):
    (folder / name).write_text(content, encoding="utf-8")
    return folder / name


def assert_is(record, channels, **tolerances):
    close = {"rtol": 1e-6, "atol": 1e-8, **tolerances}
    result = dict(zip(record.ground_channels, (m.acceleration for m in record.ground), strict=True))
    result |= record.response
    if "current" in channels:
        np.testing.assert_allclose(record.current, channels["current"], **close)
    expected = {channel_of(key).name: one for key, one in channels.items() if channel_of(key)}
    assert set(result) == set(expected)
    for name, values in expected.items():
        np.testing.assert_allclose(result[name], values, **close, err_msg=name)


def refused(files, out=None, **options):
    with pytest.raises(iso.InputError) as caught:
        iso.import_building_record(files, out, **options)
    message = str(caught.value)
    assert "\n" not in message and "expected: " in message
    return message


UNITS = {
    "acceleration": {"g": G, "m/s^2": 1.0, "gal": 1e-2, "mm/s2": 1e-3, "mg": G / 1e3},
    "displacement": {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254},
    "current": {"A": 1.0, "mA": 1e-3},
}
PLACES = {
    "ground": ("A_ground", "shake table", "Rütteltisch", "gnd"),
    "base": ("A_base", "Base slab", "Bodenplatte"),
    "isolator": ("LVDT bearing", "Isolator", "Lager"),
    "floor": ("floor {}", "A_floor{}", "{}. OG", "F{}", "Level 0{}"),
}


@st.composite
def dialects(draw):
    """A record by its seed and directions, and how a logger writes it."""
    made = (
        draw(st.integers(0, 99)), draw(st.sampled_from([("",), ("x", "y")])),
        draw(st.integers(1, 3)), draw(st.booleans()),
    )  # fmt: skip
    keys = draw(st.permutations(list(motion(*made))))
    names = {place: draw(st.sampled_from(words)) for place, words in PLACES.items()}
    units = {quantity: draw(st.sampled_from(sorted(all_))) for quantity, all_ in UNITS.items()}
    form = draw(st.sampled_from(["{} [{}]", "{} ({})", "{}, {}"]))
    heads = []
    for number, key in enumerate(keys, 1):
        one = channel_of(key)
        name = f"{names['floor' if one.floor else one.place]} {one.axis}" if one else "Coil current"
        name = name.format(one.floor if one else "").strip()
        channel = draw(st.sampled_from(["", f"CH{number:02d} "]))
        heads.append(form.format(f"{channel}{name}", units[one.quantity if one else "current"]))
    separator, comma = draw(st.sampled_from([("\t", True), (";", True), (";", False)]))
    time = draw(st.sampled_from(["s", "ms", "header"]))
    start = draw(st.sampled_from([0.0, 12.5]))
    kind = draw(st.sampled_from(["one file", "file per sensor", "matrix"]))
    return made, keys, heads, units, separator, comma, time, start, kind


@given(dialects())
@settings(max_examples=8, deadline=None, suppress_health_check=list(HealthCheck))
def test_a_record_in_any_dialect_comes_back(tmp_path_factory, dialect):
    from scipy.io import savemat

    made, keys, heads, units, separator, comma, time, start, kind = dialect
    channels = motion(*made)
    columns = []
    for key in keys:
        quantity = key.split("_")[-1]
        columns.append(channels[key] / UNITS[quantity][units[quantity]])
    folder = tmp_path_factory.mktemp("raw")
    preamble = "Versuch 7\nOperator: Müller\n\n"
    times = {"s": ("Time [s]", TIME + start), "ms": ("Zeit [ms]", 1e3 * (TIME + start))}
    if time == "header":
        preamble += f"Sampling rate:{separator}100 Hz\n\n"
    first = [times[time]] if time in times else []
    if kind == "matrix":
        content = {"data": np.column_stack([*(one for _, one in first), *columns]),
                   "names": np.array([*(head for head, _ in first), *heads], object)}  # fmt: skip
        savemat(folder / "log.mat", content if first else {**content, "fs": RATE})
    elif kind == "one file":
        head = separator.join([*(head for head, _ in first), *heads])
        values = text([*(one for _, one in first), *columns], separator, comma)
        written(folder, f"{preamble}{head}\n{values}", "log.txt")
    else:
        for number, (head, column) in enumerate(zip(heads, columns, strict=True)):
            head = separator.join([*(head for head, _ in first), head])
            values = text([*(one for _, one in first), column], separator, comma)
            written(folder, f"{preamble}{head}\n{values}", f"sensor_{number}.txt")
    imported = iso.import_building_record(folder, folder / "out" / "quake.csv")
    assert_is(read_building_record(imported.path), channels)
    assert imported.record.dt == pytest.approx(1 / RATE)
    again = iso.import_building_record(folder, settings=tomllib.loads(imported.settings))
    assert_is(again.record, channels)


@pytest.mark.parametrize(
    ("heading", "expected"),
    [
        ("CH03 A_roof [g]", ("roof", "", "acceleration")),
        ("Base X [g]", ("base", "x", "acceleration")),
        ("basey acc [cm/s2]", ("base", "y", "acceleration")),
        ("2nd floor acc X", ("floor2", "x", "acceleration")),
        ("CH2 floor [g]", ("", "", "acceleration")),
        ("Floor 03 N-S (g)", ("floor3", "ns", "acceleration")),
        ("acc_f2_x_g", ("floor2", "x", "acceleration")),
        ("ground floor [g]", ("", "", "acceleration")),
        ("Table disp [mm]", ("ground", "", "displacement")),
        ("Base rel. displacement [mm]", ("isolator", "", "displacement")),
        ("base isolation acc [g]", ("base", "", "acceleration")),
        ("rot base [rad/s^2]", ("base", "rotation", "acceleration")),
        ("base_rotation_acceleration_rad_s2", ("base", "rotation", "acceleration")),
        ("Dach z [mg]", ("roof", "vertical", "acceleration")),
        ("channel 4 acceleration Up Base slab [cm/s2]", ("base", "vertical", "acceleration")),
        ("90 Deg Free field [g]", ("ground", "90deg", "acceleration")),
        ("Displ. Lager", ("isolator", "", "displacement")),
        ("floor 0 [g]", ("base", "", "acceleration")),
        ("Roof slab [g]", ("roof", "", "acceleration")),
        ("Bearing top [g]", ("", "", "acceleration")),
        ("90 Deg Base slab, above isolators [cm]", ("base", "90deg", "displacement")),
        ("Foundation above the isolation level [g]", ("base", "", "acceleration")),
        ("Basement below base isolators [cm]", ("ground", "", "displacement")),
        ("oberhalb der Lager x [mm/s2]", ("base", "x", "acceleration")),
        ("1st floor above isolators [g]", ("floor1", "", "acceleration")),
        ("1st floor 90 Deg (mg)", ("floor1", "90deg", "acceleration")),
        ("rel. displacement above isolators [mm]", ("isolator", "", "displacement")),
        ("Base force [kN]", ("base", "", "")),
    ],
)
def test_places_in_headings(heading, expected):
    read = heading_of(heading)
    assert read_heading(read.text, read.name, read.unit)[:3] == expected


def test_azimuths_are_directions_by_the_settings():
    words = {"360 deg": "x", "EW": "y"}
    assert read_name("channel 2 acceleration 360 DEG Base", words).axis == "x"
    assert read_name("channel 2 acceleration 90 DEG Base", words).axis == "90deg"


def test_names_of_files_say_where_a_sensor_stands(tmp_path):
    channels = motion(floors=2)
    for key, values in channels.items():
        head = "Displacement (mm)" if "displacement" in key else "Acceleration (m/s^2)"
        values = 1e3 * values if "displacement" in key else values
        place = key.split("_")[0]
        written(tmp_path, f"Time (s),{head}\n{text([TIME, values], ',')}", f"{place}.csv")
    assert_is(iso.import_building_record(tmp_path).record, channels)


def test_one_column_per_file_with_decimal_commas(tmp_path):
    for key, values in motion().items():
        head = f"Abtastrate: 100 Hz\n{key.split('_')[0]} [{si(key)}]\n"
        written(tmp_path, head + text([values], comma=True, form="%.9f"), f"{key}.asc")
    assert_is(iso.import_building_record(tmp_path).record, motion())


def test_sheets_of_a_workbook_are_one_record(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for key, values in motion().items():
        sheet = book.create_sheet(key.split("_")[0])
        sheet.append(["t [s]", f"value [{si(key)}]"])
        for row in zip(TIME, values, strict=True):
            sheet.append([*map(float, row)])
    book.save(tmp_path / "all.xlsx")
    imported = iso.import_building_record(tmp_path, columns={"time": "t"})
    assert_is(imported.record, motion())
    again = iso.import_building_record(tmp_path, settings=tomllib.loads(imported.settings))
    assert_is(again.record, motion())
    assert again.settings == imported.settings


def test_variables_of_matlab_without_units(tmp_path):
    from scipy.io import savemat

    ground, base, floor, isolator = motion().values()
    variables = {"t": TIME, "ag": ground / G, "ab": base / G, "acc_1": floor / G, "x": isolator}
    savemat(tmp_path / "log.mat", {**variables, "title": "test 7"})
    imported = iso.import_building_record(
        tmp_path / "log.mat",
        columns={"floor1_acceleration": "acc_1"},
        units={"acceleration": "g", "displacement": "m"},
    )
    assert_is(imported.record, motion())
    assert "'x', the only displacement, is taken for the isolators'" in imported.notes


def test_settings_give_sign_scale_unit_and_column(tmp_path):
    channels = motion()
    head = "\t".join(["t", "a", "b", "c", "d"])
    columns = [TIME, channels[ONE[0]] / G, -channels[ONE[1]], channels[ONE[2]], channels[ONE[3]]]
    path = written(tmp_path, f"{head}\n{text([*columns[:4], columns[4] * 500])}", "log.txt")
    (tmp_path / "sensors.toml").write_text(
        'units = { displacement = "mm" }\n[channels]\n'
        'ground_acceleration = { column = "a", unit = "g" }\n'
        'base_acceleration = { column = "b", unit = "m/s2", sign = -1 }\n'
        'floor1_acceleration = { column = 4, unit = "m/s2" }\n'
        'isolator_displacement = { column = "d", scale = 2 }\n'
    )
    imported = iso.import_building_record(path, settings=tmp_path / "sensors.toml")
    assert_is(imported.record, channels)
    again = iso.import_building_record(path, settings=tomllib.loads(imported.settings))
    assert_is(again.record, channels)


def test_absolute_displacements_give_that_of_the_isolators(tmp_path):
    channels = motion(axes=("x", "y"))
    settings, table = {}, 0.02 * np.sin(3 * TIME)
    for key, values in channels.items():
        if key.startswith("isolator"):
            settings[key.replace("isolator", "base")] = values + table
            settings[key.replace("isolator", "ground")] = table
        else:
            settings[key] = values
    imported = iso.import_building_record(written(tmp_path, plain(settings)))
    assert_is(imported.record, channels)
    assert "isolator_y_displacement is base_y_displacement minus ground_y_displacement" in (
        imported.notes
    )
    del settings["ground_y_displacement"]
    message = refused(written(tmp_path, plain(settings)))
    assert "a displacement of the base without one of the ground" in message
    assert "--column isolator_y_displacement=" in message


def test_relative_accelerations_are_made_absolute_only_if_the_settings_say_so(tmp_path):
    channels = motion(floors=2, size=3.0)
    ground = channels["ground_acceleration"]
    relative = {k: v - ground if k[:4] in ("base", "floo") else v for k, v in channels.items()}
    path = written(tmp_path, plain(relative))
    message = refused(path)
    assert message.endswith('accelerations = "relative" in the settings')
    imported = iso.import_building_record(path, settings={"accelerations": "relative"})
    assert_is(imported.record, channels)
    assert "added to base_acceleration, floor1_acceleration, floor2_ac" in " ".join(imported.notes)
    path = written(tmp_path, plain(relative).replace("base_acc", "rel base_acc"))
    assert "relative accelerations by their names, 'rel base_acceleration" in refused(path)


def test_offsets_are_subtracted_only_if_asked(tmp_path):
    channels = motion()
    shifted = {key: values + 0.01 * k for k, (key, values) in enumerate(channels.items())}
    path = written(tmp_path, plain(shifted))
    assert_is(iso.import_building_record(path).record, shifted)
    imported = iso.import_building_record(path, settings={"offset_s": 0.9})
    assert_is(imported.record, channels)
    assert "base_acceleration 0.01 m/s2" in imported.notes[-1]
    assert "in which ground_acceleration" in refused(path, settings={"offset_s": 5})
    assert "given 90; expected: 8 samples or more" in refused(path, settings={"offset_s": 90})


def test_loggers_with_other_times_are_cut_to_the_common_ones(tmp_path):
    channels = motion()
    written(
        tmp_path,
        f"t [s],table [m/s2],base [m/s2]\n{text([TIME, channels[ONE[0]], channels[ONE[1]]], ',')}",
        "a.csv",
    )
    late = slice(20, 590)
    rows = text([TIME[late], channels[ONE[2]][late], channels[ONE[3]][late]], ",")
    written(tmp_path, f"t [s],F1 [m/s2],LVDT iso [m]\n{rows}", "b.csv")
    imported = iso.import_building_record(tmp_path)
    assert_is(imported.record, {key: values[late] for key, values in channels.items()})
    assert any("all of them from 0.2 to 5.89 s" in note for note in imported.notes)
    assert "time_s = 0 is 0.2 s of the files" in imported.notes
    # without times nothing says when a file starts
    rows = text([channels[ONE[2]][late], channels[ONE[3]][late]], ",")
    written(tmp_path, f"F1 [m/s2],LVDT iso [m]\n{rows}", "b.csv")
    assert "no time in one of them; expected: as many samples" in refused(tmp_path, rate=100.0)
    imported = iso.import_building_record(
        tmp_path, settings={"start_s": {"b.csv": 0.2}, "rate_Hz": 100}
    )
    assert_is(imported.record, {key: values[late] for key, values in channels.items()})
    assert "one of a.csv, b.csv" in refused(
        tmp_path, rate=RATE, settings={"start_s": {"c.csv": 1.0}}
    )


def test_loggers_with_times_of_day_are_aligned(tmp_path):
    channels = motion()
    late = slice(20, 590)
    clock = [f"10:59:{57 + t:06.3f}" if t < 3 else f"11:00:{t - 3:06.3f}" for t in TIME]

    def rows(part, *keys):
        cells = zip(clock[part], *(channels[key][part] for key in keys), strict=True)
        return "".join(f"{t};{a:.9g};{b:.9g}\n" for t, a, b in cells)

    head = "Timestamp;table [m/s2];base [m/s2]\n"
    written(tmp_path, head + rows(slice(None), *ONE[:2]), "a.csv")
    written(tmp_path, f"Timestamp;F1 [m/s2];LVDT iso [m]\n{rows(late, *ONE[2:])}", "b.csv")
    imported = iso.import_building_record(tmp_path)
    assert_is(imported.record, {key: values[late] for key, values in channels.items()})


def test_loggers_of_other_rates_are_resampled_only_if_asked(tmp_path):
    channels = motion()
    a = text([TIME, channels[ONE[0]], channels[ONE[1]]], ",")
    written(tmp_path, f"t [s],table [m/s2],base [m/s2]\n{a}", "a.csv")
    half = slice(0, N, 2)
    b = text([TIME[half], channels[ONE[2]][half], channels[ONE[3]][half]], ",")
    written(tmp_path, f"t [s],F1 [m/s2],LVDT iso [m]\n{b}", "b.csv")
    message = refused(tmp_path)
    assert "b.csv: given 50 samples per second, where" in message and "resample_Hz = 50" in message
    fine = iso.import_building_record(tmp_path, settings={"resample_Hz": 100})
    assert len(fine.record) == N - 1
    inner = slice(0, -20)
    for name, values in fine.record.response.items():
        expected = next(channels[key] for key in channels if name.startswith(key))[:-1]
        np.testing.assert_allclose(values[inner], expected[inner], atol=2e-3)
    coarse = iso.import_building_record(tmp_path, settings={"resample_Hz": 50})
    for name, values in coarse.record.response.items():
        expected = next(channels[key] for key in channels if name.startswith(key))[half]
        np.testing.assert_allclose(values[inner], expected[inner], atol=5e-3)
    assert any("low-pass filtered at 20 Hz" in note for note in coarse.notes)
    b = text([TIME + 0.004, channels[ONE[2]], channels[ONE[3]]], ",")
    written(tmp_path, f"t [s],F1 [m/s2],LVDT iso [m]\n{b}", "b.csv")
    assert "samples 4 ms beside those of" in refused(tmp_path)


def test_directions(tmp_path):
    channels = motion(axes=("x", "y"))
    named = {key.replace("_x_", " EW ").replace("_y_", " N-S "): v for key, v in channels.items()}
    heads = {key: f"{key} [{'m' if 'displ' in key else 'm/s2'}]" for key in named}
    content = ",".join(["t [s]", *heads.values()]) + "\n" + text([TIME, *named.values()], ",")
    path = written(tmp_path, content)
    message = refused(path)
    assert "given directions ew, ns" in message and 'directions = { x = "EW", y = "NS" }' in message
    both = iso.import_building_record(path, settings={"directions": {"x": "EW", "y": "NS"}})
    assert_is(both.record, channels)
    one = iso.import_building_record(path, settings={"direction": "NS"})
    assert_is(one.record, {k.replace("_y", ""): v for k, v in channels.items() if "_y" in k})
    # one direction alone needs no name
    only = {key: values for key, values in channels.items() if "_x" in key}
    one = iso.import_building_record(written(tmp_path, plain(only)))
    assert_is(one.record, {key.replace("_x", ""): values for key, values in only.items()})
    mixed = {"floor2_acceleration" if key == "floor1_y_acceleration" else key: values
             for key, values in channels.items()}  # fmt: skip
    message = refused(written(tmp_path, plain(mixed)))
    assert "no direction, beside columns along x and y" in message


def test_rotations_and_a_second_floor_in_one_direction(tmp_path):
    channels = motion(axes=("x", "y"))
    channels["base_rotation_acceleration"] = 0.1 * channels["base_x_acceleration"]
    channels["floor2_x_acceleration"] = 1.1 * channels["floor1_x_acceleration"]
    assert_is(iso.import_building_record(written(tmp_path, plain(channels))).record, channels)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("floor1_acceleration [m/s2]", "A_roof [g]", "number of floors is not known; expected: f"),
        ("floor1_acceleration [m/s2]", "CH07 [g]", "not recognised: floor1_acceleration; exp"),
        ("floor1_acceleration [m/s2]", "base slab [m/s2]",
         "2 columns for base_acceleration, 'base_acceleration [m/s2]', 'base slab [m/s2]'; expe"),
        ("floor1_acceleration [m/s2]", "floor1 acc [V]", "the unit 'V' for floor1_acceleration; "),
        ("floor1_acceleration [m/s2]", "floor1 acc", "no unit for floor1_acceleration; expected"),
        ("isolator_displacement [m]", "Lager Weg", "--unit isolator_displacement=UNIT, --unit d"),
        ("isolator_displacement [m]", "isolator displacement [cm]", "times that of the isolators'"),
        ("isolator_displacement [m]", "base displacement [m]", "without one of the ground"),
        ("base_acceleration [m/s2]", "base [g]", "times the one that fits the other columns"),
        ("base_acceleration [m/s2]", "base [g]", "displacement (columns: ground_acceleration 'gro"),
        ("base_acceleration [m/s2]", "base [g]", "isolator_displacement [m]'); expected: "),
        ("Time [s]", "Zeile", "not recognised: time; expected: --column time=HEADING"),
    ],
)  # fmt: skip
def test_what_is_not_clear_is_refused(tmp_path, old, new, message):
    path = written(tmp_path, plain().replace(old, new))
    assert message in refused(path, tmp_path / "quake.csv")
    assert not (tmp_path / "quake.csv").exists()


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({"chanels": {}}, "settings: unknown key 'chanels'; did you mean 'channels'?"),
        ({"channels": {"roof_acceleration": 3}}, "settings: channels.roof_acceleration: no"),
        ({"channels": {"isolator_acceleration": 3}}, "channel; expected: time, current, "),
        ({"channels": {"base_acceleration": "?"}}, "base_acceleration: '?'; expected: a heading"),
        ({"channels": {"base_acceleration": "xx"}}, "given 'xx'; expected: one of 'Time [s]', "),
        ({"channels": {"base_acceleration": {"column": 3, "sing": -1}}}, "did you mean 'sign'?"),
        ({"channels": {"base_acceleration": {"column": 3, "sign": 2}}}, "sign: 2; expected: 1 or"),
        ({"channels": {"base_acceleration": {"column": 3, "unit": "mm"}}}, "unit: given 'mm'; exp"),
        ({"channels": {"base_acceleration": {"column": 3, "file": "b"}}}, "expected: one of log"),
        ({"channels": {"base_acceleration": 3, "floor2_acceleration": 3}}, "that of base_accele"),
        ({"channels": {"base_acceleration": "none"}}, "not recognised: base_acceleration"),
        ({"channels": {"time": "Zeit"}}, "channels.time: given 'Zeit'; expected: one of 'Time [s]"),
        ({"rate_Hz": 0}, "settings: rate_Hz: given 0; expected: a number above 0"),
        ({"floors": 2.5}, "settings: floors: given 2.5; expected: a whole number"),
        ({"accelerations": "rel"}, "accelerations: given 'rel'; expected: 'absolute' or"),
        ({"directions": {"x": "EW"}}, "settings: directions: {'x': 'EW'}; expected: { x"),
        (
            {"units": {"acc": "g"}},
            "units.acc: no quantity and no channel; expected: acceleration, displacement, time, ",
        ),
        ({"units": {"acceleration": "V"}}, "the unit 'V' for"),
        ({"start_s": 3}, "settings: start_s: given 3; expected: a table"),
    ],
)
def test_wrong_settings_are_refused(tmp_path, value, message):
    assert message in refused(written(tmp_path, plain()), settings=value)


def test_the_settings_of_the_documentation_are_accepted():
    text = (Path(__file__).parents[3] / "docs/reference/formats.md").read_text()
    (example,) = re.findall(r"```toml\n(floors = .*?)```", text, re.DOTALL)
    read = read_settings(tomllib.loads(example), {}, {}, None)
    assert (read.floors, read.offset_s) == (5, 5.0)
    entry = read.sensors["base_acceleration"]
    assert (entry.column, entry.unit, entry.factor) == ("CH02", "g", -1.0)
    keys = re.findall(
        r"^\| `(\w+)` \|", text[text.index(example) : text.index("## Ground mot")], re.M
    )
    assert set(keys) == set(RecordSettings.model_fields)


def test_what_is_not_used_is_reported(tmp_path):
    channels = motion()
    content = plain({**channels, "Spare": TIME, "Table setpoint": TIME, "Base z": TIME})
    content = content.replace("[A]", "[g]").replace("setpoint [g]", "setpoint [mm]")
    imported = iso.import_building_record(written(tmp_path, content))
    assert_is(imported.record, channels)
    assert "not used, a set point by its name: 'Table setpoint [mm]'" in imported.notes
    assert "not used, vertical: 'Base z [g]'" in imported.notes
    assert any("that are recognised: 'Spare [g]'" in note for note in imported.notes)


def test_missing_samples_and_wrong_numbers(tmp_path):
    channels = motion()
    lines = plain().splitlines()
    lines[101] = lines[101].rpartition(",")[0] + ","
    imported = iso.import_building_record(written(tmp_path, "\n".join(lines)))
    assert_is(imported.record, channels, atol=1e-3)
    assert any("1 sample is missing in the isolator_displ" in note for note in imported.notes)
    still = {**channels, "floor1_acceleration": 0 * TIME}
    message = refused(written(tmp_path, plain(still)))
    assert message.startswith(
        f"{tmp_path}/log.csv, column 'floor1_acceleration [m/s2]', floor1_acc"
    )
    assert "the same number throughout" in message


def test_files_that_are_read_are_never_replaced(tmp_path, capsys):
    path = written(tmp_path, plain())
    assert "exists; expected: a new name" in refused(path, path)
    assert "given a file of the record; expected: another file" in refused(
        path, path, overwrite=True
    )
    assert "expected: a file *.csv" in refused(path, tmp_path / "quake.txt")
    code, _, errors = called(capsys, path, "--building", "--write-settings", path, "--force")
    assert code == 2 and "given a file of the record; expected: another file" in errors
    assert path.read_text() == plain()


def called(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main(["import", *map(str, arguments)])
    out, captured = capsys.readouterr()
    return ended.value.code, out, captured


def test_settings_are_shown_written_completed_and_used(tmp_path, capsys):
    content = plain().replace("base_acceleration", "CH02 A").replace("floor1_acc", "Dach acc")
    raw, sensors, quake = written(tmp_path, content), tmp_path / "s.toml", tmp_path / "q.csv"
    code, out, errors = called(capsys, raw, "--building")
    assert code == 2 and errors.count("\n") == 1 and "(and 1 more that is not clear)" in errors
    template = out[out.index("# Settings of an import") :]
    assert set(tomllib.loads(template)["channels"]) == {
        "time", "ground_acceleration", "base_acceleration", "isolator_displacement",
    }  # fmt: skip
    assert '# PLACE_acceleration = { column = "CH02 A [m/s2]", unit = "m/s2" }' in template
    assert '# floorN_acceleration = { column = "Dach acceleration [m/s2]"' in template
    code, out, errors = called(capsys, raw, "--building", "--write-settings", sensors)
    assert code == 0 and errors == "" and f"settings: {sensors}, to be completed" in out
    code, _, errors = called(capsys, raw, "--building", "--write-settings", sensors)
    assert code == 2 and "s.toml: exists; expected: a new name, or --force" in errors
    code, _, errors = called(capsys, raw, "--settings", sensors, "--out", quake)
    assert code == 2 and "channels.base_acceleration.column: '?'; expected: a heading" in errors
    completed = (
        sensors.read_text().replace('"?"', '"CH02 A [m/s2]"').replace("# floors = 5", "floors = 1")
    )
    sensors.write_text(completed)
    code, out, errors = called(capsys, raw, "--settings", sensors, "--out", quake)
    assert code == 0 and errors == "" and f"record: {quake}" in out
    assert_is(read_building_record(quake), motion())
    assert (
        "# floor1_acceleration: 'Dach acceleration [m/s2]' in m/s2 of log.csv" in quake.read_text()
    )
    before = quake.read_text()
    code, out, errors = called(capsys, raw, "--settings", sensors, "--out", quake)
    assert code == 2 and out == "" and "exists; expected: a new name, or --force" in errors
    assert quake.read_text() == before
    code, *_ = called(capsys, raw, "--settings", sensors, "--out", quake, "--force")
    assert code == 0


def test_options_of_device_tests_are_refused(tmp_path, capsys):
    raw = written(tmp_path, plain())
    code, _, errors = called(capsys, raw, "--building", "--hold-out", "2")
    assert (
        code == 2 and "--hold-out: given with a building record; expected: device tests" in errors
    )
    code, _, errors = called(capsys, raw, "--force")
    assert code == 2 and "--force: given with device tests" in errors


def test_several_sensors_of_a_channel(tmp_path):
    channels = motion(floors=2)
    floor = channels.pop("floor1_acceleration")
    many = plain({**channels, "A3": 1.1 * floor, "A4": 0.9 * floor})
    many = many.replace("A3 [A]", "A3 [m/s2]").replace("A4 [A]", "A4 [m/s2]")
    files = written(tmp_path, many)
    expected = channels | {"floor1_acceleration": floor}
    imported = iso.import_building_record(files, columns={"floor1_acceleration": ["A3", "A4"]})
    assert_is(imported.record, expected)
    assert imported.notes == (
        "floor1_acceleration is the mean of 'A3 [m/s2]', 'A4 [m/s2]', which differ from it by 10 % "
        "(RMS)",
    )
    assert "A3 [m/s2], A4 [m/s2]" in str(imported)
    # the settings that it writes import the same
    again = written(tmp_path, imported.settings, "again.toml")
    assert_is(iso.import_building_record(files, settings=again).record, expected)
    options = ["--building", "--column", "floor1_acceleration=A3"]
    with pytest.raises(SystemExit) as stop:
        main(["import", str(files), *options, "--column", "floor1_acceleration=A4"])
    assert stop.value.code == 0
    assert "one column" in refused(files, columns={"time": [1, 2]})
    placed = {"column": "A3", "position_m": [0, 3]}
    message = refused(files, settings={"channels": {"floor1_acceleration": placed}})
    assert "given one of floor1_acceleration; expected: that of an acceleration along x" in message
    assert "none alone" in refused(files, columns={"floor1_acceleration": ["A3", "none"]})


def planar(channels, places):
    """Sensors at positions of floors that move as rigid bodies."""
    shown = {}
    for place, sensors in places.items():
        quantity = "displacement" if place == "isolator" else "acceleration"
        turn = channels[f"{place}_rotation_{quantity}"]
        for k, (axis, x, y) in enumerate(sensors):
            arm = -y if axis == "x" else x
            shown[place, k] = channels[f"{place}_{axis}_{quantity}"] + arm * turn
    return shown


def test_sensors_at_positions_give_the_rotation(tmp_path):
    channels = motion(axes=("x", "y"))
    for k, place in enumerate(("base", "floor1", "isolator"), 1):
        quantity = "displacement" if place == "isolator" else "acceleration"
        channels[f"{place}_rotation_{quantity}"] = 0.1 * k * channels["isolator_x_displacement"]
    places = {
        "base": [("x", 0, 4), ("x", 0, -4), ("y", 6, 0)],
        "floor1": [("x", 1, 4), ("x", 2, -4), ("y", 6, 1), ("y", -5, 0)],
        "isolator": [("x", 0, 4), ("y", 5, 0), ("y", -5, 0)],
    }
    sensors = planar(channels, places)
    names = ["ground_x_acceleration", "ground_y_acceleration"]
    heads = ["Time [s]", *(f"{name} [m/s^2]" for name in names)]
    heads += [f"s{n} [{'m' if key[0] == 'isolator' else 'm/s^2'}]" for n, key in enumerate(sensors)]
    rows = text([TIME, *(channels[name] for name in names), *sensors.values()], ",")
    files = written(tmp_path, ",".join(heads) + "\n" + rows)
    entries = {}
    for place, each in places.items():
        quantity = "displacement" if place == "isolator" else "acceleration"
        for k, (axis, *at) in enumerate(each):
            entry = {"column": 4 + list(sensors).index((place, k)), "position_m": at}
            entries.setdefault(f"{place}_{axis}_{quantity}", []).append(entry)
    options = {"channels": entries}
    imported = iso.import_building_record(files, settings=options)
    assert_is(imported.record, channels)
    assert any("rigid body by 4 sensors, which differ from it by" in n for n in imported.notes)
    again = written(tmp_path, imported.settings, "again.toml")
    assert_is(iso.import_building_record(files, settings=again).record, channels)
    # without a rotation that the building does not have
    fewer = {**entries, "floor1_rotation_acceleration": "none"}
    record = iso.import_building_record(files, settings={"channels": fewer}).record
    assert not any(name.startswith("floor1_rotation") for name in record.response)
    alone = {**entries, "floor1_y_acceleration": entries["floor1_y_acceleration"][:1]}
    alone["floor1_x_acceleration"] = entries["floor1_x_acceleration"][:1]
    message = refused(files, settings={"channels": alone})
    assert "floor1, acceleration: given 2 sensors at (1, 4) m, (6, 1) m" in message
    lacking = {**entries, "floor1_x_acceleration": entries["floor1_x_acceleration"][0]["column"]}
    assert "given no position of 's3" in refused(files, settings={"channels": lacking})
    ground = {"ground_x_acceleration": {"column": 2, "position_m": [0, 1]}}
    assert "given one of ground_x_acceleration" in refused(files, settings={"channels": ground})
    # of one direction, whose keys have it
    entries = {key: one for key, one in entries.items() if "_y_" not in key}
    entries |= {"ground_y_acceleration": "none"}
    message = refused(files, settings={"channels": entries, "direction": "x"})
    assert "given position_m, in a record of one direction" in message


def channel_of_csmip(number, location, acceleration, displacement, azimuth=90):
    """A channel of a corrected record of CSMIP, in cm/s^2 and cm."""
    lines = ["CORRECTED ACCELEROGRAM     24579-S1870-94020.03" if number == 1 else ""]
    lines += [f"CHAN  {number}:  {azimuth} DEG                Location: {location}"]
    blocks = (("accel", "cm/sec2.", acceleration), ("veloc", "cm/sec.", 0 * acceleration),
              ("displ", "cm.", displacement))  # fmt: skip
    for kind, unit, values in blocks:
        step = f" {1 / RATE:.3f}"
        lines += [f"{len(values):5d} points of {kind} data equally spaced at {step} sec, in {unit}"
                  "    (8f10.5)"]  # fmt: skip
        cells = [f"{100 * value:10.5f}" for value in values]
        lines += ["".join(cells[k : k + 8]) for k in range(0, len(cells), 8)]
    return "\n".join([*lines, f"/&  ----------  End of data for channel {number}  ----------", ""])


def test_a_corrected_record_of_an_instrumented_building(tmp_path):
    channels = motion()
    ground, base, floor, x = channels.values()
    below = 0.02 * np.sin(TIME)
    content = channel_of_csmip(1, "Foundation", ground, below)
    content += channel_of_csmip(2, "Base slab", base, below + x)
    content += channel_of_csmip(3, "1st floor", floor, below + x)
    path = written(tmp_path, content, "24579.V2")
    imported = iso.import_building_record(path)
    assert_is(imported.record, channels, atol=1e-6)
    assert "isolator_displacement is base_displacement minus ground_displacement" in imported.notes
    assert "channel 2 acceleration 90 DEG Base slab" in imported.settings
    # displacements that do not belong to a channel, and lengths that differ
    cut = content.partition("  600 points of accel")[2].partition("  600 points of displ")
    assert "displacements of no channel" in refused(
        written(tmp_path, content.partition("\n")[0] + "\n" + "".join(cut[1:]), "cut.v2")
    )


def file_of_cosmos(number, location, quantity, values, units, azimuth=90):
    """Samples of one channel as COSMOS writes them: real headers with the step in ms at 62."""
    headers = [1000 / RATE if k == 62 else -999.0 for k in range(1, 101)]
    lines = [
        f"Corrected {quantity}   (Format v01.20 with 13 text lines)",
        f"Sta Chan {number:3d}:{azimuth:3d} deg (Rcrdr Chan {number:2d}) Location:{location}",
        "Record filtered below  0.08 Hz (periods over 12.5 secs), and above 40.0 Hz",
        " 100 Real-header values follow on 10 lines, Format= (10F13.6)",
        *("".join(f"{each:13.6f}" for each in headers[k : k + 10]) for k in range(0, 100, 10)),
        f" {N} {quantity} pts, approx {N / RATE:.0f} secs, units={units},Format=(1E15.6)",
        *(f"{100 * value:15.6e}" for value in values),
        f"End-of-data for Chan {number} {quantity}",
    ]
    return "\n".join([*lines, ""])


def test_a_record_in_one_file_for_each_quantity_of_each_channel(tmp_path):
    channels = motion()
    ground, base, floor, x = channels.values()
    places = {"Foundation": (ground, 0 * x), "Base slab": (base, x), "1st floor": (floor, x)}
    for k, (place, (acceleration, displacement)) in enumerate(places.items(), 1):
        for end, *one in (
            ("acc", "acceleration", acceleration, "cm/sec2(04)"),
            ("vel", "velocity", 0 * acceleration, "cm/sec(05)"),
            ("dis", "displacement", displacement, "cm(06)"),
        ):
            written(tmp_path, file_of_cosmos(k, place, *one), f"bmr.{k}.{end}.V2c")
    imported = iso.import_building_record(tmp_path)
    assert_is(imported.record, channels, atol=1e-6)
    left_out = "bmr.1.vel.V2c and 2 more: neither accelerations nor displacements; left out"
    assert left_out in imported.notes
    (told,) = [note for note in imported.notes if note.startswith("bmr.1.acc.V2c and 4 more: ")]
    assert "filtered below 0.08 Hz: slower and residual motion is missing" in told
    assert told.endswith("; 100 samples per second, as the file says")
    assert imported.record.filter.line == "filter = { high_pass_Hz = 0.08, low_pass_Hz = 40.0 }"
    given = {"filter": {"high_pass_Hz": [0.05, 0.1], "ground": False}}
    stated = iso.import_building_record(tmp_path, settings=given)
    assert stated.record.filter.high_pass_Hz == (0.05, 0.1) and not stated.record.filter.ground
    assert "filter = { high_pass_Hz = [0.05, 0.1], ground = false }" in stated.settings.replace(
        "(", "["
    )
    assert "Corrected velocity" in refused(tmp_path / "bmr.1.vel.V2c")


def test_locations_of_cosmos_have_brackets_and_floors_of_their_own(tmp_path):
    """Channels from 10 on have one blank less in their header; floors may count from the base."""
    channels = motion()
    ground, base, floor, x = channels.values()
    places = {
        "Foundation Level": (ground, 0 * x), "Base level (above isolators)": (base, x),
        "2nd Floor": (floor, x),
    }  # fmt: skip
    content = "".join(
        file_of_cosmos(k, place, quantity, values, units, azimuth)
        for azimuth, first in ((360, 9), (90, 12))
        for k, (place, pair) in enumerate(places.items(), first)
        for quantity, values, units in zip(
            ("acceleration", "displacement"), pair, ("cm/sec2(04)", "cm(06)"), strict=True
        )
    )
    path = written(tmp_path, content, "24605.V2")
    with pytest.raises(iso.InputError) as asked:
        iso.import_building_record(path)
    # all is clear but the direction
    assert "given directions 360deg, 90deg" in str(asked.value)
    assert "not clear" not in str(asked.value)
    settings = {"direction": "90 Deg"}
    imported = iso.import_building_record(path, settings=settings)
    (counted,) = [note for note in imported.notes if "is read as floor 2 above the base" in note]
    assert '--column floor1_acceleration="channel 14 acceleration 90 deg 2nd Floor' in counted
    settings |= {"channels": {"floor1_acceleration": "channel 14 acceleration 90 deg 2nd Floor"}}
    imported = iso.import_building_record(path, settings=settings)
    assert_is(imported.record, channels, atol=1e-6)
    assert not any("is read as floor" in note for note in imported.notes)
    # a ground floor may be the base or the first floor
    path.write_text(content.replace("Foundation Level", "Ground level"))
    assert "of the base without one of the ground" in refused(path, settings=settings)
    path.write_text(content.replace("Foundation Level", "Ground level, below isolators"))
    assert_is(iso.import_building_record(path, settings=settings).record, channels, atol=1e-6)


@pytest.mark.parametrize(
    ("azimuths", "settings", "signs"),
    [
        ((90, 90, 270), {}, (1, 1, -1)),
        ((180, 360, 360), {}, (-1, 1, 1)),
        ((90, 270, 90), {"direction": "270 Deg"}, (-1, 1, -1)),
    ],
)
def test_opposite_azimuths_have_opposite_signs(tmp_path, azimuths, settings, signs):
    ground, base, floor, x = channels = motion().values()
    below = 0.02 * np.sin(TIME)
    signals = ("Foundation", ground, below), ("Base slab", base, below + x), ("1st floor", floor, x)
    content = "".join(
        channel_of_csmip(k, place, sign * acceleration, sign * displacement, azimuth)
        for k, ((place, acceleration, displacement), azimuth, sign) in enumerate(
            zip(signals, azimuths, signs, strict=True), 1
        )
    )
    path = written(tmp_path, content, "24579.V2")
    imported = iso.import_building_record(path, settings=settings)
    assert_is(imported.record, dict(zip(motion(), channels, strict=True)), atol=1e-6)
    turned = [note for note in imported.notes if "is read with the sign -1" in note]
    assert any("opposite to" in note for note in turned)
    # the settings that are written say it, too
    again = written(tmp_path, imported.settings, "again.toml")
    assert_is(iso.import_building_record(path, settings=again).record, motion(), atol=1e-6)
