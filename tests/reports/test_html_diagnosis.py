"""The report of a diagnosis tells what was found, in order, and shows the runs' own numbers."""

from dataclasses import replace

import numpy as np
import pytest

import isolation_sim as iso
from isolation_sim.discrepancy.consequence import Consequence, Performance
from isolation_sim.discrepancy.diagnosis import Cause, Diagnosis, Errors, Interval, Step, Trace
from isolation_sim.discrepancy.planned_tests import PlannedTest, TestPlan
from isolation_sim.discrepancy.tiers.result import Ladder, Rung
from isolation_sim.effects import effect, extend
from isolation_sim.reports.diagnosis import markdown
from isolation_sim.reports.diagnosis_figures import STRONGEST, errors, histories, loops
from isolation_sim.reports.html.diagnosis_report import diagnosis_report, equations

MOST = 6_000_000


@pytest.mark.parametrize("where", ["choice", "ladder"])
def test_another_law_that_is_far_better_is_reported_before_the_verdict(diagnosis, where):
    said = "Another law is better: Spencer."
    n_known = replace(
        diagnosis,
        **{"details": {"law_choice": {"text": said, "wrong_family": True, "laws": []}}}
        if where == "choice"
        else {"ladder": Ladder((Rung("law", 0.1, 0.1, 0.1),), better_law=said)},
    )
    verdict = diagnosis_report(n_known).sections[0].blocks[0].paragraphs[0]
    assert verdict == said
    for text, first in ((n_known.summary(), "EXPLAINED."), (markdown(n_known), "**Explained.**")):
        assert text.count(said) == 1 and text.index(said) < text.index(first)


def test_a_noise_floor_far_below_leaves_the_room_to_the_errors(diagnosis):
    """A near floor has a line; the value of a far one is written."""
    floor = "noise floor, all fitted runs"
    near = errors(diagnosis)
    far = errors(replace(diagnosis, noise_floor=1e-5))
    assert floor in near.lines and "noise floor" not in near.x
    assert floor not in far.lines and far.x.endswith("noise floor of all fitted runs 0.001 %")


def test_the_plan_of_tests_stands_below_the_next_test(diagnosis):
    test = PlannedTest(4e-3, 2.0, (0.0, 1.5), 12.0, 500.0, "tells a from b", step=2.0)
    planned = replace(diagnosis, test_plan=TestPlan("rig 3", (test,), ("One frequency.",)))
    (section,) = (s for s in diagnosis_report(planned).sections if s.title == "Next test")
    said, table, notes = section.blocks
    assert said.paragraphs == ("Test at 4 mm and 2 Hz.",) and notes.paragraphs == (
        "One frequency.",
    )
    (row,) = table.rows
    assert [cell.text for cell in row.cells] == ["4", "2", "24", "0 / 1.5 every 2 s", "500",
                                                 "tells a from b"]  # fmt: skip


def trace(name, friction, held_out):
    """Spring and friction; the simulation before knows no friction."""
    time = np.arange(1500) / 256
    x = np.sin(2 * np.pi * time)
    before = 50 * x
    measured = before + friction * np.sign(np.cos(2 * np.pi * time))
    return Trace(name, held_out, time, x, "deformation, mm", "force, N", measured, before,
                 measured + 0.5)  # fmt: skip


@pytest.fixture(scope="module")
def diagnosis():
    friction = effect("coulomb_friction", "dahl")
    device = extend(
        iso.law("kelvin_voigt", {"k": 5e4, "c": 100.0}),
        [(friction, {"level": 25.0, "length": 1e-4})],
    )
    cause = Cause(
        "coulomb_friction", 0.98, 1e-12,
        {"level": Interval(25.0, 24.5, 25.5, "N"), "length": Interval(1e-4, 8e-5, 1.2e-4, "m")},
        "Without friction the residual is six times as large.", ("end_stop",), "dahl",
    )  # fmt: skip
    return Diagnosis(
        data="rig 3", model="Kelvin-Voigt", verdict="explained", noise_floor=0.011,
        error_before=Errors(0.2, 0.25), error_after=Errors(0.012, 0.013), causes=(cause,),
        unexplained_share=0.02, depends_on=("velocity",), next_test="Test at 4 mm and 2 Hz.",
        steps=(
            Step("The data", "Nothing looks wrong."),
            Step("Dependence of the residual", "Parts of the misfit.",
                 ("function of", "misfit predicted"), (("velocity alone", "39 %"),)),
            Step("Effects tried, round 1", "What each leaves.", ("effect", "form", "left"),
                 (("Coulomb friction", "dahl", "-0.19"),)),
        ),
        extended=device, gain=(0.9, 0.96),
        # the report itself puts the worst first
        traces=(trace("small", 5.0, True), trace("large", 30.0, False), trace("none", 0.1, False)),
        consequence=Consequence(
            "two storeys, a pulse", "Scaled 10 times.", "It chooses on_off.",
            {"on_off": {"predicted": Performance(0.0123456, 1.5, 0.5, 1),
                        "actual": Performance(0.02, 2.0, 0.75, 2), "redesigned": None}},
            ("Beyond what was tested.",),
        ),
    )  # fmt: skip


def test_the_sections_are_in_order(diagnosis):
    page = diagnosis_report(diagnosis, "law = 'kelvin_voigt'")
    assert [section.title for section in page.sections] == [
        "Verdict", "Measured against simulated", "Errors by run", "Steps of the diagnosis",
        "Causes", "Extended law", "Gain", "Next test", "Consequence for control",
        "Inputs and versions", "References",
    ]  # fmt: skip
    text = page.html().replace("\u00a0", " ")
    for expected_text in (
        "Kelvin-Voigt has an RMS error of 25 % on held-out data; noise alone causes 1.1 %.",
        "Explained by Coulomb friction: with it the error is 1.3 %; 2 % of the misfit remains",
        "25 (24.5 to 25.5)", "0.0001 (8e-05 to 0.00012)",
        "cannot distinguish coulomb_friction from",
        "velocity alone", "-0.19", "90 to 96", "Test at 4 mm and 2 Hz.", "12.3", "-38",
        "It chooses on_off.", "P. R. Dahl",
        "law = &#39;kelvin_voigt&#39;",
    ):  # fmt: skip
        assert expected_text in text, expected_text
    wrong = next(s for s in page.sections if s.title == "Errors by run")
    assert any(getattr(b, "caption", "") == "Dependence of the residual" for b in wrong.blocks)


def test_the_runs_are_drawn_as_they_are_the_worst_first(diagnosis, figures, unpacked):
    drawn = figures(diagnosis_report(diagnosis).html())
    loops = list(drawn)[:3]
    assert [title.split(":")[0].split(",")[0] for title in loops] == ["large", "small", "none"]
    small, large, _ = diagnosis.traces
    for title, run in zip(loops, (large, small), strict=False):
        for line in drawn[title]["data"]:
            expected = getattr(run, line["name"])[-1200:]
            np.testing.assert_allclose(unpacked(line["y"]), expected, rtol=1e-6, atol=1e-9)
    residual = next(f for title, f in drawn.items() if title.startswith("Residual, large"))
    before, after = (unpacked(line["y"]) for line in residual["data"])
    np.testing.assert_allclose(before, large.before - large.measured, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(after, 0.5, rtol=1e-5)


def test_errors_of_runs_stand_beside_the_noise_floor(diagnosis, figures, unpacked):
    drawn = figures(diagnosis_report(diagnosis).html())
    chart = next(f for title, f in drawn.items() if title.startswith("Residual over"))
    before, after, floor = chart["data"]
    assert before["ids"] == ["large", "small", "none"]
    runs = {each.name: each for each in diagnosis.traces}
    for line, simulated in ((before, "before"), (after, "after")):
        expected = [
            100 * np.std(getattr(runs[n], simulated) - runs[n].measured, mean=0.0)
            / np.std(runs[n].measured, mean=0.0)
            for n in line["ids"]
        ]  # fmt: skip
        np.testing.assert_allclose(unpacked(line["x"]), expected, rtol=1e-5)
    np.testing.assert_allclose(unpacked(floor["x"]), 1.1, rtol=1e-6)


def test_a_run_over_time_shows_its_strongest_seconds():
    time = np.arange(4000) / 100
    signal = np.where((time >= 20) & (time < 24), 5.0, 0.1)
    run = Trace("a", True, time, time, "time, s", "acceleration, m/s²", signal, signal, signal)
    (panel,) = loops([run])
    for x, y in panel.lines.values():
        assert x[-1] - x[0] == pytest.approx(STRONGEST) and np.sum(y == 5.0) == 400


def test_a_simulation_is_drawn_from_where_it_counts():
    """What is before depends on how the run began; a spike there would hide the rest."""
    time = np.arange(1000) / 100
    measured = np.sin(2 * np.pi * time)
    simulated = np.where(time < 2, 50.0, measured)
    run = Trace("a", False, time, measured, "deformation, mm", "force, N", measured, simulated,
                simulated, settled=200)  # fmt: skip
    (signal,), (residual,) = histories([run]), histories([run], residual=True)
    assert signal.lines["measured"][0][0] == 0.0 and signal.lines["after"][0][0] == 2.0
    assert np.max(np.abs(residual.lines["before"][1])) == 0.0
    (loop,) = loops([run])
    assert np.max(np.abs(loop.lines["after"][1])) <= 1.0


def test_equations_are_those_that_are_computed():
    text = equations(effect("coulomb_friction", "dahl"))
    assert "z' = (v - |v| z) / length" in text
    assert "def dahl(" in text and "def rates_dahl(" in text and "def smooth(" not in text
    law = equations(iso.law("strain_stiffening").law)
    assert "return k1 * y + alpha * z**3" in law and "def rates(" in law


def test_an_adequate_model_has_a_short_report(diagnosis):
    adequate = replace(
        diagnosis, verdict="adequate", causes=(), traces=(), extended=None, gain=None,
        depends_on=(), next_test=None, consequence=None, noise_floor=float("nan"),
        error_before=Errors(0.012, float("nan")), error_after=Errors(0.012, float("nan")),
        steps=diagnosis.steps[:1],
    )  # fmt: skip
    page = diagnosis_report(adequate)
    titles = [section.title for section in page.sections]
    assert titles == ["Verdict", "Steps of the diagnosis", "Gain", "Inputs and versions"]
    text = page.html().replace("\u00a0", " ")
    assert "an RMS error of 1.2 % on the fitted data." in text and "no effect is missing" in text
    assert "nan" not in text and "Plotly, Inc." not in text


def test_rounds_that_begin_alike_are_reported_once(diagnosis):
    rounds = tuple(
        Step(f"Effects tried, round {k}", "What each leaves:", ("effect", "left"), (("a", "1"),))
        for k in (1, 2)
    )
    text = diagnosis_report(replace(diagnosis, steps=rounds)).html()
    assert text.count("What each leaves:") == 1
    assert "round 1" in text and "round 2" in text


@pytest.fixture(scope="module")
def report(diagnosis, tmp_path_factory):
    """The report as a file."""
    path = tmp_path_factory.mktemp("report") / "report.html"
    return diagnosis_report(diagnosis, "law").write(path)


def test_the_tables_fit_on_paper(report, shown):
    page = shown(report, width=688)
    page.emulate_media(media="print")
    widths = page.evaluate("[...document.querySelectorAll('table')].map((t) => t.offsetWidth)")
    assert len(widths) > 4 and max(widths) <= 688


def test_the_folder_says_what_is_in_it(diagnosis, tmp_path):
    written = diagnosis.save(tmp_path)
    assert {path.name for path in written} == {path.name for path in tmp_path.iterdir()}
    lines = (tmp_path / "README.txt").read_text()
    assert all(path.name in lines for path in written if path.name != "README.txt")
    section = (tmp_path / "extended_law.toml").read_text()
    assert 'name = "coulomb_friction"' in section
    assert "[[isolator.effect]]" in (tmp_path / "report.html").read_text()


def test_the_report_is_operated(report, shown, until, cut_off):
    assert report.stat().st_size < MOST
    page = shown(report, width=390)
    assert cut_off(page) == []
    page.set_viewport_size({"width": 1400, "height": 900})
    until(page, "[...document.querySelectorAll('.plot')].some("
                "(plot) => plot._fullLayout.width > 1000)")  # fmt: skip
    assert cut_off(page) == []
    page.locator(".filters select").select_option("held out")
    assert page.locator(".filters output").inner_text() == "1 of 3 rows"
    # points of the runs that are not chosen fade
    until(page, "[...document.querySelectorAll('.plot')].some("
                "(plot) => JSON.stringify(plot.data[0].selectedpoints) === '[1]')")  # fmt: skip
    page.locator("[data-line=before]").uncheck()
    shown = (
        "[...document.querySelectorAll('.plot')].flatMap((plot) => plot._fullData)"
        ".filter((line) => line.meta === 'before' && line.visible === true).length"
    )
    until(page, f"{shown} === 0")
    # the times of different runs have nothing to do with each other
    assert page.locator(".timerange, .plot[data-link=time]").count() == 0
    listing = page.locator("details").last
    listing.locator("summary").click()
    assert listing.locator("pre").inner_text() == "law"
