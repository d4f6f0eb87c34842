"""Reading of building records, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from ground_motions import Record
from isolation_sim.discrepancy.building.record import BuildingRecord, read_building_record
from isolation_sim.discrepancy.data_checks import record_problems
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
    assert record.ground.dt == pytest.approx(0.01)
    np.testing.assert_allclose(record.values, rows[:, 2:6], rtol=1e-8)
    np.testing.assert_allclose(record.ground.acceleration, rows[:, 1], rtol=1e-8)
    np.testing.assert_allclose(record.current, 1.5)


@pytest.mark.parametrize(
    ("names", "change", "told"),
    [
        (NAMES[:5] + NAMES[6:], None, "no column 'isolator_displacement_m'"),
        ([*NAMES[:3], "floor1_acceleration_g", *NAMES[4:]], None, "did you mean"),
        ([*NAMES[:4], NAMES[3], *NAMES[5:]], None, "given twice"),
        (NAMES, (7, 3, np.nan), "line 10, column floor1_acceleration_m_s2"),
        (NAMES, (7, 5, 60.0), "isolator_displacement_m: sample 7 is 60"),
        (NAMES, (7, 0, 0.074), "uniform times"),
        (NAMES, (slice(None), 4, 0.25), "the same number throughout"),
    ],
)
def test_what_cannot_be_used_is_one_line_with_the_place(tmp_path, names, change, told):
    rows = _rows()[:, : len(names)]
    if change is not None:
        rows[change[0], change[1]] = change[2]
    path = _write(tmp_path / "quake.csv", names, rows)
    with pytest.raises(InputError) as error:
        read_building_record(path)
    assert told in str(error.value)
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


@pytest.mark.parametrize(
    ("channel", "spoil", "told"),
    [
        ("isolator_displacement_m", lambda x: 2 * x, "0.50 times"),
        ("isolator_displacement_m", lambda x: -x, "a sign"),
        ("isolator_displacement_m", lambda x: np.roll(x, 4), "40 ms behind"),
        ("base_acceleration_m_s2", lambda x: np.clip(x, -0.6 * x.max(), 0.6 * x.max()), "clipped"),
        ("floor1_acceleration_m_s2", lambda x: x + 2 * x.std(), "does not start at rest"),
    ],
)
def test_what_does_not_hang_together_is_told(channel, spoil, told):
    spoilt = spoil(_record().response[channel])
    assert any(told in problem for problem in record_problems(_record(**{channel: spoilt})))
