"""Reading of building records, and what is refused."""

from __future__ import annotations

import re

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import Record
from isolation_sim.discrepancy.building.causes.sensor_causes import _logged_together
from isolation_sim.discrepancy.building.channels import channel, required
from isolation_sim.discrepancy.building.record import BuildingRecord, read_building_record
from isolation_sim.discrepancy.building.record_checks import (
    check_quantities,
    record_problems,
    unmeasured_floors,
    without_offsets,
)
from isolation_sim.errors import InputError

NAMES = [
    "time_s", "ground_acceleration_m_s2", "base_acceleration_m_s2", "floor1_acceleration_m_s2",
    "floor3_acceleration_m_s2", "isolator_displacement_m", "current_A",
]  # fmt: skip
N = 400


def _rows(n=N):
    """A rigid building that moves on its isolators, from rest to rest."""
    t = 0.01 * np.arange(n)
    grown = np.sin(np.pi * t / t[-1]) ** 4
    x = 0.1 * grown * np.sin(6.0 * t)
    a = np.gradient(np.gradient(x, t), t)
    ground = 0.2 * grown * np.sin(9.0 * t)
    return np.column_stack([t, ground, a + ground, a + ground, a + ground, x, 0 * t + 1.5])


def _write(path, names, rows):
    text = "\n".join(",".join(f"{value:.10g}" for value in row) for row in np.asarray(rows))
    path.write_text(",".join(names) + "\n# a remark\n" + text + "\n")
    return path


def test_columns_in_any_order_come_out_from_below(tmp_path):
    rows, order = _rows(), [0, 5, 4, 3, 6, 2, 1]
    record = read_building_record(
        _write(tmp_path / "quake.csv", [NAMES[k] for k in order], rows[:, order])
    )
    assert record.name == "quake"
    assert record.floors == (1, 3)
    assert record.channels == tuple(NAMES[2:6])
    assert record.dt == pytest.approx(0.01)
    np.testing.assert_allclose(record.values, rows[:, 2:6], rtol=1e-8)
    np.testing.assert_allclose(record.ground[0].acceleration, rows[:, 1], rtol=1e-8)
    np.testing.assert_allclose(record.current, 1.5)


def test_other_units_are_converted_and_other_columns_are_not_used(tmp_path):
    units = {
        1: ("ground_acceleration_g", 1 / 9.80665),
        2: ("base_acceleration_cm_s2", 100.0),
        3: ("floor1_acceleration_mm_s2", 1e3),
        5: ("isolator_displacement_mm", 1e3),
    }
    names, rows = [*NAMES, "temperature_C"], np.column_stack([_rows(), np.arange(N)])
    for k, (name, factor) in units.items():
        names[k] = name
        rows[:, k] *= factor
    record = read_building_record(_write(tmp_path / "quake.csv", names, rows))
    assert record.channels == tuple(NAMES[2:6])
    np.testing.assert_allclose(record.values, _rows()[:, 2:6], rtol=1e-8)
    np.testing.assert_allclose(record.ground[0].acceleration, _rows()[:, 1], rtol=1e-8)
    assert record.notes == (
        "converted to SI: ground_acceleration_g, base_acceleration_cm_s2, "
        "floor1_acceleration_mm_s2, isolator_displacement_mm",
        "columns not used: temperature_C",
    )


def test_few_missing_samples_are_interpolated(tmp_path):
    rows = _rows()
    rows[7, 3] = np.nan
    record = read_building_record(_write(tmp_path / "quake.csv", NAMES, rows))
    assert record.response["floor1_acceleration_m_s2"][7] == pytest.approx(rows[[6, 8], 3].mean())
    assert record.notes == (
        "1 sample is missing in the floor1_acceleration_m_s2, first at 0.07 s; interpolated",
    )


def test_one_floor_of_any_number_is_enough(tmp_path):
    used = [0, 1, 2, 4, 5]
    path = tmp_path / "quake.csv"
    record = read_building_record(_write(path, [NAMES[k] for k in used], _rows()[:, used]))
    assert record.floors == (3,)
    _write(path, NAMES[:3] + NAMES[5:], _rows()[:, [0, 1, 2, 5, 6]])
    with pytest.raises(InputError, match="no column 'floor1_acceleration_m_s2'"):
        read_building_record(path)


def test_each_direction_needs_a_floor_of_its_own():
    given = ["floor3_x_acceleration", "base_y_acceleration", "floor2_rotation_acceleration"]
    keys = [one.key for one in required(("x", "y"), given)]
    assert [key for key in keys if key.startswith("floor")] == [
        "floor3_x_acceleration", "floor1_y_acceleration",
    ]  # fmt: skip


def test_floors_without_a_sensor_are_reported():
    structure = iso.reference_building()
    assert unmeasured_floors(_record(), structure) == (
        f"floors 4 to 5 of {structure.name} were not measured",
    )


@pytest.mark.parametrize(
    ("names", "change", "message"),
    [
        (NAMES[:5] + NAMES[6:], None, "no column 'isolator_displacement_m'"),
        ([*NAMES[:3], "floor1_acceleration_v", *NAMES[4:]], None, "did you mean"),
        (["Time_s", *NAMES[1:]], None, "did you mean 'time_s'"),
        ([*NAMES[:6], "isolator_displacement_mm"], None, "as 'isolator_displacement_m' and"),
        ([*NAMES[:4], NAMES[3], *NAMES[5:]], None, "given twice"),
        (NAMES, (slice(7, 60), 3, np.nan), "line 10, column floor1_acceleration_m_s2"),
        (NAMES, (7, 0, np.nan), "line 10, column time_s"),
        (NAMES, (7, 5, 60.0), "isolator_displacement_m: sample 7: given 60"),
        (NAMES, (7, 0, 0.074), "uniform times"),
        (NAMES, (slice(None), 4, 0.25), "the same number throughout"),
    ],
)
def test_what_cannot_be_used_is_one_line_with_the_place(tmp_path, names, change, message):
    rows = _rows()[:, : len(names)]
    if change is not None:
        rows[change[0], change[1]] = change[2]
    path = _write(tmp_path / "quake.csv", names, rows)
    with pytest.raises(InputError) as error:
        read_building_record(path)
    assert message in str(error.value)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


def test_a_short_file_and_a_missing_one_are_refused(tmp_path):
    path = _write(tmp_path / "short.csv", NAMES, _rows(20))
    with pytest.raises(InputError, match="20 samples; expected: 64 or more"):
        read_building_record(path)
    with pytest.raises(InputError, match=r"none\.csv"):
        read_building_record(tmp_path / "none.csv")


def _record(**changes):
    columns = dict(zip(NAMES, _rows(1600).T, strict=True))
    columns.update(changes)
    ground = Record(columns["ground_acceleration_m_s2"], 0.01, "quake")
    return BuildingRecord("quake", ground, {name: columns[name] for name in NAMES[2:6]})


def test_a_sound_record_has_no_problems():
    assert record_problems(_record()) == ()


@pytest.mark.parametrize("n", [400, 650, 800])
def test_a_record_that_ends_in_strong_motion_hangs_together(n):
    columns = dict(zip(NAMES, _rows(1600)[:n].T, strict=True))
    ground = Record(columns["ground_acceleration_m_s2"], 0.01, "quake")
    record = BuildingRecord("quake", ground, {name: columns[name] for name in NAMES[2:6]})
    assert record_problems(record) == ()


@pytest.mark.parametrize(
    ("channel", "spoil", "message"),
    [
        ("isolator_displacement_m", lambda x: 2 * x, "0.50 times"),
        ("isolator_displacement_m", lambda x: -x, "a sign"),
        ("isolator_displacement_m", lambda x: np.roll(x, 4), "40 ms behind"),
        ("base_acceleration_m_s2", lambda x: np.clip(x, -0.6 * x.max(), 0.6 * x.max()), "clipped"),
        ("floor1_acceleration_m_s2", lambda x: x + 2 * x.std(), "does not start at rest"),
        (
            "floor3_acceleration_m_s2",
            lambda x: 0.01 * x.std() * np.random.default_rng(0).standard_normal(x.size),
            "does not move with the building",
        ),
    ],
)
def test_what_does_not_hang_together_is_reported(channel, spoil, message):
    spoilt = spoil(_record().response[channel])
    assert any(message in problem for problem in record_problems(_record(**{channel: spoilt})))


@pytest.mark.parametrize("name", ["base", "ground"])
@pytest.mark.parametrize(
    ("factor", "units"), [(9.80665, "g and m/s^2"), (1 / 9.80665, "g and m/s^2"), (0.01, "cm/s^2")]
)
def test_a_single_accelerometer_in_another_unit_is_named(name, factor, units):
    record = _record()
    check_quantities(record)
    if name == "base":
        changed = factor * record.response["base_acceleration_m_s2"]
        record = _record(base_acceleration_m_s2=changed)
    else:
        record = _record(ground_acceleration_m_s2=factor * record.ground[0].acceleration)
    told = rf"the {name}'s acceleration is .* times the one that fits .*between {re.escape(units)}"
    with pytest.raises(InputError, match=told):
        check_quantities(record)


@pytest.mark.parametrize("name", ["base_acceleration_m_s2", "floor3_acceleration_m_s2"])
def test_a_turned_accelerometer_is_reported_with_what_to_do(name):
    turned = _record(**{name: -_record().response[name]})
    notes = [problem for problem in record_problems(turned) if "its sign is turned?" in problem]
    assert len(notes) == 1 and notes[0].startswith(name) and "sign = -1" in notes[0]


@pytest.mark.parametrize(("factor", "units"), [(1 / 9.81, "g and m/s^2"), (0.01, "cm/s^2")])
def test_a_floor_in_another_unit_is_reported(factor, units):
    name = "floor1_acceleration_m_s2"
    notes = record_problems(_record(**{name: factor * _record().response[name]}))
    assert len(notes) == 1 and notes[0].startswith(name) and units in notes[0]


TWO = [
    "time_s", "ground_x_acceleration_m_s2", "ground_y_acceleration_m_s2",
    "base_x_acceleration_m_s2", "base_y_acceleration_m_s2", "base_rotation_acceleration_rad_s2",
    "floor1_x_acceleration_m_s2", "floor1_y_acceleration_m_s2", "floor3_y_acceleration_m_s2",
    "isolator_x_displacement_m", "isolator_y_displacement_m", "current_A",
]  # fmt: skip


def _two_rows(n=N):
    """The rigid building, along y 0.6 times as much and a little twisted."""
    t, ground, base, _, _, x, current = _rows(n).T
    y = 0.6
    rows = t, ground, y * ground, base, y * base, 0.01 * base, base, y * base, y * base
    return np.column_stack([*rows, x, y * x, current])


def test_two_directions_are_read_by_their_names(tmp_path):
    order = [0, 9, 5, 2, 1, 8, 10, 3, 4, 7, 6]
    names, rows = [TWO[k] for k in order], _two_rows()
    record = read_building_record(_write(tmp_path / "quake.csv", names, rows[:, order]))
    assert record.axes == ("x", "y") and record.floors == (1, 3)
    assert record.channels == tuple(TWO[3:11])
    np.testing.assert_allclose(record.values, rows[:, 3:11], rtol=1e-8)
    for motion, column in zip(record.ground, (1, 2), strict=True):
        np.testing.assert_allclose(motion.acceleration, rows[:, column], rtol=1e-8)
    assert [sensor.words for sensor in record.sensors[:3]] == [
        "base x",
        "base y",
        "base rotation",
    ]
    assert [sensor.unit for sensor in record.sensors[2:4]] == ["rad/s2", "m/s2"]
    assert record_problems(record) == ()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("base_y_acceleration_m_s2", "base_acceleration_m_s2", "without a direction"),
        ("base_y_acceleration_m_s2", "base_acceleration_y_m_s2", "mean 'base_y_acceleration_m_s2'"),
        ("base_rotation_acceleration_rad_s2", "base_rotation_acceleration_m_s2", "did you mean"),
        ("ground_y_acceleration_m_s2", "floor4_y_acceleration_m_s2", "no column 'ground_y_"),
        ("floor3_y_acceleration_m_s2", "ground_rotation_acceleration_rad_s2", "unknown column"),
        ("isolator_y_displacement_m", "isolator_y_acceleration_m_s2", "unknown column"),
    ],
)
def test_names_that_do_not_fit_two_directions_are_refused(tmp_path, old, new, message):
    names = [new if name == old else name for name in TWO]
    path = _write(tmp_path / "quake.csv", names, _two_rows())
    with pytest.raises(InputError) as error:
        read_building_record(path)
    assert message in str(error.value) and f"{path}, line 1" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_rotation_needs_two_directions(tmp_path):
    names = [*NAMES[:6], "base_rotation_acceleration_rad_s2"]
    with pytest.raises(InputError, match="of a rotation beside one direction"):
        read_building_record(_write(tmp_path / "quake.csv", names, _rows()))


def test_exchanged_directions_are_reported():
    columns = dict(zip(TWO, _two_rows(1600).T, strict=True))
    ground = [Record(columns[name], 0.01, name) for name in TWO[1:3]]
    response = {name: columns[name] for name in TWO[3:11]}
    x, y = TWO[9:11]
    response[x], response[y] = response[y], response[x]
    problems = record_problems(BuildingRecord("quake", tuple(ground), response))
    assert len(problems) == 2
    assert "along x is 1.66 times" in problems[0] and "along y is 0.60 times" in problems[1]


def test_a_filter_is_stated_by_a_comment(tmp_path):
    path = _write(tmp_path / "quake.csv", NAMES, _rows())
    assert read_building_record(path).filter is None
    text = path.read_text()
    ramps = "filter = { high_pass_Hz = [0.05, 0.1], low_pass_Hz = 40.0, ground = false }"
    path.write_text(f"# made by a logger\n# {ramps}\n{text}")
    stated = read_building_record(path).filter
    assert (stated.high_pass_Hz, stated.low_pass_Hz) == ((0.05, 0.1), 40.0)
    assert stated.line == ramps and not stated.ground
    for line, message in (
        ("filter = {}", "no corner"), ("filter = 0.1", "such as filter = { high_pass_Hz = 0.1 }"),
        ("filter = { high_pass_Hz = [0.2, 0.1] }", "a lower and a higher frequency"),
        ("filter = { corner_Hz = 0.1 }", "corner_Hz"),
    ):  # fmt: skip
        path.write_text(f"# {line}\n{text}")
        with pytest.raises(InputError, match=re.escape(message)):
            read_building_record(path)


def test_offsets_of_most_channels_are_subtracted_before_the_motion():
    rng = np.random.default_rng(0)
    quiet, moving = np.zeros((500, len(NAMES))), _rows(1600)
    rows = np.vstack([quiet, moving, quiet]) + 1e-3 * rng.standard_normal((2600, len(NAMES)))

    def record(**offsets):
        columns = {
            name: values + offsets.get(name, 0.0)
            for name, values in zip(NAMES, rows.T, strict=True)
        }
        ground = Record(columns[NAMES[1]], 0.01, "quake")
        return BuildingRecord("quake", ground, {name: columns[name] for name in NAMES[2:6]})

    one_alone = record(base_acceleration_m_s2=0.05)
    assert without_offsets(one_alone) is one_alone
    shifts = dict(zip(NAMES[1:6], (0.02, -0.03, 0.05, 0.04, 2e-3), strict=True))
    centred, plain = without_offsets(record(**shifts)), without_offsets(record())
    np.testing.assert_allclose(centred.values, plain.values, atol=3e-4)
    difference = centred.ground[0].acceleration - plain.ground[0].acceleration
    np.testing.assert_allclose(difference, 0, atol=3e-4)
    assert "floor1_acceleration_m_s2 0.05" in centred.notes[-1]


@pytest.mark.parametrize(
    ("names", "together"),
    [
        (NAMES[2:6], ["all channels", "accelerations", "accelerations above the base"]),
        # both floors' accelerations are all, and one floor has one channel
        (NAMES[3:5], ["all channels"]),
        (
            ["base_x_acceleration_m_s2", "base_y_acceleration_m_s2",
             "floor4_x_acceleration_m_s2", "floor4_y_acceleration_m_s2"],
            ["all channels", "accelerations above the base", "channels of base"],
        ),
    ],
)  # fmt: skip
def test_channels_of_one_logger_may_be_late_together(names, together):
    loggers = _logged_together([channel(name) for name in names])
    assert list(loggers) == [*names, *together]
    assert all(set(some) <= set(names) for some in loggers.values())
