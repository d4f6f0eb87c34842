"""The report of a sweep: the reader chooses runs, and sees those and no others."""

import base64

import numpy as np
import pandas
import pytest

from isolation_sim.errors import InputError
from isolation_sim.reports.html.explorer import explorer
from isolation_sim.reports.html.sweep_report import sweep_report
from isolation_sim.reports.sweep_tables import controllers_table
from isolation_sim.sweeps import Sweep, sweep
from isolation_sim.written_names import as_written
from studies.report import study_report

MOST = 6_000_000
FLOOR = "peak_floor_acceleration_m_s2"
PLAN = {
    "name": "scales",
    "scenario": {
        "ground": {"stop_s": 2.0},
        "controller": [{"name": "passive_off"}, {"name": "on_off"}],
    },
    "vary": [
        {"field": "ground.scale_factor", "label": "scale", "values": [0.5, 1.0, 1e5]},
        {"field": "isolator.count", "label": "isolators", "factor": True, "values": [0.8, 1.2]},
    ],
}


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """Two controllers, six cases; a third of them fail."""
    return sweep(PLAN, tmp_path_factory.mktemp("sweep") / "scales", workers=1)


@pytest.fixture(scope="module")
def large(swept):
    """The same repeated, with another scale and result each, to twelve thousand runs."""
    sweep = Sweep(swept.folder)
    once = swept.table[swept.table["status"] == "ok"]
    table = pandas.concat([once] * 1500, ignore_index=True)
    random = np.random.default_rng(0)
    table["case"] = np.arange(len(table)) // 2
    table["scale"] = np.repeat(random.uniform(0.2, 2.0, len(table) // 2), 2)
    table[FLOOR] *= random.uniform(0.5, 2.0, len(table))
    vars(sweep)["table"] = table
    return sweep


def floats(text):
    return np.frombuffer(base64.b64decode(text), "<f4")


def codes(field):
    return np.frombuffer(base64.b64decode(field["codes"]), "u1")


def test_the_explorer_holds_the_runs_that_ended_well(swept):
    data = explorer(swept, FLOOR).data
    good = swept.table[swept.table["status"] == "ok"]
    assert len(good) == 8
    for field, name in zip(data["fields"], ("controller", "scale", "isolators"), strict=True):
        shown = [field["groups"][code] for code in codes(field)]
        expected = (
            good[name].map(as_written) if name == "controller" else good[name].map("{:.5g}".format)
        )
        assert shown == list(expected)
    chosen = data["criteria"][data["criterion"]]
    assert chosen["name"] == "peak floor acceleration, m/s²" and not chosen["more"]
    np.testing.assert_allclose(floats(chosen["values"]), good[FLOOR], rtol=1e-6)
    against = data["criteria"][data["against"]]
    expected = 1e3 * good["peak_base_displacement_m"]
    np.testing.assert_allclose(floats(against["values"]), expected, rtol=1e-6)


def test_the_report_says_what_came_of_the_sweep(swept):
    text = sweep_report(swept, "rms_drift_m").html().replace("\u00a0", " ")
    good = swept.table[swept.table["status"] == "ok"]
    best = good.loc[good["rms_drift_m"].idxmin()]
    for phrase in (
        "12 runs: 6 cases under 2 controllers; 4 failed.",
        f"The lowest RMS storey drift, {1e3 * best['rms_drift_m']:.4g} mm, is that of "
        f"{as_written(best['controller'])} in case {best['case']} (scale {best['scale']:.5g}",
        "diverged", "table.npz", "--csv",
    ):  # fmt: skip
        assert phrase in text, phrase
    median = good.groupby("controller")["peak_drift_m"].median()["on_off"]
    assert f"{1e3 * median:.4g}" in text
    with pytest.raises(InputError, match="did you mean 'rms_drift_m'"):
        sweep_report(swept, "rms_drft_m")


def test_controllers_that_print_alike_are_equally_good(swept):
    equal = Sweep(swept.folder)
    table = swept.table.copy()
    on, off = (table["controller"] == name for name in ("on_off", "passive_off"))
    for name in (FLOOR, "peak_drift_m"):
        table.loc[on, name] = table.loc[off, name].to_numpy() * (1 + 1e-9)
    vars(equal)["table"] = table
    page = sweep_report(equal, FLOOR)
    assert "is that of passive off and on-off in case" in page.sections[0].blocks[0].paragraphs[1]
    rows = page.sections[1].blocks[0].rows
    marks = {row.label: [cell.mark for cell in row.cells] for row in rows}
    # nothing to choose where all print alike; J6 is 1 for every isolated building
    assert marks["peak storey drift, mm"] == marks["J6 control device / base shear"] == ["", ""]
    assert sorted(marks["peak base displacement, mm"]) == ["", "best"]
    assert page.sections[1].blocks[0].note == "* best of the row. J1 to J8 refer to passive off."


def test_a_table_without_marks_explains_none(swept):
    alone = Sweep(swept.folder)
    off = swept.table["controller"] == "passive_off"
    vars(alone).update(table=swept.table[off], controllers=("passive_off",))
    page = sweep_report(alone, FLOOR)
    assert page.sections[1].blocks[0].note == controllers_table(alone).caption == ""


def test_a_sweep_without_a_good_run_still_has_a_report(swept):
    bad = Sweep(swept.folder)
    vars(bad)["table"] = swept.failed
    titles = [section.title for section in sweep_report(bad, FLOOR).sections]
    assert titles == ["Verdict", "Failed runs", "Inputs and versions"]
    assert "nothing to compare" in sweep_report(bad, FLOOR).html()


def test_ten_thousand_runs_stay_small_and_the_best_are_among_them(large, tmp_path):
    path = large.to_html(tmp_path / "report.html")
    assert 5_000_000 < path.stat().st_size < MOST
    data = explorer(large, FLOOR).data
    values, controller = floats(data["criteria"][1]["values"]), codes(data["fields"][0])
    cases = floats(data["cases"])
    assert 5000 < len(cases) < len(large.table)
    for code, label in enumerate(data["fields"][0]["groups"]):
        own = large.table.loc[large.table["controller"].map(as_written) == label, FLOOR]
        computed = np.sort(values[controller == code])[:12]
        np.testing.assert_allclose(computed, np.sort(own)[:12], rtol=1e-6)
    # a quantity with many values is chosen by intervals, which hold them
    scale = data["fields"][1]
    ends = np.array([group.split(" to ") for group in scale["groups"]], float)
    assert len(ends) == 8
    each = floats(scale["values"])
    low, high = ends[codes(scale)].T
    assert np.all((each > low - 0.01) & (each < high + 0.01))


def test_the_report_is_operated(swept, opened, until, tmp_path, cut_off):
    page = opened(swept.to_html(tmp_path / "report.html"), width=390)
    assert cut_off(page) == []
    page.set_viewport_size({"width": 1400, "height": 900})
    until(page, "[...document.querySelectorAll('.plot')].every(p => p._fullLayout.width > 1000)")
    assert cut_off(page) == []
    table = page.locator(".explorer tbody tr")
    good = swept.table[swept.table["status"] == "ok"]
    ordered = good.sort_values(FLOOR)
    assert table.locator("th").all_inner_texts() == [str(case) for case in ordered["case"]]

    # a map is of one controller, the best run's if the reader does not choose
    title = page.locator(".explorer figcaption").last
    assert title.inner_text().endswith(
        "over scale and isolators, " + as_written(ordered["controller"].iloc[0])
    )
    page.locator(".explorer [data-field='0']").select_option("on-off")
    assert title.inner_text().endswith("over scale and isolators, on-off")
    assert page.locator(".explorer output").inner_text() == "4 of 8 runs"
    assert set(table.locator("td:nth-child(2)").all_inner_texts()) == {"on-off"}
    points = "[...document.querySelectorAll('.explorer .plot')][1].data.map((t) => t.x.length)"
    until(page, f"JSON.stringify({points}) === '[0,4]'")
    page.locator(".explorer [data-field='1']").select_option("0.5")
    assert table.count() == 2

    page.locator("[data-role=criterion]").select_option("RMS storey drift, mm")
    own = good[(good["controller"] == "on_off") & (good["scale"] == 0.5)]
    shown = table.locator("td:nth-child(5)").all_inner_texts()
    np.testing.assert_allclose(np.array(shown, float), 1e3 * np.sort(own["rms_drift_m"]), rtol=1e-3)
    assert "highest" not in page.locator(".explorer caption").inner_text()
    cells = "document.querySelectorAll('.explorer .plot')[2].data[0].z"
    page.locator("[data-role=up]").select_option("controller")
    page.locator("[data-role=across]").select_option("isolators")
    drawn = page.evaluate(cells)
    assert drawn[0] == [None, None]  # passive_off is not among the chosen
    expected = 1e3 * own.sort_values("isolators")["rms_drift_m"]
    np.testing.assert_allclose(drawn[1], expected, rtol=1e-6)

    failed = page.locator("section#failed-runs")
    failed.locator("select").first.select_option("passive off")
    assert failed.locator("tbody tr:visible").count() == 2


def test_a_result_is_once_among_the_best_runs(swept, opened, tmp_path):
    """Of a quantity that no controller depends on; the lines are of all controllers."""
    twice = Sweep(swept.folder)
    more = swept.table.assign(case=swept.table["case"] + 6, isolators=7.0)
    vars(twice)["table"] = pandas.concat([swept.table, more], ignore_index=True)
    page = opened(twice.to_html(tmp_path / "report.html"))
    assert page.locator(".explorer tbody tr").count() == 8
    assert page.locator(".explorer output").inner_text() == "16 of 16 runs"
    lines = page.evaluate(
        "document.querySelector('.explorer .plot').data.map((t) => [t.name, t.x.length])"
    )
    assert [name for name, _ in lines] == ["other runs", "passive off", "on-off", "best"]
    per_run = lines[-1][1]
    assert lines[0][1] == 16 * per_run and lines[1][1] == lines[2][1] == 4 * per_run


def test_a_study_is_shown_with_its_table_and_figures(tmp_path):
    (tmp_path / "two_maps.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
    rows = [["far", "1.5", "a"], ["far", "1.5", "b"], ["near", "2", "c"]]
    page = study_report(
        "Periods", ["It is so.", "And so."], {"Found": (["motion", "gap, m", "who"], rows)},
        [tmp_path / "two_maps.svg"], "which period suits", "isolation-sim study periods",
    )  # fmt: skip
    table = page.sections[1].blocks[0]
    # words that repeat are worth choosing by; numbers, and names that are all different, are not
    assert table.filters == ("motion",)
    text = page.html()
    for phrase in ("It is so.", "Two maps", "data:image/svg+xml;base64,", "Which period suits",
                 "isolation-sim study periods"):  # fmt: skip
        assert phrase in text, phrase
    assert "Plotly, Inc." not in text
