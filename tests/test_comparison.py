"""Comparison of controllers: what it refuses, its numbers, its table and its report."""

import json
import re

import pytest
from rich.console import Console

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.comparison import Comparison, json_report
from isolation_sim.criteria import criteria
from isolation_sim.reports.tables import as_text, criteria_tables, run_table

GROUND = el_centro_1940().cut(0, 8)
CONTROLLERS = ("passive_off", "passive_on", "on_off")


@pytest.fixture(scope="module")
def isolated():
    return iso.reference_building().on(iso.reference_isolators())


@pytest.fixture(scope="module")
def comparison(isolated):
    return Comparison({name: iso.simulate(isolated, GROUND, name) for name in CONTROLLERS})


def rows(text):
    """Cells of each row by its label; a label of two groups is the later one's."""
    pattern = re.compile(r"^ +(\S.*?) +((?:(?:-?\d\S*|nan|-)(?: +|$))+)$", re.MULTILINE)
    return {label: cells.split() for label, cells in pattern.findall(text)}


def test_criteria_are_against_passive_off(comparison):
    assert comparison.reference == "passive_off"
    reference = comparison.runs["passive_off"]
    for name, run in comparison.runs.items():
        assert comparison.criteria[name] == criteria(run, reference)
    for key in ("J1", "J2", "J3", "J4", "J5", "J7", "J8"):
        assert comparison.criteria["passive_off"][key] == 1.0


def test_another_reference(comparison):
    other = Comparison(comparison.runs, reference="passive_on")
    assert other.criteria["passive_on"]["J3"] == 1.0
    assert other.criteria["passive_off"]["J3"] > 1.0


def test_without_passive_off_there_are_no_ratios(comparison):
    alone = Comparison({"passive_on": comparison.runs["passive_on"]})
    assert alone.reference is None
    assert not any(key.startswith("J") for key in alone.criteria["passive_on"])
    assert "Benchmark" not in str(alone)
    assert "*" not in str(alone)


def test_the_reference_is_recognised_under_another_label(comparison):
    other = Comparison({"on": comparison.runs["passive_on"], "off": comparison.runs["passive_off"]})
    assert other.reference == "off"
    assert other.criteria["on"]["J3"] == comparison.criteria["passive_on"]["J3"]


def test_a_missing_ratio_says_what_it_needs(comparison):
    alone = Comparison({"passive_on": comparison.runs["passive_on"]})
    for values in (alone.criteria["passive_on"], comparison.runs["on_off"].criteria):
        with pytest.raises(iso.InputError, match="'J1' is a ratio to the run without current"):
            values["J1"]
    with pytest.raises(iso.InputError, match="unknown criterion 'J10'"):
        comparison.criteria["on_off"]["J10"]


def test_it_prints_the_verdict_and_the_best_current(isolated):
    comparison = iso.compare(isolated, GROUND, ["passive_off", "best_constant"])
    *sentences, last = comparison.verdict()
    assert len(sentences) == 2 and "together" in sentences[0]
    assert re.fullmatch(r"best constant: \S+ A, found by trial runs of this motion", last)
    assert str(comparison).endswith("\n".join([*sentences, last]))
    assert str(comparison.runs["best_constant"]).endswith(last)


def test_refusals(comparison, isolated):
    run = comparison.runs["passive_off"]
    with pytest.raises(iso.InputError, match="one run or more"):
        Comparison({})
    with pytest.raises(iso.InputError, match="did you mean 'passive_off'"):
        Comparison(comparison.runs, reference="pasive_off")
    shorter = iso.simulate(isolated, GROUND.cut(0, 4), "passive_off")
    with pytest.raises(iso.InputError, match="'a' and 'b' differ in ground motion"):
        Comparison({"a": run, "b": shorter})
    small = iso.shear_building([1e5], [1e8], base_mass=1e5).on(iso.reference_isolators())
    with pytest.raises(iso.InputError, match="'a' and 'b' differ in dofs"):
        Comparison({"a": run, "b": iso.simulate(small, GROUND, "passive_off")})
    with pytest.raises(iso.InputError, match="unknown figure 'loop'; did you mean 'loops'"):
        comparison.plot("loop")


def test_energies(comparison):
    for name, run in comparison.runs.items():
        assert comparison.energy[name]["input_J"] == run.energy.final["input_J"]
        assert comparison.energy[name]["closure_error"] < 1e-4
    assert comparison.energy["on_off"]["field_work_J"] != 0.0
    assert comparison.energy["passive_on"]["field_work_J"] == 0.0


def test_table_in_engineering_units(comparison):
    cells = rows(str(comparison))
    peaks = [run.criteria["peak_base_displacement_m"] for run in comparison.runs.values()]
    shown = [float(cell.rstrip("*")) for cell in cells["base displacement, mm"]]
    rms = [run.criteria["rms_base_displacement_m"] for run in comparison.runs.values()]
    assert shown == pytest.approx([1e3 * value for value in rms], rel=1e-3)
    assert f"{1e3 * peaks[0]:.4g}" in str(comparison)
    assert float(cells["input, kJ"][0]) == pytest.approx(
        1e-3 * comparison.energy["passive_off"]["input_J"], rel=1e-3
    )


def test_the_best_of_a_row_is_marked(comparison):
    cells = rows(str(comparison))
    for label, best in (
        ("J3 peak isolator displacement", min),
        ("J9 control work / input energy", max),
    ):
        values = [float(cell.rstrip("*")) for cell in cells[label]]
        marked = [cell.endswith("*") for cell in cells[label]]
        assert marked == [value == best(values) for value in values]
    # energies are an account, not a score
    assert not any(cell.endswith("*") for cell in cells["input, kJ"])


def test_seven_long_names_fit_a_terminal(comparison):
    names = [
        "passive_off",
        "passive_on",
        "best_constant",
        "clipped_lqr",
        "sliding_mode",
        "model_predictive_control",
        "clairvoyant",
    ]
    runs = list(comparison.runs.values())
    seven = Comparison({name: runs[k % 3] for k, name in enumerate(names)})
    text = as_text(seven.table())
    assert max(len(line) for line in text.splitlines()) <= 100
    assert "…" not in text
    header = text[: text.index("Peak")]
    for word in ("predictive", "clairvoyant", "sliding", "constant"):
        assert word in header
    assert all(len(cells) == 7 for cells in rows(text).values())


def test_a_missing_number_leaves_its_place():
    table = criteria_tables(
        {"[a]": {"J1": 0.5, "J9": float("nan")}, "b": {"J9": 0.25}}, {"[a]": {}, "b": {}}
    )
    assert "[a]" in as_text(table)
    cells = rows(as_text(table))
    assert cells["J1 peak base shear"] == ["0.5000*", "-"]
    assert cells["J9 control work / input energy"] == ["nan", "0.2500*"]


def test_it_prints_itself(comparison):
    console = Console(width=100, color_system=None)
    with console.capture() as capture:
        console.print(comparison)
    assert "passive" in capture.get()
    assert "J9" in capture.get()
    assert "on_off" in repr(comparison)
    assert "base shear, kN" in as_text(run_table(comparison.runs["on_off"]))


def test_records_are_flat(comparison):
    records = comparison.to_records()
    assert [record["controller"] for record in records] == list(CONTROLLERS)
    assert records[1]["J3"] == comparison.criteria["passive_on"]["J3"]
    assert records[1]["energy_input_J"] == comparison.energy["passive_on"]["input_J"]
    for record in records:
        assert record.keys() == records[0].keys()
        assert all(type(v) is float for k, v in record.items() if k != "controller")


def test_json_report(comparison):
    report = json.loads(json.dumps(json_report(comparison), allow_nan=False))
    assert list(report) == ["runs", "diverged", "warnings"] and report["diverged"] == []
    assert report["warnings"] == comparison.warnings()
    assert [run["controller"] for run in report["runs"]] == list(CONTROLLERS)
    for run in report["runs"]:
        assert set(run) == {"controller", "criteria", "energy"}
        assert {
            "peak_base_displacement_m",
            "peak_floor_acceleration_m_s2",
            "peak_drift_m",
            "peak_base_shear_N",
            "rms_drift_m",
            "J1",
            "J9",
        } <= set(run["criteria"])
        assert {"closure_error", "field_work_J", "input_J"} <= set(run["energy"])
        assert all(type(v) is float for part in ("criteria", "energy") for v in run[part].values())
    assert report["runs"][2]["criteria"] == comparison.criteria["on_off"]


@pytest.mark.parametrize(
    "kind", ["time_histories", "loops", "currents", "floor_envelopes", "energy"]
)
def test_plots(comparison, kind):
    assert comparison.plot(kind).axes
