"""Tables in narrow terminals: numbers stay whole, headings break between words, nothing is cut."""

import numpy as np
import pytest

from isolation_sim.discrepancy.diagnosis import Cause, Diagnosis, Errors, Interval
from isolation_sim.discrepancy.interval import percent
from isolation_sim.reports.diagnosis import causes_tables, shown
from isolation_sim.reports.tables import (
    TextTable,
    as_text,
    criteria_lines,
    criteria_tables,
    title_of,
)
from isolation_sim.written_names import as_written, number_text

HEADINGS = ("run", "simulation.computation_delay_s", "95 % interval", "error, %", "what it is",
            "unit")  # fmt: skip
ROWS = [
    ("4mm_1Hz_isolator_number_7", "0.0033333", "849 to 1101.3", "39.39", "a text of some length "
     "that may be broken between its words", "N s/m"),
    ("8mm", "0.01", "19201 to 20787", "< 1e-9", "", "N"),
]  # fmt: skip


@pytest.mark.parametrize("width", [60, 80, 100, 250])
def test_numbers_and_words_stay_whole(width):
    text = as_text(TextTable("A title", HEADINGS, ROWS), width)
    assert max(map(len, text.splitlines())) <= width and "…" not in text
    for row in ROWS:
        for cell in (*row[:4], row[5]):
            assert cell in text
        for word in row[4].split():
            assert word in text.split()
    for word in ("simulation.", "delay_s", "interval", "error, %", "unit"):
        assert word in text
    # a part below begins with the key again, and only where one is needed
    assert text.count("4mm_1Hz_isolator_number_7") == (1 if width >= 100 else 2)


def test_totals_stand_below_a_line():
    text = as_text(TextTable("", ("run", "error, %"), [("a", "1.5"), ("all", "2.5")], totals=1))
    lines = [line.split() for line in text.splitlines()]
    assert lines.index(["all", "2.5"]) - lines.index(["a", "1.5"]) == 2


def test_intervals_of_causes_stay_whole():
    numbers = {
        "level": Interval(20.02, 19.91, 20.13, "N"),
        "velocity": Interval(0.001021, 0.000983, 0.00106, "m/s", at_bound=True),
    }
    causes = tuple(
        Cause(name, 0.9, 1e-12, numbers, "It.", form="power_by_current")
        for name in ("coulomb_friction", "tension_compression_asymmetry")
    )
    nothing = Errors(np.nan, np.nan)
    diagnosis = Diagnosis(
        "tests", "law", "explained", 0.0, nothing, nothing, causes, 0.0, (), None, ()
    )
    for width in (80, 100):
        causes, values = (as_text(table, width) for table in causes_tables(diagnosis))
        text = causes + values
        assert max(map(len, text.splitlines())) <= width
        assert text.count("20.02 (19.9 to 20.1)") == 2
        assert text.count("0.001021 (0.000983 to 0.00106)") == 2
        assert text.count("at its bound") == 2
        assert "power_by_current" in text and "< 1e-9" in text


def test_ends_of_an_interval_differ_from_its_value():
    for numbers, said in (
        ((0.2998, 0.2991, 0.3005), "0.2998 (0.2991 to 0.3005)"),
        ((20.02, 19.91, 20.13), "20.02 (19.9 to 20.1)"),
        ((3.0, 3.0, 3.0), "3"),
        ((0.5, 0.5, 0.61), "0.5 (0.5 to 0.61)"),
        ((1.0, -np.inf, np.inf), "1 (not determined)"),
    ):
        assert str(Interval(*numbers, "1")) == said
    assert [percent(share) for share in (0.0123, 0.9961, 1.0, 3.21)] == ["1.2", "100", "100", "321"]


def test_a_cause_in_a_sensor_shows_its_channel_and_empty_columns_are_left_out():
    nothing, place = Errors(np.nan, np.nan), "floor3_acceleration_m_s2"
    gain = {"gain": Interval(1.15, 1.14, 1.16, "1")}
    cause = Cause("sensor_gain", 0.9, 1e-12, gain, "It.", place=place)
    diagnosis = Diagnosis("a", "b", "explained", 0.0, nothing, nothing, (cause,), 0.0, (), None, ())
    causes, values = causes_tables(diagnosis)
    assert causes.headings == ["cause", "place", "share of the misfit, %", "p"]
    assert causes.rows[0][1] == place == diagnosis.to_dict()["causes"][0]["place"]
    assert values.rows == [("sensor_gain", "gain", "1.15 (1.14 to 1.16)", "1")]


def test_equal_causes_at_two_places_keep_their_numbers_apart():
    nothing, places = Errors(np.nan, np.nan), ("storey1", "storey2")
    loss = {"loss": Interval(0.2, 0.19, 0.21, "1")}
    causes = tuple(Cause("storey_stiffness", 0.4, 0.0, loss, "It.", place=one) for one in places)
    diagnosis = Diagnosis("a", "b", "explained", 0.0, nothing, nothing, causes, 0.0, (), None, ())
    _, values = causes_tables(diagnosis)
    assert [row[0] for row in values.rows] == [f"storey_stiffness ({one})" for one in places]


def test_evidence_for_a_cause_names_its_place():
    nothing, place = Errors(np.nan, np.nan), "floor3_acceleration_m_s2"
    cause = Cause("sensor_gain", 0.9, 1e-12, {}, "It.", place=place)
    diagnosis = Diagnosis("a", "b", "explained", 0.0, nothing, nothing, (cause,), 0.0, (), None, ())
    assert f"sensor_gain ({place}): It." in list(shown(diagnosis))


def test_suspicious_data_are_said_before_the_verdict():
    nothing = Errors(np.nan, np.nan)
    notes = ("all runs: the loops run the wrong way round", *(f"r{k}: clipped?" for k in range(6)))
    diagnosis = Diagnosis(
        "tests", "law", "unexplained", 0.0, nothing, nothing, (), 0.0, (), None, (),
        data_notes=notes,
    )  # fmt: skip
    lines = [line for line in shown(diagnosis) if isinstance(line, str)]
    assert lines[1] == "Data: all runs: the loops run the wrong way round."
    assert lines[2] == "Data: r0: clipped?"
    assert lines[6] == "Data: 2 more in the step Data."
    assert lines[7].startswith("UNEXPLAINED.")
    assert diagnosis.to_dict()["data_notes"] == list(notes)


def test_adequate_on_the_fitted_data_alone_is_said():
    said = {0.011: "no effect is missing.", 0.03: "misses the data held out by more"}
    for held_out, words in said.items():
        error = Errors(0.01, held_out)
        diagnosis = Diagnosis("tests", "law", "adequate", 0.01, error, error, (), 0.0, (), None, ())
        lines = [line for line in shown(diagnosis) if isinstance(line, str)]
        assert words in lines[1]


def test_the_place_of_a_controller_is_not_written_as_words():
    assert as_written("clipped_lqr") == "clipped LQR"
    assert as_written("my_control.py:StaticOutput") == "my_control.py:StaticOutput"


def test_criteria_have_one_label_in_all_tables():
    assert title_of("peak_drift_m") == "peak storey drift"
    assert title_of("rms_superstructure_acceleration_m_s2") == "RMS floor accel. above base"
    assert title_of("J5") == "J5 peak floor acceleration"
    assert title_of("isolator_travel_m") == "travel of the isolators"
    assert title_of("normalised_peak_drift") == "normalised peak drift"


def test_criteria_of_jerk_and_of_mean_squares_have_a_unit():
    for name, line in {"jerk_m_s3": "jerk, m/s³", "square_m2_s4": "square, m²/s⁴"}.items():
        ((label, _),) = criteria_lines({"off": {name: 1.0}}, {"off": {}})["Further"]
        assert label == line


def test_large_numbers_have_no_exponent():
    assert [number_text(n) for n in (10970.0, 1.0, 0.0012)] == ["10970", "1.000", "1.2e-03"]


def test_one_run_has_no_ratios_to_itself():
    ones = {f"J{k}": 1.0 for k in range(1, 9)}
    assert "Benchmark" not in criteria_lines({"off": ones}, {"off": {}})
    assert "Benchmark" in criteria_lines({"off": ones, "on": ones}, {"off": {}, "on": {}})


def test_a_star_is_explained_where_one_stands():
    names = [f"controller_{k}" for k in range(9)]
    criteria = {name: {"peak_drift_m": 1e-3 * k} for k, name in enumerate(names, 1)}
    first, *_, last = as_text(criteria_tables(criteria, {name: {} for name in names}), 80).split(
        "\n\n"
    )
    assert "1.000*" in first and first.endswith("* best of the row") and "*" not in last
    alike = {name: {"peak_drift_m": 1e-3} for name in names}
    assert "*" not in as_text(criteria_tables(alike, {name: {} for name in names}))
